"""Build of the documentation site: every example is run anew, and its output is compared with the page and shown.

``python -m docs.website FOLDER`` copies the pages into a folder beside the site, runs their examples there, and
builds the site with MkDocs (extra ``docs``) into ``FOLDER``, where every warning is an error: a broken link, an
anchor that is not there, a page without a place. It ends with code 1 where a page of the repository shows what its
examples do not print. ``--as-shown`` leaves the examples out and shows what stands in the pages. ``python -m mkdocs``
cannot build from ``docs`` itself: its pages link to those at the top of the repository.
"""

import argparse
import os
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from docs.gallery import add_pictures
from docs.outputs import run_pages
from docs.pages import ROOT, TOP_FOLDER_PAGES, pages
from docs.validation_cases import counts_table, newest_report, rows_table

QUIET_ENVIRONMENT = {"NO_MKDOCS_2_WARNING": "1"}
"""Environment variable that keeps advertisements of MkDocs out of the output."""
SKIPPED_FILES = shutil.ignore_patterns("*.py", "__pycache__", "*.yml")


def copy_pages(target_folder: Path) -> None:
    """Copy all pages and their pictures into a folder, with the same relative paths as in the repository."""
    shutil.copytree(ROOT / "docs", target_folder / "docs", ignore=SKIPPED_FILES)
    shutil.copyfile(ROOT / "docs" / "nav.yml", target_folder / "nav.yml")
    for name in TOP_FOLDER_PAGES:
        shutil.copyfile(ROOT / name, target_folder / name)
    (target_folder / "studies").mkdir()
    for picture in (ROOT / "studies").glob("*.png"):
        shutil.copyfile(picture, target_folder / "studies" / picture.name)


def add_report_rows(pages_folder: Path) -> None:
    """Append the rows of the newest report, if there is one, and their counts to the pages that explain them."""
    report = newest_report()
    if report is None:
        return
    for name, text in (("reference/report_rows.md", rows_table(report)), ("validated_by.md", counts_table(report))):
        page = pages_folder / "docs" / name
        page.write_text(page.read_text(encoding="utf-8") + text, encoding="utf-8")


def build(site: Path, work: Path, as_shown: bool) -> bool:
    """Build the site in the folder ``site`` from copies in ``work``; returns whether the pages show the outputs of
    their examples."""
    sources = work / "pages"
    copy_pages(sources)
    outputs_agree = as_shown or run_pages(pages(sources), check=False, strict=True)
    add_report_rows(sources)
    add_pictures(ROOT / "results", sources / "docs" / "gallery.md")
    for name in ("mkdocs.yml", "mathml.py"):
        shutil.copyfile(ROOT / "docs" / name, work / name)
    command = [sys.executable, "-m", "mkdocs", "build", "--strict"]
    command += ["--config-file", str(work / "mkdocs.yml"), "--site-dir", str(site.absolute())]
    subprocess.run(command, check=True, cwd=ROOT, env=os.environ | QUIET_ENVIRONMENT)
    return outputs_agree


def main() -> None:
    """Command: build the documentation site."""
    parser = argparse.ArgumentParser(description="Build the site of the documentation.")
    parser.add_argument("site", type=Path, help="folder of the site")
    parser.add_argument("--as-shown", action="store_true", help="do not run the examples")
    asked = parser.parse_args()
    with TemporaryDirectory(prefix="website") as work:
        try:
            outputs_agree = build(asked.site, Path(work), asked.as_shown)
        except subprocess.CalledProcessError as error:
            sys.exit(error.returncode)
    differs = "pages show what their examples do not print; `python -m docs.outputs` writes it"
    print(f"the site is in {asked.site}" if outputs_agree else differs)
    sys.exit(0 if outputs_agree else 1)


if __name__ == "__main__":
    main()
