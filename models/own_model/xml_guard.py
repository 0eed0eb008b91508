"""Check of an XML model file before MuJoCo parses it; nothing in a file is executed.

Refused, with the line: what is no XML, document types and entities, plugins, includes, attached models, meshes and
pictures outside the file's folder, or that which the user names, and counts that no machine could hold. Of a URDF all
this is asked of the text that MuJoCo gets (``urdf_text``).
"""

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple
from xml.parsers import expat

from models.core.errors import InputError
from models.own_model.urdf_text import UrdfText, text_for_mujoco

LARGEST_FILE = 20_000_000
"""Largest size of a file in bytes."""
DEEPEST_INCLUDE = 8
"""Largest depth of includes within includes."""
LARGEST_COPY_COUNT = 2000
"""Largest count of copies that one element may ask for (replicate, composite, flexcomp): more is a mistake, or an
attack."""
FORMAT_OF_ROOT = {"mujoco": "MJCF", "robot": "URDF"}
PART_ROOT = "mujocoinclude"
"""Root tag of a file that other models include, and that is no model itself."""
PLUGIN_TAGS = ("plugin", "extension")
ASSET_FOLDERS = {"mesh": "meshdir", "hfield": "meshdir", "texture": "texturedir", "skin": "meshdir"}
"""Elements that name files, by the attribute of <compiler> with the folder of these files."""


@dataclass(frozen=True)
class XmlElement:
    """Element of an XML file: tag, attributes, and its location: file, line, and the enclosing tags, outermost
    first."""

    tag: str
    attributes: dict[str, str]
    file: str
    line: int
    enclosing_tags: tuple[str, ...]


@dataclass(frozen=True)
class Document:
    """A checked model file. path; kind : "MJCF" or "URDF"; elements : of the file and all that it includes, in their
    order; urdf : of a URDF, the text that MuJoCo gets."""

    path: Path
    kind: str
    elements: tuple[XmlElement, ...]
    urdf: UrdfText | None = None

    def line(self, tags: tuple[str, ...], name: str) -> str:
        """Position "FILE:LINE" of the first element with one of the tags and the name; "" if there is none."""
        for element in self.elements:
            if element.tag in tags and element.attributes.get("name") == name:
                return f"{element.file}:{element.line}"
        return ""

    def line_of_attribute(self, tag: str, attribute: str) -> str:
        """Position "FILE:LINE" of the first element with this tag that has an attribute; "" if there is none."""
        there = (each for each in self.elements if each.tag == tag and attribute in each.attributes)
        return next((f"{each.file}:{each.line}" for each in there), "")


@dataclass
class _Reader:
    path: Path
    elements: list[XmlElement] = field(default_factory=list)
    enclosing_tags: list[str] = field(default_factory=list)

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
        self.elements.append(XmlElement(tag, attributes, self.path.name, line, tuple(self.enclosing_tags)))
        self.enclosing_tags.append(tag)

    def _end(self, tag: str) -> None:
        self.enclosing_tags.pop()

    def _refuse_types(self, *_: Any) -> None:
        place = f"line {self._parser.CurrentLineNumber}"
        raise InputError(self.path.name, place, "DOCTYPE", "document types and entities are not read")


class _Folders(NamedTuple):
    """Folders of included files. allowed_folder : folder that must contain all of them; model_folder : folder in which
    MuJoCo looks for them, that of the model file, not of the including file (an attached model has its own); elements :
    of the files with this model folder."""

    allowed_folder: Path
    model_folder: Path
    elements: list[XmlElement]


def checked_document(path: Path, folder: Path | None = None) -> Document:
    """Elements of a model file after checks. Raises InputError for content that must not reach the parser.

    folder : in which all files must lie that the model names; its own if None.
    """
    base = path.resolve().parent
    allowed, elements = base if folder is None else folder.resolve(), list[XmlElement]()
    if not base.is_relative_to(allowed):
        raise InputError("--folder", "", str(folder), f"must be a folder that holds {path}")
    content = _file_content(path)
    root = _Reader(path).read(content)[0]
    if root.tag not in FORMAT_OF_ROOT:
        part = f": <{PART_ROOT}> is a part of other models: give the model that includes it"
        told = f"must be <mujoco> (MJCF) or <robot> (URDF){part if root.tag == PART_ROOT else ''}"
        raise InputError(path.name, f"line {root.line}", f"<{root.tag}>", told)
    urdf = text_for_mujoco(content) if FORMAT_OF_ROOT[root.tag] == "URDF" else None
    folders = _Folders(allowed, base, [])
    _read_elements(path, urdf.text.encode() if urdf else content, folders, elements, 0)
    _check_assets(folders)
    return Document(path, FORMAT_OF_ROOT[root.tag], tuple(elements), urdf)


def _file_content(path: Path) -> bytes:
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise InputError(str(path), "", path.stat().st_size, f"bytes: a model may have {LARGEST_FILE} at the most")
        return path.read_bytes()
    except OSError as error:
        raise InputError(str(path), "", None, f"cannot be read: {error.strerror or error}") from None


def _read_model(path: Path, folders: _Folders, elements: list[XmlElement], depth: int) -> None:
    """Read a model with all that it includes, and check where the files of its meshes and pictures lie."""
    _read_elements(path, _file_content(path), folders, elements, depth)
    _check_assets(folders)


def _read_elements(path: Path, content: bytes, folders: _Folders, elements: list[XmlElement], depth: int) -> None:
    for element in _Reader(path).read(content):
        elements.append(element)
        folders.elements.append(element)
        place = f"line {element.line}"
        if element.tag in PLUGIN_TAGS or "plugin" in element.attributes:
            raise InputError(path.name, place, f"<{element.tag}>", "plugins are code: none is loaded")
        if element.tag in ("include", "model") and "file" in element.attributes:
            _read_included(path, folders, element, elements, depth)
        _check_counts(path, element, place)


def _read_included(path: Path, folders: _Folders, element: XmlElement, elements: list[XmlElement], depth: int) -> None:
    """Read a file that an element includes or attaches. Raises InputError if it lies outside the allowed folder."""
    name, place = element.attributes["file"], f"line {element.line}"
    target = (folders.model_folder / name).resolve()
    if not target.is_relative_to(folders.allowed_folder):
        raise InputError(path.name, place, name, _outside_text(element, folders, target))
    if not target.is_file():
        raise InputError(path.name, place, name, f"<{element.tag}> names a file that is not there: {target}")
    if depth >= DEEPEST_INCLUDE:
        raise InputError(path.name, place, name, f"includes go {DEEPEST_INCLUDE} deep at the most")
    if element.tag == "model":
        _read_model(target, _Folders(folders.allowed_folder, target.parent, []), elements, depth + 1)
    else:
        _read_elements(target, _file_content(target), folders, elements, depth + 1)


def _outside_text(element: XmlElement, folders: _Folders, target: Path) -> str:
    """Text on the folder that is allowed in place of an outside file, and the option that allows this file."""
    both = Path(os.path.commonpath((folders.allowed_folder, target.parent)))
    option = f"; if all below {both} may be read: `--folder {both}`" if both != Path(both.anchor) else ""
    return f"<{element.tag}> must name a file in the folder of the model{option}"


def _check_assets(folders: _Folders) -> None:
    """Raise InputError for a mesh or picture file outside the allowed folder, in any folder that a <compiler> names."""
    compilers = [element.attributes for element in folders.elements if element.tag == "compiler"]
    urdf = folders.elements[0].tag == "robot"
    strips = any(_strips_paths(compiler, urdf) for compiler in compilers or [{}])
    for element in (element for element in folders.elements if element.tag in ASSET_FOLDERS):
        keys = (ASSET_FOLDERS[element.tag], "assetdir")
        within = {compiler[key] for compiler in compilers for key in keys if key in compiler} or {""}
        names = [name for key, name in element.attributes.items() if key.startswith("file")]
        names = [Path(name).name for name in names] if strips else names
        for path in (Path(folder) / name for name in names for folder in within):
            target = (folders.model_folder / path).resolve()
            if not target.is_relative_to(folders.allowed_folder):
                told = _outside_text(element, folders, target)
                raise InputError(element.file, f"line {element.line}", str(path), told)


def _strips_paths(compiler: dict[str, str], urdf: bool) -> bool:
    """Whether MuJoCo drops the folders from the names of files, as it does in a URDF unless told otherwise."""
    return compiler.get("strippath", str(urdf).lower()) == "true"


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
    if not product <= LARGEST_COPY_COUNT:
        raise InputError(
            path.name, place, element.attributes["count"], f"asks for more than {LARGEST_COPY_COUNT} copies"
        )


def _memory_is_modest(text: str) -> bool:
    """Whether an amount of memory, in MuJoCo's notation such as 100M, is below 4 GB."""
    units = {"K": 2**10, "M": 2**20, "G": 2**30, "T": 2**40, "P": 2**50, "E": 2**60}
    number, unit = (text[:-1], units[text[-1:].upper()]) if text[-1:].upper() in units else (text, 1)
    try:
        return float(number) * unit <= 4 * 2**30
    except ValueError:
        return True  # MuJoCo's parser says what is wrong with it
