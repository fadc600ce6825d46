from .columns import QUANTITIES as QUANTITIES
from .columns import Quantity as Quantity
from .recording import Recording as Recording
