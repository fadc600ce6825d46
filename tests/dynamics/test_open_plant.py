"""An open plant: shortening and speed of each muscle are inputs, its tension is an output (port
causality).

At the same shortening and speed it has the rates and tensions of the plant with its own load, and
its books close.
"""

from __future__ import annotations

import numpy as np
import plants
import pytest

from airmuscle.engine import Problem, Rodas4, SampledSignal, Schedule, solve
from airmuscle.engine.loop.inputs import CombinedSignal
from airmuscle.errors import ParameterError
from airmuscle.physics import ExternalLoad, WithEnergyMeters, open_plant

ONE = ("dmsp-20-300", "LuGre", "heat", "three positions through a tube", "stop, lagging wall")
TIMES = (0.0, 0.2, 0.3, 0.6, 0.8)
SHORTENINGS = (0.003, 0.006, 0.004, 0.01, 0.01)


@pytest.mark.parametrize("name", [*ONE, "joint with stops", "arm"])
def test_at_the_same_shortening_and_speed_it_does_what_the_closed_plant_does(name):
    closed = plants.EXAMPLES[name]
    ports = open_plant(closed)
    rng = np.random.default_rng(5)
    state = closed.state_at(pressure=2e5)
    for c in closed.mechanism.coordinates:
        state[c.name] += rng.uniform(-0.1, 0.1) * c.nominal
        state[c.speed] += rng.uniform(-1, 1) * c.nominal_speed
    own = {s.name: state[s.name] for s in ports.states}
    inputs = {
        i.name: rng.uniform(max(i.minimum, -1), min(i.maximum, 1)) for i in closed.input_variables
    }
    prefixes = [f"{m.name}." for m in closed.muscles] if len(closed.muscles) > 1 else [""]
    for prefix, muscle, at in zip(
        prefixes, closed.muscles, closed.muscle_states(state), strict=True
    ):
        rest = muscle.geometry.resting_length
        inputs[f"{prefix}shortening"] = rest * at.contraction
        inputs[f"{prefix}shortening_speed"] = at.speed
    rates, outputs = ports.rates_and_outputs(own, inputs)
    expected_rates, expected = closed.rates_and_outputs(state, inputs)
    assert set(rates) == set(own)
    for name in rates:
        assert rates[name] == pytest.approx(
            expected_rates[name], rel=1e-9, abs=1e-12 * abs(expected_rates[name]) + 1e-300
        )
    for prefix in prefixes:
        assert outputs[f"{prefix}force"] == pytest.approx(expected[f"{prefix}force"], rel=1e-10)


def motion():
    """A shortening that is linear in pieces, and its derivative; valves open one after the
    other.
    """
    speeds = [
        (b - a) / (t - s)
        for a, b, s, t in zip(SHORTENINGS, SHORTENINGS[1:], TIMES, TIMES[1:], strict=False)
    ]
    shortening = SampledSignal({"shortening": tuple(zip(TIMES, SHORTENINGS, strict=True))})
    others = Schedule(
        {
            "shortening_speed": tuple(zip(TIMES, [*speeds, 0.0], strict=True)),
            "fill": ((0.05, 1.0), (0.4, 0.0)),
            "discharge": ((0.6, 1.0), (0.65, 0.0)),
        }
    )
    return CombinedSignal(shortening, others)


@pytest.mark.parametrize("name", ["dmsp-20-300", "heat", "LuGre"])
def test_its_books_close(name):
    """Mass and energy of the air, work on the load, and work of the contractile element, over a
    motion that is imposed.
    """
    metered = WithEnergyMeters(open_plant(plants.EXAMPLES[name], [SHORTENINGS[0]]))
    start = metered.extend_state(metered.plant.state_at(pressure=1e5))
    run = (
        solve(Problem(metered, motion(), 0.8, start, integrator=Rodas4(1e-9)))
        .raise_if_incomplete()
        .recording
    )
    assert (run["force"] > 0).all()

    def closes(change, *terms):
        size = max(np.abs(term).max() for term in terms)
        np.testing.assert_allclose(change - change[0], sum(terms), rtol=0, atol=1e-7 * size)

    closes(run["air_total"], run["air_supplied"], -run["air_exhausted"])
    closes(run["air_energy"], run["energy_of_flow"], run["heat_to_air"], -run["work_of_air"])
    closes(
        run["kinetic_energy"] + run["potential_energy"],
        run["work_of_tension"],
        -run["mechanism_loss"],
    )
    friction = [run["friction_work"]] if "friction_work" in run else []
    closes(
        run["work_of_contractile"],
        run["work_of_tension"],
        run["damping_heat"],
        run["element_work"],
        *friction,
    )


def test_the_work_on_the_load_is_the_integral_of_tension_over_shortening():
    """The integral by the midpoint rule, from the given shortenings and not from their speeds.

    The tensions jump with the speeds, at the ends of intervals. The muscles work against each
    other: by different amounts, one shortens while the other lengthens.
    """
    factors = {"m0": 1.0, "m1": -0.6}
    speeds = (*(np.diff(SHORTENINGS) / np.diff(TIMES)), 0.0)
    place = {
        f"{m}.shortening": [(t, f * s) for t, s in zip(TIMES, SHORTENINGS, strict=True)]
        for m, f in factors.items()
    }
    speed = {
        f"{m}.shortening_speed": [(t, f * v) for t, v in zip(TIMES, speeds, strict=True)]
        for m, f in factors.items()
    }
    fill = {"m0.fill": ((0.05, 1.0), (0.4, 0.0)), "m1.fill": ((0.3, 1.0), (0.5, 0.0))}
    command = CombinedSignal(SampledSignal(place), Schedule({**speed, **fill}))
    start = [f * SHORTENINGS[0] for f in factors.values()]
    metered = WithEnergyMeters(open_plant(plants.EXAMPLES["joint with stops"], start))
    state = metered.extend_state(metered.plant.state_at(pressure=1.5e5))
    problem = Problem(metered, command, 0.8, state, output_times=1e-4, integrator=Rodas4(1e-9))
    run = solve(problem).raise_if_incomplete().recording
    steps = np.diff(np.interp(run["time"][::2], TIMES, SHORTENINGS))
    works = [
        np.cumsum(factor * run[f"{muscle}.force"][1::2] * steps)
        for muscle, factor in factors.items()
    ]
    assert min(np.abs(work[-1]) for work in works) > 0.3
    for meter in ("mechanism_loss", "work_of_tension"):
        np.testing.assert_allclose(run[meter][2::2], sum(works), rtol=0, atol=1e-6)


def test_a_state_without_inputs_is_at_the_given_shortening():
    base = plants.EXAMPLES["dmsp-20-300"]
    shorter = open_plant(base, [0.02]).state_at(pressure=2e5)
    rest = open_plant(base).state_at(pressure=2e5)
    closed = base.state_at(pressure=2e5, position=0.02)
    assert shorter["air_mass"] == pytest.approx(closed["air_mass"], rel=1e-12)
    assert rest["air_mass"] == pytest.approx(base.state_at(pressure=2e5)["air_mass"], rel=1e-12)


@pytest.mark.parametrize(("muscles", "shortenings"), [((), (0.02, 0.03)), (("a", "b"), (0.02,))])
def test_another_number_of_shortenings_is_refused(muscles, shortenings):
    with pytest.raises(
        ParameterError, match=r"\d shortenings are given for \d muscles; give one for each"
    ):
        ExternalLoad(muscles, shortenings)


def test_the_plant_of_several_muscles_names_its_ports():
    ports = open_plant(plants.EXAMPLES["joint with stops"])
    assert ports.inputs[-4:] == (
        "m0.shortening",
        "m0.shortening_speed",
        "m1.shortening",
        "m1.shortening_speed",
    )
    assert [s.name for s in ports.states] == ["m0.air_mass", "m1.air_mass"]
