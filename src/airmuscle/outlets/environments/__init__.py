"""Learning environments: plants with a task as Gymnasium environments, single and as vectors of thousands.

Where Gymnasium is installed, `import airmuscle.environments` registers them, also that of the identifier
"airmuscle.environments:airmuscle/Joint-v0". Each name is imported when it is first used.
"""

import importlib.util

from ...core.stubs import attach_stub
from .registration import register_environments

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
if importlib.util.find_spec("gymnasium") is not None:
    register_environments()
