"""Recipe of a braided muscle: dimensions of tube, braid and ends, with their tolerances."""

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

from ...core import Array, ParameterError, model, parameter
from ...physics import BraidedTube, MooneyRivlinTube
from .rubber_hardness import HARDNESSES, modulus_of_hardness

INACTIVE_DIAMETERS = 1.0
"""Length at both ends together that does not contract, in diameters of the braid (chosen)."""
NEUTRAL_ANGLE = math.atan(math.sqrt(2.0))
"""Angle [rad] at which the volume within inextensible threads is greatest, 54.7 degrees."""
YOUNG = 6.0
"""Young's modulus over C_1 of neo-Hookean rubber: E = 3 mu, mu = 2 C_1."""


@dataclasses.dataclass(frozen=True)
class DimensionTolerance:
    """Half width of a dimension of the recipe, within which its true value is equally likely."""

    half_width: float
    unit: str
    source: str = "chosen"


TOLERANCES: Mapping[str, DimensionTolerance] = {
    "bore": DimensionTolerance(0.1e-3, "m"),
    "wall_thickness": DimensionTolerance(0.05e-3, "m"),
    "hardness": DimensionTolerance(5.0, "Shore A"),
    "modulus": DimensionTolerance(0.15, "1"),
    "braid_diameter": DimensionTolerance(0.1e-3, "m"),
    "braid_angle": DimensionTolerance(math.radians(1.5), "rad"),
    "inactive_length": DimensionTolerance(0.5, "braid diameters"),
    "friction": DimensionTolerance(0.05, "1"),
}
"""Tolerances of a caliper, a data sheet and a photograph of the braid; `friction` is the force of
the threads against each other, as a part of that of the ideal braid at rest at the same pressure.
"""


@model
class MuscleRecipe:
    """What is measured of a muscle before it is made."""

    bore: float = parameter("m", "d_i", "inner diameter of the tube", bounds=(2e-4, 0.1))
    wall_thickness: float = parameter("m", "h", "wall of the tube", bounds=(1e-5, 0.02))
    resting_length: float = parameter(
        "m", "L_0", "length between the crimps, without pressure and load", bounds=(5e-3, 20.0)
    )
    braid_angle: float = parameter(
        "rad",
        "theta_0",
        "angle between threads and axis, of the braid on the tube",
        bounds=(0.05, 1.5),
    )
    thread_diameter: float = parameter(
        "m", "d", "diameter of a thread", bounds=(0.0, 5e-3), default=0.0
    )
    hardness: float = parameter(
        "1",
        "S",
        "Shore A hardness of the tube; 0 where the modulus is given",
        bounds=(0.0, 100.0),
        default=0.0,
    )
    modulus: float = parameter(
        "Pa",
        "E",
        "Young's modulus of the tube; 0 where the hardness is given",
        bounds=(0.0, 1e9),
        default=0.0,
    )
    braid_diameter: float = parameter(
        "m",
        "D",
        "outer diameter of the braid at rest; 0 for a braid that lies on the tube",
        bounds=(0.0, 0.2),
        default=0.0,
    )
    inactive_length: float = parameter(
        "m",
        "l_e",
        "length at both ends together that does not contract; 0 for one diameter of the braid",
        bounds=(0.0, 1.0),
        default=0.0,
    )
    threads: int = 0
    """Number of threads of the braid; 0 where it was not counted."""

    def check(self) -> None:
        """Raise ParameterError for a tube without one stated elasticity, a braid that is narrower
        than the tube or lengthens under pressure, or threads that do not fit beside each other.
        """
        if (self.hardness == 0.0) == (self.modulus == 0.0):
            raise ParameterError(
                "MuscleRecipe: give the Shore A hardness or Young's modulus of the tube, one of"
                " both."
            )
        if self.hardness:
            modulus_of_hardness(self.hardness)
        self._check_braid()
        self._check_threads()

    def _check_braid(self) -> None:
        if self.braid_angle >= NEUTRAL_ANGLE:
            raise ParameterError(
                f"MuscleRecipe: a braid of {math.degrees(self.braid_angle):.4g} deg makes the"
                " muscle longer under pressure; allowed range: below"
                f" {math.degrees(NEUTRAL_ANGLE):.3g} deg. Measure the angle between thread and"
                " axis; between crossing threads it is twice as large."
            )
        narrowest = self._braid_on_tube
        if self.braid_diameter and self.braid_diameter < narrowest * (1.0 - 1e-9):
            raise ParameterError(
                f"MuscleRecipe: the braid has an outer diameter of {1e3 * self.braid_diameter:.4g}"
                f" mm, and on a tube of {1e3 * self._tube_diameter:.4g} mm it has"
                f" {1e3 * narrowest:.4g} mm or more. Measure the braid on the tube."
            )

    def _check_threads(self) -> None:
        if self.threads < 0 or self.threads % 2:
            raise ParameterError(
                f"MuscleRecipe: threads is {self.threads}; it must be an even number, half of them"
                " in each direction."
            )
        if self.threads and self.thread_diameter and self.cover > 1.0:
            raise ParameterError(
                f"MuscleRecipe: {self.threads} threads of {1e3 * self.thread_diameter:.3g} mm do"
                f" not fit beside each other on {1e3 * self.outer_diameter:.4g} mm at"
                f" {math.degrees(self.braid_angle):.3g} deg: they cover {100 * self.cover:.4g} % of"
                " the circumference. Check number, diameter and angle."
            )

    @property
    def _tube_diameter(self) -> float:
        return self.bore + 2.0 * self.wall_thickness

    @property
    def _braid_on_tube(self) -> float:
        """Outer diameter [m] of the braid where it lies on the tube: two crossing threads."""
        return self._tube_diameter + 4.0 * self.thread_diameter

    @property
    def outer_diameter(self) -> float:
        """Outer diameter [m] of the braid at rest."""
        return self.braid_diameter or self._braid_on_tube

    @property
    def ends(self) -> float:
        """Length [m] at both ends together that does not contract."""
        return self.inactive_length or INACTIVE_DIAMETERS * self.outer_diameter

    @property
    def cover(self) -> float:
        """Part of the circumference [1] that the threads of one direction cover at rest."""
        circumference = math.pi * (self.outer_diameter - 2.0 * self.thread_diameter)
        spacing = 2.0 * circumference * math.cos(self.braid_angle) / max(self.threads, 1)
        return self.thread_diameter / spacing if self.threads else 0.0

    def law(self) -> MooneyRivlinTube:
        """The law of the recipe, with the middle of the modulus."""
        modulus = self.modulus or modulus_of_hardness(self.hardness).middle
        return self._law_of(self.bore, self.wall_thickness, modulus, {})

    @property
    def tolerances(self) -> dict[str, DimensionTolerance]:
        """The tolerances of what the recipe states."""
        elastic = "hardness" if self.hardness else "modulus"
        left_out = {"hardness", "modulus"} - {elastic}
        if not self.braid_diameter:  # the braid follows the tube
            left_out.add("braid_diameter")
        return {name: item for name, item in TOLERANCES.items() if name not in left_out}

    def drawn(self, uniform: Array) -> MooneyRivlinTube:
        """The law with dimensions drawn within their tolerances.

        uniform  numbers between 0 and 1, in the order of `tolerances`
        """
        tolerances = self.tolerances
        shifts = {
            name: tolerance.half_width * float(2.0 * number - 1.0)
            for (name, tolerance), number in zip(tolerances.items(), uniform, strict=True)
        }
        bore = max(self.bore + shifts["bore"], 0.5 * self.bore)
        wall = max(self.wall_thickness + shifts["wall_thickness"], 0.2 * self.wall_thickness)
        elastic = "hardness" if self.hardness else "modulus"
        number = float(uniform[list(tolerances).index(elastic)])
        return self._law_of(bore, wall, self._drawn_modulus(number), shifts)

    def _drawn_modulus(self, number: float) -> float:
        """A modulus [Pa] between the least and the greatest of the hardness; the logarithm is
        equally likely between them.
        """
        if self.modulus:
            return self.modulus * (1.0 + TOLERANCES["modulus"].half_width * (2.0 * number - 1.0))
        half_width = TOLERANCES["hardness"].half_width
        low = max(self.hardness - half_width, HARDNESSES[0])
        high = min(self.hardness + half_width, HARDNESSES[1])
        middle = 0.5 * (low + high)
        modulus = modulus_of_hardness(middle, 0.5 * (high - low))
        greatest_ratio = modulus.greatest / modulus.least
        return float(modulus.least * greatest_ratio**number)

    def _law_of(
        self, bore: float, wall: float, modulus: float, shifts: Mapping[str, float]
    ) -> MooneyRivlinTube:
        """The law of a tube, with shifts of the other dimensions."""
        outer = self.outer_diameter + shifts.get("braid_diameter", 0.0)
        on_tube = bore + 2.0 * wall + 4.0 * self.thread_diameter
        gap = 0.5 * (outer - on_tube) if self.braid_diameter else 0.0
        ends = self.ends + shifts.get("inactive_length", 0.0) * self.outer_diameter
        geometry = BraidedTube(
            braid_angle=self.braid_angle + shifts.get("braid_angle", 0.0),
            resting_length=self.resting_length,
            bore_radius=0.5 * bore,
            wall_thickness=wall,
            thread_distance=self.thread_diameter,
            clearance=max(gap, 0.0),
            inactive_length=min(max(ends, 0.0), 0.5 * self.resting_length),
        )
        return MooneyRivlinTube(geometry, modulus / YOUNG)


def angle_of_turn(turn: Any, diameter: float) -> float:
    """Angle [rad] between thread and axis from the length of one turn of a thread [m] and the
    diameter of the middle of the braid [m]: tan(theta) = pi D/turn. Raises ParameterError.
    """
    if not (math.isfinite(turn) and turn > 0.0):
        raise ParameterError(
            f"angle_of_turn: the length of one turn is {turn:g} m; it must be positive."
        )
    return math.atan(math.pi * diameter / turn)
