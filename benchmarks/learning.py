"""Actuators of learning stacks: a step of 4096 x 8 muscles in PyTorch, Warp and ONNX Runtime,
beside BatchStepper.

python benchmarks/learning.py
"""

from __future__ import annotations

import dataclasses
import importlib.util
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from environments import is_installed
from measure import Section, Target, format_time, print_section, time_variants

import airmuscle as am
from airmuscle.engine import Single
from airmuscle.engine.processes import available_cores
from airmuscle.engine.run.batch.stepper import BatchStepper
from airmuscle.physics import open_plant

ENVIRONMENTS = 4096
MUSCLES = 8
DT = 1e-3
COUNT = ENVIRONMENTS * MUSCLES
PLANTS = {"valves": ("lift-dmsp-20", ""), "regulator": ("joint-dmsp-20-itv2050", "left")}
"""A muscle between two on/off valves (one state), and one behind a pressure regulator with heat
(ten states).
"""
HEADER = ("what", "median", "minimum", "muscle steps a second")
TEXT = (
    f"One `compute` of {ENVIRONMENTS} x {MUSCLES} muscles DMSP-20-300: outputs, and a step of RK4"
    f" of {DT * 1e3:g} ms, in single precision, on {available_cores()} cores. `valves` is"
    " `lift-dmsp-20`, `regulator` a muscle of `joint-dmsp-20-itv2050`. PyTorch is compiled by"
    " `torch.compile`. Warp runs the threads of a kernel one after the other on one core; its"
    " kernels are made for GPUs. `BatchStepper` is the step of `simulate_batch`, with outputs."
)


def module_of(plant: Any, muscle: str, stack: Any, suffix: str = "") -> ModuleType:
    """The module of an actuator."""
    folder = Path(tempfile.mkdtemp())
    am.outlets.write_actuator(plant, folder, stack, name="muscle", muscle=muscle)
    path = folder / f"muscle{suffix}.py"
    spec = importlib.util.spec_from_file_location(f"{path.stem}_{folder.name}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def torch_step(plant: Any, muscle: str, command: float) -> Callable[[], Any]:
    """A step of the module of PyTorch, compiled."""
    import torch

    torch.set_num_threads(available_cores())
    module = module_of(plant, muscle, am.outlets.TorchStack())
    actuator = module.Muscle((ENVIRONMENTS, MUSCLES))
    shape = (ENVIRONMENTS, MUSCLES)
    length = torch.full(shape, 0.95 * module.RESTING_LENGTH)
    state, compute = actuator.start(1e5, length), torch.compile(actuator.compute)
    given = torch.full(shape, command), length, torch.zeros(shape)

    def run() -> Any:
        with torch.inference_mode():
            return compute(state, *given, DT)

    return run


def warp_step(plant: Any, muscle: str, command: float) -> Callable[[], Any]:
    """A step of the kernels of Warp on the processor."""
    import warp as wp

    wp.config.quiet = True
    module = module_of(plant, muscle, am.outlets.WarpStack(), "_warp")
    actuator = module.Muscle(COUNT, device="cpu")
    length = 0.95 * module.RESTING_LENGTH
    actuator.start(1e5, length)
    given = [
        wp.full(COUNT, value, dtype=module.real, device="cpu") for value in (command, length, 0.0)
    ]
    return lambda: actuator.compute(*given, DT)


def onnx_step(plant: Any, muscle: str, command: float) -> Callable[[], Any]:
    """A step of the graph by ONNX Runtime."""
    import onnxruntime as runtime

    folder = Path(tempfile.mkdtemp())
    am.outlets.write_actuator(
        plant, folder, am.outlets.OnnxStack(Single()), name="muscle", muscle=muscle
    )
    options = runtime.SessionOptions()
    options.intra_op_num_threads = available_cores()
    options.log_severity_level = 3
    sessions = [
        runtime.InferenceSession(
            str(folder / f"{name}.onnx"), options, providers=["CPUExecutionProvider"]
        )
        for name in ("muscle_start", "muscle")
    ]
    full = {"command": command, "length": 0.95 * 0.3, "speed": 0.0}
    given = {key: np.full(COUNT, value, np.float32) for key, value in full.items()}
    (state,) = sessions[0].run(
        ["state"], {"pressure": np.full(COUNT, 1e5, np.float32), "length": given["length"]}
    )
    given |= {"state": state, "dt": np.array(DT, np.float32)}
    return lambda: sessions[1].run(["tension", "next_state"], given)


def library_step(plant: Any, muscle: str, command: float) -> Callable[[], Any]:
    """A step of the library's lanes."""
    alone = plant
    if muscle:
        first = {
            "muscle": plant.muscles[0],
            "circuit": plant.circuits[0],
            "mechanism": am.HangingMass(1.0),
        }
        alone = dataclasses.replace(plant, **first)
    part = open_plant(alone, (0.015,))
    stepper = BatchStepper(part, COUNT, am.RungeKutta4(DT), precision=Single())
    state = list(part.state_at(pressure=1e5).values())
    stepper.states[:] = np.array(state)[None, :, None]
    inputs = {"shortening": 0.015, **dict.fromkeys(("fill", "setpoint"), command)}
    stepper.inputs[:] = np.array([inputs.get(name, 0.0) for name in part.inputs])[None, :, None]
    return lambda: stepper.advance(1)


STACKS = {"torch": torch_step, "warp": warp_step, "onnxruntime": onnx_step}


def section(rounds: int = 9) -> Section:
    """The complete benchmark."""
    runs: dict[str, Callable[[], Any]] = {}
    for kind, (name, muscle) in PLANTS.items():
        plant = am.load(name).plant
        command = 0.5 if kind == "valves" else 3e5
        runs[f"BatchStepper, {kind}"] = library_step(plant, muscle, command)
        for package, step in STACKS.items():
            if is_installed(package) and (package != "onnxruntime" or is_installed("onnx")):
                runs[f"{package}, {kind}"] = step(plant, muscle, command)
    times = time_variants(runs, rounds)
    rows = [
        (
            name,
            *(format_time(t) for t in (time.median, time.minimum)),
            f"{COUNT / time.minimum / 1e6:.3g} M",
        )
        for name, time in times.items()
    ]
    targets = [
        Target(f"learning: 4096 x 8 muscles, {name}", times[name].minimum * 1e3, 2.0, "ms")
        for name in times
        if name.startswith("torch")
    ]
    missing = [
        package for package in ("torch", "warp", "onnx", "onnxruntime") if not is_installed(package)
    ]
    note = f" Not installed and omitted: {', '.join(missing)}." if missing else ""
    return Section("Actuators of learning stacks", TEXT + note, HEADER, tuple(rows), tuple(targets))


if __name__ == "__main__":
    print_section(section())
