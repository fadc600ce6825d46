"""Spring load: a mass with a spring and a damper."""

from __future__ import annotations

from collections.abc import Mapping

from ...core.declaration import model, parameter
from ...core.ops import Value
from .translation import Translation


@model
class SpringLoad(Translation):
    """Spring load: m y'' = F - F_0 - k y - d y', with y from the position at the resting length of the muscle.

    m mass, k stiffness, d damping coefficient, F_0 preload at y = 0, which may include a weight m g. All muscles act on
    the same point in parallel.
    """

    mass: float = parameter("kg", "m", "mass of the load", bounds=(1e-4, 1e5))
    stiffness: float = parameter("N/m", "k", "stiffness of the spring", bounds=(0.0, 1e8))
    damping: float = parameter("N s/m", "d", "damping coefficient of the load", bounds=(0.0, 1e6), default=0.0)
    preload: float = parameter("N", "F_0", "preload at position 0", bounds=(-1e6, 1e6), default=0.0)

    def acceleration(
        self, q: Mapping[str, Value], v: Mapping[str, Value], forces: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Mapping[str, Value]:
        resistance = self.preload + self.stiffness * q["position"] + self.damping * v["speed"]
        return {"position": (forces["position"] - resistance) / self.mass}

    def dissipated_power(
        self, q: Mapping[str, Value], v: Mapping[str, Value], forces: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Value:
        return self.damping * v["speed"] ** 2

    def potential_energy(self, q: Mapping[str, Value]) -> Value:
        return (self.preload + 0.5 * self.stiffness * q["position"]) * q["position"]
