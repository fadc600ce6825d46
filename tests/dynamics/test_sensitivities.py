"""Forward sensitivities: the derivative of what a run gives by a parameter, d x/d theta, to a
stated accuracy.

Against closed forms where there is one, against the law that `WithSensitivities` states, and
against differences of runs. A run with fixed steps is differentiated step by step, so that there
the differences agree to their own rounding.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from filling import hanging, runs
from formulas import FORMULAS, Formula
from widths import widened

from airmuscle.core import StateVariable, System, model, ops, parameter, tree
from airmuscle.engine import (
    Rodas4,
    RungeKutta4,
    SampledSignal,
    Schedule,
    WithSensitivities,
    sensitivity,
)
from airmuscle.engine.compile import compile_system
from airmuscle.errors import ParameterError

PATHS = (
    "circuit.fill.conductance",
    "circuit.fill.critical_ratio",
    "circuit.discharge.conductance",
    "circuit.supply.pressure",
    "muscle.spring.stiffness",
    "muscle.damper.damping",
    "muscle.damper.damping_slope",
    "mechanism.mass",
)
COMMAND = Schedule({"fill": ((0.5, 1.0), (2.0, 0.0)), "discharge": ((3.0, 1.0),)})
TIMES = np.linspace(0.0, 5.0, 251)


@model
class Decay(System):
    """x' = -a x + b u, z' = a x: with u = 1, x = (x0 - b/a) exp(-a t) + b/a."""

    a: float = parameter("1/s", "a", "rate of decay", default=1.5)
    b: float = parameter("1/s", "b", "gain", default=0.7)
    inputs = ("u",)

    @property
    def states(self):
        return StateVariable("x", "1", 1.0), StateVariable("z", "1", 1.0)

    def rates(self, state, inputs):
        return {"x": -self.a * state["x"] + self.b * inputs["u"], "z": self.a * state["x"]}

    def outputs(self, state, inputs):
        return {"y": self.b * state["x"] ** 2}


@model
class Swing(System):
    """x' = v, v' = u x - a sin x - b v sqrt(1 + v^2): smooth everywhere."""

    a: float = parameter("1/s2", "a", "pull back", default=3.0)
    b: float = parameter("1/s", "b", "friction", default=0.2)
    inputs = ("u",)

    @property
    def states(self):
        return StateVariable("x", "1", 1.0), StateVariable("v", "1", 1.0)

    def rates(self, state, inputs):
        v = state["v"]
        pull = self.a * ops.sin(state["x"]) + self.b * v * ops.sqrt(1 + v * v)
        return {"x": v, "v": inputs["u"] * state["x"] - pull}

    def outputs(self, state, inputs):
        return {}


def leaf_values(system):
    return {leaf.path: leaf.value for leaf in tree.leaves(system)}


def with_leaf(system, path, value):
    return tree.with_parameters(
        system, [value if p == path else v for p, v in leaf_values(system).items()]
    )


def rows(system, start, times, command, method):
    segments = command.segments(system.inputs, 0.0, times[-1])
    course = method.run(compile_system(system), segments, 0.0, np.array(start), times)
    assert course.status == 0
    return course.rows


def sensitive(system, paths):
    values = leaf_values(system)
    return WithSensitivities(
        system, tuple((path,) for path in paths), tuple(abs(values[path]) for path in paths)
    )


@pytest.mark.parametrize("method", [Rodas4(1e-9), RungeKutta4(1e-3)], ids=["Rodas4", "RungeKutta4"])
def test_a_linear_system_has_its_closed_form(method):
    a = 1.5
    b = 0.7
    x0 = 2.0
    times = np.linspace(0.0, 2.0, 21)
    system = WithSensitivities(Decay(a, b), (("a",), ("b",), ()), (a, b, x0))
    start = [x0, 0.0, *[0.0, 0.0, 1.0], *[0.0] * 3]  # the last column is the start's own value
    found = rows(system, start, times, Schedule({"u": ((0.0, 1.0),)}), method)
    e = np.exp(-a * times)
    by_a = -times * e * (x0 - b / a) + b / a**2 * e - b / a**2
    np.testing.assert_allclose(found[:, 2:5], np.column_stack([by_a, (1 - e) / a, e]), atol=2e-9)


@pytest.mark.parametrize("method", [Rodas4(1e-9), RungeKutta4(1e-3)], ids=["Rodas4", "RungeKutta4"])
def test_an_input_that_moves_is_carried(method):
    """x' = -a x + b t from x = 0: x = b (t/a - (1 - exp(-a t))/a^2)."""
    a = 1.5
    b = 0.7
    t = np.linspace(0.0, 2.0, 21)
    system = WithSensitivities(Decay(a, b), (("a",), ("b",)), (a, b))
    found = rows(system, [0.0] * 6, t, SampledSignal({"u": ((0.0, 0.0), (2.0, 2.0))}), method)
    e = np.exp(-a * t)
    by_a = b * (-t / a**2 - t * e / a**2 + 2 * (1 - e) / a**3)
    np.testing.assert_allclose(
        found[:, 2:4], np.column_stack([by_a, t / a - (1 - e) / a**2]), atol=2e-9
    )


# What is printed is the law


def point(system, vector, scatter, rng):
    """A state near a vector, with S of any size, by name."""
    inner = system.inner.states
    further = system.states[len(system.inner.states) :]
    values = vector + scatter * np.array([s.nominal for s in inner]) * rng.standard_normal(
        len(inner)
    )
    return dict(zip((s.name for s in inner), values, strict=True)) | {
        s.name: s.nominal * rng.standard_normal() for s in further
    }


def printed(system, state, inputs):
    """Rates, and outputs by name."""
    ready, x = compile_system(system), np.array([state[s.name] for s in system.states])
    outputs = np.empty(ready.sizes.outputs)
    u = np.array([inputs[name] for name in system.inputs], dtype=float)
    ready.call("outputs", x, u, ready.precomputed, outputs)
    return ready.rates(x, u), dict(zip(ready.output_names, outputs, strict=True))


def assert_the_law(system, state, inputs, relative):
    rates, outputs = printed(system, state, inputs)
    law = system.rates(state, inputs)
    seen = system.outputs(state, inputs)
    sizes = np.array([s.nominal for s in system.states])
    expected = np.array([law[s.name] for s in system.states])
    np.testing.assert_allclose(
        rates / sizes,
        expected / sizes,
        rtol=relative,
        atol=relative * np.abs(expected / sizes).max(),
    )
    assert list(outputs) == list(seen)
    for name, value in seen.items():
        assert outputs[name] == pytest.approx(
            value, rel=relative, abs=1e-12 * abs(value) + 1e-280
        ), name


@pytest.mark.parametrize(
    ("states", "columns"),
    widened(
        [(3, 3), (6, 5), (3, 1), (6, 8), (10, 11)],
        lambda states, columns: (states, columns) == (6, 5),
    ),
)
def test_printed_columns_are_the_law(states, columns):
    """At random points with any valve open, any number of columns, whatever the registers hold."""
    run = runs()[states]
    rng = np.random.default_rng(states)
    paths = [leaf.path for leaf in tree.leaves(run.system) if leaf.value and "[" not in leaf.path][
        :columns
    ]
    assert len(paths) == columns
    system = sensitive(run.system, paths)
    for _ in range(6):
        inputs = {name: float(rng.integers(0, 2)) for name in system.inputs}
        assert_the_law(system, point(system, run.vector, 0.3, rng), inputs, 1e-9)


@pytest.mark.parametrize("name", FORMULAS)
def test_every_operation_has_its_derivative(name):
    """Also the second derivatives, which `jac` of a differentiated system gives."""
    system, rng = (
        WithSensitivities(Formula(name), (("shift",), ()), (1.0, 1.0)),
        np.random.default_rng(2),
    )
    for x, y in [*rng.uniform(-1.4, 1.4, (8, 2)), (0.75, 1.0), (-0.25, 0.0)]:
        state = {"x": x, "y": y, "d x/d 0": 0.3, "d x/d 1": -1.1, "d y/d 0": 0.7, "d y/d 1": 0.2}
        assert_the_law(system, state, {}, 1e-11)


@pytest.mark.parametrize("name", [n for n in FORMULAS if n not in ("choices", "extremes")])
def test_the_change_of_the_jacobian_is_its_derivative(name):
    """dJ from `jac` against central differences of J along each column."""
    system, at = (
        WithSensitivities(Formula(name), (("shift",), ()), (1.0, 1.0)),
        np.array([0.4, 0.9]),
    )
    s = np.array([[0.3, -1.1], [0.7, 0.2]])

    def matrix(z, shift, rows):
        ready = compile_system(dataclasses.replace(system, inner=Formula(name, shift)))
        f, found = np.empty(6), np.empty(ready.sizes.jacobian)
        ready.call(
            "jac", np.concatenate([z, rows.ravel()]), np.empty(0), ready.precomputed, f, found
        )
        return found

    whole = matrix(at, 0.25, s)
    distinct = compile_system(Formula(name)).sizes.jacobian
    moving = (whole.size - distinct) // 2
    changes = whole[distinct:].reshape(moving, 2)
    for k, by_shift in enumerate((1.0, 0.0)):
        e = 1e-5
        up, down = (
            matrix(at + side * e * s[:, k], 0.25 + side * e * by_shift, 0 * s)[:distinct]
            for side in (1, -1)
        )
        expected = (up - down) / (2 * e)
        expected = expected[np.abs(expected) > 1e-9]
        np.testing.assert_allclose(changes[np.abs(changes[:, k]) > 1e-9, k], expected, rtol=1e-6)


def test_outputs_carry_their_derivatives_and_their_slope_in_time():
    system = WithSensitivities(Decay(1.5, 0.7), (("a",), ("b",)), (1.5, 0.7))
    state = {"x": 2.0, "z": 0.3, "d x/d 0": 0.1, "d z/d 0": 0.2, "d x/d 1": -0.4, "d z/d 1": 0.0}
    found = system.outputs(state, {"u": 1.0})
    assert found["y"] == pytest.approx(0.7 * 4.0)
    assert found[sensitivity("y", 0)] == pytest.approx(0.7 * 2 * 2.0 * 0.1)
    assert found[sensitivity("y", 1)] == pytest.approx(2.0**2 + 0.7 * 2 * 2.0 * -0.4)
    assert found["y.rate"] == pytest.approx(0.7 * 2 * 2.0 * (-1.5 * 2.0 + 0.7))


def test_a_group_shares_one_value():
    run = runs()[3]
    both = ("circuit.fill.conductance", "circuit.discharge.conductance")
    system = WithSensitivities(run.system, (both, both[:1], both[1:]), (1e-9,) * 3)
    start = [*run.vector, *[0.0] * 9]
    found = rows(system, start, TIMES, COMMAND, Rodas4(1e-8))[:, 3:].reshape(TIMES.size, 3, 3)
    size = np.abs(found[:, :, 0]).max(axis=0)
    np.testing.assert_allclose(
        (found[:, :, 1] + found[:, :, 2]) / size, found[:, :, 0] / size, atol=1e-6
    )


def plant_case():
    run = runs()[3]
    return run.system, run.vector


def difference(system, path, start, relative):
    """The central difference of runs at rtol 1e-13."""
    value = leaf_values(system)[path]
    ends = (with_leaf(system, path, value * (1 + side * relative)) for side in (1, -1))
    up, down = (rows(end, start, TIMES, COMMAND, Rodas4(1e-13)) for end in ends)
    return (up - down) / (2 * relative * value)


@pytest.mark.parametrize(
    "paths", [PATHS[::3], pytest.param(PATHS, marks=pytest.mark.slow)], ids=["few", "all"]
)
def test_a_plant_against_differences(paths):
    """Rodas4 at rtol 1e-10 is within 5e-7 of each derivative's greatest.

    No one step of the differences serves all: 1e-4 has a truncation error of 1e-6 for a valve, 1e-5
    a rounding error of 1e-6 for a damper.
    """
    system, start = plant_case()
    exact = rows(
        sensitive(system, paths), [*start, *[0.0] * 3 * len(paths)], TIMES, COMMAND, Rodas4(1e-10)
    )
    for k, path in enumerate(paths):
        found = exact[:, 3 + k :: len(paths)]
        size = np.abs(found).max(axis=0)
        errors = []
        for relative in (1e-3, 1e-4, 1e-5):
            errors.append((np.abs(found - difference(system, path, start, relative)) / size).max())
        assert min(errors) < 5e-7, path


def test_the_default_tolerance_gives_three_digits():
    """At rtol 1e-6 every derivative is within 5e-4 of its greatest; the states keep their own
    tolerance.
    """
    system, start = plant_case()
    case = sensitive(system, PATHS)
    full = [*start, *[0.0] * 3 * len(PATHS)]
    reference, found = (rows(case, full, TIMES, COMMAND, Rodas4(rtol)) for rtol in (1e-11, 1e-6))
    errors = np.abs(found - reference).max(axis=0) / np.abs(reference).max(axis=0)
    assert errors[3:].max() < 5e-4
    assert errors[:3].max() < 1e-5


def swings(columns=(("a",), ("b",), ("a", "b"), ())):
    """A pendulum started by hand, its own columns zero, that of the start one."""
    s = np.zeros((2, len(columns)))
    s[0, -1] = 1.0
    return WithSensitivities(Swing(), columns, (1.0,) * len(columns)), np.array(
        [1.0, 0.0, *s.ravel()]
    )


def test_fixed_steps_are_differentiated_themselves():
    """Steps so long that the run errs by 1e-3 have the derivatives of that run, not of the
    solution.
    """
    system, start = swings()
    times = np.linspace(0.0, 6.0, 21)
    command = SampledSignal({"u": ((1.0, 0.0), (5.0, 1.0))})
    found, exact = (rows(system, start, times, command, RungeKutta4(h)) for h in (0.3, 1e-3))
    assert 1e-3 < np.abs(found - exact).max() < 0.1
    for k, paths in enumerate(system.columns):
        ends = []
        for e in (1e-3, -1e-3, 5e-4, -5e-4):
            inner = system.inner
            at = start[:2] + (e * np.array([1.0, 0.0]) if not paths else 0.0)
            for path in paths:
                inner = with_leaf(inner, path, leaf_values(inner)[path] + e)
            ends.append(rows(inner, at, times, command, RungeKutta4(0.3)))
        expected = (4 * (ends[2] - ends[3]) / 1e-3 - (ends[0] - ends[1]) / 2e-3) / 3
        np.testing.assert_allclose(found[:, 2 + k :: 4], expected, atol=1e-9)


def test_rodas4_keeps_its_order():
    """Derivatives converge as the states do; without the change of the Jacobian they fall to order
    one.
    """
    system, start = swings()
    times = np.linspace(0.0, 6.0, 21)
    command = SampledSignal({"u": ((1.0, 0.0), (5.0, 1.0))})
    exact = rows(system, start, times, command, RungeKutta4(1e-3))
    for rtol in (1e-5, 1e-7, 1e-9):
        errors = np.abs(rows(system, start, times, command, Rodas4(rtol)) - exact).max(axis=0)
        assert errors[2:].max() < 300 * rtol
        assert errors[:2].max() < 30 * rtol


def test_columns_share_one_factorisation():
    """The factors are those of the inner system; each column adds the changes of the Jacobian
    alone.
    """
    system, _ = plant_case()
    alone = compile_system(system).sizes
    together = compile_system(sensitive(system, PATHS)).sizes
    assert together.states == 9 * alone.states
    assert together.jacobian <= 9 * alone.jacobian
    assert together.factors - alone.factors == together.jacobian - alone.jacobian


def test_only_what_is_observed_is_given():
    system, start = plant_case()
    whole = sensitive(system, PATHS[:2])
    some = dataclasses.replace(whole, observed=("position", "pressure"))
    assert compile_system(some).output_names == (
        "position",
        "pressure",
        "d position/d 0",
        "d position/d 1",
        "d pressure/d 0",
        "d pressure/d 1",
        "position.rate",
        "pressure.rate",
    )
    state = point(some, start, 0.3, np.random.default_rng(4))
    inputs = {"fill": 1.0, "discharge": 0.0}
    everything = whole.outputs(state, inputs)
    for name, value in printed(some, state, inputs)[1].items():
        assert value == pytest.approx(everything[name], rel=1e-10)
    with pytest.raises(
        ParameterError, match=r"no state or output 'presure'.*Did you mean 'pressure'"
    ):
        dataclasses.replace(whole, observed=("presure",))


def test_unknown_paths_and_missing_scales_are_refused():
    with pytest.raises(
        ParameterError, match=r"no parameter 'mechanism.mas'.*Did you mean 'mechanism.mass'"
    ):
        WithSensitivities(hanging(), (("mechanism.mas",),), (1.0,))
    with pytest.raises(ParameterError, match="2 columns need as many scales"):
        WithSensitivities(hanging(), (("mechanism.mass",), ()), (1.0,))
    with pytest.raises(ParameterError, match="0 columns need as many scales"):
        WithSensitivities(hanging(), (), ())


def test_another_parameter_set_costs_no_program():
    system, _ = plant_case()
    heavier = dataclasses.replace(system, mechanism=dataclasses.replace(system.mechanism, mass=6.0))
    assert (
        compile_system(sensitive(system, PATHS)).program
        is compile_system(sensitive(heavier, PATHS)).program
    )
