"""Workflow on one page: measured points, fitted muscle, plant with valves and load, simulation.

python examples/bench_to_simulation.py        writes report/examples/chain.png
"""

import numpy as np

import airmuscle as am
from airmuscle.core import plotting
from airmuscle.units import bar, kPa

bench = am.load_data("dmsp-20-300")
result = am.fit(am.characteristic.ContractileSurface.blank(5, max_force=1e5), bench)
print(result)

braid = am.geometry.Braid(radius=0.010, braid_angle=0.426, resting_length=0.300)
muscle = am.Muscle(result.model, braid, damper=am.LinearDamper(200.0))
valve = am.Valve(conductance=2.6167e-9, critical_ratio=0.433)
plant = am.Plant(muscle, am.FillDischarge(am.Supply(5.5 * bar), valve, valve), am.HangingMass(10.0))
run = am.simulate(
    plant, am.Schedule({"fill": ((1, 1), (4, 0)), "discharge": ((5, 1),)}), duration=8.0
)
print(f"stroke with 10 kg: {run['position'].max() * 1e3:.1f} mm")
print(*run.notes, sep="\n")
print(*am.cite(plant), sep="\n")

figure, (left, right) = plotting.new_figure(1, 2, width=9.0, height=3.2)
contraction = np.linspace(0.0, 0.26, 200)
for i, pressure in enumerate((600, 450, 312.5, 180)):
    level = np.isclose(bench["pressure"], pressure * kPa)
    left.plot(
        contraction * 100,
        result.model.force(pressure * kPa, contraction),
        color=plotting.LINES[i],
        label=f"{pressure:g}",
    )
    left.plot(
        bench["contraction"][level] * 100, bench["force"][level], "o", color=plotting.LINES[i]
    )
left.set(xlabel="contraction [%]", ylabel="force [N]", title="measured points and fitted surface")
left.legend(title="kPa gauge")
right.plot(run["time"], run["pressure"] / kPa, color=plotting.LINES[0])
right.set(
    xlabel="time [s]", ylabel="pressure [kPa gauge]", title="simulated filling and discharge, 10 kg"
)
right.yaxis.label.set_color(plotting.LINES[0])
position = right.twinx()
position.plot(run["time"], run["position"] * 1e3, color=plotting.LINES[1], linestyle="--")
position.set_ylabel("position [mm]", color=plotting.LINES[1])
position.grid(False)
plotting.save(figure, "report/examples/chain.png")
print("wrote report/examples/chain.png")
