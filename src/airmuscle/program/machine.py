"""LLVM text as machine code, by llvmlite, which numba brings."""

from __future__ import annotations

import functools
from typing import Any

from .llvm import DECLARED


@functools.cache
def _target() -> Any:
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    features = llvm.get_host_cpu_features().flatten()
    target = llvm.Target.from_default_triple()
    return lambda: target.create_target_machine(cpu=llvm.get_host_cpu_name(), features=features, opt=2)


def compiled(text: str) -> Any:
    """Machine code of LLVM text; the returned engine must stay alive as long as its addresses are used."""
    import llvmlite.binding as llvm

    machine = _target()()
    module = llvm.parse_assembly(DECLARED + text)
    options = llvm.create_pipeline_tuning_options(speed_level=2)
    options.slp_vectorization = False
    passes = llvm.create_pass_builder(machine, options)
    passes.getModulePassManager().run(module, passes)
    engine = llvm.create_mcjit_compiler(module, machine)
    engine.finalize_object()
    return engine
