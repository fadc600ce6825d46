/* Control loop in the page: measure, command, hold, integrate, by the printed plant and the printed control law. */
"use strict";

(() => {
  const CLOSE = 1e-9, MOST_STEPS = 200000;

  /* A control law of a sheet with its present gains. */
  class PrintedLaw {
    constructor(sheet, row) {
      this.row = row;
      this.program = airmusclePrograms[sheet.id].joint[row.key];
      this.averaged = airmusclePrograms[sheet.id].joint[`${row.key}-averaged`] ?? this.program;
      this.values = Float64Array.from(row.values);
      const range = (name, key, other) => sheet.inputs.find((input) => input.name === name)[key] ?? other;
      this.low = Float64Array.from(row.inputs, (name) => range(name, "minimum", -Infinity));
      this.high = Float64Array.from(row.inputs, (name) => range(name, "maximum", Infinity));
      this.held = new Float64Array(this.program.held + 1);
      this.averagedHeld = new Float64Array(this.averaged.held + 1);
      this.prepare();
    }

    /* To be called after every change of `values`. */
    prepare() {
      this.program.prepare(this.values, this.held);
      this.averaged.prepare(this.averagedValues, this.averagedHeld);
    }

    get averagedValues() { return Float64Array.from(this.row.averaged_paths, (path) => this.values[this.row.paths.indexOf(this.row.prefix + path)]); }

    get(path) { return this.values[this.row.paths.indexOf(path)]; }

    set(path, value) { this.values[this.row.paths.indexOf(path)] = value; this.prepare(); }
  }

  /* Sampling instants between two times, both included. */
  function instants(start, end, sampleTime) {
    const edges = [start];
    for (let k = 1; start + sampleTime * k < end - CLOSE * sampleTime; k++) edges.push(start + sampleTime * k);
    edges.push(end);
    return edges;
  }

  /* Points [[time, value], ...] with times that are close to an instant moved to it. */
  function snapped(points, sampleTime) {
    return points.map(([time, value]) => { const k = Math.round(time / sampleTime); return [Math.abs(time - k * sampleTime) <= CLOSE * sampleTime ? k * sampleTime : time, value]; });
  }

  /* Points [[time, value], ...] of one of the inputs as segments of all inputs, constant outside the points. */
  function segmentsOf(points, at, inputs) {
    const ends = [...points.map(([time]) => time), Infinity], of = (value) => { const row = new Float64Array(inputs); if (at >= 0) row[at] = value; return row; };
    const values = ends.map((_, k) => of(points[Math.max(k - 1, 0)]?.[1] ?? 0));
    const slopes = ends.map((_, k) => of(k > 0 && k < points.length ? (points[k][1] - points[k - 1][1]) / (points[k][0] - points[k - 1][0]) : 0));
    return { ends, values, slopes };
  }

  /* run: a PlantRun; law: a PrintedLaw; task: {duration, sampleTime, state, setpoints: {name: values at the instants},
     torque: [[time, value], ...], torqueInput}. Returns {columns, status, time, steps}; rows are the instants. */
  function runLoop(run, law, task) {
    const { program, sheet } = run, { row } = law, { sampleTime, duration, setpoints } = task;
    const edges = instants(0, duration, sampleTime), torqueAt = sheet.inputs.findIndex((input) => input.name === task.torqueInput);
    const others = segmentsOf(snapped(task.torque ?? [], sampleTime), torqueAt, sheet.inputs.length), { cut_segments } = program.joint.inputs;
    const solver = new program.Solver(run.held, 0, task.state), n = program.states.length, columns = run.empty();
    for (const name of row.setpoints) columns[`setpoint.${name}`] = [];
    const commanded = row.inputs.map((name) => sheet.inputs.findIndex((input) => input.name === name));
    const measured = row.measured.map((name) => { const i = program.states.indexOf(name); return i >= 0 ? i : n + program.outputs.indexOf(name); });
    let memory = Float64Array.from(row.initial_memory), later = new Float64Array(memory.length), status = 0, taken = 0, piece = 0, pieces = 0;
    const y = new Float64Array(measured.length), r = new Float64Array(row.setpoints.length), T = Float64Array.of(sampleTime), command = new Float64Array(commanded.length);
    const u = Float64Array.from(others.values[0]), w = new Float64Array(u.length), signals = sheet.inputs.map(() => [[], [], []]), needsOutputs = measured.some((i) => i >= n);
    for (let k = 0; k < edges.length - 1 && !status; k++) {
      const begin = edges[k], end = edges[k + 1];
      if (needsOutputs) program.outputsOf(solver.x, u, run.held, run.o);
      measured.forEach((at, i) => { y[i] = at < n ? solver.x[at] : run.o[at - n]; });
      row.setpoints.forEach((name, i) => { r[i] = setpoints[name][k]; columns[`setpoint.${name}`].push(r[i]); });
      law.program.sample(y, r, memory, T, law.low, law.high, law.held, command, later);
      [memory, later] = [later, memory];
      for (let i = 0; i < command.length; i++) command[i] = Math.min(law.high[i], Math.max(law.low[i], command[i]));
      if (command.some((value) => !Number.isFinite(value))) { status = 3; break; }
      [piece, pieces] = cut_segments(others.ends, others.values, others.slopes, others.ends.length - 1, 0, piece, begin, end, command, commanded, signals);
      for (let part = 0; part < pieces && !status; part++) {
        signals.forEach(([, values, slopes], i) => { u[i] = values[part]; w[i] = slopes[part]; });
        if (!part) run.write(columns, begin, solver.x, u);
        solver.setSegment(signals[0][0][part], u, w);
        solver.h = 0;
        for (let count = 0; solver.t < solver.end && !status; count++) { status = count > MOST_STEPS ? 2 : solver.step(); taken++; }
      }
      solver.inputsAt(end, u);
    }
    if (!status) { run.write(columns, edges.at(-1), solver.x, u); for (const name of row.setpoints) columns[`setpoint.${name}`].push(setpoints[name][edges.length - 2]); }
    return { columns, status, time: solver.t, steps: taken };
  }

  Object.assign(airmuscle, { PrintedLaw, runLoop, loopInstants: instants });
})();
