"""`airmuscle inspect` prints the inspection of recordings and changes nothing.

The output equals that of the library: columns with their original units, sampling, runs, branches,
plateaus, outliers, saturation. Files that a fit would reject are inspected, with the reason.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle

from airmuscle.bench import inspect, read

ROWS = 400


def seen(*arguments: object) -> dict:
    result = airmuscle("inspect", *arguments, "--json")
    assert result.exit_code == 0, result.stderr
    return json.loads(result.stdout)["inspection"]


def bench(path: Path, *, glitch: int | None = 95, swap: bool = False) -> Path:
    """Twenty steps up and twenty down, the force rounded to 0.5 N and saturated at -5 N, an outlier
    of one row.
    """
    random = np.random.default_rng(5)
    levels = [*np.linspace(0, 570, 20), *np.linspace(540, 0, 20)]
    pressure = np.repeat(levels, 10) + random.normal(0, 0.4, ROWS)
    force = np.maximum(0.9 * np.repeat(levels, 10) - 200.0 + random.normal(0, 0.6, ROWS), -5.0)
    if glitch is not None:
        force[glitch] += 60.0
    time = 0.05 * np.arange(ROWS)
    if swap:
        time[[20, 21]] = time[[21, 20]]
    rows = zip(time, pressure, np.round(2.0 * force) / 2.0, strict=True)
    lines = [f"{t:.2f},{p:.3f},{f:.1f},270,300" for t, p, f in rows]
    path.write_text("\n".join(["t [s],p [kPa],F [N],L [mm],rest_length [mm]", *lines]))
    return path


def test_json_contains_the_results_of_the_library(tmp_path: Path):
    path = bench(tmp_path / "run.csv")
    found = seen(path)
    (recording,) = read(path)
    expected = inspect(recording)
    assert (found["recording"], found["rows"], found["resting_length"]) == ("run.csv", ROWS, 0.3)
    columns = {column["column"]: column for column in found["columns"]}
    pressure = columns["pressure"]
    force = columns["force"]
    assert (pressure["unit"], pressure["unit_in_file"]) == ("Pa", "kPa")
    assert (pressure["min"], pressure["max"]) == (
        recording["pressure"].min(),
        recording["pressure"].max(),
    )
    assert found["rows_per_second"] == pytest.approx(20.0)
    assert (force["resolution"], force["lower_limit"], force["upper_limit"]) == (
        pytest.approx(0.5),
        -5.0,
        None,
    )
    assert found["runs"] == [
        {
            "run": "isometric",
            "first_row": 1,
            "last_row": ROWS,
            "constant": "contraction",
            "level": pytest.approx(0.1),
            "unit": "1",
            "swept": "pressure, force",
        }
    ]
    assert [(b["branch"], b["first_row"], b["last_row"]) for b in found["branches"]] == [
        ("inflating", 1, 200),
        ("deflating", 201, ROWS),
    ]
    assert len(found["plateaus"]) == len(expected.plateaus) == 40
    assert [(o["column"], o["row"]) for o in found["outliers"]] == [("force", 96)]
    assert found["quasi_static_rows"] == expected.quasi_static
    assert any("sensor saturates at its lower limit" in note for note in found["notes"])
    assert any("read as gauge" in note for note in found["notes"])


def test_the_text_output(tmp_path: Path):
    text = airmuscle("inspect", bench(tmp_path / "run.csv")).stdout
    for said in (
        "run.csv: 400 rows",
        "20 rows per second over 19.95 s, jitter 0.0 %",
        "force sensor saturates at its lower limit, -5 N, in 160 rows (40 %)",
    ):
        assert said in text
    for said in (
        "resting length +300 mm",
        "isometric +contraction +10 +% +pressure, force +1 +400",
        "inflating +1 +200",
        "deflating +201 +400",
        "plateaus +40 +with",
        "suspected outliers +1 +not removed",
        "force +96 ",
    ):
        assert re.search(said, text), said
    assert "PROBLEM" not in text
    digits = re.findall(r"(?<![\w.])\d+\.\d+(?![\w.])", text)
    assert digits
    assert all(len(number.replace(".", "").strip("0")) <= 4 for number in digits), digits


def test_a_long_list_is_truncated_with_a_count(tmp_path: Path):
    rows = [(p, c, 1e3 * p - 9 * c) for p in range(1, 14) for c in range(0, 24, 2)]
    path = tmp_path / "table.csv"
    path.write_text("\n".join(["p [barg],k [%],F [N]", *(",".join(map(str, row)) for row in rows)]))
    text = airmuscle("inspect", path).stdout
    assert re.search("isobaric +pressure +800 +kPa", text)
    assert "... 5 more in the report of --out" in text
    assert "The rows have no time." in text
    assert "rows per second" not in text


@pytest.mark.drawn
def test_the_figures_are_written_to_the_folder_and_reproducible(tmp_path: Path):
    bench(tmp_path / "a.csv")
    bench(tmp_path / "b.csv", glitch=None)
    for folder in ("one", "two"):
        result = airmuscle("inspect", tmp_path / "*.csv", "--out", tmp_path / folder)
        assert result.exit_code == 0, result.stderr
        assert f"report: {tmp_path / folder / 'report.html'}" in result.stdout
    names = sorted(
        path.relative_to(tmp_path / "one").as_posix() for path in (tmp_path / "one").rglob("*.*")
    )
    figures = [f"figures/recording-{i}.{suffix}" for i in (1, 2) for suffix in ("png", "svg")]
    assert [name for name in names if name.startswith("figures/")] == figures
    assert {"data/columns-1.csv", "data/outliers-1.csv", "data/runs-2.csv", "data/files.csv"} < set(
        names
    )
    assert "data/outliers-2.csv" not in names
    kept = [name for name in names if name != "report.html"]
    assert all(
        (tmp_path / "one" / n).read_bytes() == (tmp_path / "two" / n).read_bytes() for n in kept
    )
    assert (tmp_path / "one" / figures[0]).read_bytes().startswith(b"\x89PNG")


def test_the_figure_shows_branches_plateaus_outliers_and_limits(tmp_path: Path):
    (recording,) = read(bench(tmp_path / "run.csv"))
    figure = inspect(recording).plot()
    pressure, force, contraction = figure.axes
    labels = pressure.get_legend_handles_labels()[1]
    assert labels == ["inflating", "deflating", "plateau", "suspected outlier"]
    assert force.get_ylabel() == "force\n[N]"
    assert contraction.get_ylabel() == "contraction\n[%]"
    glitches = next(line for line in force.lines if line.get_label() == "suspected outlier")
    assert list(glitches.get_xdata()) == [pytest.approx(0.05 * 95)]
    assert any(
        list(line.get_ydata()) == [-5.0, -5.0] and line.get_linestyle() == "--"
        for line in force.lines
    )


def test_a_file_that_a_fit_rejects_is_inspected(tmp_path: Path):
    path = bench(tmp_path / "run.csv", swap=True)
    text = airmuscle("inspect", path).stdout
    assert "PROBLEM: time decreases in 1 row, first in row 22" in text
    fitted = airmuscle(
        "fit", path, "--characteristic", "ContractileSurface", "--out", tmp_path / "fit"
    )
    assert fitted.exit_code == 1
    assert "is less than the time of the previous row" in fitted.stderr


def test_rounded_time_stamps_are_told_from_the_rate_of_the_rows_and_name_the_option(tmp_path: Path):
    rows = [f"{i // 2 / 10:.1f},{i * 10},{0.3 - 1e-4 * i},{2 * i}" for i in range(60)]
    path = tmp_path / "rounded.csv"
    path.write_text("\n".join(["time [s],pressure [kPa],length [m],force [N]", *rows]))
    text = airmuscle("inspect", path).stdout
    assert "20.34 rows per second over 2.9 s, time stamps repeat" in text
    assert "For stamps that the logger rounded, use --time uniform." in text


def test_options_and_mapping_are_equivalent(tmp_path: Path):
    path = tmp_path / "run.txt"
    np.savetxt(
        path,
        np.column_stack([np.arange(9.0), np.linspace(2, 6, 9), np.linspace(290, 250, 9)]),
        delimiter="\t",
    )
    flags = ("--column", "1=time [s]", "--column", "2=pressure [bara]", "--column", "3=length [mm]")
    by_flags = seen(path, *flags, "--resting-length", "300 mm", "--ambient", "1 bar")
    (tmp_path / "rig.toml").write_text(
        'resting_length = "300 mm"\nambient = "1 bar"\n'
        '[columns]\n1 = "time [s]"\n2 = "pressure [bara]"\n3 = "length [mm]"\n'
    )
    by_file = seen(path, "--mapping", tmp_path / "rig.toml")
    assert by_file == by_flags
    pressure = next(column for column in by_file["columns"] if column["column"] == "pressure")
    assert (pressure["min"], pressure["max"]) == pytest.approx((1e5, 5e5))


@pytest.mark.parametrize(
    ("arguments", "code", "expected"),
    [
        (("none.csv",), 1, "cannot be read"),
        (("run.csv", "--column", "p"), 2, "--column must be NAME=TEXT"),
        (
            ("run.csv", "--column", "x=pressure [bar]"),
            1,
            "the mapping names column 'x', but the columns are t [s]",
        ),
        (("run.csv", "--unit", "pressure=mm"), 1, "cannot be converted to 'Pa'"),
        ((), 2, "Missing argument"),
    ],
)
def test_an_unreadable_file_is_an_error_on_one_line(
    tmp_path: Path, monkeypatch, arguments, code: int, expected: str
):
    bench(tmp_path / "run.csv")
    monkeypatch.chdir(tmp_path)
    result = airmuscle("inspect", *arguments)
    assert result.exit_code == code
    assert expected in result.stderr
    assert code == 2 or len(result.stderr.strip().splitlines()) == 1


def test_many_files_have_one_line_each_and_each_finding_once(tmp_path: Path, monkeypatch):
    for name in ("a", "b", "c"):
        bench(tmp_path / f"{name}.csv", glitch=None if name == "c" else 95)
    monkeypatch.setenv("COLUMNS", "160")
    text = airmuscle("inspect", *sorted(tmp_path.glob("*.csv"))).stdout
    lines = text.splitlines()
    rows = [line.split() for line in lines if re.match("[abc].csv ", line)]
    runs, levels = rows[:3], rows[3:]
    assert [row[:2] for row in runs] == [[f"{name}.csv", "400"] for name in "abc"]
    assert [row[3] for row in runs] == ["1", "1", "0"]
    assert [row[0] for row in levels] == ["a.csv", "b.csv", "c.csv"], "what each record gives"
    assert text.count("saturates at its lower limit") == 1
    assert "resting length   300 mm" in lines
    assert "Possible now: airmuscle hysteresis, campaign." in text, "no law of one length"
    assert len(lines) <= 24


@pytest.mark.parametrize(
    ("known", "again"), [("force [N]", "|F| [N]"), ("elongation [mm]", "Extension (mm)")]
)
def test_a_quantity_that_is_read_is_not_proposed_for_a_second_column(
    tmp_path: Path, known: str, again: str
):
    path = tmp_path / "run.csv"
    rows = "\n".join(f"{k},{k % 7},{k % 7}" for k in range(20))
    path.write_text(f"time [s],{known},{again}\n{rows}\n", encoding="utf-8")
    assert "mapping" not in airmuscle("inspect", path).stdout
    path.write_text(f"time [s],pressure [kPa],{again}\n{rows}\n", encoding="utf-8")
    assert f'"{again}" = "{known}"' in airmuscle("inspect", path).stdout


def test_the_way_on_is_in_the_brief_view_where_a_file_is_not_understood(tmp_path: Path):
    for name in ("a", "b"):
        bench(tmp_path / f"{name}.csv")
    (tmp_path / "c.csv").write_text("time [s],pressure [kPa]\n0,x\n1,y\n2,z\n", encoding="utf-8")
    further = airmuscle("inspect", tmp_path).stdout.partition("The way on")[2]
    assert "airmuscle hysteresis " in further
    assert "resting length" not in further, "the files state it"


def test_a_fit_is_proposed_only_where_the_records_support_a_law(tmp_path: Path):
    for length in ("270", "285", "294"):
        path = bench(tmp_path / f"{length}.csv", glitch=None)
        content = path.read_text(encoding="utf-8")
        path.write_text(content.replace(",270,", f",{length},"), encoding="utf-8")
    text = airmuscle("inspect", tmp_path).stdout
    assert "Possible now: airmuscle fit, hysteresis, campaign." in text
    text = " ".join(airmuscle("inspect", path).stdout.split())
    assert "airmuscle fit " not in text
    assert "there is one contraction: measure the same at two further lengths" in text
    refused = airmuscle("fit", *2 * [path], "--compare")
    assert "two further lengths" in " ".join(refused.stderr.split())
