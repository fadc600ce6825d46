"""Operations of laws with the points at which they are compared with NumPy, and a system whose rates
are their values.
"""

from __future__ import annotations

import numpy as np

from airmuscle.core import StateVariable, System, model, ops

OWN = {"absolute_value": np.abs, "both": np.logical_and, "either": np.logical_or}
"""Names of this package's own, with the functions of NumPy."""
ONE_ARGUMENT = {
    "abs": (-2.5, -0.3, 0.7),
    "absolute_value": (-2.5, -0.3, 0.7),
    "arccos": (-0.9, 0.1, 0.8),
    "arccosh": (1.1, 1.5, 40.0),
    "arcsin": (-0.9, 0.1, 0.8),
    "arcsinh": (-3.0, 0.1, 8.0),
    "arctan": (-3.0, 0.1, 8.0),
    "arctanh": (-0.9, 1e-3, 0.8),
    "ceil": (-1.5, 0.2, 3.7),
    "cos": (-2.0, 0.3, 4.0),
    "cosh": (-2.0, 0.3, 4.0),
    "exp": (-2.0, 0.3, 4.0),
    "expm1": (-2.0, 1e-6, 4.0),
    "floor": (-1.5, 0.2, 3.7),
    "log": (0.1, 1.7, 300.0),
    "log10": (0.1, 1.7, 300.0),
    "log1p": (-0.5, 1e-6, 4.0),
    "log2": (0.1, 1.7, 300.0),
    "sign": (-2.5, -0.3, 0.7),
    "sin": (-2.0, 0.3, 4.0),
    "sinh": (-2.0, 0.3, 4.0),
    "sqrt": (0.1, 1.7, 300.0),
    "square": (-2.0, 0.3, 4.0),
    "tan": (-1.2, 0.3, 1.0),
    "tanh": (-2.0, 0.3, 1.0),
}
"""Operations of one argument, and the points at which they are compared."""
PAIRS = ((0.3, 0.7), (2.0, -1.5), (-1.2, 0.4), (-0.2, -0.9), (1.4, -0.1))
TWO_ARGUMENTS = {
    "arctan2": PAIRS,
    "hypot": PAIRS,
    "maximum": PAIRS,
    "minimum": PAIRS,
    "power": ((0.3, 0.7), (2.0, -1.5), (1.2, 3.0), (0.8, 0.5)),
}
POINTS = {
    **{name: tuple((x,) for x in points) for name, points in ONE_ARGUMENT.items()},
    **TWO_ARGUMENTS,
}


def of_numpy(name: str):
    return OWN.get(name) or getattr(np, name)


@model
class Operations(System):
    """States of each operation as its arguments, and its value as their rate."""

    inputs = ()

    @property
    def states(self):
        return tuple(
            StateVariable(f"{name}_{i}", "1", 1.0)
            for name, points in POINTS.items()
            for i in range(len(points[0]))
        )

    def rates(self, state, inputs):
        rates = {}
        for name, points in POINTS.items():
            names = [f"{name}_{i}" for i in range(len(points[0]))]
            value = getattr(ops, name)(*[state[argument] for argument in names])
            rates.update(dict.fromkeys(names, value))
        return rates

    def outputs(self, state, inputs):
        return {}


def states_and_values() -> tuple[np.ndarray, np.ndarray]:
    """States of Operations at the points, and the rates by NumPy."""
    count = min(map(len, POINTS.values()))
    states = [[x for points in POINTS.values() for x in points[k]] for k in range(count)]
    values = [
        [float(of_numpy(name)(*points[k])) for name, points in POINTS.items() for _ in points[k]]
        for k in range(count)
    ]
    return np.array(states), np.array(values)
