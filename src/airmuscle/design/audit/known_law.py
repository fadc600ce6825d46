"""Laws that the program knows as subjects of an audit: an entry of the library, measured points."""

import warnings
from pathlib import Path

import numpy as np

from ...bench import read_csv
from ...core import Array
from ...core.errors import AirmuscleWarning
from ...files.library import Entry
from ...physics.muscle.characteristic import validity_range_of, values_or_nan
from .audited_law import AuditedLaw

PRESSURES = (0.0, 6e5)
CONTRACTIONS = (0.0, 0.25)
"""Range of an entry that states none (chosen)."""


def law_of_entry(entry: Entry) -> AuditedLaw:
    """The law of a library entry or a muscle file, in its validity range; negative forces are zero,
    as a muscle takes them.
    """
    law = entry.characteristic
    known = validity_range_of(law, entry.validity_range)

    def force(pressure: Array, contraction: Array) -> Array:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", AirmuscleWarning)  # beyond the range is asked for
            return np.maximum(values_or_nan(law.force, pressure, contraction), 0.0)

    pressures = PRESSURES if known is None else known.pressure
    contractions = CONTRACTIONS if known is None else known.contraction
    return AuditedLaw(entry.name, force, pressures, contractions, refuses=True)


def law_of_points(path: Path) -> AuditedLaw:
    """The law that interpolates the points of a file with pressure, contraction and force linearly.
    Raises FileError.
    """
    from scipy.interpolate import LinearNDInterpolator

    recording = read_csv(path)
    pressures, contractions, forces = (
        np.asarray(recording[name]) for name in ("pressure", "contraction", "force")
    )
    pressure_scale = float(np.ptp(pressures)) or 1.0
    contraction_scale = float(np.ptp(contractions)) or 1.0
    places = np.column_stack([pressures / pressure_scale, contractions / contraction_scale])
    surface = LinearNDInterpolator(places, forces)

    def force(pressure: Array, contraction: Array) -> Array:
        return np.asarray(surface(pressure / pressure_scale, contraction / contraction_scale))

    return AuditedLaw(
        path.name,
        force,
        (float(pressures.min()), float(pressures.max())),
        (float(contractions.min()), float(contractions.max())),
        is_table=True,
    )
