"""Integrators: numerical methods for ordinary differential equations, each a thin caller of one kernel."""

import abc
import functools
from typing import ClassVar

from ...core import Array, ParameterError, Reference, abridged, model, parameter, published
from ..compile.cache.kernel import fixed_step, rodas4
from ..compile.program import CompiledSystem, Tableau
from ..loop.inputs import PiecewiseLinear
from .bound_integrator import MAX_STEPS, Binding, BoundIntegrator, RawSolution

HAIRER_WANNER1996 = published("hairer-wanner-1996")
KUTTA1901 = published("kutta-1901")
PRINCE_DORMAND1981 = published("prince-dormand-1981")


class Integrator(abc.ABC):
    """A numerical method for ordinary differential equations.

    printed_step  module of the kernels with the step that exported programs print; empty: there is none
    """

    printed_step: ClassVar[str] = ""

    @abc.abstractmethod
    def binding(self, compiled: CompiledSystem) -> Binding:
        """Kernel, arguments and workspace for a system."""

    def bind(self, compiled: CompiledSystem) -> BoundIntegrator:
        """The integrator at this system, for callers that run it often."""
        return BoundIntegrator(self.binding(compiled), compiled.sizes)

    def run(
        self, compiled: CompiledSystem, segments: PiecewiseLinear, start: float, state: Array, times: Array,
        max_steps: int = MAX_STEPS,
    ) -> RawSolution:  # fmt: skip
        """Integrate from `state` (n,) at `start` [s] through the segments; rows (N, n) at rising `times` (N,)."""
        return self.bind(compiled).run(segments, start, state, times, max_steps)


@model
class Rodas4(Integrator):
    """Rosenbrock method of order four for stiff systems, adaptive; the default.

    The absolute tolerance of a state is the relative one times its nominal size.
    Reference: Hairer and Wanner, Solving Ordinary Differential Equations II, 1996, section VI.4, method RODAS.
    """

    references: ClassVar[tuple[Reference, ...]] = (HAIRER_WANNER1996,)
    printed_step: ClassVar[str] = "rodas4"

    rtol: float = parameter("1", "rtol", "relative tolerance of a step", bounds=(1e-13, 0.1), default=1e-6)

    def binding(self, compiled: CompiledSystem) -> Binding:
        sizes, at = compiled.sizes, compiled.address
        addresses = (at["stage"], at["jac"], at["factor"], at["solve"], at["df_dt"], sizes.jacobian, sizes.factors)
        work = 11 * sizes.states + 2 * sizes.inputs + sizes.jacobian + sizes.factors
        return Binding(rodas4, (*addresses, compiled.precomputed), (self.rtol, self.rtol * compiled.nominal), work)


class ExplicitRungeKutta(Integrator):
    """An explicit Runge-Kutta method of fixed step size, stable only for small steps; a subclass has its tableau."""

    printed_step: ClassVar[str] = "fixed_step"
    step: float

    @abc.abstractmethod
    def tableau(self) -> Tableau:
        """Rows of the tableau below its first, and the weights."""

    def binding(self, compiled: CompiledSystem) -> Binding:
        address, precomputed = compiled.program.step(self.tableau(), compiled.parameters)
        work = compiled.sizes.states + compiled.sizes.inputs
        return Binding(fixed_step, (address, precomputed), (self.step,), work)


@functools.cache
def _default() -> Integrator:
    return Rodas4()


def default_integrator(integrator: Integrator | None) -> Integrator:
    """The given integrator, or the default. Raises ParameterError for anything else, such as a name."""
    if integrator is None:
        return _default()
    if not isinstance(integrator, Integrator):
        raise ParameterError(
            f"the integrator is {abridged(integrator)}; give Rodas4(), RungeKutta4(step) or DormandPrince8(step)."
        )
    return integrator


@model
class RungeKutta4(ExplicitRungeKutta):
    """The classical method of order four (Kutta 1901)."""

    references: ClassVar[tuple[Reference, ...]] = (KUTTA1901,)

    step: float = parameter("s", "h", "step size", bounds=(1e-9, 1e3))

    def tableau(self) -> Tableau:
        return ((0.5,), (0.0, 0.5), (0.0, 0.0, 1.0)), (1 / 6, 1 / 3, 1 / 3, 1 / 6)


@model
class DormandPrince8(ExplicitRungeKutta):
    """RK8(7)13M of Prince and Dormand (1981), the weights of order eight: Simulink's ode8, which the third paper uses.

    Reference: Prince, P. J., Dormand, J. R., High order embedded Runge-Kutta formulae,
    J. Computational and Applied Mathematics 7(1):67-75, 1981, table 2.
    """

    references: ClassVar[tuple[Reference, ...]] = (PRINCE_DORMAND1981,)

    step: float = parameter("s", "h", "step size", bounds=(1e-9, 1e3))

    def tableau(self) -> Tableau:
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
