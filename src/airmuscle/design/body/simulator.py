"""Module mujoco, which computes the geometry of a body."""

import re
from typing import Any

from ...core import ParameterError, install_command

OLDEST = (3, 17)
"""First version of MuJoCo whose model contains the sparse structure of the tendon Jacobian."""
REMEDY = f"install it with: {install_command('mujoco')}"


def load_simulator() -> Any:
    """The module mujoco. Raises ParameterError where it is missing or too old."""
    try:
        import mujoco
    except ImportError:
        raise ParameterError(
            f"the package mujoco, which computes the geometry of a body, is not installed; {REMEDY}"
        ) from None
    numbers = tuple(int(number) for number in re.findall(r"\d+", mujoco.__version__)[:2])
    if numbers < OLDEST:
        raise ParameterError(
            f"MuJoCo {mujoco.__version__} is too old to compute the geometry of a body; {REMEDY}"
        )
    return mujoco
