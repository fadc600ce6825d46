"""Exported programs: time of a step in an FMU and in MuJoCo, of a run in C and JavaScript, and sizes of the code.

Needs gcc; node and mujoco where their rows are measured. Times are processor times of one process each.
"""

from __future__ import annotations

import shutil
import subprocess
import tempfile
import time
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from filling import DURATION, Run, runs
from measure import Section, Target, format_time, print_section

from airmuscle.compile.program import compile_system
from airmuscle.export import C99, JavaScript, write_fmu, write_mujoco_plugin, write_program
from airmuscle.export.mujoco_plugin import check_mujoco
from airmuscle.simulation import Problem, Rodas4

STEPS = 1000
TEXT = (
    f"The runs of {DURATION:g} s with Rodas4(1e-6), with three, six, eight and ten states. `DoStep` of 1 ms is called "
    "from C, an input being set and an output read in each, with a jump of the input every 50 steps. A run in C or "
    "JavaScript writes no rows but the last and is compared with the kernel of the library. The step in MuJoCo is RK4 "
    "of 1 ms of a mass: with the muscle, less that without."
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
"""
RUNS = """
#define main exported_main
#include "main.c"
#undef main
#include <time.h>
int main(void)
{
  FILE *nowhere = fopen("/dev/null", "w");
  double best = 1e9;
  int round, k;
  for (round = 0; round < 9; round++) {
    const clock_t start = clock();
    for (k = 0; k < 20; k++)
      if (run(nowhere)) return 1;
    if ((double)(clock() - start) / CLOCKS_PER_SEC < best) best = (double)(clock() - start) / CLOCKS_PER_SEC;
  }
  printf("%.9g", best / 20.0);
  return 0;
}
"""
SCRIPT = """
import {simulate} from "./plant.mjs";
let best = 1e9;
for (let round = 0; round < 9; round++) {
  const start = process.cpuUsage();
  for (let k = 0; k < 20; k++) simulate();
  const used = process.cpuUsage(start);
  best = Math.min(best, (used.user + used.system) / 1e6 / 20);
}
console.log(best);
"""


def built(folder: Path, *sources: str) -> float:
    """The number that a C program prints."""
    command = ["gcc", "-std=c99", "-O2", "-ffp-contract=off", *sources, "-o", "program", "-lm"]
    subprocess.run(command, cwd=folder, check=True)
    return float(subprocess.run(["./program"], cwd=folder, check=True, capture_output=True, text=True).stdout)


def problem_of(case: Run) -> Problem:
    """The run with a row at its end only."""
    return Problem(
        case.system, case.command, DURATION, case.initial_state, integrator=Rodas4(1e-6), output_times=(DURATION,)
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
    path = write_fmu(problem_of(case), folder / "a.fmu", fmi=2, name="plant", binary=False).path
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
    text = subprocess.run(["size", "size.o"], cwd=folder, check=True, capture_output=True, text=True).stdout
    return f"{int(text.split()[6]) / 1e3:.1f} kB"


def rows_of(case: Run, folder: Path) -> tuple[list[tuple[str, ...]], list[Target]]:
    """The rows of one plant."""
    name, problem = f"{len(case.system.states)} states", problem_of(case)
    ready, method = compile_system(case.system), Rodas4(1e-6)
    end, state = np.array([DURATION]), case.vector
    kernel = processor_time(lambda: method.run(ready, case.segments, 0.0, state, end))
    rows = [(f"{name}: kernel", format_time(kernel), "1", "")]
    write_program(problem, folder / "c", C99(), name="plant")
    (folder / "c" / "driver.c").write_text(RUNS)
    in_c = built(folder / "c", "driver.c", "plant.c")
    rows.append((f"{name}: C", format_time(in_c), f"{in_c / kernel:.2f}", code_size(folder / "c", "plant.c")))
    if shutil.which("node"):
        write_program(problem, folder / "js", JavaScript(), name="plant")
        (folder / "js" / "driver.mjs").write_text(SCRIPT)
        done = subprocess.run(["node", "driver.mjs"], cwd=folder / "js", check=True, capture_output=True, text=True)
        in_js = float(done.stdout)
        rows.append((f"{name}: JavaScript", format_time(in_js), f"{in_js / kernel:.2f}", ""))
    step = do_step(case, folder)
    rows.append((f"{name}: FMU, DoStep of 1 ms", format_time(step), "", ""))
    targets = [Target(f"C against the kernel, {name}", in_c / kernel, 1.15, "")]
    if len(case.system.states) == 8:
        targets.append(Target("DoStep of 1 ms, 8 states", step * 1e6, 3.0, "us"))
    return rows, targets


def in_mujoco(case: Run, folder: Path) -> float:
    """Processor time of a step in MuJoCo that a muscle adds [s]."""
    mujoco = check_mujoco()
    muscle = write_mujoco_plugin(case.system, folder / "plugin", name="plant")
    times = []
    for with_muscle in (True, False):
        spec = mujoco.MjSpec()
        spec.option.timestep, spec.option.integrator = 1e-3, mujoco.mjtIntegrator.mjINT_RK4
        body = spec.worldbody.add_body(name="load")
        body.add_joint(name="z", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, 0, 1], damping=1e3)
        body.add_geom(size=[0.05, 0, 0], mass=5.0)
        if with_muscle:
            muscle.add_to(spec, name="muscle", joint="z", gear=-1.0, rest_length=0.0)
        model = spec.compile()
        data = mujoco.MjData(model)
        if with_muscle:
            muscle.initialise(model, data, "muscle", pressure=1e5)
        times.append(processor_time(lambda m=model, d=data: mujoco.mj_step(m, d, nstep=STEPS), 1) / STEPS)
    return times[0] - times[1]


def section(rounds: int = 1) -> Section:
    """The complete benchmark."""
    rows: list[tuple[str, ...]] = []
    targets: list[Target] = []
    for case in runs().values():
        with tempfile.TemporaryDirectory() as folder:
            more, reached = rows_of(case, Path(folder))
            rows, targets = rows + more, targets + reached
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
