"""Force resultant of the fibres of a tube: M = Sum sin(theta_n)."""

from __future__ import annotations

import abc

from ....core import ops
from ....core.declaration import model, parameter
from ....core.ops import Value


class FibreSum(abc.ABC):
    """M = Sum sin(theta_n) over the half section, theta_n = (pi/m)(2 n + 1): Saga et al. 2007, (13), (15)."""

    @abc.abstractmethod
    def sum_of_sines(self, fibres: int) -> Value:
        """M [1] for m = `fibres`."""


@model
class PrintedFibreSum(FibreSum):
    """Sum over n = 0..m/2, as (15) is printed: one fibre lies beyond pi and is subtracted; 4.93074 for 16 fibres."""

    def sum_of_sines(self, fibres: int) -> Value:
        return 1.0 / ops.sin(ops.pi / fibres) - ops.sin(ops.pi / fibres)


@model
class HalfShellFibreSum(FibreSum):
    """Sum over n = 0..m/2 - 1, the fibres of the half section: 1/sin(pi/m); 5.12583 for 16 fibres."""

    def sum_of_sines(self, fibres: int) -> Value:
        return 1.0 / ops.sin(ops.pi / fibres)


@model
class UniformFibreSum(FibreSum):
    """Continuous distribution of fibres: m/pi, as axial symmetry requires; 5.09296 for 16 fibres."""

    def sum_of_sines(self, fibres: int) -> Value:
        return fibres / ops.pi


@model
class UserDefinedFibreSum(FibreSum):
    """User-defined value, for sensitivity studies."""

    value: float = parameter("1", "M", "sum of the sines of the fibre angles", bounds=(0.1, 1e3), fitted=False)

    def sum_of_sines(self, fibres: int) -> Value:
        return self.value
