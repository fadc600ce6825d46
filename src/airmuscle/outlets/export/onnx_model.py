"""ONNX models of an actuator: a graph of its start, and one of a step with the states as input and output."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...core.errors import AirmuscleError
from ...engine.compile.ir import emission
from ...engine.compile.ir.instructions import instructions
from ...engine.compile.onnx_graph import GraphBody
from .actuator import ActuatorModel

OPSET, IR_VERSION = 17, 8
"""Versions of the operators and of the format: ONNX Runtime reads them from 1.12 on."""


def onnx_models(
    name: str,
    title: str,
    model: ActuatorModel,
    provenance: Sequence[str],
    single: bool,
    *,
    tunable: bool,
    substeps: int,
) -> dict[str, bytes]:
    """The graphs NAME_start.onnx and NAME.onnx; a step of dt is divided into so many steps of the integrator.

    tunable  whether the parameters (P, 1) or (P, count) are an input; otherwise they are constants


    Raises AirmuscleError without the package onnx.
    """
    try:
        import onnx
    except ImportError:
        raise AirmuscleError("an ONNX graph needs the package 'onnx'; pip install airmuscle[learning].") from None
    start, begun = _Graph(), ("pressure", "length")
    start.append(*model.start, {"q": dict(enumerate(begun))}, "x")
    step, driven = _Graph(), ("command", "length", "speed")
    rows = dict(enumerate(driven))
    step.append(*model.observe, {"z": rows}, "o")
    step.nodes.append(("Div", ("dt", step.constant(float(substeps))), "h"))
    for k in range(substeps):
        moved = step.node("Mul", step.constant(float(k)), step.node("Mul", "h", "speed"))
        at = step.node("Add", "length", moved) if k else "length"
        step.append(*model.step_of_time, {"z": {**rows, 1: at}}, "y")
        step.results["x"] = step.results.pop("y")
    observed = step.results["o"]
    valid = step.node("Greater", observed[2], step.constant(0.5))
    rows_out = {"tension": observed[0], "pressure": observed[1], "valid": valid}
    given = ("state", *driven, "dt")
    models = {
        f"{name}_start.onnx": _model(onnx, start, model, single, tunable, begun, {"state": "x"}, {}),
        f"{name}.onnx": _model(onnx, step, model, single, tunable, given, {"next_state": "x"}, rows_out),
    }
    for each in models.values():
        onnx.helper.set_model_props(each, _facts(title, model, provenance))
    return {file: each.SerializeToString() for file, each in models.items()}


def _facts(title: str, model: ActuatorModel, provenance: Sequence[str]) -> dict[str, str]:
    """The metadata of both graphs."""
    low, high = model.command_range
    return {
        "title": title, "provenance": "\n".join(provenance), "step": repr(model.step),
        "command": f"{low!r} to {high!r}", "states": ", ".join(s.name for s in model.part.states),
        "parameters": ", ".join(leaf.path for leaf in model.parameters),
    }  # fmt: skip


class _Graph(GraphBody):
    """The nodes of a model; its arrays are the states and the parameters."""

    def __init__(self) -> None:
        super().__init__({"x": "state", "p": "parameters"})
        self.scalars = frozenset({"h"})

    def append(self, inputs: Mapping[str, Any], result: Any, rows: Mapping[str, dict[int, str]], output: str) -> None:
        """Append a function of arrays, of which `rows` has the tensors of single elements."""
        self.results |= {array: dict(elements) for array, elements in rows.items()}
        code = instructions(list(inputs.values()), [result])
        values = emission.computed(self, code, list(inputs), {}, {})
        self.results[output] = {index: value for (_, index), value in values.items()}


def _model(
    onnx: Any, graph: _Graph, model: ActuatorModel, single: bool, tunable: bool, inputs: Sequence[str],
    arrays: Mapping[str, str], rows: Mapping[str, str],
) -> Any:  # fmt: skip
    """A model whose inputs are rows (count,), the states (n, count), and numbers."""
    helper, kind = onnx.helper, onnx.TensorProto.FLOAT if single else onnx.TensorProto.DOUBLE
    number, shapes = np.float32 if single else np.float64, {"state": (len(model.part.states), "count"), "dt": ()}
    nodes = [helper.make_node(operator, list(given), [result]) for operator, given, result in graph.nodes]
    row = next(name for name in inputs if name not in shapes)
    nodes.append(helper.make_node("Shape", [row], ["count"]))
    outputs = []
    for name, value in rows.items():
        nodes.append(helper.make_node("Expand", [value, "count"], [name]))
        outputs.append(
            helper.make_tensor_value_info(name, onnx.TensorProto.BOOL if name == "valid" else kind, ("count",))
        )
    for name, array in arrays.items():
        elements = [graph.results[array][i] for i in sorted(graph.results[array])]
        for i, value in enumerate(elements):
            nodes.append(helper.make_node("Expand", [value, "count"], [f"{name}_row{i}"]))
            nodes.append(helper.make_node("Unsqueeze", [f"{name}_row{i}", "first_axis"], [f"{name}_table{i}"]))
        nodes.append(helper.make_node("Concat", [f"{name}_table{i}" for i in range(len(elements))], [name], axis=0))
        outputs.append(helper.make_tensor_value_info(name, kind, (len(elements), "count")))
    constants: dict[str, Any] = {
        name: np.int64(value) if name[0] == "i" else number(value) for name, value in graph.constants.items()
    }
    defaults = np.array([float(leaf.value) for leaf in model.parameters], number)[:, None]
    constants |= {"first_axis": np.zeros(1, np.int64), **({} if tunable else {"parameters": defaults})}
    given = [helper.make_tensor_value_info(name, kind, shapes.get(name, ("count",))) for name in inputs]
    if tunable:
        given.append(helper.make_tensor_value_info("parameters", kind, (len(defaults), "width")))
    stored = [onnx.numpy_helper.from_array(np.asarray(value), name) for name, value in constants.items()]
    whole = helper.make_graph(nodes, "actuator", given, outputs, stored)
    opset = [helper.make_opsetid("", OPSET)]
    made = helper.make_model(whole, opset_imports=opset, ir_version=IR_VERSION, producer_name="airmuscle")
    onnx.checker.check_model(made)
    return made
