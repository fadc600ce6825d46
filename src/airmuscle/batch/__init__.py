"""Thousands of plants at once: other parameters, other starts, other commands, one pass over all cores."""

from .precision import Double as Double
from .precision import Precision as Precision
from .precision import Single as Single
from .result import Batch as Batch
from .simulate_batch import simulate_batch as simulate_batch
