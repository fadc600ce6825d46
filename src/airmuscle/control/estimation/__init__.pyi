from .kalman_filters import ExtendedKalmanFilter as ExtendedKalmanFilter
from .kalman_filters import UnscentedKalmanFilter as UnscentedKalmanFilter
from .kalman_filters import consistency_band as consistency_band
from .kalman_filters import normalised_error_squared as normalised_error_squared
from .lqg_and_adrc import design_adrc as design_adrc
from .lqg_and_adrc import design_lqg as design_lqg
from .moving_horizon import MovingHorizonEstimator as MovingHorizonEstimator
from .nonlinear_predictive import FiniteControlSet as FiniteControlSet
from .nonlinear_predictive import NonlinearModelPredictive as NonlinearModelPredictive
from .predictive_design import PredictiveControl as PredictiveControl
from .predictive_design import design_predictive as design_predictive
from .state_estimator import Innovation as Innovation
from .state_estimator import StateEstimate as StateEstimate
from .state_estimator import StateEstimator as StateEstimator

# isort: split
# For the other packages, not in __all__
from .lqg_and_adrc import GAO2003 as GAO2003
from .lqg_and_adrc import HAN2009 as HAN2009
