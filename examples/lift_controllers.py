"""Position control of a load: PID with a proportional valve, and on/off control with two small
solenoid valves.

python examples/lift_controllers.py        writes report/examples/control.png

The muscle is the DMSP-20-300 of Martens and Boblan; load, size and dynamics of the small valves,
gains and sample times are chosen.
"""

from dataclasses import replace

import airmuscle as am
from airmuscle.control import PID, OnOffController
from airmuscle.core import plotting
from airmuscle.engine import ControlLoop, Problem, SolenoidDriver, SplitRange, solve
from airmuscle.physics import ProportionalValve, SecondOrderLag
from airmuscle.units import bar, mm, ms

muscle = replace(am.load("dmsp-20-300").muscle, damper=am.LinearDamper(300.0))
edge = am.Valve(conductance=2.6167e-9, critical_ratio=0.433)
setpoint = am.Schedule({"position": ((0, 10 * mm), (2, 30 * mm), (4, 20 * mm))})

proportional_valve = ProportionalValve(
    am.Supply(6 * bar), edge, edge, SecondOrderLag(frequency=80.0, damping_ratio=0.7)
)
pid = PID(
    "position", "command", gain=60.0, integral_time=1.0, derivative_time=0.05, setpoint_weight=0.8
)
pid_loop = ControlLoop(pid, sample_time=2 * ms, setpoint=setpoint)

small_valve = am.Valve(conductance=3e-10, critical_ratio=0.433)
solenoid_valves = am.FillDischarge(am.Supply(6 * bar), small_valve, small_valve)
solenoid = SolenoidDriver(opening_delay=3 * ms, closing_delay=2 * ms)
on_off = OnOffController("position", SplitRange("fill", "discharge"), hysteresis=1 * mm)
on_off_loop = ControlLoop(
    on_off, sample_time=5 * ms, setpoint=setpoint, drivers={"fill": solenoid, "discharge": solenoid}
)

figure, (left, right) = plotting.new_figure(2, 1, height=4.6, sharex=True)
cases = (
    ("PID, proportional valve", proportional_valve, pid_loop),
    ("on/off control, solenoid valves", solenoid_valves, on_off_loop),
)
for i, (name, circuit, loop) in enumerate(cases):
    plant = am.Plant(muscle, circuit, am.HangingMass(10.0))
    start = am.find_equilibrium(plant, pressure=0.8 * bar)
    run = am.simulate(plant, loop, duration=6.0, initial_state=start)
    late = (run["time"] > 5.0) & (run["time"] < 6.0)
    error = abs(run["position"] - run["setpoint.position"])[late].max()
    print(f"{name}: maximum error {error / mm:.2f} mm in the last second")
    left.plot(run["time"], run["position"] / mm, color=plotting.LINES[i], label=name)
    column = "command.command" if i == 0 else "command.fill"
    right.plot(
        run["time"],
        run[column],
        color=plotting.LINES[i],
        drawstyle="steps-post",
        linewidth=0.9 if i else 1.4,
    )
left.plot(
    run["time"],
    run["setpoint.position"] / mm,
    color=plotting.BLACK,
    linestyle="--",
    linewidth=0.9,
    label="setpoint",
)
left.set_ylabel("position [mm]")
right.set(xlabel="time [s]", ylabel="command")
plotting.legend_below(figure, left, columns=3)
plotting.save(figure, "report/examples/control.png")

plant = am.Plant(muscle, proportional_valve, am.HangingMass(10.0))
start = am.find_equilibrium(plant, pressure=0.8 * bar)
complete = solve(Problem(plant, pid_loop, duration=3.0, initial_state=start))
first = solve(Problem(plant, pid_loop, duration=2.0, initial_state=start))
second = solve(first.continuation(duration=1.0))
same = second.final_state == complete.final_state
print(f"stopped after 2 s and resumed, the run has the same final state: {same}")
print(*am.cite(pid), sep="\n")
print("wrote report/examples/control.png")
