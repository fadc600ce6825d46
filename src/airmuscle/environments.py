"""Learning environments: the names of `airmuscle.outlets.environments`, which registers them with Gymnasium."""

from functools import partial

from .outlets import environments as _room

__getattr__, __dir__, __all__ = partial(getattr, _room), partial(dir, _room), _room.__all__
