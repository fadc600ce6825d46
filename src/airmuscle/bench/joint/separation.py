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

UNSEPARATED, SHARE, NAMED = 1.0, 0.1, 4
"""Standard error of a direction, relative to its parameters, from which it is not separated; share of a parameter in a
direction that is named, and number of those (chosen)."""
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
    """A parameter by its path in the arm, its value and its standard error [SI], which is robust between episodes."""

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
    information = np.einsum("nrp,nr,nrq->pq", scaled, weight, scaled)
    scores = np.einsum("nrp,nr->np", scaled, weight * error)
    scores = np.array([scores[some.episode == e].sum(axis=0) for e in np.unique(some.episode)])
    larger = len(windows) / len(some)  # the information of all windows
    levels, directions = np.linalg.eigh(information * larger)
    meat = directions.T @ (scores.T @ scores * larger) @ directions
    deviation = np.sqrt(np.maximum(np.diag(meat), 0.0)) / np.maximum(levels, 1e-300)
    weak = (deviation > UNSEPARATED) | (levels < 1e-12 * levels[-1])
    inverse = directions / np.maximum(levels, 1e-12 * levels[-1])
    covariance = inverse @ meat @ inverse.T
    estimates = [
        ArmParameter(path, float(value), float(size * np.sqrt(max(variance, 0.0))))
        for path, value, size, variance in zip(paths, values, sizes, np.diag(covariance), strict=True)
    ]
    return estimates, [_words(joint, paths, directions[:, i] ** 2) for i in np.flatnonzero(weak)]


def _words(joint: int, paths: Sequence[str], shares: Array) -> str:
    order = [i for i in np.argsort(-shares) if shares[i] > SHARE][:NAMED] or [int(np.argmax(shares))]
    names = list(dict.fromkeys(_name(paths[i]) for i in order))
    remedy = "fix one of them, or measure it" if len(names) > 1 else "fix it, or measure it"
    return f"joint {joint + 1}: {', '.join(names)} {'are' if len(names) > 1 else 'is'} not separated; {remedy}"


def _name(path: str) -> str:
    field = path.rsplit(".", 1)[-1]
    muscle = path.split("]", maxsplit=1)[0].removeprefix("muscle[") if path.startswith("muscle[") else ""
    word = WORDS[field.split("[", maxsplit=1)[0]]
    if muscle:
        return f"{word} of muscle {int(muscle) + 1}" + (f" (degree {field[-2]})" if field.endswith("]") else "")
    if field.startswith(("lags", "load_arms")):
        return f"{word} of muscle {int(field.split('[')[1][:-1]) + 1}"
    return word
