"""From a kernel that numba compiled to machine code that stands by itself, and from a file back into memory."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..target import native
from .entry_point import entry, parts

_C_LIBRARY = frozenset({"sqrt", "ceil", "floor", "memset", "memcpy", "memmove"})
_NOTHING_OF_PYTHON = {"_nrt": False, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}


def load_engine(code: bytes) -> Any:
    """An engine that holds the machine code; its function is `entry`."""
    import llvmlite.binding as llvm

    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), native(3))
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    return engine


def build(kernel: Any, kinds: Sequence[str], arguments: Sequence[Any]) -> bytes:
    """Machine code of a kernel of numba's for arguments of these kinds; nothing where it cannot do without numba.

    It cannot where it allocates or raises, returns something else than a status, or calls what neither LLVM nor the
    C library has. Neither can a kernel of a numba that takes arguments apart in another way than `entry` knows.
    """
    import llvmlite.binding as llvm
    import numba
    from numba.core.errors import NumbaError

    options = {name: value for name, value in kernel.targetoptions.items() if name != "nopython"}
    alone = numba.njit(**options, **_NOTHING_OF_PYTHON)(kernel.py_func)
    signature = tuple(map(numba.typeof, arguments))
    try:
        alone.compile(signature)
    except NumbaError:
        return b""
    text, returned = alone.inspect_llvm(signature), {s.return_type for s in alone.nopython_signatures}
    functions = [f for f in llvm.parse_assembly(text).functions if not f.is_declaration]
    known = ["retptr", "excinfo", *parts(kernel.py_func.__code__.co_varnames[: len(kinds)], kinds)]
    if [[a.name for a in f.arguments] for f in functions] != [known] or text.count("%excinfo") > 1:
        return b""  # taken apart otherwise, or it raises
    if not returned <= {numba.int64, numba.none}:
        return b""
    return _emitted(f"{text}\n{entry(functions[0].name, kinds)}", functions[0].name)


def _emitted(text: str, inner: str) -> bytes:
    """Machine code of what `entry` needs of a module; nothing where that is not all in there."""
    import llvmlite.binding as llvm

    module, machine = llvm.parse_assembly(text), native(3)
    module.get_function(inner).linkage = "internal"
    passes = llvm.create_new_module_pass_manager()
    passes.add_global_dead_code_eliminate_pass()
    passes.run(module, llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options()))
    asked = [v.name for v in (*module.functions, *module.global_variables) if v.is_declaration]
    if any(not name.startswith("llvm.") and name not in _C_LIBRARY for name in asked):
        return b""
    code: bytes = machine.emit_object(module)
    return code
