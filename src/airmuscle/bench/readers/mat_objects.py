"""MATLAB objects in MAT files: tables and timetables are read, others are named with the command that exports them.

MATLAB stores an object as an opaque variable, whose values are in a separate part of the file. The package mat-io
decodes it; without the package the variables are found by their headers.
"""

import struct
import zlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np

from ...core import Array
from .separate_process import import_lab_package, is_installed

READABLE = ("table", "timetable")
"""Classes whose objects can be read."""
_PACKAGE = "matio"
_COMPRESSED, _MATRIX, _OPAQUE_CLASS = 15, 14, 17
"""Numbers of the format: compressed element, array element, class of an opaque array."""
_HEADER, _HEAD = 128, 2048
"""Bytes of the header of a file, and of the beginning of a variable that contains its name and class."""
_NUMERIC = {"double", "single", "logical", "char", "cell", "struct", "function_handle", "canonical empty"}


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
    """The objects among the variables of a MAT file, of version 5 to 7.3; empty for a damaged file."""
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
            kind, head = struct.unpack(f"{order}I", head[:4])[0], head[8:]
        if kind == _MATRIX and len(head) >= 16 and struct.unpack(f"{order}I", head[8:12])[0] & 0xFF == _OPAQUE_CLASS:
            name, _, class_name = _texts(head[16:], order)
            yield MatlabObject(name, class_name)


def _texts(data: bytes, order: str) -> list[str]:
    """The three texts at the beginning of an opaque array: name, type system and class."""
    texts = []
    for _ in range(3):
        kind, size = struct.unpack(f"{order}2I", data[:8])
        if kind >> 16:  # a short element: its size and its data are in the tag
            size, start, length = kind >> 16, 4, 8
        else:
            start, length = 8, 8 + (size + 7) // 8 * 8
        texts.append(data[start : start + size].decode("ascii"))
        data = data[length:]
    return texts


def _hdf5_objects(path: Path) -> Iterator[MatlabObject]:
    """The opaque variables of a file of version 7.3."""
    if not is_installed("h5py"):
        return
    try:
        with import_lab_package("h5py", path).File(path, "r") as file:
            for name, item in file.items():
                class_name = item.attrs.get("MATLAB_class", b"").decode()
                is_opaque = item.attrs.get("MATLAB_object_decode", 0) == 3
                if not name.startswith("#") and is_opaque and class_name not in _NUMERIC:
                    yield MatlabObject(name, class_name)
    except OSError:  # the reader of the file states the damage
        return


def read_objects(path: Path, objects: Sequence[MatlabObject]) -> dict[str, Mapping[str, Any]]:
    """The numeric columns of the tables and timetables, by variable; with their units in `units`, if stated.

    Empty without the package mat-io. A timetable has the column `time`, in seconds from its first row.
    """
    names = [each.name for each in objects if each.class_name in READABLE]
    if not names or not is_installed(_PACKAGE):
        return {}
    frames = import_lab_package(_PACKAGE, path).load_from_mat(str(path), variable_names=names, add_table_attrs=True)
    return {name: _columns(frames[name]) for name in names if hasattr(frames.get(name), "columns")}


def _columns(frame: Any) -> dict[str, Any]:
    units = [str(unit) for unit in frame.attrs.get("VariableUnits") or frame.attrs.get("varUnits") or []]
    fields: dict[str, Any] = {}
    if frame.index.dtype.kind in "mM":
        fields["time"] = _numbers(frame.index.to_numpy())
    fields |= {str(name): _numbers(frame[name].to_numpy()) for name in frame.columns}
    stated = dict(zip(map(str, frame.columns), units, strict=False))
    dated = {str(name) for name in frame.columns if frame[name].dtype.kind in "mM"}
    stated |= {name: "s" for name in fields if name == "time" or name in dated}
    return {name: values for name, values in fields.items() if values is not None} | {"units": stated}


def _numbers(values: Any) -> Array | None:
    """The values of a column as numbers, durations in seconds, instants in seconds from the first; None for texts."""
    if values.dtype.kind in "mM":
        origin = values[0] if values.dtype.kind == "M" else np.timedelta64(0, "ns")
        return np.asarray((values - origin) / np.timedelta64(1, "ns"), dtype=float) * 1e-9
    return np.asarray(values, dtype=float) if values.dtype.kind in "biuf" else None
