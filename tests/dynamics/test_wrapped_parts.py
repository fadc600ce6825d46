"""Every option of a wrapped part is honoured or refused by what wraps it.

Over all pairs: an estimator that uses a filter, a control law around another one, a mechanism
around another one. A number of the part inside that changes nothing would be an option that is
ignored in silence.
"""

from __future__ import annotations

import dataclasses
import inspect
import warnings

import numpy as np
import pytest

import airmuscle as am
from airmuscle.control import (
    PID,
    ExtendedKalmanFilter,
    GainSchedule,
    HysteresisCompensation,
    InverseHysteresisOperator,
    MovingHorizonEstimator,
    Multirate,
    ProportionalFeedback,
    RepetitiveControl,
    SmithPredictor,
    WithCommandDelay,
    WithFilter,
    WithManual,
    WithRateLimit,
    WithSetpointDelay,
    WithStuckValve,
)
from airmuscle.core import StateVariable, System, leaves, unflatten
from airmuscle.engine import ColumnSensor, LawDesign, SigmaDelta, WithSensors
from airmuscle.errors import AirmuscleWarning, ParameterError
from airmuscle.physics import (
    AntagonisticJoint,
    GaussianResidual,
    HangingMass,
    HuntCrossley,
    JointWithEndStops,
    JointWithExternalTorque,
    JointWithFriction,
    MechanismWrapper,
    MusclesInSeries,
    StickSlip,
    WithEndStops,
    WithLatch,
    WithOffsets,
    WithStickSlip,
)

H = 0.1


class Oscillator(System):
    """x'' = u - k x - 0.4 x'."""

    states = (StateVariable("position", "m", 1.0), StateVariable("speed", "m/s", 1.0))
    inputs = ("force",)

    def rates(self, state, inputs):
        return {
            "position": state["speed"],
            "speed": inputs["force"] - 4.0 * state["position"] - 0.4 * state["speed"],
        }

    def outputs(self, state, inputs):
        return {"sum": state["position"] + 0.5 * state["speed"]}


FILTER = ExtendedKalmanFilter(
    Oscillator(), ("sum",), H, {"position": 0.05, "speed": 0.3}, {"sum": 0.2}, gate=0.999
)
DEVIATIONS = {"position": 0.5, "speed": 0.7}


def record(rows=60, outliers=0.1, sample_time=H, shift=0.0):
    """Measurements of the oscillator at rest, a part of which is wrong by 60 standard deviations."""
    random = np.random.default_rng(7)
    values = 0.2 * random.normal(size=rows) + shift
    values[random.random(rows) < outliers] += 12.0
    values[[4, 5, 20]] = np.nan
    time = sample_time * np.arange(rows)
    return am.Recording({"time": time, "force": 0.0 * time, "sum": values}, "test")


def estimated(estimator, record, state=(("position", 0.2), ("speed", -0.1))):
    judged = getattr(estimator, "filter", estimator)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        return estimator.estimate(record, judged.start(dict(state), DEVIATIONS))


@pytest.mark.parametrize("horizon", [1, 8])
def test_the_moving_horizon_without_bounds_is_the_gated_filter(horizon):
    found = estimated(MovingHorizonEstimator(FILTER, horizon), record())
    exact = estimated(FILTER, record())
    for name in exact:
        assert found[name] == pytest.approx(exact[name], abs=1e-9)
    assert found["rejected"].sum() > 3
    free = estimated(dataclasses.replace(FILTER, gate=1.0), record())
    assert "rejected" not in free
    assert np.abs(free["position"]).max() > 3.0 * np.abs(exact["position"]).max()


class Stiffer(Oscillator):
    def rates(self, state, inputs):
        rates = super().rates(state, inputs)
        return {**rates, "speed": rates["speed"] - 2.0 * state["position"]}


OPTIONS = {
    "plant": Stiffer(),
    "measured": ("position",),
    "sample_time": 0.5 * H,
    "process_noise": {"position": 0.1, "speed": 0.6},
    "measurement_noise": {"sum": 0.4},
    "parameters": ("stiffness",),
    "disturbances": ("speed",),
    "gate": 1.0,
}
"""Another value of every field of a filter."""


def test_every_option_of_a_filter_is_one_of_the_moving_horizon_estimator():
    fields = {field.name for field in dataclasses.fields(FILTER) if field.init}
    assert fields == OPTIONS.keys()
    plain = estimated(MovingHorizonEstimator(FILTER, 4), record())
    for option in fields - {"parameters"}:  # of a plant with parameters, in test_nonlinear_filters
        changes = {option: OPTIONS[option]}
        if option == "measured":
            changes["measurement_noise"] = {"position": 0.2}
        if option == "disturbances":
            changes["process_noise"] = {**FILTER.process_noise, "speed.disturbance": 0.1}
        judged = dataclasses.replace(FILTER, **changes)
        rows = record()
        rows = am.Recording({**{n: rows[n] for n in rows.columns}, "position": rows["sum"]}, "test")
        found = estimated(MovingHorizonEstimator(judged, 4), rows)
        exact = estimated(judged, rows)
        assert not np.allclose(found["position"], plain["position"]), option
        for name in exact:
            assert found[name] == pytest.approx(exact[name], abs=1e-9), option


@pytest.mark.parametrize("wrap", [lambda f: f, lambda f: MovingHorizonEstimator(f, 5)])
def test_a_gate_that_locks_out_a_wrong_start_says_so_and_the_remedy_works(wrap):
    rows = record(outliers=0.0, shift=2.0)
    start = FILTER.start({"position": -6.0, "speed": 0.0}, {"position": 0.01, "speed": 0.01})
    judged = dataclasses.replace(FILTER, process_noise={"position": 1e-3, "speed": 1e-3})
    with pytest.warns(AirmuscleWarning, match=r"rejected \d+ of 60 rows, \d+ of them one after"):
        found = wrap(judged).estimate(rows, start)
    assert found["rejected"].sum() >= 10
    wide = FILTER.start({"position": -6.0, "speed": 0.0}, {"position": 10.0, "speed": 10.0})
    noisy = dataclasses.replace(FILTER, process_noise={"position": 0.3, "speed": 3.0})
    with warnings.catch_warnings():
        warnings.simplefilter("error", AirmuscleWarning)
        assert wrap(noisy).estimate(rows, wide)["rejected"].sum() < 3


# Control laws


def pid(**changes):
    return PID(
        "position",
        "fill",
        **{"gain": 0.7, "integral_time": 0.3, "derivative_time": 0.05, **changes},
    )


WRAPPED = {
    WithSensors: lambda law: WithSensors(
        law, (ColumnSensor("position", lag=0.05, noise=0.02, delay=1),)
    ),
    WithSetpointDelay: lambda law: WithSetpointDelay(law, 2),
    Multirate: lambda law: Multirate(law, 2),
    WithCommandDelay: lambda law: WithCommandDelay(law, 1),
    WithRateLimit: lambda law: WithRateLimit(law, (5.0,)),
    WithManual: WithManual,
    WithStuckValve: lambda law: WithStuckValve(law, "fill", 0.7 if isinstance(law, PID) else 1.5),
    WithFilter: lambda law: WithFilter.lead_lag(law, "position", 0.02, 0.05),
    RepetitiveControl: lambda law: RepetitiveControl(law, "position", 6, 1, gain=0.2),
    SmithPredictor: lambda law: SmithPredictor(law, "position", "fill", 3, 0.4, 0.2),
    GainSchedule: lambda law: GainSchedule(
        law, scheduled_of(law), "position", (-1.0, 0.4, 1.0), (0.3, 0.9, 0.5)
    ),
    HysteresisCompensation: lambda law: HysteresisCompensation(
        law, "fill", InverseHysteresisOperator((0.0, 0.05), (1.0, 0.4))
    ),
    SigmaDelta: SigmaDelta,
}


def scheduled_of(law):
    return next(
        leaf.path for leaf in leaves(law) if leaf.path.rpartition(".")[2] in ("setpoint_weight",)
    )


def responses(law, samples=40):
    """Commands and memory (samples, n) for measurements and set points that reach all limits."""
    memory = law.init()
    random = np.random.default_rng(3)
    ranges = dict.fromkeys(law.inputs, (0.0, 1.0))
    rows = []
    for _ in range(samples):
        columns = {name: random.uniform(-1.0, 1.0) for name in law.measured_columns}
        setpoints = {name: random.uniform(-1.5, 2.0) for name in law.setpoints}
        setpoints |= {name: 0.0 for name in setpoints if name == "manual"}
        commands, memory = law.step(memory, am.engine.Measurement(columns, setpoints, ranges), 0.05)
        rows.append([float(value) for value in (*commands.values(), *memory.values())])
    return np.array(rows)


def changed(part, index):
    """A part with another value of one of its parameters."""
    numbers = [leaf.value for leaf in leaves(part)]
    numbers[index] = 0.6 * numbers[index] if numbers[index] else 0.3
    return unflatten(part, numbers)


@pytest.mark.parametrize("inner", WRAPPED, ids=lambda kind: kind.__name__)
@pytest.mark.parametrize("outer", WRAPPED, ids=lambda kind: kind.__name__)
def test_a_number_of_a_law_changes_what_the_law_around_it_commands(outer, inner):
    """Unless it changes nothing of the law alone either, such as a tracking time of a PID that is
    not limited.
    """
    part = WRAPPED[inner](pid())
    whole = WRAPPED[outer](part)
    alone = responses(part)
    plain = responses(whole)
    for index, leaf in enumerate(leaves(part)):
        other = changed(part, index)
        if np.allclose(responses(other), alone, rtol=1e-9, atol=1e-12):
            continue
        if outer is GainSchedule and leaf.path == scheduled_of(part):
            continue  # the schedule replaces it
        found = responses(WRAPPED[outer](other))
        assert not np.allclose(found, plain, rtol=1e-9, atol=1e-12), leaf.path


@pytest.mark.parametrize("outer", WRAPPED, ids=lambda kind: kind.__name__)
def test_the_law_around_another_one_passes_on_what_that_one_states(outer):
    """Set points that are attained, units of signals, and why a law has no linearisation."""
    law = ProportionalFeedback(("position",), ("fill",), gain=2.0)
    if outer is GainSchedule:
        whole = GainSchedule(law, "gain", "position", (-1.0, 1.0), (2.0, 2.0))
    else:
        whole = WRAPPED[outer](law)
    measured = am.engine.Measurement(
        {"position": 0.1}, dict.fromkeys(whole.setpoints, 0.9), {"fill": (0.0, 1.0)}
    )
    commands = {"fill": 1.0}
    assert whole.attained(measured, commands) == law.attained(measured, commands)
    assert whole.measured_columns == law.measured_columns
    assert set(law.setpoints) <= set(whole.setpoints)


def test_every_law_around_another_one_is_in_these_tests():
    (enclosing,) = WithSensors.__bases__
    names = (*am.control.__all__, *am.engine.__all__)
    known = [getattr(am.control, n, getattr(am.engine, n, None)) for n in names]
    kinds = {kind for kind in known if inspect.isclass(kind) and issubclass(kind, enclosing)}
    assert kinds - {LawDesign} == set(WRAPPED)


# Mechanisms

JOINT = AntagonisticJoint(radius=0.02, inertia=0.02, damping=0.05, weight_torque=0.5, offset=0.08)
CONTACT = HuntCrossley(1e6)
RESIDUAL = GaussianResidual(("m0.pressure",), (0.5,), (1e5,), (0.1, 2.0), (0.6,), (0.3,))
AROUND = {
    WithLatch: lambda inner, pulls: WithLatch(inner),
    WithOffsets: lambda inner, pulls: WithOffsets(inner, (0.01, 0.02)[:pulls]),
    JointWithFriction: lambda inner, pulls: JointWithFriction(inner, 0.2, 0.5),
    JointWithExternalTorque: lambda inner, pulls: JointWithExternalTorque(inner),
    JointWithEndStops: lambda inner, pulls: JointWithEndStops(inner, -0.3, 0.1, 0.05, CONTACT),
    WithStickSlip: lambda inner, pulls: WithStickSlip(
        inner, (StickSlip(0.3, (1e-3, 2e-3)[:pulls]),), RESIDUAL
    ),
    WithEndStops: lambda inner, pulls: WithEndStops(
        inner, -0.3, 0.1, CONTACT, own_coordinate(inner)
    ),
    MusclesInSeries: lambda inner, pulls: MusclesInSeries(inner, (0.5,), 1.0),
}
"""Wrappers of a mechanism that is pulled by a number of muscles."""


def own_coordinate(inner):
    """The last coordinate: that of the load, behind the nodes of muscles in series."""
    return inner.coordinates[-1].name


def answers(mechanism):
    """All that a plant asks a mechanism, in contact and with a bent bristle."""
    q = {c.name: 0.2 + 0.05 * i for i, c in enumerate(mechanism.coordinates)}
    q |= {state.name: 0.3 for state in mechanism.inner_states}
    q["m0.pressure"] = 1.3e5
    v = {c.speed: 0.4 + 0.1 * i for i, c in enumerate(mechanism.coordinates)}
    inputs = {each.name: 0.5 for each in mechanism.inputs}
    count = mechanism.muscle_count or 1
    lengths = [0.3, 0.32, 0.34][:count]
    forces = mechanism.generalised_forces(q, [200.0, 150.0, 120.0][:count], lengths)
    return np.array(
        [
            *mechanism.contractions(q, lengths),
            *mechanism.contraction_speeds(q, v, lengths),
            *forces.values(),
            *mechanism.acceleration(q, v, forces, inputs).values(),
            *mechanism.inner_rates(q, v, forces).values(),
            mechanism.dissipated_power(q, v, forces, inputs),
            *(
                x
                for store in mechanism.energy_accounts(q, v, forces, inputs).values()
                for x in store
            ),
            mechanism.potential_energy(q),
            mechanism.kinetic_energy(q, v),
        ],
        dtype=float,
    )


@pytest.mark.parametrize("inner", AROUND, ids=lambda kind: kind.__name__)
@pytest.mark.parametrize("outer", AROUND, ids=lambda kind: kind.__name__)
def test_a_number_of_a_mechanism_changes_what_the_one_around_it_answers(outer, inner):
    """On a joint of two muscles and on a load of one; a pair that does not fit is refused."""
    accepted = 0
    for base, pulls in ((JOINT, 2), (HangingMass(5.0), 1)):
        try:
            part = AROUND[inner](base, pulls)
            whole = AROUND[outer](part, part.muscle_count or 1)
        except ParameterError:
            continue
        accepted += 1
        plain = answers(whole)
        alone = answers(part)
        for index, leaf in enumerate(leaves(part)):
            other = changed(part, index)
            if np.allclose(answers(other), alone, rtol=1e-9):
                continue
            found = answers(AROUND[outer](other, other.muscle_count or 1))
            assert not np.allclose(found, plain, rtol=1e-9), leaf.path
    if outer is inner is WithStickSlip:
        assert not accepted


def test_each_wrapper_of_a_mechanism_is_tried_on_one():
    for kind, around in AROUND.items():
        bases = ((JOINT, 2), (HangingMass(5.0), 1))
        joint = "Joint" in kind.__name__ or kind is WithStickSlip
        base, pulls = bases[0 if joint else 1]
        assert np.isfinite(answers(around(base, pulls))).all()


def test_a_second_stick_slip_is_refused_and_one_with_both_torques_is_not():
    one = WithStickSlip(JOINT, (StickSlip(0.3),))
    with pytest.raises(ParameterError, match="one WithStickSlip with one element for each angle"):
        WithStickSlip(WithLatch(one), (StickSlip(0.2),))
    assert WithStickSlip(JOINT, (StickSlip(0.5),)).inner_states == one.inner_states


def test_every_wrapper_of_a_mechanism_is_in_these_tests():
    known = [getattr(am.physics, name) for name in am.physics.__all__]
    kinds = {k for k in known if inspect.isclass(k) and issubclass(k, MechanismWrapper)}
    assert {k for k in kinds if not inspect.isabstract(k)} - {MechanismWrapper} == set(AROUND)
