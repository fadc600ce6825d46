"""Sizing of a lift: muscles of the catalogue, the best choice with its valves, and a check by
simulation.

python examples/sized_lift.py        prints the choices, the valves and the stroke that the lift
                                    reaches

Load, stroke, supply, safety factor and cycle time are chosen.
"""

import airmuscle as am
from airmuscle.design import (
    LiftRequirement,
    SizingConditions,
    discharge_valve,
    fill_valve,
    size_muscles,
)
from airmuscle.physics import HangingMass
from airmuscle.units import bar, mm

lift = LiftRequirement(stroke=40 * mm, mass=20.0)
conditions = SizingConditions(
    supply=6 * bar, safety_factor=1.5, cycle_time=2.0, max_length=400 * mm, max_count=2
)
result = size_muscles(
    lift,
    conditions,
    [am.load(name) for name in ("dmsp-10-250", "dmsp-20-300", "festo-tool-dmsp-10")],
)

for choice in result.choices:
    start = choice.design.extended
    end = choice.design.contracted
    print(
        f"{choice.count} x {choice.entry.name} of {choice.length / mm:.1f} mm:"
        f" {start.pressure / bar:.2f} to {end.pressure / bar:.2f} bar,"
        f" {1e3 * choice.reference_volume:.2f} l (ANR) a cycle"
    )
for item in result.unsuitable:
    print(f"{item.name}: {item.reason}")

choice = next(choice for choice in result.choices if choice.count == 1)
fill = fill_valve(choice, 0.75)
discharge = discharge_valve(choice, 0.75)
print(
    f"valves for 0.75 s: {1e8 * fill.conductance:.4f} and {1e8 * discharge.conductance:.4f} dm3/(s"
    " bar)"
)

muscle = am.Muscle(
    choice.entry.characteristic,
    choice.entry.geometry,
    damper=am.LinearDamper(500.0),
    ratings=choice.entry.ratings,
)
plant = am.Plant(
    muscle,
    am.FillDischarge(am.Supply(6 * bar), fill, discharge),
    HangingMass(lift.mass),
    am.Isothermal(),
)
start = choice.design.extended
state = plant.state_at(pressure=start.pressure, position=start.contraction * choice.length)
run = am.simulate(
    plant, am.Schedule({"fill": ((0.1, 1), (0.85, 0))}), duration=1.2, initial_state=state
)
print(
    f"simulated stroke: {(run['position'][-1] - run['position'][0]) / mm:.1f} mm of"
    f" {lift.stroke / mm:.0f} mm"
)
