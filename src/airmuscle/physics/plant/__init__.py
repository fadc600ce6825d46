"""Plant: one or more muscles with their pneumatic circuits, a mechanism, a gas and the ambient air."""

from .energy_balance import WithEnergyMeters, total_air
from .muscle_state import MuscleState
from .opening import open_plant
from .plant import Plant

__all__ = ["MuscleState", "Plant", "WithEnergyMeters", "open_plant", "total_air"]
