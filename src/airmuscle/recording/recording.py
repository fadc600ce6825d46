"""The recording itself: SI columns on common rows, constants, and where it came from."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.arrays import Array
from ..core.errors import ColumnError, suggestion
from ..core.units import conversion
from .columns import quantity_of
from .heading import split_unit

if TYPE_CHECKING:
    import pandas as pd


@dataclasses.dataclass(frozen=True, eq=False)
class Recording:
    """Columns in SI units, each of shape (N,), that share their rows.

    `constants` hold what does not change in the run (resting_length [m], ambient [Pa], specimen);
    `origin` is a file's name, or how it was simulated; `notes` are what the reader should know of it; `units` are
    those that a file stated, before its columns became SI.
    """

    columns: Mapping[str, Array]
    origin: str
    constants: Mapping[str, float | str] = dataclasses.field(default_factory=dict)
    notes: tuple[str, ...] = ()
    units: Mapping[str, str] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        arrays = {name: np.asarray(values, dtype=float) for name, values in self.columns.items()}
        sizes = {name: values.shape for name, values in arrays.items()}
        if len(set(sizes.values())) > 1 or any(len(shape) != 1 for shape in sizes.values()):
            raise ColumnError(f"{self.origin}: columns must be vectors of one length; they are {sizes}.")
        arrays = {name: values.view() for name, values in arrays.items()}
        for values in arrays.values():
            values.setflags(write=False)
        object.__setattr__(self, "columns", arrays)

    def __getitem__(self, name: str) -> Array:
        """A column by its name; `contraction` and `length` follow from each other when L0 is known."""
        if name in self.columns:
            return self.columns[name]
        resting_length = self.constants.get("resting_length")
        if isinstance(resting_length, float | int):
            if name == "contraction" and "length" in self.columns:
                return (resting_length - self.columns["length"]) / resting_length
            if name == "length" and "contraction" in self.columns:
                return resting_length * (1.0 - self.columns["contraction"])
        known = list(self.columns)
        remedy = (
            " Give the resting length to have it from the length."
            if name == "contraction" and "length" in known
            else ""
        )
        raise ColumnError(
            f"{self.origin}: no column '{name}'; there are {', '.join(known)}.{suggestion(name, known)}{remedy}"
        )

    def __contains__(self, name: str) -> bool:
        try:
            self[name]
        except ColumnError:
            return False
        return True

    def __len__(self) -> int:
        return next(iter(self.columns.values())).size if self.columns else 0

    def __iter__(self) -> Iterator[str]:
        return iter(self.columns)

    def in_unit(self, name: str, unit: str | None) -> Array:
        """A column in this SI unit. A column of no known quantity was taken as it stood; the unit that its heading
        states, as in `height [mm]`, counts here, unless None is asked for, and its name is also 'height'. Raises
        ColumnError and UnitError."""
        for heading, values in self.columns.items():
            plain, stated = split_unit(heading)
            if stated is not None and name in (heading, plain):
                convert = conversion(stated, unit, where=f"{self.origin}, {heading}") if unit else np.asarray
                return np.asarray(convert(values))
        return self[name]

    def rows(self, chosen: Any) -> Recording:
        """The recording with only the rows picked by a mask, slice or index array."""
        return dataclasses.replace(self, columns={name: values[chosen] for name, values in self.columns.items()})

    def with_columns(self, **columns: Any) -> Recording:
        """The recording with further, or other, columns in SI units."""
        return dataclasses.replace(self, columns={**self.columns, **columns})

    def with_constants(self, **constants: float | str) -> Recording:
        """The recording with further, or other, constants."""
        return dataclasses.replace(self, constants={**self.constants, **constants})

    def to_pandas(self) -> pd.DataFrame:
        """A data frame whose headers carry the units: `pressure [Pa]`."""
        import pandas as pd

        return pd.DataFrame({column_heading(name): values for name, values in self.columns.items()})

    def plot(self, *names: str) -> Any:
        """Columns over time, or over the row number, one axis each; a Matplotlib figure."""
        from .plot import plot_recording

        return plot_recording(self, names)

    def __repr__(self) -> str:
        return f"Recording({self.origin}: {len(self)} rows of {', '.join(self.columns)})"

    def _repr_html_(self) -> str:
        note = "".join(f"<br>{n}" for n in self.notes)
        return f"<b>{self.origin}</b>{note}{self.to_pandas().describe().to_html(float_format='%.6g')}"


def column_heading(name: str) -> str:
    """A column's heading with its unit, as files and data frames carry it."""
    quantity = quantity_of(name)
    return f"{name} [{quantity.unit}]" if quantity else name
