"""Engine: compiled systems, input signals and sampled loops, runs, batches and sensitivities of any
System.
"""

from ..core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
