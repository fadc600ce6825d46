"""Expressions as a compiled function of arrays, for kernels that are not about steps in time."""

from __future__ import annotations

from typing import Any

from .cache.module import load_module
from .functions import Printer


class Function:
    """CasADi expressions of vectors, compiled: `address` is that of a function of the inputs' and outputs' arrays.

    A matrix is written row by row. The machine code lives as long as this object.
    """

    def __init__(self, inputs: dict[str, Any], outputs: dict[str, Any]) -> None:
        import casadi

        rows = {name: casadi.densify(casadi.vec(casadi.SX(value).T)) for name, value in outputs.items()}
        printer = Printer()
        printer.add("function", inputs, rows)
        self._engine = load_module(printer.module())
        self.address = int(self._engine.get_function_address("function"))
