"""Channels with their own times on common rows: linear between samples, integers held until their
next sample.
"""

from __future__ import annotations

import numpy as np
import pytest

from airmuscle.bench.readers import Channel, merge_channels
from airmuscle.errors import ColumnError

OFFSETS = pytest.mark.parametrize(
    "offset", [0.0, -3.0, 1.7e9], ids=["from 0", "before 0", "from 1970"]
)


@OFFSETS
def test_a_valve_switches_at_its_own_instants_whatever_the_origin_of_time(offset):
    fine = offset + np.arange(400) * 0.01
    coarse = offset + np.arange(8) * 0.5
    table = merge_channels(
        "made",
        [Channel("pressure", np.sin(fine - offset), fine), Channel("valve", np.arange(8), coarse)],
        {},
    )
    columns = dict(zip(table.headings, table.columns, strict=True))
    rows = np.arange(400)
    assert np.array_equal(columns["valve"], np.minimum(rows // 50, 7))
    assert columns["time"] == pytest.approx(0.01 * rows, abs=1e-6)


@OFFSETS
def test_rows_that_a_channel_does_not_cover_are_left_out(offset):
    fine = offset + np.arange(200) * 0.01
    coarse = offset + 0.5 + np.arange(11) * 0.1
    channels = [
        Channel("pressure", np.ones(200), fine),
        Channel("force", 3.0 * (coarse - offset), coarse),
    ]
    columns = dict(
        zip(
            ("time", "pressure", "force"), merge_channels("made", channels, {}).columns, strict=True
        )
    )
    assert len(columns["time"]) == 101
    assert columns["force"] == pytest.approx(3.0 * np.linspace(0.5, 1.5, 101), abs=1e-5)


def test_a_channel_whose_time_decreases_is_not_interpolated():
    fine = 0.05 * np.arange(20)
    twice = np.tile(0.2 * np.arange(5), 2)
    channels = [
        Channel("pressure", np.ones(20), fine),
        Channel("force", np.repeat([0.0, 1.0], 5), twice),
    ]
    with pytest.raises(
        ColumnError, match="made: the time of channel 'force' decreases at its row 6"
    ):
        merge_channels("made", channels, {})
