"""Large MAT files, reduced while they are read: version 7.3 by slices of its HDF5 datasets, others by variables."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...core.arrays import Array
from .downsampling import Downsampling
from .optional_dependency import import_lab_package
from .pieces import Reduction, check_reduced_lengths, read_reduced

MAX_CELLS = 10_000
"""Maximum number of texts of a cell array that is read, as names of columns (chosen)."""
_HDF5_BEGINNING = b"MATLAB 7.3"
_HDF5, _USER_BLOCK = b"\x89HDF\r\n\x1a\n", 512
"""Signature of HDF5, and its place behind the header of MATLAB, whose text other programs write differently."""


@dataclasses.dataclass(frozen=True, eq=False)
class LargeContents:
    """The variables of a large file with reduced arrays, the reduction of each struct, and what was not read."""

    variables: Mapping[str, Any]
    reductions: Mapping[str, Reduction]
    notes: tuple[str, ...] = ()


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


def is_version_7_3(path: Path) -> bool:
    """Whether a MAT file is of version 7.3, which is HDF5."""
    with path.open("rb") as beginning:
        head = beginning.read(_USER_BLOCK + len(_HDF5))
    return head.startswith(_HDF5_BEGINNING) or head[_USER_BLOCK:] == _HDF5


def read_large_mat(path: Path, pymatreader: Any, downsampling: Downsampling) -> LargeContents | None:
    """The reduced contents of a file with a variable of more than `downsampling.max_rows` rows; None for another file.

    Of version 7.3, at most a piece of one dataset is in memory at once. Of the versions before, whose variables are
    compressed as a whole, it is one variable; a struct is one variable. Such a file that contains objects of MATLAB is
    read as a whole.
    """
    if is_version_7_3(path):
        return _read_hdf5(path, downsampling)
    from scipy.io import whosmat

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            shapes = whosmat(str(path))
        except TypeError:  # an object of MATLAB, whose header SciPy does not read
            return None
        long = any(max(shape, default=0) > downsampling.max_rows for _, shape, _ in shapes)
        structs = any(kind in ("struct", "cell") for _, _, kind in shapes)
        if not long and not (structs and path.stat().st_size > downsampling.max_rows):
            return None
        variables: dict[str, Any] = {}
        reductions: dict[str, Reduction] = {}
        longest = max((max(s) for _, s, kind in shapes if kind not in ("struct", "cell") and s), default=0)
        for name, _, _ in shapes:
            fields = dict(pymatreader.read_mat(str(path), variable_names=[name]))
            fields = {key: value for key, value in fields.items() if not key.startswith("__")}
            variables |= _reduced(path.name, "", fields, downsampling, reductions, longest)
    return LargeContents(variables, reductions)


def _read_hdf5(path: Path, downsampling: Downsampling) -> LargeContents | None:
    h5py = import_lab_package("h5py", path)
    notes: list[str] = []
    with h5py.File(path, "r") as file:
        sizes: list[int] = []

        def measure(_: str, item: Any) -> None:
            if isinstance(item, h5py.Dataset) and item.dtype.kind in "biuf":
                sizes.append(max(item.shape, default=0))

        file.visititems(measure)
        if max(sizes, default=0) <= downsampling.max_rows:
            return None
        fields = dict(_fields(h5py, file, file, "", notes))
        reductions: dict[str, Reduction] = {}
        variables = _reduced(path.name, "", fields, downsampling, reductions)
    return LargeContents(variables, reductions, tuple(notes))


def _fields(h5py: Any, file: Any, group: Any, prefix: str, notes: list[str]) -> Iterator[tuple[str, Any]]:
    """The variables of a file or the fields of a struct; arrays remain in the file until their rows are requested."""
    for name in group:
        if name.startswith("#") or not isinstance(group.get(name, getlink=True), h5py.HardLink):
            continue
        item = group[name]
        if isinstance(item, h5py.Group):
            yield name, dict(_fields(h5py, file, item, f"{prefix}{name}.", notes))
            continue
        kind = _text(item.attrs.get("MATLAB_class", b""))
        if "MATLAB_empty" in item.attrs:
            continue
        if kind == "char":
            yield name, _characters(item)
        elif item.dtype.kind in "biuf" and kind not in ("", "function_handle"):
            yield name, float(item[()].item()) if item.size == 1 else _Slices(item)
        elif kind == "cell" and item.size <= MAX_CELLS:
            texts = [file[reference] for reference in item[()].ravel()]
            if all(_text(text.attrs.get("MATLAB_class", b"")) == "char" for text in texts):
                yield name, [_characters(text) for text in texts]
            else:
                notes.append(f"Not read from the large file: {prefix}{name}, a cell array.")
        else:
            notes.append(f"Not read from the large file: {prefix}{name}, which contains no numbers.")


def _characters(dataset: Any) -> str:
    return "".join(map(chr, dataset[()].T.ravel().tolist()))


def _text(value: Any) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)


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
    reduction = Reduction.of([longest, *map(_row_count, arrays.values())], downsampling)
    if arrays:
        reductions[name] = reduction
    result: dict[str, Any] = {}
    for key, value in fields.items():
        if key in arrays:
            result[key] = _reduce_array(value, reduction.step, downsampling)
        elif isinstance(value, Mapping):
            result[key] = _reduced(origin, f"{name}.{key}".lstrip("."), value, downsampling, reductions)
        elif not isinstance(value, _Slices):
            result[key] = value
    check_reduced_lengths(origin, map(_row_count, arrays.values()), (len(result[key]) for key in arrays))
    return result


def _reduce_array(value: Any, step: int, downsampling: Downsampling) -> Any:
    rows = _row_count(value)
    if isinstance(value, _Slices):
        return read_reduced(value.rows, rows, step, downsampling)
    flat = value.reshape(-1) if value.ndim == 2 and 1 in value.shape else value
    return read_reduced(lambda first, end: flat[first:end], rows, step, downsampling)
