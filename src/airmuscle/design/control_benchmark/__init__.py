"""Control benchmark: controllers of an antagonistic joint, tuned alike and judged on a plant that is not their model.

joint = proportional_joint()
contenders = (*standard_contenders(joint), Contender("mine", MyLaw(gain=1e5), {"gain": (1e4, 1e6)}))
result = benchmark_controllers(joint, contenders, seed=1)
result.scores(), result.metric("mine", "sine 1 Hz", "rmse")
"""

from .benchmark import BenchmarkResult, BenchmarkRun, TunedContender, benchmark_controllers, ranking
from .chapter import benchmark_chapter, write_benchmark
from .contender_of_scenario import scenario_contender
from .contenders import Contender, standard_contenders
from .joints import BenchmarkJoint, on_off_joint, proportional_joint
from .learning import LearningCurve, learn
from .motion_dynamics import inverse_dynamics
from .motions import JointMotion, MinimumJerkMotion, RampMotion, SineMotion, StepMotion, SumOfMotions
from .plots import error_plot, run_plot
from .tasks import STANDARD_TASKS, ControlTask, StuckValve, find_tasks
from .tracking_metrics import TrackingMetrics

__all__ = [
    "STANDARD_TASKS",
    "BenchmarkJoint",
    "BenchmarkResult",
    "BenchmarkRun",
    "Contender",
    "ControlTask",
    "JointMotion",
    "LearningCurve",
    "MinimumJerkMotion",
    "RampMotion",
    "SineMotion",
    "StepMotion",
    "StuckValve",
    "SumOfMotions",
    "TrackingMetrics",
    "TunedContender",
    "benchmark_chapter",
    "benchmark_controllers",
    "error_plot",
    "find_tasks",
    "inverse_dynamics",
    "learn",
    "on_off_joint",
    "proportional_joint",
    "ranking",
    "run_plot",
    "scenario_contender",
    "standard_contenders",
    "write_benchmark",
]
