"""Separation of parameters by a record: covariance of the estimates, and directions that have no value."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from ...core import tree
from ...core.arrays import Array
from ...physics import PressureDriven
from .descent import CLIP, OUTLIER, gradients, typical_size
from .windows import Windows

UNSEPARATED, SHARE, NAMED = 1.0, 0.1, 6
"""Standard error of a direction, relative to its parameters, from which it is not separated; share of a parameter in
such directions that is named, and number of names (chosen)."""
WINDOWS = 300
"""Windows from which the information is computed (chosen)."""
WORDS = {
    "area": "effective area", "passive_force": "force without pressure", "slack_width": "width of slackening",
    "lags": "lag of the pressure", "coulomb_torque": "dry friction", "presliding_angle": "presliding angle",
    "load_arms": "growth of friction with tension", "static_excess": "stiction", "stribeck_speed": "Stribeck speed",
    "damping": "viscous friction", "rotor_inertia": "inertia", "inertia": "inertia of a link",
    "mass": "mass of a link", "centre": "centre of mass",
    "zero_angle": "direction of gravity",
}  # fmt: skip


@dataclasses.dataclass(frozen=True)
class ArmParameter:
    """A parameter by its path in the arm, its value and its standard error [SI], a window as one observation."""

    path: str
    value: float
    standard_error: float


def separate(
    arm: PressureDriven, joint: int, paths: Sequence[str], windows: Windows
) -> tuple[list[ArmParameter], list[str]]:
    """Estimates of one joint, and what the record does not separate, in words; from the Fisher information."""
    some = windows.part(np.linspace(0, len(windows) - 1, min(WINDOWS, len(windows))).astype(int))
    leaves = {leaf.path: leaf for leaf in tree.leaves(arm)}
    values = np.array([float(leaves[path].value) for path in paths])
    sizes = np.maximum(np.abs(values), [typical_size(path, leaves) for path in paths])
    error, gradient = gradients(arm, joint, paths, some)
    lost = ~np.isfinite(error) | (np.abs(error) > OUTLIER) | ~np.isfinite(gradient).all(axis=-1)
    error, scaled = np.where(lost, 0.0, error), np.where(lost[..., None], 0.0, gradient) * sizes
    weight = 1.0 / np.sqrt(1.0 + (error / CLIP) ** 2)
    scale = np.sqrt(np.mean(error**2) * windows.rows)  # the errors of one window count as one
    information = (
        np.einsum("nrp,nr,nrq->pq", scaled, weight, scaled) * (len(windows) / len(some)) / max(scale, 1e-9) ** 2
    )
    levels, directions = np.linalg.eigh(information)
    weak = levels < 1.0 / UNSEPARATED**2
    inverse = directions / np.sqrt(np.maximum(levels, 1e-12 * levels[-1]))
    deviations = np.sqrt(np.sum(inverse**2, axis=1)) * sizes
    estimates = [
        ArmParameter(path, float(value), float(deviation))
        for path, value, deviation in zip(paths, values, deviations, strict=True)
    ]
    return estimates, _words(joint, paths, np.sum(directions[:, weak] ** 2, axis=1))


def _words(joint: int, paths: Sequence[str], shares: Array) -> list[str]:
    """The parameters of the directions that are not separated, first those that have the least information."""
    names = list(dict.fromkeys(_name(paths[i]) for i in np.argsort(-shares) if shares[i] > SHARE))
    if not names:
        return []
    further = f" and {len(names) - NAMED} others" if len(names) > NAMED else ""
    return [
        f"joint {joint + 1}: the record does not separate {', '.join(names[:NAMED])}{further}: combinations of them "
        "may have any value; fix or measure them before they are read as properties of the arm"
    ]


def _name(path: str) -> str:
    field = path.rsplit(".", 1)[-1]
    muscle = path.split("]", maxsplit=1)[0].removeprefix("muscle[") if path.startswith("muscle[") else ""
    word = WORDS[field.split("[", maxsplit=1)[0]]
    if muscle:
        return f"{word} of muscle {int(muscle) + 1}" + (f" (degree {field[-2]})" if field.endswith("]") else "")
    if field.startswith(("lags", "load_arms")):
        return f"{word} of muscle {int(field.split('[')[1][:-1]) + 1}"
    return word
