"""Feed-forward control of an antagonistic pair of straight-fibre muscles: error of the angle with
each model.

The paper proposes its closed form for feed-forward control. Here the pressures that a model gives
for an angle drive a pair of muscles with the exact meridian, in steady state and without friction;
the paper has no such experiment.
"""

import functools
from typing import Any

import numpy as np
import numpy.typing as npt

import airmuscle as am

from ..core import BLACK, DASHES, Array, legend_outside, new_figure
from ..core import LINES as COLOURS
from ..report.chapter import Plot, Table
from ..report.formatting import to_mathtext
from . import saga2007_muscle as values
from .run import captioned, titled
from .saga2007_muscle import LENGTH, LINES, circular_meridian, exact_meridian, pressure_along

RADIUS = 0.012
OFFSET = 0.08
TENSION = 50.0
"""Pulley radius [m], contraction of both muscles at angle 0, and tension of both muscles [N]
(chosen).
"""
SLACK_TENSION = 5.0
"""Tension [N] below which a muscle is called slack (chosen): the exact meridian ends shortly before
zero tension.
"""
ANGLES = tuple(np.radians((5.0, 10.0, 15.0)))
"""Wanted angles [rad] of the table (chosen); by symmetry the errors of negative angles are
opposite.
"""
LINE = tuple(np.radians(np.arange(1.0, 15.5)))
"""Wanted angles [rad] of the figure, from which the search for the greatest error starts."""
Angles = tuple[float, ...]
REACH = np.radians(25.0)
"""Greatest angle [rad] of the search for the angle that is reached: contractions of 0.7 % to 15.3 %
(chosen).
"""
GRID = 31
"""Angles of the search, between which the torque is interpolated by a cubic spline."""


def models(line: am.characteristic.RubberLine) -> dict[str, am.characteristic.Characteristic]:
    """Return the models that compute the pressures, by name, for one rubber line."""
    return {
        r"printed, \(w = 2\), \(q = 1\)": values.interpretation(line, 2.0, 1.0),
        "exact mechanics of the parabola": values.exact_mechanics(line),
        "circular meridian, virtual work": circular_meridian(line),
        "exact meridian": exact_meridian(line),
    }


def commanded_pressures(
    law: am.characteristic.Characteristic, tension: float, angles: Angles
) -> Array:
    """Return the pressures [Pa] (2, A) of both muscles for angles [rad] at equal tensions [N]."""
    turned = np.array(angles)
    return np.array(
        [
            pressure_along(law, OFFSET + sign * turned * RADIUS / LENGTH, tension)
            for sign in (1.0, -1.0)
        ]
    )


@functools.cache
def slack_angles(name: str, line: str, angles: Angles = ANGLES) -> npt.NDArray[np.bool_]:
    """Return whether both muscles are slack at each angle: pressures below the exact ones at
    SLACK_TENSION.
    """
    law = models(LINES[line])[name]
    truth = exact_meridian(LINES[line])
    below = commanded_pressures(law, TENSION, angles) < commanded_pressures(
        truth, SLACK_TENSION, angles
    )
    return np.asarray(below.all(axis=0))


@functools.cache
def reached_angles(name: str, line: str, angles: Angles = ANGLES) -> Array:
    """Return the angles [rad] of the exact pair at the pressures of a model for angles; NaN where
    it is slack.
    """
    law = models(LINES[line])[name]
    truth = exact_meridian(LINES[line])
    pressures = commanded_pressures(law, TENSION, angles)
    trial = np.linspace(-REACH, REACH, GRID)
    reached = []
    for pair in zip(*pressures, strict=True):
        tensions = [
            np.asarray(
                truth.shape_at_pressure(
                    np.full(GRID, p), OFFSET + sign * trial * RADIUS / LENGTH
                ).force
            )
            for p, sign in zip(pair, (1.0, -1.0), strict=True)
        ]
        reached.append(_first_zero(trial, tensions[0] - tensions[1]))
    return np.where(slack_angles(name, line, angles), np.nan, np.array(reached))


def _first_zero(angles: Array, difference: Array) -> float:
    """Return the angle at which the falling difference of the tensions is zero; NaN without one."""
    from scipy.interpolate import CubicSpline

    taut = np.isfinite(difference)
    if np.count_nonzero(taut) < 4:
        return float("nan")
    roots = CubicSpline(angles[taut], difference[taut]).roots(extrapolate=False)
    return float(roots[0]) if roots.size else float("nan")


def angle_errors(name: str, line: str, angles: Angles = LINE) -> Array:
    """Return the errors of the angles [rad]."""
    return np.asarray(reached_angles(name, line, angles) - np.array(angles))


@functools.cache
def max_angle_error(name: str, line: str) -> float:
    """Return the greatest error [rad] up to the greatest angle, refined within LINE; NaN where both
    are slack.
    """
    from scipy.optimize import minimize_scalar

    errors = np.abs(angle_errors(name, line))
    if np.isnan(errors).any():
        return float("nan")
    at = int(errors.argmax())
    span = (LINE[max(at - 1, 0)], LINE[min(at + 1, len(LINE) - 1)])

    def negative(angle: float) -> float:
        return -abs(float(angle_errors(name, line, (float(angle),))[0]))

    refined = minimize_scalar(negative, bounds=span, method="bounded", options={"xatol": 1e-3})
    return float(max(errors[at], -refined.fun))


def relative_angle_error(name: str, line: str) -> tuple[float, str]:
    """Return the greatest error of all angles relative to the greatest angle [%]; 100 % if the
    muscles are slack.
    """
    error = max_angle_error(name, line)
    slack = (
        "With the pressures of this model both muscles are slack: the joint is not moved, error"
        " 100 %."
    )
    return 100.0 * float(np.nan_to_num(error / ANGLES[-1], nan=1.0)), (
        slack if np.isnan(error) else ""
    )


def feed_forward_table() -> Table:
    """Return the angles that the exact pair reaches."""
    rows = [(name, line) for line in LINES for name in models(LINES[line])]
    columns: dict[str, list[Any]] = {
        "model": [name for name, _ in rows],
        "rubber line": [line for _, line in rows],
    }
    reached = np.degrees([reached_angles(name, line) for name, line in rows])
    for angle, column in zip(np.degrees(ANGLES), reached.T.tolist(), strict=True):
        columns[f"angle for {angle:g} degrees [degree]"] = [round(each, 3) for each in column]
    note = (
        "The model gives the pressures of both muscles for the wanted angle at equal tensions; the"
        " pair has the exact meridian. No value: both muscles are slack, because both pressures"
        f" are below those at which the exact muscle has a tension of {SLACK_TENSION:g} N (chosen)."
        " The last row of each line checks the computation: the exact model reaches each angle."
    )
    return titled("saga2007_feed_forward", columns, note=note)


def feed_forward_figure() -> Plot:
    """Return the error of the angle over the wanted angle."""
    figure, axes = new_figure(1, 2, height=3.0, sharey=True)
    wanted = np.degrees([-angle for angle in LINE[::-1]] + [0.0, *LINE])
    for axis, line in zip(axes, LINES, strict=True):
        for i, name in enumerate(list(models(LINES[line]))[:-1]):
            error = np.degrees(angle_errors(name, line))
            both = np.concatenate([-error[::-1], [0.0], error])
            axis.plot(wanted, both, linestyle=DASHES[i], color=COLOURS[i], label=to_mathtext(name))
        axis.axhline(0.0, color=BLACK, linewidth=0.6)
        axis.set(xlabel="wanted angle [degree]", title=f"rubber line {line}")
    axes[0].set_ylabel("error of the angle [degree]")
    legend_outside(axes[1])
    return captioned("saga2007_feed_forward", figure)
