"""Build of the site: generated sources, figures, live page, then Sphinx with warnings as errors."""

from __future__ import annotations

import argparse
import shutil
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from airmuscle.outlets import export_page, write_site

from . import gallery, pictures
from .contents import ROOT, broken_links, documents
from .sources import write_sources

OUT = ROOT / "build" / "docs"
LIVE = ("dmsp-20-300",)
"""Library entries of the live page."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Build the site; returns the exit code."""
    parser = argparse.ArgumentParser(prog="./run docs", description="Build the documentation site.")
    parser.add_argument(
        "--out", type=Path, default=OUT, metavar="DIR", help="output folder; default: build/docs"
    )
    parser.add_argument(
        "--without-figures",
        action="store_true",
        help="leave out the figures that take longest, for drafts",
    )
    chosen = parser.parse_args(arguments)
    out: Path = chosen.out.resolve()
    broken = [link for page in documents() for link in broken_links(page)]
    if broken:
        print("docs: broken links: " + ", ".join(broken), file=sys.stderr)
        return 1
    source = out / "source"
    html = out / "html"
    for folder in (source, html):
        shutil.rmtree(folder, ignore_errors=True)
    prepare(source, figures=not chosen.without_figures)
    code = run_sphinx(source, html, out / "doctrees")
    if code == 0:
        export_page(list(LIVE), live := html / "_static" / "live" / "muscle.html")
        note(f"live page: {live.stat().st_size // 1000} kB")
        static = write_site(html / "_static" / "page")
        note(f"page of the library: {static.size // 1000} kB")
        note(f"site: {html / 'index.html'}")
    return code


def prepare(source: Path, figures: bool) -> None:
    """Write the sources of all pages, with the figures of models and of the gallery if wanted."""
    drawn: tuple[str, ...] = ()
    if figures:
        note("figures of the models")
        drawn = pictures.write(source / "models" / "images")
    note("pages")
    write_sources(source, drawn)
    for title in gallery.write(source) if figures else ():
        note(f"gallery: {title}")


def run_sphinx(source: Path, html: Path, doctrees: Path) -> int:
    """Run Sphinx; warnings are errors."""
    from sphinx.cmd.build import build_main  # the program does not need it

    note("HTML")
    configuration = str(Path(__file__).parent)
    (html / "_static" / "live").mkdir(parents=True, exist_ok=True)
    options = ["-q", "-W", "--keep-going", "-b", "html", "-c", configuration, "-d", str(doctrees)]
    return int(build_main([*options, str(source), str(html)]))


START = time.perf_counter()


def note(text: str) -> None:
    """Print a step of the build with the time since its start."""
    print(f"docs: {time.perf_counter() - START:5.1f} s  {text}", flush=True)
