"""Nonlinear programs of predictive control: target and plan of a plant as CasADi expressions,
solved by Ipopt.
"""

import functools
import importlib
import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from ...core import AirmuscleError, Array, Node, Operation, ParameterError, install_command, nodes
from ...physics.analysis import held, linearise
from .lqg_and_adrc import regulator

MAX_HORIZON = 200
"""Maximum number of samples of a horizon, whose matrices have the square of it, and of steps of a
sample (chosen).
"""
MAX_ITERATIONS = 100
"""Iterations after which a search has no solution (chosen)."""
TARGET_WEIGHT = 1e8
"""Weight of the set points against that of the inputs in the target, both relative to permitted
deviations (chosen).
"""
TOLERANCE = 1e-9
"""Tolerance of the optimality conditions, which are scaled (chosen)."""


def check_limits(
    owner: str, limits: Mapping[str, tuple[float, float]], slack_weight: float
) -> None:
    """Raise ParameterError for limits of columns, or a weight of their violation, that make no
    program.
    """
    for name, (low, high) in limits.items():
        if not -np.inf < low < high < np.inf:
            raise ParameterError(
                f"{owner}: the limits of '{name}' are {low:g} and {high:g}; the minimum must be"
                " below the maximum, and both finite."
            )
    if not slack_weight > 0.0:
        raise ParameterError(f"{owner}: slack_weight is {slack_weight!r}; it must be positive.")


_SAME_NAMES = (
    *("sqrt", "sin", "cos", "tan", "sinh", "cosh", "tanh"),
    *("exp", "log", "expm1", "log1p", "sign", "floor"),
)
"""Functions of CasADi that have the names of our operations."""


def _casadi() -> Any:
    """The module casadi. Raises AirmuscleError where it is not installed."""
    try:
        return importlib.import_module("casadi")
    except ImportError:
        raise AirmuscleError(
            "NonlinearModelPredictive needs Ipopt in the package casadi;"
            f" {install_command('predictive')}. LinearModelPredictive needs no further package."
        ) from None


@functools.cache
def casadi_operations() -> dict[Operation, Callable[..., Any]]:
    """The functions of CasADi for recorded operations."""
    casadi = _casadi()
    return {
        Operation.NEGATE: operator.neg,
        Operation.INVERSE: lambda x: 1.0 / x,
        Operation.TWICE: lambda x: 2.0 * x,
        Operation.SQUARE: lambda x: x**2,
        Operation.DIVIDE: operator.truediv,
        Operation.MULTIPLY: operator.mul,
        Operation.ADD: operator.add,
        Operation.SUBTRACT: operator.sub,
        Operation.ABS: casadi.fabs,
        Operation.ASIN: casadi.asin,
        Operation.ACOS: casadi.acos,
        Operation.ATAN: casadi.atan,
        Operation.ASINH: casadi.asinh,
        Operation.POWER: operator.pow,
        Operation.FMIN: casadi.fmin,
        Operation.FMAX: casadi.fmax,
        Operation.LESS: operator.lt,
        Operation.LESS_EQUAL: operator.le,
        Operation.EQUAL: operator.eq,
        Operation.NOT_EQUAL: operator.ne,
        Operation.NOT: casadi.logic_not,
        Operation.AND: casadi.logic_and,
        Operation.OR: casadi.logic_or,
        Operation.MASK: lambda condition, x: casadi.if_else(condition, x, 0.0),
        Operation.SELECT: casadi.if_else,
        **{
            Operation[name.upper()]: getattr(casadi, name)
            for name in [
                "sqrt",
                "sin",
                "cos",
                "tan",
                "sinh",
                "cosh",
                "tanh",
                "exp",
                "log",
                "expm1",
                "log1p",
                "sign",
                "floor",
            ]
        },
    }


class PredictiveProgram:
    """Target and plan of a NonlinearModelPredictive, in states and inputs divided by `scale` (n,)
    and `sizes` (m,).

    inputs      values of all inputs of the plant; the commanded ones are replaced
    weights, terminal    (n, n) of the states of each sample and of the last one; those of the
                         inputs are 1
    """

    def __init__(self, controller: Any, inputs: Sequence[float]) -> None:
        self.controller = controller
        estimator = controller.estimator
        self.inputs = dict(zip(estimator.plant.inputs, inputs, strict=True))
        states = [s.name for s in estimator.plant.states]
        permitted = controller.permitted
        magnitudes = dict(zip(states, estimator.magnitudes.tolist(), strict=False))
        self.scale = scale = np.array(
            [permitted.get(name, size) for name, size in magnitudes.items()]
        )
        self.sizes = sizes = np.array([permitted[name] for name in controller.commanded])
        point = dict(zip(states, controller.first.mean.tolist(), strict=False))
        linear = linearise(estimator.plant, point, self.inputs).select(
            inputs=list(controller.commanded)
        )
        a, b = held(
            linear.A * scale / scale[:, None],
            linear.B * sizes / scale[:, None],
            estimator.sample_time,
        )
        self.weights = np.diag([1.0 if name in permitted else 0.0 for name in states])
        self.slacks = len(controller.limits) if np.isfinite(controller.slack_weight) else 0
        """Number of slack variables: one for each limited column; none where limits are hard."""
        _, self.terminal = regulator(
            "NonlinearModelPredictive", a, b, self.weights, np.eye(sizes.size)
        )

    @functools.cached_property
    def _solvers(self) -> tuple[Any, Any]:
        """The solvers of target and plan, which hold the numbers of a search: one thread at a time
        uses them.
        """
        casadi = _casadi()
        options: Any = {
            "expand": True,
            "print_time": False,
            "ipopt": {"print_level": 0, "sb": "yes", "max_iter": MAX_ITERATIONS, "tol": TOLERANCE},
        }
        programs = {"target": self._target(), "plan": self._plan()}
        target, plan = (
            casadi.nlpsol(name, "ipopt", program, options) for name, program in programs.items()
        )
        return target, plan

    def _symbols(self) -> Any:
        """Scaled states and inputs, and disturbances [SI] of the states that are disturbed."""
        casadi = _casadi()
        return [casadi.SX.sym(name, size) for name, size in self._sizes().items()]

    def _sizes(self) -> dict[str, int]:
        """How many states, inputs and disturbances there are."""
        return {
            "x": len(self.scale),
            "u": len(self.sizes),
            "d": len(self.controller.estimator.disturbances),
        }

    @functools.cached_property
    def _plant(self) -> tuple[Any, Any, Any]:
        """Functions of the plant: scaled rates (x, u, d), controlled columns (x, u), and limited
        columns (x, u) as parts of their ranges, 0 at the minimum and 1 at the maximum."""
        casadi = _casadi()
        law = self.controller
        plant = law.estimator.plant
        x, u, d = (nodes.symbols(name, size) for name, size in self._sizes().items())
        of_inputs = zip(law.commanded, self.sizes.tolist(), strict=True)
        state = {s.name: x[i] * float(self.scale[i]) for i, s in enumerate(plant.states)}
        inputs = {**self.inputs, **{name: u[i] * size for i, (name, size) in enumerate(of_inputs)}}
        rates = plant.rates(state, inputs)
        columns = {**plant.outputs(state, inputs), **state}
        rows = [rates[name] for name in state]
        for i, place in enumerate(law.estimator.places[1]):
            rows[place] = rows[place] + d[i]
        scaled = [row / float(size) for row, size in zip(rows, self.scale, strict=True)]
        limited = [(columns[name] - low) / (high - low) for name, (low, high) in law.limits.items()]
        controlled = [columns[name] for name in law.controlled]

        def function(name: str, arguments: Sequence[Sequence[Node]], results: Sequence[Any]) -> Any:
            vectors = [casadi.SX.sym("v", len(symbols)) for symbols in arguments]
            values = {
                id(symbol): vector[i]
                for symbols, vector in zip(arguments, vectors, strict=True)
                for i, symbol in enumerate(symbols)
            }
            replayed = nodes.replayed(nodes.as_nodes(results), values, casadi_operations())
            return casadi.Function(name, vectors, [casadi.vertcat(*replayed)])

        return (
            function("rates", [x, u, d], scaled),
            function("columns", [x, u], controlled),
            function("limited", [x, u], limited),
        )

    def _target(self) -> dict[str, Any]:
        """Variables (x_s, u_s), parameters (d, r); set points relative to the sizes of the
        controlled columns.
        """
        casadi = _casadi()
        law = self.controller
        rates, columns, _ = self._plant
        x, u, d = self._symbols()
        r = casadi.SX.sym("r", len(law.controlled))
        known = {
            s.name: size for s, size in zip(law.estimator.plant.states, self.scale, strict=True)
        }
        error = (columns(x, u) - r) / np.array(
            [known.get(name, 1.0) for name in law.controlled], dtype=float
        )
        at = np.array([self.inputs[name] for name in law.commanded]) / self.sizes
        cost = TARGET_WEIGHT * casadi.sumsqr(error) + casadi.sumsqr(u - at)
        return {
            "x": casadi.vertcat(x, u),
            "p": casadi.vertcat(d, r),
            "f": cost / TARGET_WEIGHT,
            "g": rates(x, u, d),
        }

    def _plan(self) -> dict[str, Any]:
        """Variables (x_1, u_0, x_2, u_1, ..., s), parameters (x_0, d, x_s, u_s); constraints:
        steps, then limits.
        """
        casadi = _casadi()
        law = self.controller
        n = len(self.scale)
        m = len(self.sizes)
        slacks = self.slacks
        parts = np.cumsum([0, n, len(law.estimator.disturbances), n, m]).tolist()
        z = casadi.MX.sym("z", law.horizon * (n + m) + slacks)
        p = casadi.MX.sym("p", parts[-1])
        x, d, x_s, u_s = casadi.vertsplit(p, parts)
        s = z[law.horizon * (n + m) :]
        cost = (float(law.slack_weight) if slacks else 0.0) * casadi.sumsqr(s)
        defects = []
        rows = []
        step = self.step_function()
        limited = self._plant[2]
        for k in range(law.horizon):
            u = z[k * (n + m) + n : (k + 1) * (n + m)]
            later = z[k * (n + m) : k * (n + m) + n]
            cost += casadi.bilin(self.weights, x - x_s) + casadi.sumsqr(u - u_s)
            defects.append(later - step(x, u, d))
            y = limited(later, u)
            rows += [y - s, y + s] if slacks else [y, y]
            x = later
        cost += casadi.bilin(self.terminal, x - x_s)
        return {"x": z, "p": p, "f": cost, "g": casadi.vertcat(*defects, *rows)}

    def step_function(self) -> Any:
        """The scaled states after a sample, by classical Runge-Kutta steps with held inputs: a
        function (x, u, d).
        """
        casadi = _casadi()
        x, u, d = self._symbols()
        rates = self._plant[0]
        state = x
        h = self.controller.estimator.sample_time / self.controller.substeps
        for _ in range(self.controller.substeps):
            first = rates(state, u, d)
            second = rates(state + 0.5 * h * first, u, d)
            third = rates(state + 0.5 * h * second, u, d)
            fourth = rates(state + h * third, u, d)
            state = state + h / 6.0 * (first + 2.0 * second + 2.0 * third + fourth)
        return casadi.Function("step", [x, u, d], [state])

    def solve(
        self, state: Array, wanted: Array, low: Array, high: Array, variables: Array | None
    ) -> tuple[Array | None, Array | None]:
        """The planned inputs (N, m), or None, and the variables of target and plan, which begin the
        next search.
        """
        target, planner = self._solvers
        law = self.controller
        n = len(self.scale)
        m = len(self.sizes)
        x = state[:n] / self.scale
        d = state[n:]
        lower = np.concatenate([np.full(n, -np.inf), low / self.sizes])
        upper = np.concatenate([np.full(n, np.inf), high / self.sizes])
        operating = np.array([self.inputs[name] for name in law.commanded]) / self.sizes
        guess = np.concatenate([x, operating]) if variables is None else variables[: n + m]
        solution = target(
            x0=guess, p=np.concatenate([d, wanted]), lbg=0.0, ubg=0.0, lbx=lower, ubx=upper
        )
        aim = np.array(solution["x"]).ravel()
        if not (target.stats()["success"] and np.isfinite(aim).all()):
            return None, None
        count = law.horizon
        width = len(law.limits)
        slack = np.zeros(self.slacks)
        steps = np.zeros(count * n)
        if variables is None:
            begin = np.concatenate([np.tile(np.append(x, aim[n:]), count), slack])
        else:  # the last plan, moved by one sample
            _, *samples, last = np.split(variables, aim.size * np.arange(1, count + 2))
            begin = np.concatenate([*samples[1:], samples[-1], last])
        solution = planner(
            x0=begin,
            p=np.concatenate([x, d, aim]),
            lbx=np.concatenate([np.tile(lower, count), slack]),
            ubx=np.concatenate([np.tile(upper, count), slack + np.inf]),
            lbg=np.concatenate([steps, np.tile(np.repeat([-np.inf, 0.0], width), count)]),
            ubg=np.concatenate([steps, np.tile(np.repeat([1.0, np.inf], width), count)]),
        )
        z = np.array(solution["x"]).ravel()
        if not (planner.stats()["success"] and np.isfinite(z).all()):
            return None, None
        return z[: count * (n + m)].reshape(count, n + m)[:, n:] * self.sizes, np.concatenate(
            [aim, z]
        )
