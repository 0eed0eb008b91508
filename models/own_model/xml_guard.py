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
class ModelXml:
    """A checked model file. path; kind : "MJCF" or "URDF"; elements : of the file and all that it includes, in their
    order; urdf : of a URDF, the text that MuJoCo gets."""

    path: Path
    kind: str
    elements: tuple[XmlElement, ...]
    urdf: UrdfText | None = None

    def line(self, tags: tuple[str, ...], element_name: str) -> str:
        """Position "FILE:LINE" of the first element with one of the tags and the name; "" if there is none."""
        for element in self.elements:
            if element.tag in tags and element.attributes.get("name") == element_name:
                return f"{element.file}:{element.line}"
        return ""

    def line_of_attribute(self, xml_tag: str, attribute: str) -> str:
        """Position "FILE:LINE" of the first element with this tag that has an attribute; "" if there is none."""
        there = (each for each in self.elements if each.tag == xml_tag and attribute in each.attributes)
        return next((f"{each.file}:{each.line}" for each in there), "")


@dataclass
class _XmlReader:
    path: Path
    elements: list[XmlElement] = field(default_factory=list)
    enclosing_tags: list[str] = field(default_factory=list)

    def read(self, file_content: bytes) -> list[XmlElement]:
        parser = self._parser = expat.ParserCreate()
        parser.StartElementHandler, parser.EndElementHandler = self._start, self._end
        parser.StartDoctypeDeclHandler = self._refuse_types
        try:
            parser.Parse(file_content, True)
        except expat.ExpatError as error:
            what = expat.ErrorString(error.code)
            raise InputError(self.path.name, f"line {error.lineno}", None, f"is no well-formed XML: {what}") from None
        except (ValueError, LookupError) as error:
            raise InputError(self.path.name, f"line {parser.CurrentLineNumber}", None, f"is no XML: {error}") from None
        return self.elements

    def _start(self, xml_tag: str, attributes: dict[str, str]) -> None:
        line = self._parser.CurrentLineNumber
        self.elements.append(XmlElement(xml_tag, attributes, self.path.name, line, tuple(self.enclosing_tags)))
        self.enclosing_tags.append(xml_tag)

    def _end(self, xml_tag: str) -> None:
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


def checked_document(model_path: Path, allowed_folder: Path | None = None) -> ModelXml:
    """Elements of a model file after checks. Raises InputError for content that must not reach the parser.

    allowed_folder : in which all files must lie that the model names; its own if None.
    """
    base = model_path.resolve().parent
    allowed, elements = base if allowed_folder is None else allowed_folder.resolve(), list[XmlElement]()
    if not base.is_relative_to(allowed):
        raise InputError("--folder", "", str(allowed_folder), f"must be a folder that holds {model_path}")
    content = _file_content(model_path)
    root = _XmlReader(model_path).read(content)[0]
    if root.tag not in FORMAT_OF_ROOT:
        part = f": <{PART_ROOT}> is a part of other models: give the model that includes it"
        told = f"must be <mujoco> (MJCF) or <robot> (URDF){part if root.tag == PART_ROOT else ''}"
        raise InputError(model_path.name, f"line {root.line}", f"<{root.tag}>", told)
    urdf = text_for_mujoco(content) if FORMAT_OF_ROOT[root.tag] == "URDF" else None
    folders = _Folders(allowed, base, [])
    _read_elements(model_path, urdf.text.encode() if urdf else content, folders, elements, 0)
    _check_assets(folders)
    return ModelXml(model_path, FORMAT_OF_ROOT[root.tag], tuple(elements), urdf)


def _file_content(xml_path: Path) -> bytes:
    try:
        if xml_path.stat().st_size > LARGEST_FILE:
            raise InputError(
                str(xml_path), "", xml_path.stat().st_size, f"bytes: a model may have {LARGEST_FILE} at the most"
            )
        return xml_path.read_bytes()
    except OSError as error:
        raise InputError(str(xml_path), "", None, f"cannot be read: {error.strerror or error}") from None


def _read_model(xml_path: Path, include_folders: _Folders, elements: list[XmlElement], include_depth: int) -> None:
    """Read a model with all that it includes, and check where the files of its meshes and pictures lie."""
    _read_elements(xml_path, _file_content(xml_path), include_folders, elements, include_depth)
    _check_assets(include_folders)


def _read_elements(
    xml_path: Path, file_content: bytes, include_folders: _Folders, elements: list[XmlElement], include_depth: int
) -> None:
    for element in _XmlReader(xml_path).read(file_content):
        elements.append(element)
        include_folders.elements.append(element)
        place = f"line {element.line}"
        if element.tag in PLUGIN_TAGS or "plugin" in element.attributes:
            raise InputError(xml_path.name, place, f"<{element.tag}>", "plugins are code: none is loaded")
        if element.tag in ("include", "model") and "file" in element.attributes:
            _read_included(xml_path, include_folders, element, elements, include_depth)
        _check_counts(xml_path, element, place)


def _read_included(
    xml_path: Path, include_folders: _Folders, element: XmlElement, elements: list[XmlElement], include_depth: int
) -> None:
    """Read a file that an element includes or attaches. Raises InputError if it lies outside the allowed folder."""
    name, place = element.attributes["file"], f"line {element.line}"
    target = (include_folders.model_folder / name).resolve()
    if not target.is_relative_to(include_folders.allowed_folder):
        raise InputError(xml_path.name, place, name, _outside_text(element, include_folders, target))
    if not target.is_file():
        raise InputError(xml_path.name, place, name, f"<{element.tag}> names a file that is not there: {target}")
    if include_depth >= DEEPEST_INCLUDE:
        raise InputError(xml_path.name, place, name, f"includes go {DEEPEST_INCLUDE} deep at the most")
    if element.tag == "model":
        _read_model(target, _Folders(include_folders.allowed_folder, target.parent, []), elements, include_depth + 1)
    else:
        _read_elements(target, _file_content(target), include_folders, elements, include_depth + 1)


def _outside_text(element: XmlElement, include_folders: _Folders, outside_path: Path) -> str:
    """Text on the folder that is allowed in place of an outside file, and the option that allows this file."""
    both = Path(os.path.commonpath((include_folders.allowed_folder, outside_path.parent)))
    option = f"; if all below {both} may be read: `--folder {both}`" if both != Path(both.anchor) else ""
    return f"<{element.tag}> must name a file in the folder of the model{option}"


def _check_assets(include_folders: _Folders) -> None:
    """Raise InputError for a mesh or picture file outside the allowed folder, in any folder that a <compiler> names."""
    compilers = [element.attributes for element in include_folders.elements if element.tag == "compiler"]
    urdf = include_folders.elements[0].tag == "robot"
    strips = any(_strips_paths(compiler, urdf) for compiler in compilers or [{}])
    for element in (element for element in include_folders.elements if element.tag in ASSET_FOLDERS):
        keys = (ASSET_FOLDERS[element.tag], "assetdir")
        within = {compiler[key] for compiler in compilers for key in keys if key in compiler} or {""}
        names = [name for key, name in element.attributes.items() if key.startswith("file")]
        names = [Path(name).name for name in names] if strips else names
        for path in (Path(folder) / name for name in names for folder in within):
            target = (include_folders.model_folder / path).resolve()
            if not target.is_relative_to(include_folders.allowed_folder):
                told = _outside_text(element, include_folders, target)
                raise InputError(element.file, f"line {element.line}", str(path), told)


def _strips_paths(compiler_attributes: dict[str, str], is_urdf: bool) -> bool:
    """Whether MuJoCo drops the folders from the names of files, as it does in a URDF unless told otherwise."""
    return compiler_attributes.get("strippath", str(is_urdf).lower()) == "true"


def _check_counts(xml_path: Path, element: XmlElement, element_place: str) -> None:
    if element.tag not in ("replicate", "composite", "flexcomp", "size"):
        return
    if element.tag == "size":
        for name in ("memory", "nstack", "njmax", "nconmax", "nuserdata"):
            if name in element.attributes and not _memory_is_modest(element.attributes[name]):
                raise InputError(
                    xml_path.name, element_place, element.attributes[name], f"<size> asks for too much {name}"
                )
        return
    product = 1.0
    for text in element.attributes.get("count", "1").split():
        try:
            product *= max(1.0, abs(float(text)))
        except ValueError:
            raise InputError(xml_path.name, element_place, text, "count must be whole numbers") from None
    if not product <= LARGEST_COPY_COUNT:
        raise InputError(
            xml_path.name, element_place, element.attributes["count"], f"asks for more than {LARGEST_COPY_COUNT} copies"
        )


def _memory_is_modest(memory_text: str) -> bool:
    """Whether an amount of memory, in MuJoCo's notation such as 100M, is below 4 GB."""
    units = {"K": 2**10, "M": 2**20, "G": 2**30, "T": 2**40, "P": 2**50, "E": 2**60}
    number, unit = (
        (memory_text[:-1], units[memory_text[-1:].upper()]) if memory_text[-1:].upper() in units else (memory_text, 1)
    )
    try:
        return float(number) * unit <= 4 * 2**30
    except ValueError:
        return True  # MuJoCo's parser says what is wrong with it
