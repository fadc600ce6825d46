from .columns import QUANTITIES as QUANTITIES
from .columns import Quantity as Quantity
from .recording import Recording as Recording

# isort: split
# For the other rooms, not in __all__
from .columns import display_scale as display_scale
from .columns import quantity_of as quantity_of
from .plot import plot_columns as plot_columns
from .recording import resting_length_of as resting_length_of
from .vocabulary import UNIT_NAMES as UNIT_NAMES
from .vocabulary import WORDS as WORDS
from .vocabulary import Certainty as Certainty
from .vocabulary import read_heading as read_heading
from .vocabulary import unit_named as unit_named
