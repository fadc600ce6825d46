"""Three muscles on a drumming wrist in MuJoCo: a stick beats a drum at 160 beats a minute.

Pulleys (14 mm), muscle length (150 mm), reference angles (7, 70 and 45 degrees) and regulators (SMC
ITV2050) are those of a published drumming robot (PorcaroRL, github.com/hasadi-robot); muscles
(DMSP-10), masses and drum are chosen, as they are not published. Needs mujoco>=3.17 (not 4.0.0) and
a C compiler.
"""

import dataclasses
import math
import sys
import tempfile

import airmuscle as am
from airmuscle.outlets import write_mjcf
from airmuscle.physics import ArmLink, MuscleRoute, PlanarArm, Plant, Supply

# of the pulleys and of the muscles [m]
RADIUS = 0.014
LENGTH = 0.15
ZERO = {
    "extensor": (1, 1, 7.0),
    "flexor": (1, -1, 70.0),
    "grip": (2, -1, 45.0),
}  # joint, sign, reference angle [deg]
# setpoints [Pa], period [s]; chosen
HIGH = 4.5e5
LOW = 0.5e5
HELD = 2.0e5
BEAT = 60.0 / 160.0

regulator = dataclasses.replace(am.load("vessel-smc-itv2050").plant.circuit, supply=Supply(6.5e5))
muscle = am.files.scale_entry(am.load("dmsp-10-250"), resting_length=LENGTH).muscle
muscles = tuple(dataclasses.replace(muscle, name=name) for name in ZERO)
routes = tuple(
    MuscleRoute((joint,), (sign * RADIUS,), -sign * RADIUS * math.radians(angle) / LENGTH)
    for joint, sign, angle in ZERO.values()
)
hand = ArmLink(0.08, mass=0.25, centre=0.05, inertia=3e-4, damping=0.1)
stick = ArmLink(0.35, mass=0.06, centre=0.15, inertia=6e-4, damping=0.02)
plant = Plant(muscles, (regulator,) * 3, PlanarArm((hand, stick), routes))

with tempfile.TemporaryDirectory() as folder:
    robot = write_mjcf(plant, folder, name="wrist")
    if robot.plugins[0].library is None:
        print(f"the plugins were not built: {robot.plugins[0].remark}")
        sys.exit()
    import mujoco

    for plugin in robot.plugins:
        mujoco.mj_loadPluginLibrary(str(plugin.library))
    spec = mujoco.MjSpec.from_file(str(robot.path))
    tip = spec.body("link2").add_geom(
        type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.01] * 3, pos=[0, 0, -0.35], mass=0
    )
    drum = spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.02, 0.15, 0.15], pos=[-0.12, 0, -0.4]
    )
    tip.name = "tip"
    drum.name = "drum"
    model = spec.compile()
    data = mujoco.MjData(model)
    for plugin, each in zip(robot.plugins, muscles, strict=True):
        plugin.initialise(model, data, each.name, pressure=HELD)
    beats = []
    touched = False
    while data.time < 4.0:
        up = data.time % BEAT < 0.5 * BEAT
        for name, setpoint in zip(
            ZERO, (HIGH, LOW, HELD) if up else (LOW, HIGH, HELD), strict=True
        ):
            data.actuator(name).ctrl = setpoint
        mujoco.mj_step(model, data)
        contact = any(
            {model.geom("tip").id, model.geom("drum").id} == set(c.geom) for c in data.contact
        )
        if contact and not touched:
            beats.append(data.time)
        touched = contact
    angle = math.degrees(float(data.joint("joint1.angle").qpos[0]))
    print(
        f"{len(beats)} beats in {data.time:.1f} s, the last at {beats[-1]:.2f} s; wrist at"
        f" {angle:.1f} deg"
    )
