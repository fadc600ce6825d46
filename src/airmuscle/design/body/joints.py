"""Joints of a body: ranges of their positions, and couplings by equality constraints."""

import dataclasses
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from ...core import Array


class Coupling(NamedTuple):
    """A joint whose position is a polynomial of that of another one: q - q0 = sum c_k (p - p0)^k.

    leader        name of the joint that it follows
    coefficients  c_0 to c_4 of MuJoCo's joint equality
    reference     q0 and p0
    """

    leader: str
    coefficients: tuple[float, ...]
    reference: tuple[float, float]

    def position(self, leading: Any) -> Any:
        """Position [rad or m] for that of the leader."""
        offset = leading - self.reference[1]
        return self.reference[0] + np.polynomial.polynomial.polyval(offset, self.coefficients)

    def slope(self, leading: Any) -> Any:
        """Derivative of the position by that of the leader."""
        derivative = np.polynomial.polynomial.polyder(self.coefficients)
        return np.polynomial.polynomial.polyval(leading - self.reference[1], derivative)


@dataclasses.dataclass(frozen=True)
class BodyJoint:
    """A hinge or slide of a body.

    low, high  range of its position [rad or m]; infinite without limits
    position   index of its position and of its speed in MuJoCo's vectors
    place      file and line
    """

    name: str
    is_hinge: bool
    low: float
    high: float
    reference: float
    position: int
    speed: int
    place: str
    coupling: Coupling | None = None

    @property
    def is_limited(self) -> bool:
        """Whether it has a range."""
        return bool(np.isfinite(self.low) and np.isfinite(self.high))

    @property
    def unit(self) -> str:
        """SI unit of its position."""
        return "rad" if self.is_hinge else "m"

    def shown(self, value: float) -> str:
        """A position as text, in degrees or mm."""
        if self.is_hinge:
            return f"{np.degrees(value) + 0.0:.4g}°"
        return f"{1e3 * value + 0.0:.4g} mm"


def following_positions(
    joints: Mapping[str, BodyJoint], values: Mapping[str, Array]
) -> dict[str, Array]:
    """Positions of joints, and of all that are coupled to one of them."""
    positions = dict(values)
    waiting = [joint for joint in joints.values() if joint.coupling and joint.name not in values]
    while waiting:
        ready = [joint for joint in waiting if joint.coupling.leader in positions]  # type: ignore[union-attr]
        if not ready:
            return positions
        for joint in ready:
            assert joint.coupling is not None
            positions[joint.name] = joint.coupling.position(positions[joint.coupling.leader])
        waiting = [joint for joint in waiting if joint.name not in positions]
    return positions
