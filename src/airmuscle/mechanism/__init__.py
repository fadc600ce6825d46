"""What a muscle pulls at."""

from .antagonistic_joint import AntagonisticJoint
from .base import Coordinate, Mechanism
from .hanging_mass import HangingMass
from .held import Held
from .in_series import InSeries
from .isometric import Isometric
from .isotonic import Isotonic
from .lever import Lever
from .mounted import Mounted
from .prescribed import Prescribed
from .pulley import Pulley
from .spring_load import SpringLoad
from .stopped import Stopped, StoppedJoint
from .wrapper import Wrapper

__all__ = [
    "AntagonisticJoint",
    "Coordinate",
    "HangingMass",
    "Held",
    "InSeries",
    "Isometric",
    "Isotonic",
    "Lever",
    "Mechanism",
    "Mounted",
    "Prescribed",
    "Pulley",
    "SpringLoad",
    "Stopped",
    "StoppedJoint",
    "Wrapper",
]
