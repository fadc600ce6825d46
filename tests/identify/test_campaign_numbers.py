"""Numbers of a campaign and of dynamic fits against their definitions: bands, steps, motions,
volumes, limits.
"""

from __future__ import annotations

import types

import numpy as np
import pytest

from airmuscle.bench import (
    Experiment,
    InitialConditions,
    classify_records,
    creep_elements,
    estimate_sensors,
    fit,
    fit_creep,
    fit_held_creep,
)
from airmuscle.bench.campaign import (
    check_one_rig,
    find_motion,
    find_pressure_steps,
    volume_change,
    with_force,
)
from airmuscle.bench.campaign.friction_and_release import _mass
from airmuscle.bench.campaign.static_stage import _band, _inner, _left_out_residuals
from airmuscle.bench.dynamics import SensorLocation, searches_at_lowest
from airmuscle.bench.dynamics.candidate_records import _Context
from airmuscle.bench.dynamics.fit import _describe_model_error
from airmuscle.engine import Schedule
from airmuscle.errors import IdentificationError
from airmuscle.physics import (
    Braid,
    FillDischarge,
    Isometric,
    Muscle,
    Plant,
    Polytropic,
    Supply,
    Valve,
    VirtualWork,
)
from airmuscle.recording import Recording

LENGTH = 0.3
BRAID = Braid(0.01, 0.43, LENGTH)
LAW = VirtualWork(BRAID)


def recording(name: str = "run", length: float = LENGTH, **columns: np.ndarray) -> Recording:
    return Recording(columns, name, {"resting_length": length})


# Bands


@pytest.mark.parametrize(("count", "from_above"), [(19, 1), (20, 1), (39, 2), (59, 3)])
def test_the_half_width_of_a_band_is_the_conformal_quantile_of_the_residuals(
    count: int, from_above: int
):
    """A further residual is below the k-th of n by chance k/(n + 1); k is the least with 95 % or
    more.
    """
    residuals = np.arange(1.0, count + 1.0)
    assert int(np.floor(_band("test", residuals, 1).half_width)) == count + 1 - from_above


def test_the_lowest_and_the_highest_level_are_in_every_fit():
    levels = [
        ("pressure", 6e5),
        ("pressure", 1e5),
        ("pressure", 2e5),
        None,
        ("pressure", 1.02e5),
        ("pressure", 3e5),
    ]
    labels = _inner(levels)
    assert [label is None for label in labels] == [True, True, False, True, True, False]
    assert labels[2] != labels[5]
    assert _inner(levels[:2]) == [None, None]


def test_a_quarter_of_the_change_by_leaving_a_level_out_is_added_to_its_residuals():
    contraction = np.linspace(0.02, 0.2, 30)
    noise = np.random.default_rng(1)
    runs = [
        recording(
            f"{p:g}",
            pressure=np.full(30, p),
            contraction=contraction,
            force=LAW.force(p, contraction) * (1.0 + 0.02 * noise.standard_normal()),
        )
        for p in (1e5, 2e5, 4e5)
    ]
    whole = fit(LAW, runs)
    labels = [None, ("pressure", 1), None]
    none, quarter, all_of_it = (
        _left_out_residuals(whole, runs, labels, share)[0] for share in (0.0, 0.25, 1.0)
    )
    default, groups = _left_out_residuals(whole, runs, labels)
    assert groups == 1
    assert np.abs(all_of_it - none).max() > 0.1
    assert default == pytest.approx(0.75 * none + 0.25 * all_of_it)
    assert default == pytest.approx(quarter)


# Records


def test_a_fill_and_a_discharge_have_their_start_change_and_final_pressure():
    time = np.arange(0.0, 4.0, 0.002)
    rise = 2e4 + 4e5 * -np.expm1(-np.maximum(time - 0.5, 0.0) / 0.1)
    pressure = np.where(time < 2.0, rise, 5e4 + 3.7e5 * np.exp(-np.maximum(time - 2.0, 0.0) / 0.2))
    run = recording(time=time, pressure=pressure, contraction=np.full(time.size, 0.05))
    up, down = find_pressure_steps(run, estimate_sensors(run))
    assert (up.start, down.start) == pytest.approx((0.5, 2.0), abs=0.02)
    assert (up.change, down.change) == pytest.approx((4e5, -3.7e5), rel=0.01)
    assert (up.final_pressure, down.final_pressure) == pytest.approx((4.2e5, 5e4), rel=0.01)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_motion_lasts_from_2_to_95_per_cent_of_its_travel(sign: float):
    time = np.arange(0.0, 40.0, 0.02)
    contraction = 0.1 + sign * 0.05 * np.clip((time - 10.0) / 10.0, 0.0, 1.0)
    motion = find_motion(recording(time=time, contraction=contraction))
    assert (motion.start, motion.end) == pytest.approx((10.2, 19.5), abs=0.05)
    assert (motion.travel, motion.range) == pytest.approx((sign * 0.05 * LENGTH, 0.05 * LENGTH))


def test_a_force_is_added_to_rows_with_tension_only():
    found = with_force(recording(force=np.array([-1.0, 0.0, 5.0])), np.array([2.0, 2.0, 2.0]))
    assert found["force"].tolist() == [-1.0, 0.0, 7.0]


def test_a_hanging_mass_follows_from_the_force_in_the_last_tenth_of_a_release():
    force = np.concatenate([np.full(170, 200.0), np.full(30, 98.0665)])
    assert _mass(types.SimpleNamespace(recording=recording(force=force))) == pytest.approx(10.0)


def isobaric(name: str, level: float, factor: float = 1.0) -> Recording:
    contraction = np.concatenate([np.linspace(0.02, 0.16, 200), np.linspace(0.16, 0.02, 200)])
    force = factor * np.asarray(LAW.force(level, contraction))
    return recording(
        name,
        time=0.2 * np.arange(400),
        pressure=np.full(400, level),
        contraction=contraction,
        force=force,
    )


@pytest.mark.parametrize(
    ("level", "factor", "refused"),
    [(3e5, 1.45, False), (3e5, 1.55, True), (1.5e5, 9.0, False), (1.5e5, 11.0, True)],
)
def test_forces_of_one_rig_differ_by_a_half_at_one_pressure_and_by_pressure_by_ten_at_most(
    level, factor, refused
):
    records = classify_records([isobaric("a", 3e5), isobaric("b", level, factor)])
    if refused:
        with pytest.raises(IdentificationError, match=r"contradict each other|a unit is wrong"):
            check_one_rig(records)
    else:
        check_one_rig(records)


# Creep under a load, and the volume


@pytest.mark.parametrize(("motion", "found"), [(2.5, True), (4.0, False)])
def test_creep_under_a_load_uses_the_stiffness_by_length_after_a_motion_of_three_tenths_of_its_time(
    motion, found
):
    time = np.arange(0.0, 120.0, 0.1)
    moved = np.clip((time - 5.0) / motion, 0.0, 1.0)
    creep = 0.01 * -np.expm1(-np.maximum(time - 5.0 - motion, 0.0) / 10.0)
    pressure = np.full(time.size, 3e5)
    contraction = 0.05 + 0.08 * moved + creep
    run = recording(
        time=time, pressure=pressure, contraction=contraction, force=np.full(time.size, 100.0)
    )
    result = fit_held_creep([run], law=LAW)
    assert bool(result.elements.stiffnesses) == found
    if found:
        rows = run.rows(time >= 5.0 + motion)
        at = float(np.median(rows["contraction"]))
        slope = (LAW.force(3e5, at + 1e-6) - LAW.force(3e5, at - 1e-6)) / 2e-6  # [N] by contraction
        expected = creep_elements(
            fit_creep(rows, "contraction"),
            step=0.08 * LENGTH,
            stiffness=-float(slope) / LENGTH,
            resting_length=LENGTH,
        )
        assert result.elements.stiffnesses[0] == pytest.approx(expected.stiffnesses[0], rel=0.05)
        assert result.elements.relaxation_times[0] == pytest.approx(
            expected.relaxation_times[0], rel=0.05
        )


def test_the_change_of_volume_by_virtual_work_is_that_of_the_geometry_of_the_law():
    change = volume_change(LAW, LENGTH, (5e4, 5e5), (0.0, 0.2))
    contraction = np.linspace(0.0, 0.2, 7)
    expected = np.asarray(BRAID.volume(contraction)) - float(BRAID.volume(0.0))
    assert change(contraction) == pytest.approx(expected, rel=1e-6, abs=1e-12)


# Dynamic fits


@pytest.mark.parametrize(("correlation", "is_named"), [(0.25, False), (0.36, True), (0.8, True)])
def test_autocorrelated_residuals_are_named_with_the_factor_of_the_standard_errors(
    correlation: float, is_named: bool
):
    random = np.random.default_rng(2)
    count = 200_000
    white = random.standard_normal(count)
    residuals = np.zeros(count)
    for i in range(1, count):
        residuals[i] = correlation * residuals[i - 1] + white[i]
    models = [types.SimpleNamespace(valid=np.ones((count, 1), dtype=bool), names=("pressure",))]
    problem = types.SimpleNamespace(record_models=models, margins=np.zeros(0))
    notes = _describe_model_error(problem, residuals, (), 0)
    assert bool(notes) == is_named
    factor = np.sqrt((1 + correlation) / (1 - correlation))
    assert not is_named or f"too small by a factor of about {factor:.1f}" in notes[0]


def test_searches_within_a_thousandth_of_the_lowest_sum_reached_the_optimum():
    assert searches_at_lowest(np.array([1000.0, 1000.9, 1001.1, 2000.0])) == 2


@pytest.mark.parametrize(
    ("in_muscle", "in_line", "text"),
    [
        (2.1e3, 1e3, "is probably upstream"),
        (1.9e3, 0.9e3, "may be upstream"),
        (2.5e3, 1.3e3, "does not determine"),
    ],
)
def test_a_sensor_is_upstream_if_the_line_fits_twice_as_well_and_the_muscle_misses_two_per_cent(
    in_muscle: float, in_line: float, text: str
):
    assert text in str(SensorLocation(in_muscle, in_line, 1e5))


def test_candidate_records_have_supplies_by_absolute_pressure_and_a_pulse_to_half_of_the_supply():
    supply = 6e5
    conductance = 3e-9
    valve = Valve(conductance, 0.3)
    plant = Plant(
        Muscle.ideal(BRAID),
        FillDischarge(Supply(supply), valve, valve),
        Isometric(0.0),
        Polytropic(1.2),
    )
    times = np.linspace(0.0, 1.0, 20)
    record = recording(time=times, pressure=np.zeros(20))
    experiment = Experiment(
        record, Schedule({"fill": ((0.0, 1.0),)}), InitialConditions.at_coordinates(plant, 0.0)
    )
    context = _Context(plant, experiment, times, ("pressure",), 0.0, frozenset())
    ambient = plant.ambient.pressure
    found = [each.experiment.plant.circuit.supply.pressure + ambient for each in context.supplies()]
    assert found == pytest.approx([0.6 * (supply + ambient), 1.4 * (supply + ambient)])
    choked = (
        conductance * 1e5 * (supply + ambient) / float(BRAID.volume(0.0))
    )  # rise at the ambient temperature [Pa/s]
    _, pulse, *_ = context.valve_records(plant.circuit)
    _, (closed, _) = pulse.experiment.command.changes["fill"]
    assert closed == pytest.approx(0.5 * supply / choked)
    assert 0.02 < closed < 0.5
