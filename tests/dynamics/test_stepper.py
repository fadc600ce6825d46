"""Claims about steps by hand: they are those of `simulate` to the last bit, a snapshot repeats
them, a step that is impossible changes nothing, and no step allocates arrays."""

from __future__ import annotations

import dataclasses
import pickle
import re
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from control_plants import JOINT, LIFT

from airmuscle.engine import Rodas4, RungeKutta4, Schedule, Stepper, simulate
from airmuscle.errors import ParameterError, SimulationError
from airmuscle.files import library
from airmuscle.physics import WithEnergyMeters

START = JOINT.state_at(pressure=2e5)
FILL = [0.5, 0.0, 0.0, 0.5]
SHUT = [0.0] * 4


def stepped(stepper, count=20):
    """The state after steps with open, then with closed valves."""
    for k in range(count):
        stepper.step(FILL if k < count // 2 else SHUT, 0.01)
    return stepper.state.copy()


def repeat(stepper, inputs, dt):
    """Equal steps until one fails: the message, and the snapshots before and after the step that
    failed.
    """
    before = stepper.snapshot()
    try:
        for _ in range(100):
            before = stepper.snapshot()
            stepper.step(inputs, dt)
    except SimulationError as error:
        return str(error), before, stepper.snapshot()
    pytest.fail("no step failed")


@pytest.mark.parametrize("integrator", [RungeKutta4(1e-3), Rodas4(1e-7)])
def test_steps_by_hand_are_those_of_simulate(integrator):
    """Rodas4 begins every step anew and so agrees to its tolerance; a fixed step agrees to the
    rounding of the instants.
    """
    stepper = Stepper(JOINT, START, integrator=integrator)
    stepped(stepper)
    opened = Schedule(
        {"left.fill": ((0.0, 0.5), (0.1, 0.0)), "right.discharge": ((0.0, 0.5), (0.1, 0.0))}
    )
    run = simulate(JOINT, opened, duration=0.2, initial_state=START, integrator=integrator)
    tolerance = 1e-11 if isinstance(integrator, RungeKutta4) else 1e-6
    for name in ("angle", "left.pressure", "right.force"):
        assert stepper[name] == pytest.approx(run[name][-1], rel=tolerance)
    assert stepper.time == pytest.approx(0.2)


def test_equal_steps_give_equal_bits_and_a_snapshot_repeats_them():
    first = Stepper(JOINT, START)
    second = Stepper(JOINT, START)
    expected = stepped(first)
    assert np.array_equal(expected, stepped(second))
    kept = pickle.loads(pickle.dumps(first.snapshot()))
    later = stepped(first)
    outputs = second.restore(kept)
    assert second.time == kept.time
    assert np.array_equal(later, stepped(second))
    assert outputs is second.outputs


def test_a_stepper_is_represented_by_its_time_and_present_state():
    stepper = Stepper(LIFT, {"air_mass": 1e-4, "position": 0.01, "speed": 0.0}, start_time=2.0)
    shown = "Stepper(Plant at 2 s: air_mass 0.0001, position 0.01, speed 0; Rodas4(rtol=1e-06))"
    assert repr(stepper) == shown


def test_values_are_read_by_name_and_those_of_the_inputs_are_the_last_ones():
    stepper = Stepper(JOINT, START)
    stepper.step({"left.fill": 0.5}, 0.01)
    stepper.step({"right.discharge": 0.25}, 0.01)
    assert stepper.inputs.tolist() == [0.5, 0.0, 0.0, 0.25]
    values = stepper.values()
    assert values["left.fill"] == 0.5
    assert values["left.pressure"] == stepper["left.pressure"] > 2e5
    assert set(values) == {
        "time",
        *stepper.state_names,
        *stepper.output_names,
        *stepper.input_names,
    }
    state = dict(zip(stepper.state_names, stepper.state.tolist(), strict=True))
    exact = JOINT.outputs(
        state, dict(zip(stepper.input_names, stepper.inputs.tolist(), strict=True))
    )
    assert values["right.force"] == pytest.approx(exact["right.force"], rel=1e-12)


def test_reset_takes_another_state_or_a_plant_of_the_same_structure():
    stepper = Stepper(JOINT, START)
    first = stepped(stepper)
    stepper.reset()
    assert stepper.time == 0.0
    assert np.array_equal(first, stepped(stepper))
    heavy = dataclasses.replace(JOINT, mechanism=dataclasses.replace(JOINT.mechanism, inertia=0.04))
    stepper.reset(START, plant=heavy)
    assert stepper.plant is heavy
    assert np.array_equal(stepped(stepper), stepped(Stepper(heavy, START)))
    assert abs(stepper["angle"] - first[stepper.state_names.index("angle")]) > 0.01
    with pytest.raises(ParameterError, match="another structure"):
        stepper.reset(plant=LIFT)


@pytest.mark.parametrize(
    ("inputs", "dt", "message"),
    [
        ([0.1, 0.2], 0.01, r"give 4 numbers in the order of left\.fill"),
        ("abcd", 0.01, "give 4 numbers"),
        (None, 0.01, "give 4 numbers"),
        ([np.nan] * 4, 0.01, r"'left\.fill' is nan at 0 s; allowed range: 0 to 1"),
        ([0, 0, 2, 0], 0.01, r"'right\.fill' is 2 at 0 s; allowed range: 0 to 1"),
        ({"left.fil": 1}, 0.01, r"no input 'left\.fil'.*Did you mean 'left\.fill'"),
        ({"left.fill": "open"}, 0.01, "give 4 numbers"),
        (SHUT, 0.0, "dt is 0.0 s; it must be positive"),
        (SHUT, float("nan"), "dt is nan s"),
    ],
)
def test_impossible_inputs_are_refused_and_change_nothing(inputs, dt, message):
    stepper = Stepper(JOINT, START)
    with pytest.raises(ParameterError, match=message):
        stepper.step(inputs, dt)
    assert (stepper.time, stepper.state.tolist(), stepper.inputs.tolist()) == (
        0.0,
        [*START.values()],
        SHUT,
    )


def test_other_impossible_requests_are_refused():
    with pytest.raises(ParameterError, match="is no plant"):
        Stepper(JOINT.muscles[0])
    with pytest.raises(ParameterError, match="lacks"):
        Stepper(JOINT, {"angle": 0.0})
    stepper = Stepper(JOINT, START)
    with pytest.raises(ParameterError, match=r"no state, output or input 'left\.presure'"):
        stepper["left.presure"]
    with pytest.raises(ParameterError, match="no snapshot of this plant, which has 4 states"):
        stepper.restore(Stepper(LIFT).snapshot())


def test_a_step_that_fails_changes_nothing():
    stepper = Stepper(JOINT, START, integrator=RungeKutta4(1.0))
    message, before, failed = repeat(stepper, FILL, 1.0)
    assert message.endswith("The stepper is in the state before the step.")
    assert failed == before


def test_leaving_the_validity_range_is_an_error_where_it_is_wanted():
    plant = library.load("joint-dmsp-20-matrix").plant
    start = plant.state_at(pressure=2e5)
    strict = Stepper(plant, start, check_validity=True)
    message, before, failed = repeat(strict, {"left.fill": 1.0, "right.discharge": 1.0}, 0.05)
    assert (
        "allowed range: 0.01333 to 0.25 (the validity range of right; check_validity=False"
        " continues" in message
    )
    assert failed == before
    strict.step({"left.fill": 0.0, "right.discharge": 0.0}, 0.01)
    tolerant = Stepper(plant)
    tolerant.restore(failed)
    tolerant.step({"left.fill": 1.0, "right.discharge": 1.0}, 0.05)
    assert tolerant["right.contraction"] < 0.01333


def test_energy_meters_leave_the_check_of_the_validity_range_as_it_is():
    plant = library.load("joint-dmsp-20-matrix").plant
    metered = WithEnergyMeters(plant)
    assert list(metered.column_limits) == list(plant.column_limits)
    strict = Stepper(
        metered, metered.extend_state(plant.state_at(pressure=2e5)), check_validity=True
    )
    message, _, _ = repeat(strict, {"left.fill": 1.0, "right.discharge": 1.0}, 0.05)
    assert "the validity range of right" in message


def test_a_step_allocates_no_arrays():
    stepper = Stepper(JOINT, START)
    stepper.step(SHUT, 1e-3)
    tracemalloc.start()
    before, _ = tracemalloc.get_traced_memory()
    tracemalloc.reset_peak()
    for _ in range(500):
        stepper.step(SHUT, 1e-3)
    after, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert after - before < 1000
    assert (
        peak - before < 2000
    )  # an array alone takes 112 bytes, a view of it too; the frames of Python some hundred


def test_the_example_of_the_page_reaches_its_angle():
    page = Path(__file__).parents[2] / "docs" / "guides/stepping.md"
    (code,) = re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    names: dict[str, object] = {}
    exec(code, names)
    assert names["stepper"].time == pytest.approx(0.5)
    assert names["stepper"]["angle"] == pytest.approx(0.2, abs=0.1)
