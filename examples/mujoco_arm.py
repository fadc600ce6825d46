"""An arm with six pneumatic muscles in MuJoCo: muscles and valves are an engine plugin, MuJoCo
carries the arm.

Needs mujoco>=3.17 (not 4.0.0) and a C compiler. The arm is that of mujoco_arm.xml; valves and
commands are chosen.
"""

import sys
import tempfile
from pathlib import Path

import airmuscle as am
from airmuscle.outlets import write_mujoco_plugin

MODEL = Path(__file__).with_name("mujoco_arm.xml")
COMMANDS = {"shoulder_flexor": 0.4, "elbow_flexor": 0.3, "biarticular_flexor": 0.2}
"""Openings of the fill valves during half a second; all muscles begin at 2 bar."""

valve = am.Valve(conductance=2.6e-9, critical_ratio=0.433)
circuit = am.FillDischarge(am.Supply(7e5), fill=valve, discharge=valve)
plant = am.Plant(am.load("dmsp-20-300").muscle, circuit, am.HangingMass(1.0))

with tempfile.TemporaryDirectory() as folder:
    made = write_mujoco_plugin(plant, folder, name="dmsp")
    if made.library is None:
        print(f"the plugin was not built: {made.remark}")
        sys.exit()
    import mujoco

    mujoco.mj_loadPluginLibrary(str(made.library))
    model = mujoco.MjModel.from_xml_path(str(MODEL))
    data = mujoco.MjData(model)
    for k in range(model.nu):
        made.initialise(model, data, model.actuator(k).name, pressure=2e5)
    for step in range(2500):
        for name, opening in COMMANDS.items():
            data.actuator(name).ctrl = opening if 1000 <= step < 1500 else 0.0
        mujoco.mj_step(model, data)
        if step % 500 == 499:
            shoulder, elbow = (
                57.29578 * float(data.joint(name).qpos[0]) for name in ("shoulder", "elbow")
            )
            tensions = " ".join(f"{-force:4.0f}" for force in data.actuator_force)
            print(
                f"{data.time:.1f} s: shoulder {shoulder:5.1f} deg, elbow {elbow:5.1f} deg, tensions"
                f" {tensions} N"
            )
    picture = Path(sys.argv[1]) if len(sys.argv) > 1 else None
    if picture:
        import matplotlib.image

        with mujoco.Renderer(model, 480, 480) as renderer:
            renderer.update_scene(data, camera="side")
            matplotlib.image.imsave(picture, renderer.render())
