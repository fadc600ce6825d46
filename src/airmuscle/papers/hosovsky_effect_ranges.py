"""Ratios of the effects during filling and discharging over the ranges of the suspected causes' parameters."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from typing import Any

from ..report.chapter import Table
from ..report.formatting import format_unit
from .hosovsky_effects import PRINTED, SuspectedCauses, effect_of, fill_discharge_ratio, run_fill_of, substitutions
from .hosovsky_plant import FILLING, UnpublishedParameters

STRONGER = 1.2
"""Ratio above which filling is affected more than discharging, by at least a fifth (chosen)."""
SMALLEST_EFFECT = 100.0
"""Pressure change [Pa] below which a ratio has no meaning (chosen)."""
COMPONENTS: Mapping[str, Callable[[float], str]] = {
    "line_length": lambda value: "pressure measured at the valve",
    "critical_ratio": lambda value: rf"\(b = {value:g}\)",
    "index": lambda value: rf"\(m = {value:g}\)",
    "laminar_ratio": lambda value: f"laminar above {value:g}",
    "heat_transfer": lambda value: rf"first law, \(hA = {value:g}\) W/K",
    "series_stiffness": lambda value: "nonlinear series spring",
}
"""Parameters whose substitution affects filling more at the chosen value, each with the component that it sets."""


@dataclasses.dataclass(frozen=True)
class RatioRange:
    """Ratio of filling to discharging at both ends of a parameter's range and at its chosen value; NaN if no effect."""

    meaning: str
    unit: str
    values: tuple[float, float, float]
    ratios: tuple[float, float, float]

    @property
    def stronger(self) -> bool:
        """Whether filling is affected more by at least a fifth at all three values that have an effect."""
        return all(math.isnan(ratio) or ratio > STRONGER for ratio in self.ratios)


def ratio_ranges(parameters: UnpublishedParameters, suspected: SuspectedCauses) -> tuple[RatioRange, ...]:
    """Simulate fill and discharge at the low end, the chosen value and the high end of each parameter."""
    base = run_fill_of(PRINTED, parameters)
    result = []
    for name, component in COMPONENTS.items():
        item = getattr(suspected, name)
        values = (item.low, item.value, item.high)
        ratios = []
        for value in values:
            varied = dataclasses.replace(suspected, **{name: dataclasses.replace(item, value=value)})
            wanted = component(value)
            chosen = next(s for s in substitutions(parameters, varied) if s.component == wanted)
            effect = effect_of(base, chosen, run_fill_of(chosen, parameters))
            small = abs(effect.largest("pressure", FILLING)) < SMALLEST_EFFECT
            ratios.append(math.nan if small else fill_discharge_ratio(effect))
        result.append(RatioRange(item.meaning, item.unit, values, (ratios[0], ratios[1], ratios[2])))
    return tuple(result)


def range_table(ranges: tuple[RatioRange, ...]) -> Table:
    """Return the ratios of filling to discharging over the ranges of the parameters."""
    columns: dict[str, list[Any]] = {
        "parameter": [r.meaning for r in ranges],
        "unit": [format_unit(r.unit) for r in ranges],
    }
    for i, place in enumerate(("low end", "chosen value", "high end")):
        columns[place] = [r.values[i] for r in ranges]
    for i, place in enumerate(("low end", "chosen value", "high end")):
        columns[f"ratio at the {place} [1]"] = [
            None if math.isnan(r.ratios[i]) else float(f"{r.ratios[i]:.3g}") for r in ranges
        ]
    note = (
        "Ratio of the largest pressure change during filling to that during discharging. No value: the component "
        "equals the printed one."
    )
    return Table(
        "hosovsky_effect_ranges", "Filling and discharging over the ranges of the suspected causes", columns, note
    )


def describe_ranges(ranges: tuple[RatioRange, ...]) -> str:
    """Return for which parameters filling is affected more by at least a fifth over their whole range."""
    held = [r.meaning for r in ranges if r.stronger]
    failing = [
        f"{r.meaning} (ratio {r.ratios[0]:.3g}, {r.ratios[1]:.3g} and {r.ratios[2]:.3g} at {r.values[0]:g}, "
        f"{r.values[1]:g} and {r.values[2]:g} {format_unit(r.unit)})".replace(" )", ")")
        for r in ranges
        if not r.stronger
    ]
    text = f"Over the whole range of its parameter this holds for: {', '.join(held) or 'none'}."
    return text + (f" It does not hold over the range of: {', '.join(failing)}." if failing else "")
