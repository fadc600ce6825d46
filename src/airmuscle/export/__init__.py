"""Export of plants, laws and controllers as source text of other languages: C99, JavaScript, MATLAB and Octave."""

from .controller import write_controller
from .identifiers import make_identifiers
from .targets import C99, JavaScript, Octave, Target
from .write import write_law, write_program

__all__ = [
    "C99",
    "JavaScript",
    "Octave",
    "Target",
    "make_identifiers",
    "write_controller",
    "write_law",
    "write_program",
]
