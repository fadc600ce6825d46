"""Entries of the library: `airmuscle list`, `show`, `cite`, and `evaluate` at an operating
point.
"""

import dataclasses
import itertools
import re
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any

import click

from ...core import Reference, check_known, leaves, quantity, reference, with_parameters
from ...files.library import PARTS, UNITS, Entry, load, load_law, model_class, scale_entry
from ...files.library import evaluate as evaluate_entry
from ...files.library.files import DATA, FOLDERS, list_data, list_names
from ...physics.muscle.characteristic import ForceLaw
from ...physics.muscle.isobars import describe_point
from ...report.write import rendered_figure, save_table
from ..requests import RequestError, Where, many, optional, read_pair, request
from .delivery import print_result, write_result
from .options import Json, Name, OptionalFolder, with_requests
from .parser import CommandOption
from .terminal import echo, print_json, print_table


@request
class EntryRequest:
    """How an entry differs from its file."""

    resting_length: str | None = optional(
        "Scale the muscle to this resting length: '200 mm'.", metavar="QUANTITY"
    )
    diameter: str | None = optional(
        "Scale a McKibben muscle to this braid diameter at rest.", metavar="QUANTITY"
    )
    set: tuple[Any, ...] = many(
        "Another value of a parameter, by its path: characteristic.slope_factor=2,"
        " 'geometry.radius=10 mm'. Repeatable.",
        metavar="PATH=VALUE",
        read=read_pair,
    )

    def load(self, name: str, find: Callable[[str], Any] = load_law) -> Any:
        """The entry of a name or file, as changed. Raises ParameterError or UnitError."""
        entry = find(name)
        if self.resting_length is not None or self.diameter is not None:
            entry = scale_entry(entry, resting_length=self.resting_length, diameter=self.diameter)
        return with_values(entry, dict(self.set))


def with_values(entry: Any, changes: Mapping[str, float | str]) -> Any:
    """The entry with other values, [SI] or texts, by path; a law loses standard errors, error band
    and checks.
    """
    if not changes:
        return entry
    parts = {name: part for name in PARTS if (part := getattr(entry, name, None)) is not None}
    known = {f"{name}.{leaf.path}": leaf for name, part in parts.items() for leaf in leaves(part)}
    check_known(f"{entry.name} has no parameter", changes, known, "its parameters are")
    values = {
        path: quantity(value, known[path].declared.unit, where=path)
        for path, value in changes.items()
    }
    changed = {
        name: with_parameters(
            part, [values.get(f"{name}.{leaf.path}", leaf.value) for leaf in leaves(part)]
        )
        for name, part in parts.items()
        if any(path.startswith(f"{name}.") for path in values)
    }
    geometry = getattr(parts.get("characteristic"), "geometry", None)
    if "characteristic" in changed and geometry is not None and geometry == entry.geometry:
        changed["geometry"] = changed["characteristic"].geometry
    if not isinstance(entry, Entry):
        return dataclasses.replace(entry, **changed)
    stated = ", ".join(f"{path} = {value:.6g}" for path, value in values.items())
    return dataclasses.replace(
        entry,
        **changed,
        title=f"{entry.title}, parameters changed",
        provenance="chosen",
        uncertainty=None,
        checks=(),
        error_band=None,
        note=f"Changed (SI): {stated}. {entry.note}".strip(),
    )


@request
class EvaluateRequest:
    """Two of pressure, contraction and force."""

    pressure: float | None = optional(
        "Pressure with unit: '3 bar' (gauge), '400 kPa', '4 bara' (at 101.325 kPa ambient).",
        unit="Pa",
    )
    contraction: float | None = optional("Contraction: 0.12 or '12 %'.", unit="1")
    force: float | None = optional("Tension with unit: '100 N', '0.1 kN'.", unit="N")

    def check(self, where: Where) -> None:
        """Raise RequestError unless two quantities are given."""
        if len(self.given) != 2:
            pressure, contraction, force = map(where, UNITS)
            raise RequestError(
                f"give two of {pressure}, {contraction} and {force}, not {len(self.given)}"
            )

    @property
    def given(self) -> dict[str, float]:
        """The given quantities [SI]."""
        return {name: value for name in UNITS if (value := getattr(self, name)) is not None}


@with_requests
def evaluate(
    name: Name,
    point: EvaluateRequest,
    variant: EntryRequest,
    out: OptionalFolder = None,
    json: Json = False,
) -> None:
    """Evaluate a law for two of pressure, contraction and force.

    \b
    If several solutions exist, the result is the one reached from the state of rest.
    A point that the maker does not permit is refused, or, where it was measured, reported with a
    warning. With --out, DIR/isobars.png and DIR/isobars.csv show force over contraction, with the
    operating point.

    \b
    Examples:
      airmuscle evaluate dmsp-20-300 --pressure "3 bar" --force "100 N"
      airmuscle evaluate dmsp-20-300 --contraction "12 %" --force "100 N" --out chart
      airmuscle evaluate tondu-lopez --diameter "30 mm" --resting-length "200 mm" --pressure "3 bar"
          --force "100 N"
      airmuscle evaluate saga2007 --set characteristic.slope_factor=2 --pressure "1 bar"
          --contraction "5 %"
      airmuscle evaluate my/muscle.toml --pressure "400 kPa" --contraction 0.1 --json
    """
    evaluation = evaluate_entry(variant.load(name), point.given)
    chapter = evaluation.chapter()
    print_result([chapter], {}, json)
    if out is not None:
        write_result(
            out,
            [],
            "",
            {
                "isobars.csv": lambda path: save_table(evaluation.isobar_table(), path),
                "isobars.png": lambda path: path.write_bytes(
                    rendered_figure(chapter.plots[0])["png"]
                ),
            },
        )
        echo(
            f"chart: {out / 'isobars.png'}, data: {out / 'isobars.csv'}"
            f" ({describe_point(evaluation.point)})",
            err=json,
        )


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


def list_entries(json: Json = False) -> None:
    """List muscles, laws, valves, plants, products and data sets.

    A muscle can be simulated; a characteristic cannot, because it has no geometry or is not solved
    for the force. A product states the values that the maker of a muscle permits. A valve is used
    in a scenario as { library = NAME }, and a plant as [plant] library = NAME; `airmuscle simulate
    NAME` runs its example. A data set is used as FILES of `airmuscle fit`; that of a specimen is
    listed with its law. The provenance is the origin of the numbers: printed, measured, data sheet,
    secondary source, fitted or chosen.

    \b
    Examples:
      airmuscle list
      airmuscle list --json
    """
    rows = _library_rows()
    if json:
        print_json(rows)
    else:
        print_table({key: [row[key] for row in rows] for key in rows[0]})


def _library_rows() -> list[dict[str, str]]:
    """All library entries, valves, plants and data sets, read from the files without building any
    model.
    """
    kinds: dict[str, Callable[[Mapping[str, Any]], str]] = {
        "muscle or law": _law_kind,
        "valve": lambda tables: f"valve, {tables['valve']['model']}",
        "plant": lambda tables: f"plant, {tables['plant']['mechanism']['model']}",
        "product": lambda _: "product, Ratings",
    }
    data = {name: _data_row(DATA / f"{name}.csv") for name in list_data()}
    rows = []
    for noun, kind_of in kinds.items():
        for name in list_names(FOLDERS[noun]):
            tables = tomllib.loads((FOLDERS[noun] / f"{name}.toml").read_text(encoding="utf-8"))
            kind = kind_of(tables)
            provenance = tables["provenance"]
            if kind_of is _law_kind and name in data:  # one row with the data set of the same name
                measured = data.pop(name)
                kind = f"{kind}; {measured['kind']}"
                provenance = "; ".join(
                    filter(None, dict.fromkeys((provenance, measured["provenance"])))
                )
            rows.append(
                {"name": name, "title": tables["title"], "kind": kind, "provenance": provenance}
            )
    return [*rows, *data.values()]


def _law_kind(tables: Mapping[str, Any]) -> str:
    law = tables["characteristic"]
    has_force = issubclass(model_class(law["model"], tables["title"]), ForceLaw)
    is_muscle = has_force and ("geometry" in tables or "geometry" in law)
    return f"{'muscle' if is_muscle else 'characteristic'}, {law['model']}"


def _data_row(path: Path) -> dict[str, str]:
    """Title and provenance from the comments at the top of a data file."""
    with path.open(encoding="utf-8") as file:
        comments = list(itertools.takewhile(lambda line: line.startswith("#"), file))
    # the first comment is the title
    lines = [comment.lstrip("# ").strip() for comment in comments]
    text = " ".join(lines)
    title = lines[0] if lines else ""
    provenance = next((word for word in ("secondary source", "measured") if word in text), "")
    return {"name": path.stem, "title": title, "kind": "data set", "provenance": provenance}


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
