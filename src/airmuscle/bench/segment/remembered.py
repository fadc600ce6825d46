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
    def remembering(*arguments: Any, **options: Any) -> Any:
        if options or len(arguments) != 1:
            return analyse(*arguments, **options)
        (recordings,) = arguments
        several = (recordings,) if isinstance(recordings, Recording) else tuple(recordings)
        if not several:
            return analyse(recordings)
        known, key = results.setdefault(several[0], {}), tuple(map(id, several))
        stored = known.get(key)
        if stored is None or any(ref() is not each for ref, each in zip(stored[0], several, strict=True)):
            stored = known[key] = tuple(map(weakref.ref, several)), analyse(recordings)
        return stored[1]

    return remembering  # type: ignore[return-value]
