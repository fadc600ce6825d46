@steps@
/** Solver: one step at a time within a segment. */
export class Solver extends Segment {
  constructor(c, t, x) {
    super();
    this.c = c;
    this.rtol = RTOL;
    this.d2 = new Float64Array(states.length);
    this.d3 = new Float64Array(states.length);
    this.work = {
      @single_step_work@
    };
    this.begin(t, x);
  }

  /** One step, which meets the end of the segment exactly; returns a status. */
  step() {
    const {work} = this;
    if (this.refusal !== status.done) return this.refusal;
    let result, reached, taken, following, rejections;
    @single_step@
    this.rejected += rejections;
    this.h = following;
    if (result !== status.done) return result;
    this.xBefore.set(this.x);
    this.x.set(work.yn);
    this.tBefore = this.t;
    this.t = reached;
    this.hTaken = taken;
    this.steps++;
    this.done++;
    return status.done;
  }

  /** The state at a time within the last step, written into `between`. */
  stateAt(time, between) {
    if (this.steps === 0 || time >= this.t - CLOSE) {
      between.set(this.x);
      return;
    }
    const {work} = this;
    @state_between@
  }
}
