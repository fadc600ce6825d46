"""Processor that machine code is made for: its name and features, and the width of its registers.

It is the processor of this machine. The environment variable AIRMUSCLE_PROCESSOR names a lower
level of x86-64 instead, for tests, and for code that other processors must be able to run.
"""

import dataclasses
import functools
import os
from collections.abc import Mapping

from ....core import ParameterError
from .engine_packages import llvm_binding

VARIABLE = "AIRMUSCLE_PROCESSOR"
"""The environment variable that names a level."""
NARROWEST = 16
"""Bytes of a register of every processor with vectors: SSE2, NEON."""
REGISTERS = {"avx512f": 64, "avx": 32}
"""Bytes of the widest register of a processor with a feature; the first of them counts."""


@dataclasses.dataclass(frozen=True)
class TargetProcessor:
    """A processor by LLVM's name and features; `register` is the width of its widest register in
    bytes.
    """

    name: str
    features: str
    register: int


LEVELS = {
    "x86-64-v2": ("sse4.2", NARROWEST),
    "x86-64-v3": ("avx2", REGISTERS["avx"]),
    "x86-64-v4": ("avx512vl", REGISTERS["avx512f"]),
}
"""A feature of each level that the level below lacks, and the width of its registers."""


def processor() -> TargetProcessor:
    """The processor that machine code is made for. Raises ParameterError if AIRMUSCLE_PROCESSOR
    names a level that is unknown, or that this processor does not reach.
    """
    level = os.environ.get(VARIABLE, "")
    return level_of(level) if level else _this_processor()


def possible_levels() -> list[str]:
    """The levels that this processor reaches."""
    features = _features()
    return [name for name, (feature, _) in LEVELS.items() if features.get(feature)]


def level_of(level: str) -> TargetProcessor:
    """A level of x86-64, such as x86-64-v3. Raises ParameterError as `processor`."""
    possible = possible_levels()
    if level not in possible:
        allowed = f"this processor can run {', '.join(possible) or 'no such level'}"
        raise ParameterError(
            f"{VARIABLE} is {level!r}; {allowed}. Unset it to use all features of the processor."
        )
    return TargetProcessor(level, "", LEVELS[level][1])


def register_width(features: Mapping[str, bool]) -> int:
    """The bytes of the widest register of a processor with these features."""
    widths = (width for feature, width in REGISTERS.items() if features.get(feature))
    return next(widths, NARROWEST)


@functools.cache
def _this_processor() -> TargetProcessor:
    llvm = llvm_binding()
    features = llvm.get_host_cpu_features()
    return TargetProcessor(llvm.get_host_cpu_name(), features.flatten(), register_width(features))


@functools.cache
def _features() -> Mapping[str, bool]:
    features: Mapping[str, bool] = llvm_binding().get_host_cpu_features()
    return features
