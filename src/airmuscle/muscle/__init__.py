"""The muscle after Hill, and the elements that stand beside its contractile one."""

from .creep import CreepElements as CreepElements
from .damper import Damper as Damper
from .damper import DirectionalDamper as DirectionalDamper
from .damper import LinearDamper as LinearDamper
from .damper import PressureDamper as PressureDamper
from .muscle import INNER as INNER
from .muscle import Muscle as Muscle
from .reynolds2003 import Reynolds2003Damper as Reynolds2003Damper
from .reynolds2003 import Reynolds2003Spring as Reynolds2003Spring
from .series import RigidSeries as RigidSeries
from .series import Series as Series
from .series import SeriesSpring as SeriesSpring
from .serres2009 import Serres2009Damper as Serres2009Damper
from .serres2009 import Serres2009Spring as Serres2009Spring
from .spring import CubicSpring as CubicSpring
from .spring import LinearSpring as LinearSpring
from .spring import Spring as Spring
from .stop import EndStop as EndStop
from .stop import NoStop as NoStop
from .stop import Stop as Stop
from .wall import LaggingWall as LaggingWall
from .wall import RigidWall as RigidWall
from .wall import SwellingWall as SwellingWall
from .wall import Wall as Wall
