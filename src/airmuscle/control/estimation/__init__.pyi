from .estimates import Innovation as Innovation
from .estimates import StateEstimate as StateEstimate
from .kalman_filters import ExtendedKalmanFilter as ExtendedKalmanFilter
from .kalman_filters import UnscentedKalmanFilter as UnscentedKalmanFilter
from .kalman_filters import consistency_band as consistency_band
from .kalman_filters import normalised_error_squared as normalised_error_squared
from .linear_design import design_adrc as design_adrc
from .linear_design import design_lqg as design_lqg
from .moving_horizon import MovingHorizonEstimator as MovingHorizonEstimator
from .nonlinear_predictive import FiniteControlSet as FiniteControlSet
from .nonlinear_predictive import NonlinearModelPredictive as NonlinearModelPredictive
from .predictive_design import PredictiveControl as PredictiveControl
from .predictive_design import design_predictive as design_predictive
from .state_estimator import StateEstimator as StateEstimator

# isort: split
# For the other packages, not in __all__
from .linear_design import GAO2003 as GAO2003
from .linear_design import HAN2009 as HAN2009
