"""Files that the example lines of the help texts name: records of a test rig and of a robot,
studies, mappings and scenarios, all made of a muscle of the library.
"""

from __future__ import annotations

import dataclasses
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
from bodies import URDF, URDF_ROUTES
from dynamic_study import HELD, STUDY, VALVES, noisy_run, plant_table, run_table
from scenario_files import HELD_FILL, HELD_STUDY, MUSCLE_FILE, PRESSURE_LOOP

import airmuscle as am
from airmuscle.bench import write
from airmuscle.design import declaration_toml, propose_submission
from airmuscle.engine import RungeKutta4, SampledSignal, Schedule, simulate_batch
from airmuscle.files import save
from airmuscle.physics import PressureDriven
from airmuscle.recording import Recording

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
MUSCLE = "dmsp-20-300"
LENGTH = 0.3
TRUE = plant_table(HELD, exponent=1.25, conductance=3e-9)
START = plant_table(HELD, exponent=1.1, conductance=4e-9)
FILL = (
    run_table("0.2 bar")
    + '[input]\nfill = [["0.1 s", 1], ["1 s", 0]]\ndischarge = [["1.3 s", 1]]\n'
)
RECORD = '[[record]]\nfile = "{}"\ninitial_state = {{ pressure = "0.2 bar" }}\n'
WALL_STUDY = (
    START.replace(
        'model = "Polytropic", exponent = 1.1', 'model = "EnergyBalance", heat_transfer = 1.2'
    )
    + STUDY
).replace(
    VALVES + ', "gas.exponent"',
    '"circuit.fill.conductance", "circuit.fill.critical_ratio", "gas.heat_transfer"',
)
"""A study with the three numbers of a valve and of the wall that a fill hardly tells apart."""
POSITION_LOOP = PRESSURE_LOOP.replace('measured = "pressure"', 'measured = "position"').replace(
    '"1.5 1/bar"', '"50 1/m"'
)
POSITION_LOOP = POSITION_LOOP.replace(
    'pressure = [["0 s", "1 bar"], ["0.1 s", "2 bar"]]',
    'position = [["0 s", "10 mm"], ["0.1 s", "20 mm"]]',
)
ARM = (
    'sample_time = "10 ms"\nstarts = "start"\n[angles]\ncolumns = ["q"]\n[speeds]\ncolumns = ["v"]\n'
    '[pressures]\ncolumns = ["p"]\n[arm]\npairs = [[1, 2]]\n'
)
KNEE = URDF.replace('"arm"', '"knee"')
KNEE_ROUTES = URDF_ROUTES.replace("arm_flexor", "knee_flexor")
TORQUES = "angle [deg],torque [N m]\n" + "".join(
    f"{angle},{6.0 + 3.0 * np.sin(np.radians(2.0 * angle)):.4g}\n" for angle in range(0, 61, 5)
)
WALK = "time [s],hip [deg],knee [deg],ankle [deg]\n" + "".join(
    f"{0.1 * i:.1f},{10.0 * np.sin(0.6 * i) - 5.0:.2f},{30.0 + 20.0 * np.sin(0.6 * i):.2f},0\n"
    for i in range(11)
)


def force_map(seed: int, scale: float = 1.0) -> Recording:
    """Static points at six pressures and six contractions, with a noise of 2 N."""
    pressure, contraction = (
        values.ravel() for values in np.meshgrid(1e5 * np.arange(1, 7), 0.03 * np.arange(6))
    )
    force = scale * am.load(MUSCLE).characteristic.force(pressure, contraction)
    force = force + np.random.default_rng(seed).normal(0.0, 2.0, force.size)
    columns = {"pressure": pressure, "contraction": contraction, "force": np.maximum(force, 0.0)}
    return Recording(columns, f"map {seed}", {"resting_length": LENGTH})


def loop(seed: int, bar: float = 3.0, rows: int = 300) -> Recording:
    """A triangle of the contraction at a constant pressure, with a friction of 8 N."""
    random = np.random.default_rng(seed)
    contraction = np.interp(np.linspace(0.0, 2.0, rows), [0.0, 1.0, 2.0], [0.01, 0.15, 0.01])
    pressure = np.full(rows, 1e5 * bar)
    force = am.load(MUSCLE).characteristic.force(pressure, contraction)
    friction = 8.0 * np.tanh(np.gradient(contraction) / 1e-4)
    columns = {
        "time": np.linspace(0.0, 60.0, rows),
        "pressure": pressure + random.normal(0.0, 50.0, rows),
        "contraction": contraction,
        "force": force - friction + random.normal(0.0, 1.0, rows),
    }
    return Recording(columns, f"loop {seed}", {"resting_length": LENGTH})


def ramp(contraction: float, rows: int = 200) -> Recording:
    """A triangle of the pressure at a constant length."""
    pressure = np.interp(np.linspace(0.0, 2.0, rows), [0.0, 1.0, 2.0], [5e4, 5e5, 5e4])
    force = am.load(MUSCLE).characteristic.force(pressure, np.full(rows, contraction))
    noise = np.random.default_rng(3).normal(0.0, 2.0, rows)
    columns = {"time": 0.1 * np.arange(rows), "pressure": pressure, "force": force + noise}
    return Recording(columns, "ramp")


def water_column() -> Recording:
    contraction = np.linspace(0.0, 0.25, 30)
    noise = np.random.default_rng(2).normal(0.0, 2e-7, 30)
    volume = am.load(MUSCLE).muscle.geometry.volume(contraction) + noise
    return Recording({"contraction": contraction, "volume": volume}, "column")


def regulator_record(steps: list[tuple[float, float]]) -> Recording:
    """Command and pressure of a regulator of the library."""
    plant = am.load("vessel-smc-itv2050").plant
    run = am.simulate(
        plant,
        Schedule({"setpoint": steps}),
        duration=steps[-1][0] + 0.8,
        output_times=1e-2,
        initial_state=plant.state_at(pressure=3e5),
    )
    instants, levels = np.array(steps).T
    command = levels[np.searchsorted(instants, run["time"] + 1e-9, side="right") - 1]
    noise = np.random.default_rng(10).normal(0.0, 1e3, len(run))
    columns = {"time": run["time"], "setpoint": command, "pressure": run["pressure"] + noise}
    return Recording(columns, "regulator")


def joint_episodes(count: int = 12, rows: int = 80) -> dict[str, np.ndarray]:
    """Angle, speed and pressures of a joint of the library in several episodes."""
    plant = am.load("joint-dmsp-20-matrix").plant
    joint = PressureDriven(plant.muscles, plant.mechanism, (0.02, 0.02))
    random = np.random.default_rng(0)
    knots = np.linspace(0.0, 0.01 * rows, 12)
    levels = random.uniform(1e5, 4e5, (count, 2, len(knots)))
    names = [f"{prefix}measured_pressure" for prefix in joint.prefixes]
    signals = [
        SampledSignal(
            {
                name: tuple(zip(knots.tolist(), pressure.tolist(), strict=True))
                for name, pressure in zip(names, episode, strict=True)
            }
        )
        for episode in levels
    ]
    start = {state.name: np.zeros(count) for state in joint.states}
    start |= {f"{prefix}pressure": levels[:, i, 0] for i, prefix in enumerate(joint.prefixes)}
    run = simulate_batch(
        joint,
        {},
        signals,
        duration=0.01 * (rows - 1),
        initial_states=start,
        output_times=0.01 * np.arange(rows),
        integrator=RungeKutta4(1e-3),
        keep=["angle", "angular_speed", *names],
    )
    noise = 5e-4 * random.standard_normal(run["angle"].shape)
    pressures = np.stack([run[name] for name in names], axis=-1)
    return {"q": run["angle"] + noise, "v": run["angular_speed"], "p": pressures}


def _write_static(folder: Path) -> None:
    write(am.load_data(MUSCLE), folder / "bench.csv")
    for name in ("my", "fit", "identified"):
        (folder / name).mkdir()
        save(am.load(MUSCLE).muscle, folder / name / "muscle.toml")
    (folder / "rig.toml").write_text('resting_length = "300 mm"\n', encoding="utf-8")
    for name in ("runs", "muscles", "loops", "today", "later", "run", "fills"):
        (folder / name).mkdir()
    for i in (1, 2, 3):
        for suffix in (".csv", ".xlsx", ".tdms"):
            write_any(force_map(i), folder / "runs" / f"run{i}{suffix}")
        specimen = {"resting_length": 0.1 * (i + 1), "specimen": f"{10 * (i + 1)} cm"}
        muscle = force_map(i, 1.0 + 0.02 * i)
        for again in ("a", "b"):
            write(
                Recording(muscle.columns, muscle.origin, {**specimen, "run": again}),
                folder / "muscles" / f"muscle{i}{again}.csv",
            )
    for name in ("bench.tdms", "log.mat"):
        write_any(loop(4), folder / name)
    for i in (1, 2):
        write(loop(i), folder / f"loop{i}.csv")
        write(loop(i, 1.0 + 2.0 * i), folder / "loops" / f"loop{i}.csv")
    for name in ("later.csv", "later/isobar_250kPa.csv", "today/isobar.csv", "run_07.csv"):
        write(loop(7, 2.5), folder / name)
    for name in ("logger.csv", "run/recording.csv"):
        write(loop(8, 4.0), folder / name)
    write(force_map(9), folder / "log.csv")
    for contraction in (0.02, 0.06, 0.10, 0.14):
        millimetres = 200.0 * (1.0 - contraction)
        write(ramp(contraction), folder / f"log_held{millimetres:g}mm.csv")
    for name in ("column.csv", "fills/fill1.csv"):
        write(water_column(), folder / name)


def write_any(recording: Recording, path: Path) -> None:
    """A recording as a workbook, a TDMS or a MAT file, whose names state the units, or as text."""
    named = {
        "time": ("time [s]", 1.0),
        "pressure": ("pressure [kPa]", 1e-3),
        "contraction": ("contraction [%]", 100.0),
        "force": ("force [N]", 1.0),
    }
    columns = {
        named[name][0]: named[name][1] * np.asarray(values)
        for name, values in recording.columns.items()
    }
    if path.suffix == ".xlsx":
        import openpyxl

        book = openpyxl.Workbook()
        book.active.append([*columns])
        for row in np.transpose([*columns.values()]).tolist():
            book.active.append(row)
        book.save(path)
    elif path.suffix == ".tdms":
        import nptdms

        channels = [nptdms.ChannelObject("run", name, column) for name, column in columns.items()]
        with nptdms.TdmsWriter(path) as file:
            file.write_segment(channels)
    elif path.suffix == ".mat":
        import scipy.io

        units = {"time": "s", "pressure": "kPa", "contraction": "percent", "force": "N"}
        names = [f"{name}_{units[name]}" for name in recording.columns]
        scipy.io.savemat(path, dict(zip(names, columns.values(), strict=True)))
    else:
        write(recording, path)


def _write_campaign(folder: Path) -> None:
    (folder / "bench").mkdir()
    for bar in (2.0, 4.0):
        write(loop(int(bar), bar), folder / "bench" / f"isobar_{bar:g}bar.csv")
    write(force_map(1), folder / "bench" / "map.csv")


def _write_dynamic(folder: Path) -> None:
    random = np.random.default_rng(1)
    truth = TRUE + FILL + '[observed]\npressure = "500 Pa"\n'
    for name in ("dynamic/scenario.toml", "campaign/scenarios/fill_1.toml"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(truth, encoding="utf-8")
    for name, shift in (("run1", 0.01), ("run2", 0.0), ("fill3", 0.2)):
        run = noisy_run(folder / "dynamic" / "scenario.toml", random, {"pressure": 500.0})
        write(Recording({**run, "time": run["time"] + shift}, name), folder / f"{name}.csv")
    study = START + STUDY + 'start_time = "50 ms"\n'
    (folder / "study.toml").write_text(
        study + RECORD.format("run1.csv") + RECORD.format("run2.csv"), encoding="utf-8"
    )
    (folder / "further-records.toml").write_text(RECORD.format("run2.csv"), encoding="utf-8")
    steps = [(0.0, 3e5), (0.5, 3.4e5), (1.6, 2.6e5), (1.75, 3e5), (2.5, 3.2e5)]
    for name, factor in (("steps", 1.0), ("sines", 1.1)):
        scaled = [(time, factor * pressure) for time, pressure in steps]
        write(regulator_record(scaled), folder / f"{name}.csv")


def _write_joint(folder: Path) -> None:
    episodes = joint_episodes()
    (folder / "episodes").mkdir()
    count, rows = episodes["q"].shape
    for i in range(count):
        arrays = {name: values[i] for name, values in episodes.items()}
        np.savez(folder / "episodes" / f"episode{i:02d}.npz", start=[0, rows], **arrays)
    joined = {name: values.reshape(count * rows, -1) for name, values in episodes.items()}
    np.savez(folder / "episodes.npz", start=rows * np.arange(count + 1), **joined)
    (folder / "arm.toml").write_text(ARM, encoding="utf-8")
    (folder / "joint.toml").write_text(
        '[plant]\nlibrary = "joint-dmsp-20-matrix"\n[run]\nduration = "1 s"\n', encoding="utf-8"
    )


def _write_simulation(folder: Path) -> None:
    shutil.copytree(EXAMPLES, folder / "examples")
    contents = {"muscle": MUSCLE_FILE, "scenario": HELD_FILL, "lift": POSITION_LOOP}
    for name, content in contents.items():
        (folder / f"{name}.toml").write_text(content, encoding="utf-8")
    _write_loops(folder)
    shutil.copy(EXAMPLES / "air_leg.xml", folder / "leg.xml")
    bodies = {"leg.urdf": KNEE, "routes.toml": KNEE_ROUTES, "walk.csv": WALK, "torque.csv": TORQUES}
    for name, content in bodies.items():
        (folder / name).write_text(content, encoding="utf-8")
    cluster = (EXAMPLES / "cluster_local.toml").read_text(encoding="utf-8")
    (folder / "cluster.toml").write_text(
        cluster.replace("workers = 2", "workers = 1"), encoding="utf-8"
    )


def _write_loops(folder: Path) -> None:
    """Scenarios whose controllers are compared: loops of one pressure, and predictive control."""
    loop = (EXAMPLES / "pressure_loop.toml").read_text(encoding="utf-8")
    slow = loop.replace("1.5 1/bar", "0.5 1/bar")
    (folder / "loop-tuned.toml").write_text(slow, encoding="utf-8")
    for name, content in (("pid", loop), ("cascade", slow), ("bench", loop)):
        short = content.replace('duration = "5 s"', 'duration = "1 s"')
        (folder / f"{name}.toml").write_text(short, encoding="utf-8")


def write_contribution(folder: Path, rms_error: str = "") -> None:
    """A contribution whose questions are answered: muscle, records of the fit, one held out."""
    folder.mkdir()
    write(force_map(1), folder / "map.csv")
    write(loop(1), folder / "loop.csv")
    write(force_map(2), folder / "later.csv")
    save(am.load(MUSCLE), folder / "muscle.toml")
    answered = dataclasses.replace(
        propose_submission(folder),
        name="smith-pam-20-300",
        licence="CC0-1.0",
        contributor="A. Smith <smith@example.org>",
        measured_by="A. Smith, Example University 2026",
        rig=dict.fromkeys(("pressure", "force", "motion", "procedure"), "simulated"),
    )
    records = [
        dataclasses.replace(record, use="held out", rms_error=rms_error)
        if record.file == "later.csv"
        else dataclasses.replace(record, use="fit")
        for record in answered.records
    ]
    text = declaration_toml(dataclasses.replace(answered, records=tuple(records)))
    (folder / "submission.toml").write_text(text, encoding="utf-8")


def _write_audited(folder: Path) -> None:
    """A model of a user and its constants, as `audit` examines them."""
    shutil.copy(Path(__file__).with_name("audited_models.py"), folder / "mymodel.py")
    with (folder / "mymodel.py").open("a", encoding="utf-8") as file:
        file.write("\n\nforce = ideal\nflow = iso\n")
    constants = "name,value,unit,printed\ncritical ratio,0.3,,0.3\nbraid angle,25,deg,\n"
    (folder / "constants.csv").write_text(constants, encoding="utf-8")


def _write_contribution(folder: Path) -> None:
    write_contribution(folder / "contribution", "2 N")


WRITERS: tuple[Callable[[Path], None], ...] = (
    _write_static,
    _write_campaign,
    _write_dynamic,
    _write_joint,
    _write_simulation,
    _write_audited,
    _write_contribution,
)


def write_user_files(folder: Path) -> None:
    """All files that example lines name; `study.toml` is that of a dynamic fit."""
    for writer in WRITERS:
        writer(folder)


def serial_rows() -> str:
    """Rows of a stream without headings: pressure [kPa], contraction [%], force [N]."""
    points = force_map(9)
    columns = (1e-3 * points["pressure"], 100.0 * points["contraction"], points["force"])
    return "\n".join(",".join(f"{x:.5g}" for x in row) for row in zip(*columns, strict=True))


def write_study(command: str, folder: Path) -> None:
    """The study that lines of a command take in place of that of a dynamic fit."""
    studies = {
        "study": HELD_STUDY.replace("48", "4"),
        "plan": WALL_STUDY + RECORD.format("run1.csv"),
    }
    if command in studies:
        (folder / "study.toml").write_text(studies[command], encoding="utf-8")
