"""`airmuscle cite`: the sources behind a library entry."""

from __future__ import annotations

import dataclasses
import re
from typing import TYPE_CHECKING, Annotated

import typer

from .options import Json, Name
from .terminal import print_json

if TYPE_CHECKING:
    from ..core.reference import Reference


def cite(
    name: Name,
    json: Json = False,
    bibtex: Annotated[bool, typer.Option("--bibtex", help="Print BibTeX entries.")] = False,
) -> None:
    """Print every source of an entry's formulas and numbers.

    \b
    Examples:
      airmuscle cite dmsp-20-300
      airmuscle cite dmsp-20-300 --bibtex >> references.bib
    """
    from ..core import reference
    from ..library.catalogue import load

    if json and bibtex:
        raise typer.BadParameter("--json and --bibtex exclude each other")
    found = reference.cite(load(name))
    if json:
        print_json([dataclasses.asdict(source) for source in found])
        return
    for source in found:
        typer.echo(as_bibtex(source) if bibtex else str(source))
    if not found:
        typer.echo(f"{name}: no source is named; its numbers were chosen.")


def as_bibtex(source: Reference) -> str:
    """A BibTeX entry that any style can set."""
    fields = {
        "author": _people(source.authors),
        "title": "{" + _escaped(source.title) + "}",
        "howpublished": _escaped(source.where),
        "year": str(source.year) if source.year else "",
        "doi": source.doi or "",
        "note": _escaped(source.note),
    }
    lines = [f"  {key} = {{{value}}}," for key, value in fields.items() if value]
    key = re.sub(r"[^\w:.-]", "-", source.key)
    return "\n".join([f"@misc{{{key},", *lines, "}"])


def _people(authors: str) -> str:
    """`Chou, C.-P., Hannaford, B. et al.` in BibTeX's way: joined by `and`."""
    joined = re.sub(r"(?:(?<=\.),|;) ", " and ", authors)
    return _escaped(re.sub(r",? et al\.?", " and others", joined))


def _escaped(text: str) -> str:
    return re.sub(r"([&%$#_{}])", r"\\\1", text)
