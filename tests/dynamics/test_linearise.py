"""Near a state a plant is x' = A x + B u, y = C x + D u, with the exact derivatives of what is
simulated.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joints import chosen_muscle, joint, joint_start

import airmuscle as am
from airmuscle.engine import Problem, Rodas4, Schedule, simulate, solve
from airmuscle.engine.compile import compile_system
from airmuscle.errors import AirmuscleError, ParameterError
from airmuscle.physics import (
    AntagonisticJoint,
    ClosedChamber,
    EnergyBalance,
    FillDischarge,
    HangingMass,
    Isothermal,
    LuGre,
    Plant,
    Polytropic,
    ProportionalRegulator,
    ProportionalValve,
    SecondOrderLag,
    SeriesSpring,
    SpringLoad,
    Supply,
    Tube,
    Valve,
    WithTubes,
    find_equilibrium,
    linearise,
)

VALVE = Valve(2.6e-9, 0.433)
LEFT, RIGHT = (replace(chosen_muscle(), name=name) for name in ("left", "right"))
JOINT = AntagonisticJoint(0.03, 0.05, 0.2, 2.0, 0.12)
PROPORTIONAL = ProportionalValve(Supply(6e5), VALVE, VALVE, SecondOrderLag(50.0), muscle_count=2)
HANGING = Plant(
    chosen_muscle(), FillDischarge(Supply(6e5), VALVE, VALVE), HangingMass(20.0), Polytropic(1.2)
)
REGULATED = Plant(
    replace(chosen_muscle(), series=SeriesSpring(5e4)),
    WithTubes(
        ProportionalRegulator(Supply(6e5), VALVE, VALVE, SecondOrderLag(20.0)),
        Tube(Valve(1e-8, 0.2), 2e-5),
    ),
    SpringLoad(5.0, 2e3, 10.0, 40.0),
    EnergyBalance(0.5),
)
CASES = {
    "hanging": (HANGING, {"fill": 0.3, "discharge": 0.1}),
    "joint": (Plant((LEFT, RIGHT), PROPORTIONAL, JOINT, Isothermal()), {"command": 0.2}),
    "regulated": (REGULATED, {"setpoint": 3.2e5}),
    "friction": (
        replace(
            HANGING,
            muscle=replace(chosen_muscle(), friction=LuGre(1e5, 300.0, 5.0, 10.0, 6.0, 0.01)),
        ),
        {},
    ),
}


def moving(plant, pressure=3e5):
    """A state away from rest and from kinks."""
    state = find_equilibrium(plant, pressure=pressure)
    push = {
        "speed": 0.02,
        "angular_speed": 0.2,
        "spool": 0.1,
        "lagged_setpoint": 8e3,
        "tube.air_mass": 1e-6,
        "bristle": 1e-6,
    }
    return {n: v + push.get(n, 0.0) for n, v in state.items()}


@pytest.mark.parametrize(("plant", "inputs"), CASES.values(), ids=CASES)
def test_the_matrices_are_the_slopes_of_rates_and_outputs(plant, inputs):
    state = moving(plant)
    found = linearise(plant, state, inputs)
    ready = compile_system(plant)
    x, u = (
        np.array([state[n] for n in found.states]),
        np.array([found.input_values[n] for n in found.inputs]),
    )
    np.testing.assert_allclose(found.rates, ready.rates(x, u), rtol=1e-9, atol=1e-9)

    def values(x, u):
        named = (
            dict(zip(found.states, map(float, x), strict=True)),
            dict(zip(found.inputs, map(float, u), strict=True)),
        )
        further = {**named[0], **plant.outputs(*named)}
        return np.concatenate([ready.rates(x, u), [float(further[n]) for n in found.outputs]])

    whole = np.vstack([np.hstack([found.A, found.B]), np.hstack([found.C, found.D])])
    sizes = [s.nominal for s in plant.states] + [
        1e5 if n == "setpoint" else 0.1 for n in found.inputs
    ]
    for i, size in enumerate(sizes):
        h = 1e-5 * size * np.eye(len(sizes))[i]
        n = len(x)
        slope = (values(x + h[:n], u + h[n:]) - values(x - h[:n], u - h[n:])) / (2e-5 * size)
        rows = (
            np.abs(whole * sizes).max(axis=1) / size
        )  # the greatest change of each row, by a change of this size
        assert (np.abs(whole[:, i] - slope) <= 2e-5 * np.abs(slope) + 1e-8 * rows).all()


def test_it_follows_a_small_step_of_the_simulated_plant():
    """The error is of second order: half the step leaves a quarter of it."""
    from scipy.signal import lsim

    start = find_equilibrium(HANGING, pressure=3e5)
    times = np.linspace(0.0, 0.3, 61)
    found = linearise(HANGING, start).select(("fill",), ("position", "pressure", "force"))
    errors = []
    for step in (4e-4, 2e-4):
        command = Schedule({"fill": ((0.0, step),)})
        run = simulate(
            HANGING,
            command,
            duration=0.3,
            initial_state=start,
            output_times=times,
            integrator=Rodas4(1e-12),
        )
        _, linear, _ = lsim(found.to_scipy(), np.full((61, 1), step), times)
        moved = np.column_stack([run[n] - run[n][0] for n in found.outputs])
        assert moved[-1, 1] > 10.0
        errors.append(np.abs(moved - linear).max(axis=0))
        assert (errors[-1] < 2e-2 * np.abs(moved).max(axis=0)).all()
    assert errors[1] / errors[0] == pytest.approx(0.25, rel=0.1)


def test_a_hanging_mass_with_shut_valves_swings_with_its_shut_stiffness():
    """Pole of m s^2 + d s + k/L0 = 0 with the damper of the muscle, and one at zero for the air
    that is shut in.
    """
    plant = Plant(chosen_muscle(), ClosedChamber(), HangingMass(20.0), Isothermal())
    state = find_equilibrium(plant, pressure=3e5)
    found = linearise(plant, state)
    stiff = found.stiffness.per_metre["muscle"].shut_valves
    resting, first, second = found.poles
    assert resting.value == 0
    assert np.isnan(resting.damping_ratio)
    assert first.frequency == pytest.approx(np.sqrt(stiff / 20.0) / (2 * np.pi), rel=1e-9)
    assert first.damping_ratio == pytest.approx(150.0 / (2 * np.sqrt(stiff * 20.0)), rel=1e-9)
    assert second.value == pytest.approx(first.value.conjugate())
    assert stiff == found.stiffness.coordinates["position"].shut_valves


def test_names_and_units_come_along():
    plant, inputs = CASES["joint"]
    found = linearise(plant, moving(plant), inputs)
    assert found.states == tuple(s.name for s in plant.states)
    assert found.outputs[: len(found.states)] == found.states
    assert (found.inputs, found.input_values) == (("command",), {"command": 0.2})
    assert {found.units[n] for n in ("left.pressure", "right.pressure")} == {"Pa"}
    assert (
        found.units["angle"],
        found.units["angular_speed"],
        found.units["angular_acceleration"],
    ) == (
        "rad",
        "rad/s",
        "rad/s^2",
    )
    assert set(found.units) >= {*found.states, *found.inputs, *found.outputs}
    assert repr(found).startswith("LinearModel(6 states, inputs command, 17 outputs; poles ")


def test_rounding_errors_of_poles_are_not_shown():
    """A load on enclosed air without losses: an integrator and an undamped pair."""
    model = linearise(CASES["joint"][0], moving(CASES["joint"][0]), CASES["joint"][1])
    at = replace(
        model,
        A=np.array([[1e-14, 0.0, 0.0], [0.0, -1e-13, -43.78], [0.0, 43.78, 0.0]]),
        states=("m", "x", "v"),
    )
    assert "poles 0, 0-43.78j, 0+43.78j 1/s" in repr(at)


def test_scipy_and_python_control_see_the_same_system():
    plant, inputs = CASES["joint"]
    found = linearise(plant, moving(plant), inputs).select(outputs=("angle", "left.pressure"))
    frequencies = np.array([0.1, 1.0, 10.0])
    response = found.frequency_response(frequencies)
    assert response.shape == (3, 2, 1)
    in_scipy = found.to_scipy()
    for name in "ABCD":
        np.testing.assert_array_equal(getattr(in_scipy, name), getattr(found, name))
    control = pytest.importorskip("control")
    system = found.to_control()
    assert isinstance(system, control.StateSpace)
    assert (system.input_labels, system.output_labels) == (["command"], ["angle", "left_pressure"])
    np.testing.assert_allclose(system(2j * np.pi * 1.0)[:, 0], response[1, :, 0], rtol=1e-9)
    assert sorted(system.poles(), key=abs)[-1] == pytest.approx(found.poles[-1].value, rel=1e-6)


def test_without_python_control_the_error_says_what_to_do(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "control", None)
    with pytest.raises(
        AirmuscleError, match=r"pip install .airmuscle.control.., or use to_scipy\(\)"
    ):
        linearise(HANGING, moving(HANGING)).to_control()


def test_an_own_system_is_linearised_like_a_plant():
    system = joint()
    found = linearise(system, joint_start(system), {"left.fill": 0.5})
    assert found.stiffness is None
    assert found.A.shape == (6, 6)
    assert found.units["left.force"] == "N"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda s: linearise(HANGING, {**s, "positon": 0.0}),
            "no state 'positon'.*Did you mean 'position'",
        ),
        (
            lambda s: linearise(HANGING, {"position": 0.0}),
            "the initial state lacks air_mass, speed",
        ),
        (lambda s: linearise(HANGING, {**s, "speed": float("nan")}), "must be finite"),
        (lambda s: linearise(HANGING, s, {"fil": 1.0}), "no input 'fil'"),
        (
            lambda s: linearise(HANGING, s, {"fill": 1.5}),
            "the input 'fill' is 1.5; allowed range: 0 to 1",
        ),
        (
            lambda s: linearise(HANGING, s).select(outputs=("presure",)),
            "no output 'presure'.*Did you mean 'pressure'",
        ),
        (
            lambda s: linearise(HANGING, s).frequency_response([-1.0]),
            "must be finite and not negative",
        ),
        (
            lambda s: linearise(joint(), joint_start(joint()), {"fill": 1.0}),
            "no input 'fill'; there are left.fill",
        ),
    ],
)
def test_bad_input_is_refused(change, message):
    with pytest.raises(ParameterError, match=message):
        change(moving(HANGING))


def test_python_control_receives_the_nonlinear_system():
    """The response of python-control differs from `simulate` by the tolerances of its
    integrator.
    """
    control = pytest.importorskip("control")
    plant = HANGING
    state = moving(plant) | {"speed": 0.0}
    system = linearise(plant, state).to_control(nonlinear=True)
    assert isinstance(system, control.NonlinearIOSystem)
    assert system.state_labels == [s.name.replace(".", "_") for s in plant.states]
    times = np.linspace(0.0, 0.5, 26)
    inputs = np.array(
        [np.full(times.size, 0.3 if name == plant.inputs[0] else 0.0) for name in plant.inputs]
    )
    found = control.input_output_response(
        system,
        times,
        inputs,
        list(state.values()),
        solve_ivp_method="LSODA",
        solve_ivp_kwargs={"rtol": 1e-12, "atol": 1e-14},
    )
    held = Schedule({plant.inputs[0]: ((0.0, 0.3),)})
    expected = solve(
        Problem(plant, held, 0.5, state, integrator=Rodas4(1e-11), output_times=times)
    ).recording
    for label, values in zip(system.output_labels, found.outputs, strict=True):
        scale = np.abs(expected[label]).max()
        assert np.abs(values - expected[label]).max() <= 1e-9 * (scale or 1.0), label


def test_a_regulator_that_rests_is_named_as_a_kink_and_one_that_fills_is_not():
    """At rest its valves neither fill nor vent: a lower set point discharges, a higher one fills,
    with another flow.
    """
    plant = am.load("joint-dmsp-20-regulators").plant
    rest = find_equilibrium(plant, pressure=2e5)
    setpoints = dict.fromkeys(("left.setpoint", "right.setpoint"), 2e5)
    at_rest = linearise(plant, rest, setpoints)
    assert {"left.lagged_setpoint", "right.lagged_setpoint", "angle"} <= set(at_rest.kinks)
    assert "one-sided by" in repr(at_rest)
    assert at_rest.select(outputs=["angle"]).kinks == at_rest.kinks
    filling = {**rest, "left.lagged_setpoint": 2.3e5, "right.lagged_setpoint": 2.3e5}
    assert linearise(plant, filling, setpoints).kinks == ()


@pytest.mark.parametrize("case", CASES)
def test_a_smooth_state_and_inputs_within_their_range_have_no_kink(case):
    plant, inputs = CASES[case]
    assert linearise(plant, moving(plant), inputs).kinks == ()
