"""Control benchmark: controllers of an antagonistic joint, tuned alike and judged on plants that are not their model.

joint = proportional_joint()
contenders = (*standard_contenders(joint), Contender("mine", MyLaw(gain=1e5), {"gain": (1e4, 1e6)}))
result = benchmark_controllers(joint, contenders, seeds=(1, 2, 3))
result.scores(), result.metric("mine", "sine 1 Hz", "rmse")
"""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
