"""The stored machine code of a kernel computes bit for bit what numba computes; code of other
sources, truncated code and code for another processor are never run; a kernel that needs the
library of numba is run by numba.
"""

from __future__ import annotations

import concurrent.futures
import copy
import ctypes
import dataclasses
import inspect
import math
import os
import pathlib
import re
import sys
import warnings

import numba
import numpy as np
import pytest
from filling import lifting_run
from numba.core import ir

from airmuscle.core import nodes
from airmuscle.engine import DormandPrince8, Rodas4, Schedule, simulate
from airmuscle.engine.compile import Function, compile_system
from airmuscle.engine.compile.cache import kernel as kernels
from airmuscle.engine.compile.cache import store as kept
from airmuscle.engine.compile.cache.kernel import BoundKernel, Kernel
from airmuscle.engine.compile.llvm.jit import build, object_code, shallow_scope_copies
from airmuscle.engine.compile.llvm.processor import TargetProcessor
from airmuscle.errors import AirmuscleWarning

CASE = lifting_run(1)
READY = compile_system(CASE.system)
SOURCE = pathlib.Path(kernels.__file__).parents[3]
kept_found = kept.load
ROWS = 7


def arguments(rows=ROWS):
    """What `evaluate` is given for some rows; the last array is room for its results."""
    seeds = np.random.default_rng(1)
    states = CASE.vector * seeds.uniform(0.9, 1.1, (rows, CASE.vector.size))
    inputs = seeds.uniform(0.0, 1.0, (rows, len(CASE.system.inputs)))
    return {
        "function": READY.address["outputs"],
        "c": READY.precomputed,
        "states": states,
        "inputs": inputs,
        "results": np.zeros((rows, READY.sizes.outputs)),
    }


def expected():
    given = arguments()
    Kernel("evaluate").numba(**given)
    return given["results"]


@pytest.fixture
def empty(tmp_path, monkeypatch):
    """An empty folder for machine code."""
    monkeypatch.setenv("AIRMUSCLE_CACHE_DIR", str(tmp_path))
    return tmp_path


@pytest.fixture
def without_numba(monkeypatch):
    """A kernel without machine code fails."""
    bind = BoundKernel.__init__

    def check(self, kernel, arguments):
        bind(self, kernel, arguments)
        assert self._numba is None, f"{kernel.name} is run by numba"

    monkeypatch.setattr(BoundKernel, "__init__", check)


def files(folder):
    return sorted(path for path in folder.rglob("*") if path.is_file())


@pytest.mark.parametrize(
    "method",
    [
        pytest.param(Rodas4(1e-6), id="rodas4", marks=pytest.mark.slow),
        pytest.param(DormandPrince8(1e-3), id="fixed_step"),
    ],
)
def test_a_run_is_bit_for_bit_that_of_numba(method, monkeypatch):
    ramps = Schedule({"fill": ((0.5, 1.0), (1.5, 0.0)), "discharge": ((2.0, 0.7),)})

    def run():
        system = dataclasses.replace(CASE.system)  # nothing that was bound before is kept with it
        return simulate(
            system, ramps, duration=3.0, initial_state=CASE.initial_state, integrator=method
        )

    by_code = run()
    monkeypatch.setattr(Kernel, "entry", lambda self, kinds: None)
    by_numba = run()
    assert by_code.notes == by_numba.notes
    assert all(np.array_equal(by_code[name], by_numba[name]) for name in by_numba.columns)


def all_kernels():
    """Every kernel that a file of the program names."""
    made = re.compile(r'Kernel\("(\w+)"(?:, "(\w+)")?\)')
    texts = (path.read_text(encoding="utf-8") for path in SOURCE.rglob("*.py"))
    return [Kernel(name, module) for text in texts for name, module in made.findall(text)]


def test_callers_name_the_arguments_that_the_function_of_a_kernel_declares():
    found = all_kernels()
    assert len(found) >= 19
    for kernel in found:
        declared = inspect.signature(kernel.numba.py_func).parameters
        assert list(kernel.places) == list(declared), kernel.name


def test_an_argument_that_a_kernel_lacks_or_does_not_know_is_an_error():
    given = arguments()
    given["result"] = given.pop("results")
    with pytest.raises(TypeError, match=r"missing \['results'\], unknown \['result'\]"):
        Kernel("evaluate").bind(**given)


def test_made_once_it_is_found_again(empty, without_numba, capsys):
    for words in ("compiling evaluate, once on this machine (some seconds) ...\n", ""):
        given = arguments()
        Kernel("evaluate")(**given)
        assert np.array_equal(given["results"], expected())
        assert capsys.readouterr().err == words
        assert len(files(empty)) == 1


@pytest.mark.parametrize(
    "other",
    [
        lambda a: np.repeat(a, 2, axis=1)[:, ::2],
        np.asfortranarray,
        lambda a: np.frombuffer(a.tobytes()).reshape(a.shape),
    ],
    ids=["every second", "by columns", "read-only"],
)
def test_an_array_that_is_not_contiguous_and_writeable_is_an_error(other):
    given = arguments()
    given["states"] = other(given["states"])
    with pytest.raises((TypeError, ValueError, BufferError)):
        Kernel("evaluate")(**given)


def test_an_input_may_be_read_only_but_must_be_contiguous_and_of_its_kind(without_numba):
    bound = Kernel("evaluate").bind(**arguments())
    second = arguments()
    for name in ("c", "states", "inputs"):
        given = second[name].copy()
        given.setflags(write=False)
        bound.replace_input(name, given)
    bound.replace("results", second["results"])
    bound()
    assert np.array_equal(second["results"], expected())
    for wrong in (
        np.asfortranarray(second["states"]),
        second["states"].astype(np.float32),
        second["c"].copy(),
    ):
        wrong.setflags(write=False)
        with pytest.raises(TypeError, match="argument states"):
            bound.replace_input("states", wrong)


def test_replaced_arguments_are_those_that_count(without_numba):
    bound = Kernel("evaluate").bind(**arguments())
    second = arguments()
    bound()
    for name in ("c", "states", "inputs", "results"):
        bound.replace(name, second[name])
    bound()
    assert np.array_equal(second["results"], expected())


def test_a_view_of_a_live_array_is_pointed_at(without_numba):
    given = arguments()
    bound = Kernel("evaluate").bind(**given)
    addresses = {
        name: given[name].ctypes.data + 2 * 8 * given[name].shape[1]
        for name in ("states", "inputs")
    }
    bound.point(addresses, 3)
    bound()
    assert np.array_equal(given["results"][:3], expected()[2:5])
    assert not given["results"][3:].any()


def test_a_view_of_a_live_array_is_pointed_at_by_numba_too(monkeypatch):
    monkeypatch.setattr(Kernel, "entry", lambda self, kinds: None)
    given = arguments()
    bound = Kernel("evaluate").bind(**given)
    addresses = {
        name: given[name].ctypes.data + 2 * 8 * given[name].shape[1]
        for name in ("states", "inputs", "results")
    }
    bound.point(addresses, 3)
    bound()
    assert np.array_equal(given["results"][2:5], expected()[2:5])
    assert not given["results"][:2].any()
    assert not given["results"][5:].any()


def test_no_row_is_no_work(without_numba):
    assert Kernel("evaluate")(**arguments(0)) == 0


@pytest.mark.parametrize(
    "spoil",
    [
        lambda content: content[:-1],
        lambda content: content[:40],
        lambda content: b"",
        lambda content: content[:100] + bytes([content[100] ^ 1]) + content[101:],
        lambda content: bytes([content[0] ^ 1]) + content[1:],
    ],
    ids=["cut short", "without code", "empty", "one bit", "of other sources"],
)
def test_a_spoilt_file_is_made_anew(spoil, empty, without_numba, capsys):
    Kernel("evaluate")(**arguments())
    (file,) = files(empty)
    file.write_bytes(spoil(file.read_bytes()))
    capsys.readouterr()
    given = arguments()
    Kernel("evaluate")(**given)
    assert "compiling evaluate" in capsys.readouterr().err
    assert np.array_equal(given["results"], expected())
    Kernel("evaluate")(**arguments())
    assert capsys.readouterr().err == ""


def test_other_sources_and_versions_have_another_origin(monkeypatch, tmp_path):
    origin = kept._origin.__wrapped__()
    assert kept._origin.__wrapped__() == origin
    (tmp_path / "kernel.py").write_text("x = 1\n", encoding="utf-8")
    monkeypatch.setattr(kept, "_SOURCES", (tmp_path / "kernel.py",))
    elsewhere = kept._origin.__wrapped__()
    (tmp_path / "kernel.py").write_text("x = 2\n", encoding="utf-8")
    changed = kept._origin.__wrapped__()
    monkeypatch.setattr(kept.importlib.util, "find_spec", lambda name: None)
    assert len({origin, elsewhere, changed, kept._origin.__wrapped__()}) == 4


def test_each_processor_and_each_kind_has_its_own_file(monkeypatch):
    mine = kept._file_name("evaluate", ("q", "d1"))
    assert kept._file_name("evaluate", ("q", "d2")) != mine
    monkeypatch.setattr(kept, "processor", lambda: TargetProcessor("another", "", 16))
    assert kept._file_name("evaluate", ("q", "d1")) != mine


@pytest.mark.parametrize("place", ["a file", "writeable by others"])
def test_a_folder_that_is_not_private_is_not_used_and_one_warning_says_so(
    place, tmp_path, monkeypatch
):
    folder = tmp_path / "kernels"
    if place == "a file":
        folder.write_text("not a folder", encoding="utf-8")
    else:
        folder.mkdir()
        folder.chmod(0o777)
    monkeypatch.setenv("AIRMUSCLE_CACHE_DIR", str(folder))
    kept.warn_not_stored.cache_clear()
    with pytest.warns(
        AirmuscleWarning, match="compiled kernels are not stored: .*AIRMUSCLE_CACHE_DIR"
    ) as caught:
        stored = kept.save("evaluate", ("q",), b"code")
    assert stored == b"code"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert kept.load("evaluate", ("q",)) is None
    assert len(caught) == 1
    given = arguments()
    Kernel("evaluate")(**given)
    assert np.array_equal(given["results"], expected())
    kept.warn_not_stored.cache_clear()


def test_a_link_in_place_of_a_kernel_is_not_followed(empty):
    kept.save("evaluate", ("q",), b"code")
    assert kept.load("evaluate", ("q",)) == b"code"
    (file,) = files(empty)
    other = file.rename(empty / "other")
    file.symlink_to(other)
    assert kept.load("evaluate", ("q",)) is None


@numba.njit(error_model="numpy")
def plain(x, y):
    for i in range(x.shape[0]):
        y[i] = math.sqrt(x[i])
    return x.shape[0]


@numba.njit(error_model="numpy")
def allocates(x, y):
    y[:] = np.sort(x)
    return x.shape[0]


@numba.njit(error_model="numpy")
def raises(x, y):
    if x[0] > y[0]:
        raise ValueError
    return x.shape[0]


@numba.njit(error_model="numpy")
def calls_a_library(x, y):
    y[0] = math.lgamma(x[0])
    return x.shape[0]


@numba.njit(error_model="numpy")
def returns_a_float(x, y):
    return x[0] + y[0]


def test_a_copied_scope_has_its_own_names_and_numba_is_as_before_afterwards():
    scope = ir.Scope(None, ir.unknown_loc)
    variable = scope.define("x", ir.unknown_loc)
    scope.redefine("x", ir.unknown_loc)
    with shallow_scope_copies():
        copied = copy.deepcopy(scope)
    assert copied.get_exact("x") is variable
    copied.redefine("x", ir.unknown_loc)
    copied.define("y", ir.unknown_loc)
    assert (scope.get_versions_of("x"), copied.get_versions_of("x")) == ({"x.1"}, {"x.1", "x.2"})
    assert "y" not in scope.localvars
    assert copy.deepcopy(scope).get_exact("x") is not variable


def test_only_what_does_without_numba_is_made_machine_code():
    assert build(plain, ("d1", "d1"))
    for kernel in (allocates, raises, calls_a_library, returns_a_float):
        assert build(kernel, ("d1", "d1")) == b""


@pytest.mark.slow
def test_a_kernel_that_needs_numba_is_tried_once_on_a_machine(empty, monkeypatch):
    looked = []
    monkeypatch.setattr(Kernel, "numba", property(lambda self: allocates))
    monkeypatch.setattr(
        kernels.store, "load", lambda *asked: looked.append(asked) or kept_found(*asked)
    )
    for kernel in (Kernel("allocates"), Kernel("allocates")):
        for _ in range(2):
            x = np.array([3.0, 1.0, 2.0])
            y = np.zeros(3)
            assert kernel(x, y) == 3
            assert y.tolist() == [1.0, 2.0, 3.0]
    assert len(looked) == 2
    assert [file.stat().st_size for file in files(empty)] == [
        64
    ]  # no code: the next process need not try


def test_threads_that_ask_at_once_get_one_machine_code(empty, without_numba, monkeypatch):
    kernel, right, looked = Kernel("evaluate"), expected(), []
    monkeypatch.setattr(
        kernels.store, "load", lambda *asked: looked.append(asked) or kept_found(*asked)
    )

    def found(_):
        given = arguments()
        kernel(**given)
        return given["results"]

    with concurrent.futures.ThreadPoolExecutor(8) as pool:
        assert all(np.array_equal(results, right) for results in pool.map(found, range(64)))
    assert len(looked) == 1


# Printed modules


def squares() -> float:
    """3^2 + 1 by a module that is compiled for this call."""
    x = nodes.symbol("x")
    function = Function({"x": [x]}, {"y": [x * x + 1.0]})
    given, result = np.array([3.0]), np.empty(1)
    ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(function.address)(
        given.ctypes.data, result.ctypes.data
    )
    return float(result[0])


def test_the_machine_code_of_a_module_is_generated_once(empty, monkeypatch):
    texts = []
    monkeypatch.setattr(kept, "object_code", lambda text: texts.append(text) or object_code(text))
    assert [squares(), squares()] == [10.0, 10.0]
    assert len(texts) == len(files(empty)) == 1
    (file,) = files(empty)
    file.write_bytes(file.read_bytes()[:-1] + b"?")
    assert squares() == 10.0
    assert len(texts) == 2, "damaged code is generated anew"


def test_codes_that_were_not_used_for_the_longest_time_are_removed(empty, monkeypatch):
    monkeypatch.setattr(kept, "MAX_FILES", 2)
    for age, name in enumerate(("a", "b")):
        kept.save(name, (), b"code")
        path = empty / kept._file_name(name, ())
        os.utime(path, (1e9 + age, 1e9 + age))
    assert kept.load("a", ()) == b"code"  # now b is the one that was not used for the longest time
    kept.save("c", (), b"code")
    assert [kept.load(name, ()) for name in "abc"] == [b"code", None, b"code"]


def test_the_code_of_another_kernel_is_compiled_anew(empty):
    """The checksum contains the name of the file, so that files that exchanged their names are not
    run.
    """
    for name in ("one", "other"):
        kept.save(name, ("d",), f"code of {name}".encode())
    one, other = files(empty)
    assert kept.load("one", ("d",)) == b"code of one"
    one.write_bytes(other.read_bytes())
    assert kept.load("one", ("d",)) is None
    assert kept.load("other", ("d",)) == b"code of other"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="Windows has no such pipes")
def test_a_pipe_under_the_name_of_a_code_is_not_waited_for(empty):
    kept.save("evaluate", ("d",), b"code")
    (path,) = files(empty)
    path.unlink()
    os.mkfifo(path)
    assert kept.load("evaluate", ("d",)) is None


@pytest.mark.skipif(sys.platform != "linux", reason="the specification is that of Linux")
def test_a_relative_cache_folder_of_the_user_is_ignored(tmp_path, monkeypatch):
    monkeypatch.delenv("AIRMUSCLE_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    assert kept.cache_folder() == tmp_path / ".cache" / "airmuscle" / "kernels"
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "own"))
    assert kept.cache_folder() == tmp_path / "own" / "airmuscle" / "kernels"
