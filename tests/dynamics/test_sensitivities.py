"""Forward sensitivities: the derivative of what a run gives by a parameter, d x/d theta, to a stated accuracy.

Against closed forms where there is one, against central differences of runs at rtol 1e-13 elsewhere. Differentiating
the start is part of it: a state that rests for every theta keeps its derivative.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from filling import hanging, runs

from airmuscle import declare
from airmuscle.command import Schedule
from airmuscle.declare import model, parameter
from airmuscle.errors import ParameterError
from airmuscle.method import Rodas4, RungeKutta4
from airmuscle.program import StateVariable
from airmuscle.program.prepared import prepared
from airmuscle.sensitive import Sensitive, sensitivity

PATHS = (
    "circuit.fill.conductance",
    "circuit.fill.critical_ratio",
    "circuit.discharge.conductance",
    "circuit.supply.pressure",
    "muscle.spring.stiffness",
    "muscle.damper.damping",
    "muscle.damper.growth",
    "mechanism.mass",
)
COMMAND = Schedule({"fill": ((0.5, 1.0), (2.0, 0.0)), "discharge": ((3.0, 1.0),)})
TIMES = np.linspace(0.0, 5.0, 251)


@model
class Decay:
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


def leaf_values(system):
    return {leaf.path: leaf.value for leaf in declare.leaves(system)}


def with_leaf(system, path, value):
    return declare.with_parameters(system, [value if p == path else v for p, v in leaf_values(system).items()])


def rows(system, start, times, command, method):
    segments = command.segments(system.inputs, 0.0, times[-1])
    course = method.run(prepared(system), segments, 0.0, np.array(start), times)
    assert course.status == 0
    return course.rows


def sensitive(system, paths):
    values = leaf_values(system)
    return Sensitive(system, tuple((path,) for path in paths), tuple(abs(values[path]) for path in paths))


@pytest.mark.parametrize("method", [Rodas4(1e-9), RungeKutta4(1e-3)], ids=["Rodas4", "RungeKutta4"])
def test_a_linear_system_has_its_closed_form(method):
    a, b, x0 = 1.5, 0.7, 2.0
    times = np.linspace(0.0, 2.0, 21)
    system = Sensitive(Decay(a, b), (("a",), ("b",), ()), (a, b, x0))
    start = [x0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]  # the last column is the start's own value
    found = rows(system, start, times, Schedule({"u": ((0.0, 1.0),)}), method)
    e = np.exp(-a * times)
    by_a = -times * e * (x0 - b / a) + b / a**2 * e - b / a**2
    np.testing.assert_allclose(found[:, 2], by_a, atol=2e-9)
    np.testing.assert_allclose(found[:, 4], (1 - e) / a, atol=2e-9)
    np.testing.assert_allclose(found[:, 6], e, atol=2e-9)


def test_outputs_carry_their_derivatives_and_their_slope_in_time():
    system = Sensitive(Decay(1.5, 0.7), (("a",), ("b",)), (1.5, 0.7))
    state = {"x": 2.0, "z": 0.3, "d x/d 0": 0.1, "d z/d 0": 0.2, "d x/d 1": -0.4, "d z/d 1": 0.0}
    found = system.outputs(state, {"u": 1.0})
    assert found["y"] == pytest.approx(0.7 * 4.0)
    assert found[sensitivity("y", 0)] == pytest.approx(0.7 * 2 * 2.0 * 0.1)
    assert found[sensitivity("y", 1)] == pytest.approx(2.0**2 + 0.7 * 2 * 2.0 * -0.4)
    assert found["y.rate"] == pytest.approx(0.7 * 2 * 2.0 * (-1.5 * 2.0 + 0.7))


def test_a_group_shares_one_value():
    run = runs()[3]
    both = ("circuit.fill.conductance", "circuit.discharge.conductance")
    system = Sensitive(run.system, (both, both[:1], both[1:]), (1e-9,) * 3)
    start = [*run.vector, *[0.0] * 9]
    found = rows(system, start, TIMES, COMMAND, Rodas4(1e-8)).reshape(TIMES.size, 4, 3)
    size = np.abs(found[:, 1]).max(axis=0)
    np.testing.assert_allclose((found[:, 2] + found[:, 3]) / size, found[:, 1] / size, atol=1e-6)


def plant_case():
    run = runs()[3]
    return run.system, run.vector


def difference(system, path, start, relative):
    """The central difference of runs at rtol 1e-13."""
    value = leaf_values(system)[path]
    ends = (with_leaf(system, path, value * (1 + side * relative)) for side in (1, -1))
    up, down = (rows(end, start, TIMES, COMMAND, Rodas4(1e-13)) for end in ends)
    return (up - down) / (2 * relative * value)


def test_a_plant_against_differences():
    """Rodas4 at rtol 1e-10 is within 5e-7 of each derivative's greatest.

    No one step of the differences serves all: 1e-4 has a truncation error of 1e-6 for a valve, 1e-5 a rounding error
    of 1e-6 for a damper.
    """
    system, start = plant_case()
    exact = rows(sensitive(system, PATHS), [*start, *[0.0] * 3 * len(PATHS)], TIMES, COMMAND, Rodas4(1e-10))
    for k, path in enumerate(PATHS):
        found = exact[:, 3 + 3 * k : 6 + 3 * k]
        size, errors = np.abs(found).max(axis=0), []
        for relative in (1e-3, 1e-4, 1e-5):
            errors.append((np.abs(found - difference(system, path, start, relative)) / size).max())
        assert min(errors) < 5e-7, path


def test_the_default_tolerance_gives_three_digits():
    """At rtol 1e-6 every derivative is within 5e-4 of its greatest; the states keep their own tolerance."""
    system, start = plant_case()
    case, full = sensitive(system, PATHS), [*start, *[0.0] * 3 * len(PATHS)]
    reference, found = (rows(case, full, TIMES, COMMAND, Rodas4(rtol)) for rtol in (1e-11, 1e-6))
    errors = np.abs(found - reference).max(axis=0) / np.abs(reference).max(axis=0)
    assert errors[3:].max() < 5e-4
    assert errors[:3].max() < 1e-5


def test_the_repeated_block_is_factorised_once():
    """Eight columns add to the factors their couplings alone: far fewer than nine blocks and their couplings."""
    system, _ = plant_case()
    alone, together = prepared(system).sizes, prepared(sensitive(system, PATHS)).sizes
    assert together.states == 9 * alone.states
    assert together.jacobian - alone.jacobian <= 8 * alone.jacobian
    assert together.factors - alone.factors <= 8 * alone.states**2


def test_unknown_paths_and_missing_scales_are_refused():
    with pytest.raises(ParameterError, match=r"no parameter 'mechanism.mas'.*Did you mean 'mechanism.mass'"):
        Sensitive(hanging(), (("mechanism.mas",),), (1.0,))
    with pytest.raises(ParameterError, match="2 columns need as many scales"):
        Sensitive(hanging(), (("mechanism.mass",), ()), (1.0,))


def test_another_parameter_set_costs_no_program():
    system, _ = plant_case()
    heavier = dataclasses.replace(system, mechanism=dataclasses.replace(system.mechanism, mass=6.0))
    assert prepared(sensitive(system, PATHS)).program is prepared(sensitive(heavier, PATHS)).program
