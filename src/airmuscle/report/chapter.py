"""Building blocks of a report: a chapter describes one result, and every outlet is a renderer of
it.

`text` renders the brief view in a terminal, `data` everything as JSON, `html` the page, `notebook`
a card. Numbers are in SI units; the unit in which a column or quantity is shown is declared with
it.
"""

import dataclasses
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from .. import report
from ..core import Reference, ShortRepr
from .formatting import DIGITS

BY_ROW = "by row"
"""Unit of a column whose numbers have the unit in the column "unit" of their row."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class TableColumn(ShortRepr):
    """A column of a table: numbers in SI units, or texts.

    values  numbers, texts, truth values, pairs (first, last) of a range; None where there is no
            value
    unit    SI unit of the numbers, "1" of a ratio, BY_ROW; empty for texts and counts
    shown   unit in which the page, the terminal and the CSV file show them, by default `unit`; of
            the column "unit", a sequence of the units in which the numbers of each row are shown
    digits  significant digits that are shown
    brief   whether the brief view has the column
    short   heading in the brief view, if the name is too long for a terminal
    """

    values: Any
    unit: str = ""
    shown: str | Sequence[str] = ""
    digits: int = DIGITS
    brief: bool = True
    short: str = ""

    def __post_init__(self) -> None:
        values: Any = self.values
        object.__setattr__(
            self, "values", values.tolist() if hasattr(values, "tolist") else list(values)
        )

    def __len__(self) -> int:
        return len(self.values)

    def __iter__(self) -> Iterator[Any]:
        return iter(self.values)

    def __getitem__(self, row: int) -> Any:
        return self.values[row]


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Table(ShortRepr):
    """A titled table, written to data/<name>.csv.

    columns  by name; values alone are a column without unit, whose name may end with one, `pressure
             [MPa]`
    shown    whether the page has it
    series   whether it is a long series, which only its file has
    folded   whether the page shows its title alone until the reader unfolds it
    head     rows that the page shows before the reader unfolds the others; 0 for all
    brief    rows of the brief view: the first ones, or the indices of some; 0 for none
    key      name in JSON, by default `name`; several chapters of a report may have a table of the
             same key
    """

    name: str
    title: str
    columns: Mapping[str, Any]
    note: str = ""
    _: dataclasses.KW_ONLY
    shown: bool = True
    series: bool = False
    folded: bool = False
    head: int = 0
    brief: int | Sequence[int] = 0
    key: str = ""

    def __post_init__(self) -> None:
        made = {
            key: column if isinstance(column, TableColumn) else TableColumn(column)
            for key, column in self.columns.items()
        }
        lengths = {key: len(column.values) for key, column in made.items()}
        if len(set(lengths.values())) > 1:
            raise ValueError(
                f"table {self.name}: all columns must have the same length, not {lengths}."
            )
        vars(self).update(
            columns=made, shown=self.shown and not self.series, key=self.key or self.name
        )

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())).values) if self.columns else 0

    @property
    def brief_rows(self) -> list[int]:
        """The indices of the rows of the brief view."""
        return (
            list(range(len(self)))[: self.brief]
            if isinstance(self.brief, int)
            else list(self.brief)
        )


@dataclasses.dataclass(frozen=True)
class NamedValue:
    """A scalar result: a number in SI units, or a text; `remark` is a short addition, such as
    "solved".
    """

    name: str
    value: Any
    unit: str = ""
    shown: str = ""
    digits: int = DIGITS
    remark: str = ""
    brief: bool = True


@dataclasses.dataclass(frozen=True, eq=False)
class Plot:
    """A figure with its caption. Embedded in the page and written to figures/<name>.svg and .png.

    figure  a Matplotlib figure, a function that draws one, or the files of a rendered one by their
            format
    """

    name: str
    caption: str
    figure: Any

    def draw(self) -> Any:
        """The figure, or the files of a rendered one."""
        return self.figure() if callable(self.figure) else self.figure


@dataclasses.dataclass(frozen=True, eq=False)
class DisplayedEquation:
    """An equation in LaTeX, one entry of `lines` for each definition, and its source text by
    language.
    """

    name: str
    title: str
    lines: tuple[str, ...]
    note: str
    sources: Mapping[str, str]


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Chapter(ShortRepr):
    """The description of one result: summary, values, tables, figures, notes, references, sources
    of all values.

    name      identifier in the page and in JSON
    summary   paragraphs, as a tuple or separated by blank lines; the first states the result in a
              sentence or two
    problems  faults of the data that make results wrong
    notes     remarks on the data and what to do
    brief     whether the brief view has the chapter
    """

    name: str
    title: str
    summary: str | tuple[str, ...]
    claims: "tuple[report.Claim, ...]" = ()
    tables: tuple[Table, ...] = ()
    plots: tuple[Plot, ...] = ()
    references: tuple[Reference, ...] = ()
    chosen: tuple[tuple[str, str, str], ...] = ()
    """Values used for the figures: (meaning, value with unit, source or "chosen")."""
    equations: tuple[DisplayedEquation, ...] = ()
    values: tuple[NamedValue, ...] = ()
    problems: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    brief: bool = True
    answers: tuple[tuple[str, str], ...] = ()
    """Questions of a reader with answers of one sentence or two, before the summary."""
    terms: tuple[tuple[str, str], ...] = ()
    """Terms of the chapter with their definitions, after the answers."""
    commands: tuple[tuple[str, str], ...] = ()
    """Commands that evaluate a model of the chapter with other parameters, each with what it
    shows.
    """
    opening: bool = False
    """Whether the page begins with it, before the contents: figure and values side by side."""

    @property
    def paragraphs(self) -> tuple[str, ...]:
        """The paragraphs of the summary."""
        if not isinstance(self.summary, str):
            return tuple(text for text in self.summary if text)
        return tuple(
            " ".join(part.split()) for part in re.split(r"\n\s*\n", self.summary) if part.strip()
        )

    def among(self, prefix: str = "", suffix: str = "") -> "Chapter":
        """The chapter with names of itself, its tables and figures that are unique among others of
        its kind.
        """
        named: dict[str, Any] = {
            kind: tuple(
                dataclasses.replace(item, name=f"{prefix}{item.name}{suffix}")
                for item in getattr(self, kind)
            )
            for kind in ("tables", "plots")
        }
        return dataclasses.replace(self, name=f"{prefix}{self.name}{suffix}", **named)
