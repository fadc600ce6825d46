"""Tuning of a position controller for the nominal plant alone, and for a family of plants.

python examples/tuned_pid.py        writes report/examples/tuning.png

The muscle is the DMSP-20-300 of Martens and Boblan; load, valve, sensor, perturbations, ranges and
budget are chosen.
"""

from dataclasses import replace

import numpy as np

import airmuscle as am
from airmuscle.control import PID
from airmuscle.core import plotting
from airmuscle.design import Perturbations, perturbed_family, tune
from airmuscle.engine import ControlLoop
from airmuscle.physics import ProportionalValve, SecondOrderLag
from airmuscle.units import bar, mm, ms

muscle = replace(am.load("dmsp-20-300").muscle, damper=am.LinearDamper(300.0))
edge = am.Valve(conductance=2.6167e-9, critical_ratio=0.433)
valve = ProportionalValve(
    am.Supply(6 * bar), edge, edge, SecondOrderLag(frequency=80.0, damping_ratio=0.7)
)
plant = am.Plant(muscle, valve, am.HangingMass(10.0))


def lifted(plant):
    """The equilibrium at a position of 15 mm, whatever the load is."""
    low = 0.0
    high = 5 * bar
    for _ in range(30):
        pressure = (low + high) / 2
        start = am.find_equilibrium(plant, pressure=pressure)
        low, high = (pressure, high) if start["position"] < 15 * mm else (low, pressure)
    return start


motion = am.SampledSignal(
    {
        "position": (
            (0, 15 * mm),
            (0.1, 15 * mm),
            (0.4, 25 * mm),
            (0.8, 25 * mm),
            (1.1, 20 * mm),
            (1.5, 20 * mm),
        )
    }
)
pid = PID("position", "command", gain=60.0, integral_time=1.0, derivative_time=0.05)
loop = ControlLoop(pid, sample_time=5 * ms, setpoint=motion)
perturbations = Perturbations(loads=(0.5, 2.0), supplies=(0.8,), leak=0.01, delay=2, draws=0)
family = perturbed_family(plant, loop, perturbations, initial_state=lifted)

bounds = {"gain": (5.0, 1000.0), "integral_time": (0.05, 5.0), "derivative_time": (0.002, 0.2)}
options = {"duration": 1.5, "simulations": 600, "seed": 1}
nominal = tune(family.cases[:1], bounds, **{**options, "simulations": 160})
robust = tune(family.cases, bounds, start=[nominal.gains], **options)

figure, (left, right) = plotting.new_figure(1, 2, height=3.4)
history = robust.history
front = history.pareto("air")
error = history.means("index") / mm
air = history.means("air") * 1e3
left.plot(air, error, "o", color=plotting.SKY, markersize=2.5, label="sets of gains")
left.plot(
    air[front],
    error[front],
    "o-",
    color=plotting.ORANGE,
    markersize=3,
    linewidth=1.0,
    label="Pareto front",
)
left.plot(
    air[robust.best], error[robust.best], "D", color=plotting.BLUE, label="smallest objective"
)
left.set(
    xlabel="mean air drawn [g/s]",
    ylabel="mean rms error [mm]",
    xlim=(0.05, 0.35),
    ylim=(0, 4 * error.min()),
)
left.legend(frameon=False, fontsize=7, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)

heavy = family.cases[2]
present = {path: getattr(pid, path) for path in bounds}
sets = {
    "present gains": present,
    "nominal plant alone": nominal.gains,
    "family of plants": robust.gains,
}
for (name, gains), colour in zip(sets.items(), plotting.LINES, strict=False):
    tuned = replace(loop, controller=replace(pid, **gains))
    run = am.simulate(
        heavy.plant, tuned, duration=1.5, initial_state=heavy.initial_state, output_times=5 * ms
    )
    rms = float(np.sqrt(np.mean((run["position"] - run["setpoint.position"]) ** 2))) / mm
    numbers = ", ".join(f"{key} {value:.4g}" for key, value in gains.items())
    print(f"{name}: {numbers}; with twice the load rms error {rms:.2f} mm")
    right.plot(run["time"], run["position"] / mm, color=colour, label=name)
right.plot(
    run["time"],
    run["setpoint.position"] / mm,
    color=plotting.BLACK,
    linestyle="--",
    linewidth=0.9,
    label="set point",
)
right.set(xlabel="time [s]", ylabel="position with twice the load [mm]", ylim=(13, 33))
right.legend(frameon=False, fontsize=7, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
objectives = [
    robust.objective / mm,
    robust.history.objective[1] / mm,
    robust.present_objective / mm,
]
print(
    "objective of the family {:.2f} mm, with the gains of the nominal plant {:.2f}, present {:.2f}".format(  # noqa: E501
        *objectives
    )
)
plotting.save(figure, "report/examples/tuning.png")
print("wrote report/examples/tuning.png")
