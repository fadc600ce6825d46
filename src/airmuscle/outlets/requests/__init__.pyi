from .braid import BraidRequest as BraidRequest
from .declaration import Option as Option
from .declaration import RequestError as RequestError
from .declaration import build as build
from .declaration import form_fields as form_fields
from .declaration import option as option
from .declaration import options_of as options_of
from .declaration import request as request
from .entry import EntryRequest as EntryRequest
from .fit import FitRequest as FitRequest
from .fitting import fit_requested as fit_requested
from .reading import ReadingRequest as ReadingRequest
from .size import SizeRequest as SizeRequest

# isort: split
# For the other rooms, not in __all__
from .braid import BraidSize as BraidSize
from .braid import braid_of_length as braid_of_length
from .braid import check_one_length as check_one_length
from .braid import read_braid as read_braid
from .declaration import Where as Where
from .fit import WEAK as WEAK
from .reading import Pairs as Pairs
from .reading import read_pair as read_pair
