"""What a muscle pulls at."""

from .base import Coordinate as Coordinate
from .base import Mechanism as Mechanism
from .hanging_mass import HangingMass as HangingMass
from .held import Held as Held
from .isometric import Isometric as Isometric
