"""The union of the entries of the library."""

from .entry import Entry
from .plant_entry import PlantEntry
from .product_entry import ProductEntry
from .valve_entry import ValveEntry

AnyEntry = Entry | ValveEntry | ProductEntry | PlantEntry
