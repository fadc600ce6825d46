from .plant_env import MeasuredObservations as MeasuredObservations
from .plant_env import PlantEnv as PlantEnv
from .plant_env import with_on_off_valves as with_on_off_valves
from .plant_vector_env import PlantVectorEnv as PlantVectorEnv
from .plant_vector_env import Rollouts as Rollouts
from .plant_vector_env import roll_out as roll_out
from .randomisation import FactorRange as FactorRange
from .randomisation import FitUncertainty as FitUncertainty
from .randomisation import Randomisation as Randomisation
from .randomisation import ValueRange as ValueRange
from .standard import ArmReaching as ArmReaching
from .standard import JointTracking as JointTracking
from .standard import LoadLifting as LoadLifting
from .standard import arm_task as arm_task
from .standard import joint_task as joint_task
from .standard import lift_task as lift_task
from .task import EnvironmentTask as EnvironmentTask
from .task import Observation as Observation

EPISODE_PERIODS: int

def register_environments() -> None: ...
