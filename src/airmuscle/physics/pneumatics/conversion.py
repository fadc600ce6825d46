"""Conversion between the sonic conductance C and other flow figures of data sheets; combined
valves.

The flow laws use C [m3/(s Pa)]. The functions of each pair are inverse to each other.

    nominal flow    volume flow at the reference atmosphere of ISO 8778 from 6 to 5 bar gauge,
                    ambient pressure 1 bar: Q = C p1 phi(p2/p1), p1 = 7 bar, p2 = 6 bar absolute;
                    reproduces SMC's tables of C, b and Q exactly
    Kv              m3/h of water at a pressure difference of 1 bar (IEC 60534). Kv corresponds to
                    an area A by Q = A sqrt(2 dp/rho), and air near equal pressures flows through
                    the same area: C rho0 sqrt(R T0) = A sqrt(1 - b)
    Cv              US gallons per minute of water at 1 psi; Kv = 0.865 Cv (IEC 60534)
    effective area  S of the loss-free nozzle with the same choked flow: C rho0 = S 0.6847/sqrt(R
                    T0), which is the rule S [mm2] = 5.0 C [dm3/(s bar)] of JIS B 8390 and of the
                    catalogues of CKD and SMC
    diameter        of a round hole, S = c_d pi d^2/4 with its discharge coefficient c_d

All conversions but that of the effective area need b. A data sheet with only Kv or the nominal flow
does not state b; 0.3 is a common assumption, which must be documented. Kv (measured with water) and
Cv (with air at a drop of 0.1 bar) contain no information on choking: for SMC's valves, the printed
Cv is 4 to 31 % above the value from the printed C and b. Use C and b where they are printed. Kv and
Cv are numbers in the units of their definitions; all other values are SI.

The choked flow of the equivalent valve is exact, and so is its flow near equal pressures, where the
squares of the pressures are linear in the square of the flow. Between, the equivalent valve follows
an ellipse, which approximates the exact curve. The errors stated below are tested against a
numerical solution for the pressure between the valves.
"""

from ...core import ParameterError, attribute_hint, ops
from .gas import (
    GAS_CONSTANT,
    HEAT_CAPACITY_RATIO,
    REFERENCE_DENSITY,
    REFERENCE_TEMPERATURE,
    Ambient,
)
from .valve import Valve

NOMINAL_UPSTREAM = 7e5
NOMINAL_DOWNSTREAM = 6e5
"""Absolute pressures [Pa] of the nominal flow: 6 and 5 bar gauge at an ambient pressure of 1
bar.
"""
KV_PER_CV = 0.865
"""Kv [m3/h at 1 bar] of a valve with Cv = 1 [US gallons per minute at 1 psi]."""
_NOZZLE_FACTOR: float = HEAT_CAPACITY_RATIO**0.5 * (2.0 / (HEAT_CAPACITY_RATIO + 1.0)) ** (
    (HEAT_CAPACITY_RATIO + 1.0) / (2.0 * (HEAT_CAPACITY_RATIO - 1.0))
)
"""qm sqrt(R T)/(S p1) of loss-free choked flow, 0.6847."""
_REFERENCE_SPEED: float = ops.sqrt(GAS_CONSTANT * REFERENCE_TEMPERATURE)
"""sqrt(R T0) [m/s]."""
_KV_AREA: float = 1.0 / 3600.0 / ops.sqrt(2.0 * 1e5 / 1000.0)
"""Area [m2] of Kv = 1: 1 m3/h of water, 1000 kg/m3, at 1 bar."""


def nominal_flow(conductance: float, critical_ratio: float) -> float:
    """Nominal volume flow [m3/s] at the reference atmosphere, from 6 to 5 bar gauge. Raises
    ParameterError.
    """
    return flow_at_reference(conductance, critical_ratio, NOMINAL_UPSTREAM, NOMINAL_DOWNSTREAM)


def conductance_from_nominal_flow(volume_flow: float, critical_ratio: float) -> float:
    """C [m3/(s Pa)] from the nominal flow [m3/s] at the reference atmosphere. Raises
    ParameterError.
    """
    return conductance_from_flow(volume_flow, critical_ratio, NOMINAL_UPSTREAM, NOMINAL_DOWNSTREAM)


def flow_at_reference(
    conductance: float, critical_ratio: float, upstream: float, downstream: float
) -> float:
    """Volume flow [m3/s] at the reference atmosphere between two absolute pressures [Pa], for air
    at 293.15 K.

    Raises ParameterError for a value that is not positive and finite, or if `downstream` is not
    less than `upstream`.
    """
    return _positive("conductance", conductance) * _unit_flow(critical_ratio, upstream, downstream)


def conductance_from_flow(
    volume_flow: float, critical_ratio: float, upstream: float, downstream: float
) -> float:
    """C [m3/(s Pa)] from a volume flow [m3/s] at the reference atmosphere between two absolute
    pressures [Pa].

    Raises ParameterError as `flow_at_reference`.
    """
    return _positive("volume_flow", volume_flow) / _unit_flow(critical_ratio, upstream, downstream)


def kv(conductance: float, critical_ratio: float) -> float:
    """Kv [m3/h] from the sonic conductance. Raises ParameterError."""
    mass_flow = _positive("conductance", conductance) * REFERENCE_DENSITY * _REFERENCE_SPEED
    return mass_flow / (_KV_AREA * _near_equal_factor(critical_ratio))


def conductance_from_kv(kv: float, critical_ratio: float) -> float:
    """C [m3/(s Pa)] from Kv [m3/h]. Raises ParameterError."""
    area = _positive("Kv", kv) * _KV_AREA
    return area * _near_equal_factor(critical_ratio) / (REFERENCE_DENSITY * _REFERENCE_SPEED)


def cv(conductance: float, critical_ratio: float) -> float:
    """Cv [US gallons per minute] from the sonic conductance. Raises ParameterError."""
    return kv(conductance, critical_ratio) / KV_PER_CV


def conductance_from_cv(cv: float, critical_ratio: float) -> float:
    """C [m3/(s Pa)] from Cv [US gallons per minute]. Raises ParameterError."""
    return conductance_from_kv(KV_PER_CV * _positive("Cv", cv), critical_ratio)


def effective_area(conductance: float) -> float:
    """Effective area S [m2] from the sonic conductance. Raises ParameterError."""
    return (
        _positive("conductance", conductance)
        * REFERENCE_DENSITY
        * _REFERENCE_SPEED
        / _NOZZLE_FACTOR
    )


def conductance_from_area(area: float) -> float:
    """C [m3/(s Pa)] from the effective area S [m2]. Raises ParameterError."""
    return _positive("area", area) * _NOZZLE_FACTOR / (REFERENCE_DENSITY * _REFERENCE_SPEED)


def diameter(conductance: float, discharge_coefficient: float) -> float:
    """Diameter [m] of the round hole with the same choked flow. Raises ParameterError."""
    _check_discharge_coefficient(discharge_coefficient)
    return float(ops.sqrt(effective_area(conductance) / discharge_coefficient * 4.0 / ops.pi))


def conductance_from_diameter(diameter: float, discharge_coefficient: float) -> float:
    """C [m3/(s Pa)] of a round hole from its diameter [m] and discharge coefficient. Raises
    ParameterError.
    """
    _positive("diameter", diameter)
    _check_discharge_coefficient(discharge_coefficient)
    return conductance_from_area(discharge_coefficient * ops.pi / 4.0 * diameter**2)


def leak_valve(
    volume_flow: float, pressure: float, ambient: Ambient | None = None, critical_ratio: float = 0.3
) -> Valve:
    """Leak as a valve that is always open, from its flow at one gauge pressure.

    `volume_flow` [m3/s at the reference atmosphere] is the leakage from `pressure` [Pa] gauge to
    the surroundings. At other pressures the leak follows ISO 6358 with the given critical ratio
    (the default is chosen; that of a leak is rarely known). Raises ParameterError, also if the
    pressure is not above ambient.
    """
    ambient = Ambient() if ambient is None else ambient
    conductance = conductance_from_flow(
        volume_flow, critical_ratio, pressure + ambient.pressure, ambient.pressure
    )
    return Valve(conductance, critical_ratio)


def _unit_flow(critical_ratio: float, upstream: float, downstream: float) -> float:
    """Volume flow [m3/s] at the reference atmosphere for C = 1, by the law of `Valve` including its
    laminar chord.
    """
    _positive("upstream pressure", upstream)
    _positive("downstream pressure", downstream)
    if not downstream < upstream:
        raise ParameterError(
            f"the downstream pressure is {downstream:g} Pa; it must be less than the upstream"
            f" pressure of {upstream:g} Pa (both absolute)."
        )
    law = Valve(1e-8, critical_ratio)
    return float(
        law.mass_flow(upstream, downstream, 1.0, REFERENCE_TEMPERATURE) / (REFERENCE_DENSITY * 1e-8)
    )


def _positive(what: str, value: float) -> float:
    """The value. Raises ParameterError unless it is a finite number greater than zero."""
    if (
        isinstance(value, bool)
        or not isinstance(value, float | int)
        or not 0.0 < value < float("inf")
    ):
        raise ParameterError(f"{what} is {value!r}; it must be a finite number greater than zero.")
    return value


def _check_discharge_coefficient(value: float) -> None:
    if _positive("discharge coefficient", value) > 1.0:
        raise ParameterError(
            f"discharge coefficient is {value:g}; it must be at most 1 (about 0.6 for a sharp-edged"
            " hole)."
        )


def _near_equal_factor(critical_ratio: float) -> float:
    return float(
        ops.sqrt(1.0 - Valve(1e-8, critical_ratio).critical_ratio)
    )  # Valve declares the bounds


def in_series(*valves: Valve) -> Valve:
    """Equivalent valve of valves in series, in the direction of the flow.

    For two valves, with C2/C1 = k and s the pressure between them over the upstream pressure at
    choking:

        C1 <= b1 C2    the first chokes     C = C1
        else           the second chokes    C = C2 s,  s = (b1 + sqrt(b1^2 + A (1 - 2 b1)))/A,  A =
                       1 + k^2 (1 - b1)^2
        b = 1 - C^2 ((1 - b1)/C1^2 + (1 - b2)/C2^2)

    s solves C2 s = C1 sqrt(1 - ((s - b1)/(1 - b1))^2). The order matters: C = 1 and 2 with b = 0.3
    give 0.97 in one order and 0.92 in the other. Of any number of valves, C is the largest flow
    that none of them limits, by bisection. The maximum flow error is 2.8 % of the choked flow for b
    up to 0.6 and any ratio of the conductances, and for b from 0.2 to 0.5 1.6 % for two valves and
    1.8 % for three. Valid for steady flow in the given direction, without volume between the
    valves. Valves with C = 0 have no equivalent.

    Raises ParameterError for no valve, a valve with C = 0, or an argument that is not a Valve. The
    rules are equivalent to those of ISO 6358:1989 and of textbooks; they were derived
    independently, because neither text was available (ISO 6358-3:2014 uses a numerical method).
    """
    _check_valves(valves, "in_series")
    low = 0.0
    conductance = min(valve.conductance for valve in valves)
    if not _passes(valves, conductance):
        while low < (middle := (low + conductance) / 2.0) < conductance:
            low, conductance = (middle, conductance) if _passes(valves, middle) else (low, middle)
        conductance = low
    ratio = 1.0 - conductance**2 * sum((1.0 - v.critical_ratio) / v.conductance**2 for v in valves)
    return _equivalent_valve(conductance, ratio, valves)


def in_parallel(*valves: Valve) -> Valve:
    """Equivalent valve of valves in parallel; the order does not matter.

        C = sum C_i,   b = 1 - (sum C_i / sum (C_i/sqrt(1 - b_i)))^2

    The flow is overestimated by at most 5.3 % of the choked flow for b up to 0.6, and by 1.8 % for
    b from 0.2 to 0.5; it is exact for equal b. Raises ParameterError as `in_series`.
    """
    _check_valves(valves, "in_parallel")
    conductance = sum(v.conductance for v in valves)
    near_equal = sum(v.conductance / ops.sqrt(1.0 - v.critical_ratio) for v in valves)
    return _equivalent_valve(conductance, 1.0 - (conductance / near_equal) ** 2, valves)


def _check_valves(valves: tuple[Valve, ...], rule: str) -> None:
    if not valves:
        raise ParameterError(f"{rule}: no valve is given; give at least one.")
    for i, valve in enumerate(valves, 1):
        if not isinstance(valve, Valve):
            raise ParameterError(
                f"{rule}: argument {i} is {type(valve).__name__}; it must be a Valve, with C and b."
                f"{attribute_hint(valve, Valve)}"
            )
        if not valve.conductance > 0:
            raise ParameterError(
                f"{rule}: the conductance of argument {i} is 0; it must be positive. Leave out a"
                " closed parallel valve."
            )


def _passes(valves: tuple[Valve, ...], flow: float) -> bool:
    """Whether each valve passes a flow at the pressure that the ones before it leave; both over the
    upstream values.
    """
    pressure = 1.0
    for valve in valves:
        choked = valve.conductance * pressure
        if flow > choked:
            return False
        pressure *= valve.critical_ratio + (1.0 - valve.critical_ratio) * ops.sqrt(
            1.0 - (flow / choked) ** 2
        )
    return True


def _equivalent_valve(conductance: float, ratio: float, parts: tuple[Valve, ...]) -> Valve:
    """Valve with b >= 0 (negative only by rounding) and the widest laminar range of its parts; a
    single part itself.
    """
    if len(parts) == 1:
        return parts[0]
    return Valve(conductance, ops.maximum(ratio, 0.0), min(part.laminar_ratio for part in parts))
