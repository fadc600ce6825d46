"""Isotonic load: a constant force against the muscle, as on a force-controlled test bench."""

from __future__ import annotations

from collections.abc import Mapping

from ...core.declaration import model, parameter
from ...core.ops import Value
from .translation import Translation


@model
class Isotonic(Translation):
    """Isotonic load: m y'' = F - F_c - d y', with y from the position at the resting length of the muscle.

    F_c constant force, m moving mass without weight, d damping. The smaller the mass, the closer the tension is to F_c.
    All muscles act on the same point in parallel.
    """

    force: float = parameter("N", "F_c", "constant force against the muscles", bounds=(0.0, 1e6))
    mass: float = parameter("kg", "m", "moving mass, without weight", bounds=(1e-4, 1e5))
    damping: float = parameter("N s/m", "d", "damping coefficient of the load", bounds=(0.0, 1e6), default=0.0)

    def acceleration(
        self, q: Mapping[str, Value], v: Mapping[str, Value], forces: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Mapping[str, Value]:
        return {"position": (forces["position"] - self.force - self.damping * v["speed"]) / self.mass}

    def dissipated_power(
        self, q: Mapping[str, Value], v: Mapping[str, Value], forces: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Value:
        return self.damping * v["speed"] ** 2

    def potential_energy(self, q: Mapping[str, Value]) -> Value:
        return self.force * q["position"]
