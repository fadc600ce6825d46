"""Machine code: compilation of LLVM text by llvmlite, and of kernels by numba into object code that
is stored.
"""

import contextlib
import functools
from collections import defaultdict
from collections.abc import Iterator, Sequence
from typing import Any

from .emit import DECLARED
from .engine_packages import llvm_binding, numba_module
from .processor import processor

LEVEL = 2
"""Optimisation level of printed modules."""
STRAIGHT_PASSES = """
simplify_cfg instruction_combine new_gvn simplify_cfg reassociate instruction_combine new_gvn simplify_cfg"""  # noqa: E501
"""Passes for a function without loops, memory of its own, and calls to other printed functions:
those of the standard pipeline that change it, in half the time of the pipeline (measured)."""


def object_code(text: str) -> bytes:
    """An object file with the machine code of LLVM text for this processor."""
    code: bytes = native(LEVEL).emit_object(optimised(text))
    return code


def optimised(text: str) -> Any:
    """The module of LLVM text, optimised for this processor."""
    llvm = llvm_binding()
    module = llvm.parse_assembly(DECLARED + text)
    machine = native(LEVEL)
    _optimise(module, machine)
    return module


def _optimise(module: Any, machine: Any) -> None:
    """Optimise a module: with the standard pipeline if it has functions to inline, else each
    function by itself.
    """
    llvm = llvm_binding()
    options = llvm.create_pipeline_tuning_options(speed_level=LEVEL)
    options.slp_vectorization = False
    builder = llvm.create_pass_builder(machine, options)
    functions = [function for function in module.functions if not function.is_declaration]
    if any(function.linkage == llvm.Linkage.internal for function in functions):
        builder.getModulePassManager().run(module, builder)
        return
    passes = llvm.create_new_function_pass_manager()
    for name in STRAIGHT_PASSES.split():
        getattr(passes, f"add_{name}_pass")()
    for function in functions:
        passes.run(function, builder)


def engine_of(code: bytes) -> Any:
    """An engine with the code of an object file; it must stay alive as long as its addresses are
    used.
    """
    llvm = llvm_binding()
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), native(LEVEL))
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    return engine


@functools.cache
def _target() -> Any:
    llvm = llvm_binding()
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return llvm.Target.from_default_triple()


def native(level: int) -> Any:
    """A code generator for this processor, with so much optimisation (0 to 3); each engine owns
    its own.
    """
    made_for = processor()
    return _target().create_target_machine(cpu=made_for.name, features=made_for.features, opt=level)


_C_LIBRARY = frozenset({"sqrt", "ceil", "floor", "memset", "memcpy", "memmove"})
_STANDALONE = {"_nrt": False, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}


def build(kernel: Any, kinds: Sequence[str]) -> bytes:
    """Machine code of a numba kernel for arguments of these kinds; empty where the kernel cannot do
    without numba.
    """
    module = standalone(kernel, kinds)
    code: bytes = b"" if module is None else native(3).emit_object(module)
    return code


def standalone(kernel: Any, kinds: Sequence[str]) -> Any:
    """The module of a numba kernel for arguments of these kinds; None where the kernel cannot do
    without numba.

    That is where it allocates or raises, returns something else than a status, or calls what
    neither LLVM nor the C library provides; or with a version of numba that passes arrays in
    another way than `entry_point` knows.
    """
    numba = numba_module()
    llvm = llvm_binding()
    options = {name: value for name, value in kernel.targetoptions.items() if name != "nopython"}
    compiled = numba.njit(**options, **_STANDALONE)(kernel.py_func)
    signature = tuple(_numba_type(kind) for kind in kinds)
    try:
        with shallow_scope_copies():
            compiled.compile(signature)
    except numba.core.errors.NumbaError:
        return None
    text = compiled.inspect_llvm(signature)
    returned = {s.return_type for s in compiled.nopython_signatures}
    functions = [f for f in llvm.parse_assembly(text).functions if not f.is_declaration]
    expected = [
        "retptr",
        "excinfo",
        *numba_arguments(kernel.py_func.__code__.co_varnames[: len(kinds)], kinds),
    ]
    if [[a.name for a in f.arguments] for f in functions] != [expected] or text.count(
        "%excinfo"
    ) > 1:
        return None  # arrays are passed in another way, or it raises
    if not returned <= {numba.int64, numba.none}:
        return None
    module = llvm.parse_assembly(f"{text}\n{entry_point(functions[0].name, kinds)}")
    module.get_function(functions[0].name).linkage = "internal"
    passes = llvm.create_new_module_pass_manager()
    passes.add_global_dead_code_eliminate_pass()
    machine = native(3)
    passes.run(module, llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options()))
    declared = [v.name for v in (*module.functions, *module.global_variables) if v.is_declaration]
    if any(not name.startswith("llvm.") and name not in _C_LIBRARY for name in declared):
        return None
    return module


def _numba_type(kind: str) -> Any:
    numba = numba_module()
    item = {"q": numba.int64, "d": numba.float64, "f": numba.float32}[kind[0]]
    return numba.types.Array(item, int(kind[1:]), "C") if len(kind) > 1 else item


@contextlib.contextmanager
def shallow_scope_copies() -> Iterator[None]:
    """Within the context a copied scope of numba shares its variables, unless this numba has scopes
    of another form.
    """
    ir = numba_module().core.ir
    scope = ir.Scope
    if hasattr(scope, "__deepcopy__") or set(vars(scope(None, ir.unknown_loc))) != _FIELDS:
        yield
        return
    scope.__deepcopy__ = _shallow_copy
    try:
        yield
    finally:
        del scope.__deepcopy__


_FIELDS = {"parent", "localvars", "loc", "redefined", "var_redefinitions"}


def _shallow_copy(self: Any, memo: dict[int, Any]) -> Any:
    """A scope with dictionaries of its own and the same variables."""
    copied = type(self)(self.parent, self.loc)
    copied.localvars._con = dict(self.localvars._con)
    copied.redefined = self.redefined.copy()
    copied.var_redefinitions = defaultdict(
        set, {name: set(names) for name, names in self.var_redefinitions.items()}
    )
    memo[id(self)] = copied
    return copied


_NUMBERS = {"q": "i64", "d": "double"}
_ITEM_SIZES = {"q": 8, "d": 8, "f": 4}


@functools.cache
def slot_count(kind: str) -> int:
    """Slots of an argument of this kind: "q" whole number, "d" float, "d2" array of doubles, "f1"
    of singles.
    """
    return 1 + int(kind[1:] or 0)


def numba_arguments(names: Sequence[str], kinds: Sequence[str]) -> Iterator[str]:
    """The argument names of a function compiled by numba."""
    for name, kind in zip(names, kinds, strict=True):
        argument = f"arg.{name}"
        if kind in _NUMBERS:
            yield argument
            continue
        yield from (f"{argument}.{part}" for part in range(5))
        for part in (5, 6):  # shape and strides
            yield from (f"{argument}.{part}.{axis}" for axis in range(int(kind[1:])))


def entry_point(function: str, kinds: Sequence[str]) -> str:
    """LLVM text of the entry point, which returns the status that `function` returns."""
    lines = ["%status = alloca i64", "store i64 0, ptr %status"]
    passed = ["ptr %status", "ptr null"]
    slot = 0
    for i, kind in enumerate(kinds):
        x = f"%x{i}"
        if kind in _NUMBERS:
            lines += _load(x, _NUMBERS[kind], slot)
            passed.append(f"{_NUMBERS[kind]} {x}")
        else:
            dimensions = int(kind[1:])
            item = _ITEM_SIZES[kind[0]]
            lines += _load(f"{x}.data", "ptr", slot)
            for k in range(dimensions):
                lines += _load(f"{x}.shape{k}", "i64", slot + 1 + k)
            stride = str(item)
            for k in reversed(range(dimensions)):
                lines.append(f"{x}.stride{k} = add i64 {stride}, 0")
                lines.append(f"{x}.size{k} = mul i64 {stride}, {x}.shape{k}")
                stride = f"{x}.size{k}"
            lines.append(f"{x}.items = sdiv i64 {stride}, {item}")
            passed.append(f"ptr null, ptr null, i64 {x}.items, i64 {item}, ptr {x}.data")
            passed += [f"i64 {x}.shape{k}" for k in range(dimensions)]
            passed += [f"i64 {x}.stride{k}" for k in range(dimensions)]
        slot += slot_count(kind)
    lines += [
        f'call i32 @"{function}"({", ".join(passed)})',
        "%result = load i64, ptr %status",
        "ret i64 %result",
    ]
    return "\n".join(["define i64 @entry(ptr %slots) {", *lines, "}\n"])


def _load(name: str, kind: str, slot: int) -> list[str]:
    return [
        f"{name}.at = getelementptr i8, ptr %slots, i64 {8 * slot}",
        f"{name} = load {kind}, ptr {name}.at",
    ]
