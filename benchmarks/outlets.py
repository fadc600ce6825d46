"""Exported programs: time of a step in an FMU and in MuJoCo, of a run in C and JavaScript, and
sizes of the code.

Needs gcc; node, ziglang and mujoco where their rows are measured. Kernel and C are timed in turn in
one process, the other rows are processor times of a process of their own.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
import time
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from filling import DURATION, Run, runs
from measure import Section, Target, format_time, print_section, time_variants

import airmuscle as am
from airmuscle.core.errors import ParameterError
from airmuscle.engine.compile.program import compile_system
from airmuscle.outlets.export.compiler import find_cross_compiler
from airmuscle.outlets.export.mujoco_plugin import check_mujoco

STEPS = 1000
TEXT = (
    f"The runs of {DURATION:g} s with Rodas4(1e-6), with three, six, eight and ten states. `DoStep`"
    " of 1 ms is called from C, an input being set and an output read in each, with a jump of the"
    " input every 50 steps. C is the integration of the same steps without output, timed in turn"
    " with the kernel of the library, which is called from Python, in one process; their ratio is"
    " the median over the rounds, all times are the least. WebAssembly is the same C, compiled by"
    " zig and run in Node; JavaScript writes the last row only. The step in MuJoCo is RK4 of 1 ms"
    " of a mass: with the muscle, less that without."
)
HEADER = ("program", "time", "relative to the kernel", "machine code")
DO_STEP = """
#include <stdio.h>
#include <stdarg.h>
#include <time.h>
#include "fmi2Functions.h"
static void log_message(fmi2ComponentEnvironment e, fmi2String n, fmi2Status s, fmi2String c, fmi2String m, ...)
{ (void)e, (void)n, (void)s, (void)c, (void)m; }
int main(void)
{
  fmi2CallbackFunctions f = {log_message, 0, 0, 0, 0};
  fmi2Component c = fmi2Instantiate("a", fmi2CoSimulation, "TOKEN", "", &f, 0, 0);
  const fmi2ValueReference input = INPUT, output = OUTPUT;
  double best = 1e9, t = 0.0;
  int round, k;
  if (!c || fmi2SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0)) return 1;
  for (round = 0; round < 9; round++) {
    const clock_t start = clock();
    for (k = 0; k < 1000; k++) {
      double u = 0.3 + 0.2 * ((k / 50) % 2), o;
      if (fmi2SetReal(c, &input, 1, &u) || fmi2DoStep(c, t, 1e-3, 1) > fmi2Warning) return 2;
      fmi2GetReal(c, &output, 1, &o);
      t += 1e-3;
    }
    if ((double)(clock() - start) / CLOCKS_PER_SEC < best) best = (double)(clock() - start) / CLOCKS_PER_SEC;
  }
  printf("%.9g", best / 1000.0);
  return 0;
}
"""  # noqa: E501
RUNS = """
#define main exported_main
#include "main.c"
#undef main
void integrate(int count)
{
  double c[PLANT_PRECOMPUTED + 1];
  plant_solver s;
  int k, segment, status = PLANT_DONE;
  (void)run, (void)exported_main;
  plant_prepare(plant_defaults, c);
  for (k = 0; k < count; k++) {
    plant_begin(&s, start, initial);
    for (segment = 0; segment < SEGMENTS; segment++) {
      plant_set_segment(&s, ends[segment], values[segment], slopes[segment]);
      s.h = PLANT_FIRST_STEP;
      while (s.t < ends[segment] && status == PLANT_DONE) status = plant_step(&s, c);
    }
  }
}
"""
"""The integration alone, as the kernel makes it: no row is written."""
WASM_OPTIONS = (
    "-target",
    "wasm32-wasi",
    "-mexec-model=reactor",
    "-std=c99",
    "-O2",
    "-ffp-contract=off",
    "-s",
)
LAST_ROW = """
import {simulate} from "./plant.mjs";
const integrate = count => { for (let k = 0; k < count; k++) simulate(); };
"""
IN_WASM = """
import {readFileSync} from "fs";
const {instance: {exports: {integrate}}} = await WebAssembly.instantiate(readFileSync("plant.wasm"));
"""  # noqa: E501
SCRIPT = """
let best = 1e9;
for (let round = 0; round < 9; round++) {
  const start = process.cpuUsage();
  integrate(20);
  const used = process.cpuUsage(start);
  best = Math.min(best, (used.user + used.system) / 1e6 / 20);
}
console.log(best);
"""


def built(folder: Path, *sources: str) -> float:
    """The number that a C program prints."""
    command = ["gcc", "-std=c99", "-O2", "-ffp-contract=off", *sources, "-o", "program", "-lm"]
    subprocess.run(command, cwd=folder, check=True)
    return float(
        subprocess.run(["./program"], cwd=folder, check=True, capture_output=True, text=True).stdout
    )


def problem_of(case: Run) -> am.Problem:
    """The run with a row at its end only."""
    return am.Problem(
        case.system,
        case.command,
        DURATION,
        case.initial_state,
        integrator=am.Rodas4(1e-6),
        output_times=(DURATION,),
    )


def processor_time(call: Callable[[], object], count: int = 20) -> float:
    """The least processor time of one call [s]."""
    call()
    times = []
    for _ in range(9):
        start = time.process_time()
        for _ in range(count):
            call()
        times.append((time.process_time() - start) / count)
    return min(times)


def do_step(case: Run, folder: Path) -> float:
    """Processor time of a DoStep of 1 ms [s]."""
    path = am.outlets.write_fmu(
        problem_of(case), folder / "a.fmu", fmi=2, name="plant", binary=False
    ).path
    with zipfile.ZipFile(path) as archive:
        archive.extractall(folder / "fmu")
    text = (folder / "fmu" / "modelDescription.xml").read_text()
    n = len(case.system.states)
    values = {"TOKEN": text.split('guid="')[1].split('"')[0], "INPUT": str(1 + 2 * n)}
    values["OUTPUT"] = str(1 + 2 * n + len(case.system.inputs))
    program = DO_STEP
    for name, value in values.items():
        program = program.replace(name, value)
    (folder / "fmu" / "sources" / "driver.c").write_text(program)
    return built(folder / "fmu" / "sources", "driver.c", "fmi2.c", "plant.c")


def code_size(folder: Path, source: str) -> str:
    """Bytes of machine code and constants with optimisation for size."""
    if shutil.which("size") is None:
        return "-"
    subprocess.run(["gcc", "-std=c99", "-Os", "-c", source, "-o", "size.o"], cwd=folder, check=True)
    text = subprocess.run(
        ["size", "size.o"], cwd=folder, check=True, capture_output=True, text=True
    ).stdout
    return f"{int(text.split()[6]) / 1e3:.1f} kB"


def in_node(folder: Path, script: str) -> float:
    """The number that a JavaScript module prints."""
    (folder / "driver.mjs").write_text(script)
    done = subprocess.run(
        ["node", "driver.mjs"], cwd=folder, check=True, capture_output=True, text=True
    )
    return float(done.stdout)


def in_webassembly(folder: Path) -> float | None:
    """Processor time of a run of the C sources in WebAssembly [s]; None without the cross
    compiler.
    """
    try:
        compiler = find_cross_compiler()
    except ParameterError:
        return None
    files = ["driver.c", "plant.c", "-o", "plant.wasm", "-Wl,--export=integrate", "-lm"]
    subprocess.run([*compiler, *WASM_OPTIONS, *files], cwd=folder, check=True, capture_output=True)
    return in_node(folder, IN_WASM + SCRIPT)


def in_c(folder: Path) -> Callable[[], object]:
    """A run of the C sources, which a shared library makes in this process."""
    options = ["-std=c99", "-O2", "-ffp-contract=off", "-fPIC", "-shared"]
    subprocess.run(
        ["gcc", *options, "driver.c", "plant.c", "-o", "plant.so", "-lm"], cwd=folder, check=True
    )
    function = ctypes.CDLL(str(folder / "plant.so")).integrate
    return lambda: function(1)


def rows_of(case: Run, folder: Path, rounds: int) -> tuple[list[tuple[str, ...]], list[Target]]:
    """The rows of one plant."""
    name = f"{len(case.system.states)} states"
    problem = problem_of(case)
    bound = am.Rodas4(1e-6).bind(compile_system(case.system))
    end = np.array([DURATION])
    state = case.vector
    am.outlets.write_program(problem, folder / "c", am.outlets.C99(), name="plant")
    (folder / "c" / "driver.c").write_text(RUNS)
    times = time_variants(
        {"kernel": lambda: bound.run(case.segments, 0.0, state, end), "C": in_c(folder / "c")},
        5 * rounds,
    )
    kernel = times["kernel"].minimum
    ratio = times["C"].ratio_to(times["kernel"])
    rows = [(f"{name}: kernel", format_time(kernel), "1", "")]
    size = code_size(folder / "c", "plant.c")
    rows.append((f"{name}: C", format_time(times["C"].minimum), f"{ratio:.2f}", size))
    if shutil.which("node"):
        am.outlets.write_program(problem, folder / "js", am.outlets.JavaScript(), name="plant")
        others = {
            "JavaScript": in_node(folder / "js", LAST_ROW + SCRIPT),
            "WebAssembly": in_webassembly(folder / "c"),
        }
        rows += [
            (f"{name}: {k}", format_time(v), f"{v / kernel:.2f}", "")
            for k, v in others.items()
            if v is not None
        ]
    step = do_step(case, folder)
    rows.append((f"{name}: FMU, DoStep of 1 ms", format_time(step), "", ""))
    targets = [Target(f"C against the kernel, {name}", ratio, 1.15, "")]
    if len(case.system.states) == 8:
        targets.append(Target("DoStep of 1 ms, 8 states", step * 1e6, 3.0, "us"))
    return rows, targets


def in_mujoco(case: Run, folder: Path) -> float:
    """Processor time of a step in MuJoCo that a muscle adds [s]."""
    mujoco = check_mujoco()
    muscle = am.outlets.write_mujoco_plugin(case.system, folder / "plugin", name="plant")
    times = []
    for with_muscle in (True, False):
        spec = mujoco.MjSpec()
        spec.option.timestep = 1e-3
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
        body = spec.worldbody.add_body(name="load")
        body.add_joint(name="z", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, 0, 1], damping=1e3)
        body.add_geom(size=[0.05, 0, 0], mass=5.0)
        if with_muscle:
            muscle.add_to(spec, name="muscle", joint="z", gear=-1.0, rest_length=0.0)
        model = spec.compile()
        data = mujoco.MjData(model)
        if with_muscle:
            muscle.initialise(model, data, "muscle", pressure=1e5)
        times.append(
            processor_time(lambda m=model, d=data: mujoco.mj_step(m, d, nstep=STEPS), 1) / STEPS
        )
    return times[0] - times[1]


def section(rounds: int = 5) -> Section:
    """The complete benchmark."""
    rows: list[tuple[str, ...]] = []
    targets: list[Target] = []
    for case in runs().values():
        with tempfile.TemporaryDirectory() as folder:
            more, reached = rows_of(case, Path(folder), rounds)
            rows = rows + more
            targets = targets + reached
    try:
        with tempfile.TemporaryDirectory() as folder:
            step = in_mujoco(runs()[3], Path(folder))
        rows.append(("a muscle in MuJoCo, RK4 step of 1 ms", format_time(step), "", ""))
        targets.append(Target("a muscle in a step of MuJoCo", step * 1e6, 3.0, "us"))
    except Exception as reason:  # without MuJoCo the other rows remain
        rows.append(("a muscle in MuJoCo", f"not measured: {reason}", "", ""))
    return Section("Exported programs", TEXT, HEADER, tuple(rows), tuple(targets))


if __name__ == "__main__":
    print_section(section())
