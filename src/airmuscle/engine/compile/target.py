"""This machine as LLVM's target."""

from __future__ import annotations

import functools
from typing import Any


@functools.cache
def _target() -> Any:
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return llvm.Target.from_default_triple()


def native(level: int) -> Any:
    """A code generator for this very processor, with so much optimisation (0 to 3); each engine owns its own."""
    import llvmlite.binding as llvm

    features = llvm.get_host_cpu_features().flatten()
    return _target().create_target_machine(cpu=llvm.get_host_cpu_name(), features=features, opt=level)
