"""Dynamic identification closes the loop: what a simulation used is found again from its noisy
record, within the stated bands; what a record cannot tell is named, with the experiment that would
tell it, and nothing is named when it is told. One record's fill gives C/V, never C and V.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from filling import hanging

from airmuscle import Status
from airmuscle.bench import (
    Experiment,
    InitialConditions,
    InitialValue,
    StartTime,
    analyse_identifiability,
    fit_dynamic,
    locate_pressure_sensor,
    predict_dynamic,
    rank_records,
)
from airmuscle.bench.dynamics import DynamicProfile, cross_predict
from airmuscle.core import StateVariable, System, model, parameter, tree
from airmuscle.engine import InputSignal, PiecewiseLinear, Schedule, simulate
from airmuscle.engine.run import BoundIntegrator
from airmuscle.errors import IdentificationError, ParameterError
from airmuscle.physics import (
    Dahl,
    EnergyBalance,
    FillDischarge,
    HangingMass,
    Isometric,
    Muscle,
    Plant,
    Polytropic,
    Supply,
    SwellingWall,
    Tube,
    Valve,
    Vessel,
    WithLeak,
    WithTubes,
    find_equilibrium,
)
from airmuscle.recording import Recording

FILL = Schedule({"fill": ((0.1, 1.0), (1.0, 0.0)), "discharge": ((1.3, 1.0),)})
SENSORS = {"pressure": 500.0, "position": 5e-5}
FREE = (
    ("circuit.fill.conductance", "circuit.discharge.conductance"),
    ("circuit.fill.critical_ratio", "circuit.discharge.critical_ratio"),
    "gas.exponent",
    "muscle.geometry.braid_angle",
    "muscle.spring.stiffness",
    "muscle.damper.damping",
    "mechanism.mass",
)


def moving():
    return dataclasses.replace(hanging(), gas=Polytropic(1.25))


def noisy(recording, seed, **deviations):
    rng = np.random.default_rng(seed)
    return recording.with_columns(
        **{
            name: recording[name] + s * rng.standard_normal(len(recording))
            for name, s in deviations.items()
        }
    )


def changed(plant, **factors):
    values = {leaf.path: leaf.value for leaf in tree.leaves(plant)}
    for path, factor in factors.items():
        values[path.replace("__", ".")] *= factor
    return tree.with_parameters(plant, list(values.values()))


def truth(plant, name):
    return {leaf.path: leaf.value for leaf in tree.leaves(plant)}[name.partition(" of record")[0]]


def recorded(plant, seed, shift=0.0):
    run = simulate(plant, FILL, duration=2.0, output_times=0.01)
    run = run.with_columns(time=run["time"] + shift)
    return Experiment(noisy(run, seed, **SENSORS), FILL, InitialConditions.at_rest(plant, 0.0), 0.0)


def rigid_plant():
    """A muscle held at one length: a vessel of constant volume."""
    plant = hanging()
    return Plant(plant.muscle, plant.circuit, Isometric(0.05), Polytropic(1.2))


def rigid_fill(plant, seed=3):
    command = Schedule({"fill": ((0.0, 1.0),)})
    start = InitialConditions.at_coordinates(plant, 0.0)
    run = simulate(
        plant, command, duration=1.0, initial_state=plant.state_at(pressure=0.0), output_times=0.005
    )
    return Experiment(noisy(run, seed, pressure=300.0), command, start)


# The master test


def test_what_the_simulation_used_is_found_within_the_stated_bands():
    """Two records that share the muscle but not the supply; seven shared numbers, supply and start
    time for each.
    """
    plants = [moving(), changed(moving(), circuit__supply__pressure=0.9)]
    experiments = [
        recorded(p, seed, shift)
        for p, seed, shift in zip(plants, (5, 6), (0.013, -0.004), strict=True)
    ]
    start = changed(
        moving(),
        circuit__fill__conductance=1.5,
        circuit__fill__critical_ratio=0.6,
        gas__exponent=0.9,
        muscle__geometry__braid_angle=1.2,
        muscle__damper__damping=2.0,
        mechanism__mass=0.7,
        muscle__spring__stiffness=0.8,
    )
    fit = fit_dynamic(
        start,
        experiments,
        free=FREE,
        per_record=("circuit.supply.pressure", StartTime(0.05)),
        observed=SENSORS,
        starts=4,
    )
    expected = [truth(plants[0], e.name) for e in fit.estimates[:7]]
    expected += [
        truth(plants[0], "circuit.supply.pressure"),
        0.013,
        truth(plants[1], "circuit.supply.pressure"),
        -0.004,
    ]
    distance = (fit.values - expected) / np.array([e.stderr for e in fit.estimates])
    assert np.abs(distance).max() < 3.5
    squared = distance @ np.linalg.solve(fit.correlations, distance)
    assert 1.83 < squared < 31.3  # 0.1 % and 99.9 % of chi squared with eleven degrees of freedom
    assert fit.residual_std == pytest.approx(1.0, abs=0.06)
    assert fit.starts_at_optimum >= 2
    assert fit.rms("pressure", 1) == pytest.approx(500.0, rel=0.1)
    assert all(e.stderr < 0.05 * e.value for e in fit.estimates[:7])


@pytest.mark.slow
def test_the_bands_hold_the_truth_as_often_as_they_say():
    """60 simulated records, three well-posed numbers: the 95 % bands hold 171 of 180 in the mean, 3
    sigma is 8.8.
    """
    plant = rigid_plant()
    free = ("circuit.fill.conductance", "circuit.fill.critical_ratio", "circuit.supply.pressure")
    held = 0
    for seed in range(60):
        fit = fit_dynamic(
            plant, [rigid_fill(plant, 100 + seed)], free=free, observed={"pressure": 300.0}
        )
        held += sum(abs(e.value - truth(plant, e.name)) < 1.96 * e.stderr for e in fit.estimates)
    assert 162 <= held <= 180


# What the records cannot tell apart


def test_conductance_against_volume_is_named_with_the_experiment_that_separates_them():
    plant = rigid_plant()
    free = ("circuit.fill.conductance", "muscle.geometry.resting_length")
    fit = fit_dynamic(plant, [rigid_fill(plant)], free=free, observed={"pressure": 300.0})
    (found,) = fit.identifiability.undetermined
    assert {name for name, _ in found.shares} == set(free)
    assert [share for _, share in found.shares] == pytest.approx([1.0, 1.0], abs=1e-3)
    assert "rigid vessel of known volume" in found.remedy
    assert "the modelled data stay the same if they change together" in str(fit)
    assert fit.identifiability.rank == 1
    assert all(np.isnan(e.stderr) for e in fit.estimates)


def test_with_the_volume_known_nothing_is_named():
    plant = rigid_plant()
    guess = changed(plant, circuit__fill__conductance=1.3)
    fit = fit_dynamic(
        guess, [rigid_fill(plant)], free=("circuit.fill.conductance",), observed={"pressure": 300.0}
    )
    assert fit.identifiability.undetermined == ()
    assert not any("change together" in note or "determined" in note for note in fit.notes)
    found = fit["circuit.fill.conductance"]
    assert abs(found.value - 2.6167e-9) < 3 * found.stderr


def test_a_parameter_that_nothing_depends_on_is_named():
    plant = rigid_plant()
    free = ("circuit.fill.conductance", "circuit.discharge.conductance")  # the discharge stays shut
    fit = fit_dynamic(plant, [rigid_fill(plant)], free=free, observed={"pressure": 300.0})
    (found,) = fit.identifiability.undetermined
    assert [name for name, _ in found.shares] == ["circuit.discharge.conductance"]
    assert "circuit.discharge.conductance is not determined at all" in str(found)
    assert np.isfinite(fit["circuit.fill.conductance"].stderr)


def test_singular_values_of_a_known_design():
    """Columns (1, 0) and (1, 1e-3): singular values sqrt(2) and about 1e-3/sqrt(2), direction (1,
    -1).
    """
    found = analyse_identifiability(np.array([[1.0, 1.0], [0.0, 1e-3]]), ["a", "b"], np.ones(2))
    assert found.singular_values == pytest.approx([np.sqrt(2), 1e-3 / np.sqrt(2)], rel=1e-5)
    assert found.undetermined[0].relative_stderr == pytest.approx(1e3 * np.sqrt(2), rel=1e-5)
    assert dict(found.undetermined[0].shares)["a"] == pytest.approx(
        -dict(found.undetermined[0].shares)["b"], rel=1e-3
    )


# Profiles, starts, nuisances


def test_a_profile_agrees_with_the_standard_deviation_where_the_problem_is_nearly_linear():
    plant = rigid_plant()
    free = ("circuit.fill.conductance", "circuit.fill.critical_ratio", "circuit.supply.pressure")
    fit = fit_dynamic(plant, [rigid_fill(plant)], free=free, observed={"pressure": 300.0})
    found = fit.profile("circuit.fill.critical_ratio", 6)
    estimate = fit["circuit.fill.critical_ratio"]
    low, high = found.interval
    assert high - low == pytest.approx(2 * 1.96 * estimate.stderr, rel=0.1)
    assert found.cost_increase.min() == 0.0


def test_a_profile_of_what_is_not_determined_is_open():
    plant = rigid_plant()
    free = ("circuit.fill.conductance", "muscle.geometry.resting_length")
    fit = fit_dynamic(plant, [rigid_fill(plant)], free=free, observed={"pressure": 300.0})
    found = fit.profile("circuit.fill.conductance", 3)
    assert np.isnan(found.interval).all()
    assert found.cost_increase.max() < 0.1


def test_a_profile_that_ends_where_the_plant_cannot_be_simulated_has_no_limit_there():
    values = np.arange(6.0)
    increase = np.array([np.inf, 1.0, 0.0, 1.0, 9.0, np.inf])
    low, high = DynamicProfile("x", "1", values, increase, values[:, None]).interval
    assert np.isnan(low)
    assert high == pytest.approx(3.0 + 0.96 / 2.0)


def test_a_start_time_is_found_on_a_clock_that_counts_from_1970():
    """The zero of the clock changes neither the search nor the bounds and standard errors."""
    plant = rigid_plant()
    epoch = 1.7e9
    first = rigid_fill(plant)
    shifted = first.recording.with_columns(time=first.recording["time"] + epoch)
    fits = [
        fit_dynamic(
            plant,
            [dataclasses.replace(first, recording=recording, start_time=begun)],
            free=("circuit.fill.conductance",),
            per_record=(StartTime(0.02),),
            observed={"pressure": 300.0},
        )
        for recording, begun in ((first.recording, 0.004), (shifted, epoch + 0.004))
    ]
    near, far = (fit["start time of record 1"] for fit in fits)
    assert not far.on_bound
    assert far.value - epoch == pytest.approx(near.value, abs=1e-6)
    assert far.stderr == pytest.approx(near.stderr, rel=0.01)
    widths = [np.ptp(fit.profile("start time of record 1", 4).interval) for fit in fits]
    assert widths == pytest.approx([2 * 1.96 * near.stderr] * 2, rel=0.2)


def test_the_effect_of_a_bound_of_a_start_time_does_not_depend_on_the_zero_of_the_clock():
    plant = rigid_plant()
    epoch = 1.7e9
    moves = []
    first = rigid_fill(plant)
    for zero in (1.0, epoch):
        recording = first.recording.with_columns(time=first.recording["time"] + zero)
        early = dataclasses.replace(first, recording=recording, start_time=zero - 0.05)
        fit = fit_dynamic(
            plant,
            [early],
            free=("circuit.fill.conductance",),
            per_record=(StartTime(0.02),),
            observed={"pressure": 300.0},
        )
        moves.append(
            next(note for note in fit.notes if "is on its bound" in note).partition(
                "If the bound were "
            )[2]
        )
    assert moves[0] == moves[1]
    assert moves[0].startswith("0.002 s greater, it would move circuit.fill.conductance by")


def test_the_start_pressure_is_a_nuisance():
    plant = rigid_plant()
    command = Schedule({"fill": ((0.0, 1.0),)})
    run = simulate(
        plant,
        command,
        duration=0.5,
        initial_state=plant.state_at(pressure=40e3),
        output_times=0.005,
    )
    wrong = Experiment(
        noisy(run, 1, pressure=300.0), command, InitialConditions.at_coordinates(plant, 36e3)
    )
    fit = fit_dynamic(
        plant,
        [wrong],
        free=("circuit.fill.conductance",),
        per_record=(InitialValue("pressure", 8e3),),
        observed={"pressure": 300.0},
    )
    found = fit["initial pressure of record 1"]
    assert abs(found.value - 40e3) < 3 * found.stderr
    assert found.stderr < 300.0


def test_the_derivative_of_a_start_at_rest_is_that_of_the_equilibrium():
    plant = moving()
    start = InitialConditions.at_rest(plant, 2e5)
    path = "muscle.spring.stiffness"
    experiment = Experiment(simulate(plant, FILL, duration=0.1), FILL, start)
    fit = fit_dynamic(
        plant,
        [experiment],
        free=(path,),
        per_record=(InitialValue("pressure", 1e4),),
        observed=SENSORS,
    )
    state, slopes = fit.problem.record_models[0].initial_state(np.array([4000.0, 2e5]))
    up, down = (
        find_equilibrium(changed(plant, muscle__spring__stiffness=f), pressure=2e5)
        for f in (1.001, 0.999)
    )
    higher, lower = (find_equilibrium(plant, pressure=p) for p in (2e5 + 100, 2e5 - 100))
    for i, name in enumerate(s.name for s in plant.states):
        assert state[i] == pytest.approx(
            find_equilibrium(plant, pressure=2e5)[name], rel=1e-9, abs=1e-12
        )
        assert slopes[i, 0] == pytest.approx((up[name] - down[name]) / 8.0, rel=1e-4, abs=1e-15)
        assert slopes[i, 1] == pytest.approx(
            (higher[name] - lower[name]) / 200.0, rel=1e-4, abs=1e-15
        )


OPEN = Schedule({"fill": ((0.0, 1.0),)})


def free_muscle(lag=0.2, tube=3e-5):
    """An unloaded muscle of unknown length behind a valve and a line."""
    muscle = dataclasses.replace(
        Muscle.ideal(Vessel(1e-4)), wall=SwellingWall(1e-4, 150e3, 6e4, lag)
    )
    valves = FillDischarge(Supply(620e3), Valve(1e-9, 0.4), Valve(0.0, 0.3))
    return Plant(muscle, WithTubes(valves, Tube(Valve(2e-9, 0.3), tube)), Isometric(0.0))


def free_fill(plant, sensed, seed=2, first=1e4):
    run = simulate(
        plant, OPEN, duration=2.0, initial_state=plant.state_at(pressure=first), output_times=0.005
    )
    return Experiment(
        noisy(run, seed, **{sensed: 500.0}), OPEN, InitialConditions.at_coordinates(plant, first)
    )


def test_line_and_muscle_are_told_from_a_sensor_in_the_line():
    plant = free_muscle()
    valve = "circuit.circuit.fill"
    line = "circuit.tube"
    wall = "muscle.wall"
    free = (
        f"{valve}.conductance",
        f"{valve}.critical_ratio",
        f"{line}.volume",
        f"{line}.orifice.conductance",
        f"{wall}.growth_volume",
        f"{wall}.time_constant",
    )
    guess = changed(
        plant,
        circuit__tube__volume=1.5,
        circuit__tube__orifice__conductance=0.8,
        muscle__wall__time_constant=0.6,
        muscle__wall__growth_volume=1.4,
    )
    fit = fit_dynamic(
        guess,
        [free_fill(plant, "tube.pressure")],
        free=free,
        observed={"tube.pressure": 500.0},
        starts=3,
    )
    for estimate in fit.estimates:
        assert abs(estimate.value - truth(plant, estimate.name)) < 3.5 * estimate.stderr, (
            estimate.name
        )
    assert fit.residual_std == pytest.approx(1.0, abs=0.12)


def test_a_tube_that_is_filled_along_its_length_is_told_from_one_at_one_pressure():
    """A fill through a tube of three segments, sensed behind the valve: three segments give volume
    and conductances back, one leaves more than the noise of the sensor."""
    tube = Tube(Valve(6e-10, 0.0), 2e-5, segment_count=3)
    lone = free_muscle(lag=2.0)
    along = dataclasses.replace(lone, circuit=dataclasses.replace(lone.circuit, tube=tube))
    record = free_fill(along, "tube1.pressure").recording
    record = record.with_columns(**{"tube.pressure": record["tube1.pressure"]})
    free = (
        "circuit.circuit.fill.conductance",
        "circuit.tube.volume",
        "circuit.tube.orifice.conductance",
    )
    fits = {}
    for count, sensed in ((3, "tube1.pressure"), (1, "tube.pressure")):
        plant = changed(along, circuit__tube__volume=1.5, circuit__tube__orifice__conductance=0.8)
        circuit = dataclasses.replace(
            plant.circuit, tube=dataclasses.replace(plant.circuit.tube, segment_count=count)
        )
        plant = dataclasses.replace(plant, circuit=circuit)
        experiment = Experiment(record, OPEN, InitialConditions.at_coordinates(plant, 1e4))
        fits[count] = fit_dynamic(plant, [experiment], free=free, observed={sensed: 500.0})
    for estimate in fits[3].estimates:
        assert abs(estimate.value - truth(along, estimate.name)) < 3.5 * estimate.stderr, (
            estimate.name
        )
    assert fits[3].residual_std == pytest.approx(1.0, abs=0.12)
    assert fits[1].residual_std > 2.0


@pytest.mark.parametrize("sensed", ["tube.pressure", "pressure"])
def test_a_fill_tells_whether_it_was_sensed_before_the_muscle(sensed):
    """A small line behind a large valve and before a narrow tube fills at once and then waits for
    the muscle.

    Both descriptions are fitted to the same record: one growing volume sensed inside, and line and
    muscle. A reading of the record is missing.
    """
    plant = free_muscle(lag=2.0, tube=1e-6)
    plant = changed(
        plant, circuit__circuit__fill__conductance=0.4, circuit__tube__orifice__conductance=0.3
    )
    record = free_fill(plant, sensed)
    values = np.where(np.arange(len(record.recording)) == 100, np.nan, record.recording[sensed])
    recording = record.recording.with_columns(**{"pressure": values, "tube.pressure": values})
    lone = dataclasses.replace(free_muscle(lag=0.005), circuit=plant.circuit.circuit)
    valve = "circuit.fill"
    wall = "muscle.wall"
    inside = fit_dynamic(
        lone,
        [Experiment(recording, OPEN, InitialConditions.at_coordinates(lone, 1e4))],
        observed={"pressure": 500.0},
        starts=3,
        free=(
            f"{valve}.conductance",
            f"{valve}.critical_ratio",
            f"{wall}.growth_volume",
            f"{wall}.midpoint_pressure",
        ),
        bounds={f"{valve}.critical_ratio": (0.1, 0.6), f"{wall}.growth_volume": (0.0, 2e-4)},
    )
    line = (
        "circuit.circuit.fill.conductance",
        "circuit.tube.volume",
        "circuit.tube.orifice.conductance",
    )
    before = fit_dynamic(
        plant,
        [Experiment(recording, OPEN, record.initial_conditions)],
        free=line,
        observed={"tube.pressure": 500.0},
    )
    found = locate_pressure_sensor(in_muscle=inside, in_line=before)
    assert found.is_upstream == (sensed == "tube.pressure")
    assert str(found).startswith("the sensor is probably upstream of the muscle") == (
        sensed == "tube.pressure"
    )
    assert inside.rms("pressure") == found.rms_in_muscle
    assert found.pressure_rise == np.nanmax(values) - np.nanmin(values)
    other = dataclasses.replace(record, recording=noisy(record.recording, 3, **{sensed: 1.0}))
    elsewhere = fit_dynamic(plant, [other], free=line, observed={sensed: 500.0})
    with pytest.raises(IdentificationError, match="different rows"):
        locate_pressure_sensor(in_muscle=inside, in_line=elsewhere)


def test_the_heat_through_the_wall_is_found_from_the_pressure_of_a_fill_and_a_hold():
    """After the valve shuts the warm air cools, and its pressure falls with a time constant m
    c_v/(hA).
    """
    plant = dataclasses.replace(rigid_plant(), gas=EnergyBalance(0.5))
    command = Schedule({"fill": ((0.0, 1.0), (0.4, 0.0))})
    start = InitialConditions.at_coordinates(plant, 0.0)
    run = simulate(
        plant, command, duration=1.5, initial_state=plant.state_at(pressure=0.0), output_times=0.005
    )
    record = Experiment(noisy(run, 4, pressure=300.0), command, start)
    free = ("gas.heat_transfer", "circuit.fill.conductance")
    guess = changed(plant, gas__heat_transfer=3.0, circuit__fill__conductance=0.8)
    fit = fit_dynamic(guess, [record], free=free, observed={"pressure": 300.0})
    for estimate in fit.estimates:
        assert abs(estimate.value - truth(plant, estimate.name)) < 3.5 * estimate.stderr, (
            estimate.name
        )
        assert estimate.stderr < 0.05 * estimate.value


def test_a_leak_is_found_from_a_hold_with_shut_valves():
    plant = rigid_plant()
    plant = dataclasses.replace(plant, circuit=WithLeak(plant.circuit, Valve(2e-11, 0.3)))
    rest = Schedule({})
    start = InitialConditions.at_coordinates(plant, 3e5)
    run = simulate(
        plant, rest, duration=10.0, initial_state=plant.state_at(pressure=3e5), output_times=0.05
    )
    record = Experiment(noisy(run, 8, pressure=300.0), rest, start)
    guess = changed(plant, circuit__leak__conductance=4.0)
    fit = fit_dynamic(
        guess,
        [record],
        free=("circuit.leak.conductance",),
        observed={"pressure": 300.0},
        per_record=(InitialValue("pressure", 2e4),),
    )
    leak = fit["circuit.leak.conductance"]
    assert abs(leak.value - 2e-11) < 3.5 * leak.stderr
    assert leak.stderr < 0.02 * leak.value


def test_friction_is_found_from_the_way_up_and_down():
    plant = moving()
    plant = dataclasses.replace(
        plant, muscle=dataclasses.replace(plant.muscle, friction=Dahl(4e4, 15.0))
    )
    record = recorded(plant, 11)
    free = ("muscle.friction.stiffness", "muscle.friction.coulomb_force", "muscle.damper.damping")
    guess = changed(plant, muscle__friction__stiffness=0.5, muscle__friction__coulomb_force=1.6)
    fit = fit_dynamic(guess, [record], free=free, observed=SENSORS)
    for estimate in fit.estimates:
        assert abs(estimate.value - truth(plant, estimate.name)) < 3.5 * estimate.stderr, (
            estimate.name
        )
    assert fit["muscle.friction.coulomb_force"].stderr < 1.0


@model
class Cooling(System):
    """A body that takes the temperature of its surroundings."""

    ambient: float = parameter("K", "T_a", "temperature of the surroundings", bounds=(1.0, 1e4))
    time_constant: float = parameter("s", "tau", "time constant", bounds=(1e-3, 1e3))
    states = (StateVariable("temperature", "K", 300.0),)
    inputs = ()

    def rates(self, state, inputs):
        return {"temperature": (self.ambient - state["temperature"]) / self.time_constant}

    def outputs(self, state, inputs):
        return {}


def test_a_system_of_any_kind_is_fitted_whatever_its_surroundings_are():
    """The notes on ambient air are for plants with air."""
    time = np.linspace(0.0, 5.0, 101)
    record = Recording({"time": time, "temperature": 290.0 + 60.0 * np.exp(-time / 2.0)}, "cooling")
    start = InitialConditions({"temperature": 350.0}, {"temperature": 350.0})
    run = Experiment(record, Schedule({}), start)
    sensor = {"temperature": 0.1}
    fit = fit_dynamic(
        Cooling(280.0, 1.0), [run], free=("ambient", "time_constant"), observed=sensor
    )
    assert fit["time_constant"].value == pytest.approx(2.0, rel=1e-4)
    warmer = predict_dynamic(
        fit.plant(), dataclasses.replace(run, plant=Cooling(300.0, 2.0)), sensor
    )
    assert warmer.quantities[0].max_error == pytest.approx(10.0 * (1.0 - np.exp(-2.5)), rel=1e-3)
    assert not any("ambient air" in note for note in (*fit.notes, *warmer.notes))
    best = rank_records(fit, ("ambient", "time_constant")).ranking[0]
    assert best.description == "the same record, 4 times as long"


def test_a_record_that_cannot_be_simulated_with_the_parameters_of_the_others_is_not_predicted():
    plant = rigid_plant()
    fit = fit_dynamic(
        plant,
        [rigid_fill(plant), rigid_fill(plant, 4)],
        free=("circuit.fill.conductance",),
        observed={"pressure": 300.0},
    )

    def refit(chosen):
        estimates = tuple(
            dataclasses.replace(e, value=np.nan if chosen == [0] else e.value)
            for e in fit.estimates
        )
        return dataclasses.replace(fit, estimates=estimates)

    (prediction,) = cross_predict(fit, refit)
    assert prediction.ratio == pytest.approx(1.0)


# Bad input


def test_model_error_is_called_so():
    plant = rigid_plant()
    circuit = FillDischarge(plant.circuit.supply, Valve(2e-9, 0.1), plant.circuit.discharge)
    wrong = dataclasses.replace(plant, circuit=circuit)
    fit = fit_dynamic(
        wrong, [rigid_fill(plant)], free=("circuit.fill.conductance",), observed={"pressure": 300.0}
    )
    assert any("model error rather than noise" in note for note in fit.notes)


def test_the_autocorrelation_is_that_along_the_time_of_each_quantity():
    """Neighbours in time, not the pressure and the position of one row."""
    plant = moving()
    experiment = recorded(plant, 3)
    gappy = experiment.recording["pressure"].copy()
    gappy[::7] = np.nan
    record = dataclasses.replace(
        experiment, recording=experiment.recording.with_columns(pressure=gappy)
    )
    wrong = changed(plant, circuit__fill__critical_ratio=0.5)
    fit = fit_dynamic(wrong, [record], free=("circuit.fill.conductance",), observed=SENSORS)
    series = [fit.residuals()[name] / deviation for name, deviation in SENSORS.items()]
    series = [each[np.isfinite(each)] for each in series]
    expected = sum(each[1:] @ each[:-1] for each in series) / sum(each @ each for each in series)
    assert expected > 0.3
    assert f"(lag 1: {expected:.2f})" in "".join(fit.notes)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"free": ("circuit.fill.conductanse",)}, "Did you mean 'circuit.fill.conductance'"),
        ({"observed": {"presure": 1.0}}, "no output 'presure'|no column 'presure'"),
        (
            {"bounds": {"gas.exponent": (1.0, 2.0)}},
            "bounds are given for 'gas.exponent', which is not free; free are circuit.fill",
        ),
        (
            {"bounds": {"circuit.fill.conductance": (1e-8, 1e-7)}},
            "circuit.fill.conductance is 2.6167e-09, outside its bounds 1e-08 to 1e-07",
        ),
        ({"free": ()}, "no parameter is free"),
        (
            {"per_record": (InitialValue("presure", 1.0),)},
            "initial conditions of record 1 have no known value 'presure'; known are pressure",
        ),
        ({"starts": 0}, "one start"),
        ({"observed": {"pressure": 0.0}}, "must be positive"),
    ],
)
def test_what_cannot_be_asked_is_refused(change, message):
    plant = rigid_plant()
    question = {"free": ("circuit.fill.conductance",), "observed": {"pressure": 300.0}} | change
    with pytest.raises(Exception, match=message):
        fit_dynamic(plant, [rigid_fill(plant)], **question)


def test_records_that_cannot_be_used_are_refused():
    plant = rigid_plant()
    record = rigid_fill(rigid_plant())
    question = {"free": ("circuit.fill.conductance",), "observed": {"pressure": 300.0}}
    back = record.recording["time"].copy()
    back[7] = back[3]
    jumping = dataclasses.replace(record, recording=record.recording.with_columns(time=back))
    with pytest.raises(IdentificationError, match="time must not decrease, but row 8"):
        fit_dynamic(plant, [jumping], **question)
    short = dataclasses.replace(record, recording=record.recording.rows(slice(0, 1)))
    with pytest.raises(IdentificationError, match="1 observations cannot determine 1 unknowns"):
        fit_dynamic(plant, [short], **question)
    with pytest.raises(ParameterError, match="as many conditions as there are states"):
        fit_dynamic(
            plant,
            [
                dataclasses.replace(
                    record, initial_conditions=InitialConditions({}, {"air_mass": 1e-4})
                )
            ],
            **question,
        )


@pytest.mark.parametrize(
    ("known", "still", "message"),
    [
        (
            {"position": 0.0, "contraction": 0.0, "speed": 0.0},
            (),
            "no state satisfies .* the Jacobian is singular",
        ),
        (
            {"pressure": -5e5, "position": 0.0, "speed": 0.0},
            (),
            r"no state satisfies .*pressure = -5e\+05|ended early",
        ),
        (
            {"pressure": 0.0, "speed": 0.0},
            ("speed",),
            "no state satisfies the initial conditions .*Newton's method did not converge",
        ),
    ],
)
def test_a_start_that_does_not_exist_is_refused(known, still, message):
    """Conditions that say one thing twice; a pressure below absolute zero; rest under a load that
    nothing bears.
    """
    plant = dataclasses.replace(moving(), mechanism=HangingMass(1e5))
    record = dataclasses.replace(
        recorded(moving(), 1),
        initial_conditions=InitialConditions(known, moving().state_at(pressure=0.0), still),
    )
    with pytest.raises(IdentificationError, match=message):
        fit_dynamic(plant, [record], free=("muscle.damper.damping",), observed=SENSORS)


def test_starts_on_several_cores_give_what_one_after_another_gives(monkeypatch):
    plant = rigid_plant()
    free = ("circuit.fill.conductance", "circuit.supply.pressure")
    found = []
    for cores in (1, 3):
        monkeypatch.setattr("os.cpu_count", lambda cores=cores: cores)
        found.append(
            fit_dynamic(
                plant, [rigid_fill(plant)], free=free, observed={"pressure": 300.0}, starts=7
            )
        )
    np.testing.assert_array_equal(found[0].costs, found[1].costs)
    np.testing.assert_array_equal(found[0].values, found[1].values)


def test_a_start_left_after_a_first_look_goes_on_as_if_it_had_not_been(monkeypatch):
    plant = rigid_plant()
    free = ("circuit.fill.conductance", "circuit.supply.pressure")
    question = {"free": free, "observed": {"pressure": 300.0}, "starts": 5}
    whole = fit_dynamic(plant, [rigid_fill(plant)], **question)
    monkeypatch.setattr("airmuscle.bench.dynamics.fit.SCREENING_RUNS", 3)
    monkeypatch.setattr("airmuscle.bench.dynamics.fit.SCREENING_RATIO", np.inf)
    np.testing.assert_array_equal(
        fit_dynamic(plant, [rigid_fill(plant)], **question).costs, whole.costs
    )
    monkeypatch.setattr("airmuscle.bench.dynamics.fit.SCREENING_RATIO", 1.0)
    left = fit_dynamic(plant, [rigid_fill(plant)], **question)
    assert left.costs[-1] > 10 * whole.costs[-1]
    assert left.costs[0] == pytest.approx(whole.costs[0], rel=1e-6)


def test_a_run_of_far_more_steps_than_the_best_is_not_waited_for(monkeypatch):
    """The first run may take what it takes; where any further one takes too many steps the search
    stays where it is.
    """
    plant = rigid_plant()
    path = "circuit.fill.conductance"
    allowed = []
    guess = changed(plant, circuit__fill__conductance=1.3)
    record = rigid_fill(plant)
    whole = BoundIntegrator.run

    def noted(*arguments):
        allowed.append(arguments[-1])
        return whole(*arguments)

    monkeypatch.setattr(BoundIntegrator, "run", noted)
    found = fit_dynamic(guess, [record], free=(path,), observed={"pressure": 300.0})
    assert found[path].value == pytest.approx(truth(plant, path), rel=0.01)
    assert allowed == [
        1_000_000,
        *[10_000] * (len(allowed) - 2),
        1_000_000,
    ]  # the last is that of the result
    monkeypatch.setattr("airmuscle.bench.dynamics.problem.MIN_STEP_BUDGET", 10)
    monkeypatch.setattr("airmuscle.bench.dynamics.problem.STEP_BUDGET_FACTOR", 0.5)
    stays = fit_dynamic(guess, [record], free=(path,), observed={"pressure": 300.0})
    assert stays[path].value == truth(guess, path)


def test_an_interrupted_run_ends_the_fit(monkeypatch):
    """A start whose run is interrupted is not one that failed."""
    plant = rigid_plant()
    record = rigid_fill(rigid_plant())
    whole = BoundIntegrator.run
    monkeypatch.setattr(
        BoundIntegrator, "run", lambda *a, **k: whole(*a, **k)._replace(status=Status.INTERRUPTED)
    )
    with pytest.raises(KeyboardInterrupt):
        fit_dynamic(
            plant, [record], free=("circuit.fill.conductance",), observed={"pressure": 300.0}
        )


def test_a_heavier_load_is_another_plant_of_the_same_structure():
    light = moving()
    heavy = dataclasses.replace(moving(), mechanism=HangingMass(8.0))
    records = [recorded(light, 1), dataclasses.replace(recorded(heavy, 2), plant=heavy)]
    fit = fit_dynamic(
        light,
        records,
        free=("muscle.damper.damping",),
        per_record=("mechanism.mass",),
        observed=SENSORS,
    )
    for found, expected in zip(fit.estimates[1:], (5.0, 8.0), strict=True):
        assert abs(found.value - expected) < 3.5 * found.stderr
    assert fit.plant(1).mechanism.mass == fit.estimates[2].value


class InIntegers(InputSignal):
    """The command of `rigid_fill` as a user's signal in integers."""

    def segments(self, inputs, start, duration):
        values = np.array([[int(name == "fill") for name in inputs]])
        return PiecewiseLinear(np.array([start + duration]), values, 0 * values)


def test_a_command_in_integers_is_that_in_floats():
    plant = rigid_plant()
    usual = rigid_fill(plant)
    own, same = (
        fit_dynamic(
            plant, [each], free=("circuit.fill.conductance",), observed={"pressure": 300.0}
        )["circuit.fill.conductance"].value
        for each in (dataclasses.replace(usual, command=InIntegers()), usual)
    )
    assert own == same
