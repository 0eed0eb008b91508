"""Export of an assembled Exudyn system as a Python script that builds it again with Exudyn and numpy alone.

The script is read off the system: its nodes, its objects and loads, and the markers that these need, each with the
values that are not Exudyn's defaults. Functions in Python do not leave the process: an item whose law is a function is
left out, and an item that a function adds to stays without it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import exudyn as exu
import numpy as np

from models.engines.exudyn_system import items

ITEMS_WITH_ADDED_FORCE = ("ObjectKinematicTree", "ObjectGenericODE2")
"""Classes of Exudyn items whose user function adds a force to their own."""
ADDED_FORCE_REMARK = ": what the road adds, which is flat here"
"""Remark behind the name of an item whose user function is left out."""
FUNCTION_SUFFIX, DERIVED_SUFFIXES = "UserFunction", ("HT", "HTs")
"""Endings of the keys of functions, and of keys that Exudyn derives from other values."""
REFERENCES = {"nodeNumber": "node", "markerNumber": "marker", "bodyNumber": "object", "objectNumber": "object"}
"""Kind of item to which a key refers, with one number or several."""
SCRIPT_TEMPLATE = '''"""{comment}"""

import exudyn as exu
import exudyn.itemInterface as items
import numpy as np

COORDINATES = {coordinates}
"""Place of every coordinate of the vehicle in the vectors of Exudyn."""


def build():
    """The assembled system."""
    mbs = exu.SystemContainer().AddSystem()
{lines}
    mbs.Assemble()
    return mbs


def accelerations(mbs, q, v):
    """Accelerations at coordinates and their rates, all in the order of Exudyn."""
    mbs.systemData.SetODE2Coordinates(q, exu.ConfigurationType.Initial)
    mbs.systemData.SetODE2Coordinates_t(v, exu.ConfigurationType.Initial)
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    solver = exu.MainSolverImplicitSecondOrder()
    solver.InitializeSolver(mbs, settings)
    solver.ComputeMassMatrix(mbs)
    solver.ComputeODE2RHS(mbs)
    size = solver.GetODE2size()
    mass, force = solver.GetSystemMassMatrix()[:size, :size], solver.GetSystemResidual()[:size]
    solver.FinalizeSolver(mbs, settings)
    return np.linalg.solve(mass, force)


if __name__ == "__main__":
    system = build()
    rest = np.zeros(len(system.systemData.GetODE2Coordinates()))
    found = accelerations(system, rest, rest)
    for name, place in COORDINATES.items():
        print(f"{{name}}: acceleration at rest {{found[place]:.6g}}")
'''


def python_script(mbs: Any, coordinate_indices: dict[str, int], head_comment: str) -> str:
    """Text of a Python script that builds an assembled Exudyn system.

    coordinate_indices : place of every coordinate in Exudyn's vectors, by its name; head_comment : for people, at its
    head."""
    lines = _ScriptWriter(mbs).script_lines()
    text = head_comment.replace("\\", "/").replace('"""', "'''")
    return SCRIPT_TEMPLATE.format(comment=text, coordinates=coordinate_indices, lines="\n".join(lines))


def item_counts(mbs: Any) -> Sequence[str]:
    """Texts with the numbers of nodes, objects, markers and loads that the exported script builds."""
    writer = _ScriptWriter(mbs)
    writer.script_lines()
    return [f"{count} {kind}s" for kind, count in writer.counts.items() if count]


def items_with_functions(mbs: Any) -> tuple[str, ...]:
    """Names of the items that an exported script lacks because their law is a function, and of those whose added force
    it lacks."""
    writer, data = _ScriptWriter(mbs), mbs.systemData
    places = [("object", i) for i in range(data.NumberOfObjects())] + [("load", i) for i in range(data.NumberOfLoads())]
    acting = (
        (kind, item) for kind, item in ((kind, writer.item(kind, i)) for kind, i in places) if _has_force_function(item)
    )
    return tuple(
        f"{item['name']}{ADDED_FORCE_REMARK if _class_name(kind, item) in ITEMS_WITH_ADDED_FORCE else ''}"
        for kind, item in acting
    )


def _has_force_function(exudyn_item: dict[str, Any]) -> bool:
    """Whether an item calls a user function for its forces."""
    return any(key.endswith(FUNCTION_SUFFIX) and value for key, value in exudyn_item.items() if not key.startswith("V"))


@dataclass
class _ScriptWriter:
    """Writer of the script lines that rebuild an Exudyn system. Each item is written once, before the first item that
    refers to it."""

    mbs: Any
    lines: list[str] = field(default_factory=list)
    written: set[str] = field(default_factory=set)
    counts: dict[str, int] = field(default_factory=lambda: {"node": 0, "object": 0, "marker": 0, "load": 0})

    def script_lines(self) -> list[str]:
        """All lines of the script; nodes come first, so that coordinates keep their order."""
        data = self.mbs.systemData
        for kind, count in (
            ("node", data.NumberOfNodes()),
            ("object", data.NumberOfObjects()),
            ("load", data.NumberOfLoads()),
        ):
            for number in range(count):
                if not self._by_function(kind, number):
                    self.variable_of(kind, number)
        return self.lines

    def item(self, item_kind: str, item_index: int) -> dict[str, Any]:
        """Exudyn's dictionary that describes an item."""
        item: dict[str, Any] = getattr(self.mbs, f"Get{item_kind.capitalize()}")(item_index)
        return item

    def _by_function(self, item_kind: str, item_index: int) -> bool:
        """Whether the law of an item is given by a function, so that the item cannot be exported."""
        item = self.item(item_kind, item_index)
        return _has_force_function(item) and _class_name(item_kind, item) not in ITEMS_WITH_ADDED_FORCE

    def variable_of(self, item_kind: str, item_index: int) -> str:
        """Name of the script's variable for an item; the item is written now if it has not been."""
        variable = f"{item_kind}{item_index}"
        if variable not in self.written:
            self.written.add(variable)
            item = self.item(item_kind, item_index)
            arguments = dict(self._arguments(item_kind, item))
            if arguments.get("name") == repr(variable):  # which Exudyn gives what has none
                del arguments["name"]
            made = (
                f"items.{_class_name(item_kind, item)}({', '.join(f'{key}={text}' for key, text in arguments.items())})"
            )
            self.lines.append(f"    {variable} = mbs.Add{item_kind.capitalize()}({made})")
            self.counts[item_kind] += 1
        return variable

    def _arguments(self, item_kind: str, exudyn_item: dict[str, Any]) -> Iterator[tuple[str, str]]:
        """Names and texts of an item's arguments that differ from Exudyn's defaults."""
        usual = dict(getattr(items, _class_name(item_kind, exudyn_item))())
        for key, value in exudyn_item.items():
            referred = REFERENCES.get(key.removesuffix("s"))
            if key not in usual or key.startswith("V") or key.endswith((FUNCTION_SUFFIX, *DERIVED_SUFFIXES)):
                continue
            if referred and key in REFERENCES:
                if int(value) >= 0:
                    yield key, self.variable_of(referred, int(value))
            elif referred:
                yield key, f"[{', '.join(self.variable_of(referred, int(each)) for each in value)}]"
            elif (text := _python_text(value)) not in (_python_text(usual[key]), "[]"):
                yield key, text


def _class_name(item_kind: str, exudyn_item: dict[str, Any]) -> str:
    """Name of an item's class in exudyn.itemInterface."""
    return f"{item_kind.capitalize()}{exudyn_item[f'{item_kind}Type']}"


def _python_text(script_value: Any) -> str:
    """Python text of a value in the script: matrices as arrays, Exudyn's own lists by their constructors."""
    if isinstance(script_value, exu.Vector3DList | exu.Matrix3DList):
        entries: Any = script_value  # Exudyn's type hints do not know that these are lists
        inner = ", ".join(_python_text(np.asarray(entries[i]).tolist()) for i in range(len(entries)))
        return f"exu.{type(script_value).__name__}([{inner}])" if len(entries) else "[]"
    if isinstance(script_value, exu.MatrixContainer):
        return _python_text(np.array(script_value.Convert2DenseMatrix()))
    if isinstance(script_value, np.ndarray):
        return (
            f"np.array({script_value.tolist()!r})"
            if script_value.ndim > 1 and script_value.size
            else repr(script_value.ravel().tolist())
        )
    if isinstance(script_value, list | tuple):
        return f"[{', '.join(map(_python_text, script_value))}]"
    if hasattr(script_value, "name") and hasattr(type(script_value), "__members__"):
        return f"exu.{type(script_value).__name__}.{script_value.name}"
    if script_value is None or isinstance(script_value, bool | int | float | str):
        return repr(script_value)
    raise TypeError(f"{type(script_value).__name__} has no text in a script")
