"""A whole plant: a joint with two muscles, a proportional valve, a tube to each muscle, a brake that lets go late.

python examples/A3_joint.py        prints where it rests, what it does when the valve opens, and its poles

Dimensions, valve and brake are chosen.
"""

from dataclasses import replace

import airmuscle as am
from airmuscle.analysis.linear_model import linearise
from airmuscle.analysis.static_stiffness import stiffness
from airmuscle.control.driver import SolenoidDriver, WithDrivers
from airmuscle.mechanism import AntagonisticJoint
from airmuscle.pneumatics import ProportionalValve, SecondOrderLag, Tube, WithTubes
from airmuscle.units import bar, degree, kPa, mm, ms

muscle = replace(am.load("dmsp-20-300").muscle, damper=am.LinearDamper(200.0))
left, right = replace(muscle, name="left"), replace(muscle, name="right")
edge = am.Valve(conductance=2.6e-9, critical_ratio=0.433)
valve = ProportionalValve(am.Supply(6 * bar), edge, edge, SecondOrderLag(frequency=80.0), overlap=0.05, muscle_count=2)
circuit = WithTubes(valve, Tube.from_dimensions(length=1.0, diameter=4 * mm))
joint = AntagonisticJoint(radius=40 * mm, inertia=0.05, damping=0.2, weight_torque=2.0, offset=0.11)
plant = am.Plant((left, right), circuit, am.WithLatch(joint))

rest = am.find_equilibrium(plant, pressure=2.5 * bar)
both = stiffness(plant, rest).coordinates["angle"]
print(f"at rest at {rest['angle'] / degree:.1f} degrees, both muscles at 2.5 bar")
print(f"stiffness {both.constant_pressure:.0f} N m/rad, with shut valves {both.shut_valves:.0f} N m/rad")

told = am.Schedule({"command": ((0.1, 0.6), (0.3, 0.0)), "latched": ((0, 1), (0.1, 0))})
command = WithDrivers(told, {"latched": SolenoidDriver(opening_delay=10 * ms, closing_delay=25 * ms)})
run = am.simulate(plant, command, duration=2.0, start=rest)
moves = run["time"][abs(run["angle"] - run["angle"][0]) > 0.1 * degree][0]
print(f"brake released and valve opened at 100 ms: moves from {moves / ms:.0f} ms on")
print(f"turns to {run['angle'].max() / degree:.1f} degrees and ends at {run['angle'][-1] / degree:.1f}")
print(f"pressures then: {run['left.pressure'][-1] / kPa:.0f} and {run['right.pressure'][-1] / kPa:.0f} kPa")

linear = linearise(plant, rest | {"spool": 0.1}, {"command": 0.1})  # beyond the overlap, where the valve answers
for pole in linear.poles:
    print(f"pole {pole.value:.4g} 1/s: {pole.frequency:.3g} Hz, damping ratio {pole.damping_ratio:.2f}")
