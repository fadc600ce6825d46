"""Program that renders a compiled model of MuJoCo in a process of its own, because a graphics
driver that fails ends its process: render_model.py MODEL.mjb VIEW.npz PICTURE.npy
"""

import sys

import numpy as np


def main(model_path: str, view_path: str, picture_path: str) -> None:
    """Render a model in the pose and from the view of a file."""
    import mujoco

    model = mujoco.MjModel.from_binary_path(model_path)
    data = mujoco.MjData(model)
    with np.load(view_path) as view:
        data.qpos[:] = view["positions"]
        camera = mujoco.MjvCamera()
        camera.lookat[:] = view["target"]
        camera.distance, camera.azimuth, camera.elevation = view["camera"].tolist()
        height, width = view["size"].tolist()
    mujoco.mj_forward(model, data)
    options = mujoco.MjvOption()
    options.flags[mujoco.mjtVisFlag.mjVIS_TENDON] = True
    options.flags[mujoco.mjtVisFlag.mjVIS_ACTUATOR] = False
    options.sitegroup[:] = 0
    renderer = mujoco.Renderer(model, height, width)
    renderer.update_scene(data, camera, options)
    renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = False
    renderer.scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = False
    np.save(picture_path, renderer.render())


if __name__ == "__main__":
    main(*sys.argv[1:])
