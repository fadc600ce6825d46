"""What a muscle pulls at."""

from .antagonistic_joint import AntagonisticJoint as AntagonisticJoint
from .base import Coordinate as Coordinate
from .base import Mechanism as Mechanism
from .hanging_mass import HangingMass as HangingMass
from .held import Held as Held
from .in_series import InSeries as InSeries
from .isometric import Isometric as Isometric
from .isotonic import Isotonic as Isotonic
from .lever import Lever as Lever
from .mounted import Mounted as Mounted
from .prescribed import Prescribed as Prescribed
from .pulley import Pulley as Pulley
from .spring_load import SpringLoad as SpringLoad
from .stopped import Stopped as Stopped
from .stopped import StoppedJoint as StoppedJoint
from .wrapper import Wrapper as Wrapper
