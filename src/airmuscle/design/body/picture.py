"""Picture of a body with its routes in colours, rendered by MuJoCo where it can, else drawn."""

import contextlib
import functools
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...core import Array, plotting
from .body import Body
from .kinematics import BodyKinematics, Poses
from .simulator import load_simulator

WIDTH = 900
HEIGHT = 1100
"""Size of a rendered picture [pixels] (chosen)."""
BACKENDS = ("egl", "osmesa")
"""Backends of MuJoCo that render without a screen."""
PROGRAM = Path(__file__).with_name("render_model.py")
TIME_LIMIT = 60.0
"""Time that a picture may take [s] (chosen)."""
AZIMUTH = 125.0
ELEVATION = -12.0
"""Direction of view [degrees] (chosen)."""
PICTURE = 5.0
BAR = 1.4
"""Height of a figure, and width of its bar of colours [inches] (chosen)."""
WHITE = 250
MARGIN = 20
"""Least value of a white pixel, and margin of a picture [pixels] (chosen)."""
LINE = 0.004
"""Radius of a route in a picture, as a part of the size of the body (chosen)."""


def colour_of(value: float) -> tuple[float, float, float]:
    """Colour of a share: green at 0, yellow at a half, red from 1 on."""
    import matplotlib as mpl

    red, green, blue, _ = mpl.colormaps["RdYlGn_r"](float(np.clip(value, 0.0, 1.0)))
    return float(red), float(green), float(blue)


def body_figure(body: Body, shares: Sequence[float], label: str, pose: Poses | None = None) -> Any:
    """A figure of a body in a pose, the middle of the ranges by default.

    shares  of the routes: from 0, green, to 1, red
    label   of the colours
    """
    import matplotlib as mpl

    pose = middle_pose(body) if pose is None else pose
    image = _rendered(body, shares, pose)
    width = PICTURE if image is None else PICTURE * min(image.shape[1] / image.shape[0], 1.0)
    figure, axes = plotting.new_figure(width=width + BAR, height=PICTURE)
    if image is not None:
        axes.imshow(image)
        axes.set_axis_off()
    else:
        _draw(axes, body, shares, pose)
    scale = mpl.cm.ScalarMappable(mpl.colors.Normalize(0.0, 1.0), "RdYlGn_r")
    bar = figure.colorbar(scale, ax=axes, shrink=0.6, extend="max", pad=0.02)
    bar.set_label(label)
    return figure


def middle_pose(body: Body) -> Poses:
    """The pose in the middle of the ranges."""
    joints = [body.joints[name] for name in body.moving]
    middle = [
        0.5 * (joint.low + joint.high) if joint.is_limited else joint.reference for joint in joints
    ]
    return Poses(body.moving, np.array([middle]).reshape(1, len(joints)))


@functools.cache
def _backend() -> str:
    """The backend that can render, tried on a small model; empty without."""
    model = load_simulator().MjSpec().compile()
    stated = os.environ.get("MUJOCO_GL")
    view = _view(model.qpos0, np.zeros(3), 1.0, (8, 8))
    for name in (stated,) if stated else BACKENDS:
        if _picture_by(name, model, view) is not None:
            return name
    return ""


def _view(
    positions: Array, target: Array, distance: float, size: tuple[int, int]
) -> dict[str, Any]:
    """What the program that renders reads: pose, camera and size (height, width)."""
    camera = (distance, AZIMUTH, ELEVATION)
    return {"positions": positions, "target": target, "camera": camera, "size": size}


def _picture_by(backend: str, model: Any, view: dict[str, Any]) -> Array | None:
    """A picture (height, width, 3) by a backend in a process of its own; None where it fails."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        model_path, view_path, picture_path = (
            folder / file for file in ("model.mjb", "view.npz", "picture.npy")
        )
        load_simulator().mj_saveModel(model, str(model_path), None)
        np.savez(view_path, **view)
        command = [sys.executable, PROGRAM, model_path, view_path, picture_path]
        with contextlib.suppress(OSError, subprocess.SubprocessError):
            subprocess.run(
                list(map(str, command)),
                env={**os.environ, "MUJOCO_GL": backend},
                capture_output=True,
                timeout=TIME_LIMIT,
                check=True,
            )
            return np.asarray(np.load(picture_path))
    return None


def _rendered(body: Body, shares: Sequence[float], pose: Poses) -> Array | None:
    """A picture (HEIGHT, WIDTH, 3); None where MuJoCo cannot render."""
    if not _backend():
        return None
    kinematics = BodyKinematics(body)
    mujoco = kinematics.mujoco
    spec = body.file.specification()
    spec.visual.global_.offwidth = WIDTH
    spec.visual.global_.offheight = HEIGHT
    size = _size(body, pose)
    colours = {
        route.tendon: colour_of(share) for route, share in zip(body.routes, shares, strict=True)
    }
    for tendon in spec.tendons:
        if tendon.name in colours:
            tendon.rgba = [*colours[tendon.name], 1.0]
            tendon.material = ""
            tendon.width = LINE * size
            tendon.group = 0
    _light(mujoco, spec)
    model = body.file.compiled(spec)
    low, high = _extent(body, pose)
    positions = kinematics.rows(pose)[0]
    view = _view(positions, 0.5 * (low + high), 1.75 * size, (HEIGHT, WIDTH))
    image = _picture_by(_backend(), model, view)
    return None if image is None else _cropped(image)


def _cropped(image: Array) -> Array:
    """The part of a picture that is not white, with a margin."""
    is_drawn = (image < WHITE).any(axis=2)
    rows, columns = np.nonzero(is_drawn)
    if not len(rows):
        return image
    parts = [
        slice(max(0, int(filled.min()) - MARGIN), int(filled.max()) + MARGIN)
        for filled in (rows, columns)
    ]
    return np.asarray(image[parts[0], parts[1]])


def _light(mujoco: Any, spec: Any) -> None:
    """A white background, and light from everywhere."""
    for texture in list(spec.textures):
        if texture.type == mujoco.mjtTexture.mjTEXTURE_SKYBOX:
            spec.delete(texture)
    background = spec.add_texture(name="airmuscle_background", width=8, height=8)
    background.type = mujoco.mjtTexture.mjTEXTURE_SKYBOX
    background.builtin = mujoco.mjtBuiltin.mjBUILTIN_FLAT
    background.rgb1 = [1.0, 1.0, 1.0]
    background.rgb2 = [1.0, 1.0, 1.0]
    spec.visual.headlight.ambient = [0.5, 0.5, 0.5]
    spec.visual.headlight.diffuse = [0.5, 0.5, 0.5]
    spec.visual.headlight.specular = [0.0, 0.0, 0.0]
    for geom in spec.geoms:
        if geom.type in (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD):
            geom.rgba = [1.0, 1.0, 1.0, 0.0]


def _extent(body: Body, pose: Poses) -> tuple[Array, Array]:
    """Corners [m] of the box that contains bodies and routes."""
    kinematics = BodyKinematics(body)
    kinematics.place(kinematics.rows(pose)[0])
    moving = body.model.body_dofnum > 0
    points = [kinematics.data.xipos[moving]]
    points += [path for route in body.routes for path in _paths(kinematics, route.index)]
    everything = np.concatenate(points)
    return everything.min(axis=0), everything.max(axis=0)


def _size(body: Body, pose: Poses) -> float:
    low, high = _extent(body, pose)
    return float(np.linalg.norm(high - low))


def _paths(kinematics: BodyKinematics, tendon: int) -> list[Array]:
    """The points of the branches of a route [m]."""
    data = kinematics.data
    first = int(data.ten_wrapadr[tendon])
    members = range(first, first + int(data.ten_wrapnum[tendon]))
    points = np.reshape(data.wrap_xpos, (-1, 3))
    objects = np.ravel(data.wrap_obj)
    branches: list[list[Array]] = [[]]
    for member in members:
        if objects[member] == -2:
            branches.append([])
        else:
            branches[-1].append(points[member])
    return [np.array(branch) for branch in branches if branch]


def _draw(axes: Any, body: Body, shares: Sequence[float], pose: Poses) -> None:
    """The links between joints and the routes as lines, seen from the side with more of the
    body.
    """
    kinematics = BodyKinematics(body)
    kinematics.place(kinematics.rows(pose)[0])
    low, high = _extent(body, pose)
    across = 0 if high[0] - low[0] >= high[1] - low[1] else 1
    model = body.model
    for index in range(1, model.nbody):
        parent = int(model.body_parentid[index])
        ends = [kinematics.data.xpos[index], kinematics.data.xipos[index]]
        if parent > 0:
            ends.insert(0, kinematics.data.xpos[parent])
        line = np.array(ends)
        axes.plot(line[:, across], line[:, 2], color="0.75", linewidth=4.0, zorder=1)
    for route, share in zip(body.routes, shares, strict=True):
        for path in _paths(kinematics, route.index):
            axes.plot(path[:, across], path[:, 2], color=colour_of(share), linewidth=2.0, zorder=2)
    axes.set_aspect("equal")
    axes.set_xlabel(f"{'xy'[across]} in m")
    axes.set_ylabel("z in m")
