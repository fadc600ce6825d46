"""Forty kinds of laboratory files, imitated with numbers of our own, and the quantities in them.

Every second kind is held back: the vocabulary and the readers were not changed for it.
"""

from __future__ import annotations

import dataclasses
import io
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from scipy.io import savemat

ROWS = 120
RATE = 50.0
TIME = np.arange(ROWS) / RATE
PHASE = np.sin(np.pi * TIME / TIME[-1])
PRESSURE = 3e5 * PHASE + 2e3
"""Gauge pressure [Pa]."""
CONTRACTION = 0.15 * PHASE
LENGTH = 0.2 * (1.0 - CONTRACTION)
FORCE = 40.0 + 60.0 * PHASE
ANGLE = np.deg2rad(40.0 * PHASE - 5.0)
PSI = 6894.757293168361
GRAVITY = 9.80665
LBF = 4.4482216152605

Columns = Mapping[str, np.ndarray]
Truth = Mapping[str, np.ndarray]


@dataclasses.dataclass(frozen=True)
class FieldFile:
    """A file, what it contains in SI units, and the answers of its user to open questions.

    answers  by heading or number of a column, what the user writes for a question mark
    """

    name: str
    content: bytes
    truth: Truth
    answers: Mapping[str, str] = dataclasses.field(default_factory=dict)
    arguments: Sequence[str] = ()


KINDS: list[tuple[str, Callable[[], FieldFile]]] = []


def kind(make: Callable[[], FieldFile]) -> Callable[[], FieldFile]:
    KINDS.append((make.__name__, make))
    return make


def lines(columns: Columns, separator: str = ",", decimal: str = ".", digits: int = 4) -> str:
    """The rows of a table as text."""
    rows = zip(*columns.values(), strict=True)
    texts = [separator.join(_cell(value, digits, decimal) for value in row) for row in rows]
    return "\n".join(texts) + "\n"


def _cell(value: object, digits: int, decimal: str) -> str:
    if isinstance(value, str):
        return value
    return f"{value:.{digits}f}".replace(".", decimal)


def table(columns: Columns, separator: str = ",", decimal: str = ".", digits: int = 4) -> str:
    """Headings and rows."""
    return separator.join(columns) + "\n" + lines(columns, separator, decimal, digits)


def mat(**variables: object) -> bytes:
    """A MAT file with these variables."""
    stream = io.BytesIO()
    savemat(stream, variables)
    return stream.getvalue()


ALL = {"time": TIME, "pressure": PRESSURE, "force": FORCE}


@kind
def words_inside() -> FieldFile:
    columns = {
        "Time (s)": TIME,
        "PAM Pressure (kPa)": PRESSURE / 1e3,
        "Load Cell Force (N)": FORCE,
        "Muscle Contraction (%)": 100 * CONTRACTION,
    }
    return FieldFile("a.csv", table(columns).encode(), {**ALL, "contraction": CONTRACTION})


@kind
def testing_machine() -> FieldFile:
    columns = {"a": TIME, "b": 200.0 - 1e3 * LENGTH, "c": FORCE, "d": PRESSURE / 1e5}
    text = (
        '"Specimen","PAM 3"\n"Rate","10 mm/min"\n\n"Time","Extension","Load","Muscle pressure"\n'
        '"(s)","(mm)","(N)","(bar)"\n' + lines(columns)
    )
    return FieldFile("b.csv", text.encode(), ALL)


@kind
def german_machine() -> FieldFile:
    columns = {"a": TIME, "b": FORCE, "c": 200.0 - 1e3 * LENGTH, "d": PRESSURE / 1e5}
    text = "Prüfer;Huber\nPrüfzeit;Zugkraft;Standardweg;Überdruck\ns;N;mm;bar\n"
    content = (text + lines(columns, ";", ",")).encode("cp1252")
    return FieldFile("c.txt", content, ALL)


@kind
def control_desk() -> FieldFile:
    columns = {
        "time [s]": TIME,
        '"Platform()://Rig/Model Root/Pressure Muscle [bar]/Out1"': PRESSURE / 1e5,
        '"Platform()://Rig/Model Root/Force Sensor [N]/Out1"': FORCE,
    }
    return FieldFile("d.csv", table(columns, ";").encode(), ALL)


@kind
def serial_plotter() -> FieldFile:
    rows = zip(1e3 * TIME, PRESSURE / 1e3, FORCE, strict=True)
    text = "".join(f"time_ms:{t:.0f},pressure_kPa:{p:.4f},force_N:{f:.4f}\n" for t, p, f in rows)
    return FieldFile("e.txt", text.encode(), ALL)


@kind
def terminal_banner() -> FieldFile:
    columns = {
        "millis": 1e3 * TIME,
        "pressure_psi": PRESSURE / PSI,
        "loadcell_g": 1e3 * FORCE / GRAVITY,
    }
    banner = "=~=~=~=~=~=~=~=~=~=~=~= PuTTY log 2024.03.12 10:15:32 =~=~=~=~=~=~=~=~=~=~=~=\n"
    return FieldFile("f.log.txt", (banner + table(columns)).encode(), ALL, {"millis": "ms"})


@kind
def lvm() -> FieldFile:
    header = (
        "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\n"
        "Decimal_Separator\t.\nMulti_Headings\tNo\nX_Columns\tOne\nTime_Pref\tAbsolute\n"
        "***End_of_Header***\t\n\t\nChannels\t2\nSamples\t120\t120\n"
        "Y_Unit_Label\tbar\tN\nX_Dimension\tTime\tTime\nX0\t0.0\t0.0\nDelta_X\t0.02\t0.02\n"
        "***End_of_Header***\t\t\t\nX_Value\tMuscle Pressure\tLoad Cell\tComment\n"
    )
    columns = {"a": TIME, "b": PRESSURE / 1e5, "c": FORCE}
    return FieldFile("g.lvm", (header + lines(columns, "\t")).encode(), ALL)


@kind
def daqami() -> FieldFile:
    stamps = [f"10:15:{32 + t:09.6f}" for t in TIME]
    columns = {
        "Sample": np.arange(1.0, ROWS + 1),
        "Date/Time": np.array([f"2024-03-12 {stamp[:12]}" for stamp in stamps]),
        "Pressure (psi)": PRESSURE / PSI,
        "Load (lbf)": FORCE / LBF,
    }
    preamble = "DAQami\nAcquisition device,USB-1608G\nSample rate,50 Hz\n\n"
    return FieldFile("h.csv", (preamble + table(columns)).encode(), ALL)


@kind
def topic_echo() -> FieldFile:
    nanoseconds = [f"{1710238532000000000 + round(1e9 * t)}" for t in TIME]
    columns = {
        "%time": np.array(nanoseconds),
        "field.header.seq": np.arange(1.0, ROWS + 1),
        "field.pressure_kpa": PRESSURE / 1e3,
        "field.tension_n": FORCE,
    }
    return FieldFile("i.csv", table(columns).encode(), ALL)


@kind
def writetable() -> FieldFile:
    columns = {"Time_s_": TIME, "MusclePressure_kPa_": PRESSURE / 1e3, "Force_N_": FORCE}
    return FieldFile("j.csv", table(columns).encode(), ALL)


@kind
def mat_with_names() -> FieldFile:
    matrix = np.column_stack([TIME, PRESSURE / 1e3, FORCE])
    names = np.array(["Time (s)", "Muscle pressure (kPa)", "Pull force (N)"], dtype=object)
    return FieldFile("k.mat", mat(data=matrix, names=names), ALL)


@kind
def mat_matrix() -> FieldFile:
    matrix = np.column_stack([TIME, PRESSURE / 1e3, FORCE])
    answers = {
        "Test8Data(:,1)": "time [s]",
        "Test8Data(:,2)": "pressure [kPa]",
        "Test8Data(:,3)": "force [N]",
    }
    return FieldFile("l.mat", mat(Test8Data=matrix), ALL, answers)


@kind
def side_by_side_loads() -> FieldFile:
    half = slice(0, 50)
    columns = {str(i): c[half] for i, c in enumerate([PRESSURE / 1e3, 1e3 * LENGTH])}
    rows = zip(*columns.values(), strict=True)
    cells = "".join(f"{p:.3f},{x:.3f},,{p:.3f},{x - 1:.3f}\n" for p, x in rows)
    text = "Load 100 g,,,Load 200 g,\npressure (kPa),length (mm),,pressure (kPa),length (mm)\n"
    return FieldFile(
        "m.csv", (text + cells).encode(), {"pressure": PRESSURE[half], "length": LENGTH[half]}
    )


@kind
def side_by_side_specimens() -> FieldFile:
    rows = zip(PRESSURE / 1e5, FORCE, strict=True)
    cells = "".join(f"{p:.5f};{f:.4f};{p + 0.01:.5f};{f - 3:.4f}\n" for p, f in rows)
    text = "Probe A;;Probe B;\nDruck [bar];Kraft [N];Druck [bar];Kraft [N]\n"
    return FieldFile("n.csv", (text + cells).encode(), {"pressure": PRESSURE, "force": FORCE})


def _grid() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    pressure = np.array([0.0, 1e5, 2e5, 3e5])
    contraction = np.array([0.0, 5.0, 10.0, 15.0, 20.0]) / 100
    force = (1.0 + pressure[None, :] / 1e3) * (1.0 - 3.5 * contraction[:, None])
    return contraction, pressure, force


@kind
def grid_with_corner() -> FieldFile:
    contraction, pressure, force = _grid()
    text = "contraction [%] \\ pressure [kPa]," + ",".join(f"{p / 1e3:g}" for p in pressure) + "\n"
    for c, row in zip(contraction, force, strict=True):
        text += f"{100 * c:g}," + ",".join(f"{f:.3f}" for f in row) + "\n"
    answers = {"cells": "force [N]"}
    return FieldFile("o.csv", text.encode(), {"force": force.ravel()}, answers)


@kind
def grid_with_super_heading() -> FieldFile:
    contraction, pressure, force = _grid()
    text = "Force (N);Pressure (bar);;;\nContraction (%);" + ";".join(
        f"{p / 1e5:g}" for p in pressure
    )
    for c, row in zip(contraction, force, strict=True):
        text += f"\n{100 * c:g};" + ";".join(f"{f:.3f}" for f in row)
    return FieldFile("p.csv", (text + "\n").encode(), {"force": force.ravel()})


@kind
def frame_counter() -> FieldFile:
    columns = {"frame": np.arange(ROWS), "p_kPa": PRESSURE / 1e3, "force_N": FORCE}
    text = "% Fs = 50 (Hz)\n% frame p_kPa force_N\n" + lines(columns, " ")
    return FieldFile("q.txt", text.encode(), ALL)


@kind
def rate_above() -> FieldFile:
    columns = {"Pressure [kPa]": PRESSURE / 1e3, "Force [N]": FORCE}
    text = "Rig 4\nSample rate: 50 Hz\n\n" + table(columns, "\t")
    return FieldFile("r.txt", text.encode(), ALL)


def _german_thousands(value: float) -> str:
    return f"{value:,.2f}".replace(",", "_").replace(".", ",").replace("_", ".")


@kind
def thousands() -> FieldFile:
    rows = zip(1e3 * TIME, PRESSURE / 1e2, FORCE, strict=True)
    text = "Zeit [ms];Druck [mbar];Kraft [N]\n"
    text += "".join(";".join(map(_german_thousands, row)) + "\n" for row in rows)
    return FieldFile("s.csv", text.encode(), ALL)


@kind
def spanish() -> FieldFile:
    columns = {
        "Tiempo (s)": TIME,
        "Presión (bar)": PRESSURE / 1e5,
        "Fuerza (N)": FORCE,
        "Acortamiento (mm)": 200.0 * CONTRACTION,
    }
    truth = {**ALL, "shortening": 0.2 * CONTRACTION}
    return FieldFile("t.csv", table(columns, ";", ",").encode(), truth)


@kind
def french() -> FieldFile:
    columns = {
        "Temps (s)": TIME,
        "Pression relative (bar)": PRESSURE / 1e5,
        "Effort (N)": FORCE,
        "Taux de contraction (%)": 100 * CONTRACTION,
    }
    truth = {**ALL, "contraction": CONTRACTION}
    return FieldFile("u.csv", table(columns, ";", ",").encode("cp1252"), truth)


@kind
def italian() -> FieldFile:
    columns = {"Tempo [s]": TIME, "Pressione [kPa]": PRESSURE / 1e3, "Forza [N]": FORCE}
    return FieldFile("v.csv", table(columns, ";").encode(), ALL)


@kind
def japanese() -> FieldFile:
    columns = {
        "時間(s)": TIME,
        "圧力(kPa)": PRESSURE / 1e3,
        "張力(N)": FORCE,
        "収縮率(%)": 100 * CONTRACTION,
    }
    return FieldFile("w.csv", table(columns).encode(), {**ALL, "contraction": CONTRACTION})


@kind
def czech() -> FieldFile:
    columns = {
        "Čas [s]": TIME,
        "Tlak ve svalu [kPa]": PRESSURE / 1e3,
        "Síla [N]": FORCE,
        "Zkrácení [mm]": 200.0 * CONTRACTION,
    }
    truth = {**ALL, "shortening": 0.2 * CONTRACTION}
    return FieldFile("x.csv", table(columns, ";", ",").encode(), truth)


@kind
def slovak() -> FieldFile:
    columns = {
        "Čas (s)": TIME,
        "Pretlak (kPa)": PRESSURE / 1e3,
        "Ťahová sila (N)": FORCE,
        "Skrátenie (mm)": 200.0 * CONTRACTION,
    }
    truth = {**ALL, "shortening": 0.2 * CONTRACTION}
    return FieldFile("y.csv", table(columns, ";", ",").encode(), truth)


@kind
def rig_names_with_units() -> FieldFile:
    columns = {
        "timestamp": 1710238532.0 + TIME,
        "meas_pres_DF_kPa": PRESSURE / 1e3,
        "cmd_DF_kPa": PRESSURE / 1e3 + 1,
        "meas_pres_PF_kPa": PRESSURE / 2e3,
        "wrist_angle_deg": np.rad2deg(ANGLE),
    }
    truth = {"time": TIME, "DF.pressure": PRESSURE, "PF.pressure": PRESSURE / 2, "angle": ANGLE}
    return FieldFile("z.csv", table(columns).encode(), truth)


@kind
def rig_names() -> FieldFile:
    columns = {
        "timestamp": 1710238532.0 + TIME,
        "meas_pres_L": PRESSURE / 1e3,
        "cmd_L": PRESSURE / 1e3 + 1,
        "elbow_angle_deg": np.rad2deg(ANGLE),
    }
    answers = {"meas_pres_L": "kPa", "cmd_L": "kPa"}
    truth = {"time": TIME, "L.pressure": PRESSURE, "L.setpoint": PRESSURE + 1e3, "angle": ANGLE}
    return FieldFile("aa.csv", table(columns).encode(), truth, answers)


@kind
def with_index() -> FieldFile:
    columns = {
        "": np.arange(ROWS),
        "time_s": TIME,
        "muscle_pressure_kPa": PRESSURE / 1e3,
        "force_N": FORCE,
    }
    return FieldFile("ab.csv", table(columns).encode(), ALL)


@kind
def units_alone() -> FieldFile:
    columns = {"sec": TIME, "psi": PRESSURE / PSI, "kg": FORCE / GRAVITY}
    text = " | ".join(columns) + "\n" + lines(columns, " | ", digits=5)
    return FieldFile("ac.txt", text.encode(), ALL)


@kind
def units_alone_in_tabs() -> FieldFile:
    columns = {"psi": PRESSURE / PSI, "kg": FORCE / GRAVITY, "cm": 100 * LENGTH}
    truth = {"pressure": PRESSURE, "force": FORCE, "length": LENGTH}
    return FieldFile(
        "ad.txt", table(columns, "\t", digits=5).encode(), truth, {"cm": "length [cm]"}
    )


@kind
def text_in_xls() -> FieldFile:
    columns = {"Time [s]": TIME, "Pressure [mbar]": PRESSURE / 1e2, "Force [N]": FORCE}
    return FieldFile("ae.xls", table(columns, "\t").encode(), ALL)


@kind
def repeated_headings() -> FieldFile:
    columns = {"time [s]": TIME, "pressure [kPa]": PRESSURE / 1e3, "force [N]": FORCE}
    parts = [{name: values[i : i + 40] for name, values in columns.items()} for i in (0, 40, 80)]
    return FieldFile("af.csv", "".join(map(table, parts)).encode(), ALL)


@kind
def sweeps() -> FieldFile:
    columns = {"Time (s)": TIME, "Pressure (kPa)": PRESSURE / 1e3, "Force (N)": FORCE}
    return FieldFile("ag.csv", f"Run 1\n{table(columns)}\nRun 2\n{table(columns)}".encode(), ALL)


@kind
def clock() -> FieldFile:
    columns = {
        "Zeit": np.array([f"12:30:{t:06.3f}" for t in TIME]),
        "Pressure(MPa)": PRESSURE / 1e6,
        "Force(kgf)": FORCE / GRAVITY,
    }
    return FieldFile("ah.csv", table(columns, digits=6).encode(), ALL)


@kind
def outputs_and_inputs() -> FieldFile:
    data = {
        "t": TIME,
        "y": np.column_stack([ANGLE, 2 * ANGLE]),
        "u": np.column_stack([PRESSURE / 1e5, PRESSURE / 2e5]),
    }
    answers = {
        "t": "s",
        "y(:,1)": "angle [rad]",
        "y(:,2)": "",
        "u(:,1)": "setpoint [bar]",
        "u(:,2)": "",
    }
    truth = {"time": TIME, "angle": ANGLE, "setpoint": PRESSURE}
    return FieldFile("ai.mat", mat(val1=data), truth, answers)


@kind
def tensile_station() -> FieldFile:
    columns = {"a": TIME, "b": FORCE, "c": 200.0 - 1e3 * LENGTH, "d": PRESSURE / 1e6}
    text = (
        "MTS793|MPT|ENU|1|2|.|/|:|1|0|0|A\n\nData Acquisition\n"
        "Time\tAxial Force\tAxial Displacement\tInternal Pressure\nsec\tN\tmm\tMPa\n"
    )
    return FieldFile("aj.dat", (text + lines(columns, "\t", digits=6)).encode(), ALL)


@kind
def epoch_milliseconds() -> FieldFile:
    columns = {
        "epoch_ms": 1710238532000.0 + np.round(1e3 * TIME),
        "pressure_mbar": PRESSURE / 1e2,
        "force_mN": 1e3 * FORCE,
    }
    return FieldFile("ak.csv", table(columns).encode(), ALL)


@kind
def device_channels() -> FieldFile:
    columns = {
        "Time [s]": TIME,
        "Dev1/ai0 Pressure [bar]": PRESSURE / 1e5,
        "Dev1/ai1 Force [N]": FORCE,
    }
    return FieldFile("al.csv", table(columns, "\t").encode(), ALL)


@kind
def camel_case() -> FieldFile:
    columns = {"timeMs": 1e3 * TIME, "pressureKPa": PRESSURE / 1e3, "forceN": FORCE}
    return FieldFile("am.csv", table(columns).encode(), ALL)


@kind
def absolute_pressure() -> FieldFile:
    columns = {
        "elapsed_time[s]": TIME,
        "p_abs[kPa]": (PRESSURE + 101325.0) / 1e3,
        "F_axial[N]": FORCE,
        "L[mm]": 1e3 * LENGTH,
    }
    return FieldFile("an.csv", table(columns).encode(), {**ALL, "length": LENGTH})


DEVELOPMENT = KINDS[0::2]
HELD_BACK = KINDS[1::2]
