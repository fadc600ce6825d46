"""Results that are remembered with their recordings: one analysis serves all checks of a fit, and further fits."""

from __future__ import annotations

import functools
import weakref
from collections.abc import Callable
from typing import Any, TypeVar

from ...recording.recording import Recording

Analysis = TypeVar("Analysis", bound=Callable[..., Any])
_Known = dict[tuple[int, ...], tuple[tuple[weakref.ref[Recording], ...], Any]]


def remembered(analyse: Analysis) -> Analysis:
    """The function of a recording, or of several, whose result is remembered as long as the first of them.

    Calls with further arguments are not remembered.
    """
    results: weakref.WeakKeyDictionary[Recording, _Known] = weakref.WeakKeyDictionary()

    @functools.wraps(analyse)
    def remembering(recordings: Any, *arguments: Any, **options: Any) -> Any:
        several = (recordings,) if isinstance(recordings, Recording) else tuple(recordings)
        if arguments or options or not several:
            return analyse(recordings, *arguments, **options)
        known, key = results.setdefault(several[0], {}), tuple(map(id, several))
        stored = known.get(key)
        if stored is None or any(ref() is not each for ref, each in zip(stored[0], several, strict=True)):
            stored = known[key] = tuple(map(weakref.ref, several)), analyse(recordings)
        return stored[1]

    return remembering  # type: ignore[return-value]
