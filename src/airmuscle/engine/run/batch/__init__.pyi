from .lanes import Double as Double
from .lanes import Precision as Precision
from .lanes import Single as Single
from .run import simulate_batch as simulate_batch
from .solution import BatchSolution as BatchSolution
from .stepper import BatchStepper as BatchStepper

# isort: split
# For the other packages, not in __all__
from ..loop_sensitivities import CONTROLLER as CONTROLLER
from .job import hidden_progress as hidden_progress
