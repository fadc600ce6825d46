"""Start of the command line, before anything else is imported."""

from __future__ import annotations

import os

import pytest

from airmuscle import __main__ as entry_point
from airmuscle.core import arrays


@pytest.mark.parametrize(("given", "threads"), [(None, "1"), ("4", "4")])
def test_linear_algebra_uses_one_thread_unless_the_user_says_otherwise(
    given: str | None, threads: str, monkeypatch: pytest.MonkeyPatch
):
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        monkeypatch.setenv(name, given or "")
        if given is None:
            monkeypatch.delenv(name)
    seen: list[str] = []

    def interrupted(*_: object) -> None:
        seen.append(os.environ["OPENBLAS_NUM_THREADS"])
        raise KeyboardInterrupt

    monkeypatch.setattr(entry_point.importlib, "import_module", interrupted)
    with pytest.raises(SystemExit, match="130"):
        entry_point.main()
    assert seen == [threads]


def test_the_command_and_its_workers_limit_the_same_libraries():
    """The names stand twice, because the command line sets them before it imports anything that
    loads NumPy.
    """
    assert entry_point._BLAS_THREADS == arrays.BLAS_THREADS
