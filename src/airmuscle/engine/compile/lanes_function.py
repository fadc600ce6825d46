"""Expressions as a compiled function of several points side by side, for kernels that evaluate it at many points."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.arrays import Array
from .cache.module import load_module
from .functions import Printer
from .llvm import vector_math
from .llvm.emit import LlvmLanguage
from .llvm.types import LlvmType

LANES = 8
"""Points of one call: the widest register (chosen)."""
_ALIGNMENT = 64


class LanesFunction:
    """CasADi expressions of vectors, compiled for several points at once; `address`: f(inputs..., outputs...).

    Element i of an input or output is a row of `lanes` numbers, in arrays that `lanes_array` gives for LANES points.
    The machine code lives as long as this object.
    """

    def __init__(self, inputs: dict[str, Any], outputs: dict[str, Any], lanes: int = LANES) -> None:
        import casadi

        number = LlvmType(lanes=lanes)
        printer = Printer(LlvmLanguage(number))
        printer.add("function", inputs, {name: casadi.densify(casadi.SX(value)) for name, value in outputs.items()})
        parts = [vector_math.definition(name, count, number) for name, count in printer.needed.items()]
        text = "\n".join([vector_math.declarations({number}), *parts, printer.module()])
        self._engine = load_module(text)
        self.address = int(self._engine.get_function_address("function"))


def lanes_array(*shape: int) -> Array:
    """An array of zeros whose last dimension has LANES numbers, aligned as vectors must be."""
    count = int(np.prod(shape)) * LANES
    raw = np.zeros(count + _ALIGNMENT // 8)
    start = (-raw.ctypes.data % _ALIGNMENT) // 8
    return raw[start : start + count].reshape(*shape, LANES)
