@provenance@
@constants@
export const status = {done: 0, stepTooSmall: 2, notFinite: 3};

/* Printed functions. c holds what they need of the parameters; J the distinct non-zeros of df/dx, A the LU factors of
   d I - J, k the solution of (d I - J) k = f(x, u) + g. */
@functions@
/** Inputs linear in time: u from `start` on, with slopes w. */
class Segment {
  begin(t, x) {
    this.t = this.tBefore = this.start = this.end = t;
    this.x = Float64Array.from(x);
    this.xBefore = Float64Array.from(x);
    this.h = FIRST_STEP;
    this.hTaken = 0;
    this.steps = this.rejected = this.done = 0;
    this.u = new Float64Array(inputs.length);
    this.w = new Float64Array(inputs.length);
  }

  /** Inputs from now until `end`: u now, with slopes w. Set h = 0 where the inputs jump. */
  setSegment(end, u, w) {
    this.start = this.t;
    this.end = end;
    this.done = 0;
    this.u.set(u);
    this.w.set(w);
    this.moving = this.w.some((slope) => slope !== 0);
  }

  inputsAt(time, u) {
    for (let i = 0; i < u.length; i++) u[i] = this.u[i] + (time - this.start) * this.w[i];
  }
}

@solver@
@arguments@
@simulate@