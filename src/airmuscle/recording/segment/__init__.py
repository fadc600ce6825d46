"""What a recording consists of: runs, branches, plateaus, transients, glitches, and what its sensors can tell."""

from .branches import Branch as Branch
from .branches import branches as branches
from .branches import directions as directions
from .findings import Finding as Finding
from .findings import refuse_unswept as refuse_unswept
from .inspection import Inspection as Inspection
from .inspection import inspect as inspect
from .inspection import inspect_all as inspect_all
from .outliers import Outlier as Outlier
from .outliers import outliers as outliers
from .plateaus import Plateau as Plateau
from .plateaus import plateau_points as plateau_points
from .plateaus import plateaus as plateaus
from .quasi_static import quasi_static as quasi_static
from .runs import AT_REST as AT_REST
from .runs import FREE as FREE
from .runs import ISOBARIC as ISOBARIC
from .runs import ISOMETRIC as ISOMETRIC
from .runs import ISOTONIC as ISOTONIC
from .runs import Run as Run
from .runs import runs as runs
from .sampling import Sampling as Sampling
from .sampling import sampling as sampling
from .sensor import Sensor as Sensor
from .sensor import sensors as sensors
from .stretch import Stretch as Stretch
