"""Opening of a plant: its load is replaced by ports, so that another simulator can carry the load."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..mechanism import ExternalLoad
from .plant import Plant


def open_plant(plant: Plant, shortenings: Sequence[float] = ()) -> Plant:
    """The plant with shortenings [m] and their speeds [m/s] as inputs, and the tensions of its muscles as outputs.

    shortenings  of the muscles [m], from their resting lengths, in states without inputs; 0 by default

    With one muscle the inputs are `shortening` and `shortening_speed`, and the output is `force`; with several, the
    name of the muscle precedes them. Raises ParameterError for another number of shortenings than muscles.
    """
    names = tuple(muscle.name for muscle in plant.muscles) if len(plant.muscles) > 1 else ()
    return replace(plant, mechanism=ExternalLoad(names, tuple(shortenings)))
