"""Export of plants, laws and controllers as source text of other languages, as FMUs, and as MuJoCo plugins."""

from .building import build_and_run
from .controller import PRECISIONS, write_controller
from .fmu import WrittenFmu, write_fmu
from .identifiers import make_identifiers
from .modelica import write_modelica
from .mujoco_plugin import MuscleActuator, write_mujoco_plugin
from .targets import C99, JavaScript, Octave, Target
from .write import write_law, write_program

__all__ = [
    "C99",
    "PRECISIONS",
    "JavaScript",
    "MuscleActuator",
    "Octave",
    "Target",
    "WrittenFmu",
    "build_and_run",
    "make_identifiers",
    "write_controller",
    "write_fmu",
    "write_law",
    "write_modelica",
    "write_mujoco_plugin",
    "write_program",
]
