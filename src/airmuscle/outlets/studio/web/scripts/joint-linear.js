/* Frequency response of a control loop: the plant linearised, held inputs, the control law linearised at its samples. */
"use strict";

(() => {
  const make = (rows, columns) => Array.from({ length: rows }, () => new Float64Array(columns));
  const multiply = (a, b) => a.map((row) => { const out = new Float64Array(b[0].length); row.forEach((v, k) => { if (v) for (let j = 0; j < out.length; j++) out[j] += v * b[k][j]; }); return out; });
  const table = (flat, rows, columns) => Array.from({ length: rows }, (_, i) => Float64Array.from({ length: columns }, (_, j) => flat[i * columns + j]));

  /* exp(M) by scaling and squaring of a Taylor series of degree 18 */
  function exponential(matrix) {
    const n = matrix.length, size = Math.max(...matrix.map((row) => row.reduce((s, v) => s + Math.abs(v), 0))), halvings = Math.max(0, Math.ceil(Math.log2(size / 0.5)) || 0);
    const scaled = matrix.map((row) => row.map((v) => v / 2 ** halvings));
    let sum = make(n, n), term = make(n, n);
    for (let i = 0; i < n; i++) sum[i][i] = term[i][i] = 1;
    for (let k = 1; k <= 18; k++) { term = multiply(term, scaled).map((row) => row.map((v) => v / k)); sum = sum.map((row, i) => row.map((v, j) => v + term[i][j])); }
    for (let k = 0; k < halvings; k++) sum = multiply(sum, sum);
    return sum;
  }

  /* Similarity transform by powers of two that makes rows and columns of similar size (Parlett and Reinsch 1969). */
  function balance(matrix) {
    const n = matrix.length, d = new Float64Array(n).fill(1), a = matrix.map((row) => Float64Array.from(row));
    for (let sweep = 0; sweep < 20; sweep++) {
      let changed = false;
      for (let i = 0; i < n; i++) {
        let row = 0, column = 0;
        for (let j = 0; j < n; j++) if (j !== i) { row += Math.abs(a[i][j]); column += Math.abs(a[j][i]); }
        if (!row || !column) continue;
        const f = 2 ** Math.round(0.5 * Math.log2(row / column));
        if (f === 1 || column * f + row / f >= 0.95 * (row + column)) continue;
        changed = true;
        d[i] *= f;
        for (let j = 0; j < n; j++) a[i][j] /= f;
        for (let j = 0; j < n; j++) a[j][i] *= f;
      }
      if (!changed) break;
    }
    return { a, d };
  }

  class JointLinear {
    /* statics: a JointStatics; the operating point has valves that are open a little, in the direction of a rising angle */
    constructor(statics) {
      this.statics = statics;
      this.run = statics.run;
      this.programs = airmusclePrograms[this.run.sheet.id].joint;
      this.held = new Float64Array(this.programs.linear.held + 1);
    }

    /* A, B, C of the plant at a state and inputs; rows of C are the measured columns of the sheet. */
    matrices(state, inputs) {
      const n = state.length, m = inputs.length, k = this.run.sheet.measured.length, f = new Float64Array(n);
      const A = new Float64Array(n * n), B = new Float64Array(n * m), C = new Float64Array(k * n);
      this.programs.linear.prepare(this.run.values, this.held);
      this.programs.linear.linear(state, inputs, this.held, f, A, B, C);
      return { rates: f, A: table(A, n, n), B: table(B, n, m), C: table(C, k, n) };
    }

    /* The operating point beside the working point. */
    operatingPoint(point) {
      const { sheet, program } = this.run, { state, inputs } = this.statics.rest(point.angle, point.first, point.second);
      for (const [name, offset] of Object.entries(sheet.offsets)) {
        const i = sheet.inputs.findIndex((input) => input.name === name), prefix = name.slice(0, name.lastIndexOf(".") + 1);
        inputs[i] += offset;
        program.states.forEach((name, at) => { if (name.startsWith(prefix) && /\.(spool|lagged_setpoint|delayed_setpoint\d)$/.test(name)) state[at] = inputs[i]; });
        for (const follower of ["pilot_position", "valve_position"]) { const at = program.states.indexOf(prefix + follower); if (at >= 0) { const { rates, A } = this.matrices(state, inputs); state[at] -= rates[at] / A[at][at]; } }
      }
      return { state, inputs };
    }

    /* Derivatives of commands and memory of a law where its commands are those of the operating point. */
    lawMatrices(law, point, operating, sampleTime) {
      const { row } = law, { sheet, program } = this.run, columns = sheet.measured, count = row.averaged_memory.length;
      program.outputsOf(operating.state, operating.inputs, this.run.held, this.run.o);
      const y = Float64Array.from(row.measured, (name) => { const i = program.states.indexOf(name); return i >= 0 ? operating.state[i] : this.run.o[program.outputs.indexOf(name)]; });
      const wanted = { angle: point.angle, angular_acceleration: 0, mean_pressure: 0.5 * (point.first + point.second), stiffness: point.stiffness, first_ahead: point.first, second_ahead: point.second };
      const r = Float64Array.from(row.setpoints, (name) => wanted[name]), m = Float64Array.from(row.averaged_start), at = row.averaged_memory.indexOf(row.balance), T = Float64Array.of(sampleTime);
      row.averaged_memory.forEach((name, i) => { if (/(^|\.)started$/.test(name)) m[i] = 1; });
      const f = new Float64Array(row.inputs.length + count), wide = y.length + count, D = new Float64Array(f.length * wide);
      const first = row.inputs.indexOf(Object.keys(sheet.offsets)[0]), target = operating.inputs[sheet.inputs.findIndex((input) => input.name === row.inputs[first])];
      const evaluate = (value) => { m[at] = value; law.averaged.slopes(y, r, m, T, law.low, law.high, law.averagedHeld, f, D); return f[first] - target; };
      let low = -1, high = 1;
      for (let k = 0; k < 60 && evaluate(low) > 0; k++) low *= 2;
      for (let k = 0; k < 60 && evaluate(high) < 0; k++) high *= 2;
      for (let k = 0; k < 200 && high - low > 1e-13 * Math.max(Math.abs(low), Math.abs(high)); k++) { const middle = 0.5 * (low + high); if (evaluate(middle) < 0) low = middle; else high = middle; }
      evaluate(0.5 * (low + high));
      return { table: table(D, f.length, wide), inputs: row.inputs.map((name) => sheet.inputs.findIndex((input) => input.name === name)), measured: row.measured.map((name) => columns.indexOf(name)), count };
    }

    /* The linearised plant in balanced coordinates; it is kept while working point and parameters remain. */
    plant(point) {
      const key = JSON.stringify([point.angle, point.first, point.second, Array.from(this.run.values)]);
      if (this.plantKey !== key) {
        const operating = this.operatingPoint(point), { A, B, C } = this.matrices(operating.state, operating.inputs);
        this.plantKey = key;
        this.kept = { operating, B, C, ...balance(A) };
        this.stepKey = "";
      }
      return this.kept;
    }

    /* exp([A B; 0 0] T) of the plant with held inputs */
    heldStep(a, d, B, inputs, sampleTime) {
      const key = `${inputs} ${sampleTime}`, n = a.length, block = make(n + inputs.length, n + inputs.length);
      if (this.stepKey === key) return this.step;
      for (let i = 0; i < n; i++) { for (let j = 0; j < n; j++) block[i][j] = a[i][j] * sampleTime; inputs.forEach((u, j) => { block[i][n + j] = B[i][u] / d[i] * sampleTime; }); }
      this.stepKey = key;
      return (this.step = exponential(block));
    }

    /* The open loop from the measured angle to the angle, negated, as matrices of a sampled system:
       z' = F z + G e, angle = H z, all other measurements fed back. */
    openLoop(law, point, sampleTime) {
      const { operating, a, d, B, C } = this.plant(point), k = this.lawMatrices(law, point, operating, sampleTime);
      const n = a.length, inputs = k.inputs.length, step = this.heldStep(a, d, B, k.inputs, sampleTime);
      const size = n + k.count, angle = k.measured.findIndex((at) => this.run.sheet.measured[at] === "angle");
      const F = make(size, size), G = new Float64Array(size), H = new Float64Array(size), rows = k.measured.map((at) => C[at].map((v, j) => v * d[j]));
      for (let j = 0; j < n; j++) H[j] = rows[angle][j];
      for (let i = 0; i < size; i++) {
        const gains = (of) => k.table[of];
        const contribution = (entry) => { let sum = 0; if (i < n) for (let u = 0; u < inputs; u++) sum += step[i][n + u] * entry(gains(u)); else sum = entry(gains(inputs + i - n)); return sum; };
        for (let j = 0; j < n; j++) F[i][j] = (i < n ? step[i][j] : 0) + contribution((row) => rows.reduce((s, c, at) => s + (at === angle ? 0 : row[at] * c[j]), 0));
        for (let j = 0; j < k.count; j++) F[i][n + j] = contribution((row) => row[rows.length + j]);
        G[i] = -contribution((row) => row[angle]);
      }
      return { F, G, H };
    }

    /* L(exp(j 2 pi f T)) at frequencies [Hz]: [[real, imaginary], ...] */
    response(loop, frequencies, sampleTime) { return frequencies.map((f) => transfer(loop, 2 * Math.PI * f * sampleTime)); }
  }

  /* H (z I - F)^-1 G with z = exp(j w), by complex elimination with pivoting */
  function transfer({ F, G, H }, w) {
    const n = G.length, zr = Math.cos(w), zi = Math.sin(w);
    const re = F.map((row, i) => Float64Array.from({ length: n + 1 }, (_, j) => (j === n ? G[i] : (i === j ? zr : 0) - row[j]))), im = F.map((_, i) => { const row = new Float64Array(n + 1); row[i] = zi; return row; });
    for (let k = 0; k < n; k++) {
      let p = k;
      for (let i = k + 1; i < n; i++) if (Math.hypot(re[i][k], im[i][k]) > Math.hypot(re[p][k], im[p][k])) p = i;
      [re[k], re[p]] = [re[p], re[k]]; [im[k], im[p]] = [im[p], im[k]];
      const a = re[k][k], b = im[k][k], square = a * a + b * b;
      for (let i = k + 1; i < n; i++) {
        const c = re[i][k], e = im[i][k];
        if (!c && !e) continue;
        const fr = (c * a + e * b) / square, fi = (e * a - c * b) / square;
        for (let j = k; j <= n; j++) { const x = re[k][j], y = im[k][j]; re[i][j] -= fr * x - fi * y; im[i][j] -= fr * y + fi * x; }
      }
    }
    const xr = new Float64Array(n), xi = new Float64Array(n);
    let outR = 0, outI = 0;
    for (let i = n - 1; i >= 0; i--) {
      let sr = re[i][n], si = im[i][n];
      for (let j = i + 1; j < n; j++) { sr -= re[i][j] * xr[j] - im[i][j] * xi[j]; si -= re[i][j] * xi[j] + im[i][j] * xr[j]; }
      const a = re[i][i], b = im[i][i], square = a * a + b * b;
      xr[i] = (sr * a + si * b) / square; xi[i] = (si * a - sr * b) / square;
      outR += H[i] * xr[i]; outI += H[i] * xi[i];
    }
    return [outR, outI];
  }

  /* Magnitude [dB], unwrapped phase [degree], and the smallest margins of an open loop. */
  function bode(frequencies, values) {
    const magnitude = values.map(([a, b]) => 20 * Math.log10(Math.hypot(a, b))), phase = [];
    values.forEach(([a, b], i) => { let p = Math.atan2(b, a) * 180 / Math.PI; if (!i) { if (p > 0) p -= 360; } else p += 360 * Math.round((phase[i - 1] - p) / 360); phase.push(p); });
    const crossings = (level, rows) => rows.flatMap((v, i) => (i && v !== rows[i - 1] && (rows[i - 1] - level) * (v - level) <= 0 ? [[i, (level - rows[i - 1]) / (v - rows[i - 1])]] : []));
    const at = (rows, [i, t]) => rows[i - 1] + t * (rows[i] - rows[i - 1]), frequencyAt = ([i, t]) => Math.exp(Math.log(frequencies[i - 1]) + t * Math.log(frequencies[i] / frequencies[i - 1]));
    const smallest = (found, margin) => found.sort((a, b) => margin(a) - margin(b))[0];
    const gain = smallest(crossings(0, magnitude), (c) => 180 + at(phase, c)), half = smallest(crossings(-180, phase), (c) => -at(magnitude, c));
    return {
      magnitude, phase,
      crossover: gain ? frequencyAt(gain) : NaN, phaseMargin: gain ? 180 + at(phase, gain) : NaN,
      phaseCrossover: half ? frequencyAt(half) : NaN, gainMargin: half ? -at(magnitude, half) : NaN,
    };
  }

  Object.assign(airmuscle, { JointLinear, bode });
})();
