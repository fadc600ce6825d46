"""Array type: NumPy arrays of double-precision floats."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
"""A NumPy array of float64."""
