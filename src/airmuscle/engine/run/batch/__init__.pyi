from .lanes import Double as Double
from .lanes import Precision as Precision
from .lanes import Single as Single
from .run import simulate_batch as simulate_batch
from .solution import BatchSolution as BatchSolution
from .stepper import BatchStepper as BatchStepper
