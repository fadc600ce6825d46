/* Run of a plant in the page: the printed program with its solver, driven by a schedule or by hand. */
"use strict";

(() => {
  const MOST_ROWS = 200001, MOST_STEPS = 200000;

  class PlantRun {
    constructor(sheet) {
      this.sheet = sheet;
      this.program = airmusclePrograms[sheet.id];
      this.values = Float64Array.from(sheet.values);
      this.held = new Float64Array(this.program.SIZES.held + 1);
      this.names = ["time", ...sheet.columns.map((c) => c.name)];
      this.x = new Float64Array(this.program.states.length);
      this.o = new Float64Array(this.program.outputs.length);
      this.u = new Float64Array(sheet.inputs.length);
      this.prepare();
    }

    prepare() {
      this.program.prepare(this.values, this.held);
      this.started = null;
    }

    /* Initial state with the present parameters, and whether it was found. */
    get initial() { return (this.started ??= airmuscle.startState(this)); }

    get start() { return this.program.run.start; }

    /* Set a parameter with all its places. */
    set(row, value) {
      for (const place of row.places) this.values[place] = value;
      this.prepare();
    }

    empty() { return Object.fromEntries(this.names.map((name) => [name, []])); }

    /* Append a row to columns. */
    write(columns, time, x, u) {
      this.program.outputsOf(x, u, this.held, this.o);
      let i = 0;
      columns.time.push(time);
      for (const values of [x, u, this.o]) for (const value of values) columns[this.names[++i]].push(value);
    }

    /* The whole run through segments {ends, values, slopes}; status is "done" or the reason why it ended. */
    scheduled(segments, rowTime) {
      const solver = new this.program.Solver(this.held, this.start, this.initial.state), columns = this.empty();
      let row = 0, status = 0, taken = 0;
      const timeOf = (k) => this.start + k * rowTime, end = segments.ends.at(-1), last = Math.min(MOST_ROWS - 1, Math.round((end - this.start) / rowTime));
      const writeUpTo = (limit) => {
        for (; row <= last && timeOf(row) <= limit; row++) { solver.stateAt(timeOf(row), this.x); solver.inputsAt(timeOf(row), this.u); this.write(columns, timeOf(row), this.x, this.u); }
      };
      for (let k = 0; k < segments.ends.length && !status; k++) {
        solver.setSegment(segments.ends[k], segments.values[k], segments.slopes[k]);
        solver.h = 0;
        writeUpTo(solver.t);
        while (solver.t < segments.ends[k] && !status) {
          status = ++taken > MOST_STEPS ? 2 : solver.step();
          if (!status && solver.t < segments.ends[k]) writeUpTo(solver.t);
        }
        while (!status && row <= last && timeOf(row) < segments.ends[k]) writeUpTo(timeOf(row));
      }
      if (!status) writeUpTo(end + 1e-9);
      return { columns, status, steps: solver.steps, rejected: solver.rejected, time: solver.t, state: Array.from(solver.x) };
    }

    /* The whole run under the controller of the scenario, with the columns of the plant. */
    controlled(duration, rowTime) {
      const times = Array.from({ length: Math.min(MOST_ROWS, 1 + Math.round(duration / rowTime)) }, (_, k) => this.start + k * rowTime);
      const { columns, ...facts } = this.program.simulate({ parameters: Array.from(this.values), initial: Array.from(this.initial.state), times });
      const rows = [];  /* the run has rows at further instants, such as those of pulses */
      for (let i = 0; i < columns.time.length; i++) if (columns.time[i] > times[rows.length] - 1e-9) rows.push(i);
      return { ...facts, columns: Object.fromEntries(this.names.map((name) => [name, rows.map((i) => columns[name][i])])) };
    }

    /* A run that is driven by hand. */
    live() { return new LiveRun(this); }

    /* Segments of a schedule {input: [[time, value], ...]} up to a time. */
    segmentsOf(schedule, end) {
      const times = new Set([end]);
      for (const rows of Object.values(schedule)) for (const [time] of rows) if (time > this.start && time < end) times.add(time);
      const ends = [...times].sort((a, b) => a - b), starts = [this.start, ...ends.slice(0, -1)];
      const at = (rows, time) => { let value = 0; for (const [t, v] of rows ?? []) if (t <= time) value = v; return value; };
      const values = starts.map((time) => this.sheet.inputs.map(({ name }) => at(schedule[name], time)));
      return { ends, values, slopes: values.map((row) => row.map(() => 0)) };
    }
  }

  class LiveRun {
    constructor(run) {
      this.run = run;
      this.solver = new run.program.Solver(run.held, run.start, run.initial.state);
      this.inputs = new Float64Array(run.sheet.inputs.length);
      this.still = new Float64Array(this.inputs.length);
      this.columns = run.empty();
      this.schedule = Object.fromEntries(run.sheet.inputs.map(({ name }) => [name, []]));
      this.jump = true;
      run.write(this.columns, this.solver.t, this.solver.x, this.inputs);
    }

    get time() { return this.solver.t; }

    /* An input changes now. */
    drive(index, value) {
      if (this.inputs[index] === value) return;
      this.inputs[index] = value;
      this.jump = true;
      const rows = this.schedule[this.run.sheet.inputs[index].name];
      if (rows.length && rows.at(-1)[0] === this.time) rows.at(-1)[1] = value; else rows.push([this.time, value]);
    }

    /* Advance by a time [s] and write a row; returns a status, 0 if all is well. */
    advance(duration) {
      const { solver } = this, step = solver.h, end = solver.t + duration;
      solver.setSegment(end, this.inputs, this.still);
      solver.h = this.jump ? 0 : step;
      this.jump = false;
      for (let k = 0; solver.t < end; k++) { const status = k > MOST_STEPS ? 2 : solver.step(); if (status) return status; }
      this.run.write(this.columns, solver.t, solver.x, this.inputs);
      return 0;
    }
  }

  Object.assign(airmuscle, { PlantRun });
})();
