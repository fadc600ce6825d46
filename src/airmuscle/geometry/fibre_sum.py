"""How the fibres around a tube share in holding its two halves together: M = Sum sin(theta_n)."""

from __future__ import annotations

import abc

from ..core import ops
from ..core.declaration import model, parameter
from ..core.ops import Value


class FibreSum(abc.ABC):
    """M = Sum sin(theta_n) over the cut half, theta_n = (pi/m)(2 n + 1): Saga et al. 2007, (13), (15)."""

    @abc.abstractmethod
    def sum_of_sines(self, fibres: int) -> Value:
        """M [1] for m fibres."""


@model
class PrintedFibreSum(FibreSum):
    """n up to m/2, as (15) is printed: one fibre past pi, which counts against the others; 4.93074 for 16 fibres."""

    def sum_of_sines(self, fibres: int) -> Value:
        return 1.0 / ops.sin(ops.pi / fibres) - ops.sin(ops.pi / fibres)


@model
class HalfShellFibreSum(FibreSum):
    """n up to m/2 - 1, the fibres that the half holds: 1/sin(pi/m), 5.12583 for 16 fibres."""

    def sum_of_sines(self, fibres: int) -> Value:
        return 1.0 / ops.sin(ops.pi / fibres)


@model
class UniformFibreSum(FibreSum):
    """Fibres spread evenly all around: m/pi, which any axisymmetric muscle needs; 5.09296 for 16 fibres."""

    def sum_of_sines(self, fibres: int) -> Value:
        return fibres / ops.pi


@model
class UserDefinedFibreSum(FibreSum):
    """A number, to see what depends on it."""

    value: float = parameter("1", "M", "sum of the sines of the fibre angles", bounds=(0.1, 1e3), fitted=False)

    def sum_of_sines(self, fibres: int) -> Value:
        return self.value
