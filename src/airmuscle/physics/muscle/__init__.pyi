from . import characteristic as characteristic
from . import friction as friction
from . import geometry as geometry
from .characteristic.reynolds2003 import Reynolds2003Damper as Reynolds2003Damper
from .characteristic.reynolds2003 import Reynolds2003Spring as Reynolds2003Spring
from .characteristic.serres2009 import Serres2009Damper as Serres2009Damper
from .characteristic.serres2009 import Serres2009Spring as Serres2009Spring
from .isobars import compute_isobars as compute_isobars
from .muscle import INNER_CONTRACTION as INNER_CONTRACTION
from .muscle import Muscle as Muscle
from .passive_elements import CreepElements as CreepElements
from .passive_elements import CubicSpring as CubicSpring
from .passive_elements import Damper as Damper
from .passive_elements import DirectionalDamper as DirectionalDamper
from .passive_elements import EndStop as EndStop
from .passive_elements import LinearDamper as LinearDamper
from .passive_elements import LinearSpring as LinearSpring
from .passive_elements import NoStop as NoStop
from .passive_elements import PressureDamper as PressureDamper
from .passive_elements import RigidWall as RigidWall
from .passive_elements import Spring as Spring
from .passive_elements import Stop as Stop
from .passive_elements import SwellingWall as SwellingWall
from .passive_elements import ViscoelasticWall as ViscoelasticWall
from .passive_elements import Wall as Wall
from .ratings import RatedRange as RatedRange
from .ratings import Ratings as Ratings
from .series import CubicSeriesSpring as CubicSeriesSpring
from .series import ElasticSeriesElement as ElasticSeriesElement
from .series import RigidSeriesElement as RigidSeriesElement
from .series import SeriesElement as SeriesElement
from .series import SeriesSpring as SeriesSpring

# isort: split
# For the other packages, not in __all__
from .ratings import LENGTH_BOUNDS as LENGTH_BOUNDS
