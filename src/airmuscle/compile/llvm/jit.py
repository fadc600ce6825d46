"""Compilation of LLVM text to machine code by llvmlite."""

from __future__ import annotations

from typing import Any

from ..target import native
from .emit import DECLARED


def jit_compile(text: str) -> Any:
    """Machine code of LLVM text; the returned engine must stay alive as long as its addresses are used."""
    import llvmlite.binding as llvm

    machine = native(2)
    module = llvm.parse_assembly(DECLARED + text)
    options = llvm.create_pipeline_tuning_options(speed_level=2)
    options.slp_vectorization = False
    passes = llvm.create_pass_builder(machine, options)
    passes.getModulePassManager().run(module, passes)
    engine = llvm.create_mcjit_compiler(module, machine)
    engine.finalize_object()
    return engine
