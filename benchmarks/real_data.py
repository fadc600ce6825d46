"""Static fits to measured muscles of several lengths, validated on a repeated measurement.

    python benchmarks/real_data.py FOLDER

FOLDER holds CSV files named `..._cut<cm>cm_held<cm>cm_test<n>.csv` with the columns time, pressure,
force, length and rest_length, units in the headers. Repeat 8 is fitted, with its slack rows as
bounds; the rows of repeat 9 above 2 N are used for validation, and its slack rows for the greatest
force of the law where the muscle is slack. Each error is compared with the repeatability, the
difference of the two repeats: a fit below it is overfitted. The model is selected with repeat 8
alone, for each purpose, before repeat 9 is used; one law for further runs and other lengths is also
selected with both repeats, by leaving out runs and specimens.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

import airmuscle as am
from airmuscle.bench.comparison.candidate_scores import count_parameters
from airmuscle.bench.comparison.compared_points import (
    evaluated_rows,
    force_residuals,
    residuals_of_rows,
)
from airmuscle.bench.statics.candidates import blank_surface
from airmuscle.core.errors import IdentificationError

NAME = re.compile(r"_cut(\d+)cm_held([\d.]+)cm_test(\d+)\.csv$")
MIN_FORCE = 2.0
CEILING = 5000.0


def read(path: Path) -> am.Recording:
    """One run in SI units, with its resting length as constant."""
    table = pd.read_csv(path)
    table.columns = [header.split(" [")[0] for header in table.columns]
    rest = float(table["rest_length"].iloc[0]) / 100
    columns = {
        "pressure": table["pressure"].to_numpy() * 1e3,
        "contraction": 1 - table["length"].to_numpy() / 100 / rest,
        "force": table["force"].to_numpy(),
        "branch": table["branch"].to_numpy(),
    }
    match = NAME.search(path.name)
    assert match is not None
    return am.Recording(
        columns,
        path.stem,
        {"resting_length": rest, "specimen": f"{match[1]} cm", "repeat": match[3]},
    )


def repeats(folder: Path) -> tuple[list[am.Recording], list[am.Recording]]:
    """The runs of repeat 8 and of repeat 9, in the same order."""
    runs = [read(path) for path in sorted(folder.glob("*.csv")) if NAME.search(path.name)]
    if not runs:
        raise SystemExit(f"{folder}: no file with a name such as ..._cut10cm_held8.3cm_test8.csv")
    return tuple([run for run in runs if run.constants["repeat"] == n] for n in ("8", "9"))  # type: ignore[return-value]


def rms(errors: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.asarray(errors) ** 2)))


def repeatability(first: Sequence[am.Recording], second: Sequence[am.Recording]) -> float:
    """The rms difference of the repeats [N]: medians of repeat 8 at the pressure and branch of each
    row of repeat 9.
    """
    differences = []
    for a, b in zip(first, second, strict=True):
        for branch in (1, 2):
            x, y = (run.rows(run["branch"] == branch) for run in (a, b))
            if len(x) < 5 or not len(y):
                continue
            near = np.abs(x["pressure"][None, :] - y["pressure"][:, None]) < 5e3
            usable = near.sum(axis=1) >= 3
            medians = np.array([np.median(x["force"][row]) for row in near[usable]])
            differences.append(medians - y["force"][usable])
    return rms(np.concatenate(differences))


def select_specimen(
    runs: Sequence[am.Recording], specimen: str, *, others: bool = False
) -> list[am.Recording]:
    """The runs of one specimen, or of all others."""
    return [run for run in runs if (run.constants["specimen"] == specimen) != others]


def format_row(name: str, parameters: int, errors: Sequence[float], floor: float) -> str:
    """One row of the table."""
    return f"{name:<68}{parameters:>5}" + "".join(f"{e:>9.1f}" for e in errors) + f"{floor:>9.1f}"


def pulling(runs: Sequence[am.Recording]) -> list[am.Recording]:
    """The rows above `MIN_FORCE`."""
    return [run.rows(run["force"] > MIN_FORCE) for run in runs]


def slack_force(model: am.characteristic.ForceLaw, runs: Sequence[am.Recording]) -> float:
    """The greatest force [N] of a law at the slack rows."""
    rows = evaluated_rows(runs)
    return float(residuals_of_rows(model, rows.at(~rows.measured), CEILING).max())


def validation_errors(
    candidate: am.bench.Candidate,
    train: list[am.Recording],
    test: list[am.Recording],
    specimens: list[str],
) -> list[float]:
    """Error on repeat 9, greatest force at its slack rows, then the error on each specimen left out
    of the fit; NaN if the others do not determine the law."""
    law = candidate.law
    fixed = candidate.fixed
    complete = am.fit(law, train, fixed=fixed).model
    errors = [rms(force_residuals(complete, pulling(test), CEILING)), slack_force(complete, test)]
    for name in specimens:
        try:
            model = am.fit(law, select_specimen(train, name, others=True), fixed=fixed).model
        except IdentificationError:  # not determined by two lengths
            errors.append(np.nan)
            continue
        errors.append(rms(force_residuals(model, pulling(select_specimen(test, name)), CEILING)))
    return errors


def single_surface_errors(train: list[am.Recording], test: list[am.Recording]) -> np.ndarray:
    """Errors on repeat 9 of a surface with 21 coefficients for one specimen (minimum-norm
    solution).
    """
    matrices = []
    for runs in (train, test):
        p, c = (np.concatenate([run[n] for run in runs]) for n in ("pressure", "contraction"))
        x = c / 0.075 - 1
        q = p / 3.13e5 - 1
        matrices.append(np.column_stack([x**i * q**j for j in range(6) for i in range(6 - j)]))
    goal, truth = (np.concatenate([run["force"] for run in runs]) for runs in (train, test))
    norms = np.linalg.norm(matrices[0], axis=0)
    coefficients = np.linalg.lstsq(matrices[0] / norms, goal, rcond=1e-10)[0] / norms
    return np.asarray(matrices[1] @ coefficients - truth)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    train, test = repeats(parser.parse_args().folder)
    specimens = sorted({str(run.constants["specimen"]) for run in train})
    for split in (am.bench.BlockSplit(), am.bench.SpecimenSplit()):
        print(am.bench.compare(train, leave_out=split, workers=2).reason, flush=True)
    for name, runs in (("repeat 8", train), ("repeats 8 and 9", train + test)):
        print(f"\n{name}: {am.bench.select_for_both(runs, workers=2)}", flush=True)
    floor = repeatability(pulling(train), pulling(test))
    print(
        f"\nrms error of the force [N]; fitted to repeat 8 ({sum(map(len, train))} rows), validated"
        " on repeat 9"
    )
    columns = "".join(f"{'no ' + name:>9}" for name in specimens)
    print(f"{'law':<68}{'P':>5}{'rep. 9':>9}{'at slack':>9}{columns}{'repeat.':>9}")
    each = [
        single_surface_errors(
            pulling(select_specimen(train, name)), pulling(select_specimen(test, name))
        )
        for name in specimens
    ]
    print(
        format_row(
            "one surface of degree 5 per length", 63, [rms(np.concatenate(each)), np.nan], floor
        )
    )
    print(format_row("  each length", 21, [rms(e) for e in each], floor))
    candidates = [
        am.bench.Candidate("one surface of degree 5 for all lengths", blank_surface(5)),
        *am.bench.standard_candidates(train),
    ]
    for candidate in candidates:
        if hasattr(candidate.law, "with_resting_length") or candidate is candidates[0]:
            try:
                size = count_parameters(am.fit(candidate.law, train, fixed=candidate.fixed))
                print(
                    format_row(
                        candidate.name,
                        size,
                        validation_errors(candidate, train, test, specimens),
                        floor,
                    ),
                    flush=True,
                )
            except IdentificationError as error:
                print(f"{candidate.name:<46} excluded: {error}", flush=True)


if __name__ == "__main__":
    main()
