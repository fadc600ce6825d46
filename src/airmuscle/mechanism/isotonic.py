"""A constant force against the muscle, as a force-controlled bench holds it."""

from __future__ import annotations

from collections.abc import Mapping

from ..core.declaration import model, parameter
from ..core.ops import Value
from .translation import Translation


@model
class Isotonic(Translation):
    """m y'' = F - F_c - d y', with y from where the muscle has its resting length.

    F_c constant force, m mass that moves along and does not weigh, d damping. The smaller the mass, the nearer the
    tension stays to F_c. All muscles pull at the same place.
    """

    force: float = parameter("N", "F_c", "constant force against the muscles", bounds=(0.0, 1e6))
    mass: float = parameter("kg", "m", "mass that moves along", bounds=(1e-4, 1e5))
    damping: float = parameter("N s/m", "d", "damping coefficient of the load", bounds=(0.0, 1e6), default=0.0)

    def acceleration(
        self, q: Mapping[str, Value], v: Mapping[str, Value], pulls: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Mapping[str, Value]:
        return {"position": (pulls["position"] - self.force - self.damping * v["speed"]) / self.mass}

    def dissipated_power(
        self, q: Mapping[str, Value], v: Mapping[str, Value], pulls: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Value:
        return self.damping * v["speed"] ** 2

    def potential_energy(self, q: Mapping[str, Value]) -> Value:
        return self.force * q["position"]
