"""A run that fails returns what it has, with the reason, the time, the state and the remedy; never
NaN as a result.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joints import chosen_muscle
from widths import widened

from airmuscle import Status, load
from airmuscle.control import OnOffController
from airmuscle.core import Columns, DiagnosticCode
from airmuscle.core.system import state_vector
from airmuscle.engine import (
    ControlLoop,
    InputSignal,
    PiecewiseLinear,
    Problem,
    Rodas4,
    RungeKutta4,
    Schedule,
    advance,
    simulate,
    simulate_batch,
    solve,
)
from airmuscle.engine.compile import compile_system
from airmuscle.engine.run import integrators
from airmuscle.errors import AirmuscleError, ParameterError, SimulationError
from airmuscle.physics import (
    EnergyBalance,
    FillDischarge,
    HangingMass,
    HuntCrossley,
    Isothermal,
    LinearDamper,
    Manifold,
    MusclesInSeries,
    Plant,
    Polytropic,
    SeriesSpring,
    SharedSupply,
    Supply,
    Tube,
    Valve,
    WithEndStops,
    WithLatch,
    WithLeak,
    WithTubes,
    linearise,
    stiffness,
)

HUGE = Valve(9e-6, 0.3)
VALVE = Valve(2.6e-9, 0.4)
FILL = Schedule({"fill": ((0.05, 1.0),)})
SETPOINT = Schedule({"pressure": ((0.0, 1e5),)})


def test_a_fixed_step_that_is_too_long_is_not_called_a_result():
    """A huge valve empties and overfills the muscle within one step; polytropic air of negative
    mass has no pressure.
    """
    plant = Plant(
        chosen_muscle(), FillDischarge(Supply(5e5), HUGE, HUGE), HangingMass(10.0), Polytropic(1.2)
    )
    start = plant.state_at(pressure=1e5)
    with pytest.raises(
        SimulationError, match=r"ended at .* because .*not finite.*air_mass .*fixed step too long"
    ) as caught:
        simulate(plant, FILL, duration=1.0, initial_state=start, integrator=RungeKutta4(0.01))
    part = caught.value.recording
    assert 3 <= len(part) < 101
    for name in part:
        assert np.isfinite(part[name]).all(), name
    kept = simulate(
        plant, FILL, duration=1.0, initial_state=start, integrator=RungeKutta4(0.01), complete=False
    )
    assert len(kept) == len(part)
    assert "not finite" in kept.notes[-1]


TEARING = {"one": HangingMass(60.0), "two": MusclesInSeries(HangingMass(50.0), (0.3,))}
GASES = [Isothermal(), Polytropic(1.2), EnergyBalance(0.2)]


@pytest.mark.parametrize(
    ("which", "gas"),
    widened(
        [(which, gas) for which in TEARING for gas in GASES],
        lambda which, gas: isinstance(gas, Polytropic) == (which == "two"),
    ),
    ids=str,
)
def test_a_load_that_tears_a_muscle_out_of_its_reach_is_named_as_the_cause(which, gas):
    """A braid stretched until its threads lie along it encloses nothing; a stop is what keeps a
    load from doing so.
    """
    mechanism = TEARING[which]
    muscles = tuple(replace(chosen_muscle(), name=name) for name in ("upper", "lower"))[
        : mechanism.muscle_count or 1
    ]
    plant = Plant(
        muscles, (FillDischarge(Supply(5e5), VALVE, HUGE),) * len(muscles), mechanism, gas
    )
    empty = Schedule({name: ((0.0, 1.0),) for name in plant.inputs if name.endswith("discharge")})
    with pytest.raises(
        SimulationError, match=r"upper reached a contraction of -10.*wrap"
    ) as caught:
        simulate(plant, empty, duration=2.0, initial_state=plant.state_at(pressure=0.0))
    assert len(caught.value.recording) > 1
    if len(muscles) == 1:
        held = replace(plant, mechanism=WithEndStops(mechanism, -0.015, 0.05, HuntCrossley(1e8)))
        assert (
            simulate(held, empty, duration=2.0, initial_state=held.state_at(pressure=0.0))["time"][
                -1
            ]
            == 2.0
        )


def isothermal(valve=VALVE):
    return Plant(
        chosen_muscle(), FillDischarge(Supply(5e5), valve, valve), HangingMass(10.0), Isothermal()
    )


def test_isothermal_air_of_negative_mass_has_a_pressure_and_yet_ends_the_run():
    """Isothermal air is linear in its mass: numbers stay finite where they have long lost their
    meaning.
    """
    plant, discharge, method = (
        isothermal(HUGE),
        Schedule({"discharge": ((0.02, 1.0),)}),
        RungeKutta4(0.01),
    )
    start = plant.state_at(pressure=3e5)
    with pytest.raises(
        SimulationError, match=r"because an air mass became negative.*a fixed step too long"
    ) as caught:
        simulate(plant, discharge, duration=0.2, initial_state=start, integrator=method)
    assert (caught.value.recording["air_mass"] >= 0.0).all()
    assert (caught.value.recording["pressure"] >= -101325.0).all()
    with pytest.raises(SimulationError, match="an air mass became negative"):
        advance(plant, start, {"discharge": 1.0}, 0.01, method)
    batch = simulate_batch(
        plant,
        {"mechanism.mass": [10.0, 11.0]},
        discharge,
        duration=0.05,
        initial_states=start,
        integrator=method,
    )
    assert (batch.status == Status.NEGATIVE_AIR_MASS).all()
    assert "an air mass became negative" in batch.reason(1)
    assert (np.nan_to_num(batch["air_mass"]) >= 0.0).all()


STATE = isothermal().state_at(pressure=1e5, position=0.01)
REACH = chosen_muscle().geometry.contraction_range


@pytest.mark.parametrize(
    ("state", "message"),
    [
        ({**STATE, "air_mass": -1e-3}, "air_mass is -0.001 kg; it must not be negative"),
        ({**STATE, "position": "10 mm"}, "position is '10 mm'; it must be one number, in SI"),
        ({**STATE, "position": [0.0, 0.1]}, "it must be one number, in SI"),
        ({**STATE, "sped": 0.0}, "no state 'sped'.*Did you mean 'speed'"),
        ({"air_mass": 1e-3}, "the initial state lacks position, speed"),
        ({**STATE, "air_mass": np.nan}, "the initial state must be finite"),
        ([1.0, 2.0, 3.0], "the initial state is .*; give a value for each name"),
        ({**STATE, "position": 10.0}, "a contraction of .* % is outside its range"),
        ({**STATE, "position": -10.0}, "a contraction of .* % is outside its range"),
        (
            {**STATE, "position": REACH[1] * chosen_muscle().geometry.resting_length},
            "the volume of muscle is 0 m3|is outside its range",
        ),
    ],
)
def test_a_state_that_cannot_be_is_refused_wherever_one_is_given(state, message):
    plant = isothermal()
    for act in (
        lambda: simulate(plant, FILL, duration=0.1, initial_state=state),
        lambda: linearise(plant, state),
        lambda: stiffness(plant, state),
    ):
        with pytest.raises(AirmuscleError, match=message):
            act()


def pieces(ends, values, slopes=None):
    values = np.array(values, dtype=float)
    return PiecewiseLinear(
        np.array(ends, dtype=float),
        values,
        np.zeros_like(values) if slopes is None else np.array(slopes),
    )


@pytest.mark.parametrize(
    ("segments", "message"),
    [
        (pieces([0.01], [[1.0]]), r"for 2 inputs they must be \(S,\), \(S, 2\)"),
        (pieces([0.01], [[1.0]], [[0.0, 0.0]]), "they must be"),
        (pieces([0.01], [[1.0, 0.0]], [[0.0]]), "they must be"),
        (pieces([0.005, 0.01], [[1.0, 0.0]]), "they must be"),
        (pieces([], np.zeros((0, 2))), "with at least one segment"),
        (pieces([0.02, 0.01], [[1.0, 0.0]] * 2), "in rising order after 0 s"),
        (pieces([0.01], [[np.nan, 0.0]]), "not finite"),
        (pieces([np.nan], [[1.0, 0.0]]), "not finite"),
        (pieces([0.01], [[1.0, 0.0]], [[np.inf, 0.0]]), "not finite"),
    ],
)
def test_segments_of_another_shape_never_reach_a_kernel(segments, message):
    """A kernel reads as many inputs as the plant has, whether they are there or not."""
    with pytest.raises(AirmuscleError, match=message):
        advance(isothermal(), STATE, segments, 0.01)


@pytest.mark.parametrize("end", [0.005, 0.02])
def test_a_signal_that_ends_at_another_time_than_the_run_is_refused(end):
    """A run ends with the segments of its inputs: it would be shorter or longer than asked."""

    class Own(InputSignal):
        def segments(self, inputs, start, duration):
            return pieces([end], [[0.5, 0.0]])

    given, loop = (
        {"duration": 0.01},
        ControlLoop(OnOffController("pressure", "fill", 1e4), 1e-3, SETPOINT, Own()),
    )
    for act in (
        lambda: simulate(isothermal(), Own(), initial_state=STATE, **given),
        lambda: simulate(isothermal(), loop, initial_state=STATE, **given),
        lambda: simulate_batch(isothermal(), {}, [Own()], initial_states=STATE, **given),
    ):
        with pytest.raises(
            ParameterError,
            match=rf"segments end at {end:g} s; they must end with the run, at 0.01 s",
        ):
            act()


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (
            {"input": {"fill": 1.0}},
            r"the input is {'fill': 1.0}; give a .* Schedule\({'fill': \(\(0, 1.0\),\)}\) is an",
        ),
        ({"duration": "1 s"}, "duration is '1 s'; it must be one number, in SI"),
        ({"output_times": "10 ms"}, "output_times is '10 ms'; it must be one number"),
        ({"output_times": [[0.01, 0.02]]}, "give a spacing"),
        ({"integrator": "RK4"}, "the integrator is 'RK4'; give Rodas4"),
    ],
)
def test_what_a_run_is_told_is_of_its_kind(given, message):
    with pytest.raises(AirmuscleError, match=message):
        simulate(isothermal(), **{"input": FILL, "duration": 0.1, "initial_state": STATE, **given})
    with pytest.raises(
        AirmuscleError,
        match=message if "input" not in given else "give an InputSignal, a ControlLoop, or a list",
    ):
        simulate_batch(
            isothermal(), {}, **{"input": [FILL], "duration": 0.1, "initial_states": STATE, **given}
        )


def test_what_a_step_is_told_is_of_its_kind():
    plant = isothermal()
    for inputs, dt, message in (
        ({"fill": "open"}, 0.1, "write pairs of time"),
        ([1.0, 0.0], 0.1, "inputs are"),
        ({}, "1 s", "dt is '1 s'"),
    ):
        with pytest.raises(AirmuscleError, match=message):
            advance(plant, STATE, inputs, dt)


def test_a_batch_has_no_more_plants_than_it_has():
    batch = simulate_batch(
        isothermal(), {}, [FILL, FILL], duration=0.01, initial_states=STATE, keep=()
    )
    assert batch.reason(-1) == batch.reason(1) == "it is complete"
    with pytest.raises(AirmuscleError, match="there is no plant 2; there are 0 to 1"):
        batch.reason(2)
    wrong = (
        ({"initial_states": {**STATE, "speed": "fast"}}, "'speed' is fast"),
        ({"initial_states": {**STATE, "air_mass": -1.0}}, "row 0"),
    )
    for given, message in (
        *wrong,
        ({"variations": [1, 2]}, "give a column of values"),
        ({"variations": {3: [1]}}, "Plant has no parameter '3'"),
    ):
        with pytest.raises(AirmuscleError, match=message):
            simulate_batch(
                isothermal(),
                input=FILL,
                duration=0.1,
                **{"variations": {"mechanism.mass": [9.0]}, "initial_states": STATE, **given},
            )


PARTS = [
    (
        lambda: FillDischarge(Supply(5e5), 3, VALVE),
        "FillDischarge: fill must be an instance of Orifice; it is 3",
    ),
    (
        lambda: FillDischarge(5e5, VALVE, VALVE),
        "supply must be an instance of AirSource; it is 500000",
    ),
    (
        lambda: WithTubes(FillDischarge(Supply(5e5), VALVE, VALVE), VALVE),
        "WithTubes: tube must be an instance of TubeModel",
    ),
    (
        lambda: WithTubes(FillDischarge(Supply(5e5), VALVE, VALVE), Tube(VALVE, 1e-6, 1, "air")),
        "gas must be an instance of Gas",
    ),
    (lambda: WithLeak(None, VALVE), "WithLeak: circuit must be an instance of Circuit; it is None"),
    (
        lambda: Manifold(Supply(5e5), (3,), ("a",)),
        "branches must be a tuple, each element of which is an instance of Circuit",
    ),
    (
        lambda: Manifold(Supply(5e5), FillDischarge(SharedSupply(), VALVE, VALVE), ("a",)),
        "branches must be a tuple",
    ),
    (
        lambda: Manifold(Supply(5e5), (FillDischarge(SharedSupply(), VALVE, VALVE),), (1,)),
        "names must be a tuple, each element of which is a text; it is",
    ),
]


@pytest.mark.parametrize(("make", "message"), PARTS)
def test_a_part_of_another_kind_is_named(make, message):
    with pytest.raises(AirmuscleError, match=message):
        Plant(chosen_muscle(), make(), HangingMass(10.0))


def test_a_run_ends_soon_after_its_state_has_become_impossible(monkeypatch):
    """Beyond the model the steps can become endlessly many: a thrown load is not followed to the
    end of its run.
    """
    monkeypatch.setattr(integrators, "INTERRUPT_CHECK_STEPS", 200)
    start = {**STATE, "speed": 100.0}
    problem = Problem(
        isothermal(), Schedule({}), 1.0, start, output_times=[1.0], integrator=RungeKutta4(1e-5)
    )
    solution = solve(problem)
    assert solution.status is Status.NON_POSITIVE_VOLUME
    assert 200 <= solution.statistics.steps < 2_000
    assert solution.final_time == pytest.approx(1e-5 * solution.statistics.steps, rel=1e-9)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: WithLatch(3), "WithLatch: inner must be an instance of Mechanism; it is 3"),
        (
            lambda: MusclesInSeries(3, (1.0,)),
            "MusclesInSeries: inner must be an instance of Mechanism",
        ),
        (
            lambda: WithEndStops(3, 0.0, 0.1, HuntCrossley(1e9)),
            "WithEndStops: inner must be an instance of Mechanism",
        ),
        (
            lambda: WithEndStops(HangingMass(1.0), 0.0, 0.1, 3),
            "WithEndStops: contact must be an instance of HuntCrossley",
        ),
    ],
)
def test_a_part_of_a_mechanism_is_one(make, message):
    with pytest.raises(AirmuscleError, match=message):
        Plant(chosen_muscle(), FillDischarge(Supply(5e5), VALVE, VALVE), make())


def test_the_response_at_a_pole_is_infinite():
    with pytest.raises(AirmuscleError, match="there is a pole at 0 Hz"):
        linearise(isothermal(), {**STATE, "speed": 0.0}).frequency_response([0.0])


def test_a_run_from_an_end_of_the_range_where_the_law_is_singular_says_so():
    """The force of straight fibres grows beyond all bounds towards a contraction of zero."""
    plant = replace(isothermal(), muscle=load("saga2007-circle").muscle)
    state = {**STATE, "position": 0.0, "speed": 0.0}
    message = (
        r"At a contraction of 0\.00 %, an end of the geometry of muscle, the force of"
        r" CircleVirtualWork is singular: no run "
        r"begins there .* Begin inside the range, 0\.00 % to 50\.00 %, at a distance of 0\.05 % or"
        r" more"
    )
    with pytest.raises(SimulationError, match=message):
        simulate(plant, Schedule({"fill": ((0, 1),)}), duration=0.1, initial_state=state)
    inside = simulate(
        plant,
        Schedule({"fill": ((0, 1),)}),
        duration=0.001,
        initial_state={**state, "position": 1e-4},
    )
    assert inside["time"][-1] == 0.001


def test_a_run_says_where_no_muscle_can_be():
    """A load thrown up far beyond the muscle's own length is no muscle any more; isothermal numbers
    would go on.
    """
    plant = isothermal()
    thrown = (
        r"because a muscle volume became zero or negative.* contraction of 10\d\.\d+ %, a limit of"
        r" its geometry"
    )
    with pytest.raises(SimulationError, match=thrown) as caught:
        simulate(plant, Schedule({}), duration=0.1, initial_state={**STATE, "speed": 100.0})
    assert (caught.value.recording["volume"] > 0).all()
    assert 1 < len(caught.value.recording) < 101
    columns = {
        "time": np.array([0.0, 1.0]),
        "pressure": np.zeros(2),
        "contraction": np.array([0.0, -0.2]),
    }
    (found,) = [
        d for d in plant.diagnose(Columns(columns)) if d.code is DiagnosticCode.GEOMETRY_LIMIT
    ]
    assert "by at most 9.664 % at 1 s" in found.text
    assert found.text.endswith("such contractions are not physical")
    series = replace(
        plant, muscle=replace(plant.muscle, damper=LinearDamper(50.0), series=SeriesSpring(3e4))
    )
    columns["inner_contraction"] = np.array([-0.2, 0.0])
    (found,) = [
        d for d in series.diagnose(Columns(columns)) if d.code is DiagnosticCode.GEOMETRY_LIMIT
    ]
    assert "inner contraction" in found.text
    calm = simulate(plant, Schedule({}), duration=0.1, initial_state=STATE)
    assert not [note for note in calm.notes if "range of its geometry" in note]


def test_where_a_run_ends_hardly_depends_on_its_rows():
    """Between rows far apart a state that has become impossible can grow without limit before the
    next row.
    """
    plant = isothermal()
    thrown = {**STATE, "speed": 100.0}
    ends = [
        solve(Problem(plant, Schedule({}), 0.1, thrown, output_times=spacing))
        for spacing in (1e-5, 1e-4, 2e-3)
    ]
    assert {end.status for end in ends} == {Status.NON_POSITIVE_VOLUME}
    for end in ends:
        assert end.final_time == pytest.approx(ends[0].final_time, rel=2e-3)
        assert end.final_state == pytest.approx(ends[0].final_state, rel=2e-3)


@pytest.mark.parametrize("method", [Rodas4(), RungeKutta4(1e-4)], ids=str)
def test_no_more_steps_are_taken_than_allowed(method):
    plant = Plant(chosen_muscle(), FillDischarge(Supply(5e5), VALVE, VALVE), HangingMass(10.0))
    start = state_vector(plant, plant.state_at(pressure=1e5))
    segments = FILL.segments(plant.inputs, 0.0, 1.0)
    times = np.linspace(0.0, 1.0, 11)
    bound = method.bind(compile_system(plant))
    whole = bound.run(segments, 0.0, start, times)
    assert whole.status == 0
    left = bound.run(segments, 0.0, start, times, whole.steps - 1)
    assert (left.status, left.steps) == (Status.TOO_MANY_STEPS, whole.steps - 1)
    enough = bound.run(segments, 0.0, start, times, whole.steps)
    np.testing.assert_array_equal(enough.rows, whole.rows)


@pytest.mark.parametrize("shortest", [1e-309, 1e-320])
def test_a_time_whose_inverse_is_infinite_ends_the_run(shortest):
    begin = isothermal().state_at(pressure=1e5)
    jump = Schedule({"fill": ((0.0, 0.0), (shortest, 1.0))})
    for signal, duration in ((FILL, shortest), (jump, 0.1)):
        with pytest.raises(SimulationError, match="is not finite, after 0 steps"):
            simulate(isothermal(), signal, duration=duration, initial_state=begin)


def test_a_ratio_has_no_unit_in_the_reason():
    plant = load("joint-dmsp-20-proportional").plant
    run = solve(
        Problem(plant, Schedule({"left.command": ((0.0, 1.0),)}), 10.0, integrator=RungeKutta4(0.2))
    )
    assert ", right.spool 0, right.spool_speed 0 1/s" in run.diagnostics[-1].text
