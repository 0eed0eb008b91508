"""Examples of pages are run, and what they print is compared with what the pages show."""

import pytest

from docs.alike import alike
from docs.outputs import ExampleFailed, console_commands, page_with_outputs
from docs.pages import example_blocks

PAGE = """# A page

<!-- file: numbers.txt -->
```text
3 4
```

<!-- run -->
```python
first, second = map(int, open("numbers.txt").read().split())
print(first * second)
```

<!-- output -->
```text
13
```

<!-- run -->
```python
print(first)
```

<!-- output -->
```text
3
```

<!-- run: fails -->
```console
$ cat numbers.txt
$ echo wrong >&2; exit 1
```

<!-- output -->
```text
```
"""


@pytest.fixture
def page(tmp_path):
    def write(text):
        (tmp_path / "page.md").write_text(text)
        return tmp_path / "page.md"

    return write


def test_outputs_are_written_where_they_differ(page):
    text, changes = page_with_outputs(page(PAGE), draw=False)
    assert len(changes) == 2 and "13\n" in changes[0] and "12\n" in changes[0]
    assert [block.text for block in example_blocks(text) if block.mark == "output"] == ["12\n", "3\n", "3 4\nwrong\n"]
    assert page_with_outputs(page(text), draw=False) == (text, [])


@pytest.mark.parametrize("line", ["print(1 / 0)", "print(unknown)"])
def test_an_example_that_stops_is_told(page, line):
    with pytest.raises(ExampleFailed, match="Error"):
        page_with_outputs(page(f"<!-- run -->\n```python\n{line}\n```\n"), draw=False)


@pytest.mark.parametrize(("mark", "command"), [("run", "false"), ("run: fails", "true")])
def test_a_command_that_ends_otherwise_than_the_page_says_is_told(page, mark, command):
    with pytest.raises(ExampleFailed, match="ended with code"):
        page_with_outputs(page(f"<!-- {mark} -->\n```console\n$ {command}\n```\n"), draw=False)


def test_an_output_without_an_example_is_told(page):
    with pytest.raises(ExampleFailed, match="without an example"):
        page_with_outputs(page("<!-- output -->\n```text\n```\n"), draw=False)


def test_pictures_are_drawn_where_the_page_shows_them(page, tmp_path):
    shown = "<!-- picture: a.png -->\n![what it shows](pictures/a.png)\n"
    text = f"<!-- run -->\n```console\n$ echo x > a.png\n```\n\n{shown}"
    page_with_outputs(page(text), draw=False)
    assert not (tmp_path / "pictures").exists()
    page_with_outputs(page(text), draw=True)
    assert (tmp_path / "pictures" / "a.png").read_text() == "x\n"
    with pytest.raises(ExampleFailed, match="draw no"):
        page_with_outputs(page(text.replace("echo x > a.png", "true")), draw=False)


def test_commands_go_on_in_lines_without_a_dollar():
    assert console_commands("$ a \\\n  b\n$ c\n") == ["a \\\n  b", "c"]


@pytest.mark.parametrize(
    ("written", "printed", "same"),
    [
        ("done in 2.750 s once", "done in  11.212 s once", True),
        ("Exudyn 1.13.6", "Exudyn 1.13.7", True),
        ("at most 3.7e-15", "at most 2e-16", True),
        ("at most 4.1e-06 N", "at most 4.2e-06 N", True),
        ("at most 4.1e-06 N", "at most 4.3e-06 N", False),
        ("force 13.62 N", "force 13.63 N", True),
        ("force 13.62 N", "force 13.64 N", False),
        ("16000 steps", "16001 steps", False),
        ("15 m/s", "16 m/s", False),
        ("all is well", "all is not well", False),
        ("1 2", "1", False),
    ],
)
def test_what_is_alike(written, printed, same):
    assert alike(written, printed) is same
