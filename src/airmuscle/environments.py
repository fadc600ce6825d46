"""Learning environments: the names of `airmuscle.outlets.environments`, which registers them with
Gymnasium.
"""

from functools import partial

from .outlets import environments as _room

__getattr__ = partial(getattr, _room)
__dir__ = partial(dir, _room)
__all__ = _room.__all__
