"""Kernels as text in languages of users: C99, JavaScript, MATLAB and Octave. No physics here, and
no import of numba.

The functions of `compile/kernels/` are the text. They are read as syntax trees; a printer for each
language writes them. `plain_kernels` are the same functions in Python, for few numbers.
"""

from .braces import CKernels, JavaScriptKernels
from .matlab import MatlabKernels
from .source import plain_kernels, read_kernels, read_text
from .types import typed

__all__ = [
    "CKernels",
    "JavaScriptKernels",
    "MatlabKernels",
    "plain_kernels",
    "read_kernels",
    "read_text",
    "typed",
]
