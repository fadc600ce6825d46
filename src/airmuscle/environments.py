"""Learning environments: the names of `airmuscle.outlets.environments`, which registers them with Gymnasium."""

from .outlets import environments as _room

__getattr__, __dir__, __all__ = _room.__getattr__, _room.__dir__, _room.__all__
