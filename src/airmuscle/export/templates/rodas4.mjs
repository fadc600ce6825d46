const {sqrt, abs, min, max} = Math;

/** Rodas4: Rosenbrock method of order four, adaptive. Hairer and Wanner (1996), section VI.4, method RODAS. */
export class Solver extends Segment {
  constructor(c, t, x) {
    super();
    this.c = c;
    this.rtol = RTOL;
    const n = states.length;
    for (const name of ["f0", "ft", "xs", "yn", "g", "k1", "k2", "k3", "k4", "k5", "k6", "d2", "d3"])
      this[name] = new Float64Array(n);
    this.J = new Float64Array(SIZES.jacobian);
    this.A = new Float64Array(SIZES.factors);
    this.us = new Float64Array(inputs.length);
    this.begin(t, x);
  }

  firstStep() {
    let size = 0, rate = 0;
    for (let i = 0; i < this.x.length; i++) {
      const scale = this.rtol * nominal[i] + this.rtol * abs(this.x[i]);
      size += (this.x[i] / scale) * (this.x[i] / scale);
      rate += (this.f0[i] / scale) * (this.f0[i] / scale);
    }
    const h = this.end - this.t;
    return rate > 0 ? min(h, 0.1 * sqrt(sqrt(this.rtol)) * sqrt((size + 1) / rate)) : h;
  }

  /** One attempt of size h: the new state in yn; returns the weighted norm of its error. */
  attempt(h) {
    const {c, f0, ft, xs, yn, g, k1, k2, k3, k4, k5, k6, d2, d3, J, A, us, x: y} = this;
    const n = y.length, r = 1 / h;
    factor(J, r / GAMMA, A);
    for (let i = 0; i < n; i++) g[i] = f0[i] + h * D1 * ft[i];
    solve(A, g, k1);
    this.inputsAt(this.t + N2 * h, us);
    for (let i = 0; i < n; i++) {
      xs[i] = y[i] + A21 * k1[i];
      g[i] = r * (C21 * k1[i]) + h * D2 * ft[i];
    }
    stage(xs, us, c, A, g, k2);
    this.inputsAt(this.t + N3 * h, us);
    for (let i = 0; i < n; i++) {
      xs[i] = y[i] + A31 * k1[i] + A32 * k2[i];
      g[i] = r * (C31 * k1[i] + C32 * k2[i]) + h * D3 * ft[i];
    }
    stage(xs, us, c, A, g, k3);
    this.inputsAt(this.t + N4 * h, us);
    for (let i = 0; i < n; i++) {
      xs[i] = y[i] + A41 * k1[i] + A42 * k2[i] + A43 * k3[i];
      g[i] = r * (C41 * k1[i] + C42 * k2[i] + C43 * k3[i]) + h * D4 * ft[i];
    }
    stage(xs, us, c, A, g, k4);
    this.inputsAt(this.t + h, us);
    for (let i = 0; i < n; i++) {
      xs[i] = y[i] + A51 * k1[i] + A52 * k2[i] + A53 * k3[i] + A54 * k4[i];
      g[i] = r * (C51 * k1[i] + C52 * k2[i] + C53 * k3[i] + C54 * k4[i]);
    }
    stage(xs, us, c, A, g, k5);
    for (let i = 0; i < n; i++) {
      xs[i] += k5[i];
      g[i] = r * (C61 * k1[i] + C62 * k2[i] + C63 * k3[i] + C64 * k4[i] + C65 * k5[i]);
    }
    stage(xs, us, c, A, g, k6);
    let error = 0;
    for (let i = 0; i < n; i++) {
      yn[i] = xs[i] + k6[i];
      const part = k6[i] / (this.rtol * nominal[i] + this.rtol * max(abs(y[i]), abs(yn[i])));
      error += part * part;
      d2[i] = H21 * k1[i] + H22 * k2[i] + H23 * k3[i] + H24 * k4[i] + H25 * k5[i];
      d3[i] = H31 * k1[i] + H32 * k2[i] + H33 * k3[i] + H34 * k4[i] + H35 * k5[i];
    }
    return sqrt(error / n) + 1e-16;
  }

  /** One step, which meets the end of the segment exactly; returns a status. */
  step() {
    this.inputsAt(this.t, this.us);
    jac(this.x, this.us, this.c, this.f0, this.J);
    this.ft.fill(0);
    if (this.moving) df_dt(this.x, this.us, this.c, this.w, this.ft);
    if (this.h <= 0) this.h = this.firstStep();
    let change, last, kept, rejected = false;
    for (;;) {
      last = this.t + 1.000001 * this.h >= this.end;
      kept = this.h;
      if (last) this.h = this.end - this.t;
      const error = this.attempt(this.h);
      if (!(error < 1e300)) change = 0.5;
      else {
        change = min(6, max(0.2, 0.9 / sqrt(sqrt(error))));
        if (error <= 1) break;
      }
      rejected = true;
      this.rejected++;
      this.h *= change;
      if (this.h < 1e-14 * max(abs(this.t), this.end - this.start))
        return error < 1e300 ? status.stepTooSmall : status.notFinite;
    }
    this.xBefore.set(this.x);
    this.x.set(this.yn);
    this.tBefore = this.t;
    this.hTaken = this.h;
    this.t = last ? this.end : this.t + this.h;
    this.steps++;
    this.h *= rejected ? min(change, 1) : change;
    if (last && this.h < kept) this.h = kept; // a step cut short by the end of a segment does not shorten the next
    return status.done;
  }

  /** The state at a time within the last step, written into x. */
  stateAt(time, x) {
    if (!(this.hTaken > 0) || time >= this.t) {
      x.set(this.x);
      return;
    }
    const q = (time - this.tBefore) / this.hTaken, p = 1 - q;
    for (let i = 0; i < x.length; i++)
      x[i] = this.xBefore[i] * p + q * (this.x[i] + p * (this.d2[i] + q * this.d3[i]));
  }
}
