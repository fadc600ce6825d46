"""Estimation from pressures alone, predictive choice of valve states, and compensation of
hysteresis.

python examples/estimation_and_prediction.py        writes
report/examples/estimation_and_prediction.png

The muscle is the DMSP-20-300 of Martens and Boblan; joints, loads, friction, valves, noise and
sample times are chosen.
"""

from dataclasses import replace

import numpy as np

import airmuscle as am
from airmuscle.control import (
    ExtendedKalmanFilter,
    FiniteControlSet,
    HysteresisOperator,
    SetpointCommand,
)
from airmuscle.core import plotting
from airmuscle.engine import ControlLoop
from airmuscle.physics import Dahl, MaxwellSlip, PressureScaledFriction
from airmuscle.units import bar, mm, ms

figure, axes = plotting.new_figure(2, 2, height=6.2)
estimation_axes, force_axes, valve_axes, hysteresis_axes = axes.ravel()


def at_samples(run, step):
    """The columns of a run at the sampling instants."""
    _, rows = np.unique(np.round(run["time"] / step), return_index=True)
    return {name: run[name][rows] for name in run}


# Contraction and force of a joint from its two pressures; the filter's friction is 30 % too small.
library = am.load("joint-dmsp-20-regulators").plant


def joint(scale):
    """The joint of the library with this part of the friction."""
    friction = PressureScaledFriction(
        Dahl(34e3, 38.0 * scale), ambient_ratio=0.21, reference_pressure=6 * bar
    )
    return replace(
        library, muscle=tuple(replace(muscle, friction=friction) for muscle in library.muscles)
    )


truth = joint(1.0)
h = 5 * ms
start = am.find_equilibrium(truth, pressure=2.5 * bar)
time = h * np.arange(801)
swing = 1.2 * bar * np.sin(np.pi * time) * np.minimum(time, 1.0)
command = am.Schedule(
    {
        name: tuple(zip(time.tolist(), (2.5 * bar + sign * swing).tolist(), strict=True))
        for name, sign in (("left.setpoint", 1.0), ("right.setpoint", -1.0))
    }
)
true = at_samples(am.simulate(truth, command, duration=4.0, initial_state=start, output_times=h), h)
noise = dict.fromkeys(("left.pressure", "right.pressure"), 500.0)
rng = np.random.default_rng(1)
measured = {name: true[name] + rng.normal(scale=noise[name], size=time.size) for name in noise}
process = {"left.air_mass": 1e-6, "right.air_mass": 1e-6, "angular_speed": 0.3}
estimator = ExtendedKalmanFilter(joint(0.7), tuple(noise), h, process, noise)
first = estimator.start(
    {**start, "angle": start["angle"] + 0.05}, {"angle": 0.05, "left.air_mass": 2e-6}
)
estimated = estimator.estimate(am.Recording({**true, **measured}, "measured"), first)
for panel, name, factor, label in (
    (estimation_axes, "left.contraction", 100.0, "contraction, left [%]"),
    (force_axes, "left.force", 1.0, "force, left [N]"),
):
    error = np.abs(estimated[name] - true[name])[time > 1.0].max() / np.ptp(true[name])
    print(
        f"{name} from the pressures alone, friction 30 % too small: error at most {100 * error:.2g}"
        " % of its range"
    )
    panel.plot(
        time, factor * true[name], color=plotting.BLACK, linestyle="--", linewidth=0.9, label="true"
    )
    panel.plot(
        time, factor * estimated[name], color=plotting.LINES[0], label="estimated from pressures"
    )
    panel.set(xlabel="time [s]", ylabel=label)

# A load that is lifted by two on/off valves, whose states are chosen by prediction.
muscle = replace(am.load("dmsp-20-300").muscle, damper=am.LinearDamper(300.0))
small = am.Valve(conductance=3e-10, critical_ratio=0.35)
circuit = am.FillDischarge(am.Supply(6 * bar), small, small)
model, heavier = (am.Plant(muscle, circuit, am.HangingMass(mass)) for mass in (10.0, 11.0))
modes = tuple({"fill": a, "discharge": b} for a, b in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)))
rest = am.find_equilibrium(heavier, pressure=1.5 * bar)
h = 10 * ms
process = {"air_mass": 1e-6, "speed": 0.02, "speed.disturbance": 1.0}
observer = ExtendedKalmanFilter(
    model,
    ("pressure", "position"),
    h,
    process,
    {"pressure": 500.0, "position": 0.02 * mm},
    disturbances=("speed",),
)
begin = observer.start(rest, {"air_mass": 1e-6, "speed.disturbance": 1.0})
y0 = rest["position"]
wanted = am.Schedule({"position": ((0, y0), (0.2, y0 + 8 * mm))})
for i, cost in enumerate((0.0, 0.1)):
    law = FiniteControlSet(observer, begin, modes, {"position": 0.5 * mm}, switching_cost=cost)
    record = am.simulate(
        heavier, ControlLoop(law, h, wanted), duration=2.5, initial_state=rest, output_times=h
    )
    late = record["time"] > 1.5
    error = np.abs(record["position"] - record["setpoint.position"])[late].max() / mm
    edges = sum(
        np.count_nonzero(np.diff(record[f"command.{name}"])) for name in ("fill", "discharge")
    )
    print(f"switching cost {cost:g}: error at most {error:.3f} mm and {edges} switchings in all")
    valve_axes.plot(
        record["time"],
        record["position"] / mm,
        color=plotting.LINES[i],
        label=f"switching cost {cost:g}",
    )
valve_axes.set(xlabel="time [s]", ylabel="position [mm]")

# A muscle with friction, at a pressure regulator, without and with the inverse hysteresis operator.
sliding = replace(
    muscle, friction=MaxwellSlip(stiffnesses=(2e4, 1e4, 5e3), limits=(2e-4, 1e-3, 3e-3))
)
large = am.Valve(conductance=2e-8, critical_ratio=0.4)
regulator = replace(library.circuits[0], fill=large, discharge=large)
plant = am.Plant(sliding, regulator, am.HangingMass(5.0))
h = 20 * ms
time = h * np.arange(801)


def drive(pressures):
    """The columns of a run with these set pressures."""
    points = tuple(zip(time.tolist(), pressures.tolist(), strict=True))
    loop = ControlLoop(
        SetpointCommand(("setpoint",), ("wanted",)), h, am.SampledSignal({"wanted": points})
    )
    begin = am.find_equilibrium(plant, pressure=2 * bar)
    return at_samples(
        am.simulate(plant, loop, duration=16.0, initial_state=begin, output_times=h), h
    )


taught = drive(2 * bar + 1.2 * bar * np.sin(np.pi * time / 2) * (1.0 - 0.9 * time / 16.0))
curve = np.polyfit(taught["position"], taught["pressure"], 3)
operator = HysteresisOperator.fitted(
    taught["pressure"] - 2 * bar,
    np.polyval(curve, taught["position"]) - 2 * bar,
    (0.0, *(0.1 * bar * np.arange(1, 8))),
)
wanted = 2 * bar + (0.8 * bar * np.sin(1.1 * time) + 0.3 * bar * np.sin(2.5 * time)) * np.minimum(
    time / 2.0, 1.0
)
late = time > 3.0
for i, (label, pressures) in enumerate(
    {
        "without compensation": wanted,
        "with the inverse operator": 2 * bar + operator.inverse.output(wanted - 2 * bar),
    }.items()
):
    reached = np.polyval(curve, drive(pressures)["position"])
    print(f"{label}: rms error {np.sqrt(np.mean((reached - wanted)[late] ** 2)) / 1e3:.2g} kPa")
    hysteresis_axes.plot(
        wanted[late] / bar, reached[late] / bar, color=plotting.LINES[i], label=label
    )
hysteresis_axes.set(xlabel="wanted pressure [bar]", ylabel="pressure of the position [bar]")
for each, top in (
    (estimation_axes, 24.0),
    (force_axes, 170.0),
    (valve_axes, None),
    (hysteresis_axes, None),
):
    each.set_ylim(top=top)
    each.legend(fontsize=7, loc="best", frameon=False)
plotting.save(figure, "report/examples/estimation_and_prediction.png")
print("wrote report/examples/estimation_and_prediction.png")
