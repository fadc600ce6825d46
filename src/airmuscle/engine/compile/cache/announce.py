"""Announcement on stderr that a kernel is about to be compiled."""

from __future__ import annotations

import sys


def announce(name: str) -> None:
    """Print to stderr that a kernel is being compiled, which takes some seconds."""
    print(f"compiling {name}, once on this machine (some seconds) ...", file=sys.stderr, flush=True)
