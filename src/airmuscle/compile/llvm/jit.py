"""Compilation of LLVM text to machine code by llvmlite."""

from __future__ import annotations

from typing import Any

from ..target import native
from .emit import DECLARED

LEVEL = 2
"""Optimisation level of printed modules."""


def object_code(text: str) -> bytes:
    """An object file with the machine code of LLVM text for this processor."""
    import llvmlite.binding as llvm

    machine = native(LEVEL)
    module = llvm.parse_assembly(DECLARED + text)
    options = llvm.create_pipeline_tuning_options(speed_level=LEVEL)
    options.slp_vectorization = False
    passes = llvm.create_pass_builder(machine, options)
    passes.getModulePassManager().run(module, passes)
    code: bytes = machine.emit_object(module)
    return code


def engine_of(code: bytes) -> Any:
    """An engine with the code of an object file; it must stay alive as long as its addresses are used."""
    import llvmlite.binding as llvm

    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), native(LEVEL))
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    return engine


def jit_compile(text: str) -> Any:
    """An engine with the machine code of LLVM text, for modules that are not stored."""
    return engine_of(object_code(text))
