"""Recording: SI columns with common rows, constants and origin, its notes on rows, and its display
in a notebook.
"""

import dataclasses
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import recording as room
from ..core import Array, Reference, check_field_types, conversion, install_command, one_line
from ..core.errors import (
    AirmuscleError,
    ColumnError,
    HintedText,
    ParameterError,
    alternatives,
    listed,
)
from .columns import ZERO_NOT_STATED, display_scale, quantity_of, split_unit
from .notebook import Card, NotebookDisplay

if TYPE_CHECKING:
    import pandas as pd

MAX_PANELS = 4
MAX_POINTS = 20_000
"""Maximum number of panels, and of rows of the chart; of more, every n-th row is drawn."""
ROUNDING = 1e-12
"""Values below this fraction of the largest one of a column are shown as 0 (chosen)."""
MAX_REPR = 400
"""Maximum number of characters of the names of the columns in a representation."""


@dataclasses.dataclass(frozen=True, eq=False)
class Recording(NotebookDisplay):
    """Columns in SI units, each of shape (N,), with common rows.

    columns    values by column name
    origin     name of the file, or description of the simulation
    constants  constants of the run: resting_length [m], ambient [Pa], ambient_temperature [K],
               specimen
    notes      notes for the user, such as assumptions made by the reader
    units      units stated in the file, before conversion to SI
    references sources: of published measurements, or of the models of a simulation
    headings   in the file, by column name, of columns whose quantity the words of the heading
               state; such a column has the name in its heading, too: `p1` of `p1 [kPa]`
    """

    columns: Mapping[str, Array]
    origin: str
    constants: Mapping[str, float | str] = dataclasses.field(default_factory=dict)
    notes: tuple[str, ...] = ()
    units: Mapping[str, str] = dataclasses.field(default_factory=dict)
    references: tuple[Reference, ...] = ()
    headings: Mapping[str, str] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        check_field_types(self)
        arrays: dict[str, Array] = {}
        for name, values in self.columns.items():
            try:
                arrays[name] = np.asarray(values, dtype=float).view()
            except (TypeError, ValueError, OverflowError):
                raise ColumnError(
                    f"{self.origin}: column '{one_line(name)}' is {one_line(values)}; it must be an"
                    " array of numbers."
                ) from None
        sizes = {name: vector.shape for name, vector in arrays.items()}
        if len(set(sizes.values())) > 1 or any(len(shape) != 1 for shape in sizes.values()):
            raise ColumnError(
                f"{self.origin}: columns must be vectors of equal length; their shapes are {sizes}."
            )
        for vector in arrays.values():
            vector.setflags(write=False)
        object.__setattr__(self, "columns", arrays)

    @classmethod
    def from_arrays(
        cls,
        columns: Mapping[str, Array],
        origin: str,
        constants: Mapping[str, float | str],
        notes: tuple[str, ...],
        references: tuple[Reference, ...],
    ) -> "Recording":
        """A recording of read-only vectors of one length, which are not checked again."""
        recording = object.__new__(cls)
        recording.__dict__.update(
            columns=columns,
            origin=origin,
            constants=constants,
            notes=notes,
            units={},
            references=references,
            headings={},
        )
        return recording

    def __getitem__(self, name: str) -> Array:
        """A column by its name, shape (N,). `contraction` and `length` are converted into each
        other if the resting length is known. Raises ColumnError for an unknown column."""
        if not isinstance(name, str):
            raise ColumnError(
                f"{self.origin}: no column '{one_line(name)}'; the columns are"
                f" {listed(self.columns)}."
            )
        values = self._column(name)
        if values is not None:
            return values
        remedy: str = ""
        moved = next(
            (quantity for quantity in ("length", "shortening") if quantity in self.columns), ""
        )
        if name == "contraction" and moved:
            remedy = f" Specify the resting length to convert the {moved} to a contraction."
        elif name == "contraction" and "position" in self.columns:
            remedy = HintedText(" ", ZERO_NOT_STATED)
        text = (
            f"{self.origin}: no column"
            f" '{name}'{alternatives(name, list(self.columns), 'the columns are')}"
        )
        raise ColumnError(HintedText(text, remedy))

    def _column(self, name: str) -> Array | None:
        column = self._name_of(name)
        if column in self.columns:
            return self.columns[column]
        length = self.constants.get("resting_length")
        if name not in ("contraction", "length") or not isinstance(length, float | int):
            return None
        if name == "contraction" and "length" in self.columns:
            return (length - self.columns["length"]) / length
        contraction = self.columns.get("contraction")
        if contraction is None and "shortening" in self.columns:
            contraction = self.columns["shortening"] / length
        return (
            contraction
            if contraction is None or name == "contraction"
            else length * (1.0 - contraction)
        )

    def _name_of(self, name: str) -> str:
        """The name of the column that a file has under another name, complete or without unit;
        `name` itself if there is none.
        """
        if name in self.columns:
            return name
        for column, heading in self.headings.items():
            if column in self.columns and name in (heading, split_unit(heading)[0]):
                return column
        return name

    def __contains__(self, name: str) -> bool:
        return isinstance(name, str) and self._column(name) is not None

    def __len__(self) -> int:
        return next(iter(self.columns.values())).size if self.columns else 0

    def __iter__(self) -> Iterator[str]:
        return iter(self.columns)

    def names(self) -> set[str]:
        """The names that `in_unit` takes: those of the columns, complete or without unit, and those
        in the file.
        """
        texts = [*self.columns, *(self.headings[name] for name in self if name in self.headings)]
        return {*texts, *(split_unit(text)[0] for text in texts)}

    def in_unit(self, name: str, unit: str | None) -> Array:
        """A column in the given SI unit, shape (N,).

        A column of an unknown quantity, such as `height [mm]`, is stored without conversion. It is
        converted here from the unit in its heading, unless `unit` is None; its name may be
        'height'. A column that was read as a quantity by the words of its heading is in SI, and may
        be asked for by its name in the file. Raises ColumnError or UnitError.
        """
        for heading, values in self.columns.items():
            plain, heading_unit = split_unit(heading)
            if heading_unit is not None and name in (heading, plain):
                convert = (
                    conversion(heading_unit, unit, where=f"{self.origin}, {heading}")
                    if unit
                    else np.asarray
                )
                return np.asarray(convert(values))
        column = self._name_of(name)
        quantity = quantity_of(column)
        if unit and quantity and column != name:
            conversion(quantity.unit, unit, where=f"{self.origin}, {self.headings[column]}")
        return self[name]

    def rows(self, selection: Any) -> "Recording":
        """The recording reduced to the rows that a mask, slice or index array selects; itself for a
        mask of all.
        """
        if isinstance(selection, np.ndarray) and selection.dtype == bool and selection.all():
            return self
        return dataclasses.replace(
            self, columns={name: values[selection] for name, values in self.columns.items()}
        )

    def with_columns(self, **columns: Any) -> "Recording":
        """The recording with added or replaced columns in SI units."""
        return dataclasses.replace(self, columns={**self.columns, **columns})

    def with_constants(self, **constants: float | str) -> "Recording":
        """The recording with added or replaced constants."""
        return dataclasses.replace(self, constants={**self.constants, **constants})

    def to_pandas(self) -> "pd.DataFrame":
        """The recording as a data frame with units in the column headings: `pressure [Pa]`."""
        try:
            import pandas as pd
        except ImportError:
            raise AirmuscleError(
                f"to_pandas needs the package pandas. Install it: {install_command('lab')}"
            ) from None

        return pd.DataFrame({column_heading(name): values for name, values in self.columns.items()})

    def plot(self, *names: str, ax: Any = None) -> Any:
        """Plot the named columns, or all, over time or else the row number, each quantity in one
        panel.

        `ax` is a Matplotlib Axes, or a sequence of one for each panel; it is returned. Without it,
        a new figure is returned. Raises ColumnError for an unknown column, ParameterError if `ax`
        contains too few Axes.
        """
        columns = {name: self[name] for name in names or self if name != "time"}
        return room.plot_columns(
            columns, self.columns.get("time"), self.origin, ax=ax, ordered=not names
        )

    def animate(self, plant: Any, speed: float = 1.0) -> Any:
        """An animation of this run of a plant: a joint of two muscles, or a load on one muscle.

        The muscles bulge as their geometry does and are coloured by their pressure. `speed` is that
        of the display, 1 for real time. `animation.save("run.gif")` writes it (.gif, .mp4, .html),
        `animation.still(time)` is the figure at a time [s]; a notebook shows it. Raises
        ParameterError for another plant, ColumnError for a missing column.
        """
        if not hasattr(plant, "animate"):
            raise ParameterError(
                f"animate: {one_line(plant)} is no plant; give the Plant of the run."
            )
        return plant.animate(self, speed)

    def __repr__(self) -> str:
        shown = textwrap.shorten(
            ", ".join(self.columns), MAX_REPR, placeholder=f" ... ({len(self.columns)} columns)"
        )
        return f"Recording({self.origin}: {len(self)} rows of {shown})"

    def _card(self) -> Card:
        return recording_card(self, {})


def resting_length_of(recording: Recording) -> float | None:
    """The resting length [m] that a recording states, to nine digits, so that equal ones are equal;
    None without one.
    """
    stated = recording.constants.get("resting_length")
    return None if stated is None else float(f"{float(stated):.9g}")


def column_heading(name: str) -> str:
    """The heading of a column with its SI unit, for files and data frames: `pressure [Pa]`."""
    quantity = quantity_of(name)
    return f"{name} [{quantity.unit}]" if quantity else name


def recording_card(recording: Any, units: Mapping[str, str]) -> Card:
    """The display of a Recording; `units` are SI units of columns that are no known quantity."""
    rows: list[tuple[str, ...]] = [("column", "unit", "first", "minimum", "maximum", "last")]
    for name, values in recording.columns.items():
        factor, unit = display_scale(name)
        texts = _characteristic_values(values, factor)
        rows.append((name, unit or units.get(name, ""), *texts))

    def draw() -> Any:
        step = -(-len(recording) // MAX_POINTS)
        every = slice(None, None, max(1, step))
        columns = {name: values[every] for name, values in recording.columns.items()}
        time = columns.pop("time", None)
        return room.plot_columns(columns, time, recording.origin, units=units, limit=MAX_PANELS)

    count = len(recording)
    title = f"{recording.origin}: {count} rows of {len(recording.columns)} columns"
    return Card(title, rows, draw if count else None, recording.notes)


def _characteristic_values(values: Array, factor: float) -> list[str]:
    """First, smallest, largest and last of the finite values times a factor."""
    finite = values[np.isfinite(values)] * factor
    if not finite.size:
        return []
    sizes = np.abs(finite)
    finite[sizes < ROUNDING * np.max(sizes)] = 0.0
    numbers = (finite[0], finite.min(), finite.max(), finite[-1])
    return [f"{number:.4g}" for number in numbers]


class RowNote(str):
    """Note on rows that were left out or filled, which the commands print and the reports
    contain.
    """

    __slots__ = ()


def row_notes(recordings: Iterable[Recording]) -> list[str]:
    """The notes of the recordings on rows that were left out or filled, each once."""
    return list(
        dict.fromkeys(
            note
            for recording in recordings
            for note in recording.notes
            if isinstance(note, RowNote)
        )
    )


def list_rows(label: str, rows: Sequence[Any] | Any, most: int) -> str:
    """The first of the row numbers, with the word for a row: `lines 12, 15 and 5 more`."""
    if len(rows) == 1:
        return f"{label} {rows[0]}"
    shown = [str(row) for row in rows[:most]]
    if len(rows) > most:
        shown.append(f"{len(rows) - most} more")
    *leading, last = shown
    return f"{label}s {', '.join(leading)} and {last}"
