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


def _ctype(node: ast_nodes.ValueType | ast_nodes.PointerType | ast_nodes.ArrayType) -> type:
    """C type (``ctypes``) of a field in MuJoCo's description of its structures."""
    if isinstance(node, ast_nodes.PointerType):
        return ctypes.c_void_p
    if isinstance(node, ast_nodes.ArrayType):
        kind = _ctype(node.inner_type)
        for extent in reversed(node.extents):
            kind = kind * extent
        return kind
    if isinstance(node, ast_nodes.AnonymousStructDecl):
        return _structure(node.fields)
    if node.name in structs.STRUCTS:
        return layout(node.name)
    if node.name in enums.ENUMS:
        return ctypes.c_int
    return _SCALARS[node.name]


def _structure(fields: tuple) -> type:
    """``ctypes.Structure`` with these fields of MuJoCo's description."""
    pairs = [(field.name, _ctype(field.type)) for field in fields]
    return type("Layout", (ctypes.Structure,), {"_fields_": pairs})


@cache
def layout(name: str) -> type:
    """``ctypes.Structure`` of a MuJoCo structure, for example ``mjData``."""
    return _structure(structs.STRUCTS[name].fields)


def offset(structure: str, field: str) -> int:
    """Offset (bytes) of a field within a MuJoCo structure."""
    return getattr(layout(structure), field).offset


def offsets(*fields: str) -> list[int]:
    """Offsets (bytes) of fields by their names: ``numeric_data`` within MuJoCo's model, all others within its data."""
    return [offset("mjModel" if field == "numeric_data" else "mjData", field) for field in fields]


def check_offsets(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Compare computed offsets with the addresses of MuJoCo's arrays in Python; raises RuntimeError on a mismatch."""
    arrays = (("mjModel", model, ("numeric_data", "qpos0")), ("mjData", data, ("qfrc_passive", "qvel", "qpos")))
    for structure, owner, fields in arrays:
        for field in fields:
            pointer = ctypes.c_void_p.from_address(owner._address + offset(structure, field))
            if pointer.value != getattr(owner, field).ctypes.data:
                raise RuntimeError(
                    f"MuJoCo {mujoco.__version__}: {structure}.{field} is not where its description says"
                )
