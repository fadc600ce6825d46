"""Models of ONNX: graphs with named arrays and rows as inputs and outputs, and their parameters."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...core import AirmuscleError, Leaf, install_command
from ...engine.compile.ir import emission
from ...engine.compile.ir.instructions import instructions
from ...engine.compile.onnx_graph import GraphBody
from ...engine.run.batch import Precision, Single

OPSET = 17
IR_VERSION = 8
"""Versions of the operators and of the format: ONNX Runtime reads them from 1.12 on."""
NEXT_STATE = "next_state"
"""Name of the output with the states after a step."""
COUNT = "count"
"""Name of the size of the batch in a shape."""


class Graph(GraphBody):
    """The nodes of a model; `arrays` are the names of its input tensors by the array of a
    function.
    """

    def __init__(self, arrays: Mapping[str, str]) -> None:
        super().__init__(arrays)
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

    def row(self, tensor: str, index: int) -> str:
        """A row (COUNT,) of an input tensor (rows, COUNT)."""
        return self.node("Gather", tensor, self._constant(f"i{index}", index))


@dataclasses.dataclass(frozen=True)
class OnnxInterface:
    """A graph with its inputs and outputs.

    inputs  shapes of the input tensors by name, of rows (COUNT,), arrays (rows, COUNT), numbers ()
    arrays  output tensors (rows, COUNT) by name, of the arrays that the graph has computed
    rows    output tensors (COUNT,) by name, of values of the graph
    """

    graph: Graph
    inputs: Mapping[str, tuple[Any, ...]]
    arrays: Mapping[str, str]
    rows: Mapping[str, str]


def onnx_files(
    interfaces: Mapping[str, OnnxInterface],
    parameters: Sequence[Leaf],
    precision: Precision,
    tunable: bool,
    facts: Mapping[str, str],
) -> dict[str, str | bytes]:
    """The models of interfaces by the names of their files, with `facts` as properties.

    With `tunable` the parameters are an input; beyond its bounds one makes the rows of its element
    invalid. Raises AirmuscleError without the package onnx.
    """
    try:
        import onnx
    except ImportError:
        raise AirmuscleError(
            f"an ONNX graph needs the package 'onnx'; {install_command('learning')}."
        ) from None
    single = precision == Single()
    files = dict[str, str | bytes]()
    for name, interface in interfaces.items():
        if tunable and "valid" in interface.rows:
            interface = _of_permitted(interface, parameters)
        made = _model(onnx, interface, parameters, single, tunable)
        onnx.helper.set_model_props(made, dict(facts))
        files[name] = made.SerializeToString()
    return files


def _model(
    onnx: Any, interface: OnnxInterface, parameters: Sequence[Leaf], single: bool, tunable: bool
) -> Any:
    """The model of a graph, which is checked."""
    helper = onnx.helper
    graph = interface.graph
    kind = onnx.TensorProto.FLOAT if single else onnx.TensorProto.DOUBLE
    number = np.float32 if single else np.float64
    one_row = _row_of_count(interface)
    nodes = [
        helper.make_node(operator, list(operands), [result])
        for operator, operands, result in graph.nodes
    ]
    nodes.append(helper.make_node("Shape", [one_row], [COUNT]))
    outputs = []
    for name, value in interface.rows.items():
        nodes.append(helper.make_node("Expand", [value, COUNT], [name]))
        of_row = onnx.TensorProto.BOOL if name == "valid" else kind
        outputs.append(helper.make_tensor_value_info(name, of_row, (COUNT,)))
    for name, array in interface.arrays.items():
        elements = [graph.results[array][i] for i in sorted(graph.results[array])]
        for i, value in enumerate(elements):
            row = f"{name}_row{i}"
            nodes.append(helper.make_node("Expand", [value, COUNT], [row]))
            nodes.append(helper.make_node("Unsqueeze", [row, "first_axis"], [f"{name}_table{i}"]))
        tables = [f"{name}_table{i}" for i in range(len(elements))]
        nodes.append(helper.make_node("Concat", tables, [name], axis=0))
        outputs.append(helper.make_tensor_value_info(name, kind, (len(elements), COUNT)))
    constants: dict[str, Any] = {
        key: np.int64(value) if key[0] == "i" else number(value)
        for key, value in graph.constants.items()
    }
    defaults = np.array([float(leaf.value) for leaf in parameters], number)[:, None]
    constants |= {
        "first_axis": np.zeros(1, np.int64),
        **({} if tunable else {"parameters": defaults}),
    }
    inputs = [
        helper.make_tensor_value_info(name, kind, shape) for name, shape in interface.inputs.items()
    ]
    if tunable:
        inputs.append(helper.make_tensor_value_info("parameters", kind, (len(defaults), "width")))
    stored = [
        onnx.numpy_helper.from_array(np.asarray(value), name) for name, value in constants.items()
    ]
    graph_proto = helper.make_graph(nodes, "actuator", inputs, outputs, stored)
    opset = [helper.make_opsetid("", OPSET)]
    made = helper.make_model(
        graph_proto, opset_imports=opset, ir_version=IR_VERSION, producer_name="airmuscle"
    )
    onnx.checker.check_model(made)
    return made


def _row_of_count(interface: OnnxInterface) -> str:
    """A tensor (COUNT,): an input, or a row of an input array."""
    rows = [name for name, shape in interface.inputs.items() if shape == (COUNT,)]
    if rows:
        return rows[0]
    array = next(name for name, shape in interface.inputs.items() if len(shape) == 2)
    return interface.graph.row(array, 0)


def _of_permitted(interface: OnnxInterface, parameters: Sequence[Leaf]) -> OnnxInterface:
    """The interface with rows and arrays that are invalid, and NaN, where a parameter is beyond its
    bounds; states remain.
    """
    graph = interface.graph
    permitted = ""
    for i, leaf in enumerate(parameters):
        value = graph.load("p", i)
        low, high = leaf.declared.bounds
        for operator, bound in (("GreaterOrEqual", low), ("LessOrEqual", high)):
            within = graph.node(operator, value, graph.constant(float(bound)))
            permitted = graph.node("And", permitted, within) if permitted else within
    missing = graph.constant(float("nan"))
    rows = {
        name: graph.node("And", value, permitted)
        if name == "valid"
        else graph.node("Where", permitted, value, missing)
        for name, value in interface.rows.items()
    }
    for name, array in interface.arrays.items():
        if name != NEXT_STATE:
            graph.results[array] = {
                i: graph.node("Where", permitted, value, missing)
                for i, value in graph.results[array].items()
            }
    return dataclasses.replace(interface, rows=rows)
