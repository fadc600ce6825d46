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
from .interval import Interval, level_stretches

BAND = 0.02
"""Part of its greatest value within which a quantity counts as held (chosen)."""
STROKE = 0.005
"""Contraction within which a length counts as held (chosen)."""
SWEEP = 0.1
"""Part of its range in the recording that a quantity must change by to be swept (chosen)."""
FEWEST = 3
"""The fewest rows of a run (chosen)."""


@dataclasses.dataclass(frozen=True)
class Kind:
    """What a run holds: the columns that can show it, the first there being used."""

    name: str
    held: tuple[str, ...]


ISOBARIC = Kind("isobaric", ("pressure",))
ISOMETRIC = Kind("isometric", ("contraction", "length", "position"))
ISOTONIC = Kind("isotonic", ("force",))
AT_REST = Kind("at rest", ())
FREE = Kind("free", ())
KINDS = (ISOBARIC, ISOMETRIC, ISOTONIC)
"""The kinds of run that hold one quantity; AT_REST holds all that was measured, FREE none."""


@dataclasses.dataclass(frozen=True)
class Run:
    """Rows of one kind; `column` is held at `value` [SI], `swept` are the columns that change."""

    stretch: Interval
    kind: Kind
    column: str | None
    value: float | None
    swept: tuple[str, ...]


def find_runs(recording: Recording, sensed: Mapping[str, Sensor] | None = None) -> tuple[Run, ...]:
    """The runs of a recording; one of kind FREE where nothing is held, none of an empty recording."""
    if not len(recording):
        return ()
    bands = _bands(recording, sensed or estimate_sensors(recording))
    whole = _run(recording, Interval(0, len(recording)), bands)
    if whole.kind is not FREE:
        return (whole,)
    split = [found for kind in KINDS if (found := _levels(recording, kind, bands))]
    return max(split, key=lambda found: sum(len(run.stretch) for run in found), default=(whole,))


def _column(recording: Recording, kind: Kind) -> str | None:
    return next((name for name in kind.held if name in recording), None)


def _bands(recording: Recording, sensed: Mapping[str, Sensor]) -> dict[str, float]:
    """The width within which each measured quantity counts as held."""
    deviations = {name: sensor.deviation for name, sensor in sensed.items()}
    return {
        name: max(_least_band(recording, name), 8.0 * deviations.get(name, 0.0))
        for kind in KINDS
        if (name := _column(recording, kind))
    }


def _least_band(recording: Recording, name: str) -> float:
    if name == "contraction":
        return STROKE
    greatest = float(np.max(np.abs(recording[name])))
    return greatest * (STROKE if name == "length" else BAND)


def _run(recording: Recording, stretch: Interval, bands: dict[str, float]) -> Run:
    """The run that a stretch is. Where two quantities are held, the pressure names it before length and force."""
    names = {kind: name for kind in KINDS if (name := _column(recording, kind))}
    held = [kind for kind, name in names.items() if _spread(recording[name][stretch.rows]) <= bands[name]]
    swept = tuple(name for kind, name in names.items() if kind not in held)
    if not held or (len(names) == 1 and swept):
        return Run(stretch, FREE, None, None, swept)
    if not swept:
        return Run(stretch, AT_REST, None, None, ())
    return _held(recording, stretch, held[0], names[held[0]], swept)


def _held(recording: Recording, stretch: Interval, kind: Kind, name: str, swept: tuple[str, ...]) -> Run:
    return Run(stretch, kind, name, float(np.median(recording[name][stretch.rows])), swept)


def _spread(values: Array) -> float:
    """The width that holds all but one in fifty of the values: a single glitch does not end a run."""
    low, high = np.quantile(values, [0.01, 0.99])
    return float(high - low)


def _levels(recording: Recording, kind: Kind, bands: dict[str, float]) -> tuple[Run, ...]:
    """The runs in which one kind's quantity stays on a level while another sweeps."""
    name = _column(recording, kind)
    if name is None:
        return ()
    found = []
    for stretch in level_stretches(recording[name], bands[name]):
        swept = tuple(
            other
            for other, band in bands.items()
            if other != name and _spread(recording[other][stretch.rows]) > max(band, _sweep(recording, other))
        )
        if len(stretch) >= FEWEST and swept:
            found.append(_held(recording, stretch, kind, name, swept))
    return tuple(found)


def _sweep(recording: Recording, name: str) -> float:
    """The change from which on a quantity is swept: a part of its range in the whole recording."""
    return SWEEP * float(np.ptp(recording[name]))
