"""How a plant is carried through time: the methods a user chooses between, each a thin caller of one kernel."""

from __future__ import annotations

import abc
import dataclasses
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..control.inputs import PiecewiseLinear
from ..core.arrays import Array
from ..core.declaration import model, parameter

if TYPE_CHECKING:
    from ..compile.program import CompiledSystem


REASONS = {
    0: "done",
    2: "the step became too small",
    3: "a rate or an output is not finite",
    4: "it took more steps than allowed",
    5: "it was interrupted",
    7: "there was less air than none",
    8: "the controller gave a command that is not finite",
    9: "a muscle enclosed nothing",
}
PAUSED, NOT_FINITE, TOO_MANY, INTERRUPTED, LESS_THAN_NONE, NO_COMMAND, NO_VOLUME = 1, 3, 4, 5, 7, 8, 9
INTERRUPT_CHECK_STEPS = 100_000
"""Steps between two looks at whether the user wants to stop."""
MAX_STEPS = 50_000_000
"""Steps of one run, unless told otherwise."""


class RawSolution(NamedTuple):
    """What a method computed: rows reached of those asked for, where it stopped and why, and its counts."""

    rows: Array
    reached: int
    time: float
    state: Array
    status: int
    steps: int
    rejected: int


@dataclasses.dataclass(frozen=True, eq=False)
class Stepper:
    """A method at one system: the kernel, its leading and trailing arguments, and its workspace. For one thread."""

    kernel: Any
    leading: tuple[Any, ...]
    trailing: tuple[Any, ...]
    work: Array

    def run(
        self, segments: PiecewiseLinear, start: float, state: Array, times: Array, most_steps: int = MAX_STEPS
    ) -> RawSolution:
        """As Method.run."""
        y, rows = np.array(state, dtype=float), np.empty((times.size, state.size))
        rows.fill(np.nan)
        clock, count = np.array([start, 0.0, start]), np.zeros(4, dtype=np.int64)
        status, middle = PAUSED, (y, segments.ends, segments.values, segments.slopes, times, rows)
        try:
            while status == PAUSED:
                budget = min(INTERRUPT_CHECK_STEPS, most_steps - int(count[2]))
                status = self.kernel(*self.leading, *middle, *self.trailing, clock, count, budget, self.work)
                if status == PAUSED and count[2] >= most_steps:
                    status = TOO_MANY
        except KeyboardInterrupt:
            status = INTERRUPTED
        return RawSolution(rows, int(count[1]), float(clock[0]), y, int(status), int(count[2]), int(count[3]))


class Integrator(abc.ABC):
    """A numerical method for ordinary differential equations."""

    @abc.abstractmethod
    def _kernel(self, prepared: CompiledSystem) -> tuple[Any, tuple[Any, ...], tuple[Any, ...], int]:
        """The kernel, its leading and its trailing arguments, and the length of its workspace."""

    def stepper(self, prepared: CompiledSystem) -> Stepper:
        """The method at this system, for those who call it often: what does not change is made once."""
        kernel, leading, trailing, size = self._kernel(prepared)
        return Stepper(kernel, leading, trailing, np.zeros(max(size, 1)))

    def run(
        self, prepared: CompiledSystem, segments: PiecewiseLinear, start: float, state: Array, times: Array,
        most_steps: int = MAX_STEPS,
    ) -> RawSolution:  # fmt: skip
        """Carry `state` (n,) from `start` through the segments; rows (N, n) at `times` (N,), which must rise."""
        return self.stepper(prepared).run(segments, start, state, times, most_steps)


@model
class Rodas4(Integrator):
    """Adaptive, for stiff plants, order four; the default. The absolute tolerance is rtol times the nominal size."""

    rtol: float = parameter("1", "rtol", "relative tolerance of a step", bounds=(1e-13, 0.1), default=1e-6)

    def _kernel(self, prepared: CompiledSystem) -> tuple[Any, tuple[Any, ...], tuple[Any, ...], int]:
        from ..compile.cache.kernel import rodas4

        sizes, at = prepared.sizes, prepared.address
        addresses = (at["stage"], at["jac"], at["factor"], at["solve"], at["drift"], sizes.jacobian, sizes.factors)
        length = 11 * sizes.states + 2 * sizes.inputs + sizes.jacobian + sizes.factors
        return rodas4, (*addresses, prepared.precomputed), (self.rtol, self.rtol * prepared.nominal()), length


class ExplicitRungeKutta(Integrator):
    """An explicit Runge-Kutta method of fixed step; its tableau is in the subclass. Stable only for small steps."""

    step: float

    @abc.abstractmethod
    def tableau(self) -> tuple[tuple[tuple[float, ...], ...], tuple[float, ...]]:
        """Rows of the tableau below its first, and the weights."""

    def _kernel(self, prepared: CompiledSystem) -> tuple[Any, tuple[Any, ...], tuple[Any, ...], int]:
        from ..compile.cache.kernel import fixed_step

        address, held = prepared.program.step(*self.tableau(), prepared.parameters)
        return fixed_step, (address, held), (self.step,), prepared.sizes.states + 2 * prepared.sizes.inputs


@model
class RungeKutta4(ExplicitRungeKutta):
    """The classical method of order four (Kutta 1901)."""

    step: float = parameter("s", "h", "length of a step", bounds=(1e-9, 1e3))

    def tableau(self) -> tuple[tuple[tuple[float, ...], ...], tuple[float, ...]]:
        return ((0.5,), (0.0, 0.5), (0.0, 0.0, 1.0)), (1 / 6, 1 / 3, 1 / 3, 1 / 6)


@model
class DormandPrince8(ExplicitRungeKutta):
    """RK8(7)13M of Prince and Dormand (1981), the weights of order eight: Simulink's ode8, which the third paper uses.

    Reference: Prince, P. J., Dormand, J. R., High order embedded Runge-Kutta formulae,
    J. Computational and Applied Mathematics 7(1):67-75, 1981, table 2.
    """

    step: float = parameter("s", "h", "length of a step", bounds=(1e-9, 1e3))

    def tableau(self) -> tuple[tuple[tuple[float, ...], ...], tuple[float, ...]]:
        return _RK8_ROWS, _RK8_WEIGHTS


_RK8_ROWS = (
    (1 / 18,),
    (1 / 48, 1 / 16),
    (1 / 32, 0.0, 3 / 32),
    (5 / 16, 0.0, -75 / 64, 75 / 64),
    (3 / 80, 0.0, 0.0, 3 / 16, 3 / 20),
    (29443841 / 614563906, 0.0, 0.0, 77736538 / 692538347, -28693883 / 1125000000, 23124283 / 1800000000),
    (16016141 / 946692911, 0.0, 0.0, 61564180 / 158732637, 22789713 / 633445777, 545815736 / 2771057229,
     -180193667 / 1043307555),
    (39632708 / 573591083, 0.0, 0.0, -433636366 / 683701615, -421739975 / 2616292301, 100302831 / 723423059,
     790204164 / 839813087, 800635310 / 3783071287),
    (246121993 / 1340847787, 0.0, 0.0, -37695042795 / 15268766246, -309121744 / 1061227803, -12992083 / 490766935,
     6005943493 / 2108947869, 393006217 / 1396673457, 123872331 / 1001029789),
    (-1028468189 / 846180014, 0.0, 0.0, 8478235783 / 508512852, 1311729495 / 1432422823, -10304129995 / 1701304382,
     -48777925059 / 3047939560, 15336726248 / 1032824649, -45442868181 / 3398467696, 3065993473 / 597172653),
    (185892177 / 718116043, 0.0, 0.0, -3185094517 / 667107341, -477755414 / 1098053517, -703635378 / 230739211,
     5731566787 / 1027545527, 5232866602 / 850066563, -4093664535 / 808688257, 3962137247 / 1805957418,
     65686358 / 487910083),
    (403863854 / 491063109, 0.0, 0.0, -5068492393 / 434740067, -411421997 / 543043805, 652783627 / 914296604,
     11173962825 / 925320556, -13158990841 / 6184727034, 3936647629 / 1978049680, -160528059 / 685178525,
     248638103 / 1413531060, 0.0),
)  # fmt: skip
_RK8_WEIGHTS = (
    14005451 / 335480064, 0.0, 0.0, 0.0, 0.0, -59238493 / 1068277825, 181606767 / 758867731, 561292985 / 797845732,
    -1041891430 / 1371343529, 760417239 / 1151165299, 118820643 / 751138087, -528747749 / 2220607170, 1 / 4,
)  # fmt: skip
