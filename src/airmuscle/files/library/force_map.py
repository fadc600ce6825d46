"""Force map of a law, as a grid that other programs and the readers of this one take."""

import warnings

import numpy as np

from ...core import Array
from ...core.errors import AirmuscleWarning
from ...physics.muscle.characteristic.base import Characteristic
from ...physics.muscle.characteristic.modes import values_or_nan
from ...physics.muscle.characteristic.validity_range import validity_range_of
from .entry import Entry

UNSTATED_PRESSURES = (0.0, 6e5)
UNSTATED_CONTRACTIONS = (0.0, 0.25)
"""Range of a law that states none (chosen)."""
MAP_PRESSURES = 13
MAP_CONTRACTIONS = 27
"""Columns and rows of a written map (chosen)."""
GRID = "force [N] over contraction [%], pressure [kPa]"
"""Quantities of a written map, as the option --grid takes them."""


def forces_on_grid(law: Characteristic, pressures: Array, contractions: Array) -> Array:
    """Tensions [N], shape (P, C), 0 where the muscle is slack; not a number without a solution."""
    grid = np.meshgrid(pressures, contractions, indexing="ij")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)  # the caller has chosen the range
        values = values_or_nan(law.force, grid[0].ravel(), grid[1].ravel())
    return np.maximum(np.asarray(values), 0.0).reshape(grid[0].shape)


def force_map_csv(entry: Entry) -> str:
    """The force map of an entry in its validity range: contraction [%] down, pressure [kPa] across,
    tension [N] in the cells, none where the law has no solution. A law without a range has 0 to 6
    bar and 0 to 25 % (chosen).
    """
    known = validity_range_of(entry.characteristic, entry.validity_range)
    pressures = np.linspace(
        *(UNSTATED_PRESSURES if known is None else known.pressure), MAP_PRESSURES
    )
    contractions = np.linspace(
        *(UNSTATED_CONTRACTIONS if known is None else known.contraction), MAP_CONTRACTIONS
    )
    forces = forces_on_grid(entry.characteristic, pressures, contractions)
    lines = [",".join(["", *(_cell(1e-3 * pressure) for pressure in pressures)])]
    for contraction, row in zip(contractions, forces.T, strict=True):
        lines.append(",".join([_cell(100.0 * contraction), *map(_cell, row)]))
    return "\n".join(lines) + "\n"


def _cell(value: float) -> str:
    """Ten digits; empty for what is not finite."""
    return f"{value:.10g}" if np.isfinite(value) else ""
