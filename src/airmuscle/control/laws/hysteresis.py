"""Compensation of hysteresis: modified Prandtl-Ishlinskii operator, its inverse, and a law behind
it.
"""

import itertools
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from ...core import Array, Reference, Value, model, ops, parameter, select_prefix, with_prefix
from ...core.errors import ParameterError, check_known
from ...engine.loop import ControlLaw, EnclosingLaw, Measurement, Memory, Sampled
from ...physics.muscle.friction.slip_elements import KUHNEN2003


@model
class HysteresisOperator:
    """Modified Prandtl-Ishlinskii operator: y = S(sum w_i P_ri[x]),  S(u) = v_0 u + sum v_j
    D_dj(u).

        P_r  play operator, z_k = max(x_k - r, min(x_k + r, z_(k-1)));  P_0 is the identity
        D_d  dead zone, max(u - d, 0) for d > 0 and min(u - d, 0) for d < 0

    r_i = 0 < r_1 < r_2 ... with weights w_0 > 0, w_i; d_j with weights v_j, v_0 = 1. The operator
    is invertible if w_0 + w_1 + ... + w_i > 0 for every i, and 1 + the sum of the active v_j > 0 on
    either side. The inverse is x = sum w'_i P_r'i[S'(y)], with

        w'_0 = 1/w_0,   w'_i = -w_i/(W_i W_(i-1)),   W_i = w_0 + ... + w_i,   r'_i = sum_(j <= i)
                        w_j (r_i - r_j)

    and the same formula for the weights and thresholds of S' on each side; play i of the inverse
    starts at z'_i = sum_(j <= i) w_j z_i + sum_(j > i) w_j z_j. Plays start at 0 here. Input and
    output have one unit. Reference: Kuhnen (2003).
    """

    references: ClassVar[tuple[Reference, ...]] = (KUHNEN2003,)

    thresholds: tuple[float, ...] = parameter(
        "u", "r_i", "threshold of each play, the first is 0", fitted=False
    )
    weights: tuple[float, ...] = parameter("1", "w_i", "weight of each play")
    dead_zones: tuple[float, ...] = parameter(
        "u", "d_j", "threshold of each dead zone", fitted=False, default=()
    )
    dead_zone_weights: tuple[float, ...] = parameter(
        "1", "v_j", "weight of each dead zone", default=()
    )

    def check(self) -> None:
        if not self.thresholds or len(self.thresholds) != len(self.weights):
            raise ParameterError(
                f"HysteresisOperator: {len(self.thresholds)} thresholds and {len(self.weights)}"
                " weights; give as many, one or more."
            )
        if self.thresholds[0] != 0.0 or any(b <= a for a, b in itertools.pairwise(self.thresholds)):
            raise ParameterError(
                "HysteresisOperator: the thresholds must begin with 0 and increase."
            )
        if len(self.dead_zones) != len(self.dead_zone_weights) or 0.0 in self.dead_zones:
            raise ParameterError(
                f"HysteresisOperator: {len(self.dead_zones)} dead zones and"
                f" {len(self.dead_zone_weights)} weights; give one threshold, other than 0, and one"
                " weight for each."
            )
        sums = [
            np.cumsum(self.weights),
            *(np.cumsum([1.0, *self._side(side)[1]]) for side in (1, -1)),
        ]
        if not all(w > 0.0 for w in np.concatenate(sums)):
            raise ParameterError(
                "HysteresisOperator: every partial sum of the weights of the plays, and 1 plus that"
                " of the dead zones of either side, must be positive. Otherwise there is no"
                " inverse."
            )

    def _side(self, sign: float) -> tuple[list[float], list[float]]:
        """Thresholds and weights of the dead zones of one side, from the inner to the outer one."""
        pairs = zip(self.dead_zones, self.dead_zone_weights, strict=True)
        side = sorted((pair for pair in pairs if sign * pair[0] > 0), key=lambda pair: abs(pair[0]))
        return [d for d, _ in side], [v for _, v in side]

    @property
    def inverse(self) -> "InverseHysteresisOperator":
        """The inverse operator."""
        thresholds, weights = _inverted(self.thresholds, self.weights)
        sides = [_inverted([0.0, *d], [1.0, *v]) for d, v in (self._side(1.0), self._side(-1.0))]
        return InverseHysteresisOperator(
            tuple(thresholds),
            tuple(weights),
            tuple(d for side in sides for d in side[0][1:]),
            tuple(v for side in sides for v in side[1][1:]),
        )

    def output(self, path: Any) -> Array:
        """Outputs (N,) along a path of inputs (N,), with all plays at 0 before."""
        plays = np.array([_play_along(path, r) for r in self.thresholds])
        return np.array(
            [superposed(u, self.dead_zones, self.dead_zone_weights) for u in self.weights @ plays]
        )

    @classmethod
    def fitted(cls, path: Any, output: Any, thresholds: Sequence[float]) -> "HysteresisOperator":
        """The operator without dead zones that reproduces outputs (N,) along a path (N,) by least
        squares.

        The thresholds begin with 0. Weights are not negative, so that there is an inverse (Kuhnen
        2003).
        """
        from scipy.optimize import nnls

        x, y = (np.asarray(values, dtype=float) for values in (path, output))
        if x.ndim != 1 or x.shape != y.shape or not np.isfinite([x, y]).all():
            raise ParameterError(
                "HysteresisOperator.fitted: path and output must be finite arrays (N,) of one"
                " length."
            )
        plays = np.array([_play_along(x, r) for r in thresholds]).T
        return cls(tuple(map(float, thresholds)), tuple(nnls(plays, y)[0].tolist()))


@model
class InverseHysteresisOperator:
    """Inverse of a HysteresisOperator: x = sum w'_i P_r'i[S'(y)]; made by
    `HysteresisOperator.inverse`.
    """

    references: ClassVar[tuple[Reference, ...]] = (KUHNEN2003,)

    thresholds: tuple[float, ...] = parameter("u", "r'_i", "threshold of each play", fitted=False)
    weights: tuple[float, ...] = parameter("1", "w'_i", "weight of each play", fitted=False)
    dead_zones: tuple[float, ...] = parameter(
        "u", "d'_j", "threshold of each dead zone", fitted=False, default=()
    )
    dead_zone_weights: tuple[float, ...] = parameter(
        "1", "v'_j", "weight of each dead zone", fitted=False, default=()
    )

    @property
    def initial_memory(self) -> dict[str, float]:
        """The plays, all at 0."""
        return {f"play{i}": 0.0 for i in range(len(self.thresholds))}

    def step(self, memory: Mapping[str, Value], wanted: Value) -> tuple[Value, dict[str, Value]]:
        """The input for a wanted output, and the plays after it; written over `ops`."""
        at = superposed(wanted, self.dead_zones, self.dead_zone_weights)
        plays = {
            name: ops.maximum(at - r, ops.minimum(at + r, memory[name]))
            for name, r in zip(self.initial_memory, self.thresholds, strict=True)
        }
        return sum(w * z for w, z in zip(self.weights, plays.values(), strict=True)), plays

    def output(self, path: Any) -> Array:
        """Inputs (N,) of the operator that give a path of wanted outputs (N,)."""
        memory: Mapping[str, Value] = self.initial_memory
        outputs = []
        for wanted in np.asarray(path, dtype=float).tolist():
            value, memory = self.step(memory, wanted)
            outputs.append(float(value))
        return np.array(outputs)


def superposed(value: Value, thresholds: tuple[Value, ...], weights: tuple[Value, ...]) -> Value:
    """S(u) = u + sum v_j D_dj(u)."""
    total = value
    for threshold, weight in zip(thresholds, weights, strict=True):
        excess = value - threshold
        total = total + weight * ops.where(
            threshold > 0, ops.maximum(excess, 0.0), ops.minimum(excess, 0.0)
        )
    return total


def _inverted(
    thresholds: Sequence[float], weights: Sequence[float]
) -> tuple[list[float], list[float]]:
    sums = np.cumsum(weights).tolist()
    inverse = [
        1.0 / weights[0],
        *(-w / (a * b) for w, a, b in zip(weights[1:], sums[1:], sums, strict=False)),
    ]
    pairs = list(zip(weights, thresholds, strict=True))
    return [
        float(sum(w * (r - s) for w, s in pairs[: i + 1])) for i, r in enumerate(thresholds)
    ], inverse


def _play_along(path: Any, threshold: float) -> list[float]:
    outputs = []
    z = 0.0
    for x in np.asarray(path, dtype=float).tolist():
        z = max(x - threshold, min(x + threshold, z))
        outputs.append(z)
    return outputs


@model
class HysteresisCompensation(EnclosingLaw):
    """u_k = Gamma^-1[v]_k: an input receives the command v of a law through an inverse hysteresis
    operator.

    If the plant responds to u as to Gamma[u] without hysteresis, the hysteresis cancels. Where the
    input is limited to its range, the plays follow the command v as if it were not. A law with
    integral action sees the range of u. Reference: Kuhnen (2003).
    """

    references: ClassVar[tuple[Reference, ...]] = (KUHNEN2003,)

    law: ControlLaw
    commanded: str
    inverse: InverseHysteresisOperator

    def check(self) -> None:
        check_known(
            "HysteresisCompensation: the law does not command",
            self.commanded,
            self.law.inputs,
            "it commands",
        )

    @property
    def initial_memory(self) -> dict[str, float]:
        """The plays of the inverse, `hysteresis.play0`, and the values of the law with the prefix
        `law.`.
        """
        plays = with_prefix("hysteresis.", self.inverse.initial_memory)
        return {**plays, **with_prefix("law.", self.law.initial_memory)}

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        commands, kept = self.law.step(select_prefix("law.", memory), measurement, dt)
        value, plays = self.inverse.step(
            select_prefix("hysteresis.", memory), commands[self.commanded]
        )
        commands = {**commands, self.commanded: value}
        return commands, {**with_prefix("hysteresis.", plays), **with_prefix("law.", kept)}
