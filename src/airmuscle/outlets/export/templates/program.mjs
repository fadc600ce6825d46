@provenance@
@constants@
export const status = {done: 0, stepTooSmall: 2, notFinite: 3, outOfRange: 5};

/* Printed functions. c holds what they need of the parameters; J the distinct non-zeros of df/dx, A the LU factors of
   d I - J, k the solution of (d I - J) k = f(x, u) + g. */
@functions@
/** Why an input cannot go from `first` to `last`: a status. Rounding of a ramp may pass the limit by 1e-9 of its size. */
function inputRefusal(i, first, last) {
  const slack = 1e-9 * Math.max(Math.abs(first), Math.abs(last));
  if (!Number.isFinite(first) || !Number.isFinite(last)) return status.notFinite;
  const isInside = Math.min(first, last) >= inputMinimum[i] - slack && Math.max(first, last) <= inputMaximum[i] + slack;
  return isInside ? status.done : status.outOfRange;
}

/** Inputs linear in time: u from `start` on, with slopes w. */
class Segment {
  begin(t, x) {
    this.t = this.tBefore = this.start = this.end = t;
    this.x = Float64Array.from(x);
    this.xBefore = Float64Array.from(x);
    this.h = FIRST_STEP;
    this.hTaken = 0;
    this.steps = this.rejected = this.done = 0;
    this.refusal = status.done;
    this.u = new Float64Array(inputs.length);
    this.w = new Float64Array(inputs.length);
  }

  /**
   * Inputs from now until `end`: u now, with slopes w. Set h = 0 where the inputs jump. Where one is not finite, or
   * beyond its range now or at the end, every step until then does nothing, and returns why.
   */
  setSegment(end, u, w) {
    this.start = this.t;
    this.end = end;
    this.done = 0;
    this.u.set(u);
    this.w.set(w);
    this.moving = this.w.some((slope) => slope !== 0);
    this.refusal = status.done;
    for (let i = 0; i < inputs.length && this.refusal === status.done; i++)
      this.refusal = inputRefusal(i, u[i], w[i] === 0 ? u[i] : u[i] + (end - this.t) * w[i]);
  }

  inputsAt(time, u) {
    for (let i = 0; i < u.length; i++) u[i] = this.u[i] + (time - this.start) * this.w[i];
  }
}

@solver@
@arguments@
@simulate@