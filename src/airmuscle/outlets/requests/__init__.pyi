from .body import BodyRequest as BodyRequest
from .body import FitOutRequest as FitOutRequest
from .declaration import Option as Option
from .declaration import RequestError as RequestError
from .declaration import build as build
from .declaration import form_fields as form_fields
from .declaration import many as many
from .declaration import option as option
from .declaration import optional as optional
from .declaration import options_of as options_of
from .declaration import request as request
from .fit import BraidRequest as BraidRequest
from .fit import FitRequest as FitRequest
from .fitting import fit_requested as fit_requested
from .joint import JointFitRequest as JointFitRequest
from .joint import fit_requested_arm as fit_requested_arm
from .joint import inspect_requested as inspect_requested
from .reading import ReadingRequest as ReadingRequest
from .size import SizeRequest as SizeRequest

# isort: split
# For the other rooms, not in __all__
from .declaration import Where as Where
from .declaration import read_pair as read_pair
from .fit import SPLITS as SPLITS
from .fit import WEAK as WEAK
from .fit import braid_of_length as braid_of_length
from .fit import check_one_length as check_one_length
from .fit import problem_of_lengths as problem_of_lengths
from .fit import read_braid as read_braid
from .reading import Pairs as Pairs
from .size import KINDS as KINDS
