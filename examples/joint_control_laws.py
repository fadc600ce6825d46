"""Control laws at one lifted load, and two at a joint: tracking, on/off valves, learning, angle and
stiffness.

python examples/joint_control_laws.py        writes report/examples/control_laws.png

The muscle is the DMSP-20-300 of Martens and Boblan; loads, valves, gains, defects of the sensors
and sample times are chosen. The plant is not the model of the feed-forward: its load is 20 %
heavier and it has friction.
"""

from dataclasses import replace

import numpy as np

import airmuscle as am
from airmuscle.control import (
    PID,
    AngleAndStiffness,
    AntagonisticInverse,
    Cascade,
    DeadZoneController,
    Decentralised,
    IterativeLearning,
    SetpointCommand,
    SlidingMode,
    StaticFeedForward,
    StaticInverse,
    SuperTwisting,
    WithFeedForward,
)
from airmuscle.core import plotting
from airmuscle.engine import ColumnSensor, ControlLoop, SigmaDelta, SplitRange, WithSensors
from airmuscle.physics import AntagonisticJoint, Dahl
from airmuscle.units import bar, mm, ms

muscle = replace(am.load("dmsp-20-300").muscle, damper=am.LinearDamper(300.0))
length = muscle.geometry.resting_length
truth = replace(muscle, friction=Dahl(2e4, 10.0))
valve = am.Valve(conductance=1e-8, critical_ratio=0.35)
plant = am.Plant(truth, am.FillDischarge(am.Supply(6 * bar), valve, valve), am.HangingMass(12.0))
start = am.find_equilibrium(plant, pressure=1.5 * bar)
y0 = start["position"]
step = 5 * ms

split = SplitRange("fill", "discharge")
pressure = PID("pressure", split, gain=5 / bar)
sensors = (
    ColumnSensor("position", resolution=0.02 * mm, delay=1),
    ColumnSensor("pressure", resolution=100.0, noise=500.0, delay=1),
)
wave_times = np.arange(0.0, 4.0 + step / 2, step)
wave = y0 + 8 * mm * (1 - np.cos(2 * np.pi * wave_times)) / 2
sine = am.SampledSignal({"position": tuple(zip(wave_times.tolist(), wave.tolist(), strict=True))})


def run(law, setpoint, duration, plant=plant, start=start, sample_time=step):
    """A run with rows at the sampling instants."""
    loop = ControlLoop(law, sample_time, setpoint)
    return am.simulate(
        plant, loop, duration=duration, initial_state=start, output_times=sample_time
    )


def rms(record, begin=1.0):
    """Root mean square of the tracking error [mm] from `begin` [s] on."""
    late = record["time"] >= begin
    return (
        float(np.sqrt(np.mean((record["position"] - record["setpoint.position"])[late] ** 2))) / mm
    )


forward = StaticFeedForward(StaticInverse(muscle), "pressure", length, load=10.0 * 9.80665)
feedback = PID("position", "pressure", gain=40 * bar, integral_time=0.3, initial_output=0.0)
bias = replace(feedback, initial_output=1.5 * bar)
tracking = {
    "feedback": bias,
    "feed-forward": forward,
    "feed-forward and feedback": WithFeedForward(forward, feedback),
}
figure, axes = plotting.new_figure(2, 2, height=6.2)
upper, valves, learning_axes, joint_axes = axes.ravel()
for i, (name, outer) in enumerate(tracking.items()):
    cascade = Cascade(outer, pressure, (0.0,), (5.5 * bar,))
    sensed = tuple(sensor for sensor in sensors if sensor.column in cascade.measured_columns)
    record = run(WithSensors(cascade, sensed, seed=1.0), sine, 4.0)
    print(f"{name}: rms error {rms(record):.3f} mm")
    upper.plot(record["time"], record["position"] / mm, color=plotting.LINES[i], label=name)
upper.plot(wave_times, wave / mm, color=plotting.BLACK, linestyle="--", linewidth=0.9)
upper.set(xlabel="time [s]", ylabel="position [mm]", xlim=(0, 2))

small = am.Valve(conductance=3e-10, critical_ratio=0.35)
slow = replace(plant, circuit=am.FillDischarge(am.Supply(6 * bar), small, small))
wanted = am.Schedule({"position": ((0, y0), (0.2, y0 + 8 * mm))})
switching = {
    "dead zone": DeadZoneController(
        "position", split, zone=0.5 * mm, lead_time=0.02, filter_time=0.005
    ),
    "sigma-delta": SigmaDelta(PID("position", split, gain=60.0), minimum=0.02),
    "sliding mode": SlidingMode(
        "position", split, 1.0, sliding_time=0.05, boundary_layer=4 * mm, filter_time=0.01
    ),
    "super-twisting": SuperTwisting(
        "position", split, 8.0, 0.2, sliding_time=0.05, filter_time=0.01
    ),
}
for i, (name, law) in enumerate(switching.items()):
    record = run(law, wanted, 3.0, plant=slow)
    late = record["time"] > 2.0
    error = np.abs(record["position"] - record["setpoint.position"])[late].max() / mm
    edges = sum(
        np.count_nonzero(np.diff(record[f"command.{each}"][late] > 0))
        for each in ("fill", "discharge")
    )
    print(
        f"{name}: error at most {error:.3f} mm and {edges} openings and closings in the last second"
    )
    valves.plot(record["time"], record["position"] / mm, color=plotting.LINES[i], label=name)
valves.set(xlabel="time [s]", ylabel="position [mm]")

controlled = Cascade(
    WithFeedForward(SetpointCommand(("pressure",), ("learned",)), feedback),
    pressure,
    (0.0,),
    (5.5 * bar,),
)


def trial(learned, position):
    """The position after each sample of a trial with a feed-forward signal."""
    times = wave_times[: learned.size]
    points = {"learned": learned, "position": position[: learned.size]}
    setpoint = am.Schedule(
        {name: tuple(zip(times.tolist(), v.tolist(), strict=True)) for name, v in points.items()}
    )
    record = run(controlled, setpoint, learned.size * step)
    at = np.searchsorted(record["time"], times + step / 2)
    return record["position"][np.minimum(at, len(record["time"]) - 1)]


count = 300
signal = np.full(count, 1.5 * bar)
still = np.full(count, y0)
response = trial(signal + 0.1 * bar, still) - trial(signal, still)
learning = IterativeLearning.from_step_response(
    response, 0.1 * bar, step, change_weight=1e-2, cutoff=8.0, minimum=0.0, maximum=5.5 * bar
)
errors = []
for _ in range(10):
    error = wave[1 : count + 1] - trial(signal, wave)
    errors.append(float(np.sqrt(np.mean(error**2))) / mm)
    signal = learning.improve(signal, error)
print(
    f"learning: rms error {errors[0]:.3f} mm in the first trial, {errors[-1]:.3f} mm in the tenth"
)
learning_axes.semilogy(range(1, 11), errors, marker="o")
learning_axes.set(xlabel="trial", ylabel="rms error [mm]")

mechanism = AntagonisticJoint(
    radius=40 * mm, inertia=0.05, damping=0.2, weight_torque=2.0, offset=0.11
)
pair = tuple(replace(muscle, name=name) for name in ("left", "right"))
circuit = am.FillDischarge(am.Supply(6 * bar), valve, valve)
joint = am.Plant(pair, (circuit, circuit), mechanism)
inverse = AntagonisticInverse(pair, mechanism, 0.1 * bar, 5.5 * bar)
inner = Decentralised(
    tuple(
        PID(f"{n}.pressure", SplitRange(f"{n}.fill", f"{n}.discharge"), gain=5 / bar)
        for n in ("left", "right")
    )
)
outer = AngleAndStiffness(
    inverse, ("left.pressure", "right.pressure"), gain=30.0, integral_time=0.3
)
law = Cascade(outer, inner, (0.1 * bar,) * 2, (5.5 * bar,) * 2)
rest = am.find_equilibrium(joint, pressure=2.5 * bar)
low, high = (float(inverse.stiffness(p * bar, p * bar, 0.0)) for p in (2.5, 4.0))
wanted = am.Schedule({"angle": ((0, 0.0), (0.2, 0.3)), "stiffness": ((0, low), (1.5, high))})
record = run(law, wanted, 3.0, plant=joint, start=rest, sample_time=5 * ms)
stiffness = np.array(
    [
        inverse.stiffness(*values)
        for values in zip(
            record["left.pressure"], record["right.pressure"], record["angle"], strict=True
        )
    ]
)
print(
    f"joint: angle {record['angle'][-1]:.4f} rad for 0.3, stiffness {stiffness[-1]:.1f} N m/rad for"
    f" {high:.1f}"
)
joint_axes.plot(record["time"], record["angle"] / 0.3, label="angle / 0.3 rad")
joint_axes.plot(record["time"], stiffness / high, label=f"stiffness / {high:.0f} N m/rad")
joint_axes.set(xlabel="time [s]", ylabel="share of the final set point")
for each, top in ((upper, 23.5), (valves, 24.5), (joint_axes, 1.9)):
    each.set_ylim(top=top)
    each.legend(fontsize=7, loc="upper left", frameon=False)
plotting.save(figure, "report/examples/control_laws.png")
print("wrote report/examples/control_laws.png")
