"""An interrupted campaign continues after its last finished stage, also after the process was
killed.
"""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time

import pytest
from command_line import airmuscle
from made_campaign import write_campaign


@pytest.mark.slow
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

    monkeypatch.setattr("airmuscle.bench.campaign.campaign.fit_friction_stage", fitted_again)
    monkeypatch.setattr("airmuscle.bench.campaign.campaign.fit_creep_stage", fitted_again)
    done = airmuscle("campaign", rig, "--out", out)
    assert done.exit_code == 0, done.stderr
    assert f"resuming from the results in {out / 'tasks'}" in done.stderr
    assert (out / "muscle.toml").exists()
    assert not (out / "tasks").exists(), "the results of a complete campaign are removed"
