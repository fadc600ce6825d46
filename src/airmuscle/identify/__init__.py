"""Parameters from measurements: `fit` and what it returns, `compare` and what stands around them."""

from .band import Band, band
from .bootstrap import Bootstrap, bootstrap
from .candidates import Candidate, standard_candidates
from .censoring import UNCENSORED, Censoring
from .compare import Comparison, compare
from .convert import Conversion, convert
from .fit import fit
from .leave_out import Blocks, LeaveOut, Levels, Runs, Specimens
from .loss import Huber, LeastSquares, Loss, SoftL1
from .profile import Profile, profile, weakly_determined
from .result import Estimate, Fit
from .surface.shape import ShapedFit, fit_shaped, shape_breaks

__all__ = [
    "UNCENSORED",
    "Band",
    "Blocks",
    "Bootstrap",
    "Candidate",
    "Censoring",
    "Comparison",
    "Conversion",
    "Estimate",
    "Fit",
    "Huber",
    "LeastSquares",
    "LeaveOut",
    "Levels",
    "Loss",
    "Profile",
    "Runs",
    "ShapedFit",
    "SoftL1",
    "Specimens",
    "band",
    "bootstrap",
    "compare",
    "convert",
    "fit",
    "fit_shaped",
    "profile",
    "shape_breaks",
    "standard_candidates",
    "weakly_determined",
]
