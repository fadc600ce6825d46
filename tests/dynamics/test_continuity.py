"""Within a segment the rates of every plant are continuous: on chokes, chords, checks, clamps,
slack, stops, limits.

A jump would stall an integrator or cost it its order. Every model that a file may name either
stands in an example here or is listed as one that enters no plant; so a new component is found.
Each state and each input of an example is swept far beyond its usual range from several places, and
so are lines across all of them at once; where neighbouring rates bend most the interval is halved
down to the kink, until the difference is gone or is a jump.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from plants import EXAMPLES, of

from airmuscle.core import model, ops
from airmuscle.engine.compile import compile_system
from airmuscle.files.library import model_class, model_names
from airmuscle.physics import Damper, EndStop, HuntCrossley

JUMP = 1e-6
"""What counts as a jump, as a share of a usual rate."""


NOT_IN_A_PLANT = {
    "commands, what drives valves by them, and methods": (
        "Schedule",
        "SampledSignal",
        "SolenoidDriver",
        "PWM",
        "Rodas4",
        "DormandPrince8",
        "RungeKutta4",
    ),
    "controllers, which look at a plant from outside": (
        "PID",
        "PredictiveControl",
        "OnOffController",
        "SplitRange",
        "DeadZoneController",
        "CoContraction",
        "Decentralised",
        "SetpointCommand",
        "SetpointLead",
        "SigmaDelta",
        "SlidingMode",
        "StaticFeedForward",
        "StaticInverse",
        "WithFeedForward",
        "AngleAndStiffness",
        "AntagonisticInverse",
        "Cascade",
        "ColumnSensor",
        "ComputedTorque",
        "FrictionFeedForward",
        "MotionFeedForward",
        "GainSchedule",
        "HysteresisCompensation",
        "HysteresisOperator",
        "InverseHysteresisOperator",
        "ProportionalFeedback",
        "StateFeedback",
        "SuperTwisting",
        "WithSensors",
        "WithSetpointDelay",
        "WithStuckValve",
        "Multirate",
        "RepetitiveControl",
        "SmithPredictor",
        "WithCommandDelay",
        "WithFilter",
        "WithManual",
        "WithRateLimit",
    ),
    "laws solved for pressure or contraction, where as_force_law stands in, and their readings": (
        "BorzikovaDirect",
        "BorzikovaExponential",
        "Hunt2017",
        "Saga2007",
        "ArcIntegral",
        "AxialIntegral",
        "UniformFibreSum",
        "UserDefinedFibreSum",
        "HalfShellFibreSum",
        "PrintedFibreSum",
    ),
    "not closed-form, refused by Plant": (
        "ExactMeridian",
        "Tabulated",
        "PleatedTube",
        "TabulatedGeometry",
    ),
}


def classes(thing):
    """Every model inside a model, by class name."""
    if isinstance(thing, tuple):
        return {name for item in thing for name in classes(item)}
    if not dataclasses.is_dataclass(thing):
        return set()
    return {
        type(thing).__name__,
        *classes(tuple(getattr(thing, f.name) for f in dataclasses.fields(thing))),
    }


def test_every_model_that_a_file_may_name_is_looked_at():
    seen = {name for plant in EXAMPLES.values() for name in classes(plant)} | {
        "ValidityRange",
        "Ratings",
    }
    excused = {name for names in NOT_IN_A_PLANT.values() for name in names}
    unseen = [
        f"{name}: {model_class(name, '').__module__} is in no plant of tests/plants.py, nor in"
        " NOT_IN_A_PLANT"
        for name in model_names()
        if name not in seen | excused
    ]
    assert not unseen, "\n".join(unseen)
    assert seen & excused == set()


def ranges(plant, rng):
    """How far each state and each input is swept, and a place among them."""
    start = plant.state_at(pressure=rng.uniform(-5e4, 6e5))
    low = []
    high = []
    at = []
    reach = [m.geometry.contraction_range for m in plant.muscles]
    least = max(r[0] for r in reach)
    most = min(r[1] for r in reach)
    for s in plant.states:
        if s.name.endswith(("air_mass", "internal_energy")):
            ends = 0.1 * start[s.name], 4.0 * start[s.name] + s.nominal
        elif s.name.startswith(
            "node"
        ):  # so little that the muscles beside it stay within their reach
            ends = (-0.005, 0.009) if "position" in s.name else (-0.4, 0.4)
        elif s.name in ("position", "inner_contraction"):
            size = 0.2 if s.name == "position" else 1.0
            ends = max(least + 1e-3, -0.05) * size, min(most, 0.35) * size
        else:
            ends = start[s.name] - 4.0 * s.nominal, start[s.name] + 4.0 * s.nominal
        low.append(ends[0])
        high.append(ends[1])
    for i in plant.input_variables:
        low.append(max(i.minimum, -7e5))
        high.append(min(i.maximum, 7e5))
    low = np.array(low)
    high = np.array(high)
    at = rng.uniform(low, high)
    names = [s.name for s in plant.states]
    for name in ("position", "speed"):  # near the usual, so that slack is not all there is
        if name in names:
            at[names.index(name)] = {
                "position": rng.uniform(0.005, 0.03),
                "speed": rng.uniform(-0.05, 0.05),
            }[name]
    return low, high, at


def lines(plant, rng):
    """Pairs of points: each state and input swept by itself from two places, and all of them at
    once.
    """
    for _ in range(2):
        low, high, at = ranges(plant, rng)
        for i in range(len(at)):
            one, other = at.copy(), at.copy()
            one[i] = low[i]
            other[i] = high[i]
            yield one, other
    for _ in range(6):
        low, high, _ = ranges(plant, rng)
        yield rng.uniform(low, high), rng.uniform(low, high)


def greatest_jump(rates, one, other, scale, places):
    """The largest step of any rate, by its size, that is left when suspected intervals of a line
    are halved away.

    A suspect's step is unlike its neighbours', as a jump's is however steep the course around it.
    """

    def at(t):
        return rates(one + t * (other - one)) / scale

    values = np.array([at(t) for t in places])
    assert np.isfinite(values).all()
    steps = np.diff(values, axis=0)
    unlike = np.abs(2 * steps[1:-1] - steps[:-2] - steps[2:])
    worst = 0.0
    for c in range(values.shape[1]):
        for i in np.argsort(unlike[:, c])[-6:] + 1:
            if abs(steps[i, c]) > JUMP:
                worst = max(worst, halved(lambda t, c=c: at(t)[c], places[i], places[i + 1]))
    return worst


def halved(f, a, b):
    """The step that is left after forty halvings, each time of the half that bends more: at a kink,
    or at a jump.
    """
    middle = (a + b) / 2
    fa = f(a)
    fm = f(middle)
    fb = f(b)
    for _ in range(40):
        quarters = (a + middle) / 2, (middle + b) / 2
        left, right = (f(q) for q in quarters)
        if abs(fa - 2 * left + fm) > abs(fm - 2 * right + fb):
            b = middle
            fb = fm
            middle = quarters[0]
            fm = left
        else:
            a = middle
            fa = fm
            middle = quarters[1]
            fm = right
        if max(abs(fb - fa), abs(fm - fa)) < JUMP:
            break
    return abs(fb - fa)


def worst_of(plant, few=False, seed=7):
    """The greatest jump found, as a share of the median of the rates that were met; `few`: one line
    of each variable at fewer places."""
    rng = np.random.default_rng(seed)
    ready = compile_system(plant)
    count = len(plant.states)

    def rates(point):
        return ready.rates(point[:count], point[count:])

    pairs = list(lines(plant, rng))
    examined = [*pairs[: count + len(plant.inputs)], *pairs[-2:]] if few else pairs
    nominal = np.array([s.nominal for s in plant.states])
    scale = np.maximum(
        np.median(np.abs([rates(p) for pair in pairs for p in pair]), axis=0), 1e-6 * nominal
    )
    places = np.linspace(0.0, 1.0, 90 if few else 130)
    return max(greatest_jump(rates, one, other, scale, places) for one, other in examined)


@pytest.mark.parametrize(
    "few", [True, pytest.param(False, marks=pytest.mark.slow)], ids=["few lines", "all lines"]
)
@pytest.mark.parametrize("name", EXAMPLES)
def test_the_rates_are_finite_and_continuous(name, few):
    assert worst_of(EXAMPLES[name], few) < JUMP


@model
class DryDamper(Damper):
    """Coulomb's force with a jump at standstill: what no part may be."""

    def coefficients(self, pressure, contraction):
        return 0.0, 0.0

    def force(self, pressure, contraction, speed):
        return ops.where(speed >= 0.0123, 5.0, -5.0)


@model
class LateStop(EndStop):
    """A stop that is there at once: what no part may be."""

    def force(self, contraction, speed, resting_length):
        return ops.where(contraction > self.contraction, 20.0, 0.0)


@pytest.mark.parametrize("few", [True, False], ids=["few lines", "all lines"])
@pytest.mark.parametrize(
    "parts", [{"damper": DryDamper()}, {"stop": LateStop(0.1, HuntCrossley(1e9))}], ids=str
)
def test_a_jump_would_be_found(parts, few):
    assert worst_of(of(**parts), few) > 100 * JUMP
