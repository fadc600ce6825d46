"""`airmuscle benchmark`: table and report of a benchmark, and one line for what is impossible."""

from __future__ import annotations

import json

import pytest
from command_line import airmuscle

FAST = [
    "benchmark",
    "--controller",
    "PID",
    "--task",
    "step",
    "--budget",
    "0",
    "--truths",
    "1",
    "--runs",
    "2",
]


def run(*arguments):
    return airmuscle(*arguments)


def test_a_benchmark_writes_its_report_tables_and_figures(tmp_path):
    result = run(*FAST, "--out", str(tmp_path / "benchmark"))
    assert result.exit_code == 0, result.output
    assert "PID" in result.stdout
    names = {
        path.relative_to(tmp_path / "benchmark").as_posix()
        for path in (tmp_path / "benchmark").rglob("*.*")
    }
    kinds = (
        "ranking_models",
        "ranking_commissioned",
        "rmse_models",
        "rmse_commissioned",
        "metrics",
        "gains",
        "truths",
    )
    tables = {f"data/{name}.csv" for name in kinds}
    assert {
        "report.html",
        "figures/errors_models.png",
        "figures/errors_commissioned.png",
        "figures/runs.png",
        *tables,
    } <= names
    assert "data/searches.csv" not in names, "nothing was tuned"
    page = (tmp_path / "benchmark" / "report.html").read_text(encoding="utf-8")
    for text in ("LuGre", "12-bit encoder", "1e-08 m3/(s Pa)", "weight x 2"):
        assert text in page, text


def test_json_contains_every_metric_of_every_run(tmp_path):
    result = run(*FAST, "--json", "--out", str(tmp_path / "benchmark"))
    content = json.loads(result.stdout)["benchmark"]
    (ranked,) = content["ranking_models"]
    assert [ranked[name] for name in ("controller", "score", "lowest", "highest")] == [
        "PID",
        1.0,
        1.0,
        1.0,
    ]
    assert [row["group"] for row in content["metrics"]] == ["models only", "commissioned"]
    row = content["metrics"][0]
    assert (row["controller"], row["truth"], row["task"]) == ("PID", "truth 35", "step")
    assert 0 < row["rms_error"] < row["maximum_error"] < 0.5
    assert content["units"]["metrics.rms_error"] == "rad"
    assert row["settling_time"] is None or row["settling_time"] >= 0
    found = {
        each["gain"].rpartition(".")[2]
        for each in content["gains"]
        if each["found_on"] == "truth 35"
    }
    assert found == {"gain", "integral_time", "derivative_time"}
    assert all(each["found_on"] != "models" for each in content["gains"]), "nothing was tuned"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--controller", "PDI"], "there is no controller 'PDI'; there are PID, feed-forward"),
        (["--task", "steps"], "there is no task 'steps'"),
        (
            ["--controller", "PID", "--trials", "3"],
            "--trials needs at least 2 trials and the controller",
        ),
        (["--trials", "1"], "--trials needs at least 2 trials"),
        (["--controller", "PID", "--task", "step", "--budget", "1"], "budget is 56"),
    ],
)
def test_an_impossible_benchmark_is_rejected_in_one_line(arguments, message, tmp_path):
    result = run("benchmark", *arguments, "--out", str(tmp_path / "benchmark"))
    assert result.exit_code == 1
    assert message in result.stderr
    assert result.stderr.count("\n") == 1
    assert not (tmp_path / "benchmark").exists()
