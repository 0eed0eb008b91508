"""Byte offsets of fields in MuJoCo's C structures, from MuJoCo's own description of itself.

A compiled callback receives bare pointers; the offsets differ from version to version, so they are
computed from ``mujoco.introspect`` and checked against the addresses of the bound arrays.
"""

import ctypes
from functools import cache

import mujoco
from mujoco.introspect import ast_nodes, enums, structs

_SCALARS = {
    "mjtNum": ctypes.c_double,
    "mjtByte": ctypes.c_ubyte,
    "mjtBool": ctypes.c_ubyte,
    "mjtSize": ctypes.c_int64,
    "double": ctypes.c_double,
    "float": ctypes.c_float,
    "int": ctypes.c_int,
    "unsigned int": ctypes.c_uint,
    "char": ctypes.c_char,
    "size_t": ctypes.c_size_t,
    "uint64_t": ctypes.c_uint64,
    "uintptr_t": ctypes.c_size_t,
}
"""C type of each scalar type that MuJoCo's description names."""


def _ctype(field_type: ast_nodes.ValueType | ast_nodes.PointerType | ast_nodes.ArrayType) -> type:
    """C type (``ctypes``) of a field in MuJoCo's description of its structures."""
    if isinstance(field_type, ast_nodes.PointerType):
        return ctypes.c_void_p
    if isinstance(field_type, ast_nodes.ArrayType):
        kind = _ctype(field_type.inner_type)
        for extent in reversed(field_type.extents):
            kind = kind * extent
        return kind
    if isinstance(field_type, ast_nodes.AnonymousStructDecl):
        return _structure(field_type.fields)
    if field_type.name in structs.STRUCTS:
        return layout(field_type.name)
    if field_type.name in enums.ENUMS:
        return ctypes.c_int
    return _SCALARS[field_type.name]


def _structure(structure_fields: tuple) -> type:
    """``ctypes.Structure`` with these fields of MuJoCo's description."""
    pairs = [(field.name, _ctype(field.type)) for field in structure_fields]
    return type("Layout", (ctypes.Structure,), {"_fields_": pairs})


@cache
def layout(structure_name: str) -> type:
    """``ctypes.Structure`` of a MuJoCo structure, for example ``mjData``."""
    return _structure(structs.STRUCTS[structure_name].fields)


def offset(structure_name: str, field_name: str) -> int:
    """Offset (bytes) of a field within a MuJoCo structure."""
    return getattr(layout(structure_name), field_name).offset


def offsets(*field_names: str) -> list[int]:
    """Offsets (bytes) of fields by their names: ``numeric_data`` within MuJoCo's model, all others within its data."""
    return [offset("mjModel" if field == "numeric_data" else "mjData", field) for field in field_names]


def check_offsets(mujoco_model: mujoco.MjModel, mujoco_data: mujoco.MjData) -> None:
    """Compare computed offsets with the addresses of MuJoCo's arrays in Python; raises RuntimeError on a mismatch."""
    arrays = (
        ("mjModel", mujoco_model, ("numeric_data", "qpos0")),
        ("mjData", mujoco_data, ("qfrc_passive", "qvel", "qpos")),
    )
    for structure, owner, fields in arrays:
        for field in fields:
            pointer = ctypes.c_void_p.from_address(owner._address + offset(structure, field))
            if pointer.value != getattr(owner, field).ctypes.data:
                raise RuntimeError(
                    f"MuJoCo {mujoco.__version__}: {structure}.{field} is not where its description says"
                )
