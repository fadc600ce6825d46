"""Writer of recordings as CSV, Parquet and HDF5, by the extension, and conversion to and from
pandas and xarray.
"""

import csv
import dataclasses
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...core import AirmuscleError, FileError, ParameterError, abridged, atomic_file, one_line
from ...recording.columns import split_unit
from ...recording.recording import Recording, column_heading
from .interpret import interpret
from .mapping import ColumnMapping, apply_mapping, check_mapped_columns, mapped_columns
from .tables import CONSTANT_UNITS, Channel, import_lab_package, is_number, merge_channels


def write(recording: Recording, path: str | Path, *, comments: bool = True) -> Path:
    """Write a recording in SI units as .csv, .parquet, .h5 or .hdf5, and return the path.

    The headings of a CSV file state the units; comments above them state origin, constants and
    notes. Without `comments` it has the headings and the rows alone, as other programs expect it
    (`pandas.read_csv(path)`). In the other formats, units are metadata of the columns, constants
    those of the file, and the notes are not contained. The file is replaced atomically: an existing
    file remains unchanged if writing fails.

    Raises ParameterError, or FileError for another extension, a missing package, or a file that
    cannot be written.
    """
    if not isinstance(recording, Recording):
        raise ParameterError(
            f"write: {one_line(recording)} is not a Recording. Pass the result of simulate, read or"
            " read_csv."
        )
    if not isinstance(path, str | Path):
        raise FileError(f"write: {abridged(path)} is not a path. Pass the name of a file.")
    path = Path(path)
    writer = _WRITERS.get(path.suffix.lower())
    if writer is None:
        raise FileError(
            f"{path}: a recording cannot be written as '{path.suffix}'; allowed:"
            f" {', '.join(EXTENSIONS)}."
        )
    try:
        with atomic_file(path) as temporary:
            writer(recording, temporary, path, comments)
    except AirmuscleError:
        raise
    except Exception as reason:  # each package raises its own exceptions
        text = getattr(reason, "strerror", None) or " ".join(str(reason).split())[:120]
        raise FileError(
            f"{path}: cannot be written ({text}). Choose an existing folder with write permission."
        ) from None
    return path


def _write_csv(recording: Recording, temporary: Path, path: Path, comments: bool) -> None:
    with temporary.open("w", encoding="utf-8", newline="") as file:
        if comments:
            file.write(f"# {_one_line(recording.origin)}\n")
            for name, value in recording.constants.items():
                unit = f" [{CONSTANT_UNITS[name]}]" if name in CONSTANT_UNITS else ""
                text = json.dumps(value, ensure_ascii=False)
                file.write(f"# {name}{unit} = {text}\n")
            for note in recording.notes:
                file.write(f"# Note: {_one_line(note)}\n")
        table = csv.writer(file, lineterminator="\n")
        table.writerow([column_heading(name) for name in recording])
        columns = [recording[name].tolist() for name in recording]
        table.writerows(zip(*columns, strict=True))


def _one_line(text: str) -> str:
    return " ".join(text.split())


def _columns(recording: Recording) -> list[tuple[str, str, Any]]:
    """Name, unit and values of every column."""
    headings = {name: split_unit(column_heading(name)) for name in recording}
    return [
        (plain if unit else name, unit or "", recording[name])
        for name, (plain, unit) in headings.items()
    ]


def _write_parquet(recording: Recording, temporary: Path, path: Path, comments: bool) -> None:
    arrow = import_lab_package("pyarrow", path)
    parquet = import_lab_package("pyarrow.parquet", path)
    columns = _columns(recording)
    fields = [
        arrow.field(name, arrow.float64(), metadata={"unit": unit}) for name, unit, _ in columns
    ]
    constants = {}
    for (
        name,
        value,
    ) in recording.constants.items():  # a text that looks like a number, such as `007`, is quoted
        is_text = isinstance(value, str) and (is_number(value) or value.startswith('"'))
        constants[name] = json.dumps(value, ensure_ascii=False) if is_text else str(value)
    schema = arrow.schema(fields, metadata=constants)
    table = arrow.Table.from_arrays(
        [arrow.array(values) for _, _, values in columns], schema=schema
    )
    parquet.write_table(table, str(temporary))


def _write_hdf5(recording: Recording, temporary: Path, path: Path, comments: bool) -> None:
    with import_lab_package("h5py", path).File(temporary, "w", track_order=True) as file:
        file.attrs.update(dict(recording.constants))
        for name, unit, values in _columns(recording):
            file.create_dataset(name.replace("/", "_"), data=values).attrs["unit"] = unit


_WRITERS: Mapping[str, Callable[[Recording, Path, Path, bool], None]] = {
    ".csv": _write_csv,
    ".parquet": _write_parquet,
    ".h5": _write_hdf5,
    ".hdf5": _write_hdf5,
}
EXTENSIONS = tuple(_WRITERS)
"""Extensions of the formats that can be written."""


def from_pandas(
    frame: Any,
    mapping: ColumnMapping = ColumnMapping(),
    *,
    origin: str = "data frame",
    **fields: Any,
) -> Recording:
    """A recording of a pandas.DataFrame, by the rules for files: `pressure [bar]` is converted to
    SI units; `mapping` and `fields` as in `read`.

    An index with a name, or each named level, becomes a column, such as `time [s]`. Dates are
    counted in seconds from the first. Raises ParameterError for another type, ColumnError or
    UnitError as `read`.
    """
    mapping = mapping.with_fields(fields)
    if (
        not hasattr(frame, "columns")
        or not hasattr(frame, "index")
        or not hasattr(frame, "reset_index")
    ):
        raise ParameterError(f"from_pandas: {type(frame).__name__} is not a pandas.DataFrame.")
    if any(name is not None for name in frame.index.names):
        frame = frame.reset_index()
    if not len(frame.columns) or not len(frame):
        raise ParameterError(f"from_pandas: {origin} has no columns or no rows.")
    series = [frame.iloc[:, i] for i in range(len(frame.columns))]
    dated = (column for column in series if column.dtype.kind == "M")
    text = "Column '{}' contains dates; time is counted from the first, {}."
    notes = tuple(text.format(column.name, column.iloc[0]) for column in dated)
    channels = []
    for (
        column
    ) in series:  # numbers, dates or durations where a column has such a type, otherwise texts
        kind = column.dtype.kind
        if kind in "Mm":
            values = column.to_numpy(dtype=f"{'datetime' if kind == 'M' else 'timedelta'}64[ns]")
        else:
            values = (
                np.asarray(column.to_numpy(), dtype=float)
                if kind in "biuf"
                else list(map(str, column))
            )
        channels.append(Channel(str(column.name), values))
    table = merge_channels(origin, channels, {})
    table = dataclasses.replace(table, rows=np.arange(len(frame)), notes=notes)
    check_mapped_columns(mapping, mapped_columns(table, mapping), table)
    return interpret(apply_mapping(table, mapping), mapping)


def to_xarray(recording: Recording) -> Any:
    """An xarray.Dataset over `time`, or over the row number without time; units, origin and
    constants are attributes. Raises AirmuscleError without the package xarray."""
    try:
        import xarray
    except ImportError:
        raise AirmuscleError(
            "to_xarray needs the package xarray; pip install xarray, or use to_pandas()."
        ) from None
    timed = "time" in recording.columns
    along = "time" if timed else "row"
    units = {name: split_unit(column_heading(name))[1] for name in recording}
    data = {
        name: (along, recording[name], {"units": unit} if unit else {})
        for name, unit in units.items()
        if name != "time"
    }
    rows = (
        ("time", recording["time"], {"units": "s"}) if timed else ("row", np.arange(len(recording)))
    )
    return xarray.Dataset(
        data, coords={along: rows}, attrs={"origin": recording.origin, **recording.constants}
    )
