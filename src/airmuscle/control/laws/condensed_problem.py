"""CondensedProblem: the quadratic program of linear model predictive control, in the commands alone."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from ...core.arrays import Array


@dataclasses.dataclass(frozen=True, eq=False)
class CondensedProblem:
    """min 1/2 z^T H z + (f e)^T z  with  l - z_0 <= z <= u - z_0,  l_A - A_e e <= A z <= u_A - A_e e.

    z = (v_0, ..., v_(N-1), s): deviations of the inputs from their target over N samples, and one slack variable s >= 0
    for each limited column. e: deviation (n,) of the state from its target.

    hessian      H (z, z)
    gradient     f (z, n)
    rows         A (r, z): limited columns minus or plus their slack
    rows_by_state    A_e (r, n)
    limited      (r,) index of the limited column of each row
    upper        (r,) whether a row is an upper limit
    """

    horizon: int
    inputs: int
    slacks: int
    hessian: Array
    gradient: Array
    rows: Array
    rows_by_state: Array
    limited: npt.NDArray[np.intp]
    upper: npt.NDArray[np.bool_]

    def __repr__(self) -> str:
        return f"CondensedProblem({self.horizon} samples, {self.inputs} inputs, {len(self.rows)} limits of columns)"


def condense(
    a: Array, b: Array, weights: Array, costs: Array, terminal: Array, horizon: int, columns: Array, slack_weight: float
) -> CondensedProblem:
    """The problem of x_(k+1) = a x_k + b v_k with the cost sum x^T W x + v^T R v, and the terminal cost x_N^T P x_N.

    columns (l, n) are limited at every sample from the next one on; their slack s costs slack_weight s^2, and there is
    none where slack_weight is infinite. Reference: Rawlings, Mayne and Diehl (2017), chapter 8.
    """
    n, m = b.shape
    powers = [np.eye(n)]
    for _ in range(horizon):
        powers.append(a @ powers[-1])
    forced = np.zeros((horizon, n, horizon, m))
    for k in range(horizon):
        for j in range(k + 1):
            forced[k, :, j] = powers[k - j] @ b
    by_input, by_state = forced.reshape(horizon * n, horizon * m), np.concatenate(powers[1:])
    each = np.kron(np.eye(horizon), weights)
    each[-n:, -n:] = terminal
    soft = len(columns) if np.isfinite(slack_weight) else 0
    size = horizon * m + soft
    hessian, gradient = np.zeros((size, size)), np.zeros((size, n))
    inner = by_input.T @ each @ by_input + np.kron(np.eye(horizon), costs)
    hessian[: horizon * m, : horizon * m] = inner + inner.T
    gradient[: horizon * m] = 2.0 * by_input.T @ each @ by_state
    for i in range(soft):
        hessian[horizon * m + i, horizon * m + i] = 2.0 * slack_weight
    limited = np.kron(np.eye(horizon), columns)
    rows = np.hstack([limited @ by_input, np.zeros((len(limited), soft))])
    upper, lower, index = rows.copy(), rows.copy(), np.tile(np.arange(len(columns)), horizon)
    if soft:
        upper[np.arange(len(rows)), horizon * m + index] = -1.0
        lower[np.arange(len(rows)), horizon * m + index] = 1.0
    ahead = limited @ by_state
    return CondensedProblem(
        horizon, m, soft, hessian, gradient, np.vstack([upper, lower]), np.vstack([ahead, ahead]),
        np.concatenate([index, index]), np.arange(2 * len(rows)) < len(rows),
    )  # fmt: skip
