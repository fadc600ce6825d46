"""True plant of a comparison of controllers, which differs from the model that they know."""

import dataclasses
from collections.abc import Mapping

from ...core import ShortRepr
from ...engine.loop import Driver
from ...physics import Plant


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class TruePlant(ShortRepr):
    """A plant on which controllers are judged.

    name         of the truth in tables
    plant        the plant itself, which the controllers do not know
    drivers      of the valves
    extra_delay  dead time of all sensors that nobody knows, in samples, beside the stated one
    description  in what it differs from the model, by the headings of the table of truths
    """

    name: str
    plant: Plant
    drivers: Mapping[str, Driver] = dataclasses.field(default_factory=dict)
    extra_delay: int = 0
    description: Mapping[str, str] = dataclasses.field(default_factory=dict)
