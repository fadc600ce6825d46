"""Compilation of LLVM text to machine code by llvmlite."""

import functools
from typing import Any

from .emit import DECLARED

LEVEL = 2
"""Optimisation level of printed modules."""
STRAIGHT_PASSES = (
    "simplify_cfg",
    "instruction_combine",
    "new_gvn",
    "simplify_cfg",
    "reassociate",
    "instruction_combine",
    "new_gvn",
    "simplify_cfg",
)
"""Passes for a function without loops, memory of its own, and calls to other printed functions: those of the standard
pipeline that change it, in half the time of the pipeline (measured)."""


def object_code(text: str) -> bytes:
    """An object file with the machine code of LLVM text for this processor."""
    import llvmlite.binding as llvm

    machine = native(LEVEL)
    module = llvm.parse_assembly(DECLARED + text)
    _optimise(module, machine)
    code: bytes = machine.emit_object(module)
    return code


def _optimise(module: Any, machine: Any) -> None:
    """Optimise a module: with the standard pipeline if it has functions to inline, else each function by itself."""
    import llvmlite.binding as llvm

    options = llvm.create_pipeline_tuning_options(speed_level=LEVEL)
    options.slp_vectorization = False
    builder = llvm.create_pass_builder(machine, options)
    functions = [function for function in module.functions if not function.is_declaration]
    if any(function.linkage == llvm.Linkage.internal for function in functions):
        builder.getModulePassManager().run(module, builder)
        return
    passes = llvm.create_new_function_pass_manager()
    for name in STRAIGHT_PASSES:
        getattr(passes, f"add_{name}_pass")()
    for function in functions:
        passes.run(function, builder)


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
