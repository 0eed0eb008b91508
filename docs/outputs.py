"""Run the examples of documentation pages, and write or compare their outputs.

``python -m docs.outputs [PAGE ...]`` runs the examples of pages (all of them, if none is named) and writes into each
what they print, where that says something else than what stands there (``docs.alike``). ``--check`` writes nothing, and
ends with code 1 where a page shows what its examples do not print. All examples of a page run in one new folder, in
order; its Python blocks share their names. Measured data, if there are any on the machine, are not seen.
"""

import argparse
import contextlib
import io
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from docs.alike import alike
from docs.pages import ROOT, ExampleBlock, example_blocks, pages

COLUMNS = 100
"""Width (characters) of the terminal that examples see."""
WORKERS = 2
"""Number of pages whose examples run at the same time."""
EXAMPLE_TIMEOUT = 600.0
"""Time (s) after which an example is stopped: far more than any example takes on a busy machine."""


class ExampleFailed(Exception):
    """Raised for an example that fails, or succeeds, contrary to its mark in the page."""


@dataclass
class Session:
    """State in which the examples of a page run: folder, environment variables, and names of the Python blocks."""

    folder: Path
    environment: dict[str, str]
    names: dict[str, Any] = field(default_factory=lambda: {"__name__": "__main__"})

    def run(self, block: ExampleBlock) -> str:
        """Run an example block; returns its output. Raises ExampleFailed if it ends contrary to its mark."""
        return self._python(block.text) if block.language == "python" else self._console(block)

    def _python(self, text: str) -> str:
        said = io.StringIO()
        with contextlib.chdir(self.folder), contextlib.redirect_stdout(said):
            try:
                exec(compile(text, "example", "exec"), self.names)
            except Exception as error:
                raise ExampleFailed(f"{type(error).__name__}: {error}\nin\n{text}") from error
        return said.getvalue()

    def _console(self, block: ExampleBlock) -> str:
        lines = console_commands(block.text)
        fails = [False] * (len(lines) - 1) + [block.mark == "run: fails"]
        return "".join(self._command(line, wanted) for line, wanted in zip(lines, fails, strict=True))

    def _command(self, command: str, must_fail: bool) -> str:
        ended = subprocess.run(
            ["bash", "-c", command],
            cwd=self.folder,
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT if must_fail else subprocess.PIPE,
            text=True,
            timeout=EXAMPLE_TIMEOUT,
        )
        if (ended.returncode != 0) is not must_fail:
            raise ExampleFailed(f"`{command}` ended with code {ended.returncode}: {ended.stdout}{ended.stderr or ''}")
        return ended.stdout


def console_commands(text: str) -> list[str]:
    """Commands of a console block; lines that do not begin with ``$`` continue the command before."""
    return [part.strip() for part in re.split(r"^\$ ", text, flags=re.MULTILINE) if part.strip()]


@contextlib.contextmanager
def session() -> Iterator[Session]:
    """Context that yields a session in a new folder, in which ``twinrig`` and ``python`` are those of this process."""
    with TemporaryDirectory(prefix="example") as parent:
        folder, programs = Path(parent, "work"), Path(parent, "programs")
        folder.mkdir()
        programs.mkdir()
        for name, module in (("twinrig", " -m studies.command_line"), ("python", "")):
            (programs / name).write_text(f'#!/bin/sh\nexec "{sys.executable}"{module} "$@"\n')
            (programs / name).chmod(0o755)
        changes = {"PATH": f"{programs}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT), "COLUMNS": str(COLUMNS)}
        kept = {key: value for key, value in os.environ.items() if key != "TWINRIG_DATA"}
        environment = kept | changes | {"MPLBACKEND": "Agg", "NO_COLOR": "1", "TERM": "dumb"}
        yield Session(folder, environment)


def page_with_outputs(page: Path, draw: bool) -> tuple[str, list[str]]:
    """The text of a page with the outputs of its examples, and a text on each output that differs from the page.

    draw : pictures that the examples draw are written to where the page shows them. Raises ExampleFailed.
    """
    text = page.read_text(encoding="utf-8")
    lines, changes, said, shift = text.splitlines(keepends=True), [], None, 0
    with session() as here:
        for block in example_blocks(text):
            if block.mark.startswith("run"):
                said = here.run(block)
            elif block.mark.startswith("file: "):
                (here.folder / block.file).write_text(block.text, encoding="utf-8")
            elif block.mark.startswith("picture: "):
                copy_picture(here.folder / block.file, page.parent / block.text, draw)
            elif block.mark == "output":
                if said is None:
                    raise ExampleFailed(f"line {block.first}: an output without an example before it")
                printed = as_shown_in_page(said)
                if not alike(block.text, printed):
                    changes.append(f"line {block.first}: shows\n{block.text}where its example prints\n{printed}")
                    lines[block.first + shift : block.last + shift] = [printed]
                    shift += 1 - (block.last - block.first)
                said = None
    return "".join(lines), changes


def copy_picture(picture: Path, shown_file: Path, draw: bool) -> None:
    """Copy a picture that examples drew to the file that the page shows, if ``draw``; raises ExampleFailed if it is
    missing."""
    if not picture.is_file():
        raise ExampleFailed(f"its examples draw no {picture.name}")
    if draw:
        shown_file.parent.mkdir(exist_ok=True)
        shutil.copyfile(picture, shown_file)


def as_shown_in_page(output: str) -> str:
    """An output as a page shows it: without white space at the ends of lines, and without empty lines at its ends."""
    return "\n".join(line.rstrip() for line in output.strip("\n").splitlines()) + "\n"


def has_examples(page: Path) -> bool:
    """Whether a page has marked examples."""
    return any(block.mark for block in example_blocks(page.read_text(encoding="utf-8")))


def run_page(page: Path, check: bool) -> tuple[Path, list[str], str]:
    """Run the examples of a page and, unless ``check``, write their outputs into it; returns the page, texts on changed
    outputs, and the message of a failure, else ""."""
    os.environ |= {"COLUMNS": str(COLUMNS), "MPLBACKEND": "Agg", "NO_COLOR": "1"}
    os.environ.pop("TWINRIG_DATA", None)
    try:
        text, changes = page_with_outputs(page, draw=not check)
    except (ExampleFailed, OSError, subprocess.TimeoutExpired) as error:
        return page, [], str(error)
    if changes and not check:
        page.write_text(text, encoding="utf-8")
    return page, changes, ""


def run_pages(pages: list[Path], check: bool, strict: bool) -> bool:
    """Run the examples of pages, two pages at a time; prints differing outputs, and returns whether all is well.

    strict : an output that differs is not well.
    """
    with_examples = [page for page in pages if has_examples(page)]
    well = True
    with ProcessPoolExecutor(WORKERS, get_context("spawn"), max_tasks_per_child=1) as pool:
        for page, changes, failed in pool.map(partial(run_page, check=check), with_examples):
            for told in (*changes, *([failed] if failed else [])):
                print(f"{page}: {told}")
            print(f"{page}: {'failed' if failed else f'{len(changes)} outputs differ' if changes else 'as shown'}")
            well &= not failed and not (strict and changes)
    return well


def main() -> None:
    """Command: run the examples of pages and write, or check, their outputs."""
    parser = argparse.ArgumentParser(description="Run the examples of pages and write what they print.")
    parser.add_argument("pages", nargs="*", type=Path, help="pages; all of them, if none is named")
    parser.add_argument("--check", action="store_true", help="write nothing; end with code 1 where an output differs")
    asked = parser.parse_args()
    sys.exit(0 if run_pages(asked.pages or pages(), asked.check, asked.check) else 1)


if __name__ == "__main__":
    main()
