from .outlets.environments import *  # noqa: F403
