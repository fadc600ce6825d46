/* Statics of a joint: pressures for an angle, a torque and a stiffness, the state at rest, and wanted motions. */
"use strict";

(() => {
  const ITERATIONS = 60, TOLERANCE = 1e-12;

  class JointStatics {
    constructor(run) {
      this.run = run;
      this.sheet = run.sheet;
      this.program = airmusclePrograms[run.sheet.id].joint.statics;
      this.x = new Float64Array(3);
      this.f = new Float64Array(run.sheet.pair.length);
      this.motion = new Float64Array(5);
      this.one = new Float64Array(1);
    }

    /* Quantities by name at an angle [rad] and two gauge pressures [Pa]. */
    at(angle, first, second) {
      this.x.set([angle, first, second]);
      this.program.pair(this.x, this.f);
      return Object.fromEntries(this.sheet.pair.map((name, i) => [name, this.f[i]]));
    }

    /* Torque [N m] that the muscles must give for a motion, with the torque of their dampers. */
    needed(angle, speed, acceleration, first, second) {
      this.motion.set([angle, speed, acceleration, first, second]);
      this.program.needed(this.motion, this.one);
      return this.one[0];
    }

    /* Pressures within the range for a torque and a stiffness, by Newton's method from a start; the torque has priority
       where the range is left. `exact` tells whether both are met. */
    pressures(angle, torque, stiffness, start = null) {
      const [low, high] = this.sheet.pressure_range, middle = 0.5 * (low + high), inside = (p) => Math.min(high, Math.max(low, p));
      let [a, b] = start ?? [middle, middle];
      for (let k = 0; k < ITERATIONS; k++) {
        const now = this.at(angle, a, b), q = torque - now.torque, s = stiffness - now.stiffness;
        const size = Math.abs(now.torque_by_first * high) + 1e-9, determinant = now.torque_by_first * now.stiffness_by_second - now.torque_by_second * now.stiffness_by_first;
        if (Math.abs(q) <= TOLERANCE * size && Math.abs(s) <= TOLERANCE * (Math.abs(stiffness) + size)) return { first: a, second: b, exact: true };
        if (!Number.isFinite(determinant) || determinant === 0) break;
        const da = (now.stiffness_by_second * q - now.torque_by_second * s) / determinant, db = (now.torque_by_first * s - now.stiffness_by_first * q) / determinant;
        const [na, nb] = [inside(a + da), inside(b + db)];
        if (Math.abs(na - a) + Math.abs(nb - b) < 1e-13 * high && na === a + da && nb === b + db) return { first: na, second: nb, exact: true };
        if (na === a && nb === b) break;
        [a, b] = [na, nb];
      }
      const met = this.at(angle, a, b);
      if (Math.abs(met.torque - torque) < 1e-9 * (Math.abs(torque) + 1) && Math.abs(met.stiffness - stiffness) < 1e-9 * (Math.abs(stiffness) + 1)) return { first: a, second: b, exact: true };
      for (let k = 0; k < ITERATIONS; k++) {   /* the torque alone, with both pressures in turn */
        let now = this.at(angle, a, b);
        if (Math.abs(now.torque - torque) < 1e-10 * (Math.abs(torque) + 1)) break;
        if (now.torque_by_first) a = inside(a + (torque - now.torque) / now.torque_by_first);
        now = this.at(angle, a, b);
        if (now.torque_by_second) b = inside(b + (torque - now.torque) / now.torque_by_second);
      }
      return { first: a, second: b, exact: false };
    }

    /* Limits of the stiffness at an angle, interpolated between those of the sheet; null outside the region. */
    limits(angle) {
      const { angle: grid, least, greatest } = this.sheet.region, last = grid.length - 1;
      if (!(angle >= grid[0] && angle <= grid[last])) return null;
      let i = Math.min(last - 1, Math.max(0, Math.floor((angle - grid[0]) / (grid[last] - grid[0]) * last)));
      while (i > 0 && grid[i] > angle) i--;
      while (i < last - 1 && grid[i + 1] < angle) i++;
      const t = (angle - grid[i]) / (grid[i + 1] - grid[i]), mix = (rows) => rows[i] + t * (rows[i + 1] - rows[i]);
      return [mix(least), mix(greatest)];
    }

    /* The nearest working point in the region: {angle, stiffness, first, second}. */
    workingPoint(angle, stiffness) {
      const { angle: grid } = this.sheet.region, at = Math.min(grid.at(-1), Math.max(grid[0], angle)), [least, greatest] = this.limits(at);
      const load = this.at(at, 0, 0).load, middle = 0.5 * (least + greatest), spare = 0.01 * (greatest - least);
      let wanted = Math.min(greatest - spare, Math.max(least + spare, stiffness));
      for (let k = 0; k < 40; k++, wanted = middle + 0.9 * (wanted - middle)) {
        const found = this.pressures(at, load, wanted);
        if (found.exact) return { angle: at, stiffness: wanted, first: found.first, second: found.second };
      }
      return { angle: at, stiffness: middle, ...this.pressures(at, load, middle) };
    }

    /* State of the plant at rest at an angle and two gauge pressures, valves in steady state; the inputs at rest. */
    rest(angle, first, second) {
      const { run, sheet } = this, { program } = run, wanted = [first, second], place = (name) => program.states.indexOf(name);
      const x = Float64Array.from(program.run.initial), u = new Float64Array(sheet.inputs.length), o = run.o, [coordinate] = sheet.mechanism.coordinates;
      x[place(coordinate)] = angle;
      x[place(coordinate) + 1] = 0;
      sheet.muscles.forEach(({ prefix }, k) => {
        if (sheet.regulated) {
          u[sheet.inputs.findIndex((input) => input.name === `${prefix}setpoint`)] = wanted[k];
          program.states.forEach((name, i) => { if (name.startsWith(prefix) && /\.(lagged_setpoint|delayed_setpoint\d|sensed_pressure)$/.test(name)) x[i] = wanted[k]; });
        }
        const mass = place(`${prefix}air_mass`), pressure = program.outputs.indexOf(`${prefix}pressure`), value = (m) => { airmuscle.setAir(run, x, prefix, m); program.outputsOf(x, u, run.held, o); return o[pressure] - wanted[k]; };
        let m = x[mass];
        for (let i = 0; i < ITERATIONS; i++) {   /* the pressure rises with the air mass */
          const h = 1e-6 * Math.max(m, 1e-6), error = value(m), slope = (value(m + h) - value(m - h)) / (2 * h), next = Math.max(1e-3 * m, m - error / slope);
          const done = Math.abs(next - m) <= 1e-15 * m;
          m = next;
          if (done) break;
        }
        airmuscle.setAir(run, x, prefix, m);
      });
      return { state: x, inputs: u };
    }
  }

  /* 10 s^3 - 15 s^4 + 6 s^5 and its derivatives by s, constant outside 0 to 1 */
  function fifthDegree(share) {
    const s = Math.min(1, Math.max(0, share));
    return [s ** 3 * (10 - 15 * s + 6 * s * s), 30 * s ** 2 * (1 - s) ** 2, 60 * s * (1 - s) * (1 - 2 * s)];
  }

  const MOTIONS = {
    StepMotion: ({ amplitude, begin }, t) => [t > begin - 1e-9 ? amplitude : 0, 0, 0],
    RampMotion: ({ amplitude, begin, rise_time: rise }, t) => {
      const share = (t - begin) / rise;
      return [amplitude * Math.min(1, Math.max(0, share)), share > 0 && share < 1 ? amplitude / rise : 0, 0];
    },
    SineMotion: ({ amplitude, frequency }, t) => {
      const w = 2 * Math.PI * frequency, [r, d1, d2] = fifthDegree(t * frequency), r1 = d1 * frequency, r2 = d2 * frequency ** 2, s = Math.sin(w * t), c = Math.cos(w * t);
      return [amplitude * r * s, amplitude * (r1 * s + w * r * c), amplitude * (r2 * s + 2 * w * r1 * c - w * w * r * s)];
    },
    MinimumJerkMotion: ({ amplitude, begin, rise_time: rise }, t) => fifthDegree((t - begin) / rise).map((v, i) => amplitude / rise ** i * v),
  };

  /* Angle, speed and acceleration of a motion at a time. */
  const motionAt = (motion, time) => MOTIONS[motion.kind](motion, time);

  /* Set points of a task at the instants, about a working point; `share` scales motion and disturbance. */
  function taskSignals(statics, task, point, share, times, options) {
    const signals = Object.fromEntries(["angle", "angular_acceleration", "mean_pressure", "stiffness", "first_ahead", "second_ahead"].map((name) => [name, new Float64Array(times.length)]));
    const stiffening = task.stiffening.map(([t, p]) => [t, share * p]);
    let before = [point.first, point.second], extra = null, stiffness = point.stiffness;
    times.forEach((time, k) => {
      const [q, v, a] = motionAt(task.motion, time).map((value) => share * value), angle = point.angle + q, added = valueAt(stiffening, time);
      if (added !== extra) { extra = added; stiffness = added ? statics.at(point.angle, point.first + added, point.second + added).stiffness : point.stiffness; }
      signals.angle[k] = angle;
      signals.angular_acceleration[k] = options.ahead ? a : 0;
      signals.mean_pressure[k] = 0.5 * (point.first + point.second) + added;
      signals.stiffness[k] = stiffness;
      if (!options.pressures) return;
      const found = statics.pressures(angle, statics.needed(angle, v, a, ...before), stiffness, before);
      before = [found.first, found.second];
      [signals.first_ahead[k], signals.second_ahead[k]] = before;
    });
    return signals;
  }

  function valueAt(points, time) {
    if (!points.length || time <= points[0][0]) return points.length ? points[0][1] : 0;
    for (let k = 1; k < points.length; k++) if (time <= points[k][0]) { const [[a, x], [b, y]] = [points[k - 1], points[k]]; return x + (time - a) / (b - a) * (y - x); }
    return points.at(-1)[1];
  }

  Object.assign(airmuscle, { JointStatics, motionAt, taskSignals });
})();
