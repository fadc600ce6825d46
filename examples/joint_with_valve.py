"""A complete plant: a joint with two muscles, a proportional valve, tubes, and a brake with a
release delay.

python examples/joint_with_valve.py        prints the equilibrium, the response to an opening of
                                           the valve, and the poles

Dimensions, valve and brake are chosen.
"""

from dataclasses import replace

import airmuscle as am
from airmuscle.engine import SolenoidDriver, WithDrivers
from airmuscle.physics import (
    AntagonisticJoint,
    ProportionalValve,
    SecondOrderLag,
    Tube,
    WithTubes,
    linearise,
    stiffness,
)
from airmuscle.units import bar, degree, kPa, mm, ms

muscle = replace(am.load("dmsp-20-300").muscle, damper=am.LinearDamper(200.0))
left = replace(muscle, name="left")
right = replace(muscle, name="right")
edge = am.Valve(conductance=2.6e-9, critical_ratio=0.433)
valve = ProportionalValve(
    am.Supply(6 * bar), edge, edge, SecondOrderLag(frequency=80.0), overlap=0.05, muscle_count=2
)
circuit = WithTubes(valve, Tube.from_dimensions(length=1.0, diameter=4 * mm))
joint = AntagonisticJoint(radius=40 * mm, inertia=0.05, damping=0.2, weight_torque=2.0, offset=0.11)
plant = am.Plant((left, right), circuit, am.WithLatch(joint))

equilibrium = am.find_equilibrium(plant, pressure=2.5 * bar)
stiffnesses = stiffness(plant, equilibrium).coordinates["angle"]
print(f"equilibrium at {equilibrium['angle'] / degree:.1f} degrees, both muscles at 2.5 bar")
constant_pressure = stiffnesses.constant_pressure
closed_valves = stiffnesses.shut_valves
print(f"stiffness {constant_pressure:.0f} N m/rad, with closed valves {closed_valves:.0f} N m/rad")

schedule = am.Schedule({"command": ((0.1, 0.6), (0.3, 0.0)), "latched": ((0, 1), (0.1, 0))})
command = WithDrivers(
    schedule, {"latched": SolenoidDriver(opening_delay=10 * ms, closing_delay=25 * ms)}
)
run = am.simulate(plant, command, duration=2.0, initial_state=equilibrium)
motion_start = run["time"][abs(run["angle"] - run["angle"][0]) > 0.1 * degree][0]
print(f"brake released and valve opened at 100 ms; motion starts at {motion_start / ms:.0f} ms")
print(
    f"maximum angle {run['angle'].max() / degree:.1f} degrees, final angle"
    f" {run['angle'][-1] / degree:.1f} degrees"
)
print(
    f"final pressures: {run['left.pressure'][-1] / kPa:.0f} and"
    f" {run['right.pressure'][-1] / kPa:.0f} kPa"
)

linear = linearise(
    plant, equilibrium | {"spool": 0.1}, {"command": 0.1}
)  # beyond the overlap of the valve
for pole in linear.poles:
    print(
        f"pole {pole.value:.4g} 1/s: {pole.frequency:.3g} Hz, damping ratio"
        f" {pole.damping_ratio:.2f}"
    )
