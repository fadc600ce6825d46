"""Contents of MATLAB files, v4 to v7.3: variables, of which long ones are reduced while they are
read, and objects.

Of version 7.3, which is HDF5, at most a piece of one dataset is in memory at once. Of the versions
before, whose variables are compressed as a whole, it is one variable where one is long; a struct is
one variable.

MATLAB stores an object as an opaque variable, whose values are in a separate part of the file. The
package mat-io decodes tables and timetables; without it, and of another class, an object is named
with the command that exports it.
"""

import contextlib
import dataclasses
import functools
import struct
import warnings
import zlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np

from ....core import Array, FileError
from ..tables import (
    Downsampling,
    Reduction,
    check_reduced_lengths,
    import_lab_package,
    is_installed,
)
from .raw_hdf5 import check_no_external_links, check_own_dataset, check_own_values

MAX_CELLS = 10_000
"""Maximum number of elements of a cell array of version 7.3 that is read, such as names of columns
(chosen).
"""
_HDF5 = b"\x89HDF\r\n\x1a\n"
_USER_BLOCK = 512
"""Signature of HDF5, and its place behind the header of MATLAB, whose text other programs write
differently.
"""
_INTERNAL = ("__", "#")
"""Beginnings of names that no MATLAB variable has: header, function workspace, references,
subsystem.
"""
_UNNAMED = "None"
"""Name that SciPy gives to objects."""


@dataclasses.dataclass(frozen=True, eq=False)
class MatContents:
    """The variables of a file with reduced arrays, the reduction of each struct, and notes on what
    was not read.
    """

    variables: Mapping[str, Any]
    reductions: Mapping[str, Reduction]
    notes: tuple[str, ...] = ()


def _beginning(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(_USER_BLOCK + len(_HDF5))


def is_plain_hdf5(path: Path) -> bool:
    """Whether a file is HDF5 without the header of MATLAB, as h5py writes it."""
    head = _beginning(path)
    return not head.startswith(b"MATLAB") and _HDF5 in (head[: len(_HDF5)], head[_USER_BLOCK:])


def read_contents(path: Path, downsampling: Downsampling) -> MatContents:
    """The contents of a file; objects of MATLAB are not among them. Raises FileError, and what
    SciPy or h5py raise.
    """
    head = _beginning(path)
    reductions = dict[str, Reduction]()
    if head.startswith(b"MATLAB 7.3") or head[_USER_BLOCK:] == _HDF5:
        h5py = import_lab_package("h5py", path)
        with h5py.File(path, "r") as file:
            check_own_values(h5py, file, path)
            check_no_external_links(h5py, file, path)
            reader = _Hdf5Reader(h5py, file, downsampling, path.name)
            return MatContents(reader.fields(file), reader.reductions, tuple(reader.notes))
    from scipy.io import loadmat, whosmat

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # about objects, which `find_objects` names
        try:
            shapes = whosmat(str(path))
        except (
            TypeError
        ):  # an object, whose header SciPy does not read: the file is read as a whole
            shapes = []
        long = any(max(shape, default=0) > downsampling.max_rows for _, shape, _ in shapes)
        structs = any(kind in ("struct", "cell") for _, _, kind in shapes)
        one_by_one = long or (structs and path.stat().st_size > downsampling.max_rows)
        longest = max(
            (max(s) for _, s, kind in shapes if kind not in ("struct", "cell") and s), default=0
        )
        variables: dict[str, Any] = {}
        for names in [[name] for name, _, _ in shapes] if one_by_one else [None]:
            read = loadmat(str(path), variable_names=names, simplify_cells=True, appendmat=False)
            fields = {
                key: value
                for key, value in read.items()
                if not key.startswith(_INTERNAL) and key != _UNNAMED
            }
            variables |= _reduced(path.name, "", fields, downsampling, reductions, longest)
    return MatContents(variables, reductions)


def _reduced(
    origin: str,
    name: str,
    fields: Mapping[str, Any],
    downsampling: Downsampling,
    reductions: dict[str, Reduction],
    longest: int = 0,
) -> dict[str, Any]:
    """The fields of a struct with reduced arrays; `reductions` receives that of each struct."""
    arrays = {
        key: value.reshape(-1) if 1 in value.shape else value
        for key, value in fields.items()
        if isinstance(value, np.ndarray)
        and value.dtype.kind in "biuf"
        and 0 < value.ndim <= 2
        and value.size > 1
    }
    reduction = Reduction(downsampling, max([longest, *map(len, arrays.values())]))
    if arrays:
        reductions[name] = reduction
    result = dict(fields)
    for key, value in fields.items():
        if isinstance(value, Mapping):
            result[key] = _reduced(
                origin, f"{name}.{key}".lstrip("."), value, downsampling, reductions
            )
        elif key in arrays:
            result[key] = reduction.read(functools.partial(_slice, arrays[key]), len(arrays[key]))
    check_reduced_lengths(origin, map(len, arrays.values()), (len(result[key]) for key in arrays))
    return result


def _slice(array: Array, first: int, end: int) -> Array:
    return array[first:end]


class _Hdf5Reader:
    """The reader of a file of version 7.3, which stores the axes of MATLAB in reverse order."""

    def __init__(self, h5py: Any, file: Any, downsampling: Downsampling, origin: str) -> None:
        self._h5py = h5py
        self._file = file
        self._downsampling = downsampling
        self._origin = origin
        self.reductions: dict[str, Reduction] = {}
        self.notes: list[str] = []

    def fields(self, group: Any, place: str = "", *, in_cell: bool = False) -> dict[str, Any]:
        """The variables of a file or the fields of a struct with reduced arrays, which a struct in
        a cell has whole.
        """
        items = {
            name: group[name]
            for name in group
            if not name.startswith(_INTERNAL)
            and isinstance(group.get(name, getlink=True), self._h5py.HardLink)
        }
        arrays = {
            key: dataset
            for key, dataset in items.items()
            if self._is_array(dataset) and dataset.ndim <= 2 and not in_cell
        }
        shapes = {key: dataset.shape for key, dataset in arrays.items()}
        rows = {
            key: max(shape) if len(shape) == 1 or 1 in shape else shape[-1]
            for key, shape in shapes.items()
        }
        reduction = Reduction(self._downsampling, max(rows.values(), default=0))
        if arrays:
            self.reductions[place] = reduction
        contents = {}
        for key, item in items.items():
            if key in arrays:
                contents[key] = reduction.read(functools.partial(_rows, item), rows[key])
            else:
                contents[key] = self._value(item, f"{place}.{key}".lstrip("."), in_cell)
        check_reduced_lengths(self._origin, rows.values(), (len(contents[key]) for key in arrays))
        return {key: value for key, value in contents.items() if value is not None}

    def _is_array(self, item: Any) -> bool:
        """Whether a variable, a field or an element contains several real numbers."""
        numeric = (
            isinstance(item, self._h5py.Dataset) and item.dtype.kind in "biuf" and item.size != 1
        )
        return (
            numeric
            and not _is_absent(item)
            and _class_of(item) not in ("", "char", "function_handle")
        )

    def _value(self, item: Any, place: str, in_cell: bool) -> Any:
        """A variable, a field or an element of a cell array; None if it is empty or not read."""
        check_own_dataset(self._h5py, item, self._origin)
        kind = _class_of(item)
        is_group = isinstance(item, self._h5py.Group)
        if is_group and "MATLAB_sparse" not in item.attrs:
            return self.fields(item, place, in_cell=in_cell)
        if _is_absent(item):
            return None
        if kind == "char":
            return "".join(map(chr, item[()].T.ravel().tolist()))
        if self._is_array(item):
            matrix = np.asarray(item[()].T)
            return matrix.reshape(-1) if matrix.size == max(matrix.shape, default=0) else matrix
        is_dataset = isinstance(item, self._h5py.Dataset)
        if is_dataset and item.dtype.kind in "biuf" and kind not in ("", "function_handle"):
            return float(item[()].item())
        if (
            is_dataset
            and self._h5py.check_ref_dtype(item.dtype) is not None
            and item.size <= MAX_CELLS
        ):
            return [
                self._value(self._file[reference], place, True) for reference in item[()].ravel()
            ]
        kinds = {"cell": "a cell array", "function_handle": "a function"}
        what = "a sparse matrix" if is_group else kinds.get(kind, "which contains no real numbers")
        self.notes.append(f"Not read: {place}, {what}.")
        return None


def _is_absent(item: Any) -> bool:
    """Whether an item is empty, or an object, which is named elsewhere."""
    without_values = "MATLAB_empty" in item.attrs or not getattr(item, "size", 1)
    return without_values or item.attrs.get("MATLAB_object_decode", 0) == 3


def _class_of(item: Any) -> str:
    stated = item.attrs.get("MATLAB_class", b"")
    return stated.decode(errors="replace") if isinstance(stated, bytes) else str(stated)


def _rows(dataset: Any, first: int, end: int) -> Array:
    """Rows of MATLAB, of which a vector has as many as values."""
    if dataset.ndim == 2 and 1 not in dataset.shape:
        return np.asarray(dataset[:, first:end].T)
    is_row = dataset.shape[-1] > 1
    values = dataset[..., first:end] if is_row else dataset[first:end, ...]
    return np.asarray(values).reshape(-1)


# Objects

READABLE = ("table", "timetable")
"""Classes whose objects can be read."""
_PACKAGE = "matio"
_COMPRESSED = 15
_MATRIX = 14
_OPAQUE_CLASS = 17
"""Numbers of the format: compressed element, array element, class of an opaque array."""
_HEADER = 128
_HEAD = 2048
"""Bytes of the header of a file, and of the beginning of a variable that contains its name and
class.
"""
_NUMERIC = {
    "double",
    "single",
    "logical",
    "char",
    "cell",
    "struct",
    "function_handle",
    "canonical empty",
}


class MatlabObject(NamedTuple):
    """An object in a MAT file: the name of the variable and its MATLAB class."""

    name: str
    class_name: str

    def __str__(self) -> str:
        return f"{self.name} is a MATLAB {self.class_name}"

    @property
    def export(self) -> str:
        """The MATLAB command that exports the object as a struct with vectors."""
        name = self.name
        if self.class_name == "timeseries":
            return f"S = struct('time', {name}.Time, 'force', {name}.Data); save('data.mat', 'S')"
        inner = f"timetable2table({name})" if self.class_name == "timetable" else name
        return f"S = table2struct({inner}, 'ToScalar', true); save('data.mat', 'S')"


def find_objects(path: Path) -> tuple[MatlabObject, ...]:
    """The objects among the variables of a MAT file, of version 5 to 7.3; empty for a damaged
    file.
    """
    with path.open("rb") as file:
        header = file.read(_HEADER)
        if header[126:128] not in (b"IM", b"MI"):
            return ()
        if header[125 if header[126:128] == b"IM" else 124] == 2:
            return tuple(_hdf5_objects(path))
        try:
            return tuple(_objects(file, "<" if header[126:128] == b"IM" else ">"))
        except (struct.error, zlib.error, IndexError, UnicodeDecodeError):
            return ()


def _objects(file: IO[bytes], order: str) -> Iterator[MatlabObject]:
    """The opaque variables of a file of version 5 to 7, from the beginning of each variable."""
    while len(tag := file.read(8)) == 8:
        kind, size = struct.unpack(f"{order}2I", tag)
        head = file.read(min(size, _HEAD))
        file.seek(size - len(head), 1)
        if kind == _COMPRESSED:
            head = zlib.decompressobj().decompress(head, _HEAD)
            kind = struct.unpack(f"{order}I", head[:4])[0]
            head = head[8:]
        if (
            kind == _MATRIX
            and len(head) >= 16
            and struct.unpack(f"{order}I", head[8:12])[0] & 0xFF == _OPAQUE_CLASS
        ):
            name, _, class_name = _texts(head[16:], order)
            yield MatlabObject(name, class_name)


def _texts(data: bytes, order: str) -> list[str]:
    """The three texts at the beginning of an opaque array: name, type system and class."""
    texts = []
    for _ in range(3):
        kind, size = struct.unpack(f"{order}2I", data[:8])
        if kind >> 16:  # a short element: its size and its data are in the tag
            size = kind >> 16
            start = 4
            length = 8
        else:
            start = 8
            length = 8 + (size + 7) // 8 * 8
        texts.append(data[start : start + size].decode("ascii"))
        data = data[length:]
    return texts


def _hdf5_objects(path: Path) -> Iterator[MatlabObject]:
    """The opaque variables of a file of version 7.3, whose reader states a missing package or a
    damage.
    """
    with (
        contextlib.suppress(OSError, FileError),
        import_lab_package("h5py", path).File(path, "r") as file,
    ):
        for name, item in file.items():
            is_opaque = item.attrs.get("MATLAB_object_decode", 0) == 3
            if not name.startswith("#") and is_opaque and _class_of(item) not in _NUMERIC:
                yield MatlabObject(name, _class_of(item))


def read_objects(path: Path, objects: Sequence[MatlabObject]) -> dict[str, Mapping[str, Any]]:
    """The numeric columns of the tables and timetables, by variable; with their units in `units`,
    if stated. Empty without the package mat-io. A timetable has the column `time`, in seconds from
    its first row."""
    names = [
        stored_object.name for stored_object in objects if stored_object.class_name in READABLE
    ]
    if not names or not is_installed(_PACKAGE):
        return {}
    frames = import_lab_package(_PACKAGE, path).load_from_mat(
        str(path), variable_names=names, add_table_attrs=True
    )
    tables: dict[str, Mapping[str, Any]] = {}
    for variable in (name for name in names if hasattr(frames.get(name), "columns")):
        frame = frames[variable]
        fields = dict[str, Any]()
        units = [
            str(unit)
            for unit in frame.attrs.get("VariableUnits") or frame.attrs.get("varUnits") or []
        ]
        if frame.index.dtype.kind in "mM":
            fields["time"] = _numbers(frame.index.to_numpy())
        fields |= {str(name): _numbers(frame[name].to_numpy()) for name in frame.columns}
        stated = dict(zip(map(str, frame.columns), units, strict=False))
        dated = {str(name) for name in frame.columns if frame[name].dtype.kind in "mM"}
        stated |= {name: "s" for name in fields if name == "time" or name in dated}
        known = {name: values for name, values in fields.items() if values is not None}
        tables[variable] = known | {"units": stated}
    return tables


def _numbers(values: Any) -> Array | None:
    """The values of a column as numbers, durations in seconds, instants in seconds from the first;
    None for texts.
    """
    if values.dtype.kind in "mM":
        origin = values[0] if values.dtype.kind == "M" else np.timedelta64(0, "ns")
        return np.asarray((values - origin) / np.timedelta64(1, "ns"), dtype=float) * 1e-9
    return np.asarray(values, dtype=float) if values.dtype.kind in "biuf" else None
