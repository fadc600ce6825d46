"""Integrators: numerical methods for ordinary differential equations, each a thin caller of one
kernel.

An integrator is bound to a compiled system: its kernel with all arguments, run after run.
"""

import abc
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ...core import (
    Array,
    ParameterError,
    Reference,
    Status,
    abridged,
    flat_view,
    model,
    parameter,
    published,
)
from ..compile.cache.kernel import Kernel, fixed_step, rodas4
from ..compile.functions import ArraySizes
from ..compile.program import CompiledSystem, Tableau
from ..loop.inputs import PiecewiseLinear

INTERRUPT_CHECK_STEPS = 100_000
"""Steps between two checks whether the user wants to stop, or the state is impossible."""
MAX_STEPS = 50_000_000
"""Steps of one run, by default."""
_PAUSED = Status.PAUSED.value
_TOO_MANY = Status.TOO_MANY_STEPS.value


class RawSolution(NamedTuple):
    """Result of an integrator: rows (N, n), number of rows reached, end time, status and counts."""

    rows: Array
    reached: int
    time: float
    state: Array
    status: Status
    steps: int
    rejected: int


class Binding(NamedTuple):
    """Binding of an integrator to a system: kernel, its arguments but for those of a run, and the
    size of its workspace.
    """

    kernel: Kernel
    arguments: Mapping[str, Any]
    work: int


OF_A_RUN = ("ends", "values", "slopes", "times", "rows")
"""The arguments of an integrator's kernel that are others in each run: segments, then rows."""


class BoundIntegrator:
    """An integrator bound to one compiled system, with its workspace. For one thread at a time."""

    def __init__(self, binding: Binding, sizes: ArraySizes) -> None:
        self.state, self._progress = np.zeros(sizes.states), np.zeros(7, dtype=np.int64)
        self.clock: Array = self._progress[:3].view(np.float64)
        """Time, next step, start of the current segment."""
        self.count = self._progress[3:]
        """Segment, next row, steps, rejected steps."""
        self._duration = 1.0
        self._end, inputs, slopes = (
            np.ones(1),
            np.zeros((1, sizes.inputs)),
            np.zeros((1, sizes.inputs)),
        )
        self.held: Array = inputs[0]
        """The inputs (m,) of `proceed`."""
        self._bound_values = binding.arguments
        self._kernel = binding.kernel.bind(
            **binding.arguments,
            y=self.state,
            ends=self._end,
            values=inputs,
            slopes=slopes,
            times=np.zeros(0),
            rows=np.zeros((0, sizes.states)),
            clock=self.clock,
            count=self.count,
            budget=INTERRUPT_CHECK_STEPS,
            work=np.zeros(max(binding.work, 1)),
        )
        self._run = self._kernel.runner
        self._clock_view, self._count_view = flat_view(self.clock), flat_view(self.count)
        self.places = np.array([self._kernel.slot_of(name) for name in OF_A_RUN], dtype=np.int64)
        """The places in the slots of ends, values and slopes of segments, and of times and rows
        (5,).
        """
        self.slots: Any = self._kernel.slots
        """The slots of the kernel's arguments."""
        self._words = None if self._kernel.entry_address is None else flat_view(self.slots)

    def rebind(self, binding: Binding) -> None:
        """Take the values of the same integrator at a system of the same structure with other
        parameters.
        """
        for name, bound_value in self._bound_values.items():
            if isinstance(bound_value, np.ndarray):
                bound_value[...] = binding.arguments[name]

    def run(
        self,
        segments: PiecewiseLinear,
        start: float,
        state: Array,
        times: Array,
        max_steps: int = MAX_STEPS,
        check: Callable[[Array, float], Status] | None = None,
    ) -> RawSolution:
        """Integrate from `state` (n,) at `start` [s] through the segments; rows (N, n) at rising
        `times` (N,).

        `check` states for a state (n,) and a time [s], DONE or why the run ends there; it is called
        between packets of many steps, because the steps can become endlessly many where the model
        does not hold.
        """
        rows = np.empty((times.size, self.state.size))
        self.state[:] = state
        self._kernel.replace_input("ends", segments.ends)
        self._kernel.replace_input("values", segments.values)
        self._kernel.replace_input("slopes", segments.slopes)
        self._kernel.replace_input("times", times)
        self._kernel.replace("rows", rows)
        clock = self._clock_view
        count = self._count_view
        clock[0] = start
        clock[1] = 0.0
        clock[2] = start
        count[0] = count[1] = count[2] = count[3] = 0
        if max_steps < INTERRUPT_CHECK_STEPS:
            self._kernel.replace("budget", max_steps)
        try:
            status = self._kernel()
            if status == _PAUSED:
                status = self._continue(status, max_steps, check)
        except KeyboardInterrupt:
            status = Status.INTERRUPTED.value
        self._kernel.replace("budget", INTERRUPT_CHECK_STEPS)
        reached = count[1]
        ended = Status.DONE if status == 0 else Status(status)
        if reached < len(rows):
            rows[reached:] = np.nan
        return RawSolution(rows, reached, clock[0], self.state.copy(), ended, count[2], count[3])

    def proceed(self, duration: float) -> Status:
        """Advance `self.state` by `duration` [s] with `self.held` held. Not to be mixed with
        `run`.
        """
        if duration != self._duration:
            self._end[0] = self._duration = duration
        self._progress.fill(0)
        status = self._run()
        if status == _PAUSED:
            status = self._continue(status, MAX_STEPS)
        return Status.DONE if status == 0 else Status(status)

    def run_part(self) -> Status:
        """Go on through the segments and rows in the slots, for a kernel that cannot call this one
        itself.
        """
        if self._words is None:
            slots = self.slots.tolist()
            place = dict(zip(OF_A_RUN, self.places.tolist(), strict=True))
            for names in (OF_A_RUN[:3], OF_A_RUN[3:]):
                addresses = {name: slots[place[name]] for name in names}
                self._kernel.point(addresses, slots[place[names[0]] + 1])
        before = self._count_view[2]
        status = self._run()
        if status == _PAUSED:
            status = self._continue(status, before + MAX_STEPS)
            self._kernel.replace("budget", INTERRUPT_CHECK_STEPS)
        return Status(status)

    @property
    def entry_address(self) -> int | None:
        """The address of the kernel's entry point, for a kernel that calls it; None without machine
        code.
        """
        return self._kernel.entry_address

    def _continue(
        self, status: int, max_steps: int, check: Callable[[Array, float], Status] | None = None
    ) -> int:
        """Go on where the kernel paused so that an interruption or an impossible state can be
        noticed.
        """
        while status == _PAUSED:
            if (
                check is not None
                and (outcome := check(self.state, self._clock_view[0])) != Status.DONE
            ):
                return outcome.value
            left = max_steps - int(self.count[2])
            if left <= 0:
                return _TOO_MANY
            self._kernel.replace("budget", min(INTERRUPT_CHECK_STEPS, left))
            status = self._kernel()
        return status


class Integrator(abc.ABC):
    """A numerical method for ordinary differential equations.

    printed_step  module of the kernels with the step that exported programs print; empty: there is
                  none
    """

    printed_step: ClassVar[str] = ""

    @abc.abstractmethod
    def binding(self, compiled: CompiledSystem) -> Binding:
        """Kernel, arguments and workspace for a system."""

    def bind(self, compiled: CompiledSystem) -> BoundIntegrator:
        """The integrator at this system, for callers that run it often."""
        return BoundIntegrator(self.binding(compiled), compiled.sizes)

    def run(
        self,
        compiled: CompiledSystem,
        segments: PiecewiseLinear,
        start: float,
        state: Array,
        times: Array,
    ) -> RawSolution:
        """Integrate from `state` (n,) at `start` [s] through the segments; rows (N, n) at rising
        `times` (N,).
        """
        return self.bind(compiled).run(segments, start, state, times)


@model
class Rodas4(Integrator):
    """Rosenbrock method of order four for stiff systems, adaptive; the default.

    The absolute tolerance of a state is the relative one times its nominal size.
    Reference: Hairer and Wanner, Solving Ordinary Differential Equations II, 1996, section VI.4,
    method RODAS.
    """

    references: ClassVar[tuple[Reference, ...]] = (published("hairer-wanner-1996"),)
    printed_step: ClassVar[str] = "rodas4"

    rtol: float = parameter(
        "1", "rtol", "relative tolerance of a step", bounds=(1e-13, 0.1), default=1e-6
    )

    def binding(self, compiled: CompiledSystem) -> Binding:
        sizes = compiled.sizes
        at = compiled.address
        functions = {name: at[name] for name in ("stage", "jac", "factor", "solve", "df_dt")}
        work = 11 * sizes.states + 2 * sizes.inputs + sizes.jacobian + sizes.factors
        return Binding(
            rodas4,
            {
                **functions,
                "jacobian_size": sizes.jacobian,
                "factor_size": sizes.factors,
                "c": compiled.precomputed,
                "relative": self.rtol,
                "absolute": self.rtol * compiled.nominal,
            },
            work,
        )


class ExplicitRungeKutta(Integrator):
    """An explicit Runge-Kutta method of fixed step size, stable only for small steps; a subclass
    has its tableau.
    """

    printed_step: ClassVar[str] = "fixed_step"
    step: float

    @abc.abstractmethod
    def tableau(self) -> Tableau:
        """Rows of the tableau below its first, and the weights."""

    def binding(self, compiled: CompiledSystem) -> Binding:
        address, precomputed = compiled.program.step(self.tableau(), compiled.parameters)
        work = compiled.sizes.states + compiled.sizes.inputs
        arguments = {"step": address, "c": precomputed, "length": self.step}
        return Binding(fixed_step, arguments, work)


_DEFAULT = Rodas4()


def default_integrator(integrator: Integrator | None) -> Integrator:
    """The given integrator, or the default. Raises ParameterError for anything else, such as a
    name.
    """
    if integrator is None:
        return _DEFAULT
    if not isinstance(integrator, Integrator):
        raise ParameterError(
            f"the integrator is {abridged(integrator)}; give Rodas4(), RungeKutta4(step) or"
            " DormandPrince8(step)."
        )
    return integrator


@model
class RungeKutta4(ExplicitRungeKutta):
    """The classical method of order four (Kutta 1901)."""

    references: ClassVar[tuple[Reference, ...]] = (published("kutta-1901"),)

    step: float = parameter("s", "h", "step size", bounds=(1e-9, 1e3))

    def tableau(self) -> Tableau:
        return ((0.5,), (0.0, 0.5), (0.0, 0.0, 1.0)), (1 / 6, 1 / 3, 1 / 3, 1 / 6)


@model
class DormandPrince8(ExplicitRungeKutta):
    """RK8(7)13M of Prince and Dormand (1981), the weights of order eight: Simulink's ode8, which
    the third paper uses.

    Reference: Prince, P. J., Dormand, J. R., High order embedded Runge-Kutta formulae,
    J. Computational and Applied Mathematics 7(1):67-75, 1981, table 2.
    """

    references: ClassVar[tuple[Reference, ...]] = (published("prince-dormand-1981"),)

    step: float = parameter("s", "h", "step size", bounds=(1e-9, 1e3))

    def tableau(self) -> Tableau:
        return _RK8_ROWS, _RK8_WEIGHTS


_RK8_ROWS = (
    (1 / 18,),
    (1 / 48, 1 / 16),
    (1 / 32, 0.0, 3 / 32),
    (5 / 16, 0.0, -75 / 64, 75 / 64),
    (3 / 80, 0.0, 0.0, 3 / 16, 3 / 20),
    (29443841 / 614563906, 0.0, 0.0, 77736538 / 692538347, -28693883 / 1125000000, 23124283 / 1800000000),  # noqa: E501
    (16016141 / 946692911, 0.0, 0.0, 61564180 / 158732637, 22789713 / 633445777, 545815736 / 2771057229,  # noqa: E501
     -180193667 / 1043307555),
    (39632708 / 573591083, 0.0, 0.0, -433636366 / 683701615, -421739975 / 2616292301, 100302831 / 723423059,  # noqa: E501
     790204164 / 839813087, 800635310 / 3783071287),
    (246121993 / 1340847787, 0.0, 0.0, -37695042795 / 15268766246, -309121744 / 1061227803, -12992083 / 490766935,  # noqa: E501
     6005943493 / 2108947869, 393006217 / 1396673457, 123872331 / 1001029789),
    (-1028468189 / 846180014, 0.0, 0.0, 8478235783 / 508512852, 1311729495 / 1432422823, -10304129995 / 1701304382,  # noqa: E501
     -48777925059 / 3047939560, 15336726248 / 1032824649, -45442868181 / 3398467696, 3065993473 / 597172653),  # noqa: E501
    (185892177 / 718116043, 0.0, 0.0, -3185094517 / 667107341, -477755414 / 1098053517, -703635378 / 230739211,  # noqa: E501
     5731566787 / 1027545527, 5232866602 / 850066563, -4093664535 / 808688257, 3962137247 / 1805957418,  # noqa: E501
     65686358 / 487910083),
    (403863854 / 491063109, 0.0, 0.0, -5068492393 / 434740067, -411421997 / 543043805, 652783627 / 914296604,  # noqa: E501
     11173962825 / 925320556, -13158990841 / 6184727034, 3936647629 / 1978049680, -160528059 / 685178525,  # noqa: E501
     248638103 / 1413531060, 0.0),
)  # fmt: skip
_RK8_WEIGHTS = (
    14005451 / 335480064, 0.0, 0.0, 0.0, 0.0, -59238493 / 1068277825, 181606767 / 758867731, 561292985 / 797845732,  # noqa: E501
    -1041891430 / 1371343529, 760417239 / 1151165299, 118820643 / 751138087, -528747749 / 2220607170, 1 / 4,  # noqa: E501
)  # fmt: skip
