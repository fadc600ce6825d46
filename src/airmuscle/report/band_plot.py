"""The figure of a fit's bands: where the law may lie, and where one more reading would."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..core import plotting
from ..core.errors import IdentificationError
from ..recording import Recording
from .chapter import Plot
from .levels import levels_of

if TYPE_CHECKING:
    from ..identify.result import Fit

LEVEL = 0.95
MOST = 5
"""Curves that still stand apart with their bands."""
POINTS = 121
_DRAWN = {"pressure": (1e-3, "kPa"), "contraction": (100.0, "%"), "force": (1.0, "N")}


class _Roles(NamedTuple):
    """Which quantity is held on a curve, and which runs along it."""

    held: str
    along: str


_ROLES = {
    "force": _Roles("pressure", "contraction"),
    "contraction": _Roles("pressure", "force"),
    "pressure": _Roles("contraction", "force"),
}


def band_plot(fit: Fit, name: str = "bands") -> Plot | None:
    """Curves of the fitted law with 95 % bands, and half their width beside; None where no band can be told."""
    from ..identify.confidence_bands import confidence_band

    answer, roles = fit.fitted_quantity.name, _ROLES[fit.fitted_quantity.name]
    levels = levels_of(fit.recording[roles.held], MOST)
    figure, (left, right) = plotting.new_figure(1, 2, width=7.4, height=3.7)
    (factor, unit), (across, across_unit) = _DRAWN[answer], _DRAWN[roles.along]
    for i, level in enumerate(levels):
        points = _along(fit, roles, float(level))
        try:
            law, reading = (confidence_band(fit, points, level=LEVEL, prediction=r) for r in (False, True))
        except IdentificationError:
            return None
        colour = plotting.LINES[i % len(plotting.LINES)]
        x = across * np.where(law.value < 0 if answer == "force" else False, np.nan, points[roles.along])
        scale, word = _DRAWN[roles.held]
        style = {"color": colour, "linestyle": plotting.DASHES[i % 5]}
        left.plot(x, factor * law.value, label=f"{scale * level:.4g} {word}", **style)
        left.fill_between(x, factor * reading.low, factor * reading.high, color=colour, alpha=0.15, linewidth=0)
        left.fill_between(x, factor * law.low, factor * law.high, color=colour, alpha=0.35, linewidth=0)
        right.plot(x, factor * (law.high - law.value), **style)
        right.plot(x, factor * (reading.high - reading.value), color=colour, linewidth=0.7, alpha=0.7)
    _points(left, fit, roles, factor, across)
    left.set(xlabel=f"{roles.along} [{across_unit}]", ylabel=f"{answer} [{unit}]")
    right.set(xlabel=f"{roles.along} [{across_unit}]", ylabel=f"half width of the band [{unit}]", ylim=(0.0, None))
    plotting.legend_below(figure, left, columns=MOST + 1)
    return Plot(name, _CAPTION, figure)


_CAPTION = (
    "95 % bands at levels that were measured, dark for the law, faint for one more reading; on the right half their "
    "width, thick for the law, thin for a reading, as far as the muscle pulls. They take errors as independent, which "
    "those of one slow ramp are not."
)


def _along(fit: Fit, roles: _Roles, level: float) -> Recording:
    """Points over the data's range at one level, of the length of muscle that most rows have."""
    low, high = fit.data_ranges[roles.along]
    columns = {roles.along: np.linspace(low, high, POINTS), roles.held: np.full(POINTS, level)}
    lengths = fit.recording.columns.get("resting_length")
    constants = {} if lengths is None else {"resting_length": float(np.median(lengths))}
    return Recording(columns, fit.recording.origin, constants)


def _points(axes: Any, fit: Fit, roles: _Roles, factor: float, across: float) -> None:
    measured = fit.recording.rows(fit.censoring == 0)
    style = {"marker": ".", "linestyle": "none", "markersize": 2, "color": plotting.BLACK, "alpha": 0.35}
    axes.plot(across * measured[roles.along], factor * measured[fit.fitted_quantity.name], label="measured", **style)
    values = factor * measured[fit.fitted_quantity.name]
    margin = 0.08 * float(np.ptp(values)) or 1.0
    axes.set_ylim(float(values.min()) - margin, float(values.max()) + margin)
