"""Whole plants for learning stacks: modules of PyTorch and Warp and graphs of ONNX of a joint or an
arm with its muscles.
"""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...bench import PlantUncertainty
from ...core import Array, ParameterError
from ...engine.compile.ir.emission import TargetLanguage
from ...physics.plant import Plant
from .identifiers import filled, program_name, provenance
from .learning import OnnxStack, Stack, TorchStack, WarpStack, parameter_places, tuple_text
from .onnx_model import NEXT_STATE, Graph, OnnxInterface, onnx_files
from .plant_model import PrintedPlant, plant_model
from .write import write_files

NOTE = (
    "The functions are those of the plant. Commands are held within a step; the flag says where the"
    " validity range of a muscle is left."
)


@dataclasses.dataclass(frozen=True, eq=False)
class ExportedPlant:
    """A plant ready for a stack.

    identified, root  parameters with an uncertainty, by path, and rows (P, K) of the root of their
                      covariance [SI]
    """

    name: str
    title: str
    model: PrintedPlant
    provenance: Sequence[str]
    identified: tuple[str, ...]
    root: Array

    def text(self, language: TargetLanguage, template: str, **more: str) -> str:
        """The filled template of a stack."""
        model = self.model
        functions, held_count = model.print_functions(language)
        inputs = model.inputs
        ranges = tuple((float(known.minimum), float(known.maximum)) for known in inputs)
        commands = ", ".join(f"{known.name} [{known.unit}]" for known in inputs)
        places = more | parameter_places(
            self.name, self.title, self.provenance, model.parameters, self.identified, self.root
        )
        places |= {
            "functions": functions,
            "held": str(max(held_count, 1)),
            "inputs_count": str(len(inputs)),
            "commands": commands,
            "names": tuple_text(known.name for known in inputs),
            "ranges": tuple_text(ranges),
            "coordinates": tuple_text(model.coordinates),
            "muscles": tuple_text(muscle.name for muscle in model.plant.muscles),
            "step": repr(float(model.step)),
            "states": tuple_text(s.name for s in model.plant.states),
        }
        return filled(template, places, self.name)


def write_plant_module(
    plant: Plant,
    folder: str | Path,
    stack: Stack = TorchStack(),
    *,
    name: str = "",
    title: str = "",
    step: float | None = None,
    pressure: float | None = None,
    uncertainty: PlantUncertainty | None = None,
) -> tuple[Path, ...]:
    """Write a whole plant, such as an identified arm, as a batched module of a learning stack; the
    paths of its files.

    stack        TorchStack(), WarpStack(precision) or OnnxStack(precision)
    step         the longest step of the integrator [s]; by default 1 ms, or less where the plant is
                 faster at gauge pressures up to twice `pressure` [Pa]
    uncertainty  of the parameters of the plant, as its scenario states it, from which `randomise`
                 draws

    Raises ParameterError for a plant without inputs, or that has no printed form, and FileError.
    """
    if not plant.inputs:
        raise ParameterError("write_plant_module: the plant has no input that could be commanded.")
    model = plant_model(plant, step, pressure)
    title = title or "plant"
    identified, root = _identified(model, uncertainty)
    lines = provenance(title, plant, (), [NOTE])
    exported = ExportedPlant(program_name(name, title), title, model, lines, identified, root)
    return write_files(_files(exported, stack), folder)


def _identified(
    model: PrintedPlant, uncertainty: PlantUncertainty | None
) -> tuple[tuple[str, ...], Array]:
    """Paths of the parameters with an uncertainty, and the rows of the root of their covariance;
    several paths of one parameter have equal rows.
    """
    if uncertainty is None:
        return (), np.zeros((0, 0))
    levels, directions = np.linalg.eigh(np.asarray(uncertainty.covariance))
    root = directions * np.sqrt(np.maximum(levels, 0.0))
    known = {leaf.path for leaf in model.parameters}
    paths = []
    rows = []
    for group, row in zip(uncertainty.parameters, root, strict=True):
        for path in group:
            if path not in known:
                raise ParameterError(
                    f"write_plant_module: the plant has no parameter '{path}' of the uncertainty."
                )
            paths.append(path)
            rows.append(row)
    return tuple(paths), np.array(rows).reshape(len(paths), len(root))


def _files(plant: ExportedPlant, stack: Stack) -> dict[str, str | bytes]:
    """The files of a stack by name. Raises ParameterError for a stack without plants."""
    name = plant.name
    if isinstance(stack, TorchStack):
        return {f"{name}.py": plant.text(stack.language, "torch_plant.pyt", **stack.places)}
    if isinstance(stack, WarpStack):
        text = plant.text(stack.language, "warp_plant.pyt", **stack.places)
        return {f"{name}_warp.py": text}
    if isinstance(stack, OnnxStack):
        return _onnx_files(plant, stack)
    raise ParameterError(
        f"{type(stack).__name__} has no whole plants; use TorchStack, WarpStack or OnnxStack, or"
        " write_actuator for one muscle."
    )


def _onnx_files(plant: ExportedPlant, stack: OnnxStack) -> dict[str, str | bytes]:
    """The graphs NAME_start.onnx and NAME.onnx: states and commands are arrays (rows, count)."""
    model = plant.model
    joints = len(model.coordinates)
    muscles = len(model.plant.muscles)
    count = len(model.plant.states)
    start = Graph({"p": "parameters"})
    begun = {"pressure": (muscles, "count"), "angle": (joints, "count")}
    places = {
        **{i: start.row("pressure", i) for i in range(muscles)},
        **{muscles + j: start.row("angle", j) for j in range(joints)},
    }
    start.append(*model.start, {"q": places}, "x")
    step = Graph({"x": "state", "u": "command", "p": "parameters"})
    first = {i: step.load("x", i) for i in range(count)}
    step.append(*model.observe, {}, "o")
    observed = step.results.pop("o")
    _append_steps(step, model, first, stack.substeps)
    sizes = {"angle": joints, "speed": joints, "pressure": muscles, "tension": muscles}
    begin = 0
    for name, rows in sizes.items():
        step.results[name] = {i: observed[begin + i] for i in range(rows)}
        begin += rows
    valid = step.node("Greater", observed[begin], step.constant(0.5))
    driven: dict[str, tuple[Any, ...]] = {
        "state": (count, "count"),
        "command": (len(model.inputs), "count"),
        "dt": (),
    }
    outputs = {name: name for name in sizes} | {NEXT_STATE: "x"}
    facts = {
        "title": plant.title,
        "provenance": "\n".join(plant.provenance),
        "step": repr(model.step),
        "commands": ", ".join(f"{i.name}: {i.minimum!r} to {i.maximum!r}" for i in model.inputs),
        "states": ", ".join(s.name for s in model.plant.states),
        "coordinates": ", ".join(model.coordinates),
        "muscles": ", ".join(muscle.name for muscle in model.plant.muscles),
        "parameters": ", ".join(leaf.path for leaf in model.parameters),
    }
    interfaces = {
        f"{plant.name}_start.onnx": OnnxInterface(start, begun, {"state": "x"}, {}),
        f"{plant.name}.onnx": OnnxInterface(step, driven, outputs, {"valid": valid}),
    }
    return onnx_files(interfaces, model.parameters, stack.precision, stack.tunable, facts)


def _append_steps(graph: Graph, model: PrintedPlant, first: dict[int, str], substeps: int) -> None:
    """Steps of the classical Runge-Kutta method; the states after them are the results "x"."""
    h = graph.node("Div", "dt", graph.constant(float(substeps)))
    state = first
    for _ in range(substeps):
        sums: dict[int, str] = {}
        point = state
        for part, weight in ((0.5, 1.0), (0.5, 2.0), (1.0, 2.0), (0.0, 1.0)):
            graph.append(*model.rates, {"x": point}, "f")
            rates = graph.results.pop("f")
            for i, rate in rates.items():
                weighed = graph.node("Mul", graph.constant(weight), rate)
                sums[i] = graph.node("Add", sums[i], weighed) if i in sums else weighed
            moved = graph.node("Mul", graph.constant(part), h)
            point = {
                i: graph.node("Add", state[i], graph.node("Mul", moved, rate))
                for i, rate in rates.items()
            }
        sixth = graph.node("Div", h, graph.constant(6.0))
        state = {
            i: graph.node("Add", state[i], graph.node("Mul", sixth, total))
            for i, total in sums.items()
        }
    graph.results["x"] = state
