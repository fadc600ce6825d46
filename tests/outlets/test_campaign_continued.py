"""An interrupted campaign continues after its last finished stage, also after the process was
killed.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle
from made_campaign import write_campaign

from airmuscle.bench import LeftOutStage
from airmuscle.outlets.cli import KeptStages
from airmuscle.recording import Recording

STAGE = LeftOutStage("creep", "no record is a hold", "hold the length")


def recording(force: float = 10.0) -> Recording:
    return Recording(
        {"pressure": np.full(5, 1e5), "force": np.full(5, force)}, "run", {"resting_length": 0.3}
    )


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "cache"
    monkeypatch.setenv("AIRMUSCLE_CACHE_DIR", str(folder))
    return folder


@pytest.mark.usefixtures("cache")
def test_a_kept_stage_comes_back_for_the_same_recordings_alone():
    KeptStages([recording()], None).save("creep", STAGE)
    assert KeptStages([recording()], None).load(["creep", "hysteresis"]) == {"creep": STAGE}
    assert KeptStages([recording(10.1)], None).load(["creep"]) == {}
    kept = KeptStages([recording()], None)
    kept.remove(["creep", "hysteresis"])
    assert kept.load(["creep"]) == {}


def test_a_damaged_or_foreign_stage_is_fitted_again(cache):
    kept = KeptStages([recording()], None)
    kept.save("creep", STAGE)
    (path,) = cache.glob("campaign-*.stage")
    content = path.read_bytes()
    path.write_bytes(content[:-1] + b"x")
    assert kept.load(["creep"]) == {}
    path.write_bytes(content)
    path.chmod(0o666)
    if os.name == "posix":
        assert kept.load(["creep"]) == {}, "another user may have written it"


@pytest.mark.usefixtures("cache")
def test_a_result_that_cannot_be_stored_is_not_kept():
    kept = KeptStages([recording()], None)
    kept.save("creep", lambda: None)
    assert kept.load(["creep"]) == {}


@pytest.mark.slow
@pytest.mark.usefixtures("cache")
def test_a_killed_campaign_does_not_fit_its_finished_stages_again(tmp_path, monkeypatch):
    rig = write_campaign(tmp_path / "rig")
    out = tmp_path / "out"
    for pattern in ("*isobar_[236]*", "*isometrisch*", "*fuellen*", "*freigabe*"):
        for path in rig.glob(pattern):
            path.unlink()
    process = subprocess.Popen(
        [sys.executable, "-m", "airmuscle", "campaign", str(rig), "--out", str(out)]
    )
    until = time.monotonic() + 1200.0
    while time.monotonic() < until and process.poll() is None:
        stages = out / "stages.json"
        if stages.exists() and len(json.loads(stages.read_text(encoding="utf-8"))) >= 3:
            break
        time.sleep(0.2)
    assert process.poll() is None, "the campaign ended before it could be killed"
    process.send_signal(signal.SIGKILL)
    process.wait()

    def fitted_again(*_):
        raise AssertionError("a finished stage is fitted again")

    monkeypatch.setattr(
        "airmuscle.bench.identify.campaign.campaign.fit_friction_stage", fitted_again
    )
    monkeypatch.setattr("airmuscle.bench.identify.campaign.campaign.fit_creep_stage", fitted_again)
    done = airmuscle("campaign", rig, "--out", out)
    assert done.exit_code == 0, done.stderr
    assert "continued after: creep, hysteresis" in done.stderr
    assert (out / "muscle.toml").exists()
    assert not list((tmp_path / "cache").glob("campaign-*")), (
        "the stages of a complete campaign are removed"
    )
