"""Decorator of the parts of kernels.

numba copies a part into the kernel that calls it, which so remains one function, whose machine code can be stored.
"""

from __future__ import annotations

import numba

PART = numba.njit(error_model="numpy", nogil=True, inline="always")
"""Decorator of a part of a kernel, with floating-point operations in the order in which they are written."""

CONTRACTED_PART = numba.njit(error_model="numpy", fastmath={"contract", "reassoc"}, nogil=True, inline="always")
"""Decorator of a part whose sums may be reordered and whose products and sums may be fused."""
