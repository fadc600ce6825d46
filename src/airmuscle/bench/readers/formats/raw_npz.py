"""Reader of archives of NumPy arrays (.npz); objects, which could run code, are not read."""

from pathlib import Path

import numpy as np

from ..tables import Arrays, flat, reading


def read_npz_arrays(path: Path) -> list[Arrays]:
    """The arrays of numbers in an archive, as those of one episode. Raises FileError."""
    with reading(path, "NPZ"), np.load(path, allow_pickle=False) as file:
        arrays = {name: file[name] for name in file.files}
        numeric = {
            name: np.asarray(array, dtype=float)
            for name, array in arrays.items()
            if array.dtype.kind in "fiub"
        }
        return [dict(flat(numeric))]
