"""Kernels as text in languages of users: C99, JavaScript, MATLAB and Octave. No physics here, and no import of numba.

The functions of `compile/kernels/` are the text. They are read as syntax trees; a printer for each language
writes them.
"""

from .c import CKernels
from .javascript import JavaScriptKernels
from .matlab import MatlabKernels
from .source import read_kernels, read_text
from .types import typed

__all__ = ["CKernels", "JavaScriptKernels", "MatlabKernels", "read_kernels", "read_text", "typed"]
