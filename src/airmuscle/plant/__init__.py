"""Plant: one or more muscles with their pneumatic circuits, a mechanism, a gas and the ambient air."""

from .energy_balance import WithEnergyMeters
from .plant import Plant, total_air

__all__ = ["Plant", "WithEnergyMeters", "total_air"]
