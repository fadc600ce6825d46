"""Entries of the library: `airmuscle show` and `cite`."""

import dataclasses
import re
from typing import Annotated

import click

from ...core import Reference, reference
from ...files.library import load
from .entry_request import EntryRequest
from .options import Json, Name
from .parser import CommandOption
from .printing import print_result
from .requested import with_requests
from .terminal import echo, print_json


@with_requests
def show(name: Name, variant: EntryRequest, json: Json = False) -> None:
    """Show parameters, sources and checks of a library entry.

    The table of parameters contains symbol, value, unit, meaning and bounds.

    \b
    Examples:
      airmuscle show dmsp-20-300
      airmuscle show matrix-821
      airmuscle show festo-dmsp-20
      airmuscle show my/muscle.toml --json
    """
    chapter = variant.load(name, load).chapter()
    print_result([chapter], {}, json)
    for source in () if json else chapter.references:
        echo(f"- {source}")


Bibtex = Annotated[bool, CommandOption("--bibtex", "Print BibTeX entries.")]


def cite(name: Name, json: Json = False, bibtex: Bibtex = False) -> None:
    """Print the references of a library entry.

    The list covers the formulas and the parameter values.

    \b
    Examples:
      airmuscle cite dmsp-20-300
      airmuscle cite dmsp-20-300 --bibtex >> references.bib
    """
    if json and bibtex:
        raise click.BadParameter("--json and --bibtex exclude each other")
    references = reference.cite(load(name))
    if json:
        print_json([dataclasses.asdict(source) for source in references])
    elif references:
        echo("\n".join(map(as_bibtex if bibtex else str, references)))
    else:
        echo(f"{name}: no reference is given; its parameter values are assumed.")


def as_bibtex(source: Reference) -> str:
    """A BibTeX entry of type @misc, which every bibliography style supports, with `and` between its
    authors.
    """
    separated = re.sub(r"(?:(?<=\.),|;) ", " and ", source.authors)
    fields = {
        "author": _escape(re.sub(r",? et al\.?", " and others", separated)),
        "title": "{" + _escape(source.title) + "}",
        "howpublished": _escape(source.where),
        "year": str(source.year) if source.year else "",
        "doi": source.doi or "",
        "note": _escape(source.note),
    }
    lines = [f"  {key} = {{{value}}}," for key, value in fields.items() if value]
    key = re.sub(r"[^\w:.-]", "-", source.key)
    return "\n".join([f"@misc{{{key},", *lines, "}"])


def _escape(text: str) -> str:
    return re.sub(r"([&%$#_{}])", r"\\\1", text)
