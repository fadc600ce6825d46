/** Explicit Runge-Kutta method of fixed step size; the last step of a segment is shortened. */
export class Solver extends Segment {
  constructor(c, t, x) {
    super();
    this.c = c;
    this.slopes = WEIGHTS.map(() => new Float64Array(states.length));
    this.xs = new Float64Array(states.length);
    this.yn = new Float64Array(states.length);
    this.us = new Float64Array(inputs.length);
    this.begin(t, x);
  }

  advance(t, y, h, yn) {
    const {xs, us, slopes} = this;
    for (let k = 0; k < WEIGHTS.length; k++) {
      this.inputsAt(t + NODES[k] * h, us);
      for (let i = 0; i < xs.length; i++) {
        let sum = 0;
        for (let j = 0; j < k; j++) sum += ROWS[k][j] * slopes[j][i];
        xs[i] = y[i] + h * sum;
      }
      rhs(xs, us, this.c, slopes[k]);
    }
    for (let i = 0; i < xs.length; i++) {
      let sum = 0;
      for (let k = 0; k < WEIGHTS.length; k++) sum += WEIGHTS[k] * slopes[k][i];
      yn[i] = y[i] + h * sum;
    }
  }

  /** One step, which meets the end of the segment exactly; returns a status. */
  step() {
    const total = Math.ceil((this.end - this.start) / this.h - 1e-6), last = this.done + 1 >= total;
    this.advance(this.t, this.x, last ? this.end - this.t : this.h, this.yn);
    this.xBefore.set(this.x);
    this.x.set(this.yn);
    if (!(this.x.reduce((sum, value) => sum + Math.abs(value), 0) < 1e300)) return status.notFinite;
    this.tBefore = this.t;
    this.t = last ? this.end : this.start + (this.done + 1) * this.h;
    this.done++;
    this.steps++;
    return status.done;
  }

  /** The state at a time within the last step, written into x. */
  stateAt(time, x) {
    if (time >= this.t - CLOSE || this.steps === 0) x.set(this.x);
    else this.advance(this.tBefore, this.xBefore, time - this.tBefore, x);
  }
}
