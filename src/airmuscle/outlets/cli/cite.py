"""`airmuscle cite`: references of a library entry."""

import dataclasses
import re
from typing import Annotated

import typer

from ...core import Reference, reference
from ...files.library.catalogue import load
from .options import Json, Name
from .terminal import echo, print_json


def cite(
    name: Name,
    json: Json = False,
    bibtex: Annotated[bool, typer.Option("--bibtex", help="Print BibTeX entries.")] = False,
) -> None:
    """Print the references of a library entry.

    The list covers the formulas and the parameter values.

    \b
    Examples:
      airmuscle cite dmsp-20-300
      airmuscle cite dmsp-20-300 --bibtex >> references.bib
    """
    if json and bibtex:
        raise typer.BadParameter("--json and --bibtex exclude each other")
    references = reference.cite(load(name))
    if json:
        print_json([dataclasses.asdict(source) for source in references])
        return
    for source in references:
        echo(as_bibtex(source) if bibtex else str(source))
    if not references:
        echo(f"{name}: no reference is given; its parameter values are assumed.")


def as_bibtex(source: Reference) -> str:
    """A BibTeX entry of type @misc, which every bibliography style supports."""
    fields = {
        "author": _authors(source.authors),
        "title": "{" + _escape(source.title) + "}",
        "howpublished": _escape(source.where),
        "year": str(source.year) if source.year else "",
        "doi": source.doi or "",
        "note": _escape(source.note),
    }
    lines = [f"  {key} = {{{value}}}," for key, value in fields.items() if value]
    key = re.sub(r"[^\w:.-]", "-", source.key)
    return "\n".join([f"@misc{{{key},", *lines, "}"])


def _authors(authors: str) -> str:
    """`Chou, C.-P., Hannaford, B. et al.` in the syntax of BibTeX: names separated by `and`."""
    separated = re.sub(r"(?:(?<=\.),|;) ", " and ", authors)
    return _escape(re.sub(r",? et al\.?", " and others", separated))


def _escape(text: str) -> str:
    return re.sub(r"([&%$#_{}])", r"\\\1", text)
