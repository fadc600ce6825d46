"""Stiffness of a muscle and of its load at constant pressure and with closed valves."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ...core import ShortRepr, Value, Values, autodiff
from ...core.system import state_vector
from ..muscle import ElasticSeriesElement, Muscle
from ..plant.plant import Plant
from ..plant.static_plant import MuscleState
from ..pneumatics.gas import NO_FLOW, Air, gauge_pressure


class StiffnessPair(NamedTuple):
    """Stiffness at constant pressure and with closed valves, in the unit of the containing
    field.
    """

    constant_pressure: float
    shut_valves: float


@dataclasses.dataclass(frozen=True, repr=False)
class Stiffness(ShortRepr):
    """Stiffnesses of a plant at one state.

    muscles      of every muscle by name, -dF/deps [N]
    per_metre    of every muscle by name, dF/dL [N/m]
    coordinates  of every coordinate, -dQ/dq [N/m, N m/rad], including the change of the moment arms
                 of the muscles, without the springs and weights of the mechanism
    """

    muscles: Mapping[str, StiffnessPair]
    per_metre: Mapping[str, StiffnessPair]
    coordinates: Mapping[str, StiffnessPair]


def stiffness(plant: Plant, state: Mapping[str, float]) -> Stiffness:
    """Both stiffnesses of a plant at a state: exact derivatives of its laws.

        k_p = -dF/deps,   k_m = k_p - (dF/dp) (dp/deps),   dp/deps of the gas without flow and heat
                          transfer (polytropic: -n p_abs/V dV/deps)

    With closed valves, the pressure increases when a muscle is stretched, so that the muscle is
    stiffer. Isothermal and polytropic gases follow their process; a FirstLawGas, the default, is
    evaluated as adiabatic, for a fast motion; use Isothermal for a slow one. A series spring acts
    in series: 1/k = 1/k_inner + 1/k_SE. The states of friction, creep and wall are constant. A
    slack muscle has zero stiffness. Raises ParameterError for an unknown or missing name and for an
    impossible state, GeometryLimitError for a contraction beyond the limits of a geometry.
    """
    state_vector(plant, state)
    plant.check_state(state)
    ports = plant.muscle_states(state)
    pairs = {
        m.name: _of_muscle(plant, m, port) for m, port in zip(plant.muscles, ports, strict=True)
    }
    lengths = {m.name: float(m.geometry.resting_length) for m in plant.muscles}
    per_metre = {
        name: StiffnessPair(*(k / lengths[name] for k in both)) for name, both in pairs.items()
    }
    coordinates = {
        c.name: StiffnessPair(
            *(_against(plant, state, ports, ks, c.name) for ks in zip(*pairs.values(), strict=True))
        )
        for c in plant.mechanism.coordinates
    }
    return Stiffness(pairs, per_metre, coordinates)


def _of_muscle(plant: Plant, muscle: Muscle, port: MuscleState) -> StiffnessPair:
    def tension(x: Sequence[Value]) -> list[Value]:
        return [muscle.tension(x[0], x[1])]  # without the series spring

    at = [float(port.pressure), float(port.inner_contraction)]
    by_pressure, by_contraction = (
        float(autodiff.jvp(tension, at, d)[0]) for d in ([1.0, 0.0], [0.0, 1.0])
    )
    squeezed = float(
        enclosed_pressure_slope(
            plant, muscle, port.inner_contraction, port.volume, port.air, port.states
        )
    )
    inside = (0.0 - by_contraction, 0.0 - by_contraction - by_pressure * squeezed)
    if not isinstance(muscle.series, ElasticSeriesElement):
        return StiffnessPair(*inside)
    length = float(muscle.geometry.resting_length)
    stretch = (float(port.inner_contraction) - float(port.contraction)) * length
    spring = muscle.series.tangent_stiffness(stretch) * length if stretch > 0.0 else 0.0
    return StiffnessPair(*(k * spring / (k + spring) if spring else 0.0 for k in inside))


def enclosed_pressure_slope(
    plant: Plant, muscle: Muscle, inner_contraction: Value, volume: Value, air: Air, states: Values
) -> Value:
    """dp/deps [Pa] of enclosed air: derivative of its pressure with respect to volume and gas
    states.

    The values are numbers or symbols; `states` contains those of the gas.
    """
    content = {s.name: states[s.name] for s in plant.gas.states(volume, plant.ambient)}
    names = list(content)
    growth = muscle.geometry.volume_derivative(inner_contraction)
    moved, still = (
        plant.gas.rates(content, air, NO_FLOW, rate, plant.ambient) for rate in (growth, 0.0)
    )

    def pressure(x: Sequence[Value]) -> list[Value]:
        enclosed = plant.gas.air(dict(zip(names, x[1:], strict=True)), x[0], plant.ambient)
        return [gauge_pressure(enclosed.pressure, plant.ambient)]

    at = [volume, *content.values()]
    along = [growth, *(moved[n] - still[n] for n in names)]
    return autodiff.jvp(pressure, at, along)[0]


def _against(
    plant: Plant,
    state: Mapping[str, float],
    ports: Sequence[MuscleState],
    stiffnesses: Sequence[float],
    name: str,
) -> float:
    """-dQ/dq of one coordinate, for tensions that decrease with contraction by these
    stiffnesses.
    """
    mechanism = plant.mechanism
    lengths = plant.resting_lengths
    names = [c.name for c in mechanism.coordinates]

    def pull(x: Sequence[Value]) -> list[Value]:
        q = dict(zip(names, x, strict=True))
        contractions = mechanism.contractions(q, lengths)
        moved = zip(ports, stiffnesses, contractions, strict=True)
        tensions = [
            port.tension - k * (contraction - port.contraction) for port, k, contraction in moved
        ]
        return [mechanism.generalised_forces(q, tensions, lengths)[name]]

    at = [float(state[n]) for n in names]
    return -float(autodiff.jvp(pull, at, [float(n == name) for n in names])[0])
