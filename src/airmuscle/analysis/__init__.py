"""Analysis of a plant: stiffness, linearisation, statics of joints; estimators and predictive controllers."""

from .extended_kalman_filter import ExtendedKalmanFilter
from .filter_consistency import consistency_band, normalised_error_squared
from .finite_control_set import FiniteControlSet
from .joint_plot import plot_reachable_region
from .linear_model import LinearModel, Pole, linearise
from .lqg import design_lqg
from .nonlinear_model_predictive import NonlinearModelPredictive
from .predictive_design import design_predictive
from .state_estimator import Innovation, StateEstimate, StateEstimator
from .static_stiffness import Stiffness, StiffnessPair, stiffness
from .statics_of_joint import JointPoints, JointStatics, joint_statics
from .unscented_kalman_filter import UnscentedKalmanFilter

__all__ = [
    "ExtendedKalmanFilter",
    "FiniteControlSet",
    "Innovation",
    "JointPoints",
    "JointStatics",
    "LinearModel",
    "NonlinearModelPredictive",
    "Pole",
    "StateEstimate",
    "StateEstimator",
    "Stiffness",
    "StiffnessPair",
    "UnscentedKalmanFilter",
    "consistency_band",
    "design_lqg",
    "design_predictive",
    "joint_statics",
    "linearise",
    "normalised_error_squared",
    "plot_reachable_region",
    "stiffness",
]
