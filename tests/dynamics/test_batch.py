"""Many plants at once: each is computed as it would be alone, whatever its neighbours, its place in
the batch, the number of threads and where the columns are kept; what is wrong with one is said of
that one, and does not stop the others.
"""

from __future__ import annotations

import _thread
import dataclasses
import errno
import json
import re
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from joints import chosen_muscle, joint, joint_start

from airmuscle import Status
from airmuscle.core import StateVariable, System, model, ops, parameter, tree
from airmuscle.engine import (
    ZERO_INPUT,
    BatchSolution,
    DormandPrince8,
    ExplicitRungeKutta,
    Rodas4,
    RungeKutta4,
    SampledSignal,
    Schedule,
    Single,
    WithSensitivities,
    sensitivity,
    simulate,
    simulate_batch,
)
from airmuscle.engine.run.batch import job, variations
from airmuscle.errors import ColumnError, FileError, GeometryLimitError, ParameterError
from airmuscle.papers.hosovsky_plant import UnpublishedParameters, hanging_load
from airmuscle.papers.hosovsky_plant import plant as third_paper
from airmuscle.physics import (
    FillDischarge,
    HangingMass,
    Isothermal,
    Plant,
    Polytropic,
    Supply,
    Valve,
)

PULSE = Schedule({"fill": ((0.0303, 1), (0.2, 0)), "discharge": ((0.31, 1), (0.42, 0))})
JOINT_PULSE = Schedule(
    {"left.fill": ((0.02, 1), (0.07, 0)), "right.discharge": ((0.0217, 1), (0.07, 0))}
)
FAST = RungeKutta4(1e-3)


def paper():
    return third_paper(UnpublishedParameters(), hanging_load(UnpublishedParameters()))


def plain():
    valve = Valve(5e-9, 0.433)
    return Plant(
        chosen_muscle(),
        FillDischarge(Supply(6e5), valve, valve),
        HangingMass(10.0),
        Polytropic(1.2),
    )


def around(values, count, seed=1, share=0.05):
    """Columns of values within 5 per cent of those given."""
    rng = np.random.default_rng(seed)
    return {path: value * (1 + share * rng.uniform(-1, 1, count)) for path, value in values.items()}


def pulses(count):
    """Commands whose instants differ from plant to plant, one of them without any, one moving."""
    commands = [
        Schedule(
            {"fill": ((0.02 + 0.00371 * i, 1), (0.2 + 0.001 * i, 0)), "discharge": ((0.3, 1),)}
        )
        for i in range(count)
    ]
    return [ZERO_INPUT, SampledSignal({"fill": ((0.05, 0), (0.1, 1), (0.2003, 0))}), *commands][
        :count
    ]


CASES = {
    "third paper": (
        paper(),
        {
            "mechanism.mass": 10.0,
            "circuit.fill.conductance": 2.6e-9,
            "muscle.spring.stiffness": 1e3,
        },
        paper().state_at(pressure=1e5, position=0.01),
        PULSE,
    ),
    "six states": (
        joint(),
        {"inertia": 0.05, "load": 2.0, "tube_volume": 2e-5},
        joint_start(joint()),
        JOINT_PULSE,
    ),
    "ten states": (
        joint(heat=True),
        {"inertia": 0.05, "heat_transfer": 1.0},
        joint_start(joint(heat=True)),
        JOINT_PULSE,
    ),
}


def greatest_difference(found: BatchSolution, index, run):
    """Between a batch's plant and a run of it alone, in sizes of the states and of the other
    columns.
    """
    rows = [int(np.argmin(np.abs(run["time"] - t))) for t in found.time]
    assert np.abs(run["time"][rows] - found.time).max() < 1e-12
    sizes = {s.name: s.nominal for s in found.plant(index).states}
    worst = 0.0
    for name, column in found.columns.items():
        size = max(sizes.get(name, 0.0), np.abs(run[name]).max(), 1e-300)
        worst = np.maximum(
            worst, np.abs(column[index] - run[name][rows]).max() / size
        )  # not a number stays one
    return worst


FEW = (("third paper", "ode8"), ("six states", "RK4"))
METHODS = {"RK4": RungeKutta4(1e-4), "ode8": DormandPrince8(5e-5)}


@pytest.mark.parametrize(
    ("name", "method"),
    [
        pytest.param(name, method, marks=[] if (name, method) in FEW else pytest.mark.slow)
        for name in CASES
        for method in METHODS
    ],
)
def test_a_lane_agrees_with_the_plant_alone(name, method):
    """To 1e-12 of the size of each column after thousands of steps, in 19 lanes, which is not a
    multiple of a block.
    """
    plant, varied, start, command = CASES[name]
    method = METHODS[method]
    found = simulate_batch(
        plant,
        around(varied, 19),
        command,
        duration=0.5,
        initial_states=start,
        integrator=method,
        output_times=0.0037,
    )
    assert not found.failed.size
    assert len(found) == 19
    for index in (0, 7, 15, 16, 18):
        run = simulate(
            found.plant(index),
            command,
            duration=0.5,
            initial_state=start,
            integrator=method,
            output_times=0.0037,
        )
        assert list(found.columns) == [n for n in run if n != "time"]
        assert greatest_difference(found, index, run) < 1e-12
    np.testing.assert_array_equal(found.time, run["time"])


@pytest.mark.parametrize("method", [FAST, Rodas4()], ids=["RK4", "Rodas4"])
def test_plants_with_commands_of_their_own_meet_their_own_instants(method):
    plant, start, count = plain(), plain().state_at(pressure=1e5, position=0.002), 20
    found = simulate_batch(
        plant,
        {},
        pulses(count),
        duration=0.4,
        initial_states=start,
        integrator=method,
        output_times=0.0033,
    )
    for index, command in enumerate(pulses(count)):
        run = simulate(
            plant,
            command,
            duration=0.4,
            initial_state=start,
            integrator=method,
            output_times=0.0033,
        )
        assert greatest_difference(found, index, run) < (1e-12 if method is FAST else 1e-300)


def test_an_adaptive_batch_is_simulate_itself():
    """Bit for bit, with the plant's own nominal sizes, and its own equilibrium as the start."""
    varied = around(
        {"mechanism.mass": 5.0, "muscle.geometry.radius": 0.01, "ambient.pressure": 1e5}, 5
    )
    found = simulate_batch(plain(), varied, PULSE, duration=0.5, output_times=0.01)
    for index in range(5):
        run = simulate(found.plant(index), PULSE, duration=0.5, output_times=0.01)
        for name in run:
            np.testing.assert_array_equal(found.recording(index)[name], run[name])
        for s in plain().states:
            assert found.final[s.name][index] == run[s.name][-1]


def test_a_result_depends_neither_on_threads_nor_on_neighbours():
    start = plain().state_at(pressure=1e5)
    varied = around({"mechanism.mass": 10.0, "mechanism.gravity": 9.8}, 70)
    for method in (FAST, Rodas4(1e-5)):
        runs = [
            simulate_batch(
                plain(),
                varied,
                PULSE,
                duration=0.3,
                initial_states=start,
                integrator=method,
                cores=cores,
            )
            for cores in (1, 2, 5)
        ]
        for name, column in runs[0].columns.items():
            assert all(np.array_equal(column, other[name]) for other in runs[1:])
        backwards = {path: column[::-1] for path, column in varied.items()}
        other = simulate_batch(
            plain(), backwards, PULSE, duration=0.3, initial_states=start, integrator=method
        )
        np.testing.assert_array_equal(other["pressure"][::-1], runs[0]["pressure"])


def test_rows_do_not_change_the_solution():
    start = plain().state_at(pressure=1e5)
    varied = around({"mechanism.mass": 10.0}, 3)
    ends = [
        simulate_batch(
            plain(),
            varied,
            PULSE,
            duration=0.4,
            initial_states=start,
            integrator=FAST,
            output_times=output,
            keep=keep,
        )
        for output, keep in ((0.4, None), (0.00077, ("pressure",)), (0.01, ()))
    ]
    for other in ends[1:]:
        np.testing.assert_array_equal(other.final["position"], ends[0].final["position"])
    assert list(ends[1].columns) == ["pressure"]
    assert ends[2].columns == {}
    assert list(ends[2].time) == [0.4]


def test_one_plant_is_a_batch_too():
    start = plain().state_at(pressure=1e5)
    found = simulate_batch(
        plain(),
        {"mechanism.mass": [8.0]},
        PULSE,
        duration=0.3,
        initial_states=start,
        integrator=FAST,
    )
    run = simulate(found.plant(0), PULSE, duration=0.3, initial_state=start, integrator=FAST)
    assert greatest_difference(found, 0, run) < 1e-12


def test_single_precision_keeps_four_digits_and_says_so():
    """The weight's speed is small and its rounding adds up: all columns are held to their greatest
    value.
    """
    start = plain().state_at(pressure=1e5, position=0.002)
    varied = around({"mechanism.mass": 10.0}, 33)
    double, single = (
        simulate_batch(
            plain(), varied, PULSE, duration=0.4, initial_states=start, integrator=FAST, **more
        )
        for more in ({}, {"precision": Single()})
    )
    assert "expect about four correct digits" in single.notes[-1]
    assert len(double.notes) == 1
    for name, column in double.columns.items():
        assert single[name].dtype == np.float32
        error = np.abs(single[name] - column).max() / np.abs(column).max()
        assert error < 1e-4, name
    assert np.abs(single["pressure"] - double["pressure"]).max() > 0
    with pytest.raises(ParameterError, match="Rodas4 chooses its steps in double precision"):
        simulate_batch(
            plain(), varied, PULSE, duration=0.4, initial_states=start, precision=Single()
        )


@model
class Functions(System):
    """Every function of ops that has a form of its own in lanes, or is taken lane by lane, in a
    system.
    """

    power: float = parameter("1", "m", "exponent", default=0.7)
    inputs = ("push",)

    @property
    def states(self):
        return StateVariable("x", "1", 1.0), StateVariable("y", "1", 1.0)

    def rates(self, state, inputs):
        x = state["x"]
        y = state["y"]
        first = (
            ops.exp(-(x**2))
            - ops.log(1.5 + y * y)
            + (1 + x * x) ** self.power
            + ops.sinh(x / 4)
            - 2 * x
        )
        second = (
            ops.sin(3 * x)
            + ops.cos(y)
            + ops.tan(y / 4)
            + ops.arctan(x)
            + ops.arcsinh(y)
            + inputs["push"]
            - 3 * y
        )
        return {"x": first, "y": second}

    def outputs(self, state, inputs):
        return {"power": (1 + state["x"] ** 2) ** self.power + inputs["push"]}


def test_a_system_of_ones_own_with_every_function():
    push = SampledSignal({"push": ((0.0, 0.0), (0.5, 1.0), (1.0, -0.5))})
    start = {"x": np.linspace(-1, 1, 21), "y": 0.3}
    found = simulate_batch(
        Functions(),
        {"power": np.linspace(0.2, 1, 21)},
        push,
        duration=1.0,
        initial_states=start,
        integrator=FAST,
        output_times=0.0137,
    )
    for index in range(0, 21, 4):
        one = {"x": start["x"][index], "y": 0.3}
        run = simulate(
            found.plant(index),
            push,
            duration=1.0,
            initial_state=one,
            integrator=FAST,
            output_times=0.0137,
        )
        assert greatest_difference(found, index, run) < 1e-12


@pytest.mark.parametrize("method", [FAST, Rodas4(1e-8)], ids=["RK4", "Rodas4"])
def test_sensitivities_come_in_the_same_pass(method):
    """The derivative of each plant is the difference of two plants of a batch."""
    path = "mechanism.mass"
    count = 18
    step = 1e-3
    system = WithSensitivities(plain(), ((path,),), (10.0,))
    masses = np.linspace(8.0, 12.0, count)
    start = plain().state_at(pressure=1e5, position=0.002)
    still = {**start, **{sensitivity(s.name, 0): 0.0 for s in plain().states}}
    found = simulate_batch(
        system,
        {f"inner.{path}": masses},
        PULSE,
        duration=0.3,
        initial_states=still,
        integrator=method,
        keep=(),
    )
    beside = [
        simulate_batch(
            plain(),
            {path: masses + d},
            PULSE,
            duration=0.3,
            initial_states=start,
            integrator=method,
            keep=(),
        )
        for d in (-step, step)
    ]
    by_difference = (beside[1].final["position"] - beside[0].final["position"]) / (2 * step)
    size = np.abs(by_difference).max()
    np.testing.assert_allclose(
        found.final[sensitivity("position", 0)], by_difference, rtol=0, atol=2e-4 * size
    )


def thick_and_thin(count, thin):
    """Muscles of which some are so thin that a step fills them several times over: those runs are
    not finite soon.
    """
    radius = np.full(count, 0.01)
    radius[list(thin)] = 1e-3
    return {"muscle.geometry.radius": radius}


class WithoutHint(Functions):
    def failure_hint(self, state):
        raise ZeroDivisionError


def test_a_batch_asks_for_no_remedy():
    start = {"x": [1.0, np.finfo(float).max], "y": 0.0}
    found = simulate_batch(
        WithoutHint(), {"power": [0.5, 0.5]}, ZERO_INPUT, duration=0.1, initial_states=start
    )
    assert found.failed.tolist() == [1]
    assert found.reason(1).startswith("the run ended at 0 of 0.1 s because")


def test_a_plant_that_fails_does_not_stop_the_others():
    start = plain().state_at(pressure=1e5, position=0.002, speed=0.1)
    found = simulate_batch(
        plain(),
        thick_and_thin(20, {3, 17}),
        PULSE,
        duration=0.3,
        initial_states=start,
        integrator=FAST,
    )
    assert list(found.failed) == [3, 17]
    assert found.status[3] == 3
    assert "because a rate or an output is not finite" in found.reason(17)
    assert found.reason(4) == "it is complete"
    assert np.isfinite(found["pressure"][4]).all()
    alone = simulate(
        found.plant(3), PULSE, duration=0.3, initial_state=start, integrator=FAST, complete=False
    )
    part = found.recording(3)
    assert 0 < len(part) < found.time.size
    np.testing.assert_array_equal(part["position"], alone["position"])
    assert found.reason(3) in part.notes
    assert "2 failed" in repr(found)


@pytest.mark.parametrize("keep", [None, ("position",)], ids=["all", "not the air"])
def test_air_below_none_on_the_way_is_seen_in_a_lane_as_alone(keep):
    """A pulse of a valve far too large for the step takes more air than there is; by the end it has
    come back.
    """
    isothermal = dataclasses.replace(plain(), gas=Isothermal())
    start = isothermal.state_at(pressure=5e5, position=0.002)
    pulse = Schedule({"discharge": ((0.02, 1), (0.022, 0)), "fill": ((0.03, 1),)})
    given = {"duration": 0.3, "integrator": FAST, "output_times": 1e-3}
    found = simulate_batch(
        isothermal,
        {"circuit.discharge.conductance": [1e-6, 2.8e-6, 5e-6]},
        pulse,
        keep=keep,
        initial_states=start,
        **given,
    )
    assert found.status.tolist() == [0, 7, 7]
    for index in (1, 2):
        alone = simulate(found.plant(index), pulse, complete=False, initial_state=start, **given)
        assert "ended at 0.021 of 0.3 s because an air mass became negative" in found.reason(index)
        assert re.search(
            r"ended at 0\.020\d+ of 0\.3 s because an air mass became negative", alone.notes[-1]
        )
        assert found.reached[index] == len(alone)
        assert np.isnan(found["position"][index, len(alone) :]).all()
    assert keep is None or tuple(found.columns) == keep


def test_a_plant_without_an_equilibrium_is_reported():
    found = simulate_batch(
        plain(), {"mechanism.mass": [4.0, 1e5, 5.0]}, ZERO_INPUT, duration=0.1, integrator=FAST
    )
    assert list(found.failed) == [1]
    assert (
        "it has no equilibrium to start from: HangingMass has no stable equilibrium"
        in found.reason(1)
    )
    assert np.isnan(found["pressure"][1]).all()
    np.testing.assert_allclose(
        found["position"][[0, 2]], found["position"][[0, 2], :1] * np.ones(found.time.size)
    )


def test_plants_that_differ_in_their_circuit_alone_share_the_search_for_rest(monkeypatch):
    asked = []
    search = Plant.default_states
    monkeypatch.setattr(
        Plant, "default_states", lambda plant, rows: asked.append(len(rows)) or search(plant, rows)
    )
    varied = around({"circuit.fill.conductance": 5e-9}, 6)
    simulate_batch(plain(), varied, ZERO_INPUT, duration=0.1, integrator=FAST)
    assert asked == [1]
    simulate_batch(
        plain(),
        {**varied, "mechanism.mass": [4, 5, 4, 4, 6, 5]},
        ZERO_INPUT,
        duration=0.1,
        integrator=FAST,
    )
    assert asked == [1, 3]


@pytest.mark.parametrize(
    ("varied", "message"),
    [
        ({"mass": [1.0]}, r"Plant has no parameter 'mass'; .* Did you mean 'mechanism.mass'\?"),
        (
            {"mechanism.mas": [1.0]},
            r"Plant has no parameter 'mechanism.mas'; .* Did you mean 'mechanism.mass'\?",
        ),
        (
            {"mechanism.mass": [5.0, np.nan]},
            r"row 1: 'mechanism.mass' \(m, .*\) is nan kg; allowed range:",
        ),
        (
            {"mechanism.mass": [5.0, 5.0, -2.0, -3.0]},
            r"row 2: .* is -2 kg; allowed range: 0.* \(1 further rows too\)",
        ),
        ({"mechanism.mass": []}, "there are no plants; give at least one row"),
        (
            {"mechanism.mass": [[1.0]]},
            r"must be a column \(N,\), one value per plant; its shape is \(1, 1\)",
        ),
        ({"mechanism.mass": 5.0}, r"must be a column \(N,\)"),
        ({"mechanism.mass": ["heavy"]}, "must be numbers, one for each plant"),
        (
            {"mechanism.mass": [1.0, 2.0], "mechanism.gravity": [9.8]},
            "every column needs one value per plant",
        ),
        ({}, "nothing varies; give variations, initial states or inputs, or use simulate"),
    ],
)
def test_variations_that_cannot_be_are_refused(varied, message):
    with pytest.raises(ParameterError, match=message):
        simulate_batch(plain(), varied, PULSE, duration=0.1, integrator=FAST)


def test_parameters_that_do_not_go_together_name_the_row():
    law = paper()
    varied = {"muscle.contractile.min_pressure": [-1e4, -1e4, 7e5]}
    assert any(leaf.path == next(iter(varied)) for leaf in tree.leaves(law))
    with pytest.raises(ParameterError, match=r"variations, row 2: "):
        simulate_batch(law, varied, PULSE, duration=0.1, integrator=FAST)


def test_so_do_those_of_a_model_whose_numbers_stand_in_a_list():
    @model
    class Rising(Functions):
        weights: tuple[float, ...] = parameter("1", "w_i", "weights that rise", default=(1.0, 2.0))

        def check(self):
            if not self.weights[0] < self.weights[1]:
                raise ParameterError(
                    f"Rising: {self.weights[0]:g} is not below {self.weights[1]:g}."
                )

    with pytest.raises(ParameterError, match=r"variations, row 1: Rising: 3 is not below 2"):
        simulate_batch(
            Rising(),
            {"weights[0]": [1.0, 3.0]},
            ZERO_INPUT,
            duration=0.1,
            initial_states={"x": 0.0, "y": 0.0},
            integrator=FAST,
        )


@model
class Growing(System):
    """x' = r x between two bounds that must not cross."""

    rate: float = parameter("1/s", "r", "rate", default=1.0)
    low: float = parameter("1", "a", "lower bound", default=0.0)
    high: float = parameter("1", "b", "upper bound", default=1.0)
    inputs = ()

    def check(self):
        if self.low > self.high:
            raise ParameterError(f"Growing: {self.low} is above {self.high}.")

    @property
    def states(self):
        return (StateVariable("x", "1", 1.0),)

    def rates(self, state, inputs):
        return {"x": self.rate * state["x"]}

    def outputs(self, state, inputs):
        return {}


def test_a_check_whose_answer_differs_from_row_to_row_is_asked_row_by_row():
    given = {"duration": 0.1, "initial_states": {"x": 1.0}, "integrator": FAST}
    with pytest.raises(ParameterError, match=r"variations, row 1: Growing: 2.0 is above 1.0"):
        simulate_batch(Growing(), {"low": [0.0, 2.0, 0.0]}, ZERO_INPUT, **given)
    assert not simulate_batch(
        Growing(), {"low": [0.0, 2.0], "high": [1.0, 3.0]}, ZERO_INPUT, **given
    ).failed.size


def test_a_number_too_large_for_single_precision_is_reported():
    start = {"x": [1.0, 3e38]}
    found = simulate_batch(
        Growing(),
        {},
        ZERO_INPUT,
        duration=1.0,
        initial_states=start,
        integrator=FAST,
        precision=Single(),
    )
    assert list(found.failed) == [1]
    assert (
        found.reason(1)
        == "a rate or an output is not finite in single precision, but not in double"
    )
    assert np.isnan(found["x"][1]).all()


def refused(message, error=ParameterError, **arguments):
    given = {
        "variations": {"mechanism.mass": [9.0, 10.0]},
        "input": PULSE,
        "duration": 0.1,
        "integrator": FAST,
        "initial_states": plain().state_at(pressure=0.0),
    }
    with pytest.raises(error, match=message):
        simulate_batch(plain(), **{**given, **arguments})


def test_everything_else_that_cannot_be_is_refused(tmp_path):
    start = plain().state_at(pressure=0.0)
    refused("no column 'presure'; there are .* Did you mean 'pressure'", keep=("presure",))
    refused(
        "there are 3 inputs and initial states for 2",
        input=[ZERO_INPUT] * 3,
        initial_states={**start, "speed": [0.0, 0.1]},
    )
    refused("one value per plant; .* and initial states or inputs for 3", input=[ZERO_INPUT] * 3)
    refused(
        "inputs, row 1: the plant has no input 'fil'",
        input=[ZERO_INPUT, Schedule({"fil": ((0, 1),)})],
    )
    refused("inputs, row 1 is None; give a Schedule", input=[ZERO_INPUT, None])
    refused("the input 'fill' is 2 before", input=Schedule({"fill": ((0.05, 2.0),)}))
    refused(
        "initial_states, row 1: 'speed' is nan; it must be finite",
        initial_states={**start, "speed": [0.0, np.nan]},
    )
    refused("the plant has no state 'sped'", initial_states={**start, "sped": 0.0})
    refused(
        "initial_states lack speed", initial_states={k: v for k, v in start.items() if k != "speed"}
    )
    refused("duration is -1 s", duration=-1)
    refused(r"1e\+06 s in steps of 0.001 s are 1e\+09 steps .* the limit is 5e\+07", duration=1e6)
    refused(
        "initial_states, row 0: Braid: a contraction of .* is outside its range",
        GeometryLimitError,
        initial_states={**start, "position": [1.0, 0.0]},
    )
    refused(
        "initial_states, row 1: Braid: a contraction of .* is outside its range",
        GeometryLimitError,
        initial_states={**start, "position": [0.0, -1.0]},
    )
    lengths = {"mechanism.mass": [9.0, 10.0], "muscle.geometry.resting_length": [0.3, 0.02]}
    refused(
        "initial_states, row 1: Braid: a contraction of",
        GeometryLimitError,
        variations=lengths,
        initial_states={**start, "position": -0.02},
    )
    refused("initial_states is rest; give for each state a number", initial_states="rest")
    refused("keep is 3; give names of columns", keep=3)
    refused(r"keep: no column '3'", keep=[3])
    refused("into is 5; give the path of a folder", into=5)
    refused("precision is 'single'; give Double", precision="single")
    refused("precision is <class .*Single'>; give Double", precision=Single)
    refused("cores is 'all'; it must be a whole number", cores="all")
    with pytest.raises(ParameterError, match=r"simulate_batch: Muscle.* is no plant; give Plant"):
        simulate_batch(chosen_muscle(), {}, PULSE, duration=0.1, initial_states=start)
    refused("cores is 0; it must be a whole number from 1 on", cores=0)
    (tmp_path / "there").mkdir()
    refused("there: it exists already", FileError, into=tmp_path / "there")
    (tmp_path / "file").write_text("")
    refused("cannot be written", FileError, into=tmp_path / "file" / "inside")
    with pytest.raises(
        ParameterError, match="give the initial_states of Functions, a value for each state"
    ):
        simulate_batch(Functions(), {"power": [0.5]}, ZERO_INPUT, duration=0.1)


def test_columns_that_do_not_fit_the_memory_are_refused():
    many = {"mechanism.mass": np.full(1_000_000, 10.0)}
    refused(
        r"columns of 1000000 plants at \d+ output times take .* GB of memory; the limit is 4 GB",
        variations=many,
    )


@pytest.mark.parametrize("method", [FAST, Rodas4()], ids=["RK4", "Rodas4"])
def test_on_disk_is_what_was_in_memory(tmp_path, method):
    start = plain().state_at(pressure=1e5)
    varied = thick_and_thin(18, {2} if method is FAST else ())
    varied |= around({"mechanism.mass": 10.0}, 18)
    given = {
        "duration": 0.2,
        "initial_states": start,
        "integrator": method,
        "keep": ("pressure", "position", "fill"),
    }
    memory = simulate_batch(plain(), varied, PULSE, **given)
    disk = simulate_batch(plain(), varied, PULSE, into=tmp_path / "study" / "run", **given)
    folder = tmp_path / "study" / "run"
    assert [p.name for p in (tmp_path / "study").iterdir()] == ["run"]
    for name, column in memory.columns.items():
        np.testing.assert_array_equal(np.load(folder / f"{name}.npy"), column)
        np.testing.assert_array_equal(disk[name], column)
        assert isinstance(disk[name], np.memmap)
    np.testing.assert_array_equal(np.load(folder / "time.npy"), memory.time)
    np.testing.assert_array_equal(np.load(folder / "status.npy"), memory.status)
    np.testing.assert_array_equal(np.load(folder / "final speed.npy"), memory.final["speed"])
    told = json.loads((folder / "batch.json").read_text(encoding="utf-8"))
    assert told["files"]["pressure"] == "pressure.npy"
    assert {int(i): words for i, words in told["reasons"].items()} == memory.reasons
    np.testing.assert_array_equal(disk.recording(2)["position"], memory.recording(2)["position"])


def test_a_column_of_a_strange_name_has_a_file(tmp_path):
    system = WithSensitivities(plain(), (("mechanism.mass",),), (10.0,))
    still = {s.name: 0.0 for s in system.states} | plain().state_at(pressure=1e5)
    name = sensitivity("pressure", 0)
    found = simulate_batch(
        system,
        {"scales[0]": [9.0, 10.0]},
        PULSE,
        duration=0.1,
        initial_states=still,
        integrator=FAST,
        keep=(name,),
        into=tmp_path / "out",
    )
    assert (tmp_path / "out" / "d pressure%2Fd 0.npy").exists()
    assert found[name].shape == (2, found.time.size)


@pytest.mark.parametrize(
    "place", ["numpy.lib.format.open_memmap", "os.posix_fallocate", "numpy.save"]
)
def test_a_full_disk_is_named_and_leaves_nothing_behind(tmp_path, monkeypatch, place):
    """Room for the columns is reserved before the run: in it, a disk that is full would end the
    process.
    """

    def fails(*_, **__):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(place, fails, raising=False)
    refused(
        r"out: cannot be written to: No space left on device. Free space",
        FileError,
        into=tmp_path / "out",
    )
    assert list(tmp_path.iterdir()) == []


def test_an_error_on_the_way_leaves_nothing_behind(tmp_path, monkeypatch):
    from airmuscle.engine.run.batch.job import BatchJob

    def fails(self, index):
        raise ZeroDivisionError("of the test")

    monkeypatch.setattr(BatchJob, "run_single", fails)
    with pytest.raises(ZeroDivisionError):
        simulate_batch(
            plain(),
            {"mechanism.mass": [9.0, 10.0]},
            PULSE,
            duration=0.1,
            initial_states=plain().state_at(pressure=0.0),
            into=tmp_path / "out",
        )
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("method", [RungeKutta4(2e-6), Rodas4(1e-12)], ids=["RK4", "Rodas4"])
@pytest.mark.parametrize("where", ["memory", "disk"])
def test_an_interruption_keeps_what_is_done(tmp_path, monkeypatch, method, where):
    """The user stops as soon as the first plants are done; the rest says so, and what is there is
    right.
    """
    take, once = job.Queue._take, threading.Lock()

    def interrupting(self):
        if self.done >= (1 if isinstance(method, ExplicitRungeKutta) else 20) and once.acquire(
            blocking=False
        ):
            _thread.interrupt_main()
            while not self.stop[0]:
                time.sleep(0.01)
        return take(self)

    count = 64
    start = plain().state_at(pressure=1e5)
    given = {
        "duration": 0.05,
        "initial_states": start,
        "integrator": method,
        "keep": ("pressure",),
        "cores": 1,
        "output_times": 0.01,
    }
    varied = around({"mechanism.mass": 10.0}, count)
    whole = simulate_batch(plain(), varied, PULSE, **given)
    monkeypatch.setattr(job.Queue, "_take", interrupting)
    into = {"into": tmp_path / "out"} if where == "disk" else {}
    found = simulate_batch(plain(), varied, PULSE, **given, **into)
    assert found.interrupted
    done = np.flatnonzero(found.status == 0)
    assert 0 < done.size < count
    np.testing.assert_array_equal(found["pressure"][done], whole["pressure"][done])
    assert np.isnan(found["pressure"][found.failed]).all()
    assert {found.reason(i) for i in found.failed} == {"it was interrupted"}
    assert not whole.interrupted
    if where == "disk":
        np.testing.assert_array_equal(np.load(tmp_path / "out" / "status.npy"), found.status)


def test_an_interruption_while_threads_start_keeps_what_is_done(monkeypatch):
    submit = ThreadPoolExecutor.submit

    def interrupted(self, *task):
        submit(self, *task)
        raise KeyboardInterrupt

    monkeypatch.setattr(ThreadPoolExecutor, "submit", interrupted)
    varied = around({"mechanism.mass": 10.0}, 64)
    start = plain().state_at(pressure=1e5)
    try:
        found = simulate_batch(plain(), varied, PULSE, duration=0.1, initial_states=start, cores=2)
    except KeyboardInterrupt:
        pytest.fail("the interruption is passed on, and a thread is left behind")
    assert found.interrupted
    assert set(found.status.tolist()) == {0, Status.INTERRUPTED}


def test_the_recording_of_one_is_that_of_simulate():
    start = plain().state_at(pressure=1e5)
    found = simulate_batch(
        plain(), {"mechanism.mass": [9.0, 10.0]}, PULSE, duration=0.2, initial_states=start
    )
    run = simulate(found.plant(1), PULSE, duration=0.2, initial_state=start)
    one = found.recording(1)
    assert list(one) == list(run)
    assert one.constants == run.constants
    assert set(run.notes[1:]) < set(one.notes)
    assert found.recording(-1).notes[0] == "plant 1 of a batch"
    with pytest.raises(ColumnError, match="there is no plant 2; there are 0 to 1"):
        found.recording(2)
    with pytest.raises(
        ColumnError, match=r"no column 'presure'; kept are .* Did you mean 'pressure'"
    ):
        found["presure"]


def test_a_system_whose_states_take_plain_numbers_only_has_its_own_sizes_too():
    @model
    class Picky(Functions):
        @property
        def states(self):
            size = 1.0 if self.power < 0.5 else 2.0
            return StateVariable("x", "1", size), StateVariable("y", "1", float(self.power))

    found = variations.variations_of(Picky(), {"power": [0.3, 0.6]}, None).nominal()
    np.testing.assert_array_equal(found, [[1.0, 0.3], [2.0, 0.6]])
    assert dataclasses.is_dataclass(Picky)


def test_a_bar_is_drawn_on_a_terminal_once_it_takes_long(monkeypatch, capsys):
    with job.progress("simulating", 10) as advanced:
        advanced(5)
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(job, "BAR_DELAY", -1.0)
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    with job.progress("simulating", 10) as advanced:
        advanced(5)
    assert "simulating" in capsys.readouterr().err


def test_rows_that_go_together_are_checked_at_once(monkeypatch):
    """No row is checked by itself, which for 10 000 plants would take longer than their
    simulation.
    """
    plant = paper()
    paths = [leaf.path for leaf in tree.leaves(plant) if leaf.value != 0.0]
    columns = {
        leaf.path: leaf.value * np.linspace(0.98, 0.99, 4)
        for leaf in tree.leaves(plant)
        if leaf.path in paths
    }
    check = variations.check_together
    checked = []
    monkeypatch.setattr(
        variations, "check_together", lambda part: (checked.append(part), check(part))
    )
    assert variations.variations_of(plant, columns, None).values.shape == (4, len(paths))
    assert [type(part) for part in checked] == [
        type(part) for _, part in variations.parts_of(plant)
    ]


def test_a_limit_of_the_validity_range_beyond_its_bounds_names_the_row():
    with pytest.raises(
        ParameterError, match=r"row 2.*min_pressure.*allowed range: -101325 to 1e\+08 Pa"
    ):
        variations.variations_of(
            paper(), {"muscle.contractile.min_pressure": [0.0, 0.0, -2e5]}, None
        )


def test_variations_and_input_in_exchanged_places_are_named():
    with pytest.raises(
        ParameterError, match="The order of the arguments is: plant, variations, input"
    ):
        simulate_batch(plain(), PULSE, {"mechanism.mass": [5.0, 6.0]}, duration=0.1)


def test_the_times_of_a_batch_are_read_by_name_as_its_columns_are():
    batch = simulate_batch(
        plain(), {"mechanism.mass": [5.0, 6.0]}, PULSE, duration=0.05, output_times=0.01
    )
    np.testing.assert_array_equal(batch["time"], batch.time)
