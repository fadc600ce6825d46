"""Settings of all tests: Ctrl-C interrupts, random examples are few, figures of one kind are drawn
once.

Ctrl-C interrupts here too, where a shell that runs the tests in the background has it ignored.
`--hypothesis-profile thorough` draws 300 examples in place of 10. A figure with the kinds of curves
and areas alone that were drawn before gets the files of one of those, except in tests with the
marker `drawn`, which look at the files; its image has a low resolution. A command that is called
within a test uses one process, because the tests themselves run on all cores; tests of several
processes state their number, and linear algebra uses one thread. A kernel that is missing in the
cache is compiled by one worker, while others wait for it. Objects that exist after the collection
of tests are no longer searched by the garbage collector. The configuration file of the user is not
read. Where Python must not write bytecode beside the sources, that of the tests, whose assertions
pytest rewrites, and of the processes that they start is stored in the cache folder of pytest.
"""

from __future__ import annotations

import contextlib
import gc
import os
import signal
import sys
import sysconfig
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from unittest import mock

os.environ["OPENBLAS_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = (
    "1"  # read by the first import of NumPy
)

import pytest
from hypothesis import settings

from airmuscle.core import plotting
from airmuscle.engine import processes
from airmuscle.engine.compile.cache import kernel
from airmuscle.engine.compile.cache.store import load, save
from airmuscle.engine.compile.llvm import jit

try:
    import fcntl
except ImportError:  # Windows: each worker compiles its own
    fcntl = None  # type: ignore[assignment]

CACHE = Path(__file__).parents[1] / ".pytest_cache"
LOCKS = CACHE / "compiling"
signal.signal(signal.SIGINT, signal.default_int_handler)
os.environ["AIRMUSCLE_CONFIG_DIR"] = os.devnull


def link_installed_bytecode(folder: Path) -> None:
    """The bytecode of Python and of the packages, which is stored beside them, in a folder for that
    of all.
    """
    for path in {sysconfig.get_path(name) for name in ("stdlib", "purelib", "platlib")}:
        for compiled in Path(path).rglob(f"__pycache__/*.{sys.implementation.cache_tag}.pyc"):
            link = folder.joinpath(*compiled.parts[1:-2], compiled.name)
            link.parent.mkdir(parents=True, exist_ok=True)
            with contextlib.suppress(OSError):  # there already, or a system without links
                link.symlink_to(compiled)


if sys.dont_write_bytecode and sys.pycache_prefix is None:
    sys.dont_write_bytecode = False
    sys.pycache_prefix = str(CACHE / "bytecode")
    if not os.path.isdir(sys.pycache_prefix):
        link_installed_bytecode(Path(sys.pycache_prefix))
    os.environ["PYTHONPYCACHEPREFIX"] = sys.pycache_prefix
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
settings.register_profile("few", settings(), max_examples=10, deadline=None)
settings.register_profile("thorough", settings(), max_examples=300, deadline=None)
settings.load_profile("few")
processes.available_cores = lambda: 1


class OneOfAKind:
    """`plotting.rendered`, which draws a figure if it has something of a kind that was not drawn
    before.
    """

    def __init__(self) -> None:
        self.draw = plotting.rendered
        self.draws_all = False
        self.drawn: dict[str, set[Any]] = {}
        self.files: dict[str, dict[str, bytes]] = {}

    def __call__(self, figure: Any, *options: Any, **named: Any) -> dict[str, bytes]:
        if self.draws_all:
            return self.draw(figure, *options, **named)
        way = repr((options, sorted(named.items())))
        drawn = self.drawn.setdefault(way, set())
        if way not in self.files or not kinds_of(figure) <= drawn:
            with mock.patch.dict(plotting._STYLE, {"savefig.dpi": 40}):
                self.files[way] = self.draw(figure, *options, **named)
            drawn |= kinds_of(figure)
        return self.files[way]


def kinds_of(figure: Any) -> set[Any]:
    """Its curves, areas and texts, each with the scales of its axes, and the titles and labels with
    a formula.
    """
    return {
        (kind, axes.get_xscale(), axes.get_yscale())
        for axes in figure.axes
        for kind in (
            *(type(child).__name__ for child in axes.get_children()),
            *(
                text
                for text in (axes.get_title(), axes.get_xlabel(), axes.get_ylabel())
                if "$" in text
            ),
        )
    }


ONE_OF_A_KIND = OneOfAKind()
plotting.rendered = ONE_OF_A_KIND


def built_once(numba_kernel: Any, kinds: Sequence[str]) -> bytes:
    """`jit.build`, which one worker at a time enters for a kernel; the others then find what it has
    stored.
    """
    name = numba_kernel.py_func.__name__
    LOCKS.mkdir(parents=True, exist_ok=True)
    with open(LOCKS / name, "w") as file:  # closing it releases the lock
        fcntl.flock(file, fcntl.LOCK_EX)
        stored = load(name, kinds)
        return save(name, kinds, jit.build(numba_kernel, kinds)) if stored is None else stored


if fcntl and "PYTEST_XDIST_WORKER" in os.environ:
    kernel.build = built_once


def pytest_collection_finish() -> None:
    """Modules, tests and fixtures remain until the end; fewer searches among the young suffice for
    what tests leave.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(10_000, 10, 10)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    ONE_OF_A_KIND.draws_all = item.get_closest_marker("drawn") is not None
