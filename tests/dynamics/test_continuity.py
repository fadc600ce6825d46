"""Within a segment the rates of every plant are continuous: on chokes, chords, checks, clamps, slack, stops, limits.

A jump would stall an integrator or cost it its order. Every model that a file may name either stands in an example
here or is listed as one that enters no plant; so a new component is found. Each state and each input of an example is
swept far beyond its usual range from several places, and so are lines across all of them at once; where neighbouring
rates differ most the interval is halved until the difference is gone or is a jump.
"""

from __future__ import annotations

import dataclasses
from dataclasses import replace

import numpy as np
import pytest
from joints import chosen_muscle

from airmuscle import circuit, friction, geometry, ops
from airmuscle.characteristic import (
    CircleVirtualWork,
    Clamped,
    ContractileSurface,
    EffectiveLength,
    InverseLength,
    LogarithmicLength,
    RubberLine,
    VirtualWork,
    as_force_law,
)
from airmuscle.characteristic.box import Box
from airmuscle.circuit import FillDischarge, Supply, Valve
from airmuscle.contact import HuntCrossley
from airmuscle.declare import model
from airmuscle.gas import EnergyBalance, Isothermal, Polytropic
from airmuscle.geometry.catenary import Catenary
from airmuscle.geometry.chebyshev import as_polynomial
from airmuscle.geometry.parabola import Parabola, TrueArcParabola
from airmuscle.geometry.vessel import Vessel
from airmuscle.library import catalogue
from airmuscle.library.models import model_class, model_names
from airmuscle.mechanism import HangingMass, Held, Isometric
from airmuscle.muscle import (
    CreepElements,
    CubicSpring,
    Damper,
    DirectionalDamper,
    EndStop,
    LaggingWall,
    LinearDamper,
    LinearSpring,
    Muscle,
    PressureDamper,
    Reynolds2003Damper,
    Reynolds2003Spring,
    SeriesSpring,
    Serres2009Damper,
    Serres2009Spring,
    SwellingWall,
)
from airmuscle.plant import Plant
from airmuscle.program.prepared import prepared

VALVE, OTHER = Valve(1e-8, 0.4), Valve(3e-9, 0.2)
TWO_VALVES = FillDischarge(Supply(5e5), VALVE, OTHER)
BRAID = geometry.Braid(0.01, 0.4363, 0.2)
FIBRES = geometry.StraightFibre(0.2, 0.02)
SPOOL = circuit.Follower(20.0, 0.7)
STOP = EndStop(0.1, HuntCrossley(1e9))
SLIPS = ((4e4, 2e4), (2e-4, 8e-4))
SURFACE = ContractileSurface((300.0, -200.0, 40.0, 10.0, 5.0, 3.0), 0.0, 6e5, 0.0, 0.25, 0.0, 1200.0, 2)

JUMP = 1e-6
"""What counts as a jump, as a share of the largest rate."""


def of(contractile=None, volume=BRAID, **parts):
    """A muscle of which some parts are exchanged, with a load and two valves."""
    contractile = contractile or Clamped(VirtualWork(BRAID), 0.0, 1200.0)
    parts = {"spring": LinearSpring(3000.0), "damper": LinearDamper(150.0), **parts}
    return Plant(Muscle(contractile, volume, **parts), TWO_VALVES, HangingMass(10.0), Isothermal())


def fed(by, count=1, gas=EnergyBalance(0.5)):
    """A circuit that feeds muscles which hang side by side, with heat."""
    muscles = tuple(replace(chosen_muscle(), name=f"m{i}") for i in range(count))
    return Plant(muscles if count > 1 else muscles[0], by, HangingMass(10.0 * count), gas)


def listed(name):
    return of(catalogue.load(name).characteristic)


EXAMPLES = {
    # characteristics
    **{name: listed(name) for name in ("chou-hannaford", "dmsp-20-300", "reynolds2003", "serres2009", "tondu-lopez")},
    "sarosi": listed("sarosi-dmsp-20-200n"),
    "surface": of(SURFACE),
    "stand-in": of(as_force_law(VirtualWork(BRAID), Box(0.0, 6e5, 0.0, 0.25), degree=3)),
    "dead length": of(EffectiveLength(SURFACE, 0.2, 0.02, 0.001)),
    "inverse length": of(InverseLength(SURFACE, SURFACE, 0.2, 0.3)),
    "logarithmic length": of(LogarithmicLength(SURFACE, SURFACE, 0.2, 0.3)),
    "circle": of(CircleVirtualWork(FIBRES, RubberLine(3e5, 1e5), 2e-3), FIBRES),
    # geometries
    **{
        type(m).__name__: of(SURFACE, geometry.StraightFibre(0.2, 0.02, meridian=m))
        for m in (Catenary(), Parabola(), TrueArcParabola())
    },
    "vessel": of(SURFACE, Vessel(2e-4), wall=LaggingWall(2e-11, 0.05)),
    "polynomial volume": of(SURFACE, as_polynomial(BRAID, 8, (-0.05, 0.3))),
    # elements of a muscle
    "hardening spring, lopsided damper": of(
        spring=CubicSpring(3000.0, 100.0), damper=DirectionalDamper(300.0, 150.0, 1e-3, -1e-3)
    ),
    "pressure damper, creep": of(damper=PressureDamper(50.0, 1e-3), creep=CreepElements((2e4, 1e4), (0.1, 2.0))),
    "Reynolds": of(spring=Reynolds2003Spring(), damper=Reynolds2003Damper()),
    "Serres": of(spring=Serres2009Spring(), damper=Serres2009Damper()),
    "stop, lagging wall": of(stop=STOP, wall=LaggingWall(2e-11, 0.05)),
    "series spring with a stop": of(
        series=SeriesSpring(1e5), stop=STOP, damper=DirectionalDamper(300.0, 150.0, 1e-3, 0.0)
    ),
    "swelling wall": of(wall=SwellingWall(4e-5, 2e5, 3e4, 0.05)),
    # friction
    "Dahl": of(friction=friction.Dahl(5e4, 20.0)),
    "LuGre": of(friction=friction.LuGre(5e4, 15.0, 5.0, 0.01, 50.0, 20.0)),
    "Bouc-Wen": of(friction=friction.BoucWen(5e4, 20.0, 1.7, 0.8)),
    "Maxwell slip": of(friction=friction.MaxwellSlip(*SLIPS)),
    "Prandtl-Ishlinskii": of(friction=friction.PrandtlIshlinskii(*SLIPS, (8.0, -8.0), (0.5, -0.5))),
    # circuits
    "polytropic": fed(TWO_VALVES, gas=Polytropic(1.3)),
    "heat": fed(TWO_VALVES),
    "closed": fed(circuit.ClosedChamber()),
    "held and let go": Plant(chosen_muscle(), TWO_VALVES, Held(HangingMass(10.0))),
    "held for good": Plant(chosen_muscle(), TWO_VALVES, Isometric(0.05), EnergyBalance(0.5)),
    "check valve and cracking pressure": fed(
        FillDischarge(
            Supply(5e5), circuit.CheckValve(circuit.IndexedValve(1e-8, 0.3, 0.6, 3e4)), circuit.IndexedValve(1e-8, 0.5, 0.4)
        )
    ),
    "three positions through a tube": fed(circuit.Line(circuit.ThreePosition(Supply(5e5), VALVE, OTHER),
                                                       circuit.Tube(circuit.TubeOrifice(1.0, 3e-3), 1e-5, 2))),
    "tube with inertia": fed(circuit.Line(TWO_VALVES, circuit.DistributedTube(1.0, 2e-3, 2, EnergyBalance(0.1)))),
    "overlap": fed(circuit.ProportionalValve(Supply(5e5), VALVE, OTHER, SPOOL, 0.2, 2), 2),
    "underlap": fed(circuit.ProportionalValve(Supply(5e5), VALVE, OTHER, SPOOL, -0.2)),
    "regulator, leak": fed(circuit.Leaking(circuit.ProportionalRegulator(Supply(5e5), VALVE, VALVE, SPOOL), OTHER)),
    "manifold on tank and regulator": fed(
        circuit.Manifold(
            circuit.RegulatedSupply(circuit.Tank(Supply(7e5), OTHER, 1e-3, EnergyBalance(0.1)), VALVE, 4e5),
            (FillDischarge(circuit.Shared(), VALVE, OTHER), circuit.ThreePosition(circuit.Shared(), VALVE, OTHER)),
            ("one", "two"),
        ),
        2,
    ),
}  # fmt: skip

NOT_IN_A_PLANT = {
    "commands, what drives valves by them, and methods": (
        "Schedule", "Signal", "OnOff", "PWM", "Rodas4", "DormandPrince8", "RungeKutta4"),
    "laws solved for pressure or contraction, where as_force_law stands in, and their readings": (
        "BorzikovaDirect", "BorzikovaExponential", "Hunt2017", "Saga2007", "AlongArc", "AlongAxis",
        "EvenSpread", "GivenSum", "SumOverHalf", "SumPastHalf",
    ),
    "not closed-form, refused by Plant": ("ExactMeridian", "Tabulated", "PleatedTube", "TabulatedGeometry"),
}  # fmt: skip


def classes(thing):
    """Every model inside a model, by class name."""
    if isinstance(thing, tuple):
        return {name for item in thing for name in classes(item)}
    if not dataclasses.is_dataclass(thing):
        return set()
    return {type(thing).__name__, *classes(tuple(getattr(thing, f.name) for f in dataclasses.fields(thing)))}


def test_every_model_that_a_file_may_name_is_looked_at():
    seen = {name for plant in EXAMPLES.values() for name in classes(plant)} | {"Box"}
    excused = {name for names in NOT_IN_A_PLANT.values() for name in names}
    unseen = [f"{n}: {model_class(n, '').__module__}" for n in model_names() if n not in seen | excused]
    assert unseen == [], "give each an example in EXAMPLES, or say in NOT_IN_A_PLANT why it enters no plant"
    assert seen & excused == set()


def ranges(plant, rng):
    """How far each state and each input is swept, and a place among them."""
    start = plant.state_at(pressure=rng.uniform(-5e4, 6e5))
    low, high, at = [], [], []
    reach = [m.geometry.contraction_reach for m in plant.muscles]
    least, most = max(r[0] for r in reach), min(r[1] for r in reach)
    for s in plant.states:
        if s.name.endswith(("air_mass", "internal_energy")):
            ends = 0.1 * start[s.name], 4.0 * start[s.name] + s.nominal
        elif s.name in ("position", "inner_contraction"):
            size = 0.2 if s.name == "position" else 1.0
            ends = max(least + 1e-3, -0.05) * size, min(most, 0.35) * size
        else:
            ends = start[s.name] - 4.0 * s.nominal, start[s.name] + 4.0 * s.nominal
        low.append(ends[0])
        high.append(ends[1])
    for i in plant.commands:
        low.append(i.least)
        high.append(min(i.greatest, 7e5))
    low, high = np.array(low), np.array(high)
    at = rng.uniform(low, high)
    names = [s.name for s in plant.states]
    for name in ("position", "speed"):  # near the usual, so that slack is not all there is
        if name in names:
            at[names.index(name)] = {"position": rng.uniform(0.005, 0.03), "speed": rng.uniform(-0.05, 0.05)}[name]
    return low, high, at


def lines(plant, rng):
    """Pairs of points: each state and input swept by itself from two places, and all of them at once."""
    for _ in range(2):
        low, high, at = ranges(plant, rng)
        for i in range(len(at)):
            one, other = at.copy(), at.copy()
            one[i], other[i] = low[i], high[i]
            yield one, other
    for _ in range(6):
        low, high, _ = ranges(plant, rng)
        yield rng.uniform(low, high), rng.uniform(low, high)


def greatest_jump(rates, one, other, scale):
    """The largest step of any rate, by its size, that is left when suspected intervals of a line are halved away.

    A suspect's step is unlike its neighbours', as a jump's is however steep the course around it.
    """

    def at(t):
        return rates(one + t * (other - one)) / scale

    places = np.linspace(0.0, 1.0, 130)
    values = np.array([at(t) for t in places])
    assert np.isfinite(values).all()
    steps = np.diff(values, axis=0)
    unlike = np.abs(2 * steps[1:-1] - steps[:-2] - steps[2:])
    worst = 0.0
    for c in range(values.shape[1]):
        for i in np.argsort(unlike[:, c])[-3:] + 1:
            if abs(steps[i, c]) > JUMP:
                worst = max(worst, halved(lambda t, c=c: at(t)[c], places[i], places[i + 1]))
    return worst


def halved(f, a, b):
    """The step that is left after forty halvings, each time of the half with the larger step."""
    fa, fb = f(a), f(b)
    for _ in range(40):
        middle = (a + b) / 2
        fm = f(middle)
        if abs(fm - fa) > abs(fb - fm):
            b, fb = middle, fm
        else:
            a, fa = middle, fm
        if abs(fb - fa) < JUMP:
            break
    return abs(fb - fa)


def worst_of(plant, seed=7):
    """The greatest jump found, as a share of the largest rate that was met."""
    rng, ready = np.random.default_rng(seed), prepared(plant)
    count = len(plant.states)

    def rates(point):
        return ready.rates(point[:count], point[count:])

    pairs = list(lines(plant, rng))
    nominal = np.array([s.nominal for s in plant.states])
    scale = np.maximum(np.abs([rates(p) for pair in pairs for p in pair]).max(axis=0), 1e-6 * nominal)
    return max(greatest_jump(rates, one, other, scale) for one, other in pairs)


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_rates_are_finite_and_continuous(name):
    assert worst_of(EXAMPLES[name]) < JUMP


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


@pytest.mark.parametrize("parts", [{"damper": DryDamper()}, {"stop": LateStop(0.1, HuntCrossley(1e9))}], ids=str)
def test_a_jump_would_be_found(parts):
    assert worst_of(of(**parts)) > 100 * JUMP
