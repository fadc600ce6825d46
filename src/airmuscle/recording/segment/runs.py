"""RunSplit: stretches of a recording in which one quantity is held while others sweep.

Held pressure is an isobaric run, held length or contraction an isometric one, held force an isotonic one. Held means
within `BAND` of the greatest value (within `STROKE` of contraction), or within what the sensor's noise explains. A file
may hold many runs one behind the other, as tables of static points do: then the quantity whose levels explain most
rows names them.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np

from ...core.arrays import Array
from ..recording import Recording
from .sensor import Sensor, estimate_sensors
from .interval import Interval, level_intervals

RELATIVE_BAND = 0.02
"""Part of its greatest value within which a quantity counts as held (chosen)."""
CONTRACTION_BAND = 0.005
"""Contraction within which a length counts as held (chosen)."""
SWEEP_FRACTION = 0.1
"""Part of its range in the recording that a quantity must change by to be swept (chosen)."""
MIN_ROWS = 3
"""The fewest rows of a run (chosen)."""


@dataclasses.dataclass(frozen=True)
class RunKind:
    """What a run holds: the columns that can show it, the first there being used."""

    name: str
    constant_columns: tuple[str, ...]


ISOBARIC = RunKind("isobaric", ("pressure",))
ISOMETRIC = RunKind("isometric", ("contraction", "length", "position"))
ISOTONIC = RunKind("isotonic", ("force",))
AT_REST = RunKind("at rest", ())
FREE = RunKind("free", ())
KINDS = (ISOBARIC, ISOMETRIC, ISOTONIC)
"""The kinds of run that hold one quantity; AT_REST holds all that was measured, FREE none."""


@dataclasses.dataclass(frozen=True)
class Run:
    """Rows of one kind; `column` is held at `value` [SI], `swept` are the columns that change."""

    interval: Interval
    kind: RunKind
    column: str | None
    value: float | None
    swept: tuple[str, ...]


def find_runs(recording: Recording, sensed: Mapping[str, Sensor] | None = None) -> tuple[Run, ...]:
    """The runs of a recording; one of kind FREE where nothing is held, none of an empty recording."""
    if not len(recording):
        return ()
    bands = _constant_bands(recording, sensed or estimate_sensors(recording))
    whole = _classify(recording, Interval(0, len(recording)), bands)
    if whole.kind is not FREE:
        return (whole,)
    split = [found for kind in KINDS if (found := _runs_at_levels(recording, kind, bands))]
    return max(split, key=lambda found: sum(len(run.interval) for run in found), default=(whole,))


def _column(recording: Recording, kind: RunKind) -> str | None:
    return next((name for name in kind.constant_columns if name in recording), None)


def _constant_bands(recording: Recording, sensed: Mapping[str, Sensor]) -> dict[str, float]:
    """The width within which each measured quantity counts as held."""
    deviations = {name: sensor.std for name, sensor in sensed.items()}
    return {
        name: max(_min_band(recording, name), 8.0 * deviations.get(name, 0.0))
        for kind in KINDS
        if (name := _column(recording, kind))
    }


def _min_band(recording: Recording, name: str) -> float:
    if name == "contraction":
        return CONTRACTION_BAND
    greatest = float(np.max(np.abs(recording[name])))
    return greatest * (CONTRACTION_BAND if name == "length" else RELATIVE_BAND)


def _classify(recording: Recording, stretch: Interval, bands: dict[str, float]) -> Run:
    """The run that a stretch is. Where two quantities are held, the pressure names it before length and force."""
    names = {kind: name for kind in KINDS if (name := _column(recording, kind))}
    held = [kind for kind, name in names.items() if _spread(recording[name][stretch.rows]) <= bands[name]]
    swept = tuple(name for kind, name in names.items() if kind not in held)
    if not held or (len(names) == 1 and swept):
        return Run(stretch, FREE, None, None, swept)
    if not swept:
        return Run(stretch, AT_REST, None, None, ())
    return _constant_run(recording, stretch, held[0], names[held[0]], swept)


def _constant_run(recording: Recording, stretch: Interval, kind: RunKind, name: str, swept: tuple[str, ...]) -> Run:
    return Run(stretch, kind, name, float(np.median(recording[name][stretch.rows])), swept)


def _spread(values: Array) -> float:
    """The width that holds all but one in fifty of the values: a single glitch does not end a run."""
    low, high = np.quantile(values, [0.01, 0.99])
    return float(high - low)


def _runs_at_levels(recording: Recording, kind: RunKind, bands: dict[str, float]) -> tuple[Run, ...]:
    """The runs in which one kind's quantity stays on a level while another sweeps."""
    name = _column(recording, kind)
    if name is None:
        return ()
    found = []
    for stretch in level_intervals(recording[name], bands[name]):
        swept = tuple(
            other
            for other, band in bands.items()
            if other != name and _spread(recording[other][stretch.rows]) > max(band, _min_sweep(recording, other))
        )
        if len(stretch) >= MIN_ROWS and swept:
            found.append(_constant_run(recording, stretch, kind, name, swept))
    return tuple(found)


def _min_sweep(recording: Recording, name: str) -> float:
    """The change from which on a quantity is swept: a part of its range in the whole recording."""
    return SWEEP_FRACTION * float(np.ptp(recording[name]))
