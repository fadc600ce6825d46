"""Nonlinear programs of predictive control: target and plan of a plant as CasADi expressions, solved by Ipopt."""

import dataclasses
import functools
from collections.abc import Mapping
from typing import Any

import numpy as np

from ...core import Array, ParameterError, System

MAX_HORIZON = 200
"""Maximum number of samples of a horizon, whose matrices have the square of it, and of steps of a sample (chosen)."""
MAX_ITERATIONS = 100
"""Iterations after which a search has no solution (chosen)."""
TARGET_WEIGHT = 1e8
"""Weight of the set points against that of the inputs in the target, both relative to permitted deviations (chosen)."""
TOLERANCE = 1e-9
"""Tolerance of the optimality conditions, which are scaled (chosen)."""


def check_limits(owner: str, limits: Mapping[str, tuple[float, float]], slack_weight: float) -> None:
    """Raise ParameterError for limits of columns, or a weight of their violation, that make no program."""
    for name, (low, high) in limits.items():
        if not -np.inf < low < high < np.inf:
            raise ParameterError(
                f"{owner}: the limits of '{name}' are {low:g} and {high:g}; the minimum must be below the maximum, and "
                "both finite."
            )
    if not slack_weight > 0.0:
        raise ParameterError(f"{owner}: slack_weight is {slack_weight!r}; it must be positive.")


@dataclasses.dataclass(frozen=True, eq=False)
class PredictiveProgram:
    """The target and the plan of a plant, in states and inputs divided by `scale` (n,) and `sizes` (m,).

    disturbed   indices of the states to whose rates a disturbance is added
    inputs      values of all inputs of the plant; the commanded ones are replaced
    weights, terminal    (n, n) of the states of each sample and of the last one; those of the inputs are 1
    limits      minimum and maximum of columns; a violation is relative to the range
    """

    plant: System
    disturbed: list[int]
    inputs: Mapping[str, float]
    controlled: tuple[str, ...]
    commanded: tuple[str, ...]
    scale: Array
    sizes: Array
    weights: Array
    terminal: Array
    limits: Mapping[str, tuple[float, float]]
    slack_weight: float
    horizon: int
    substeps: int
    sample_time: float

    @functools.cached_property
    def _solvers(self) -> tuple[Any, Any]:
        """The solvers of target and plan, which hold the numbers of a search: one thread at a time uses them."""
        import casadi

        n, m = len(self.scale), len(self.sizes)
        x, u, d = casadi.SX.sym("x", n), casadi.SX.sym("u", m), casadi.SX.sym("d", len(self.disturbed))
        rates = casadi.Function("rates", [x, u, d], [self._rates(x, u, d)])
        columns = casadi.Function("columns", [x, u], [casadi.vertcat(*self._columns(x, u, self.controlled))])
        limited = casadi.Function("limited", [x, u], [casadi.vertcat(*self._limited(x, u))])
        options: Any = {
            "expand": True, "print_time": False,
            "ipopt": {"print_level": 0, "sb": "yes", "max_iter": MAX_ITERATIONS, "tol": TOLERANCE},
        }  # fmt: skip
        programs = {"target": self._target(rates, columns), "plan": self._plan(limited)}
        target, plan = (casadi.nlpsol(name, "ipopt", program, options) for name, program in programs.items())
        return target, plan

    def _named(self, x: Any, u: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """States and inputs of the plant by name, from the scaled ones."""
        state = {s.name: x[i] * float(self.scale[i]) for i, s in enumerate(self.plant.states)}
        given = {name: u[i] * float(self.sizes[i]) for i, name in enumerate(self.commanded)}
        return state, {**self.inputs, **given}

    def _rates(self, x: Any, u: Any, d: Any) -> Any:
        """Scaled rates with disturbances [SI]."""
        import casadi

        rates = self.plant.rates(*self._named(x, u))
        rows = [rates[s.name] for s in self.plant.states]
        for i, place in enumerate(self.disturbed):
            rows[place] = rows[place] + d[i]
        return casadi.vertcat(*[row / float(size) for row, size in zip(rows, self.scale, strict=True)])

    def _columns(self, x: Any, u: Any, names: tuple[str, ...]) -> list[Any]:
        state, inputs = self._named(x, u)
        known = {**self.plant.outputs(state, inputs), **state}
        return [known[name] for name in names]

    def _limited(self, x: Any, u: Any) -> list[Any]:
        """Limited columns as parts of their ranges, 0 at the minimum and 1 at the maximum."""
        values = self._columns(x, u, tuple(self.limits))
        return [(y - low) / (high - low) for y, (low, high) in zip(values, self.limits.values(), strict=True)]

    def _target(self, rates: Any, columns: Any) -> dict[str, Any]:
        """Variables (x_s, u_s), parameters (d, r); set points relative to the sizes of the controlled columns."""
        import casadi

        n, m, q = len(self.scale), len(self.sizes), len(self.controlled)
        x, u = casadi.SX.sym("x", n), casadi.SX.sym("u", m)
        d, r = casadi.SX.sym("d", len(self.disturbed)), casadi.SX.sym("r", q)
        names = [s.name for s in self.plant.states]
        sizes = [self.scale[names.index(name)] if name in names else 1.0 for name in self.controlled]
        error = (columns(x, u) - r) / np.array(sizes, dtype=float)
        at = np.array([self.inputs[name] for name in self.commanded]) / self.sizes
        cost = TARGET_WEIGHT * casadi.sumsqr(error) + casadi.sumsqr(u - at)
        return {"x": casadi.vertcat(x, u), "p": casadi.vertcat(d, r), "f": cost / TARGET_WEIGHT, "g": rates(x, u, d)}

    def _plan(self, limited: Any) -> dict[str, Any]:
        """Variables (x_1, u_0, x_2, u_1, ..., s), parameters (x_0, d, x_s, u_s); constraints: steps, then limits."""
        import casadi

        n, m, slacks = len(self.scale), len(self.sizes), self.slacks
        z = casadi.MX.sym("z", self.horizon * (n + m) + slacks)
        p = casadi.MX.sym("p", 2 * n + m + len(self.disturbed))
        x, d, x_s, u_s = casadi.vertsplit(p, np.cumsum([0, n, len(self.disturbed), n, m]).tolist())
        s = z[self.horizon * (n + m) :]
        cost = (self.slack_weight if slacks else 0.0) * casadi.sumsqr(s)
        defects, rows, step = [], [], self.step_function()
        for k in range(self.horizon):
            u, later = z[k * (n + m) + n : (k + 1) * (n + m)], z[k * (n + m) : k * (n + m) + n]
            cost += casadi.bilin(self.weights, x - x_s) + casadi.sumsqr(u - u_s)
            defects.append(later - step(x, u, d))
            y = limited(later, u)
            rows += [y - s, y + s] if slacks else [y, y]
            x = later
        cost += casadi.bilin(self.terminal, x - x_s)
        return {"x": z, "p": p, "f": cost, "g": casadi.vertcat(*defects, *rows)}

    def step_function(self) -> Any:
        """The scaled states after a sample, by classical Runge-Kutta steps with held inputs: a function (x, u, d)."""
        import casadi

        n, m, h = len(self.scale), len(self.sizes), self.sample_time / self.substeps
        x, u, d = casadi.SX.sym("x", n), casadi.SX.sym("u", m), casadi.SX.sym("d", len(self.disturbed))
        state = x
        for _ in range(self.substeps):
            first = self._rates(state, u, d)
            second = self._rates(state + 0.5 * h * first, u, d)
            third = self._rates(state + 0.5 * h * second, u, d)
            fourth = self._rates(state + h * third, u, d)
            state = state + h / 6.0 * (first + 2.0 * second + 2.0 * third + fourth)
        return casadi.Function("step", [x, u, d], [state])

    @property
    def slacks(self) -> int:
        """Number of slack variables: one for each limited column; none where limits are hard."""
        return len(self.limits) if np.isfinite(self.slack_weight) else 0

    def solve(
        self, state: Array, wanted: Array, low: Array, high: Array, variables: Array | None
    ) -> tuple[Array | None, Array | None]:
        """The planned inputs (N, m), or None, and the variables of target and plan, which begin the next search."""
        target, planner = self._solvers
        n, m, count = len(self.scale), len(self.sizes), self.horizon
        x, d = state[:n] / self.scale, state[n:]
        lower = np.concatenate([np.full(n, -np.inf), low / self.sizes])
        upper = np.concatenate([np.full(n, np.inf), high / self.sizes])
        operating = np.array([self.inputs[name] for name in self.commanded]) / self.sizes
        guess = np.concatenate([x, operating]) if variables is None else variables[: n + m]
        solution = target(x0=guess, p=np.concatenate([d, wanted]), lbg=0.0, ubg=0.0, lbx=lower, ubx=upper)
        aim = np.array(solution["x"]).ravel()
        if not (target.stats()["success"] and np.isfinite(aim).all()):
            return None, None
        slack, steps, width = np.zeros(self.slacks), np.zeros(count * n), len(self.limits)
        solution = planner(
            x0=self._start(x, aim, variables),
            p=np.concatenate([x, d, aim]),
            lbx=np.concatenate([np.tile(lower, count), slack]),
            ubx=np.concatenate([np.tile(upper, count), slack + np.inf]),
            lbg=np.concatenate([steps, np.tile(np.repeat([-np.inf, 0.0], width), count)]),
            ubg=np.concatenate([steps, np.tile(np.repeat([1.0, np.inf], width), count)]),
        )
        z = np.array(solution["x"]).ravel()
        if not (planner.stats()["success"] and np.isfinite(z).all()):
            return None, None
        return z[: count * (n + m)].reshape(count, n + m)[:, n:] * self.sizes, np.concatenate([aim, z])

    def _start(self, x: Array, aim: Array, variables: Array | None) -> Array:
        """The variables from which the search starts: the last ones, moved by one sample, or the target."""
        if variables is None:
            return np.concatenate([np.tile(np.append(x, aim[x.size :]), self.horizon), np.zeros(self.slacks)])
        _, *samples, slack = np.split(variables, aim.size * np.arange(1, self.horizon + 2))
        return np.concatenate([*samples[1:], samples[-1], slack])
