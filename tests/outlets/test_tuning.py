"""`study.tune` finds the gains that minimise the objective over all cases, within its budget and
reproducibly.

The optimum is known where a regulator follows a scaled set point: the scale is 1. A set of gains
that fails in a case is worse than all that do not, an interruption keeps the best so far, and
metrics are those of the single run.
"""

from __future__ import annotations

import contextlib
import dataclasses
import pickle
from typing import ClassVar

import numpy as np
import pytest
from called_controller import Called
from control_plants import JOINT, LIFT, MUSCLES, PRESSURE, SPLIT
from plants import chosen_muscle

import airmuscle as am
from airmuscle.control import PID
from airmuscle.core import model, ops, parameter
from airmuscle.design import (
    CaseMetrics,
    IntegralAbsoluteError,
    IntegralTimeAbsoluteError,
    LoopCase,
    Perturbations,
    RobustObjective,
    RootMeanSquareError,
    perturbed_family,
    tune,
)
from airmuscle.design.tuning.optimisation import EvolutionStrategy
from airmuscle.engine import ColumnSensor, ControlLaw, ControlLoop, Schedule, WithSensors
from airmuscle.errors import ColumnError, ParameterError, SimulationError
from airmuscle.files.library import ParameterUncertainty
from airmuscle.physics import (
    HangingMass,
    Isometric,
    MuscleRoute,
    Plant,
    ProportionalRegulator,
    SecondOrderLag,
    SerialArm,
    SpatialLink,
    Supply,
    Valve,
)

STEPS = Schedule({"pressure": ((0, 1e5), (0.1, 2e5))})
LOOP = ControlLoop(PRESSURE, 0.01, STEPS)
START = am.find_equilibrium(LIFT, pressure=1e5)
NOMINAL = LoopCase("nominal", LIFT, LOOP, START)
HEAVY_PLANT = dataclasses.replace(LIFT, mechanism=HangingMass(4.0))
HEAVY = LoopCase("heavy", HEAVY_PLANT, LOOP, am.find_equilibrium(HEAVY_PLANT, pressure=1e5))
BOUNDS = {"gain": (1e-6, 1e-4), "integral_time": (0.05, 5.0)}


@model
class ScaledSetpoint(ControlLaw):
    """The set point times a scale is the command of a regulator; above a limit the command is not a
    number.
    """

    from_file: ClassVar[bool] = False

    scale: float = parameter("1", "a", "scale", bounds=(0.1, 10.0))
    limit: float = parameter("1", "l", "largest scale", default=1e9)
    measured_columns = setpoints = ("pressure",)
    inputs = ("setpoint",)
    initial_memory: ClassVar = {}

    def step(self, memory, measurement, dt):
        root = ops.sqrt(self.limit - self.scale)
        return {
            "setpoint": self.scale * measurement.setpoints["pressure"] * root / (root + 1e-12)
        }, {}


REGULATOR = ProportionalRegulator(
    Supply(6e5), Valve(2e-7, 0.3), Valve(2e-7, 0.3), SecondOrderLag(50.0, 0.8), 1e3
)
REGULATED = Plant(chosen_muscle(), REGULATOR, Isometric(0.05))


def regulated(scale=3.0, limit=1e9):
    loop = ControlLoop(ScaledSetpoint(scale, limit), 0.02, Schedule({"pressure": ((0, 2e5),)}))
    return LoopCase("regulated", REGULATED, loop, am.find_equilibrium(REGULATED, pressure=2e5))


def small(**options):
    return tune([NOMINAL, HEAVY], BOUNDS, duration=0.3, **{"simulations": 64, "seed": 3, **options})


# Optimum, seed, budget


def test_the_known_optimum_is_found():
    tuning = tune([regulated()], {"scale": (0.3, 8.0)}, duration=0.3, simulations=160)
    assert tuning.gains["scale"] == pytest.approx(1.0, rel=0.02)
    assert tuning.loop.controller.scale == tuning.gains["scale"]
    assert tuning.objective < 0.02 * tuning.present_objective
    assert not tuning.on_bound
    best = tuning.history.best_so_far
    assert (np.diff(best) <= 0).all()
    assert best[-1] == tuning.objective == tuning.history.objective.min()


def test_the_same_seed_gives_the_same_search_and_another_seed_another_one():
    first = small()
    second = small()
    other = small(seed=4)
    np.testing.assert_array_equal(first.history.gains, second.history.gains)
    np.testing.assert_array_equal(first.history.objective, second.history.objective)
    assert not np.array_equal(first.history.gains, other.history.gains)


def test_the_budget_is_an_upper_bound_and_progress_counts_loops():
    seen = []
    tuning = small(simulations=90, progress=lambda done, total: seen.append((done, total)))
    assert seen == [
        (32, 90),
        (48, 90),
        (64, 90),
        (80, 90),
    ], "a first generation of 16 sets, then 8 sets each"
    assert tuning.simulated_loops == 80 == 2 * len(tuning.history)
    assert not tuning.interrupted
    assert not tuning.converged


def test_a_search_ends_where_two_descents_agree():
    tuning = tune([regulated()], {"scale": (0.3, 8.0)}, duration=0.1, simulations=4000)
    assert tuning.converged
    assert tuning.simulated_loops < 600
    assert tuning.gains["scale"] == pytest.approx(1.0, rel=1e-3)


def test_the_evolution_strategy_finds_the_minimum_of_a_rotated_narrow_valley():
    """A condition of 1e4, and an optimum on the surface of the cube."""
    rotation, _ = np.linalg.qr(np.random.default_rng(2).standard_normal((4, 4)))
    optimum = np.array([0.3, 0.6, 0.5, 0.4])
    scales = np.array([1.0, 4.6, 21.5, 100.0])
    strategy = EvolutionStrategy(np.full(4, 0.9), np.random.default_rng(1))
    for _ in range(150):
        points = strategy.ask()
        strategy.tell(points, (((points - optimum) @ rotation * scales) ** 2).sum(axis=1))
    assert strategy.mean == pytest.approx(optimum, abs=1e-4)
    assert strategy.width < 1e-3
    outside = EvolutionStrategy(np.full(2, 0.5), np.random.default_rng(1))
    for _ in range(40):
        points = outside.ask()
        assert points.min() >= 0.0
        assert points.max() <= 1.0
        outside.tell(points, points @ [1.0, -1.0])
    assert outside.mean == pytest.approx([0.0, 1.0], abs=1e-2)


def test_the_result_is_never_worse_than_the_present_gains_or_a_start():
    tuning = small(start=[{"gain": 5e-5}, {"gain": 2e-5, "integral_time": 0.1}])
    present, first, second = tuning.history.gains[:3]
    assert present.tolist() == [PRESSURE.gain, PRESSURE.integral_time]
    assert first.tolist() == [5e-5, PRESSURE.integral_time]
    assert second.tolist() == [2e-5, 0.1]
    assert tuning.objective <= tuning.history.objective[:3].min()
    outside = tune([NOMINAL], {"gain": (1e-4, 1e-3)}, duration=0.3, simulations=16)
    assert outside.present_objective is None


def test_gains_are_written_with_five_digits_within_their_bounds():
    low = 1.23456789e-6
    high = 9.87654321e-5
    gains = tune([NOMINAL], {"gain": (low, high)}, duration=0.1, simulations=32).history.gains[
        1:, 0
    ]
    assert ((gains >= low) & (gains <= high)).all()
    inner = gains[(gains > low) & (gains < high)]
    assert [float(f"{value:.4e}") for value in inner] == inner.tolist()


# Failures and interruption


def test_gains_that_fail_are_worse_than_all_others():
    tuning = tune([regulated(1.5, limit=2.0)], {"scale": (0.3, 8.0)}, duration=0.1, simulations=64)
    failed = tuning.history.gains[:, 0] > 2.0
    assert failed.any()
    assert np.isinf(tuning.history.objective[failed]).all()
    assert np.isfinite(tuning.history.objective[~failed]).all()
    assert tuning.gains["scale"] == pytest.approx(1.0, rel=0.05)


def test_gains_that_all_fail_are_an_error_with_the_reason():
    with pytest.raises(
        SimulationError, match=r"each of 8 sets of gains fails .* a command that is not finite"
    ):
        tune([regulated(3.0, limit=2.0)], {"scale": (2.5, 8.0)}, duration=0.1, simulations=8)


def test_an_unstable_range_is_avoided():
    """With a dead time of eight samples a large gain oscillates between both valves; the tuned gain
    does not.
    """
    law = WithSensors(PRESSURE, (ColumnSensor("pressure", delay=8),))
    case = LoopCase("delay", LIFT, dataclasses.replace(LOOP, controller=law), START, "law")
    tuning = tune(
        [case],
        {"gain": (1e-6, 1e-3)},
        duration=1.0,
        simulations=64,
        index=RootMeanSquareError(begin=0.5),
    )
    gains = tuning.history.gains[:, 0]
    index = tuning.history.means("index")
    assert index[gains.argmax()] > 5 * index[tuning.best]
    assert tuning.gains["gain"] < 0.3 * gains.max()


def test_an_interruption_keeps_the_best_so_far():
    def stop(done, total):
        if done >= 32:
            raise KeyboardInterrupt

    tuning = small(progress=stop)
    complete = small()
    assert tuning.interrupted
    np.testing.assert_array_equal(tuning.history.objective, complete.history.objective[:16])
    assert tuning.objective == complete.history.objective[:16].min()

    def at_once(metrics):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        small(objective=at_once)


# Cases


def test_metrics_are_those_of_the_single_run():
    tuning = small(simulations=16)
    gains = dict(zip(tuning.history.paths, tuning.history.gains[5].tolist(), strict=True))
    loop = dataclasses.replace(LOOP, controller=dataclasses.replace(PRESSURE, **gains))
    run = am.simulate(
        HEAVY.plant, loop, duration=0.3, initial_state=HEAVY.initial_state, output_times=0.01
    )
    time, first = np.unique(run["time"], return_index=True)
    error = (run["setpoint.pressure"] - run["pressure"])[first]
    metrics = tuning.history.metrics
    assert metrics.index[5, 1] == pytest.approx(
        np.sqrt(np.trapezoid(error**2, time) / 0.3), rel=1e-9
    )
    grown = np.diff(run["air_mass"][first])
    assert metrics.air[5, 1] == pytest.approx(grown[grown > 0].sum() / 0.3, rel=1e-9)
    travel = sum(
        np.abs(np.diff(run[f"command.{name}"][first])).sum() for name in ("fill", "discharge")
    )
    assert metrics.travel[5, 1] == pytest.approx(travel / 0.3)


def test_the_travel_of_a_set_point_is_counted_in_its_range():
    case = dataclasses.replace(regulated(1.0), initial_state=None)
    steps = Schedule({"pressure": ((0, 0.0), (0.05, 2e5), (0.15, 1e5))})
    case = dataclasses.replace(case, loop=dataclasses.replace(case.loop, setpoint=steps))
    metrics = tune([case], {"scale": (0.3, 8.0)}, duration=0.3, simulations=8).history.metrics
    assert metrics.travel[0, 0] == pytest.approx((2e5 + 1e5) / REGULATOR.max_setpoint / 0.3)


def test_cases_of_several_kinds_share_one_controller():
    leaking = perturbed_family(
        LIFT, LOOP, Perturbations((), (), 0.02, 0, 0), initial_state=lambda plant: START
    )
    law = WithSensors(PRESSURE, (ColumnSensor("pressure", delay=1),))
    delayed = LoopCase("delay", LIFT, dataclasses.replace(LOOP, controller=law), START, "law")
    family = [NOMINAL, leaking.cases[1], HEAVY, delayed]
    tuning = tune(family, BOUNDS, duration=0.3, simulations=32)
    for i, case in enumerate(family):
        alone = tune([case], BOUNDS, duration=0.3, simulations=8)
        assert alone.history.metrics.index[0, 0] == tuning.history.metrics.index[0, i]
    assert np.unique(tuning.history.metrics.index[0]).size == 4


def test_a_controller_that_is_called_from_python_is_tuned_alike():
    called = LoopCase("called", LIFT, dataclasses.replace(LOOP, controller=Called(PRESSURE)), START)
    bounds = {f"inner.{name}": pair for name, pair in BOUNDS.items()}
    first = tune([called], bounds, duration=0.2, simulations=16)
    second = tune([NOMINAL], BOUNDS, duration=0.2, simulations=16)
    np.testing.assert_allclose(first.history.objective, second.history.objective, rtol=1e-9)


def test_the_family_is_the_nominal_plant_and_one_case_for_each_perturbation():
    family = perturbed_family(LIFT, LOOP, Perturbations(draws=0))
    names = [case.name for case in family.cases]
    assert names == ["nominal", "load x 0.5", "load x 2", "supply x 0.8", "leak", "delay 1"]
    by_name = {case.name: case.plant for case in family.cases}
    assert by_name["nominal"] is LIFT
    assert by_name["load x 2"].mechanism.mass == 2 * LIFT.mechanism.mass
    assert by_name["supply x 0.8"].circuit.supply.pressure == pytest.approx(
        0.8 * LIFT.circuit.supply.pressure
    )
    assert by_name["leak"].circuit.leak.conductance == pytest.approx(
        0.01 * LIFT.circuit.fill.conductance
    )
    assert family.cases[-1].controller == PRESSURE
    joint = perturbed_family(
        JOINT,
        dataclasses.replace(
            LOOP,
            controller=PID("angle", "left.fill", gain=1.0),
            setpoint=Schedule({"angle": ((0, 0.0),)}),
        ),
        Perturbations(draws=0, delay=0),
    )
    heavy = joint.cases[2].plant.mechanism
    assert (heavy.inertia, heavy.weight_torque) == (
        2 * JOINT.mechanism.inertia,
        2 * JOINT.mechanism.weight_torque,
    )
    assert joint.cases[2].plant.muscles == MUSCLES


def test_the_load_of_an_arm_without_masses_is_its_inertia():
    """An identified joint has all its inertia about its axis: cases with another load were copies
    of the nominal one.
    """
    routes = (MuscleRoute((1,), (0.03,)), MuscleRoute((1,), (-0.03,)))
    arm = dataclasses.replace(
        JOINT, mechanism=SerialArm((SpatialLink((0, 0, 1), rotor_inertia=0.1),), routes)
    )
    loop = ControlLoop(
        PID("joint1.angle", "left.fill", gain=1.0), 0.01, Schedule({"joint1.angle": ((0, 0.0),)})
    )
    family = perturbed_family(arm, loop, Perturbations(supplies=(), leak=0.0, draws=0, delay=0))
    assert [case.plant.mechanism.links[0].rotor_inertia for case in family.cases] == [
        0.1,
        0.05,
        0.2,
    ]


def test_a_perturbation_that_the_plant_does_not_have_is_noted():
    case = regulated()
    family = perturbed_family(
        case.plant, dataclasses.replace(case.loop, controller=Called(case.loop.controller))
    )
    assert [each.name for each in family.cases] == ["nominal", "supply x 0.8", "leak"]
    assert [note.partition(":")[0] for note in family.notes] == [
        "no case with another load",
        "no drawn parameters",
        "no case with a delay",
    ]


def test_drawn_parameters_have_the_covariance_of_the_fit_and_are_equal_in_muscles_of_one_fit():
    contractile = MUSCLES[0].contractile
    c = [leaf.path for leaf in am.core.leaves(contractile)][:2]
    values = [leaf.value for leaf in am.core.leaves(contractile)][:2]
    errors = tuple(0.01 * abs(value) for value in values)
    fit = ParameterUncertainty(
        tuple(f"characteristic.{name}" for name in c), errors, ((1.0, 0.6), (0.6, 1.0))
    )
    loop = ControlLoop(PID("angle", "left.fill", gain=1.0), 0.01, Schedule({"angle": ((0, 0.0),)}))
    options = Perturbations((), (), 0.0, 0, 120)
    family = perturbed_family(
        JOINT, loop, options, initial_state=lambda plant: {}, uncertainties=[fit, fit], seed=2
    )
    drawn = np.array(
        [
            [leaf.value for leaf in am.core.leaves(case.plant.muscles[0].contractile)][:2]
            for case in family.cases[1:]
        ]
    )
    scaled = (drawn - values) / np.array(errors)
    assert np.cov(scaled.T) == pytest.approx(np.array([[1.0, 0.6], [0.6, 1.0]]), abs=0.25)
    for case in family.cases[:5]:
        assert case.plant.muscles[0].contractile == case.plant.muscles[1].contractile
    again = perturbed_family(
        JOINT, loop, options, initial_state=lambda plant: {}, uncertainties=[fit, fit], seed=2
    )
    assert again.cases[7].plant == family.cases[7].plant


# Indices, objective, Pareto front


def test_indices_are_the_integrals_of_their_definitions():
    time = np.linspace(0.0, 2.0, 2001)
    columns = {"y": np.stack([1.0 - time, 0.0 * time]), "setpoint.y": np.ones((2, time.size))}
    for index, expected in (
        (RootMeanSquareError(), (np.sqrt(4 / 3), 1.0)),
        (IntegralAbsoluteError(), (2.0, 2.0)),
        (IntegralTimeAbsoluteError(), (8 / 3, 2.0)),
        (IntegralAbsoluteError(begin=1.0), (1.5, 1.0)),
        (IntegralAbsoluteError({"y": 4.0}), (0.5, 0.5)),
    ):
        scales = index.scales_for(("y",), ("y", "x"))
        assert index.values(time, columns, scales) == pytest.approx(expected, rel=1e-5)


def test_the_objective_is_the_mean_and_a_quantile_over_the_cases():
    index = np.array([[1.0, 2.0, 6.0], [1.0, np.inf, 1.0]])
    ones = np.ones((2, 3))
    metrics = CaseMetrics(index, 2 * ones, 3 * ones, np.isfinite(index))
    assert RobustObjective(1.0, 0.5)(metrics).tolist() == [3.0 + 0.5 * 6.0, np.inf]
    assert RobustObjective(0.5, 1.0, 10.0, 100.0)(metrics)[0] == pytest.approx(
        3.0 + 2.0 + 20.0 + 300.0
    )


def test_another_objective_is_a_function_of_the_metrics():
    least_air = small(objective=lambda metrics: metrics.air.max(axis=1))
    assert (
        least_air.history.metrics.air[least_air.best].max()
        <= small().history.metrics.air.max(axis=1).min() * 1.001
    )


def test_no_set_of_gains_surpasses_the_pareto_front():
    history = small(simulations=128).history
    error = history.means("index")
    air = history.means("air")
    front = history.pareto("air")
    assert front.size >= 2
    assert (np.diff(error[front]) >= 0).all()
    for i in front:
        assert not (
            (error <= error[i]) & (air <= air[i]) & ((error < error[i]) | (air < air[i]))
        ).any()
    with pytest.raises(ColumnError, match=r"no metric 'airs'.*Did you mean 'air'"):
        history.pareto("airs")


# Bad input


@pytest.mark.parametrize(
    ("bounds", "message"),
    [
        ({}, "they are empty"),
        ([("gain", 1)], "give a range for each gain"),
        ({"gian": (1, 2)}, "no parameter 'gian'.*Did you mean 'gain'"),
        ({"gain": 3.0}, r"'gain' \(K, proportional gain\) is 3.0; give two numbers"),
        ({"gain": (2.0, 1.0)}, "is 2 to 1; the minimum must be below the maximum"),
        ({"gain": (0.0, float("inf"))}, "both finite"),
        ({"gain": (float("nan"), 1.0)}, "both finite"),
        ({"integral_time": (-1.0, 1.0)}, r"is -1 to 1; allowed range: 0 to 1e\+06"),
    ],
)
def test_bad_bounds_are_refused(bounds, message):
    with pytest.raises(ParameterError, match=message):
        tune([NOMINAL], bounds, duration=0.3)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"duration": 0.0}, "duration is 0.0 s; it must be positive"),
        ({"duration": float("nan")}, "duration is nan"),
        (
            {"simulations": 15},
            "simulations is 15; .* at least 16, 8 sets of gains for each of 2 cases",
        ),
        ({"simulations": 1e3}, "simulations is 1000.0; it must be a whole number"),
        ({"seed": -1}, "seed is -1"),
        ({"index": "rmse"}, "give a TrackingIndex"),
        ({"objective": "robust"}, "give RobustObjective"),
        (
            {"objective": lambda metrics: 1.0},
            r"the objective returned \(\); it must return \(16,\)",
        ),
        ({"start": [{"gian": 1.0}]}, "start 0 names 'gian'"),
        (
            {"start": [{"gain": 1.0}], "workers": 0},
            "start 0 is outside the bounds",
        ),  # before a process is started
        ({"start": [{"gain": 1e-5}] * 20}, "20 starts; at most"),
        ({"index": RootMeanSquareError(begin=0.5)}, "fewer than two samples follow begin"),
    ],
)
def test_bad_options_are_refused(options, message):
    with pytest.raises(ParameterError, match=message):
        tune([NOMINAL, HEAVY], BOUNDS, **{"duration": 0.3, "simulations": 64, **options})


def test_bad_cases_are_refused():
    other = dataclasses.replace(LOOP, controller=PID("pressure", "fill", gain=1.0))
    for cases, message in (
        ([], "are empty; give a list of LoopCase"),
        ([LIFT], "give a list of LoopCase"),
        ([NOMINAL, NOMINAL], "two cases are named 'nominal'"),
        ([NOMINAL, LoopCase("other", LIFT, other)], "all cases need the same controller"),
        ([LoopCase("none", LIFT, LOOP, None, "law")], "has no controller at 'law'"),
        (
            [LoopCase("angle", JOINT, LOOP)],
            "case 'angle': PID measures 'pressure', which the plant does not have",
        ),
    ):
        with pytest.raises(ParameterError, match=message):
            tune(cases, BOUNDS, duration=0.3)
    with pytest.raises(
        ParameterError, match=r"LoopCase: plant must be an instance of Plant; it is "
    ):
        LoopCase("a", SPLIT, LOOP)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: Perturbations(loads=(1.0,)),
            "loads contains 1; a factor must be positive, finite and not 1",
        ),
        (lambda: Perturbations(supplies=(float("nan"),)), "supplies contains nan"),
        (lambda: Perturbations(leak=2.0), "leak is 2.0; allowed range: 0 to 1"),
        (lambda: Perturbations(delay=0.5), "delay must be an integer; it is 0.5"),
        (lambda: RobustObjective(quantile=2.0), "quantile is 2.0; allowed range: 0 to 1"),
        (lambda: RobustObjective(air_weight=-1.0), "air_weight is -1.0"),
        (lambda: RootMeanSquareError({"y": 0.0}), "scale of 'y' is 0.0; it must be positive"),
        (lambda: RootMeanSquareError(begin=-1.0), "begin is -1.0 s"),
        (
            lambda: RootMeanSquareError({"z": 1.0}).scales_for(("y",), ("y", "x")),
            "'z' is not both a set point and",
        ),
        (
            lambda: RootMeanSquareError().scales_for(("y", "x"), ("y", "x")),
            "y and x can be compared .* state scales",
        ),
        (
            lambda: perturbed_family(LIFT, LOOP, Perturbations(loads=(1e9,))),
            "load x 1e[+]09.*allowed range",
        ),
        (
            lambda: perturbed_family(LIFT, LOOP, uncertainties=[None, None]),
            "2 uncertainties for 1 muscles",
        ),
    ],
)
def test_impossible_settings_are_refused(make, message):
    with pytest.raises(ParameterError, match=message):
        make()


def test_the_report_states_index_and_objective_in_words():
    assert (
        str(RobustObjective(air_weight=100.0))
        == "mean + 1 x 0.9 quantile of the index + 100 x mean air drawn [kg/s]"
    )
    assert str(RobustObjective(quantile=1.0)) == "mean + 1 x 1 quantile of the index"
    assert (
        str(RootMeanSquareError({"angle": 0.1}, begin=0.5))
        == "RootMeanSquareError, angle divided by 0.1 (SI), from 0.5 s"
    )


def test_a_tuning_shows_its_gains_in_their_units_and_the_response_of_the_nominal_case():
    tuning = pickle.loads(pickle.dumps(small(simulations=16)))
    gains, *_ = tuning.chapter().tables
    assert list(gains.columns["unit"].values) == ["1/Pa", "s"]
    assert str(tuning).startswith(f"Tuning of {type(PRESSURE).__name__}\n16 loops were simulated")
    assert "<img" in tuning._repr_html_()
    (axis,) = tuning.chapter().plots[-1].draw().axes
    assert [line.get_label() for line in axis.get_lines()] == [
        "present gains",
        "tuned gains",
        "set point",
    ]


def test_further_local_processes_are_started_where_they_shorten_the_search(monkeypatch):
    """Compiled loops use all cores of one process; a controller that is called from Python one."""
    asked = []

    def record(workers):
        asked.append(workers)
        return contextlib.nullcontext(None)

    monkeypatch.setattr("airmuscle.design.tuning.optimisation.process_pool", record)
    called = ControlLoop(Called(PRESSURE), 0.01, STEPS)
    cases = {
        1: (LoopCase("compiled", LIFT, LOOP, START), BOUNDS),
        2: (LoopCase("called", LIFT, called, START), {"inner.gain": (1e-6, 1e-4)}),
    }
    for expected, (case, bounds) in cases.items():
        tune([case], bounds, duration=0.05, simulations=8, workers=2)
        assert asked.pop() == expected
