"""The muscle after Hill, and the elements that stand beside its contractile one."""

from .creep import CreepElements
from .damper import Damper, DirectionalDamper, LinearDamper, PressureDamper
from .muscle import INNER, Muscle
from .reynolds2003 import Reynolds2003Damper, Reynolds2003Spring
from .series import RigidSeries, Series, SeriesSpring
from .serres2009 import Serres2009Damper, Serres2009Spring
from .spring import CubicSpring, LinearSpring, Spring
from .stop import EndStop, NoStop, Stop
from .wall import LaggingWall, RigidWall, SwellingWall, Wall

__all__ = [
    "INNER",
    "CreepElements",
    "CubicSpring",
    "Damper",
    "DirectionalDamper",
    "EndStop",
    "LaggingWall",
    "LinearDamper",
    "LinearSpring",
    "Muscle",
    "NoStop",
    "PressureDamper",
    "Reynolds2003Damper",
    "Reynolds2003Spring",
    "RigidSeries",
    "RigidWall",
    "Series",
    "SeriesSpring",
    "Serres2009Damper",
    "Serres2009Spring",
    "Spring",
    "Stop",
    "SwellingWall",
    "Wall",
]
