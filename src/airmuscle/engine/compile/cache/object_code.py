"""Machine code of a kernel: compiled by numba to code that needs no numba, and loaded again from its bytes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..llvm.jit import engine_of
from ..target import native
from .entry_point import entry_point, numba_arguments
from .inlining import shallow_scope_copies

_C_LIBRARY = frozenset({"sqrt", "ceil", "floor", "memset", "memcpy", "memmove"})
_STANDALONE = {"_nrt": False, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}


def load_engine(code: bytes) -> Any:
    """An execution engine that holds the machine code; its function is `entry`."""
    return engine_of(code)


def build(kernel: Any, kinds: Sequence[str]) -> bytes:
    """Machine code of a numba kernel for arguments of these kinds; empty where the kernel cannot do without numba.

    That is where it allocates or raises, returns something else than a status, or calls what neither LLVM nor the
    C library provides; or with a version of numba that passes arrays in another way than `entry_point` knows.
    """
    import llvmlite.binding as llvm
    import numba
    from numba.core.errors import NumbaError

    options = {name: value for name, value in kernel.targetoptions.items() if name != "nopython"}
    standalone = numba.njit(**options, **_STANDALONE)(kernel.py_func)
    signature = tuple(_numba_type(kind) for kind in kinds)
    try:
        with shallow_scope_copies():
            standalone.compile(signature)
    except NumbaError:
        return b""
    text, returned = standalone.inspect_llvm(signature), {s.return_type for s in standalone.nopython_signatures}
    functions = [f for f in llvm.parse_assembly(text).functions if not f.is_declaration]
    expected = ["retptr", "excinfo", *numba_arguments(kernel.py_func.__code__.co_varnames[: len(kinds)], kinds)]
    if [[a.name for a in f.arguments] for f in functions] != [expected] or text.count("%excinfo") > 1:
        return b""  # arrays are passed in another way, or it raises
    if not returned <= {numba.int64, numba.none}:
        return b""
    return _emit(f"{text}\n{entry_point(functions[0].name, kinds)}", functions[0].name)


def _numba_type(kind: str) -> Any:
    import numba

    item = {"q": numba.int64, "d": numba.float64, "f": numba.float32}[kind[0]]
    return numba.types.Array(item, int(kind[1:]), "C") if len(kind) > 1 else item


def _emit(text: str, inner: str) -> bytes:
    """Machine code of `entry` and of the functions that it calls; empty if the module does not contain all of them."""
    import llvmlite.binding as llvm

    module, machine = llvm.parse_assembly(text), native(3)
    module.get_function(inner).linkage = "internal"
    passes = llvm.create_new_module_pass_manager()
    passes.add_global_dead_code_eliminate_pass()
    passes.run(module, llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options()))
    declared = [v.name for v in (*module.functions, *module.global_variables) if v.is_declaration]
    if any(not name.startswith("llvm.") and name not in _C_LIBRARY for name in declared):
        return b""
    code: bytes = machine.emit_object(module)
    return code
