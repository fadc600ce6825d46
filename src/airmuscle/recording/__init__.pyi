from .columns import QUANTITIES as QUANTITIES
from .columns import Quantity as Quantity
from .recording import Recording as Recording

# isort: split
# For the other rooms, not in __all__
from .recording import resting_length_of as resting_length_of
