/* Start of a run with changed parameters: the same gauge pressures as at the original start and, if the file asks for an
   equilibrium, the coordinates at which the accelerations vanish. */
"use strict";

(() => {
  const ITERATIONS = 80, HALVINGS = 30, TOLERANCE = 1e-12;
  const KEPT = /(^|\.)(air_mass|internal_energy|bristle\w*|lagged_\w+|spool\w*)$/;

  /* run: a PlantRun; returns {state, settled}: the original state where no start is found */
  function startState(run) {
    const { sheet, program } = run, original = Float64Array.from(program.run.initial);
    if (run.values.every((v, i) => v === sheet.values[i])) return { state: original, settled: true };
    const problem = startProblem(run, original);
    const state = problem ? newton(problem, original) : null;
    return state ? { state, settled: true } : { state: original, settled: false };
  }

  /* Unknown states and residuals; null where a state depends on the parameters in another way. */
  function startProblem(run, original) {
    const { sheet, program } = run, coordinates = sheet.mechanism.coordinates, moving = new Set(coordinates.flatMap((name) => [name, speedOf(name, program.states)]));
    if (program.states.some((name) => !KEPT.test(name) && !moving.has(name))) return null;
    const place = (name) => program.states.indexOf(name), output = (name) => program.outputs.indexOf(name);
    const masses = sheet.muscles.map((m) => place(`${m.prefix}air_mass`)), pressures = sheet.muscles.map((m) => output(`${m.prefix}pressure`));
    const free = sheet.start_equilibrium ? coordinates : [], accelerations = free.map((name) => output(accelerationOf(name)));
    if ([...masses, ...pressures, ...accelerations].some((i) => i < 0)) return null;
    const u = Float64Array.from(program.run.segments.values[0] ?? []), o = new Float64Array(program.outputs.length), held = new Float64Array(run.held.length);
    program.prepare(Float64Array.from(sheet.values), held);
    program.outputsOf(original, u, held, o);
    const wanted = pressures.map((i) => o[i]);
    const residual = (x) => {
      sheet.muscles.forEach((m, k) => setAir(run, x, m.prefix, x[masses[k]]));
      program.outputsOf(x, u, run.held, o);
      return [...pressures.map((i, k) => (o[i] - wanted[k]) / 1e5), ...accelerations.map((i) => o[i])];
    };
    const unknown = [...masses, ...free.map(place)], sizes = unknown.map((i, k) => (k < masses.length ? Math.max(original[i], 1e-5) : 0.1));
    return { residual, unknown, sizes };
  }

  /* Sets the air mass of a muscle, and its internal energy at ambient temperature where this is a state. */
  function setAir({ sheet, program, values }, x, prefix, mass) {
    const place = program.states.indexOf(`${prefix}air_mass`), energy = program.states.indexOf(`${prefix}internal_energy`), { initial } = program.run, ambient = sheet.temperature_index;
    x[place] = mass;
    if (energy >= 0) x[energy] = mass * initial[energy] / initial[place] * values[ambient] / sheet.values[ambient];
  }

  const speedOf = (name, states) => states[states.indexOf(name) + 1];
  const accelerationOf = (name) => (name.endsWith("angle") ? name.replace(/angle$/, "angular_acceleration") : name.replace(/position$/, "acceleration"));
  const norm = (r) => Math.max(...r.map(Math.abs));

  function newton({ residual, unknown, sizes }, start) {
    let x = Float64Array.from(start), r = residual(x);
    for (let k = 0; k < ITERATIONS; k++) {
      if (!(norm(r) < Infinity)) return null;
      if (norm(r) < TOLERANCE) return x;
      const matrix = r.map(() => []);
      unknown.forEach((i, column) => {
        const h = 1e-6 * sizes[column], up = Float64Array.from(x), down = Float64Array.from(x);
        up[i] += h; down[i] -= h;
        const a = residual(up), b = residual(down);
        a.forEach((value, row) => { matrix[row][column] = (value - b[row]) / (2 * h); });
      });
      const step = solveLinear(matrix, r);
      if (!step) return null;
      let next = null, after = null, factor = 1;
      for (let j = 0; j < HALVINGS; j++, factor /= 2) {
        next = Float64Array.from(x);
        unknown.forEach((i, column) => { next[i] -= factor * step[column]; });
        after = residual(next);
        if (norm(after) < norm(r)) break;
        after = null;
      }
      if (!after) return norm(r) < 1e-8 ? x : null;   /* at the resolution of floating-point numbers */
      x = next; r = after;
    }
    return norm(r) < 1e-8 ? x : null;
  }

  /* Gaussian elimination with partial pivoting; null for a singular matrix. */
  function solveLinear(matrix, right) {
    const n = right.length, a = matrix.map((row, i) => [...row, right[i]]);
    for (let k = 0; k < n; k++) {
      let p = k;
      for (let i = k + 1; i < n; i++) if (Math.abs(a[i][k]) > Math.abs(a[p][k])) p = i;
      if (!(Math.abs(a[p][k]) > 0) || !Number.isFinite(a[p][k])) return null;
      [a[k], a[p]] = [a[p], a[k]];
      for (let i = k + 1; i < n; i++) { const f = a[i][k] / a[k][k]; for (let j = k; j <= n; j++) a[i][j] -= f * a[k][j]; }
    }
    const x = new Array(n);
    for (let i = n - 1; i >= 0; i--) { let sum = a[i][n]; for (let j = i + 1; j < n; j++) sum -= a[i][j] * x[j]; x[i] = sum / a[i][i]; }
    return x;
  }

  Object.assign(airmuscle, { startState, setAir });
})();
