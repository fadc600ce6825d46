"""A cam on which a muscle gives a constant stiffness, and the joint that turns on it.

The muscle is held at 4 bar by a regulator; a constant torque pulls against it. The joint comes to
rest where the curve of the cam has this torque.
"""

import dataclasses
from pathlib import Path

import numpy as np

import airmuscle as am
from airmuscle.files import load_law, load_plant
from airmuscle.physics import ArmLink, Isothermal, JointWithExternalTorque, PlanarArm

OUT = Path("report/examples/cam_joint")

curve = am.design.linear_curve(0.0, np.radians(90.0), torque=10.0, stiffness=4.0)
cam = am.design.design_cam(curve, load_law("dmsp-20-300"), pressure=4e5, distance=0.3)
OUT.mkdir(parents=True, exist_ok=True)
(OUT / "cam.dxf").write_text(am.design.cam_dxf(cam), encoding="utf-8")
(OUT / "cam.svg").write_text(am.design.cam_svg(cam), encoding="utf-8")
print(f"moment arm {1e3 * cam.arm.min():.1f} to {1e3 * cam.arm.max():.1f} mm")

muscle = dataclasses.replace(cam.muscle.muscle, damper=am.LinearDamper(200.0))
regulator = load_plant("joint-dmsp-20-regulators").plant.circuits[0]
arm = PlanarArm((ArmLink(0.2, 0.1, 0.1, 0.02, 0.5),), (cam.route(),), 0.0)
plant = am.Plant(muscle, regulator, JointWithExternalTorque(arm), Isothermal())
for load in (8.0, 10.0, 12.0):
    inputs = am.Schedule({"setpoint": ((0.0, 4e5),), "external_torque": ((0.0, -load),)})
    start = plant.state_at(pressure=4e5)
    run = am.simulate(plant, inputs, duration=8.0, initial_state=start)
    angle = run["joint1.angle"][-1] + cam.middle
    print(
        f"load {load:.0f} N m: rest at {np.degrees(angle):.1f} deg, {curve.torque(angle):.2f} N m"
    )
