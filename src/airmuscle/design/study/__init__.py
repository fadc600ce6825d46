"""Studies of a scenario: designs of experiments, metrics and sensitivities; tuning of a
controller's gains.
"""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
