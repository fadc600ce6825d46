"""Plant: one or more muscles with their pneumatic circuits, a mechanism, a gas and the ambient air."""

from .energy_balance import Metered
from .plant import Plant, total_air

__all__ = ["Metered", "Plant", "total_air"]
