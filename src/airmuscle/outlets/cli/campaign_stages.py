"""Finished stages of an interrupted campaign, which are not fitted again; in the private cache folder of the user.

A stage is found by a fingerprint of the recordings, the geometry and the program; other data or another version of the
program are fitted anew. The files are removed at the end of the campaign.
"""

from __future__ import annotations

import contextlib
import hashlib
import pickle
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ...core.atomic_output import atomic_file
from ...core.fingerprint import fingerprint, program_fingerprint
from ...engine.compile.cache.store import cache_folder, read_private
from ...physics.muscle.geometry import Geometry
from ...recording import Recording

OMITTED_ROOMS = ("outlets", "papers", "report", "design", "files", "control")
"""Rooms of the program that do not affect the stages of a campaign."""
MAX_AGE = 30 * 86400.0
"""Age from which the stages of a campaign that was never continued are removed [s] (chosen)."""
_HASH = hashlib.sha256().digest_size


class KeptStages:
    """The stages of one campaign in the cache folder; without a private folder none is kept."""

    def __init__(self, recordings: Sequence[Recording], geometry: Geometry | None) -> None:
        data = [[each.origin, dict(each.columns), dict(each.constants)] for each in recordings]
        self._key = fingerprint(data, geometry, program_fingerprint(OMITTED_ROOMS))[:32]
        self._folder = cache_folder()
        _remove_old(self._folder)

    def load(self, names: Sequence[str]) -> dict[str, Any]:
        """The results of the stages that an interrupted run has finished, by name."""
        known = {}
        for name in names:
            content = None if self._folder is None else read_private(self._path(name))
            if content is None or hashlib.sha256(content[_HASH:]).digest() != content[:_HASH]:
                continue
            with contextlib.suppress(Exception):  # written with other versions of the packages
                known[name] = pickle.loads(content[_HASH:])
        return known

    def save(self, name: str, result: object) -> None:
        """Keep the result of a finished stage; a result that cannot be stored is fitted again."""
        if self._folder is None:
            return
        with contextlib.suppress(Exception):  # CasADi raises none of the usual errors
            content = pickle.dumps(result, protocol=pickle.HIGHEST_PROTOCOL)
            with atomic_file(self._path(name)) as unfinished:
                unfinished.write_bytes(hashlib.sha256(content).digest() + content)

    def remove(self, names: Sequence[str]) -> None:
        """Remove the stages of a campaign that is complete."""
        for name in names if self._folder is not None else ():
            with contextlib.suppress(OSError):
                self._path(name).unlink(missing_ok=True)

    def _path(self, name: str) -> Path:
        assert self._folder is not None
        return self._folder / f"campaign-{self._key}-{name.replace(' ', '-')}.stage"


def _remove_old(folder: Path | None) -> None:
    for path in folder.glob("campaign-*") if folder is not None else ():
        with contextlib.suppress(OSError):
            if time.time() - path.stat().st_mtime > MAX_AGE:
                path.unlink()
