"""Where NumPy keeps what an array is, so that machine code reads it without a call of Python: PyArrayObject_fields.

Offsets in bytes from the beginning of the object, as NumPy's header ndarraytypes.h gives them for 64 bits. Python or
NumPy built otherwise are recognised by trying, in every process, before any machine code relies on it.
"""

from __future__ import annotations

import ctypes
import functools
import struct

import numpy as np

DATA, DIMENSIONS, SHAPE, STRIDES, DTYPE, FLAGS = 16, 24, 32, 40, 56, 64
PLAIN = 0x1 | 0x100 | 0x400
"""C-contiguous, aligned, writeable."""


@functools.cache
def as_known() -> bool:
    """Whether an array is laid out in this process as said above."""
    if struct.calcsize("P") != 8 or np.ndarray.__basicsize__ < FLAGS + 4:
        return False
    array = np.zeros((2, 3))[:, :2]
    place = id(array)
    pointers = [ctypes.c_size_t.from_address(place + offset).value for offset in (DATA, DTYPE)]
    if pointers != [array.ctypes.data, id(array.dtype)]:
        return False
    if [ctypes.c_int.from_address(place + o).value for o in (DIMENSIONS, FLAGS)] != [array.ndim, array.flags.num]:
        return False
    shape, strides = (ctypes.c_size_t.from_address(place + offset).value for offset in (SHAPE, STRIDES))
    return strides == shape + 16 and tuple((ctypes.c_ssize_t * 4).from_address(shape)) == array.shape + array.strides
