"""Text of a URDF for MuJoCo's parser: links and joints without the elements that do not affect motion, every element on
its original line.

Left away is what other programs read (<gazebo> and its plugins, <transmission>), shapes that are only drawn, those of
links with masses of their own, which only contact would need and whose files are often missing, and all of links that
stand on the world. No element is executed or looked up to decide this.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from xml.etree import ElementTree
from xml.parsers import expat
from xml.sax.saxutils import quoteattr

READ_TAGS = ("link", "joint", "material", "mujoco")
"""Elements below <robot> that MuJoCo reads."""
PARTS_OF_LINKS = ("visual", "collision", "inertial")
"""Elements of links; those that do not affect motion are left out."""


@dataclass(frozen=True)
class UrdfText:
    """Text of a URDF for MuJoCo's parser, with every element on the line that it has in the file; notes : sentences on
    what was left out, and on what MuJoCo makes of the rest."""

    text: str
    notes: tuple[str, ...]


@dataclass
class _UrdfWriter:
    """Writer of the wanted elements of a URDF, each on its original line.

    fixed_links, links_with_mass : names of links that stand on the world, and that have masses; removed_tags : counts
    of elements that are left away, by tag; enclosing_tags : of the present element; link : its name; removed_depth :
    depth within an unwanted element."""

    fixed_links: frozenset[str]
    links_with_mass: frozenset[str]
    removed_tags: Counter[str] = field(default_factory=Counter)
    enclosing_tags: list[str] = field(default_factory=list)
    link: str = ""
    removed_depth: int = 0
    pieces: list[str] = field(default_factory=list)
    line: int = 1

    def write(self, file_content: bytes) -> str:
        parser = self._parser = expat.ParserCreate()
        parser.StartElementHandler, parser.EndElementHandler = self._start, self._end
        parser.Parse(file_content, True)
        return "".join(self.pieces)

    def _start(self, xml_tag: str, attributes: dict[str, str]) -> None:
        if self.enclosing_tags == ["robot"]:
            self.link = attributes.get("name", "") if xml_tag == "link" else ""
        if self.removed_depth or self._is_unwanted(xml_tag):
            self.removed_tags.update([] if self.removed_depth else [xml_tag])
            self.removed_depth += 1
            return
        line = self._parser.CurrentLineNumber
        told = "".join(f" {name}={quoteattr(value)}" for name, value in attributes.items())
        self.pieces += ["\n" * (line - self.line), f"<{xml_tag}{told}>"]
        self.line = max(line, self.line)
        self.enclosing_tags.append(xml_tag)

    def _is_unwanted(self, xml_tag: str) -> bool:
        if self.enclosing_tags == ["robot"]:
            return xml_tag not in READ_TAGS
        if self.enclosing_tags != ["robot", "link"]:
            return False
        if xml_tag == "visual" or (self.link in self.fixed_links and xml_tag in ("inertial", "collision")):
            return True
        return xml_tag == "collision" and self.link in self.links_with_mass

    def _end(self, xml_tag: str) -> None:
        if self.removed_depth:
            self.removed_depth -= 1
            return
        self.pieces.append(f"</{xml_tag}>")
        self.enclosing_tags.pop()


def text_for_mujoco(file_content: bytes) -> UrdfText:
    """Text of a well-formed URDF for MuJoCo's parser."""
    root = parsed_root(file_content)
    links = root.findall("link")
    massive = frozenset(link.get("name", "") for link in links if link.find("inertial") is not None)
    standing = fixed_links(root)
    writer = _UrdfWriter(frozenset(standing), massive)
    text = writer.write(file_content)
    return UrdfText(text, tuple(_notes(root, standing, massive, writer.removed_tags)))


def parsed_root(file_content: bytes) -> ElementTree.Element:
    """Root element of a well-formed URDF, with the tags freed of namespaces."""
    root = ElementTree.fromstring(file_content)
    for element in root.iter():
        if isinstance(element.tag, str):
            element.tag = element.tag.rpartition("}")[2]
    return root


def fixed_links(xml_root: ElementTree.Element) -> list[str]:
    """Names of the links that do not move in MuJoCo: the root links, and all that are fixed to them."""
    joints = [
        (joint.get("type"), _link_name(joint, "parent"), _link_name(joint, "child"))
        for joint in xml_root.findall("joint")
    ]
    children = {child for _, _, child in joints}
    standing = [name for name in (link.get("name", "") for link in xml_root.findall("link")) if name not in children]
    for name in standing:  # which grows
        standing += [child for kind, above, child in joints if kind == "fixed" and above == name != child]
        if len(standing) > len(joints) + len(xml_root):
            break  # a link with two parents in a circle: MuJoCo's parser refuses it
    return standing


def _link_name(joint_element: ElementTree.Element, end_tag: str) -> str:
    end = joint_element.find(end_tag)
    return "" if end is None else end.get("link", "")


def _notes(
    xml_root: ElementTree.Element,
    fixed_links: Sequence[str],
    links_with_mass: frozenset[str],
    removed_tags: Counter[str],
) -> list[str]:
    """Notes on a URDF: what was left out, and what MuJoCo makes of links without joints or masses."""
    notes = list[str]()
    if removed_tags["collision"]:
        notes.append(f"{removed_tags['collision']} shapes of links with masses of their own were not read")
    others = ", ".join(f"{count} <{tag}>" for tag, count in removed_tags.items() if tag not in PARTS_OF_LINKS)
    if others:
        notes.append(f"not read, since it is for other programs and moves nothing here: {others}")
    if heavy := [name for name in fixed_links if name in links_with_mass]:
        notes.append(
            f"link {heavy[0]!r} stands on the world, since MuJoCo reads a URDF so: to set it free, put a link without "
            "mass before it, and a joint of type floating between the two"
        )
    shaped = [link.get("name", "") for link in xml_root.findall("link") if link.find("collision") is not None]
    if light := [name for name in shaped if name not in links_with_mass and name not in fixed_links]:
        more = f" and {len(light) - 1} more links" if len(light) > 1 else ""
        notes.append(f"link {light[0]!r}{more} without <inertial>: MuJoCo takes 1000 kg/m^3 for the collision shapes")
    return notes
