"""Actuators for learning stacks: modules of PyTorch and Warp and graphs of ONNX, with adapters for
robot simulators.
"""

import abc
import dataclasses
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...core import Array, Leaf, ParameterError
from ...engine.compile.ir.emission import TargetLanguage
from ...engine.compile.text.languages import TorchLanguage, WarpLanguage
from ...engine.run.batch import Double, Precision, Single
from ...files import load_scenario
from ...files.library.uncertainty import ParameterUncertainty
from ...physics import ExternalLoad, Muscle, Plant
from .actuator import ActuatorModel, actuator_model, control_range
from .identifiers import filled, line_comment, program_name, provenance, template
from .onnx_model import NEXT_STATE, Graph, OnnxInterface, onnx_files
from .write import write_files

NOTE = (
    "The functions are those of the model. The command is held and the length moves at its speed"
    " within a step; the flag says where the validity range of the muscle is left."
)


@dataclasses.dataclass(frozen=True, eq=False)
class ExportedActuator:
    """An actuator ready for a stack.

    identified, root  parameters with an uncertainty, by path, and the root (K, K) of their
                      covariance [SI]
    """

    name: str
    title: str
    model: ActuatorModel
    provenance: Sequence[str]
    identified: tuple[str, ...]
    root: Array

    def files(
        self, language: TargetLanguage, templates: Mapping[str, str], **more: str
    ) -> dict[str, str | bytes]:
        """The filled templates, by the ends of the names of their files."""
        model = self.model
        low, high = control_range(self.model.controls)
        functions, held_count = model.print_functions(language)
        controls = model.controls
        command = f"{controls[0].name}: {controls[0].meaning}" if controls else "without effect"
        if len(controls) == 2:
            command = f"{controls[0].name} where positive, {controls[1].name} where negative"
        places = more | parameter_places(
            self.name, self.title, self.provenance, model.parameters, self.identified, self.root
        )
        places |= {
            "functions": functions,
            "held": str(max(held_count, 1)),
            "unit": controls[0].unit if controls else "1",
            "command": command,
            "length": repr(float(model.part.resting_lengths[0])),
            "low": repr(float(low)),
            "high": repr(float(high)),
            "step": repr(float(model.step)),
            "states": tuple_text(s.name for s in model.part.states),
        }
        return {
            f"{self.name}{end}.py": filled(f"{stack}_actuator.pyt", places, self.name)
            for end, stack in templates.items()
        }


class Stack(abc.ABC):
    """A learning stack that an actuator is written for."""

    @abc.abstractmethod
    def files(self, actuator: ExportedActuator) -> dict[str, str | bytes]:
        """The files by name."""


@dataclasses.dataclass(frozen=True)
class TorchStack(Stack):
    """A module of PyTorch, with adapters for mjlab and Isaac Lab."""

    @property
    def language(self) -> TorchLanguage:
        """The language of its functions."""
        return TorchLanguage()

    @property
    def places(self) -> dict[str, str]:
        """Values of places of its templates that are common to all modules."""
        return {"parameter_methods": template("torch_parameters.pyt")}

    def files(self, actuator: ExportedActuator) -> dict[str, str | bytes]:
        templates = {"": "torch", "_mjlab": "mjlab", "_isaaclab": "isaaclab"}
        return actuator.files(self.language, templates, **self.places)


@dataclasses.dataclass(frozen=True)
class WarpStack(Stack):
    """Kernels of NVIDIA Warp, with an adapter for Newton."""

    precision: Precision = Single()

    @property
    def language(self) -> WarpLanguage:
        """The language of its functions."""
        return WarpLanguage()

    @property
    def places(self) -> dict[str, str]:
        """Values of places of its templates that are common to all modules."""
        return {
            "real": "wp.float32" if self.precision == Single() else "wp.float64",
            "parameter_methods": template("warp_parameters.pyt"),
            "own_functions": template("warp_functions.pyt").rstrip("\n"),
        }

    def files(self, actuator: ExportedActuator) -> dict[str, str | bytes]:
        templates = {"_warp": "warp", "_newton": "newton"}
        return actuator.files(self.language, templates, **self.places)


@dataclasses.dataclass(frozen=True)
class OnnxStack(Stack):
    """Graphs of ONNX with states as inputs and outputs: one of the start, one of a step."""

    precision: Precision = Double()
    tunable: bool = False
    """Whether the parameters are an input; beyond its bounds one makes its muscle invalid."""
    substeps: int = 1
    """Steps of the integrator in a step of the graph."""

    def files(self, actuator: ExportedActuator) -> dict[str, str | bytes]:
        """The graphs NAME_start.onnx and NAME.onnx. Raises AirmuscleError without the package
        onnx.
        """
        name = actuator.name
        model = actuator.model
        arrays = {"x": "state", "p": "parameters"}
        start = Graph(arrays)
        begun = ("pressure", "length")
        start.append(*model.start, {"q": dict(enumerate(begun))}, "x")
        step = Graph(arrays)
        driven = ("command", "length", "speed")
        rows = dict(enumerate(driven))
        step.append(*model.observe, {"z": rows}, "o")
        step.nodes.append(("Div", ("dt", step.constant(float(self.substeps))), "h"))
        for k in range(self.substeps):
            moved = step.node("Mul", step.constant(float(k)), step.node("Mul", "h", "speed"))
            at = step.node("Add", "length", moved) if k else "length"
            step.append(*model.step_of_time, {"z": {**rows, 1: at}}, "y")
            step.results["x"] = step.results.pop("y")
        observed = step.results["o"]
        valid = step.node("Greater", observed[2], step.constant(0.5))
        rows_out = {"tension": observed[0], "pressure": observed[1], "valid": valid}
        low, high = control_range(model.controls)
        facts = {
            "title": actuator.title,
            "provenance": "\n".join(actuator.provenance),
            "step": repr(model.step),
            "command": f"{low!r} to {high!r}",
            "states": ", ".join(s.name for s in model.part.states),
            "parameters": ", ".join(leaf.path for leaf in model.parameters),
        }
        each = dict.fromkeys((*begun, *driven), ("count",))
        stepped: dict[str, tuple[Any, ...]] = {"state": (len(model.part.states), "count")}
        stepped |= {name: each[name] for name in driven} | {"dt": ()}
        interfaces = {
            f"{name}_start.onnx": OnnxInterface(
                start, {name: each[name] for name in begun}, {"state": "x"}, {}
            ),
            f"{name}.onnx": OnnxInterface(step, stepped, {NEXT_STATE: "x"}, rows_out),
        }
        return onnx_files(interfaces, model.parameters, self.precision, self.tunable, facts)


def write_actuator(
    plant: Plant,
    folder: str | Path,
    stack: Stack = TorchStack(),
    *,
    name: str = "",
    title: str = "",
    muscle: str = "",
    step: float | None = None,
    uncertainty: ParameterUncertainty | None = None,
) -> tuple[Path, ...]:
    """Write one muscle of a plant with its circuit as a batched actuator of a learning stack; the
    paths of its files.

    plant        its load is left out: the simulator carries it
    stack        TorchStack(), WarpStack(precision) or OnnxStack(precision)
    muscle       name of the muscle, if the plant has several, each with a circuit of its own
    step         the longest step of the integrator [s]; by default 1 ms, or less where the plant is
                 faster
    uncertainty  of the parameters of the muscle, as its file states it, from which `randomise`
                 draws

    Raises ParameterError for a plant that cannot be exported, and FileError.
    """
    model = actuator_model(plant, muscle=muscle, step=step)
    title = title or model.part.muscles[0].name
    known = {leaf.path for leaf in model.parameters}
    identified = list[str]()
    root = np.zeros((0, 0))
    if uncertainty is not None:
        for path in uncertainty.parameters:
            identified.append(
                "muscle." + re.sub(r"^characteristic\b", "contractile", path)
            )  # its name in a plant
            if identified[-1] not in known:
                text = (
                    f"write_actuator: the plant has no parameter '{identified[-1]}' of the"
                    " uncertainty."
                )
                raise ParameterError(text)
        root = uncertainty.deviations(np.eye(len(identified))).T
    lines = provenance(title, model.part, (), [NOTE])
    actuator = ExportedActuator(
        program_name(name, title), title, model, lines, tuple(identified), root
    )
    return write_files(stack.files(actuator), folder)


def regulated_plant(muscle: Muscle) -> Plant:
    """A muscle behind the pressure regulator SMC ITV2050 of the library (`vessel-smc-itv2050`),
    open to its load.

    The regulator is one that was fitted to published responses with a vessel, not to this muscle.
    """
    return Plant(muscle, load_scenario("vessel-smc-itv2050").plant.circuit, ExternalLoad())


def parameter_places(
    name: str,
    title: str,
    lines: Sequence[str],
    parameters: Sequence[Leaf],
    identified: Sequence[str],
    root: Array,
) -> dict[str, str]:
    """Values of the places of a template that state a program, its parameters and their
    covariance.
    """
    bounds = np.array([leaf.declared.bounds for leaf in parameters], dtype=float).reshape(-1, 2)
    return {
        "provenance": line_comment(lines).replace("%", "#"),
        "title": title,
        "class": "".join(word[:1].upper() + word[1:] for word in name.split("_")),
        "file": name,
        "parameters": tuple_text(leaf.path for leaf in parameters),
        "defaults": tuple_text(float(leaf.value) for leaf in parameters),
        "lower": tuple_text(bounds[:, 0].tolist()),
        "upper": tuple_text(bounds[:, 1].tolist()),
        "identified": tuple_text(identified),
        "spread": tuple_text(tuple(row) for row in root.tolist()),
    }


def tuple_text(values: Any) -> str:
    """A tuple as text of Python."""
    return re.sub(r"-?\binf\b", lambda match: f'float("{match[0]}")', repr(tuple(values)))
