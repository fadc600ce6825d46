"""Names of the columns of a table: quantities that the words of their headings state, and a name of
its own for each sensor of one quantity.
"""

import collections
import dataclasses
from collections.abc import Mapping, Sequence

from ...recording.columns import Heading, find_quantity_name, parse_heading
from ...recording.vocabulary import Certainty, Reading, read_heading, referred_unit
from .tables import RawTable, parse_constant_name


@dataclasses.dataclass(frozen=True)
class ReadColumn:
    """A column as its heading, the row of units and the user state it.

    heading  with quantity and unit, as they are read
    reading  of the words of the heading; None where its whole name is a quantity, or no word is one
    is_first whether it is the first column of its table
    """

    heading: Heading
    reading: Reading | None = None
    is_first: bool = False

    @property
    def is_open(self) -> bool:
        """Whether its words state a quantity, but not enough to read it."""
        return self.reading is not None and not self.heading.known


def read_columns(table: RawTable, user_units: Mapping[str, str]) -> list[ReadColumn]:
    """The columns of a table, with units by the user, the unit row or the heading, in this order.

    user_units  by quantity or heading
    """
    below_all = [*(table.units or ()), *[""] * len(table.headings)]
    columns = []
    for text, below in zip(table.headings, below_all, strict=False):
        if text in table.fields:
            columns.append(ReadColumn(Heading(text, text, below or None, False)))
        else:
            columns.append(_column(text, below, user_units))
    columns[:1] = [dataclasses.replace(column, is_first=True) for column in columns[:1]]
    return _named_apart(_one_time(columns))


def _column(text: str, below: str, user_units: Mapping[str, str]) -> ReadColumn:
    parsed = parse_heading(text)
    if parsed.known:
        stated = user_units.get(parsed.name, user_units.get(text))
        unit = stated or below or parsed.unit
        if not stated and unit and parsed.target == "Pa":
            unit = referred_unit(text, unit)
        return ReadColumn(dataclasses.replace(parsed, unit=unit))
    if parse_constant_name(text) is not None:
        return ReadColumn(dataclasses.replace(parsed, unit=below or None))
    stated = user_units.get(text)
    reading = read_heading(text, stated or below)
    if reading is not None and reading.unit is None and reading.quantity in user_units:
        stated = user_units[reading.quantity]
        reading = read_heading(text, stated)
    if reading is None or reading.certainty is Certainty.OPEN:
        return ReadColumn(dataclasses.replace(parsed, unit=stated or below or None), reading)
    unit = stated or reading.unit
    heading = Heading(text, reading.quantity, unit, True, reading.certainty.value)
    return ReadColumn(heading, reading)


def _one_time(columns: Sequence[ReadColumn]) -> list[ReadColumn]:
    """The columns with one time: of several, the first that states its unit; dates and counters
    beside it are kept as they are.
    """
    times = [column for column in columns if column.heading.name == "time"]
    if len(times) < 2:
        return list(columns)
    chosen = next((column for column in times if column.heading.unit), times[0])
    return [
        ReadColumn(dataclasses.replace(column.heading, name=column.heading.text, known=False))
        if column in times and column is not chosen and column.heading.text != chosen.heading.text
        else column
        for column in columns
    ]


def _named_apart(columns: Sequence[ReadColumn]) -> list[ReadColumn]:
    """The columns of which those of one quantity have names of their own, `df.pressure`; one that
    alone is of the muscle has the bare name. Columns that cannot be told apart are open.
    """
    by_name: dict[str, list[int]] = collections.defaultdict(list)
    for i, column in enumerate(columns):
        if column.heading.known:
            by_name[column.heading.name].append(i)
    named = list(columns)
    for quantity, indices in by_name.items():
        if any(columns[i].reading is not None for i in indices):
            for i, name in _names(quantity, [(i, columns[i]) for i in indices]).items():
                heading = columns[i].heading
                named[i] = dataclasses.replace(
                    columns[i],
                    heading=dataclasses.replace(
                        heading, name=name or heading.text, known=bool(name)
                    ),
                )
    return named


def _names(quantity: str, columns: Sequence[tuple[int, ReadColumn]]) -> dict[int, str]:
    """A name for each column of a quantity, by its index; empty where none tells it apart."""
    words = {i: _words(column) for i, column in columns}
    foreign = [i for i, column in columns if column.reading and column.reading.is_foreign]
    own = [i for i, _ in columns if i not in foreign]
    plain = [i for i in own if not words[i]]
    if len(own) == 1:
        plain = own
    shared = set[str].intersection(*(set(words[i]) for i in words)) if len(words) > 1 else set()
    names = {}
    for i, _ in columns:
        prefix = "_".join(word for word in words[i] if word not in shared)
        if prefix.replace("_", "").isdigit():
            prefix = f"sensor{prefix}"
        names[i] = quantity if plain == [i] else f"{prefix}.{quantity}" if prefix else ""
    counts = collections.Counter(names.values())
    strict = {i for i, column in columns if column.reading is None}
    return {
        i: quantity if i in strict else name if counts[name] == 1 else ""
        for i, name in names.items()
    }


def _words(column: ReadColumn) -> tuple[str, ...]:
    return () if column.reading is None else column.reading.qualifiers


def quantities_of_units(units: Mapping[str, str]) -> dict[str, str]:
    """Units by quantity or heading, with the names of quantities."""
    return {find_quantity_name(key) or key: unit for key, unit in units.items()}
