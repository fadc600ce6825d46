"""Control laws of the tab Joint: PID, cascade, and angle and stiffness, for the valves of a joint
of two muscles.

Every law commands two pressures. Pressure regulators receive them as set points; other valves are
driven by an inner proportional control of the pressures, on/off valves through sigma-delta
modulation. All gains are chosen.
"""

import dataclasses
import math
from collections.abc import Sequence

import airmuscle as am

from ...core import ParameterError

BAR = 1e5
SPARE = 0.02
"""Part of the pressure range that the control laws leave at each of its ends (chosen)."""
DIFFERENCE = "difference"
AHEAD = ("first_ahead", "second_ahead")
"""Set points of the feed-forward pressures, which the page computes from the statics of the
joint.
"""
INVERSE_STEPS = 3
"""Newton steps of the inverse for torque and stiffness (chosen); one is exact for laws that are
affine in pressure.
"""
MAX_SPEED = 20.0
"""Largest angular speed that the outer law of the cascade commands [rad/s] (chosen)."""
OPENING = 0.1
SLIGHT_OPENING = 0.01
"""Opening of the valves at which the joint is linearised (chosen): at closed valves the derivatives
are one-sided; and that of pressure regulators, whose bands are as wide as their range."""


@dataclasses.dataclass(frozen=True)
class Gain:
    """A gain with a slider: path in the law, symbol, meaning, unit and its factor, and the range of
    the slider.
    """

    path: str
    symbol: str
    meaning: str
    unit: str
    factor: float
    low: float
    high: float


@dataclasses.dataclass(frozen=True, eq=False)
class JointController:
    """A control law of a joint.

    law       commands the valves
    averaged  the same law without modulation, whose derivatives exist; `law` itself for other
              valves
    balance   value in the memory of `averaged` that balances the joint at rest
    bias      path in `averaged` of the first command of that integrator; empty if it begins at zero
    """

    key: str
    law: am.engine.ControlLaw
    averaged: am.engine.ControlLaw
    balance: str
    bias: str
    gains: tuple[Gain, ...]


@dataclasses.dataclass(frozen=True, eq=False)
class ValveSet:
    """The valves of a joint as the control laws command them.

    pressures  set points of the inner pressure control, or inputs of the regulators
    inner      pressure control; None for regulators
    switching  whether the valves are on/off valves
    offsets    commands at which the joint is linearised, by input; relative to the pressure [Pa]
               for regulators
    limits     range of the set points of the pressures [Pa] in which the offsets are possible
    """

    pressures: tuple[str, str]
    inner: am.engine.ControlLaw | None
    switching: bool
    offsets: dict[str, float]
    limits: tuple[float, float] = (0.0, math.inf)


def valve_set(plant: am.Plant) -> ValveSet:
    """The valves of a joint. Raises ParameterError for a circuit that the tab does not know."""
    circuit = plant.circuits[0]
    first, second = (muscle.name for muscle in plant.muscles)
    kinds = {type(valve) for valve in plant.circuits}
    regulators = am.physics.ProportionalRegulator | am.physics.PressureRegulator
    if len(kinds) == 1 and isinstance(circuit, regulators):
        pressures = (f"{first}.setpoint", f"{second}.setpoint")
        shift = (
            OPENING if isinstance(circuit, am.physics.ProportionalRegulator) else SLIGHT_OPENING
        ) * circuit.band
        offsets = {pressures[0]: shift, pressures[1]: -shift}
        highest = min(valve.inputs[0].maximum for valve in plant.circuits)
        return ValveSet(pressures, None, False, offsets, (shift, highest - shift))
    pressures = (f"{first}.pressure", f"{second}.pressure")
    if kinds == {am.physics.ProportionalValve} and isinstance(
        circuit, am.physics.ProportionalValve
    ):
        commands = (f"{first}.command", f"{second}.command")
        shift = circuit.overlap + OPENING * (1.0 - circuit.overlap)
        inner = am.control.ProportionalFeedback(pressures, commands, 3.0 / BAR)
        return ValveSet(pressures, inner, False, {commands[0]: shift, commands[1]: -shift})
    if kinds == {am.FillDischarge}:
        valves = tuple(
            am.engine.SplitRange(f"{name}.fill", f"{name}.discharge") for name in (first, second)
        )
        inner = am.control.ProportionalFeedback(pressures, valves, 3.0 / BAR, 0.03 * BAR)
        offsets = {f"{first}.fill": OPENING, f"{second}.discharge": OPENING}
        return ValveSet(pressures, inner, True, offsets)
    raise ParameterError(
        f"the joint has valves of {', '.join(sorted(kind.__name__ for kind in kinds))}; the tab"
        " Joint controls FillDischarge, ProportionalValve, ProportionalRegulator and"
        " PressureRegulator."
    )


def statics_within_valves(plant: am.Plant) -> am.physics.JointStatics:
    """The statics of a joint with pressures that its supply and its regulators can give. Raises
    ParameterError.
    """
    statics = am.physics.joint_statics(plant)
    low, high = valve_set(plant).limits
    least, greatest = statics.pressure_range
    if low <= least and greatest <= high:
        return statics
    return am.physics.joint_statics(plant, (max(low, least), min(high, greatest)))


def joint_controllers(
    plant: am.Plant, statics: am.physics.JointStatics
) -> tuple[JointController, ...]:
    """The controllers of a joint, whose pressures are within the range of its statics less a part
    at both ends.
    """
    valves = valve_set(plant)
    low, high = statics.pressure_range
    pressure_range = (low + SPARE * (high - low), high - SPARE * (high - low))
    steps = 1 if all(function.affine for function in statics.unlimited) else INVERSE_STEPS
    inverse = am.control.AntagonisticInverse(
        plant.muscles, plant.mechanism, *pressure_range, steps=steps
    )
    ahead = am.control.SetpointCommand(valves.pressures, AHEAD)
    controllers = []
    half = 0.5 * (pressure_range[1] - pressure_range[0])
    pid = am.PID(
        "angle",
        DIFFERENCE,
        gain=2.0 * BAR,
        integral_time=0.3,
        derivative_time=0.05,
        derivative_filter=5.0,
    )
    inner = am.PID("angular_speed", DIFFERENCE, gain=0.1 * BAR, integral_time=0.1)
    cascade = am.control.Cascade(
        am.PID("angle", "angular_speed", gain=6.0), inner, (-MAX_SPEED,), (MAX_SPEED,)
    )
    for key, outer, gains, inside in (
        ("pid", pid, PID_GAINS, ""),
        ("cascade", cascade, SPEED_GAINS, "inner."),
    ):
        alone, offset = (
            am.control.Cascade(
                outer, am.control.CoContraction(valves.pressures, 0.0, *mean), (-half,), (half,)
            )
            for mean in (("mean_pressure",), ())
        )
        added = am.control.WithFeedForward(ahead, offset)
        controllers += [
            _with_valves(valves, pressure_range, key, alone, "outer.", inside, gains),
            _with_valves(
                valves, pressure_range, f"{key}-ahead", added, "feedback.outer.", inside, gains
            ),
        ]
    law = am.control.AngleAndStiffness(
        inverse,
        valves.pressures,
        15.0,
        0.3,
        0.5,
        speed_column="angular_speed",
        acceleration_setpoint="angular_acceleration",
    )
    controllers.append(
        _with_valves(valves, pressure_range, "stiffness", law, "", "", TORQUE_GAINS, bias=False)
    )
    return tuple(controllers)


PID_GAINS = (
    Gain("gain", "K", "proportional gain", "bar/rad", BAR, 0.05, 20.0),
    Gain("integral_time", "T_i", "integral time; 0: no integral", "s", 1.0, 0.02, 5.0),
    Gain("derivative_time", "T_d", "derivative time; 0: no derivative", "s", 1.0, 0.001, 0.5),
    Gain("setpoint_weight", "b", "set-point weight of the proportional part", "", 1.0, 0.0, 1.0),
)
SPEED_GAINS = (
    Gain("outer.gain", "K_o", "gain of the angle", "1/s", 1.0, 0.5, 50.0),
    Gain("inner.gain", "K_i", "gain of the angular speed", "bar s/rad", BAR, 0.005, 2.0),
    Gain(
        "inner.integral_time",
        "T_i",
        "integral time of the speed; 0: no integral",
        "s",
        1.0,
        0.01,
        5.0,
    ),
)
TORQUE_GAINS = (
    Gain("gain", "K", "gain of the angle", "N m/rad", 1.0, 0.5, 300.0),
    Gain("integral_time", "T_i", "integral time; 0: no integral", "s", 1.0, 0.02, 5.0),
    Gain("speed_gain", "D", "gain of the angular speed", "N m s/rad", 1.0, 0.01, 10.0),
)
PRESSURE_GAIN = Gain("inner.gain", "K_p", "gain of the pressures", "1/bar", 1.0 / BAR, 0.2, 60.0)
"""Ranges of the sliders (chosen)."""


def _with_valves(
    valves: ValveSet,
    limits: tuple[float, float],
    key: str,
    law: am.engine.ControlLaw,
    path: str,
    inside: str,
    gains: Sequence[Gain],
    *,
    bias: bool = True,
) -> JointController:
    """A law that commands pressures, with the inner control of the valves. `path` leads to the
    feedback of the angle in the law, `inside` from there to the integrator."""
    rows = tuple(dataclasses.replace(gain, path=f"{path}{gain.path}") for gain in gains)
    ahead = key.endswith("-ahead")
    balance = f"{path}{inside}integral"
    start = f"{path}{inside}initial_output" if bias and not ahead else ""
    if valves.inner is None:
        return JointController(key, law, law, balance, start, rows)
    averaged = am.control.Cascade(law, valves.inner, (limits[0],) * 2, (limits[1],) * 2)
    rows = tuple(dataclasses.replace(gain, path=f"outer.{gain.path}") for gain in rows)
    complete = am.engine.SigmaDelta(averaged) if valves.switching else averaged
    return JointController(
        key,
        complete,
        averaged,
        f"outer.{balance}",
        start and f"outer.{start}",
        (*rows, PRESSURE_GAIN),
    )
