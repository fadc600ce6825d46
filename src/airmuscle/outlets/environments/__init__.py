"""Learning environments: plants with a task as Gymnasium environments, single and as vectors of
thousands.

Where Gymnasium is installed, `import airmuscle.environments` registers them, also that of the
identifier "airmuscle.environments:airmuscle/Joint-v0". Each name is imported when it is first used.
"""

import importlib.util

from ...core import InputError, attach_stub, install_command

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
__all__ += ["register_environments"]
EPISODE_PERIODS = 500
"""Periods after which an episode of a registered environment is truncated."""


def register_environments() -> None:
    """Register airmuscle/Joint-v0, JointOnOff-v0, Lift-v0 and Arm-v0 with Gymnasium, once.

    `gymnasium.make("airmuscle/Joint-v0")` and `gymnasium.make_vec(..., num_envs=N)` then return
    them. Gymnasium 1.0 and later call this for no package by themselves. Raises InputError if
    Gymnasium is not installed.
    """
    if importlib.util.find_spec("gymnasium") is None:
        raise InputError(
            "learning environments need the package gymnasium. Install it:"
            f" {install_command('sim')}"
        )
    from gymnasium.envs import registration

    for name in ("Joint", "JointOnOff", "Lift", "Arm"):
        identifier = f"airmuscle/{name}-v0"
        if identifier not in registration.registry:
            registration.register(
                identifier,
                entry_point="airmuscle.outlets.environments.plant_env:make_environment",
                vector_entry_point="airmuscle.outlets.environments.plant_vector_env:make_vector",
                max_episode_steps=EPISODE_PERIODS,
                kwargs={"kind": name},
            )


if importlib.util.find_spec("gymnasium") is not None:
    register_environments()
