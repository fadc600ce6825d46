"""A load lifted to where it is wanted: PID with a proportional valve, two-point control with two small on/off valves.

python examples/A4_control.py        writes control.png where it is run

The muscle is the DMSP-20-300 of Martens and Boblan; load, dynamics and size of the small valves, gains and
periods are chosen.
"""

from dataclasses import replace

import airmuscle as am
from airmuscle.control import PID, OnOffController, SplitRange
from airmuscle.control.control_loop import ControlLoop
from airmuscle.control.driver import SolenoidDriver
from airmuscle.core.plotting import BLACK, LINES, legend_below, new_figure, save
from airmuscle.pneumatics import ProportionalValve, SecondOrderLag
from airmuscle.simulation.closed_loop import simulate_closed_loop
from airmuscle.units import bar, mm, ms

muscle = replace(am.load("dmsp-20-300").muscle, damper=am.LinearDamper(300.0))
edge = am.Valve(conductance=2.6167e-9, critical_ratio=0.433)
wanted = am.Schedule({"position": ((0, 10 * mm), (2, 30 * mm), (4, 20 * mm))})

servo = ProportionalValve(am.Supply(6 * bar), edge, edge, SecondOrderLag(frequency=80.0, damping_ratio=0.7))
pid = PID("position", "command", gain=60.0, integral_time=1.0, derivative_time=0.05, setpoint_weight=0.8)
smooth = ControlLoop(pid, period=2 * ms, setpoint=wanted)

small = am.Valve(conductance=3e-10, critical_ratio=0.433)
switched = am.FillDischarge(am.Supply(6 * bar), small, small)
solenoid = SolenoidDriver(opening_delay=3 * ms, closing_delay=2 * ms)
two_point = OnOffController("position", SplitRange("fill", "discharge"), hysteresis=1 * mm)
rough = ControlLoop(two_point, period=5 * ms, setpoint=wanted, drivers={"fill": solenoid, "discharge": solenoid})

figure, (left, right) = new_figure(2, 1, height=4.6, sharex=True)
pairs = (("PID, proportional valve", servo, smooth), ("two-point, on/off valves", switched, rough))
for i, (name, circuit, loop) in enumerate(pairs):
    plant = am.Plant(muscle, circuit, am.HangingMass(10.0))
    start = am.find_equilibrium(plant, pressure=0.8 * bar)
    run = am.simulate(plant, loop, duration=6.0, initial_state=start)
    late = (run["time"] > 5.0) & (run["time"] < 6.0)
    away = abs(run["position"] - run["setpoint.position"])[late].max()
    print(f"{name}: at most {away / mm:.2f} mm away in the last second")
    left.plot(run["time"], run["position"] / mm, color=LINES[i], label=name)
    told = "command.command" if i == 0 else "command.fill"
    right.plot(run["time"], run[told], color=LINES[i], drawstyle="steps-post", linewidth=0.9 if i else 1.4)
left.plot(run["time"], run["setpoint.position"] / mm, color=BLACK, linestyle="--", linewidth=0.9, label="set point")
left.set_ylabel("position [mm]")
right.set(xlabel="time [s]", ylabel="spool, fill valve")
legend_below(figure, left, columns=3)
save(figure, "control.png")

plant = am.Plant(muscle, servo, am.HangingMass(10.0))
start = am.find_equilibrium(plant, pressure=0.8 * bar)
whole = simulate_closed_loop(plant, smooth, duration=3.0, start=start)
first = simulate_closed_loop(plant, smooth, duration=2.0, start=start)
second = simulate_closed_loop(
    plant, smooth, duration=1.0, start=first.state, start_time=first.time, memory=first.memory
)
print(f"cut after 2 s and taken up again it is the same run: {second.state == whole.state}")
print(*am.cite(pid), sep="\n")
print("wrote control.png")
