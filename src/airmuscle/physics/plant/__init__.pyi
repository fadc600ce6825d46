from .energy_balance import WithEnergyMeters as WithEnergyMeters
from .energy_balance import total_air as total_air
from .muscle_state import MuscleState as MuscleState
from .plant import Plant as Plant
from .pressure_driven import PressureDriven as PressureDriven
from .pressure_driven import open_plant as open_plant
