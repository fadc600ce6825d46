"""Learning environments: plants with a task as Gymnasium environments, single and as vectors of thousands.

Each name is imported when it is first used, so that `register_environments` costs little.
"""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
