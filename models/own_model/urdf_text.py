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
class _Writer:
    """Writer of the wanted elements of a URDF, each on its original line.

    standing, massive : names of links that stand on the world, and that have masses; left : counts of elements that are
    left away, by tag; around : the tags around, and the name of the link; inside : depth within an unwanted element.
    """

    standing: frozenset[str]
    massive: frozenset[str]
    left: Counter[str] = field(default_factory=Counter)
    around: list[str] = field(default_factory=list)
    link: str = ""
    inside: int = 0
    pieces: list[str] = field(default_factory=list)
    line: int = 1

    def write(self, content: bytes) -> str:
        parser = self._parser = expat.ParserCreate()
        parser.StartElementHandler, parser.EndElementHandler = self._start, self._end
        parser.Parse(content, True)
        return "".join(self.pieces)

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        if self.around == ["robot"]:
            self.link = attributes.get("name", "") if tag == "link" else ""
        if self.inside or self._is_unwanted(tag):
            self.left.update([] if self.inside else [tag])
            self.inside += 1
            return
        line = self._parser.CurrentLineNumber
        told = "".join(f" {name}={quoteattr(value)}" for name, value in attributes.items())
        self.pieces += ["\n" * (line - self.line), f"<{tag}{told}>"]
        self.line = max(line, self.line)
        self.around.append(tag)

    def _is_unwanted(self, tag: str) -> bool:
        if self.around == ["robot"]:
            return tag not in READ_TAGS
        if self.around != ["robot", "link"]:
            return False
        if tag == "visual" or (self.link in self.standing and tag in ("inertial", "collision")):
            return True
        return tag == "collision" and self.link in self.massive

    def _end(self, tag: str) -> None:
        if self.inside:
            self.inside -= 1
            return
        self.pieces.append(f"</{tag}>")
        self.around.pop()


def text_for_mujoco(content: bytes) -> UrdfText:
    """Text of a well-formed URDF for MuJoCo's parser."""
    root = parsed_root(content)
    links = root.findall("link")
    massive = frozenset(link.get("name", "") for link in links if link.find("inertial") is not None)
    standing = standing_links(root)
    writer = _Writer(frozenset(standing), massive)
    text = writer.write(content)
    return UrdfText(text, tuple(_notes(root, standing, massive, writer.left)))


def parsed_root(content: bytes) -> ElementTree.Element:
    """Root element of a well-formed URDF, with the tags freed of namespaces."""
    root = ElementTree.fromstring(content)
    for element in root.iter():
        if isinstance(element.tag, str):
            element.tag = element.tag.rpartition("}")[2]
    return root


def standing_links(root: ElementTree.Element) -> list[str]:
    """Names of the links that do not move in MuJoCo: the root links, and all that are fixed to them."""
    joints = [(joint.get("type"), _link(joint, "parent"), _link(joint, "child")) for joint in root.findall("joint")]
    children = {child for _, _, child in joints}
    standing = [name for name in (link.get("name", "") for link in root.findall("link")) if name not in children]
    for name in standing:  # which grows
        standing += [child for kind, above, child in joints if kind == "fixed" and above == name != child]
        if len(standing) > len(joints) + len(root):
            break  # a link with two parents in a circle: MuJoCo's parser refuses it
    return standing


def _link(joint: ElementTree.Element, which: str) -> str:
    end = joint.find(which)
    return "" if end is None else end.get("link", "")


def _notes(
    root: ElementTree.Element, standing: Sequence[str], massive: frozenset[str], left: Counter[str]
) -> list[str]:
    """Notes on a URDF: what was left out, and what MuJoCo makes of links without joints or masses."""
    notes = list[str]()
    if left["collision"]:
        notes.append(f"{left['collision']} shapes of links with masses of their own were not read")
    others = ", ".join(f"{count} <{tag}>" for tag, count in left.items() if tag not in PARTS_OF_LINKS)
    if others:
        notes.append(f"not read, since it is for other programs and moves nothing here: {others}")
    if heavy := [name for name in standing if name in massive]:
        notes.append(
            f"link {heavy[0]!r} stands on the world, since MuJoCo reads a URDF so: to set it free, put a link without "
            "mass before it, and a joint of type floating between the two"
        )
    shaped = [link.get("name", "") for link in root.findall("link") if link.find("collision") is not None]
    if light := [name for name in shaped if name not in massive and name not in standing]:
        more = f" and {len(light) - 1} more links" if len(light) > 1 else ""
        notes.append(f"link {light[0]!r}{more} without <inertial>: MuJoCo takes 1000 kg/m^3 for the collision shapes")
    return notes
