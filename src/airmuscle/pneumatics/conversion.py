"""Between the sonic conductance C and the other figures that data sheets print for the size of a valve.

C [m3/(s Pa)] is the figure that the laws use. Every pair of functions here is inverse to one another.

    nominal flow    volume flow at the reference atmosphere of ISO 8778 from 6 to 5 bar gauge, the atmosphere 1 bar:
                    Q = C p1 phi(p2/p1), p1 = 7 bar, p2 = 6 bar absolute; SMC's tables of C, b and Q agree to the digit
    Kv              m3/h of water at a pressure difference of 1 bar (IEC 60534). It stands for an area A by
                    Q = A sqrt(2 dp/rho), and air near equal pressures flows through the same A:
                    C rho0 sqrt(R T0) = A sqrt(1 - b)
    Cv              US gallons a minute of water at 1 psi; Kv = 0.865 Cv (IEC 60534)
    effective area  S of the nozzle without loss that chokes at the same flow: C rho0 = S 0.6847/sqrt(R T0), which is
                    the rule S [mm2] = 5.0 C [dm3/(s bar)] of JIS B 8390 and of CKD's and SMC's catalogues
    diameter        of a round hole, S = c_d pi d^2/4 with its discharge coefficient c_d

All but the effective area need b, which a sheet with Kv or the nominal flow alone does not print: 0.3 is usual, and
what was taken must be said. Kv measured with water, or Cv with air at a drop of 0.1 bar, says nothing of choke: of
SMC's valves the Cv printed beside C and b is 4 to 31 % above this rule. Where C and b are printed, use them.
Kv and Cv are plain numbers in the units of their definitions; everything else is SI.
"""

from __future__ import annotations

from ..core import ops
from ..core.errors import ParameterError
from .gas import GAS_CONSTANT, REFERENCE_DENSITY, REFERENCE_TEMPERATURE, Ambient
from .valve import Valve

NOMINAL_UPSTREAM, NOMINAL_DOWNSTREAM = 7e5, 6e5
"""Absolute pressures [Pa] of the nominal flow: 6 and 5 bar gauge over an atmosphere of 1 bar."""
KV_PER_CV = 0.865
"""Kv [m3/h at 1 bar] of a valve with Cv 1 [US gallons a minute at 1 psi]."""
_HEAT_RATIO = 1.4
_NOZZLE_FACTOR: float = _HEAT_RATIO**0.5 * (2.0 / (_HEAT_RATIO + 1.0)) ** (
    (_HEAT_RATIO + 1.0) / (2.0 * (_HEAT_RATIO - 1.0))
)
"""qm sqrt(R T)/(S p1) of choked air without loss [1], 0.6847."""
_REFERENCE_SPEED: float = ops.sqrt(GAS_CONSTANT * REFERENCE_TEMPERATURE)
"""sqrt(R T0) [m/s]."""
_KV_AREA: float = 1.0 / 3600.0 / ops.sqrt(2.0 * 1e5 / 1000.0)
"""Area [m2] of Kv = 1: 1 m3/h of water, 1000 kg/m3, at 1 bar."""


def nominal_flow(conductance: float, critical_ratio: float) -> float:
    """Volume flow [m3/s] at the reference atmosphere, from 6 to 5 bar gauge. Raises ParameterError."""
    return flow_at_reference(conductance, critical_ratio, NOMINAL_UPSTREAM, NOMINAL_DOWNSTREAM)


def conductance_from_nominal_flow(volume_flow: float, critical_ratio: float) -> float:
    """C [m3/(s Pa)] from the volume flow [m3/s] at the reference atmosphere, 6 to 5 bar gauge; ParameterError."""
    return conductance_from_flow(volume_flow, critical_ratio, NOMINAL_UPSTREAM, NOMINAL_DOWNSTREAM)


def flow_at_reference(conductance: float, critical_ratio: float, upstream: float, downstream: float) -> float:
    """Volume flow [m3/s] at the reference atmosphere between two absolute pressures [Pa], the air at 293.15 K.

    Raises ParameterError for a number that is not positive and finite, or a downstream pressure not the smaller.
    """
    _check_positive("conductance", conductance)
    return conductance * _unit_flow(critical_ratio, upstream, downstream)


def conductance_from_flow(volume_flow: float, critical_ratio: float, upstream: float, downstream: float) -> float:
    """C [m3/(s Pa)] from a volume flow [m3/s] at the reference atmosphere between two absolute pressures [Pa]."""
    _check_positive("volume_flow", volume_flow)
    return volume_flow / _unit_flow(critical_ratio, upstream, downstream)


def kv(conductance: float, critical_ratio: float) -> float:
    """Kv [m3/h] of a valve. Raises ParameterError."""
    _check_positive("conductance", conductance)
    return conductance * REFERENCE_DENSITY * _REFERENCE_SPEED / (_KV_AREA * _near_equal_factor(critical_ratio))


def conductance_from_kv(kv: float, critical_ratio: float) -> float:
    """C [m3/(s Pa)] from Kv [m3/h]. Raises ParameterError."""
    _check_positive("Kv", kv)
    return kv * _KV_AREA * _near_equal_factor(critical_ratio) / (REFERENCE_DENSITY * _REFERENCE_SPEED)


def cv(conductance: float, critical_ratio: float) -> float:
    """Cv [US gallons a minute] of a valve. Raises ParameterError."""
    return kv(conductance, critical_ratio) / KV_PER_CV


def conductance_from_cv(cv: float, critical_ratio: float) -> float:
    """C [m3/(s Pa)] from Cv [US gallons a minute]. Raises ParameterError."""
    _check_positive("Cv", cv)
    return conductance_from_kv(KV_PER_CV * cv, critical_ratio)


def effective_area(conductance: float) -> float:
    """Effective area S [m2]. Raises ParameterError."""
    _check_positive("conductance", conductance)
    return conductance * REFERENCE_DENSITY * _REFERENCE_SPEED / _NOZZLE_FACTOR


def conductance_from_area(area: float) -> float:
    """C [m3/(s Pa)] from the effective area S [m2]. Raises ParameterError."""
    _check_positive("area", area)
    return area * _NOZZLE_FACTOR / (REFERENCE_DENSITY * _REFERENCE_SPEED)


def diameter(conductance: float, discharge_coefficient: float) -> float:
    """Diameter [m] of the round hole that chokes at the same flow. Raises ParameterError."""
    _check_discharge_coefficient(discharge_coefficient)
    return float(ops.sqrt(effective_area(conductance) / discharge_coefficient * 4.0 / ops.pi))


def conductance_from_diameter(diameter: float, discharge_coefficient: float) -> float:
    """C [m3/(s Pa)] of a round hole from its diameter [m] and discharge coefficient [1]. Raises ParameterError."""
    _check_positive("diameter", diameter)
    _check_discharge_coefficient(discharge_coefficient)
    return conductance_from_area(discharge_coefficient * ops.pi / 4.0 * diameter**2)


def leak_valve(
    volume_flow: float, pressure: float, ambient: Ambient | None = None, critical_ratio: float = 0.3
) -> Valve:
    """A leak as a valve that is always open, from its flow at one gauge pressure.

    `volume_flow` [m3/s] at the reference atmosphere is what leaks out of `pressure` [Pa] gauge. At other
    pressures it follows ISO 6358 with the critical ratio given (chosen: a leak's is rarely known). Raises
    ParameterError, also for a pressure that is not above the surroundings.
    """
    ambient = Ambient() if ambient is None else ambient
    conductance = conductance_from_flow(volume_flow, critical_ratio, pressure + ambient.pressure, ambient.pressure)
    return Valve(conductance, critical_ratio)


def _unit_flow(critical_ratio: float, upstream: float, downstream: float) -> float:
    """Volume flow at the reference atmosphere of C = 1; Valve's own law, so that it holds on its chord too."""
    _check_positive("upstream pressure", upstream)
    _check_positive("downstream pressure", downstream)
    if not downstream < upstream:
        raise ParameterError(
            f"air flows from the higher pressure: upstream {upstream:g} Pa is not above downstream {downstream:g} Pa "
            "(both absolute)."
        )
    law = Valve(1e-8, _check_critical_ratio(critical_ratio))
    return float(law.mass_flow(upstream, downstream, 1.0, REFERENCE_TEMPERATURE) / (REFERENCE_DENSITY * 1e-8))


def _near_equal_factor(critical_ratio: float) -> float:
    return float(ops.sqrt(1.0 - _check_critical_ratio(critical_ratio)))


def _check_critical_ratio(critical_ratio: float) -> float:
    return Valve(1e-8, critical_ratio).critical_ratio  # the bounds are declared there


def _check_positive(what: str, value: float) -> None:
    if isinstance(value, bool) or not isinstance(value, float | int) or not 0.0 < value < float("inf"):
        raise ParameterError(f"{what} is {value!r}; it must be a finite number above zero.")


def _check_discharge_coefficient(value: float) -> None:
    _check_positive("discharge coefficient", value)
    if value > 1.0:
        raise ParameterError(f"discharge coefficient is {value:g}; it is at most 1 (about 0.6 for a sharp edge).")
