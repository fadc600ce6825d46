"""Previous model of the straight-fibre muscle: circular meridian of Ferraresi et al. 2001, as Saga
et al. print it.
"""

import dataclasses
import math
from typing import Any

import numpy as np

import airmuscle as am

from ..core import BLACK, DASHES, LINES, ParameterError, SolveError, new_figure
from ..report.chapter import Plot, Table
from . import saga2007_pairs as pairs
from .run import captioned
from .saga2007_muscle import DIAMETER, LENGTH, PRESSURE, WALL, exact_meridian
from .saga2007_muscle import LINES as RUBBER

FIBRES = 16
"""Number of fibres of Table 1."""
FIG_1 = (PRESSURE, 0.16e6)
FIG_1_LOAD = 100.0
"""Gauge pressures [Pa] and load [N] of Fig. 1 (chosen: pressure of the claims, and end of the axis
of Fig. 8).
"""
INITIAL_RADIUS_RATIO = 0.9
"""Ratio of initial to end radius in the table, to show the term of the two radii (chosen)."""


@dataclasses.dataclass(frozen=True)
class Ferraresi2001:
    """Muscle with a circular meridian and the force balances (A) and (B), whose labels are lost.

        (A) (2 E R^2 s/ri)(sin phi - phi cos phi) + E lf s (r0 - ri)/ri + T sin phi
            Sum_{n=-N/4}^{N/4} cos(2 pi n/N)
              - p [R^2 phi + 2 R r0 sin phi - (R^2/2) sin 2 phi] = 0
        (B) F + pi p (r0 + R (1 - cos phi))^2 - N T = 0

    R, phi radius and half angle of the meridian, lf = 2 R phi length of a fibre, r0 radius of the
    ends, ri initial radius of the tube, s wall thickness, E modulus, T tension of one fibre, p
    gauge pressure, F tension. The modulus is the slope of the rubber line; its intercept, which (A)
    does not contain, adds beta lf s. The sum is cot(pi/N). Reference: Ferraresi et al. 2001, as
    quoted by Saga et al. 2007.
    """

    rubber: am.characteristic.RubberLine
    fibre_length: float = LENGTH
    end_radius: float = DIAMETER / 2
    initial_radius: float = DIAMETER / 2
    wall_thickness: float = WALL
    fibres: int = FIBRES

    def __post_init__(self) -> None:
        if self.fibres < 4 or self.fibres % 4:
            raise ParameterError(
                f"Ferraresi2001: fibres is {self.fibres}; it must be a multiple of 4, 4 or more."
            )

    @property
    def fibre_sum(self) -> float:
        """Sum of the cosines over the fibres of one half [1], as printed."""
        quarter = self.fibres // 4
        return math.fsum(
            math.cos(2 * math.pi * n / self.fibres) for n in range(-quarter, quarter + 1)
        )

    def circle(self, contraction: Any) -> tuple[Any, Any]:
        """Radius [m] and half angle [rad] of the meridian at a contraction, from sin(phi)/phi = 1 -
        contraction.
        """
        half_angle = np.sqrt(am.geometry.CircularArc().angle_squared(contraction))
        return self.fibre_length / (2 * half_angle), half_angle

    def hoop_force(self, contraction: Any) -> Any:
        """Hoop force of the rubber on the half shell [N]: the first two terms of (A), and that of
        the intercept.
        """
        radius, angle = self.circle(contraction)
        s = self.wall_thickness
        ri = self.initial_radius
        bulged = (
            2 * self.rubber.slope * radius**2 * s / ri * (np.sin(angle) - angle * np.cos(angle))
        )
        widened = self.rubber.slope * self.fibre_length * s * (self.end_radius - ri) / ri
        return bulged + widened + self.rubber.intercept * self.fibre_length * s

    def half_section(self, contraction: Any) -> Any:
        """The bracket of (A) [m2], on which the pressure acts."""
        radius, angle = self.circle(contraction)
        r0 = self.end_radius
        return (
            radius**2 * angle + 2 * radius * r0 * np.sin(angle) - radius**2 / 2 * np.sin(2 * angle)
        )

    def pressure(self, contraction: Any, force: Any) -> Any:
        """Gauge pressure [Pa] at a contraction and a tension [N]; NaN where the balances have no
        solution.
        """
        radius, angle = self.circle(contraction)
        lever = np.sin(angle) * self.fibre_sum / self.fibres
        middle_radius = self.end_radius + radius * (1 - np.cos(angle))
        area = self.half_section(contraction) - lever * np.pi * middle_radius**2
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(area > 0, (self.hoop_force(contraction) + lever * force) / area, np.nan)

    def contraction(self, pressure: float, force: float) -> float:
        """Smallest contraction [1] at a pressure [Pa] and tension [N]. Raises SolveError beyond
        0.01 to 45 %.
        """
        from scipy.optimize import brentq

        grid = np.geomspace(1e-4, 0.45, 400)
        above = np.flatnonzero(self.pressure(grid, force) >= pressure)
        if not above.size or above[0] == 0:
            raise SolveError(
                f"Ferraresi2001: no contraction from 0.01 to 45 % at {pressure / 1e3:g} kPa and"
                f" {force:g} N. Change the pressure or the load."
            )
        low = grid[above[0] - 1]
        high = grid[above[0]]
        return float(
            brentq(lambda c: float(self.pressure(c, force)) - pressure, low, high, xtol=1e-14)
        )


def radii_at_load() -> tuple[float, str]:
    """Return the ratio of the radii of the circle at the two pressures of Fig. 1 and one load
    [1].
    """
    model = Ferraresi2001(RUBBER["A"])
    first, second = (float(model.circle(model.contraction(p, FIG_1_LOAD))[0]) for p in FIG_1)
    note = (
        f"{1e3 * first:.3g} and {1e3 * second:.3g} mm at {FIG_1[0] / 1e6:g} and {FIG_1[1] / 1e6:g}"
        " MPa."
    )
    return first / second, note


def radii_at_contraction() -> tuple[float, str]:
    """Return the ratio of the radii of the circle at two loads [N] and 10 % contraction [1]."""
    model = Ferraresi2001(RUBBER["A"])
    loads = (50.0, 150.0)
    held = [float(model.pressure(0.1, force)) for force in loads]
    radii = [
        float(model.circle(model.contraction(p, f))[0]) for p, f in zip(held, loads, strict=True)
    ]
    return (
        radii[0] / radii[1],
        (
            f"At 10 % contraction with {loads[0]:g} and {loads[1]:g} N, that is at"
            f" {held[0] / 1e6:.3g} and {held[1] / 1e6:.3g} MPa. The circle depends on the"
            " contraction only, by sin(φ)/φ = 1 − ε; the pressure of a wanted contraction and load"
            " is then explicit, also in this model."
        ),
    )


def previous_model_table() -> Table:
    """Return the pressures of the previous model, as printed and with other fibres, and of the
    exact meridian.
    """
    contraction = pairs.CONTRACTIONS
    rows: list[tuple[str, float, Any]] = []
    for name, line in RUBBER.items():
        printed = Ferraresi2001(line)
        narrow = dataclasses.replace(
            printed, initial_radius=INITIAL_RADIUS_RATIO * printed.end_radius
        )
        for force in (0.0, 100.0):
            pressures = {
                "(A), (B) as printed": printed.pressure(contraction, force),
                "with evenly distributed fibres": pairs.pressures(line, force, contraction)[
                    "circle", "middle balance"
                ],
                f"as printed, ri = {INITIAL_RADIUS_RATIO:g} r0": narrow.pressure(
                    contraction, force
                ),
                "exact meridian": np.asarray(
                    exact_meridian(line).shape_at_force(contraction, force).pressure
                ),
            }
            rows += [
                (f"{model}, line {name}", force, pressure) for model, pressure in pressures.items()
            ]
    return pairs.pressure_table("saga2007_previous", rows)


def previous_model_figure() -> Plot:
    """Return Fig. 1: the circular meridian at two pressures, with centres and radii."""
    figure, axes = new_figure(height=4.2)
    model = Ferraresi2001(RUBBER["A"])
    for i, pressure in enumerate(FIG_1):
        c = model.contraction(pressure, FIG_1_LOAD)
        radius, angle = model.circle(c)
        radius *= 1e3  # [mm]
        centre = 1e3 * model.end_radius - radius * math.cos(angle)
        theta = np.linspace(-angle, angle, 201)
        label = f"{pressure / 1e6:g} MPa, {100 * c:.1f} %"
        axes.plot(
            radius * np.sin(theta),
            centre + radius * np.cos(theta),
            DASHES[i],
            color=LINES[i],
            label=label,
        )
        axes.plot([0.0], [centre], "o", color=LINES[i])
        direction = (-0.6 if i else 0.75) * angle
        tip = (radius * math.sin(direction), centre + radius * math.cos(direction))
        axes.annotate(
            "",
            tip,
            (0.0, centre),
            arrowprops={"arrowstyle": "->", "color": LINES[i], "linewidth": 0.9},
        )
        at = (0.3 * tip[0], centre + 0.3 * (tip[1] - centre))
        text = f"$R_{2 - i}$ = {radius:.1f} mm"
        side = "right" if i else "left"
        axes.annotate(
            text,
            at,
            xytext=(-6 if i else 6, 0),
            textcoords="offset points",
            ha=side,
            color=LINES[i],
        )
    axes.axhline(0.0, color=BLACK, linewidth=0.8, linestyle="-.")
    axes.set(xlabel="position along the axis [mm]", ylabel="radius [mm]", aspect="equal")
    axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1.0), title="pressure, contraction")
    return captioned("saga2007_fig1", figure)
