"""Tables as spreadsheets and loggers write them, turned line by line into the plain form of ``models.core.tables``."""

from collections.abc import Collection
from pathlib import Path

from models.core.csv_header import (
    MARKS,
    SEPARATORS,
    Head,
    Line,
    decimal_sign,
    find_head,
    heading,
    is_number,
    separator_line,
    split,
)


def plain_text(path: str | Path, text: str, wanted: Collection[str]) -> str:
    """The same table with commas between columns, decimal points and units in the headings, each line in its place.

    ``wanted`` are names of columns, by which the headings are known. Titles become comments; a separator that ends the
    lines, quotes and a row of units go. What has two meanings, or is no such table, comes back as it was, for the
    reader to refuse; InputError where a comma can be a decimal sign or one of thousands.
    """
    lines = [Line(i, line, i, i) for i, line in enumerate(text.split("\n"), start=1)]
    asked = separator_line(lines[0].text)
    used = [line for line in lines[bool(asked) :] if line.text.strip() and not line.text.startswith("#")]
    heads = find_head(used, lambda cell: heading(cell)[0] in wanted, (asked,) if asked else tuple(SEPARATORS))
    if len(heads) != 1 or not heads[0].separator or asked not in ("", *SEPARATORS):
        return text
    return _rewritten(path, lines, heads[0])


def _rewritten(path: str | Path, lines: list[Line], head: Head) -> str:
    """Text with the head and the rows in the plain form."""
    rows = {line.number: split(line.text, head.separator) for line in lines[head.line :]}
    cells = [cell for row in rows.values() for cell in row]
    sign = decimal_sign(path, head.line + 1, head.separator, cells)
    new = {line.number: f"# {line.text}" if line.text.strip() else "" for line in lines[: head.line]}
    new[head.header.number] = ",".join(_headings(head))
    for number, row in rows.items():
        kept = row[: len(head.names)] if len(row) == head.width and not any(row[len(head.names) :]) else row
        new[number] = ",".join(_plain(cell, sign) for cell in kept)
    return "\n".join(new[line.number] for line in lines)


def _headings(head: Head) -> list[str]:
    """Headings with the units of the row beneath them, where there is one."""
    if len(head.between) != 1:
        return list(head.names)
    units = [cell.strip("[]() ") for cell in head.cells(head.between[0])]
    return [name if heading(name)[1] else f"{name} [{unit}]" for name, unit in zip(head.names, units, strict=True)]


def _plain(cell: str, sign: str) -> str:
    """A number with a decimal point; a mark for nothing measured as ``nan``; anything else as it is, less commas."""
    if is_number(cell) and sign == ",":
        return cell.replace(",", ".")
    return "nan" if cell and MARKS.fullmatch(cell) else cell.replace(",", ";")
