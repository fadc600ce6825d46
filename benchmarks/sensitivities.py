"""Residual and Jacobian with respect to eight parameters: cost relative to a simulation, and JAX
jacfwd.
"""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from filling import Array, hanging
from measure import Section, Target, format_time, print_section, time_variants

import airmuscle as am
from airmuscle.bench import Experiment, InitialConditions
from airmuscle.bench.dynamics.experiment import make_unknowns
from airmuscle.bench.dynamics.problem import DynamicFitProblem
from airmuscle.bench.dynamics.record_model import RecordModel
from airmuscle.core import tree
from airmuscle.engine.compile.functions import trace_system
from airmuscle.engine.compile.ir.instructions import Code, Operand, Operation, instructions
from airmuscle.engine.compile.program import compile_system

FREE = (
    "circuit.fill.conductance",
    "circuit.fill.critical_ratio",
    "circuit.discharge.conductance",
    "circuit.supply.pressure",
    "muscle.spring.stiffness",
    "muscle.damper.damping",
    "muscle.damper.damping_slope",
    "mechanism.mass",
)
SENSORS = {"pressure": 1e3, "position": 1e-4}
"""Standard deviations of the noise [Pa, m]; chosen."""
DURATION = 5.0
SPACING = 0.01
STEP = 1e-3
COMMAND = am.Schedule({"fill": ((0.5, 1.0), (2.5, 0.0)), "discharge": ((3.0, 1.0), (4.5, 0.0))})
METHODS: dict[str, am.engine.Integrator] = {
    "RungeKutta4(1e-3)": am.RungeKutta4(STEP),
    "Rodas4(1e-6)": am.Rodas4(),
}
LIBRARY = "RungeKutta4(1e-3), residual and Jacobian"
FORMS = ("a tuple", "an array")
HEADER = (
    "method",
    "variant",
    "median",
    "minimum",
    "ratio to a simulation",
    "maximum difference of the Jacobian",
)
REASON = (
    "a simulation skips closed valves and the extrapolation, which makes it 20 % faster; residual"
    " and Jacobian gain 12 %, because the derivatives with respect to the limits of the validity"
    " range need the slopes of the extrapolation"
)
TEXT = (
    "The plant with three states, filled and discharged within 5 s; 501 rows of pressure and"
    " position; eight parameters. A simulation is `simulate` from a given initial state, with its"
    " Recording. Residual and Jacobian are those of the fit: they include the initial equilibrium"
    " for the parameters with its derivatives, and the weighting by the sensors. JAX uses the"
    " equations of the library, the initial state and its derivatives, as one compiled function of"
    " `lax.scan` with RK4 and `jacfwd`, in 64 bits, with one thread; the state is a tuple of"
    " numbers or an array. Differences are relative to the maximum of each column of the Jacobian"
    " of Rodas4 at rtol 1e-11."
)


class Case(NamedTuple):
    """A plant, its noisy record, and the residuals of an integrator over the scaled parameters."""

    plant: am.Plant
    experiment: Experiment

    def problem(self, method: am.engine.Integrator) -> DynamicFitProblem:
        parameters = make_unknowns(self.plant, [self.experiment], FREE, (), {})
        record = RecordModel(self.plant, self.experiment, 0, parameters, SENSORS, method)
        return DynamicFitProblem((record,), parameters, np.array(list(SENSORS.values())))

    @property
    def segments(self) -> am.engine.PiecewiseLinear:
        return COMMAND.segments(self.plant.inputs, 0.0, DURATION)


@functools.cache
def case() -> Case:
    """The record of the identification benchmarks."""
    plant, rng = hanging(), np.random.default_rng(1)
    run = am.simulate(plant, COMMAND, duration=DURATION, output_times=SPACING)
    noisy = {
        name: run[name] + size * rng.standard_normal(len(run)) for name, size in SENSORS.items()
    }
    return Case(
        plant,
        Experiment(run.with_columns(**noisy), COMMAND, InitialConditions.at_rest(plant, 0.0)),
    )


def simulation(method: am.engine.Integrator) -> Callable[[], am.Recording]:
    """A function that calls `simulate` from a given initial state."""
    plant, start = case().plant, dict(case().experiment.initial_conditions.guess)

    def run() -> am.Recording:
        return am.simulate(
            plant,
            COMMAND,
            duration=DURATION,
            initial_state=start,
            output_times=SPACING,
            integrator=method,
        )

    return run


def kernel(method: am.engine.Integrator) -> Callable[[], Array]:
    """A function that runs the kernel alone for the same rows."""
    bound, segments = method.bind(compile_system(case().plant)), case().segments
    times = case().experiment.recording["time"].copy()
    start = np.array(
        [case().experiment.initial_conditions.guess[s.name] for s in case().plant.states]
    )
    return lambda: bound.run(segments, 0.0, start, times).rows


def jacobian(method: am.engine.Integrator) -> Callable[[], object]:
    """A function that computes the outputs (R,) and the Jacobian (R, 8) with respect to the
    parameters.
    """
    problem = case().problem(method)
    return lambda: problem.evaluate(problem.initial_values)


def evaluate_in_jax(code: Code, inputs: Sequence[Any]) -> list[Any]:
    """The equations of the library evaluated on JAX values, instruction by instruction."""
    import jax.numpy as jnp

    table: dict[int, Callable[..., Any]] = {
        Operation.ADD: lambda a, b: a + b,
        Operation.SUBTRACT: lambda a, b: a - b,
        Operation.MULTIPLY: lambda a, b: a * b,
        Operation.DIVIDE: lambda a, b: a / b,
        Operation.NEGATE: lambda a: -a,
        Operation.SQUARE: lambda a: a * a,
        Operation.TWICE: lambda a: a + a,
        Operation.INVERSE: lambda a: 1.0 / a,
        Operation.SQRT: jnp.sqrt,
        Operation.SIN: jnp.sin,
        Operation.COS: jnp.cos,
        Operation.LESS_EQUAL: lambda a, b: jnp.where(a <= b, 1.0, 0.0),
        Operation.LESS: lambda a, b: jnp.where(a < b, 1.0, 0.0),
        Operation.NOT: lambda a: 1.0 - a,
        Operation.MASK: lambda c, a: jnp.where(c != 0, a, 0.0),
        Operation.SELECT: lambda c, a, b: jnp.where(c != 0, a, b),
        Operation.MAXIMUM: jnp.maximum,
        Operation.MINIMUM: jnp.minimum,
    }
    known: dict[Operand, Any] = {}

    def value(operand: Operand) -> Any:
        if operand[0] == "t":
            return known[operand]
        return operand[1] if operand[0] == "c" else inputs[operand[1]][operand[2]]

    for line in code.body:
        known[line.result] = table[line.operation](*(value(a) for a in line.arguments))
    return [value(operand) for _, _, operand in code.outputs]


def make_jax_variant(form: str) -> Callable[[], tuple[Array, Array]]:
    """The same residual and Jacobian as one JAX function. Raises ImportError if JAX is not
    installed.
    """
    os.environ.setdefault(
        "XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false"
    )  # one thread is fastest
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    stacked = form == FORMS[1]
    plant, leaves = case().plant, list(tree.leaves(case().plant))
    indices = [[leaf.path for leaf in leaves].index(path) for path in FREE]
    values = np.array([leaves[index].value for index in indices])
    start, by_start = case().problem(am.RungeKutta4(STEP)).record_models[0].initial_state(values)
    t = trace_system(plant)
    names = [s.name for s in plant.states]
    outputs = list(t.output_names)
    seen = [
        t.o[outputs.index(name)] if name in outputs else t.x[names.index(name)] for name in SENSORS
    ]
    rates = instructions([t.x, t.u, t.p], [t.f])
    observed = instructions([t.x, t.u, t.p], [seen])
    recording, count = case().experiment.recording, round(DURATION / STEP)
    openings = case().segments.inputs_at((np.arange(count) + 0.5) * STEP, 0.0)
    inputs_of_rows = jnp.asarray(openings.reshape(-1, round(SPACING / STEP), openings.shape[1]))

    def residual(scaled: Any) -> Any:
        p: list[Any] = [leaf.value for leaf in leaves]
        for k, index in enumerate(indices):
            p[index] = scaled[k] * values[k]

        def moved(x: Any, h: float, k: Any) -> Any:
            return tuple(a + h * b for a, b in zip(x, k, strict=True))

        def step(x: Any, u: Any) -> Any:
            k1 = evaluate_in_jax(rates, (x, u, p))
            k2 = evaluate_in_jax(rates, (moved(x, STEP / 2, k1), u, p))
            k3 = evaluate_in_jax(rates, (moved(x, STEP / 2, k2), u, p))
            k4 = evaluate_in_jax(rates, (moved(x, STEP, k3), u, p))
            return moved(
                x,
                STEP / 6,
                [a + 2 * (b + c) + d for a, b, c, d in zip(k1, k2, k3, k4, strict=True)],
            )

        def one(x: Any, u: Any) -> Any:
            return (jnp.stack(step(tuple(x), u)) if stacked else step(x, u)), None

        def row(x: Any, u: Any) -> Any:
            end = jax.lax.scan(one, x, u)[0]
            return end, end

        begin = tuple(start[i] + (by_start[i] * values) @ (scaled - 1.0) for i in range(start.size))
        rows = jax.lax.scan(row, jnp.stack(begin) if stacked else begin, inputs_of_rows)[1]
        columns = [
            jnp.concatenate([begin[i][None], rows[:, i] if stacked else rows[i]])
            for i in range(start.size)
        ]
        modelled = evaluate_in_jax(observed, (columns, [0.0] * inputs_of_rows.shape[2], p))
        errors = [
            (y - recording[name]) / size
            for y, (name, size) in zip(modelled, SENSORS.items(), strict=True)
        ]
        return jnp.stack(errors, axis=1).ravel()

    both = jax.jit(lambda z: (residual(z), jax.jacfwd(residual)(z)))
    at = jnp.ones(len(FREE))
    return lambda: tuple(np.asarray(part) for part in both(at))  # type: ignore[return-value]


def section(rounds: int) -> Section:
    """The complete benchmark."""
    variants: dict[str, Callable[[], Any]] = {}
    for name, method in METHODS.items():
        variants[f"{name}, simulation"] = simulation(method)
        variants[f"{name}, kernel of the simulation"] = kernel(method)
        variants[f"{name}, residual and Jacobian"] = jacobian(method)
    times = time_variants(variants, rounds)
    ratios = {
        name: t.ratio_to(times[f"{name.partition(',')[0]}, simulation"])
        for name, t in times.items()
    }
    limits = {LIBRARY: 2.0, "Rodas4(1e-6), residual and Jacobian": 5.0}
    targets = [
        Target(f"{name}, 8 parameters", ratios[name], limit, "simulations", reason=REASON)
        for name, limit in limits.items()
    ]
    text = TEXT
    try:
        jax_variants = {
            f"RungeKutta4(1e-3), JAX jacfwd, state as {form}": make_jax_variant(form)
            for form in FORMS
        }
    except ImportError:
        text += "\n\nJAX is not installed, so that its rows are omitted."
    else:
        # Timed separately, because the idle threads of JAX slow down what is timed after it.
        jax_times = time_variants({LIBRARY: variants[LIBRARY], **jax_variants}, max(rounds // 2, 1))
        library = jax_times.pop(LIBRARY)
        variants = variants | jax_variants
        ratios |= {name: t.ratio_to(library) * ratios[LIBRARY] for name, t in jax_times.items()}
        times |= jax_times
        ratio = min(t.ratio_to(library) for t in jax_times.values())
        targets.append(
            Target(
                "residual and Jacobian: JAX jacfwd, faster form / library",
                ratio,
                10.0,
                "x",
                at_least=True,
            )
        )
    rows, reference = [], jacobian(am.Rodas4(1e-11))()[1]
    for name, t in times.items():
        method, _, variant = name.partition(", ")
        difference = ""
        if "simulation" not in variant:
            difference = f"{(np.abs(variants[name]()[1] - reference) / np.abs(reference).max(axis=0)).max():.0e}"  # noqa: E501
        rows.append(
            (
                method,
                variant,
                format_time(t.median),
                format_time(t.minimum),
                f"{ratios[name]:.3g}",
                difference,
            )
        )
    return Section(
        "Residual and Jacobian with respect to eight parameters",
        text,
        HEADER,
        tuple(rows),
        tuple(targets),
    )


if __name__ == "__main__":
    print_section(section(15))
