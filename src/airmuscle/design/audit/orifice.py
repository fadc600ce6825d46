"""Audit of a flow law of an orifice: mass flow at absolute pressures before and behind it."""

from collections.abc import Callable, Iterator

import numpy as np

from ...core import Array
from .finding import AuditFinding, AuditResult

Flow = Callable[[Array, Array], Array]
"""Mass flow [kg/s] at absolute pressures [Pa] before and behind the orifice."""
UPSTREAM = 600e3
"""Absolute pressure [Pa] before the orifice (chosen)."""
ATMOSPHERE = 101_325.0
TOLERANCE = 0.01
"""Relative change from which it is a fault (chosen)."""
CHOKED = (0.02, 0.1)
"""Ratios of pressures at which every valve chokes: the critical ratio of ISO 6358 is above."""
RULES = (
    "zero without a difference",
    "chokes",
    "falls with the pressure behind",
    "proportional",
    "reversed",
)


def audit_orifice(
    name: str, flow: Flow, evaluations: Callable[[], int] | None = None
) -> AuditResult:
    """The audit of a flow law by what ISO 6358 and the second law of thermodynamics ask for."""
    findings = tuple(_findings(name, flow))
    count = evaluations() if evaluations is not None else 0
    return AuditResult(name, RULES, findings, (), count)


def _findings(name: str, flow: Flow) -> Iterator[AuditFinding]:
    ratios = np.linspace(0.01, 1.0, 100)
    flows = np.asarray(flow(np.full(ratios.shape, UPSTREAM), UPSTREAM * ratios), dtype=float)
    scale = float(np.nanmax(np.abs(flows))) or 1e-300

    def call(upstream: float, downstream: float) -> str:
        value = float(flow(np.array([upstream]), np.array([downstream]))[0])
        return f"{name}({upstream:.6g}, {downstream:.6g}) = {value:.6g}"

    if not np.isfinite(flows).all():
        ratio = float(ratios[np.flatnonzero(~np.isfinite(flows))[0]])
        text = f"No finite flow at a ratio of pressures of {ratio:.3g}."
        yield AuditFinding("chokes", text, (call(UPSTREAM, ratio * UPSTREAM),))
        return
    if abs(flows[-1]) > 1e-3 * scale:
        text = f"A flow of {flows[-1]:.4g} kg/s without a difference of pressure."
        yield AuditFinding(RULES[0], text, (call(UPSTREAM, UPSTREAM),))
    choked = np.asarray(flow(np.full(2, UPSTREAM), UPSTREAM * np.array(CHOKED)), dtype=float)
    change = float(abs(choked[0] - choked[1])) / scale
    if change > TOLERANCE:
        text = (
            f"The flow does not choke: between ratios of {CHOKED[0]:g} and {CHOKED[1]:g} it changes"
            f" by {100 * change:.3g} %. Below the critical ratio it must not depend on the pressure"
            " behind."
        )
        yield AuditFinding(
            "chokes", text, tuple(call(UPSTREAM, ratio * UPSTREAM) for ratio in CHOKED)
        )
    rise = float(np.max(flows - np.minimum.accumulate(flows))) / scale
    if rise > TOLERANCE:
        place = int(np.argmax(flows - np.minimum.accumulate(flows)))
        text = (
            f"The flow grows by {100 * rise:.3g} % with the pressure behind, up to a ratio of"
            f" {ratios[place]:.3g}."
        )
        replay = (call(UPSTREAM, 0.01 * UPSTREAM), call(UPSTREAM, float(ratios[place]) * UPSTREAM))
        yield AuditFinding(RULES[2], text, replay)
    yield from _proportional(name, flow, call)
    reversed_flow = float(flow(np.array([0.5 * UPSTREAM]), np.array([UPSTREAM]))[0])
    if reversed_flow > TOLERANCE * scale:
        text = (
            f"Air flows from the lower to the higher pressure, with {reversed_flow:.4g} kg/s; the"
            " flow must be zero or negative there."
        )
        yield AuditFinding(RULES[4], text, (call(0.5 * UPSTREAM, UPSTREAM),))


def _proportional(
    name: str, flow: Flow, call: Callable[[float, float], str]
) -> Iterator[AuditFinding]:
    """Choked flow is proportional to the absolute pressure before the orifice."""
    ratio = CHOKED[0]
    half = UPSTREAM / 2.0
    pair = np.asarray(
        flow(np.array([half, UPSTREAM]), ratio * np.array([half, UPSTREAM])), dtype=float
    )
    if pair[0] == 0.0 or abs(pair[1] / pair[0] - 2.0) <= 2.0 * TOLERANCE:
        return
    growth = float(pair[1] / pair[0])
    as_gauge = (UPSTREAM + ATMOSPHERE) / (half + ATMOSPHERE)
    cause = ""
    if abs(growth - as_gauge) < 2.0 * TOLERANCE:
        cause = " The law adds an atmosphere: it seems to expect gauge pressures."
    text = (
        f"Twice the absolute pressure before the orifice gives {growth:.4g} times the choked flow;"
        f" it must be 2.{cause}"
    )
    yield AuditFinding(
        "proportional", text, tuple(call(value, ratio * value) for value in (half, UPSTREAM))
    )
