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

from ...core import AirmuscleError, Array, Leaf, ParameterError
from ...engine.compile.ir import emission
from ...engine.compile.ir.emission import TargetLanguage
from ...engine.compile.ir.instructions import instructions
from ...engine.compile.onnx_graph import GraphBody
from ...engine.compile.text.languages import TorchLanguage, WarpLanguage
from ...engine.run.batch import Double, Precision, Single
from ...files import load_scenario
from ...files.library.uncertainty import ParameterUncertainty
from ...physics import ExternalLoad, Muscle, Plant
from .actuator import ActuatorModel, actuator_model, control_range
from .identifiers import filled, line_comment, program_name, provenance
from .write import write_files

OPSET = 17
IR_VERSION = 8
"""Versions of the operators and of the format: ONNX Runtime reads them from 1.12 on."""


class _Graph(GraphBody):
    """The nodes of a model; its arrays are the states and the parameters."""

    def __init__(self) -> None:
        super().__init__({"x": "state", "p": "parameters"})
        self.scalars = frozenset({"h"})

    def append(
        self,
        inputs: Mapping[str, Any],
        result: Any,
        rows: Mapping[str, dict[int, str]],
        output: str,
    ) -> None:
        """Append a function of arrays, of which `rows` has the tensors of single elements."""
        self.results |= {array: dict(elements) for array, elements in rows.items()}
        values = emission.computed(
            self, instructions(list(inputs.values()), [result]), list(inputs)
        )
        self.results[output] = {index: value for (_, index), value in values.items()}


def _model(
    onnx: Any,
    graph: _Graph,
    model: ActuatorModel,
    single: bool,
    tunable: bool,
    inputs: Sequence[str],
    arrays: Mapping[str, str],
    rows: Mapping[str, str],
) -> Any:
    """A model whose inputs are rows (count,), the states (n, count), and numbers."""
    helper = onnx.helper
    kind = onnx.TensorProto.FLOAT if single else onnx.TensorProto.DOUBLE
    number = np.float32 if single else np.float64
    shapes = {"state": (len(model.part.states), "count"), "dt": ()}
    nodes = [
        helper.make_node(operator, list(operands), [result])
        for operator, operands, result in graph.nodes
    ]
    row = next(name for name in inputs if name not in shapes)
    nodes.append(helper.make_node("Shape", [row], ["count"]))
    outputs = []
    for name, value in rows.items():
        nodes.append(helper.make_node("Expand", [value, "count"], [name]))
        of_row = onnx.TensorProto.BOOL if name == "valid" else kind
        outputs.append(helper.make_tensor_value_info(name, of_row, ("count",)))
    for name, array in arrays.items():
        elements = [graph.results[array][i] for i in sorted(graph.results[array])]
        for i, value in enumerate(elements):
            nodes.append(helper.make_node("Expand", [value, "count"], [f"{name}_row{i}"]))
            nodes.append(
                helper.make_node(
                    "Unsqueeze", [f"{name}_row{i}", "first_axis"], [f"{name}_table{i}"]
                )
            )
        nodes.append(
            helper.make_node(
                "Concat", [f"{name}_table{i}" for i in range(len(elements))], [name], axis=0
            )
        )
        outputs.append(helper.make_tensor_value_info(name, kind, (len(elements), "count")))
    constants: dict[str, Any] = {
        key: np.int64(value) if key[0] == "i" else number(value)
        for key, value in graph.constants.items()
    }
    defaults = np.array([float(leaf.value) for leaf in model.parameters], number)[:, None]
    constants |= {
        "first_axis": np.zeros(1, np.int64),
        **({} if tunable else {"parameters": defaults}),
    }
    inputs_of_graph = [
        helper.make_tensor_value_info(name, kind, shapes.get(name, ("count",))) for name in inputs
    ]
    if tunable:
        inputs_of_graph.append(
            helper.make_tensor_value_info("parameters", kind, (len(defaults), "width"))
        )
    stored = [
        onnx.numpy_helper.from_array(np.asarray(value), name) for name, value in constants.items()
    ]
    graph_proto = helper.make_graph(nodes, "actuator", inputs_of_graph, outputs, stored)
    opset = [helper.make_opsetid("", OPSET)]
    made = helper.make_model(
        graph_proto, opset_imports=opset, ir_version=IR_VERSION, producer_name="airmuscle"
    )
    onnx.checker.check_model(made)
    return made


def _of_permitted(
    graph: _Graph, parameters: Sequence[Leaf], rows: Mapping[str, str]
) -> dict[str, str]:
    """Rows that are invalid, and NaN, where a parameter is beyond its bounds."""
    permitted = ""
    for i, leaf in enumerate(parameters):
        value = graph.load("p", i)
        low, high = leaf.declared.bounds
        for operator, bound in (("GreaterOrEqual", low), ("LessOrEqual", high)):
            within = graph.node(operator, value, graph.constant(float(bound)))
            permitted = graph.node("And", permitted, within) if permitted else within
    missing = graph.constant(float("nan"))
    numbers = {
        name: graph.node("Where", permitted, value, missing)
        for name, value in rows.items()
        if name != "valid"
    }
    return {**numbers, "valid": graph.node("And", rows["valid"], permitted)}


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
        bounds = np.array([leaf.declared.bounds for leaf in model.parameters], dtype=float).reshape(
            -1, 2
        )
        places = more | {
            "provenance": line_comment(self.provenance).replace("%", "#"),
            "title": self.title,
            "class": "".join(word[:1].upper() + word[1:] for word in self.name.split("_")),
            "file": self.name,
            "functions": functions,
            "held": str(max(held_count, 1)),
            "unit": controls[0].unit if controls else "1",
            "command": command,
            "length": repr(float(model.part.resting_lengths[0])),
            "low": repr(float(low)),
            "high": repr(float(high)),
            "step": repr(float(model.step)),
            "states": _tuple(s.name for s in model.part.states),
            "parameters": _tuple(leaf.path for leaf in model.parameters),
            "defaults": _tuple(float(leaf.value) for leaf in model.parameters),
            "lower": _tuple(bounds[:, 0].tolist()),
            "upper": _tuple(bounds[:, 1].tolist()),
            "identified": _tuple(self.identified),
            "spread": _tuple(tuple(row) for row in self.root.tolist()),
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

    def files(self, actuator: ExportedActuator) -> dict[str, str | bytes]:
        return actuator.files(
            TorchLanguage(), {"": "torch", "_mjlab": "mjlab", "_isaaclab": "isaaclab"}
        )


@dataclasses.dataclass(frozen=True)
class WarpStack(Stack):
    """Kernels of NVIDIA Warp, with an adapter for Newton."""

    precision: Precision = Single()

    def files(self, actuator: ExportedActuator) -> dict[str, str | bytes]:
        number = "wp.float32" if self.precision == Single() else "wp.float64"
        return actuator.files(WarpLanguage(), {"_warp": "warp", "_newton": "newton"}, real=number)


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
        single = self.precision == Single()
        try:
            import onnx
        except ImportError:
            raise AirmuscleError(
                "an ONNX graph needs the package 'onnx'; pip install airmuscle[learning]."
            ) from None
        start = _Graph()
        begun = ("pressure", "length")
        start.append(*model.start, {"q": dict(enumerate(begun))}, "x")
        step = _Graph()
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
        if self.tunable:
            rows_out = _of_permitted(step, model.parameters, rows_out)
        stepped = ("state", *driven, "dt")
        low, high = control_range(model.controls)
        facts = {
            "title": actuator.title,
            "provenance": "\n".join(actuator.provenance),
            "step": repr(model.step),
            "command": f"{low!r} to {high!r}",
            "states": ", ".join(s.name for s in model.part.states),
            "parameters": ", ".join(leaf.path for leaf in model.parameters),
        }
        models = {
            f"{name}_start.onnx": _model(
                onnx, start, model, single, self.tunable, begun, {"state": "x"}, {}
            ),
            f"{name}.onnx": _model(
                onnx, step, model, single, self.tunable, stepped, {"next_state": "x"}, rows_out
            ),
        }
        for model_proto in models.values():
            onnx.helper.set_model_props(model_proto, facts)
        return {file: model_proto.SerializeToString() for file, model_proto in models.items()}


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


def _tuple(values: Any) -> str:
    """A tuple as text of Python."""
    return re.sub(r"-?\binf\b", lambda match: f'float("{match[0]}")', repr(tuple(values)))
