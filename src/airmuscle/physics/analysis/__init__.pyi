from .linear_model import LinearModel as LinearModel
from .linear_model import Pole as Pole
from .linear_model import linearise as linearise
from .sampled_model import SampledModel as SampledModel
from .static_stiffness import Stiffness as Stiffness
from .static_stiffness import StiffnessPair as StiffnessPair
from .static_stiffness import stiffness as stiffness
from .statics_of_joint import JointPoints as JointPoints
from .statics_of_joint import JointStatics as JointStatics
from .statics_of_joint import joint_statics as joint_statics
from .statics_of_joint import plot_reachable_region as plot_reachable_region

# isort: split
# For the other packages, not in __all__
from .sampled_model import held as held
