from .energy_balance import WithEnergyMeters as WithEnergyMeters
from .energy_balance import total_air as total_air
from .plant import Plant as Plant
from .pressure_driven import PressureDriven as PressureDriven
from .pressure_driven import open_plant as open_plant
from .static_plant import MuscleState as MuscleState
