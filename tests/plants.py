"""Plants in which every component stands that enters one, for what must hold of them all; numbers
are chosen.
"""

from __future__ import annotations

from dataclasses import replace

from joints import chosen_muscle

from airmuscle import friction, geometry, physics
from airmuscle.files import library
from airmuscle.physics import (
    AntagonisticJoint,
    ArmLink,
    Catenary,
    CircleVirtualWork,
    Clamped,
    ConstantRadius,
    ContractileSurface,
    CrankProfile,
    CreepElements,
    CubicSeriesSpring,
    CubicSpring,
    DirectionalDamper,
    EffectiveLength,
    EndStop,
    EnergyBalance,
    ExternalLoad,
    FillDischarge,
    GaussianResidual,
    HangingMass,
    HuntCrossley,
    InverseLength,
    Isometric,
    Isothermal,
    Isotonic,
    JointWithEndStops,
    JointWithExternalTorque,
    JointWithFriction,
    Lever,
    LinearDamper,
    LinearInPressure,
    LinearSpring,
    LogarithmicLength,
    MooneyRivlinTube,
    Muscle,
    MuscleRoute,
    MusclesInSeries,
    Parabola,
    PlanarArm,
    Plant,
    PolynomialProfile,
    Polytropic,
    PooledLengthLaw,
    PrescribedMotion,
    PressureDamper,
    ProportionalRegulator,
    Pulley,
    Reynolds2003Damper,
    Reynolds2003Spring,
    RubberLine,
    SerialArm,
    SeriesSpring,
    Serres2009Damper,
    Serres2009Spring,
    SpatialLink,
    SpringLoad,
    StickSlip,
    Supply,
    SwellingWall,
    TrueArcParabola,
    ValidityRange,
    Valve,
    Vessel,
    VirtualWork,
    ViscoelasticWall,
    WithEndStops,
    WithLatch,
    WithOffsets,
    WithStickSlip,
    as_force_law,
)
from airmuscle.physics.muscle.geometry import as_polynomial

VALVE = Valve(1e-8, 0.4)
OTHER = Valve(3e-9, 0.2)
TWO_VALVES = FillDischarge(Supply(5e5), VALVE, OTHER)
BRAID = geometry.Braid(0.01, 0.4363, 0.2)
FIBRES = geometry.StraightFibre(0.2, 0.02)
BRAIDED_TUBE = geometry.BraidedTube(0.0075, 0.0015, 0.4363, 0.2, 0.0004, 0.0004, 0.02)
SPOOL = physics.SecondOrderLag(20.0, 0.7)
STOP = EndStop(0.1, HuntCrossley(1e9))
SLIPS = ((4e4, 2e4), (2e-4, 8e-4))
SURFACE = ContractileSurface(
    (300.0, -200.0, 40.0, 10.0, 5.0, 3.0), 0.0, 6e5, 0.0, 0.25, 0.0, 1200.0, 2
)


def of(contractile=None, volume=BRAID, **parts):
    """A muscle of which some parts are exchanged, with a load and two valves."""
    contractile = contractile or Clamped(VirtualWork(BRAID), 0.0, 1200.0)
    parts = {"spring": LinearSpring(3000.0), "damper": LinearDamper(150.0), **parts}
    return Plant(Muscle(contractile, volume, **parts), TWO_VALVES, HangingMass(10.0), Isothermal())


def fed(by, count=1, gas=EnergyBalance(0.5)):
    """A circuit that feeds muscles which hang side by side, with heat."""
    muscles = tuple(replace(chosen_muscle(), name=f"m{i}") for i in range(count))
    return Plant(muscles if count > 1 else muscles[0], by, HangingMass(10.0 * count), gas)


def pulled(mechanism, count=1, circuit=None):
    """A mechanism that one muscle or several pull at, each with two valves or another circuit."""
    muscles = tuple(replace(chosen_muscle(), name=f"m{i}") for i in range(count))
    return Plant(muscles, (circuit or TWO_VALVES,) * count, mechanism, Isothermal())


def listed(name):
    return of(library.load(name).characteristic)


EXAMPLES = {
    # characteristics
    **{
        name: listed(name)
        for name in (
            "braided-silicone-9mm",
            "chou-hannaford",
            "dmsp-20-300",
            "reynolds2003",
            "serres2009",
            "tondu-lopez",
        )
    },
    "sarosi": listed("sarosi-dmsp-20-200n"),
    "braided tube": of(
        MooneyRivlinTube(BRAIDED_TUBE, 3e5, 2e4),
        BRAIDED_TUBE,
    ),
    "surface": of(SURFACE),
    "stand-in": of(as_force_law(VirtualWork(BRAID), ValidityRange(0.0, 6e5, 0.0, 0.25), degree=3)),
    "dead length": of(EffectiveLength(SURFACE, 0.2, 0.02, 0.001)),
    "inverse length": of(InverseLength(SURFACE, SURFACE, 0.2, 0.3)),
    "logarithmic length": of(LogarithmicLength(SURFACE, SURFACE, 0.2, 0.3)),
    "reduced": of(LinearInPressure((6e-4, -2e-3), (-10.0,), 5.0)),
    "pooled": of(PooledLengthLaw(SURFACE, (SURFACE,), ("a",), (0.2,), "a")),
    "circle": of(CircleVirtualWork(FIBRES, RubberLine(3e5, 1e5), 2e-3), FIBRES),
    # geometries
    **{
        type(m).__name__: of(SURFACE, geometry.StraightFibre(0.2, 0.02, meridian=m))
        for m in (Catenary(), Parabola(), TrueArcParabola())
    },
    "vessel": of(SURFACE, Vessel(2e-4), wall=ViscoelasticWall(2e-11, 0.05)),
    "polynomial volume": of(SURFACE, as_polynomial(BRAID, 8, (-0.05, 0.3))),
    # elements of a muscle
    "hardening spring, lopsided damper": of(
        spring=CubicSpring(3000.0, 100.0), damper=DirectionalDamper(300.0, 150.0, 1e-3, -1e-3)
    ),
    "pressure damper, creep": of(
        damper=PressureDamper(50.0, 1e-3), creep=CreepElements((2e4, 1e4), (0.1, 2.0))
    ),
    "Reynolds": of(spring=Reynolds2003Spring(), damper=Reynolds2003Damper()),
    "Serres": of(spring=Serres2009Spring(), damper=Serres2009Damper()),
    "stop, lagging wall": of(stop=STOP, wall=ViscoelasticWall(2e-11, 0.05)),
    "series spring with a stop": of(
        series=SeriesSpring(1e5), stop=STOP, damper=DirectionalDamper(300.0, 150.0, 1e-3, 0.0)
    ),
    "hardening series spring": of(
        series=CubicSeriesSpring(5e4, 2e-3), damper=DirectionalDamper(300.0, 150.0, 1e-3, 0.0)
    ),
    "swelling wall": of(wall=SwellingWall(4e-5, 2e5, 3e4, 0.05)),
    # friction
    "Dahl": of(friction=friction.Dahl(5e4, 20.0)),
    "LuGre": of(friction=friction.LuGre(5e4, 15.0, 5.0, 0.01, 50.0, 20.0)),
    "pressure-scaled friction": of(
        friction=friction.IdentifiedFriction(
            friction.PressureScaledFriction(friction.Dahl(5e4, 20.0), 0.3, 3e5), 1e5, 4e5, 0.05
        )
    ),
    "Bouc-Wen": of(friction=friction.BoucWen(5e4, 20.0, 1.7, 0.8)),
    "Maxwell slip": of(friction=friction.MaxwellSlip(*SLIPS)),
    "Prandtl-Ishlinskii": of(friction=friction.PrandtlIshlinskii(*SLIPS, (8.0, -8.0), (0.5, -0.5))),
    # circuits
    "polytropic": fed(TWO_VALVES, gas=Polytropic(1.3)),
    "real gas": fed(TWO_VALVES, gas=physics.VirialGas()),
    "heat": fed(TWO_VALVES),
    "closed": fed(physics.ClosedChamber()),
    "held and let go": Plant(chosen_muscle(), TWO_VALVES, WithLatch(HangingMass(10.0))),
    "held for good": Plant(chosen_muscle(), TWO_VALVES, Isometric(0.05), EnergyBalance(0.5)),
    "check valve and cracking pressure": fed(
        FillDischarge(
            Supply(5e5),
            physics.CheckValve(physics.SubsonicIndexValve(1e-8, 0.3, 0.6, 3e4)),
            physics.SubsonicIndexValve(1e-8, 0.5, 0.4),
        )
    ),
    "three positions through a tube": fed(
        physics.WithTubes(
            physics.ThreePositionValve(Supply(5e5), VALVE, OTHER),
            physics.Tube(physics.TubeOrifice(1.0, 3e-3), 1e-5, 2),
        )
    ),
    "tube with inertia": fed(
        physics.WithTubes(TWO_VALVES, physics.DistributedTube(1.0, 2e-3, 2, EnergyBalance(0.1)))
    ),
    "overlap": fed(physics.ProportionalValve(Supply(5e5), VALVE, OTHER, SPOOL, 0.2, 2), 2),
    "underlap": fed(physics.ProportionalValve(Supply(5e5), VALVE, OTHER, SPOOL, -0.2)),
    "regulator, leak": fed(
        physics.WithLeak(physics.ProportionalRegulator(Supply(5e5), VALVE, VALVE, SPOOL), OTHER)
    ),
    "two pressure regulators on a tank": fed(
        physics.Manifold(
            physics.Tank(Supply(7e5), OTHER, 1e-3, EnergyBalance(0.1)),
            tuple(
                physics.PressureRegulator(
                    physics.SharedSupply(), VALVE, OTHER, 8e5, 0.05, 0.2, 0.02, 1.0, 3e3, leak
                )
                for leak in (0.0, 0.05)
            ),
            ("one", "two"),
        ),
        2,
    ),
    "manifold on tank and regulator": fed(
        physics.Manifold(
            physics.RegulatedSupply(
                physics.Tank(Supply(7e5), OTHER, 1e-3, EnergyBalance(0.1)), VALVE, 4e5
            ),
            (
                FillDischarge(physics.SharedSupply(), VALVE, OTHER),
                physics.ThreePositionValve(physics.SharedSupply(), VALVE, OTHER),
            ),
            ("one", "two"),
        ),
        2,
    ),
    # mechanisms
    "mass on a spring": pulled(SpringLoad(5.0, 2000.0, 20.0, 50.0)),
    "constant force": pulled(Isotonic(100.0, 2.0, 5.0)),
    "prescribed": pulled(PrescribedMotion()),
    "load in another program": pulled(ExternalLoad(("m0", "m1"), (0.005, 0.01)), 2),
    "lever": pulled(Lever((0.03,), 3.0, 0.2)),
    "pulley with stops": pulled(WithEndStops(Pulley(0.02, 5.0), -0.005, 0.02, HuntCrossley(1e9))),
    "joint with stops": pulled(
        JointWithEndStops(
            WithOffsets(AntagonisticJoint(0.03, 0.05, 0.2), (0.08, 0.08)),
            -0.2,
            0.2,
            0.05,
            HuntCrossley(1e9),
        ),
        2,
    ),
    "shaped joint with friction": pulled(
        JointWithFriction(
            AntagonisticJoint(
                0.03, 0.05, 0.2, 2.0, 0.1, 1.5, -1.2, 1.2, PolynomialProfile((0.2, -0.1))
            ),
            0.3,
        ),
        2,
    ),
    "joint with an external torque": pulled(
        JointWithExternalTorque(AntagonisticJoint(0.03, 0.05, 0.2, 2.0, 0.1)), 2
    ),
    "arm": pulled(
        PlanarArm(
            (
                ArmLink(0.3, 1.5, 0.14, 0.01, 0.1, -1.3, 1.3),
                ArmLink(0.25, 1.0, 0.11, 0.005, 0.1, -1.3, 1.3),
            ),
            (
                MuscleRoute((1,), (0.03,), 0.1),
                MuscleRoute((1,), (-0.03,), 0.1),
                MuscleRoute((1, 2), (0.02, 0.02), 0.1, (ConstantRadius(), CrankProfile(0.2))),
                MuscleRoute((2,), (-0.02,), 0.1, (CrankProfile(-0.2),)),
            ),
            0.5,
        ),
        4,
    ),
    "arm in space with stick-slip": pulled(
        WithStickSlip(
            SerialArm(
                (
                    SpatialLink((0, 0, 1), rotor_inertia=0.02, damping=0.1),
                    SpatialLink((0, 1, 0), (0.0, 0.0, 0.1), 1.0, (0.1, 0.0, 0.02), 0.01),
                ),
                (MuscleRoute((1,), (0.03,), 0.1), MuscleRoute((2,), (-0.03,), 0.1)),
            ),
            (StickSlip(0.5, (1e-3, 0.0)), StickSlip(0.3, (), 0.5, bearing_arms=(0.02, 0.01))),
            GaussianResidual(
                ("m0.pressure", "m1.pressure"),
                (0.5, 0.4),
                (1e5, 1e5),
                (0.1, -0.2, 2.0, 1.0, -0.3, 0.2, 3.0, 1.5),
                (0.6, -0.4),
                (0.3, -0.2, 0.1, 0.4),
            ),
        ),
        2,
        ProportionalRegulator(Supply(5e5), VALVE, OTHER, SPOOL),
    ),
    "muscles in series": pulled(MusclesInSeries(HangingMass(5.0), (0.5,), 1.0), 2),
}
