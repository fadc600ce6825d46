"""A task whose results the tests of the store of results keep."""

import numpy as np

CALLS = []


def column(scale: float, count: int) -> dict:
    """A column of numbers, and a text."""
    CALLS.append(count)
    return {"values": scale * np.arange(float(count)) / 7.0, "text": f"{count} rows"}
