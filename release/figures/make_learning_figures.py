"""Figures docs/images/torch.png, warp.png and onnx.png of the pages on learning stacks; they need
the extra `learning`.

Run python release/figures/make_learning_figures.py
"""

from __future__ import annotations

import importlib.util
import sys
import tempfile
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from airmuscle.core.plotting import DASHES, LINES, new_figure, save
from airmuscle.engine import Double, RungeKutta4, Schedule, simulate
from airmuscle.files import load_scenario
from airmuscle.files.library.uncertainty import ParameterUncertainty
from airmuscle.outlets import OnnxStack, TorchStack, WarpStack, write_actuator
from airmuscle.physics import open_plant

IMAGES = Path(__file__).parents[2] / "docs" / "images"
JOINT = "joint-dmsp-20-itv2050"
LIFT = "lift-dmsp-20"
SPREAD = ParameterUncertainty(
    ("damper.damping", "characteristic.wall_thickness"), (40.0, 4e-5), ((1.0, 0.0), (0.0, 1.0))
)
"""Standard errors of a damping [N s/m] and of a wall thickness [m] (chosen, for the picture)."""
DT = 1e-3


def written(source: str, stack: Any, name: str, **options: Any) -> tuple[Path, str]:
    """The folder of an actuator, and the name of its module."""
    folder = Path(tempfile.mkdtemp())
    write_actuator(load_scenario(source).plant, folder, stack, name=name, **options)
    return folder, name


def module_of(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module
    spec.loader.exec_module(module)
    return module


def draw_torch() -> None:
    """Tension of 200 muscles with parameters drawn from a covariance, behind regulators, at a
    length that moves.
    """
    import torch

    folder, name = written(JOINT, TorchStack(), "muscle", muscle="left", uncertainty=SPREAD)
    module = module_of(folder / f"{name}.py")
    actuator = module.Muscle((200,), dtype=torch.float64)
    length = 0.9 * module.RESTING_LENGTH
    actuator.randomise(generator=torch.Generator().manual_seed(1))
    state = actuator.start(1e5, length)
    rows = []
    times = np.arange(600) * DT
    for time in times:
        wave = 2.5e5 + 1.5e5 * np.sin(2 * np.pi * 3.0 * time)
        motion = (
            0.02 * np.sin(2 * np.pi * 3.0 * time),
            0.02 * 2 * np.pi * 3.0 * np.cos(2 * np.pi * 3.0 * time),
        )
        output = actuator.compute(state, wave, length + motion[0], motion[1], DT)
        state = output.state
        rows.append(output.tension.numpy())
    tension = np.array(rows)
    figure, axes = new_figure(width=6.4, height=3.4)
    low, high = np.quantile(tension, (0.025, 0.975), axis=1)
    axes.fill_between(times, low, high, color=LINES[0], alpha=0.3, label="95 % of 200 muscles")
    axes.plot(times, tension[:, :6], color=LINES[0], lw=0.6)
    axes.plot(times, np.median(tension, axis=1), color=LINES[1], label="median")
    axes.set(xlabel="time [s]", ylabel="tension [N]")
    axes.legend()
    save(figure, IMAGES / "torch.png")


def draw_warp() -> None:
    """Pressure of 300 muscles under as many commands, by one kernel launch a step."""
    import warp as wp

    folder, name = written(LIFT, WarpStack(), "muscle")
    module = module_of(folder / f"{name}_warp.py")
    count = 300
    length = 0.9 * module.RESTING_LENGTH
    actuator = module.Muscle(count, device="cpu")
    commands = np.linspace(-1.0, 1.0, count)
    actuator.start(2e5, length)
    command, at, still = (
        wp.array(v, dtype=module.real) for v in (commands, np.full(count, length), np.zeros(count))
    )
    rows = []
    for _ in range(400):
        actuator.compute(command, at, still, DT)
        rows.append(actuator.pressure.numpy().copy())
    figure, axes = new_figure(width=6.4, height=3.4)
    image = axes.imshow(
        np.array(rows).T / 1e5, origin="lower", aspect="auto", extent=(0.0, 0.4, -1.0, 1.0)
    )
    axes.set(xlabel="time [s]", ylabel="command (discharge < 0 < fill)")
    axes.grid(visible=False)
    figure.colorbar(image, ax=axes, label="pressure [bar]")
    save(figure, IMAGES / "warp.png")


def draw_onnx() -> None:
    """Tension by ONNX Runtime and by the library, and the difference of both."""
    import onnxruntime as runtime

    runtime.set_default_logger_severity(3)
    folder, name = written(LIFT, OnnxStack(Double()), "muscle")
    start, step = (
        runtime.InferenceSession(str(folder / f"{file}.onnx")) for file in (f"{name}_start", name)
    )
    part = open_plant(load_scenario(LIFT).plant, (0.02,))
    length = part.resting_lengths[0] - 0.02
    steps = 400
    (state,) = start.run(["state"], {"pressure": np.full(1, 1e5), "length": np.full(1, length)})
    commands = np.where(np.arange(steps) < 150, 0.6, np.where(np.arange(steps) < 250, 0.0, -0.5))
    rows = []
    for command in commands:
        given = {
            "state": state,
            "command": np.full(1, command),
            "length": np.full(1, length),
            "speed": np.zeros(1),
        }
        tension, state = step.run(["tension", "next_state"], {**given, "dt": np.array(DT)})
        rows.append(tension[0])
    signal = Schedule(
        {
            "fill": ((0.0, 0.6), (0.15, 0.0)),
            "discharge": ((0.25, 0.5),),
            "shortening": ((0.0, 0.02),),
        }
    )
    run = simulate(
        part,
        signal,
        duration=steps * DT,
        initial_state=part.state_at(pressure=1e5),
        output_times=DT,
        integrator=RungeKutta4(DT),
    )
    times = np.arange(steps) * DT
    at_rows = np.interp(times, run["time"], run["force"])
    figure, (above, below) = new_figure(2, width=6.4, height=4.4, sharex=True)
    above.plot(times, at_rows, color=LINES[0], label="airmuscle")
    above.plot(times, rows, color=LINES[1], ls=DASHES[1], label="ONNX Runtime")
    above.set(ylabel="tension [N]")
    above.legend()
    below.plot(times, np.array(rows) - at_rows, color=LINES[0])
    below.set(xlabel="time [s]", ylabel="difference [N]")
    save(figure, IMAGES / "onnx.png")


if __name__ == "__main__":
    draw_torch()
    draw_warp()
    draw_onnx()
