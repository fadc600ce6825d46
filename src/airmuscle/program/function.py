"""Expressions as a compiled function of arrays, for what Python calls often and a kernel never."""

from __future__ import annotations

import ctypes
from typing import Any

import casadi
import numpy as np
import numpy.typing as npt

from . import llvm
from .printed import Printer

Array = npt.NDArray[np.float64]


class Function:
    """CasADi expressions of vectors, compiled; called with as many arrays, it gives an array (rows, columns) for each.

    Calls share nothing, so that several threads may call at once.
    """

    def __init__(self, inputs: dict[str, Any], outputs: dict[str, Any]) -> None:
        self._shapes = [tuple(value.shape) for value in outputs.values()]
        # LLVM's arrays are filled non-zero by non-zero, column by column: the transposed matrix, row by row.
        columns = {name: casadi.densify(casadi.vec(casadi.SX(value).T)) for name, value in outputs.items()}
        printer = Printer()
        printer.add("function", inputs, columns)
        self._engine = llvm.compiled(printer.module())
        kinds = [ctypes.c_void_p] * (len(inputs) + len(outputs))
        self._call = ctypes.CFUNCTYPE(None, *kinds)(self._engine.get_function_address("function"))

    def __call__(self, *arrays: Array) -> tuple[Array, ...]:
        given = [np.ascontiguousarray(array, dtype=float) for array in arrays]
        results = tuple(np.empty(shape) for shape in self._shapes)
        self._call(*(array.ctypes.data for array in (*given, *results)))
        return results
