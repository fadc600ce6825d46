"""Pressure-dependent friction: force scale of a friction law, affine in gauge pressure."""

from __future__ import annotations

from typing import ClassVar

from ....core import ops
from ....core.declaration import model, parameter
from ....core.ops import Value
from ....core.reference import Reference
from .base import Friction
from .wrapper import FrictionWrapper

TONDU_LOPEZ2000 = Reference(
    key="tondu-lopez-2000",
    authors="Tondu, B., Lopez, P.",
    title="Modeling and control of McKibben artificial muscle robot actuators",
    where="IEEE Control Systems Magazine 20(2), 15-38",
    year=2000,
    doi="10.1109/37.833638",
    note="dry friction between the threads, proportional to the contact pressure; the affine form is chosen here",
)
DAVIS_CALDWELL2006 = Reference(
    key="davis-caldwell-2006",
    authors="Davis, S., Caldwell, D. G.",
    title="Braid effects on contractile range and friction modeling in pneumatic muscle actuators",
    where="The International Journal of Robotics Research 25(4), 359-369",
    year=2006,
    doi="10.1177/0278364906063227",
    note="friction of the threads of the braid, which increases with pressure",
)


@model
class PressureScaledFriction(FrictionWrapper):
    """Friction with a force scale: F = s(p) F_1,  s(p) = max(a + (1 - a) p/p_r, 0).

    F_1: force of the inner law, which is the friction at the reference pressure p_r; p: gauge pressure; a: ratio of the
    friction at ambient pressure to that at p_r. a = 0 is a friction proportional to the pressure between the threads,
    as in Tondu and Lopez (2000) and Davis and Caldwell (2006); a = 1 does not depend on the pressure. The affine form
    (chosen) adds the friction of the unpressurised braid. All terms of the inner law are scaled, so that the presliding
    distance does not depend on the pressure (chosen).
    """

    references: ClassVar[tuple[Reference, ...]] = (TONDU_LOPEZ2000, DAVIS_CALDWELL2006)

    inner: Friction
    ambient_ratio: float = parameter(
        "1", "a", "friction at ambient pressure relative to that at the reference pressure", bounds=(0.0, 10.0),
        default=0.0,
    )  # fmt: skip
    reference_pressure: float = parameter(
        "Pa", "p_r", "gauge pressure at which the scale is 1", bounds=(1e3, 1e7), fitted=False, default=1e5
    )

    def pressure_factor(self, pressure: Value) -> Value:
        scale = self.ambient_ratio + (1.0 - self.ambient_ratio) * pressure / self.reference_pressure
        return ops.maximum(scale, 0.0) * self.inner.pressure_factor(pressure)
