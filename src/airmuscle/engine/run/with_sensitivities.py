"""Forward sensitivities: a system extended by the derivatives of its states with respect to chosen
parameters.
"""

import itertools
from collections.abc import Mapping, Sequence
from typing import ClassVar

from ...core import (
    Node,
    ParameterError,
    Value,
    check_known,
    model,
    nodes,
    ops,
    parameter,
    slopes,
    tree,
)
from ...core.system import Input, SensitivitySystem, StateVariable, System
from ..compile.functions import TracedSystem, trace_system

TOLERANCE_FACTOR = 10.0
"""How much more a derivative times its scale may err than the state. Chosen: without any control
derivatives are lost while the states rest, and at 1 the steps double."""


@model
class WithSensitivities(SensitivitySystem):
    """A system with s_k = dx/dtheta_k for every column k as further states, and its outputs'
    derivatives.

        s_k' = (df/dx) s_k + (df/du) v_k + df/dtheta_k,    dy/dtheta_k = (dy/dx) s_k + (dy/du) v_k +
                                                           dy/dtheta_k,
        y' = (dy/dx) f

    A column is a group of leaf paths that share one value (`("circuit.fill.conductance",
    "circuit.discharge.conductance")`), or an empty group for something that acts on the start
    alone. A step of this system is exactly the derivative of the same step of the inner system,
    because it uses the Jacobian of the whole. Columns steer the step ten times less than states do.
    Inputs that move are held in y'. `observed` names the states and outputs y; all of them unless
    named. v_k = du/dtheta_k are further inputs, `sensitivity("fill", k)`, of the inputs that
    `dependent_inputs` names: those of a controller whose measurements or parameters depend on
    theta_k (`differentiate_loop`). All other inputs are independent of the columns.

    `rates` and `outputs` are the law; what runs is printed from the inner system, all columns in
    one vector.
    """

    from_file: ClassVar[bool] = False

    inner: System
    columns: tuple[tuple[str, ...], ...]
    scales: tuple[float, ...] = parameter(
        "1", "theta_k", "size of a change of each column", fitted=False
    )
    observed: tuple[str, ...] = ()
    dependent_inputs: tuple[str, ...] = ()

    def check(self) -> None:
        if not self.columns or len(self.scales) != len(self.columns):
            raise ParameterError(
                f"WithSensitivities: {len(self.columns)} columns need as many scales (1 or more); "
                f"there are {len(self.scales)}."
            )
        known = [leaf.path for leaf in tree.leaves(self.inner)]
        check_known(
            f"{type(self.inner).__name__} has no parameter", itertools.chain(*self.columns), known
        )
        check_known(
            f"{type(self.inner).__name__} has no input", self.dependent_inputs, self.inner.inputs
        )
        names = self._all_names if self.observed else ()
        check_known(f"{type(self.inner).__name__} has no state or output", self.observed, names)

    @property
    def parameter_indices(self) -> tuple[tuple[int, ...], ...]:
        """For every column the places of its paths among the inner leaves."""
        place = {leaf.path: i for i, leaf in enumerate(tree.leaves(self.inner))}
        return tuple(tuple(place[path] for path in group) for group in self.columns)

    @property
    def input_indices(self) -> tuple[int, ...]:
        """The places of the dependent inputs among the inner inputs."""
        return tuple(self.inner.inputs.index(name) for name in self.dependent_inputs)

    @property
    def observed_names(self) -> tuple[str, ...]:
        """Names of the observed quantities."""
        return self.observed or self._all_names

    @property
    def _all_names(self) -> tuple[str, ...]:
        """Names of the states and outputs of the inner system."""
        return (*(s.name for s in self.inner.states), *trace_system(self.inner).output_names)

    @property
    def output_names(self) -> tuple[str, ...]:
        """Names of the observed quantities, of the derivatives of each by every column, and of
        their slopes in time.
        """
        names = self.observed_names
        further = [sensitivity(n, k) for n in names for k in range(len(self.columns))]
        return (*names, *further, *(f"{n}.rate" for n in names))

    @property
    def states(self) -> tuple[StateVariable, ...]:
        """The inner system's states, then for each of them the derivatives by every column."""
        inner = self.inner.states
        further = []
        for s, (k, scale) in itertools.product(inner, enumerate(self.scales)):
            nominal = TOLERANCE_FACTOR * s.nominal / scale
            further.append(
                StateVariable(sensitivity(s.name, k), s.unit, nominal, f"d {s.name} by column {k}")
            )
        return (*inner, *further)

    @property
    def inputs(self) -> tuple[str, ...]:
        """The inner system's inputs, then for each dependent one its derivatives by every
        column.
        """
        further = [
            sensitivity(name, k) for name in self.dependent_inputs for k in range(len(self.columns))
        ]
        return (*self.inner.inputs, *further)

    @property
    def input_variables(self) -> tuple[Input, ...]:
        """The inner system's inputs, then the derivatives of the dependent ones, without bounds."""
        further = []
        infinity = float("inf")
        for name, k in itertools.product(self.dependent_inputs, range(len(self.columns))):
            further.append(
                Input(sensitivity(name, k), "", -infinity, infinity, f"derivative of {name}")
            )
        return (*self.inner.input_variables, *further)

    @property
    def state_lower_bounds(self) -> Sequence[float]:
        """Those of the inner system; derivatives have none."""
        further = len(self.states) - len(self.inner.states)
        return [*self.inner.state_lower_bounds, *([-float("inf")] * further)]

    def rates(self, state: Mapping[str, Value], inputs: Mapping[str, Value]) -> dict[str, Value]:
        """The inner rates, and the variational equation of every column."""
        t = trace_system(self.inner)
        names = [s.name for s in self.inner.states]
        rates, *along, _ = self._differentiated(t, names, t.f, state, inputs)
        for k, column in enumerate(along):
            for name in names:
                rates[sensitivity(name, k)] = column[name]
        return rates

    def outputs(self, state: Mapping[str, Value], inputs: Mapping[str, Value]) -> dict[str, Value]:
        """The observed quantities, their derivatives by every column, and their slopes in time
        (`pressure.rate`).
        """
        t = trace_system(self.inner)
        names = self.observed_names
        every = [*(s.name for s in self.inner.states), *t.output_names]
        values, *along, slopes_in_time = self._differentiated(t, every, [*t.x, *t.o], state, inputs)
        further = {sensitivity(n, k): column[n] for n in names for k, column in enumerate(along)}
        return (
            {n: values[n] for n in names}
            | further
            | {f"{n}.rate": slopes_in_time[n] for n in names}
        )

    def _differentiated(
        self,
        t: TracedSystem,
        names: Sequence[str],
        values: Sequence[Node],
        state: Mapping[str, Value],
        inputs: Mapping[str, Value],
    ) -> list[dict[str, Value]]:
        """Values of the traced inner system by names, their total derivatives along every column,
        and their slopes.
        """
        moving = [*t.x, *(t.u[i] for i in self.input_indices), *t.p]
        columns = [values]
        for k, indices in enumerate(self.parameter_indices):
            direction = [
                *(state[sensitivity(s.name, k)] for s in self.inner.states),
                *(inputs[sensitivity(n, k)] for n in self.dependent_inputs),
                *(float(i in indices) for i in range(len(t.p))),
            ]
            columns.append(slopes.tangents(values, moving, nodes.as_nodes(direction)))
        columns.append(slopes.tangents(values, t.x, t.f))
        point = [state[s.name] for s in self.inner.states] + [inputs[n] for n in self.inner.inputs]
        point += [leaf.value for leaf in tree.leaves(self.inner)]
        variables = [*t.x, *t.u, *t.p]
        return [
            dict(zip(names, column, strict=True)) for column in evaluated(columns, variables, point)
        ]


def sensitivity(name: str, column: int) -> str:
    """The name of the derivative of a state or output by a column."""
    return f"d {name}/d {column}"


def evaluated(
    columns: Sequence[Sequence[Node]], variables: Sequence[Node], values: Sequence[Value]
) -> list[list[Value]]:
    """Columns of expressions at these values of their variables, which may be symbols
    themselves.
    """
    flat = nodes.replaced([node for column in columns for node in column], variables, values)
    rest = iter(flat if ops.is_symbol(*values) else map(float, flat))
    return [[next(rest) for _ in column] for column in columns]
