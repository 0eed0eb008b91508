"""What a file of a model may ask of the parser, looked at before MuJoCo sees it; nothing in a file is executed.

Refused, with the line: what is no XML, document types and entities, plugins, includes, attached models, meshes and
pictures outside the file's folder, and counts that no machine could hold.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple
from xml.parsers import expat

from models.core.errors import InputError

LARGEST_FILE = 20_000_000
"""Bytes of a file."""
DEEPEST_INCLUDE = 8
"""Includes within includes."""
MOST_COPIES = 2000
"""Copies that one element may ask for (replicate, composite, flexcomp): more is a mistake, or an attack."""
FORMAT_OF_ROOT = {"mujoco": "MJCF", "mujocoinclude": "MJCF", "robot": "URDF"}
PLUGIN_TAGS = ("plugin", "extension")
ASSETS = {"mesh": "meshdir", "hfield": "meshdir", "texture": "texturedir", "skin": "meshdir"}
"""Elements that name files, by the attribute of <compiler> with the folder of these files."""


@dataclass(frozen=True)
class XmlElement:
    """An element: tag, attributes, and its location: file, line, and the enclosing tags, outermost first."""

    tag: str
    attributes: dict[str, str]
    file: str
    line: int
    enclosing_tags: tuple[str, ...]


@dataclass(frozen=True)
class Document:
    """path; kind : "MJCF" or "URDF"; elements : of the file and all that it includes, in their order."""

    path: Path
    kind: str
    elements: tuple[XmlElement, ...]

    def line(self, tags: tuple[str, ...], name: str) -> str:
        """Position "FILE:LINE" of the first element with one of the tags and the name; "" if there is none."""
        for element in self.elements:
            if element.tag in tags and element.attributes.get("name") == name:
                return f"{element.file}:{element.line}"
        return ""


@dataclass
class _Reader:
    path: Path
    elements: list[XmlElement] = field(default_factory=list)
    around: list[str] = field(default_factory=list)

    def read(self, content: bytes) -> list[XmlElement]:
        parser = self._parser = expat.ParserCreate()
        parser.StartElementHandler, parser.EndElementHandler = self._start, self._end
        parser.StartDoctypeDeclHandler = self._refuse_types
        try:
            parser.Parse(content, True)
        except expat.ExpatError as error:
            what = expat.ErrorString(error.code)
            raise InputError(self.path.name, f"line {error.lineno}", None, f"is no well-formed XML: {what}") from None
        except (ValueError, LookupError) as error:
            raise InputError(self.path.name, f"line {parser.CurrentLineNumber}", None, f"is no XML: {error}") from None
        return self.elements

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        line = self._parser.CurrentLineNumber
        self.elements.append(XmlElement(tag, attributes, self.path.name, line, tuple(self.around)))
        self.around.append(tag)

    def _end(self, tag: str) -> None:
        self.around.pop()

    def _refuse_types(self, *_: Any) -> None:
        place = f"line {self._parser.CurrentLineNumber}"
        raise InputError(self.path.name, place, "DOCTYPE", "document types and entities are not read")


class _Folders(NamedTuple):
    """Folders of included files. allowed : folder that must contain all of them; base : folder in which MuJoCo looks
    for them, that of the model file, not of the including file; an attached model has its own; elements : of the files
    with this base."""

    allowed: Path
    base: Path
    elements: list[XmlElement]


def checked_document(path: Path) -> Document:
    """The file's elements, after checks; InputError for content that must not reach the parser."""
    folder, elements = path.resolve().parent, list[XmlElement]()
    _read_model(path, _Folders(folder, folder, []), elements, 0)
    root = elements[0].tag
    if root not in FORMAT_OF_ROOT:
        allowed = "must be <mujoco> (MJCF) or <robot> (URDF)"
        raise InputError(path.name, f"line {elements[0].line}", f"<{root}>", allowed)
    return Document(path, FORMAT_OF_ROOT[root], tuple(elements))


def _file_content(path: Path) -> bytes:
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise InputError(str(path), "", path.stat().st_size, f"bytes: a model may have {LARGEST_FILE} at the most")
        return path.read_bytes()
    except OSError as error:
        raise InputError(str(path), "", None, f"cannot be read: {error.strerror or error}") from None


def _read_model(path: Path, folders: _Folders, elements: list[XmlElement], depth: int) -> None:
    """Read a model with all that it includes, and look where the files of its meshes and pictures lie."""
    _read_elements(path, folders, elements, depth)
    _check_assets(folders)


def _read_elements(path: Path, folders: _Folders, elements: list[XmlElement], depth: int) -> None:
    for element in _Reader(path).read(_file_content(path)):
        elements.append(element)
        folders.elements.append(element)
        place = f"line {element.line}"
        if element.tag in PLUGIN_TAGS or "plugin" in element.attributes:
            raise InputError(path.name, place, f"<{element.tag}>", "plugins are code: none is loaded")
        if element.tag in ("include", "model") and "file" in element.attributes:
            _read_included(path, folders, element, elements, depth)
        _check_counts(path, element, place)


def _read_included(path: Path, folders: _Folders, element: XmlElement, elements: list[XmlElement], depth: int) -> None:
    """Read a file that an element includes or attaches; InputError if it lies outside the allowed folder."""
    name, place = element.attributes["file"], f"line {element.line}"
    target = (folders.base / name).resolve()
    if not target.is_relative_to(folders.allowed):
        raise InputError(path.name, place, name, f"<{element.tag}> must name a file in the folder of the model")
    if depth >= DEEPEST_INCLUDE:
        raise InputError(path.name, place, name, f"includes go {DEEPEST_INCLUDE} deep at the most")
    if element.tag == "model":
        _read_model(target, _Folders(folders.allowed, target.parent, []), elements, depth + 1)
    else:
        _read_elements(target, folders, elements, depth + 1)


def _check_assets(folders: _Folders) -> None:
    """InputError for a file of a mesh or a picture outside the allowed folder, in any folder that a <compiler> says."""
    compilers = [element.attributes for element in folders.elements if element.tag == "compiler"]
    for element in (element for element in folders.elements if element.tag in ASSETS):
        keys = (ASSETS[element.tag], "assetdir")
        within = {compiler[key] for compiler in compilers for key in keys if key in compiler} or {""}
        names = [name for key, name in element.attributes.items() if key.startswith("file")]
        for path in (Path(folder) / name for name in names for folder in within):
            if not (folders.base / path).resolve().is_relative_to(folders.allowed):
                told = f"<{element.tag}> must name a file in the folder of the model"
                raise InputError(element.file, f"line {element.line}", str(path), told)


def _check_counts(path: Path, element: XmlElement, place: str) -> None:
    if element.tag not in ("replicate", "composite", "flexcomp", "size"):
        return
    if element.tag == "size":
        for name in ("memory", "nstack", "njmax", "nconmax", "nuserdata"):
            if name in element.attributes and not _memory_is_modest(element.attributes[name]):
                raise InputError(path.name, place, element.attributes[name], f"<size> asks for too much {name}")
        return
    product = 1.0
    for text in element.attributes.get("count", "1").split():
        try:
            product *= max(1.0, abs(float(text)))
        except ValueError:
            raise InputError(path.name, place, text, "count must be whole numbers") from None
    if not product <= MOST_COPIES:
        raise InputError(path.name, place, element.attributes["count"], f"asks for more than {MOST_COPIES} copies")


def _memory_is_modest(text: str) -> bool:
    """Whether an amount of memory, in MuJoCo's notation such as 100M, is below 4 GB."""
    units = {"K": 2**10, "M": 2**20, "G": 2**30, "T": 2**40, "P": 2**50, "E": 2**60}
    number, unit = (text[:-1], units[text[-1:].upper()]) if text[-1:].upper() in units else (text, 1)
    try:
        return float(number) * unit <= 4 * 2**30
    except ValueError:
        return True  # MuJoCo's parser says what is wrong with it
