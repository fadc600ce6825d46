"""A mass that hangs from a rope over a stepped pulley."""

from __future__ import annotations

from collections.abc import Mapping

from ..core.constants import STANDARD_GRAVITY
from ..core.declaration import model, parameter
from ..core.ops import Value
from .translation import Translation


@model
class Pulley(Translation):
    """(J/r^2 + i^2 m) y'' = F - i m g - d y', with y from where the muscle has its resting length.

    r radius of the drum that the muscle winds, i r that of the drum that lifts the mass m by i y; J inertia of the
    pulley, d friction of its bearing, as a damper at the muscle. i = 1 only turns the rope, i = 1/2 is also a block and
    tackle that halves the load. All muscles pull at the same place.
    """

    radius: float = parameter("m", "r", "radius of the drum that the muscle winds", bounds=(1e-4, 10.0))
    mass: float = parameter("kg", "m", "mass of the load", bounds=(1e-4, 1e5))
    ratio: float = parameter("1", "i", "way of the load for each way of the muscle", bounds=(1e-3, 1e3), default=1.0)
    inertia: float = parameter("kg m^2", "J", "moment of inertia of the pulley", bounds=(0.0, 1e4), default=0.0)
    damping: float = parameter("N s/m", "d", "friction of the bearing", bounds=(0.0, 1e6), default=0.0)
    gravity: float = parameter(
        "m/s^2", "g", "acceleration of gravity", bounds=(0.0, 20.0), fitted=False, default=STANDARD_GRAVITY
    )

    def _inertial_mass(self) -> Value:
        return self.inertia / self.radius**2 + self.ratio**2 * self.mass

    def acceleration(
        self, q: Mapping[str, Value], v: Mapping[str, Value], pulls: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Mapping[str, Value]:
        held = self.ratio * self.mass * self.gravity + self.damping * v["speed"]
        return {"position": (pulls["position"] - held) / self._inertial_mass()}

    def dissipated_power(
        self, q: Mapping[str, Value], v: Mapping[str, Value], pulls: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Value:
        return self.damping * v["speed"] ** 2

    def potential_energy(self, q: Mapping[str, Value]) -> Value:
        return self.mass * self.gravity * self.ratio * q["position"]

    def kinetic_energy(self, q: Mapping[str, Value], v: Mapping[str, Value]) -> Value:
        return 0.5 * self._inertial_mass() * v["speed"] ** 2
