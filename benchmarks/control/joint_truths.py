"""Truths of the control benchmark: joints drawn at random from a stated family, of other classes
than the model.
"""

import dataclasses
import math
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

import airmuscle as am
from airmuscle.core import Reference, Value, model, ops, parameter
from airmuscle.design import TruePlant
from airmuscle.engine import Driver, SolenoidDriver
from airmuscle.physics import (
    REFERENCE_DENSITY,
    REFERENCE_TEMPERATURE,
    AntagonisticJoint,
    BoucWen,
    EnergyBalance,
    FillDischarge,
    ForceLaw,
    Friction,
    Isothermal,
    JointWithExternalTorque,
    LinearDamper,
    LuGre,
    MaxwellSlip,
    Orifice,
    Plant,
    SubsonicIndexValve,
    Supply,
    TonduLopez2000,
    Tube,
    TubeOrifice,
    WallHeatTransfer,
    WithTubes,
)
from airmuscle.physics.pneumatics.gas import HEAT_CAPACITY_RATIO

SAINT_VENANT = Reference(
    "saint-venant-wantzel-1839",
    "de Saint-Venant, B., Wantzel, L.",
    "Mémoire et expériences sur l'écoulement de l'air",
    "Journal de l'École Polytechnique 16(27), 85-122",
    1839,
    note="isentropic flow through a nozzle; cited after textbooks, not read",
)
SIDES = ("left", "right")
SUPPLY = 6e5
TRUTH_SEEDS = tuple(range(35, 41))
"""Seeds of the truths of a benchmark: the first row of six after 34, the last one seen before, with
every class.
"""
DEVELOPMENT_SEEDS = tuple(range(1, 7))
"""Seeds of the truths for which the controllers of the package were developed."""
SEALED_SEED = 20_270_411
"""Seed of the truth that no tuning has seen; it is drawn for the published page alone."""
LAWS = ("sarosi-dmsp-20-200n", "sarosi-dmsp-20-400n", "tondu-lopez")
JOINT = AntagonisticJoint(radius=0.04, inertia=0.05, damping=0.2, weight_torque=2.0, offset=0.11)
"""The joint of the model (chosen)."""
MAX_EXTRA_DELAY = 2
"""Greatest unknown part of the dead time [samples] (chosen)."""
PRESLIDING = 5e-4
"""Deflection of a muscle at which its friction slides [m] (chosen)."""
CRITICAL_RATIO = (2.0 / (HEAT_CAPACITY_RATIO + 1.0)) ** (
    HEAT_CAPACITY_RATIO / (HEAT_CAPACITY_RATIO - 1.0)
)


@model
class IsentropicNozzle(Orifice):
    """Isentropic nozzle: qm = C rho0 p1 sqrt(T0/T1) psi(p2/p1)/psi(r*),   psi(r) = sqrt(r^(2/g) -
    r^(1 + 1/g)).

    r* = (2/(g + 1))^(g/(g - 1)) = 0.528 for g = 1.4, below which the flow is that at r*; C sonic
    conductance. Above the pressure ratio `laminar_ratio` the flow is linear in the pressure
    difference. Reference: Saint-Venant and Wantzel (1839).
    """

    references: ClassVar[tuple[Reference, ...]] = (SAINT_VENANT,)
    from_file: ClassVar[bool] = False

    conductance: float = parameter(
        "m3/(s Pa)", "C", "sonic conductance, fully open", bounds=(0.0, 1e-5)
    )
    laminar_ratio: float = parameter(
        "1",
        "r",
        "pressure ratio above which the flow is laminar",
        bounds=(0.9, 0.99999),
        fitted=False,
        default=0.999,
    )

    def mass_flow(
        self, upstream: Value, downstream: Value, opening: Value, temperature: Value
    ) -> Value:
        high = ops.maximum(upstream, downstream)
        low = ops.minimum(upstream, downstream)
        ratio = low / high
        laminar = _psi(self.laminar_ratio) * (1.0 - ratio) / (1.0 - self.laminar_ratio)
        isentropic = _psi(ops.clip(ratio, CRITICAL_RATIO, self.laminar_ratio))
        part = ops.where(ratio > self.laminar_ratio, laminar, isentropic) / _psi(CRITICAL_RATIO)
        flow = (
            self.conductance
            * REFERENCE_DENSITY
            * ops.sqrt(REFERENCE_TEMPERATURE / temperature)
            * high
            * part
        )
        return opening * ops.where(upstream >= downstream, flow, -flow)


def _psi(ratio: Value) -> Value:
    return ops.sqrt(
        ratio ** (2.0 / HEAT_CAPACITY_RATIO) - ratio ** (1.0 + 1.0 / HEAT_CAPACITY_RATIO)
    )


def random_truth(seed: int, conductance: float, *, switching: bool = False) -> TruePlant:
    """The truth of a seed, with valves of about this sonic conductance [m3/(s Pa)].

    All ranges are chosen; numbers are uniform within them, and logarithmic where the ends differ by
    more than 3:

        characteristic   Sarosi2012 (two fits) or TonduLopez2000 (end correction 1.1 to 1.35, radius
                         9.5 to 10.5 mm)
        friction         LuGre (static friction up to 40 % more), BoucWen or MaxwellSlip, 4 to 25 N
                         for each muscle
        valve            SubsonicIndexValve (b 0.2 to 0.45, m 0.45 to 0.65) or IsentropicNozzle,
                         flow factor 0.55 to 1.1
        gas              EnergyBalance (0.3 to 3 W/K), WallHeatTransfer (10 to 60 W/(m2 K)) or
                         Isothermal
        tube             none, or 0.2 to 1 m with an inner diameter of 4 to 6 mm
        joint            inertia 0.8 to 1.6, weight 0.6 to 1.5, offset of the pulleys 0.9 to 1.1 of
                         the model's
        damper           150 to 400 N s/m
        dead time        0 to 2 samples more than stated; on/off valves 1 to 2 ms in place of 1 ms
    """
    random = np.random.default_rng(seed)
    friction = _friction(random)
    kind = random.integers(3)
    heat = _logarithmic(random, 0.3, 3.0)
    coefficient = _logarithmic(random, 10.0, 60.0)
    gas = (EnergyBalance(heat), WallHeatTransfer(coefficient), Isothermal())[kind]
    muscle = am.load("dmsp-20-300").muscle
    law = _characteristic(random)
    damper = LinearDamper(random.uniform(150.0, 400.0))
    pair = tuple(
        replace(muscle, name=n, contractile=law, friction=friction, damper=damper) for n in SIDES
    )
    factor = random.uniform(0.55, 1.1)
    ratio = random.uniform(0.2, 0.45)
    index = random.uniform(0.45, 0.65)
    valves = (
        SubsonicIndexValve(factor * conductance, ratio, index),
        IsentropicNozzle(factor * conductance),
    )
    valve = valves[0] if random.random() < 0.5 else valves[1]
    circuit: Any = FillDischarge(Supply(SUPPLY), valve, valve)
    tube = "–"
    if random.random() < 0.7:
        length = _logarithmic(random, 0.2, 1.0)
        circuit = WithTubes(circuit, Tube.from_dimensions(length, random.uniform(4e-3, 6e-3)))
        tube = f"{length:.2g} m"
    factors = {"inertia": (0.8, 1.6), "weight_torque": (0.6, 1.5), "offset": (0.9, 1.1)}
    drawn = {name: random.uniform(*ends) for name, ends in factors.items()}
    joint = replace(JOINT, **{name: getattr(JOINT, name) * x for name, x in drawn.items()})
    extra = int(random.integers(0, MAX_EXTRA_DELAY + 1))
    delay = random.uniform(1e-3, 2e-3)
    plant = Plant(pair, (circuit, circuit), JointWithExternalTorque(joint), gas)
    inputs = [name for name in plant.inputs if name != "external_torque"]
    drivers: dict[str, Driver] = (
        dict.fromkeys(inputs, SolenoidDriver(delay, delay)) if switching else {}
    )
    description = {
        **{kind: ", ".join(sorted(names)) for kind, names in kinds_of(plant).items()},
        "flow": f"{factor:.2f}",
        "tube": tube,
        **{name.replace("_", " "): f"{x:.2f}" for name, x in drawn.items()},
    }
    name = f"truth {seed}" if seed != SEALED_SEED else "sealed truth"
    return TruePlant(name, plant, drivers, extra, description)


def _logarithmic(random: np.random.Generator, low: float, high: float) -> float:
    return math.exp(random.uniform(math.log(low), math.log(high)))


def _characteristic(random: np.random.Generator) -> ForceLaw:
    name = LAWS[random.integers(len(LAWS))]
    correction = random.uniform(1.1, 1.35)
    radius = random.uniform(9.5e-3, 10.5e-3)
    law = am.load(name).characteristic
    assert isinstance(law, ForceLaw)
    if not isinstance(law, TonduLopez2000):
        return law
    return replace(law, geometry=replace(law.geometry, radius=radius), end_correction=correction)


def _friction(random: np.random.Generator) -> Friction:
    kind = random.integers(3)
    force = _logarithmic(random, 4.0, 25.0)
    more = random.uniform(0.0, 0.4)
    if kind == 0:
        return LuGre(force / PRESLIDING, force, more * force, 0.01, 50.0)
    if kind == 1:
        return BoucWen(force / PRESLIDING, force, 1.0 + more, 0.75)
    shares = (0.5, 0.3, 0.2)
    limits = (0.2 * PRESLIDING, PRESLIDING, 3.0 * PRESLIDING)
    return MaxwellSlip(
        tuple(s * force / limit for s, limit in zip(shares, limits, strict=True)), limits
    )


def kinds_of(plant: Plant) -> dict[str, set[str]]:
    """Class names of the characteristics, valves, friction laws and gas in a plant, without
    wrappers.
    """
    laws: list[Any] = [muscle.contractile for muscle in plant.muscles]
    while any(hasattr(law, "inner") for law in laws):
        laws = [getattr(law, "inner", law) for law in laws]
    return {
        "characteristic": {type(law).__name__ for law in laws},
        "valve": {name for circuit in plant.circuits for name in _valves(circuit)},
        "friction": {type(muscle.friction).__name__ for muscle in plant.muscles},
        "gas": {type(plant.gas).__name__},
    }


def _valves(part: Any) -> set[str]:
    """Class names of the orifices inside a circuit, other than those of tubes."""
    if isinstance(part, Orifice):
        return set() if isinstance(part, TubeOrifice) else {type(part).__name__}
    if not dataclasses.is_dataclass(part):
        return set()
    return {name for f in dataclasses.fields(part) for name in _valves(getattr(part, f.name))}
