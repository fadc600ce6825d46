"""Tasks for the worker processes of the studio in tests."""

from __future__ import annotations

import time
from pathlib import Path

from airmuscle.core import atomic_folder
from airmuscle.errors import InputError
from airmuscle.outlets.studio import RequestError


class WorkerHere:
    """A worker that runs its task in the thread of the queue."""

    def call(self, task, arguments, limit, report=None):
        return task(*arguments, report)

    def kill(self):
        pass

    def stop(self):
        pass


def write_slowly(folder, out, seconds, report):
    """Write a file in a folder that appears when it is complete."""
    with atomic_folder(out) as staging:
        (staging / "result.json").write_text("{}", encoding="utf-8")
        report(0.5, "half of it")
        time.sleep(seconds)
    Path(out, "complete").touch()


def fail(folder, out, field, report):
    """An error of a field, or of none."""
    raise RequestError("this is wrong.", field) if field else InputError("this is wrong.")
