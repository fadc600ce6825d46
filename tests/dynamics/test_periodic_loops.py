"""Every form of a linearised loop has the limit of stability of the simulated one; what cannot be
lifted is refused.

A law with a part that is sampled at every n-th sample is the law at n times the sample time. Its
verdict does not depend on the sample at which a run has ended.
"""

from __future__ import annotations

import dataclasses
import inspect

import numpy as np
import pytest
from joints import chosen_muscle
from scipy.optimize import brentq

import airmuscle.control
from airmuscle.control import (
    PID,
    Cascade,
    Decentralised,
    GainSchedule,
    Multirate,
    RepetitiveControl,
    SmithPredictor,
    WithCommandDelay,
    WithFeedForward,
    WithFilter,
    WithManual,
    WithRateLimit,
    WithSetpointDelay,
    WithStuckValve,
    linearise_loop,
)
from airmuscle.core import model, ops
from airmuscle.engine import (
    ColumnSensor,
    ControlLoop,
    Problem,
    Rodas4,
    Schedule,
    SigmaDelta,
    WithSensors,
    simulate,
    solve,
)
from airmuscle.errors import ParameterError
from airmuscle.physics import (
    FillDischarge,
    Plant,
    Polytropic,
    SpringLoad,
    Supply,
    Valve,
    find_equilibrium,
)

(EnclosingLaw,) = WithSensors.__bases__
VALVE = Valve(2.6e-9, 0.433)
EDGES = FillDischarge(Supply(6e5), VALVE, VALVE)
PLANT = Plant(chosen_muscle(), EDGES, SpringLoad(5.0, 2e3, 10.0, 40.0), Polytropic(1.2))
BLEED = Schedule({"discharge": ((0, 0.2),)})
H = 5e-3


def rest(pressure=3e5):
    """An equilibrium with air flowing through: neither valve is at its kink."""
    state = find_equilibrium(PLANT, pressure=pressure)
    bleeding, filling = (
        PLANT.outputs(state, {"fill": fill, "discharge": discharge})["mass_flow"]
        for fill, discharge in ((0.0, 0.2), (1.0, 0.0))
    )
    return state, {"fill": -bleeding / filling, "discharge": 0.2}


STATE, INPUTS = rest()
TARGET = STATE["position"]


def pid(gain, **changes):
    return PID(
        "position",
        "fill",
        **{"gain": gain, "integral_time": 0.2, "initial_output": INPUTS["fill"], **changes},
    )


def loop_of(law, sample_time=H, moved=0.0):
    setpoints = {
        "position": ((0, TARGET), (0.05, TARGET + moved)),
        "manual": ((0, 0.0),),
        "manual.fill": ((0, INPUTS["fill"]),),
    }
    wanted = Schedule({name: setpoints[name] for name in law.setpoints})
    return ControlLoop(law, sample_time, wanted, BLEED)


def linear(law, sample_time=H, **given):
    return linearise_loop(PLANT, loop_of(law, sample_time), STATE, INPUTS, **given)


@pytest.mark.parametrize("every", [2, 10])
@pytest.mark.parametrize("gain", [5.0, 200.0])
def test_a_law_at_every_nth_sample_is_the_law_at_n_times_the_sample_time(every, gain):
    law = pid(gain, derivative_time=0.02)
    lifted = linear(Multirate(law, every))
    slow = linear(law, every * H)
    assert lifted.is_stable is slow.is_stable
    poles = np.sort_complex(lifted.poles[np.abs(lifted.poles) > 1e-6])
    assert poles == pytest.approx(np.sort_complex(slow.poles[np.abs(slow.poles) > 1e-6]), rel=1e-7)
    if slow.is_stable:
        *margins, peak_frequency = dataclasses.astuple(slow.margins())
        *found, found_frequency = dataclasses.astuple(lifted.margins())
        assert found == pytest.approx(margins, rel=1e-8)
        assert found_frequency == pytest.approx(peak_frequency, rel=1e-6)  # of a flat maximum
        assert lifted.step_response("position", 1.0)["position"] == pytest.approx(
            slow.step_response("position", 1.0)["position"], rel=1e-8, abs=1e-12
        )


def cascade(gain, every=10, tracking=False):
    outer = PID("position", "pressure", gain=gain, initial_output=3e5)
    inner = PID("pressure", "fill", gain=8e-5, initial_output=INPUTS["fill"])
    law = Multirate(outer, every) if every else outer
    return Cascade(law, inner, (0.0,), (5e5,), tracking)


@pytest.mark.parametrize("tracking", [False, True])
def test_the_slow_part_of_a_cascade_is_not_taken_as_cut(tracking):
    """An outer gain that destabilises the loop is seen, as in the loop whose outer part is at every
    sample.
    """
    verdicts = [
        linear(cascade(gain, every, tracking), 1e-3).is_stable
        for every in (0, 10)
        for gain in (1e6, 1e8)
    ]
    assert verdicts == [True, False, True, False]
    # a slow outer law is slower: its margin is smaller than that of the law at every sample
    slow, fast = (
        linear(cascade(1e6, every, tracking), 1e-3).margins("position").gain for every in (100, 0)
    )
    assert slow < 0.9 * fast


def test_a_column_that_is_received_at_several_samples_of_a_period_is_refused_with_the_others():
    found = linear(cascade(1e6), 1e-3)
    with pytest.raises(ParameterError, match="open the loop at 'position'"):
        found.margins("pressure")
    assert found.margins("position").gain > 1.0
    sensed = WithSensors(Multirate(pid(5.0), 2), (ColumnSensor("position", lag=8e-3),))
    with pytest.raises(ParameterError, match=r"with Multirate\(law, 1\) at the sample time"):
        linear(sensed).margins()
    linear(dataclasses.replace(sensed, law=Multirate(pid(5.0), 1)), 2 * H).margins()


def test_the_verdict_does_not_depend_on_the_sample_at_which_a_run_ended():
    loop = loop_of(WithCommandDelay(Multirate(pid(20.0), 3), 1))
    poles = []
    for samples in range(6, 10):
        end = solve(Problem(PLANT, loop, duration=samples * H, initial_state=STATE))
        found = linearise_loop(PLANT, loop, STATE, INPUTS, control_state=end.control_state)
        poles.append(found.poles)
    for others in poles[1:]:
        assert np.abs(others) == pytest.approx(np.abs(poles[0]), rel=1e-6, abs=1e-9)
    assert linear(loop.controller).poles[0] == pytest.approx(poles[0][0], rel=1e-6)


@model
class EveryThirdTwice(EnclosingLaw):
    """A law of a user that counts its samples: at every third one its command is that of the law
    plus the change since the last one.
    """

    law: PID

    @property
    def initial_memory(self):
        return {"count": 0.0, **{f"law.{n}": v for n, v in self.law.initial_memory.items()}}

    def step(self, memory, measurement, dt):
        own = {name: memory[f"law.{name}"] for name in self.law.initial_memory}
        wanted, later = self.law.step(own, measurement, dt)
        error = measurement.setpoints["position"] - measurement.columns["position"]
        share = ops.where(memory["count"] > 1.5, self.law.gain, 0.0)
        count = ops.where(memory["count"] > 1.5, 0.0, memory["count"] + 1.0)
        commands = {"fill": wanted["fill"] + share * error}
        return commands, {"count": count, **{f"law.{n}": v for n, v in later.items()}}


FORMS = {
    WithSensors: lambda k: WithSensors(
        pid(k), (ColumnSensor("position", lag=8e-3, delay=2, noise=0.0),)
    ),
    WithSetpointDelay: lambda k: WithSetpointDelay(pid(k), 3),
    Multirate: lambda k: Multirate(pid(k), 4),
    WithCommandDelay: lambda k: WithCommandDelay(Multirate(pid(k), 3), 2),
    WithRateLimit: lambda k: WithRateLimit(pid(k), (50.0,)),
    WithManual: lambda k: WithManual(pid(k)),
    WithFilter: lambda k: WithFilter.lead_lag(pid(k), "position", 0.02, 0.05),
    RepetitiveControl: lambda k: RepetitiveControl(pid(20.0), "position", 10, 2, gain=1e-3 * k),
    GainSchedule: lambda k: GainSchedule(
        pid(k), "gain", "position", (TARGET - 1.0, TARGET + 1.0), (k, k)
    ),
    SmithPredictor: lambda k: SmithPredictor(pid(k), "position", "fill", 3, 1e-3, 0.2),
    EveryThirdTwice: lambda k: EveryThirdTwice(pid(k)),
    Decentralised: lambda k: Decentralised((Multirate(pid(k), 2),)),
    WithFeedForward: lambda k: WithFeedForward(
        pid(0.3 * k, integral_time=0.0), Multirate(pid(k, initial_output=0.0), 2)
    ),
}
"""A loop of each law around another one, by the gain of the law inside."""
REFUSED = {
    SigmaDelta: (SigmaDelta(pid(5.0)), "no slopes. Linearise the law inside it"),
    WithStuckValve: (
        WithStuckValve(pid(5.0), "fill", 1.0),
        "counts them without an end in '.*samples'",
    ),
}


def test_every_law_around_another_one_is_accepted_or_refused_here():
    laws = {
        kind
        for kind in (*vars(airmuscle.control.laws).values(), SigmaDelta, WithSensors)
        if inspect.isclass(kind) and issubclass(kind, EnclosingLaw)
    }
    names = {getattr(airmuscle.control, name, None) for name in airmuscle.control.__all__}
    laws |= {k for k in names if inspect.isclass(k) and issubclass(k, EnclosingLaw)}
    others = {"HysteresisCompensation"}  # a play is a kink at every point
    assert {k.__name__ for k in laws - {EnclosingLaw}} - others <= {
        k.__name__ for k in (*FORMS, *REFUSED)
    }


@pytest.mark.parametrize("kind", FORMS, ids=lambda kind: kind.__name__)
def test_a_loop_at_rest_is_not_kicked_by_the_start_of_its_law(kind):
    """The states of a law start at the working point, which a PID knows by its initial output."""
    run = simulate(
        PLANT,
        loop_of(FORMS[kind](20.0)),
        duration=0.5,
        initial_state=STATE,
        integrator=Rodas4(1e-10),
    )
    assert run["position"] == pytest.approx(TARGET, abs=1e-10)


def limit_of(form):
    """The gain at which the greatest pole crosses the unit circle."""

    def excess(gain):
        return float(np.abs(linear(form(gain)).poles[0])) - 1.0 - 1e-7  # of memory that is constant

    gains = np.geomspace(2.0, 3000.0, 25)
    first = next(i for i, gain in enumerate(gains) if excess(gain) > 0)
    return brentq(excess, gains[first - 1], gains[first], rtol=1e-6)


@pytest.mark.parametrize("kind", FORMS, ids=lambda kind: kind.__name__)
def test_the_simulated_loop_has_the_limit_of_stability(kind):
    """A small step grows with a gain 0.5 % above the limit, and decays below it."""
    form = FORMS[kind]
    limit = limit_of(form)
    growth = []
    for factor in (0.995, 1.005):
        law = form(factor * limit)
        run = simulate(
            PLANT,
            loop_of(law, moved=1e-8),
            duration=12.0,
            initial_state=STATE,
            integrator=Rodas4(1e-10),
        )
        swing = np.abs(run["position"] - np.median(run["position"][run["time"] > 4.0]))
        early, late = (swing[(run["time"] > t) & (run["time"] < t + 2)].max() for t in (5.0, 10.0))
        growth.append(late / early)
    assert growth[0] < 1.0 < growth[1]


@pytest.mark.parametrize("kind", REFUSED, ids=lambda kind: kind.__name__)
def test_a_law_without_a_period_is_refused_and_the_remedy_works(kind):
    law, text = REFUSED[kind]
    with pytest.raises(ParameterError, match=text):
        linear(law)
    with pytest.raises(ParameterError, match=text):
        linear(WithRateLimit(law, (50.0,)))
    assert linear(law.law).is_stable


@pytest.mark.parametrize("random", [{"lost": 0.3}, {"lost": 1e-6}, {"jitter": 2}])
def test_commands_that_are_late_at_random_are_refused_and_the_longest_delay_is_not(random):
    with pytest.raises(ParameterError, match=r"Set jitter and lost to 0: with samples=(1|3)"):
        linear(WithCommandDelay(pid(5.0), 1, **random))
    assert linear(WithCommandDelay(pid(5.0), 1 + random.get("jitter", 0))).is_stable


def test_a_state_that_moves_is_refused_and_the_equilibrium_at_its_pressure_is_not():
    moving = {**STATE, "speed": 0.3}
    with pytest.raises(ParameterError, match=r"moves by .* within 0\.1 s; allowed: .*"):
        linearise_loop(PLANT, loop_of(pid(5.0)), moving, INPUTS)
    pressure = PLANT.outputs(moving, INPUTS)["pressure"]
    state = find_equilibrium(PLANT, pressure=pressure)
    found = linearise_loop(PLANT, loop_of(pid(5.0)), state, INPUTS)
    assert found.margins().gain > 1.0
    assert found.drift["position"] < 1e-9
    assert linear(pid(5.0)).drift.keys() == STATE.keys()
