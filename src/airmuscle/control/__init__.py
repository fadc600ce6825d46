"""Controllers: what closes a loop around a plant, each a frozen model with a memory that is a value."""

from .pid import PID as PID
from .split import Split as Split
from .two_point import TwoPoint as TwoPoint
