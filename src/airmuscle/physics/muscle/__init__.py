"""Hill-type muscle model: contractile element, parallel and series elements, wall, end stop."""

from .characteristic.reynolds2003 import Reynolds2003Damper, Reynolds2003Spring
from .characteristic.serres2009 import Serres2009Damper, Serres2009Spring
from .display import parameter_rows
from .isobars import compute_isobars
from .muscle import INNER_CONTRACTION, Muscle
from .passive_elements import (
    CreepElements,
    CubicSpring,
    Damper,
    DirectionalDamper,
    EndStop,
    LinearDamper,
    LinearSpring,
    NoStop,
    PressureDamper,
    Spring,
    Stop,
)
from .ratings import RatedRange, Ratings
from .series import CubicSeriesSpring, ElasticSeriesElement, RigidSeriesElement, SeriesElement, SeriesSpring
from .wall import RigidWall, SwellingWall, ViscoelasticWall, Wall

__all__ = [
    "INNER_CONTRACTION",
    "CreepElements",
    "CubicSeriesSpring",
    "CubicSpring",
    "Damper",
    "DirectionalDamper",
    "ElasticSeriesElement",
    "EndStop",
    "LinearDamper",
    "LinearSpring",
    "Muscle",
    "NoStop",
    "PressureDamper",
    "RatedRange",
    "Ratings",
    "Reynolds2003Damper",
    "Reynolds2003Spring",
    "RigidSeriesElement",
    "RigidWall",
    "SeriesElement",
    "SeriesSpring",
    "Serres2009Damper",
    "Serres2009Spring",
    "Spring",
    "Stop",
    "SwellingWall",
    "ViscoelasticWall",
    "Wall",
    "compute_isobars",
    "parameter_rows",
]
