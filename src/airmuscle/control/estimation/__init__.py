"""State estimators and their consistency, LQG and predictive controllers."""

from .extended_kalman_filter import ExtendedKalmanFilter
from .filter_consistency import consistency_band, normalised_error_squared
from .finite_control_set import FiniteControlSet
from .lqg import design_lqg
from .nonlinear_model_predictive import NonlinearModelPredictive
from .predictive_design import design_predictive
from .state_estimator import Innovation, StateEstimate, StateEstimator
from .unscented_kalman_filter import UnscentedKalmanFilter

__all__ = [
    "ExtendedKalmanFilter",
    "FiniteControlSet",
    "Innovation",
    "NonlinearModelPredictive",
    "StateEstimate",
    "StateEstimator",
    "UnscentedKalmanFilter",
    "consistency_band",
    "design_lqg",
    "design_predictive",
    "normalised_error_squared",
]
