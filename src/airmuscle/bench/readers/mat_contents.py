"""Contents of MATLAB files, v4 to v7.3: variables, of which long ones are reduced while they are read.

Of version 7.3, which is HDF5, at most a piece of one dataset is in memory at once. Of the versions before, whose
variables are compressed as a whole, it is one variable where one is long; a struct is one variable.
"""

import dataclasses
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...core import Array
from .raw_columnar import check_no_external_links, check_own_values
from .separate_process import import_lab_package
from .time_base import Downsampling, Reduction, check_reduced_lengths

MAX_CELLS = 10_000
"""Maximum number of elements of a cell array of version 7.3 that is read, such as names of columns (chosen)."""
_HEADER_7_3 = b"MATLAB 7.3"
_HDF5, _USER_BLOCK = b"\x89HDF\r\n\x1a\n", 512
"""Signature of HDF5, and its place behind the header of MATLAB, whose text other programs write differently."""
_INTERNAL = ("__", "#")
"""Beginnings of names that no MATLAB variable has: header, function workspace, references, subsystem."""
_UNNAMED = "None"
"""Name that SciPy gives to objects."""


@dataclasses.dataclass(frozen=True, eq=False)
class MatContents:
    """The variables of a file with reduced arrays, the reduction of each struct, and notes on what was not read."""

    variables: Mapping[str, Any]
    reductions: Mapping[str, Reduction]
    notes: tuple[str, ...] = ()


def is_version_7_3(path: Path) -> bool:
    """Whether a MAT file is of version 7.3, which is HDF5."""
    with path.open("rb") as beginning:
        head = beginning.read(_USER_BLOCK + len(_HDF5))
    return head.startswith(_HEADER_7_3) or head[_USER_BLOCK:] == _HDF5


def is_plain_hdf5(path: Path) -> bool:
    """Whether a file is HDF5 without the header of MATLAB, as h5py writes it; its reader states why it is no file."""
    try:
        if not path.is_file():  # a pipe may have no end
            return False
        with path.open("rb") as file:
            head = file.read(_USER_BLOCK + len(_HDF5))
    except OSError:
        return False
    return not head.startswith(b"MATLAB") and _HDF5 in (head[: len(_HDF5)], head[_USER_BLOCK:])


def read_contents(path: Path, downsampling: Downsampling) -> MatContents:
    """The contents of a file; objects of MATLAB are not among them. Raises FileError, and what SciPy or h5py raise."""
    if is_version_7_3(path):
        return _read_hdf5(path, downsampling)
    from scipy.io import loadmat, whosmat

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # about objects, which `find_objects` names
        try:
            shapes = whosmat(str(path))
        except TypeError:  # an object, whose header SciPy does not read: the file is read as a whole
            shapes = []
        long = any(max(shape, default=0) > downsampling.max_rows for _, shape, _ in shapes)
        structs = any(kind in ("struct", "cell") for _, _, kind in shapes)
        one_by_one = long or (structs and path.stat().st_size > downsampling.max_rows)
        longest = max((max(s) for _, s, kind in shapes if kind not in ("struct", "cell") and s), default=0)
        variables: dict[str, Any] = {}
        reductions: dict[str, Reduction] = {}
        for names in [[name] for name, _, _ in shapes] if one_by_one else [None]:
            read = loadmat(str(path), variable_names=names, simplify_cells=True, appendmat=False)
            fields = {key: each for key, each in read.items() if not key.startswith(_INTERNAL) and key != _UNNAMED}
            variables |= _reduced(path.name, "", fields, downsampling, reductions, longest)
    return MatContents(variables, reductions)


class _Slices:
    """A numeric dataset of a file of version 7.3, which stores the axes of MATLAB in reverse order."""

    def __init__(self, dataset: Any) -> None:
        self.dataset, self.shape = dataset, tuple(reversed(dataset.shape))

    def rows(self, first: int, end: int) -> Array:
        """Rows of MATLAB, of which a vector has as many as values."""
        if len(self.shape) == 2 and 1 not in self.shape:
            return np.asarray(self.dataset[:, first:end].T)
        if self.shape[0] > 1:
            return np.asarray(self.dataset[..., first:end]).reshape(-1)
        return np.asarray(self.dataset[first:end, ...]).reshape(-1)


def _read_hdf5(path: Path, downsampling: Downsampling) -> MatContents:
    h5py = import_lab_package("h5py", path)
    notes: list[str] = []
    reductions: dict[str, Reduction] = {}
    with h5py.File(path, "r") as file:
        check_own_values(h5py, file, path)
        check_no_external_links(h5py, file, path)
        variables = _reduced(path.name, "", _fields(h5py, file, file, "", notes), downsampling, reductions)
    return MatContents(variables, reductions, tuple(notes))


def _fields(h5py: Any, file: Any, group: Any, place: str, notes: list[str]) -> dict[str, Any]:
    """The variables of a file or the fields of a struct; arrays remain in the file until their rows are requested."""
    found = {}
    for name in group:
        if name.startswith(_INTERNAL) or not isinstance(group.get(name, getlink=True), h5py.HardLink):
            continue
        value = _value(h5py, file, group[name], f"{place}{name}", notes)
        if value is not None:
            found[name] = value
    return found


def _value(h5py: Any, file: Any, item: Any, place: str, notes: list[str]) -> Any:
    """A variable, a field or an element of a cell array; None if it is empty or not read."""
    if isinstance(item, h5py.Group) and "MATLAB_sparse" not in item.attrs:
        return _fields(h5py, file, item, f"{place}.", notes)
    stated = item.attrs.get("MATLAB_class", b"")
    kind = stated.decode(errors="replace") if isinstance(stated, bytes) else str(stated)
    if "MATLAB_empty" in item.attrs or item.attrs.get("MATLAB_object_decode", 0) == 3:  # an object, named elsewhere
        return None
    if kind == "char":
        return "".join(map(chr, item[()].T.ravel().tolist()))
    if isinstance(item, h5py.Dataset) and item.dtype.kind in "biuf" and kind not in ("", "function_handle"):
        return float(item[()].item()) if item.size == 1 else _Slices(item)
    if isinstance(item, h5py.Dataset) and h5py.check_ref_dtype(item.dtype) is not None and item.size <= MAX_CELLS:
        return [_value(h5py, file, file[each], place, notes) for each in item[()].ravel()]
    kinds = {"cell": "a cell array", "function_handle": "a function"}
    what = "a sparse matrix" if isinstance(item, h5py.Group) else kinds.get(kind, "which contains no real numbers")
    notes.append(f"Not read: {place}, {what}.")
    return None


def _is_column(value: Any) -> bool:
    if isinstance(value, _Slices):
        return len(value.shape) <= 2
    return isinstance(value, np.ndarray) and value.dtype.kind in "biuf" and 0 < value.ndim <= 2 and value.size > 1


def _row_count(value: Any) -> int:
    shape = value.shape
    return int(max(shape)) if len(shape) == 1 or 1 in shape else int(shape[0])


def _reduced(
    origin: str, name: str, fields: Mapping[str, Any], downsampling: Downsampling, reductions: dict[str, Reduction],
    longest: int = 0,
) -> dict[str, Any]:  # fmt: skip
    """The fields of a struct with reduced arrays; `reductions` receives that of each struct."""
    arrays = {key: value for key, value in fields.items() if _is_column(value)}
    reduction = Reduction(downsampling, max([longest, *map(_row_count, arrays.values())]))
    if arrays:
        reductions[name] = reduction
    result: dict[str, Any] = {}
    for key, value in fields.items():
        if key in arrays:
            result[key] = _reduced_array(value, reduction)
        elif isinstance(value, Mapping):
            result[key] = _reduced(origin, f"{name}.{key}".lstrip("."), value, downsampling, reductions)
        else:
            result[key] = _whole(value)
    check_reduced_lengths(origin, map(_row_count, arrays.values()), (len(result[key]) for key in arrays))
    return result


def _whole(value: Any) -> Any:
    """A value without parts that remain in the file."""
    if isinstance(value, _Slices):
        array = np.asarray(value.dataset[()].T)
        return array.reshape(-1) if array.size == max(array.shape, default=0) else array
    if isinstance(value, Mapping):
        return {key: _whole(item) for key, item in value.items()}
    return [_whole(item) for item in value] if isinstance(value, list) else value


def _reduced_array(value: Any, reduction: Reduction) -> Any:
    if isinstance(value, _Slices):
        return reduction.read(value.rows, _row_count(value))
    flat = value.reshape(-1) if value.ndim == 2 and 1 in value.shape else value
    return reduction.read(lambda first, end: flat[first:end], _row_count(value))
