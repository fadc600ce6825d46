"""SlidingMode: first-order sliding mode control with a boundary layer."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ...core import ops
from ...core.declaration import model, parameter
from ...core.ops import Value
from ...core.reference import Reference
from ...engine.loop.control_law import Commanded, SisoController, commands, range_of
from ...engine.loop.controller import Measurement
from .sliding_variable import sliding_memory, sliding_variable

SLOTINE_SASTRY1983 = Reference(
    key="slotine-sastry-1983",
    authors="Slotine, J.-J. E., Sastry, S. S.",
    title="Tracking control of non-linear systems using sliding surfaces, with application to robot manipulators",
    where="International Journal of Control 38(2):465-492",
    year=1983,
    doi="10.1080/00207178308933088",
    note="sliding variable and boundary layer",
)


@model
class SlidingMode(SisoController):
    """u = u_0 + K sat(s/phi),   s = e + T_s e',   e = r - y.

    sat(z) = z limited to -1 to 1. Within the boundary layer |s| < phi the law is a PD controller of gain K/phi; outside
    it commands the full K. On s = 0 the error decays with the time constant T_s. e' is a backward difference with a
    first-order filter of time constant T_f. With phi = 0 the law switches at every sample (chattering).
    Reference: Slotine and Sastry (1983).
    """

    references: ClassVar[tuple[Reference, ...]] = (SLOTINE_SASTRY1983,)

    measured: str
    commanded: Commanded
    amplitude: float = parameter("u", "K", "command outside the boundary layer")
    sliding_time: float = parameter("s", "T_s", "time constant of the error on s = 0", bounds=(0.0, 1e3), default=0.0)
    boundary_layer: float = parameter("y", "phi", "half width of the boundary layer", bounds=(0.0, 1e9), default=0.0)
    filter_time: float = parameter("s", "T_f", "time constant of the derivative", bounds=(0.0, 1e3), default=0.0)
    equivalent_output: float = parameter("u", "u_0", "command on the sliding surface", default=0.0)

    @property
    def initial_memory(self) -> dict[str, float]:
        """Whether it has started (0 or 1), the last error [y] and its filtered derivative [y/s]."""
        return sliding_memory()

    def step(
        self, memory: Mapping[str, Value], measurement: Measurement, dt: Value
    ) -> tuple[dict[str, Value], dict[str, Value]]:
        error = measurement.setpoints[self.measured] - measurement.columns[self.measured]
        s, later = sliding_variable(memory, error, self.sliding_time, self.filter_time, dt)
        layer = ops.where(self.boundary_layer > 0, self.boundary_layer, 1.0)
        switched = ops.where(s > 0.0, 1.0, ops.where(s < 0.0, -1.0, 0.0))
        saturated = ops.where(self.boundary_layer > 0, ops.clip(s / layer, -1.0, 1.0), switched)
        low, high = range_of(self.commanded, measurement.ranges)
        return commands(self.commanded, ops.clip(self.equivalent_output + self.amplitude * saturated, low, high)), later
