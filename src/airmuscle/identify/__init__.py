"""Parameters from measurements: `fit` and what it returns."""

from .censoring import UNCENSORED as UNCENSORED
from .censoring import Censoring as Censoring
from .fit import fit as fit
from .loss import Huber as Huber
from .loss import LeastSquares as LeastSquares
from .loss import Loss as Loss
from .loss import SoftL1 as SoftL1
from .result import Estimate as Estimate
from .result import Fit as Fit
