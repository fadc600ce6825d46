"""Static inverse of a joint: pressures for a wanted angle and stiffness, applied by two pressure
regulators.

python examples/joint_statics.py        prints the pressures, and the angle and stiffness that
                                           the joint reaches

The joint is a plant of the library; its dimensions are chosen, and so are the wanted angles and
stiffnesses.
"""

import numpy as np

import airmuscle as am
from airmuscle.physics import joint_statics
from airmuscle.units import bar, degree

plant = am.load("joint-dmsp-20-regulators").plant
statics = joint_statics(plant)

angles = np.array([0.0, 15.0, 15.0, -15.0]) * degree
stiffnesses = np.array([30.0, 30.0, 45.0, 45.0])
points = statics.check_reachable(angles, stiffnesses)
low, high = statics.stiffness_limits(angles)
for i, angle in enumerate(angles):
    left, right = points.pressures[i, 0] / bar
    print(
        f"{angle / degree:5.1f} degrees, {stiffnesses[i]:.0f} of {low[i]:.0f} to {high[i]:.0f} N"
        f" m/rad: {left:.2f} and {right:.2f} bar, {points.shut_valves[i, 0]:.0f} N m/rad with"
        " closed valves"
    )

hold = 2.0
times = hold * np.arange(len(angles))
schedule = {
    f"{muscle.name}.setpoint": tuple(zip(times, points.pressures[:, 0, k], strict=True))
    for k, muscle in enumerate(plant.muscles)
}
start = am.find_equilibrium(plant, pressure=tuple(points.pressures[0, 0]))
run = am.simulate(plant, am.Schedule(schedule), duration=hold * len(angles), initial_state=start)
reached = statics.with_columns(run)
for time, angle in zip(times, angles, strict=True):
    row = int(np.searchsorted(run["time"], time + 0.99 * hold))
    found = round(run["angle"][row] / degree, 2) + 0.0  # without a negative zero
    print(
        f"at {time + 0.99 * hold:.2f} s: {found:.2f} degrees (wanted {angle / degree:.0f}),"
        f" stiffness {reached['stiffness'][row]:.1f} N m/rad, co-contraction"
        f" {reached['cocontraction'][row]:.1f} N m"
    )
