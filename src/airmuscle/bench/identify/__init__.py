"""Static identification: fits, uncertainty, model selection, conversion and shape constraints."""

from .bootstrapping import Bootstrap, bootstrap
from .candidates import Candidate, standard_candidates
from .censoring import UNCENSORED, Censoring
from .confidence_bands import Band, confidence_band
from .conversion import ModelConversion, convert
from .cross_validation import BlockSplit, GroupSplit, LevelSplit, RunSplit, SpecimenSplit
from .experiment_design import BenchLimits
from .joint_selection import JointSelection, select_for_both
from .length_errors import LengthError, estimate_length_error, find_length_errors
from .loss import Huber, LeastSquares, Loss, SoftL1
from .model_selection import Comparison, compare
from .profile_likelihood import ProfileLikelihood, profile, weakly_determined
from .recursive_fit import RecursiveFit
from .result import Estimate, Fit
from .static_fit import fit
from .surface.shape import ShapeConstrainedFit, find_shape_violations, fit_shape_constrained

__all__ = [
    "UNCENSORED",
    "Band",
    "BenchLimits",
    "BlockSplit",
    "Bootstrap",
    "Candidate",
    "Censoring",
    "Comparison",
    "Estimate",
    "Fit",
    "GroupSplit",
    "Huber",
    "JointSelection",
    "LeastSquares",
    "LengthError",
    "LevelSplit",
    "Loss",
    "ModelConversion",
    "ProfileLikelihood",
    "RecursiveFit",
    "RunSplit",
    "ShapeConstrainedFit",
    "SoftL1",
    "SpecimenSplit",
    "bootstrap",
    "compare",
    "confidence_band",
    "convert",
    "estimate_length_error",
    "find_length_errors",
    "find_shape_violations",
    "fit",
    "fit_shape_constrained",
    "profile",
    "select_for_both",
    "standard_candidates",
    "weakly_determined",
]
