@kernels@
/**
 * Run of the control loop. Every argument is optional: by default the exported run. `controllerParameters` are those of
 * the control law, `setpoint` {ends, values, slopes} its set points, `segments` the inputs that it does not command.
 * Parameters and `initial` are arrays, or objects of some values by name. Throws RangeError for unknown names, wrong
 * lengths and numbers that are not finite. Returns {columns: {time, ...}, status, time, steps, rejected, samples}.
 */
export function simulate(changes = {}) {
  const usual = {parameters: defaults, controllerParameters: loop.parameterDefaults, setpoint: loop.setpoint, ...run};
  checkKeys("simulate", changes, Object.keys(usual));
  const given = {...usual, ...changes}, {setpoint, start, segments, times} = given;
  const numbers = valuesOf("parameters", given.parameters, parameters, defaults);
  checkBounds("parameters", numbers, parameters, parameterMinimum, parameterMaximum);
  const ofController = valuesOf("controllerParameters", given.controllerParameters, loop.parameters, loop.parameterDefaults);
  checkBounds("controllerParameters", ofController, loop.parameters, loop.parameterMinimum, loop.parameterMaximum);
  const initial = valuesOf("initial", given.initial, states, run.initial);
  checkSegments("segments", segments, inputs);
  checkSegments("setpoint", setpoint, loop.setpoints);
  const names = ["time", ...states, ...inputs, ...outputs, ...loop.columns];
  const columns = Object.fromEntries(names.map((name) => [name, []]));
  const c = new Float64Array(SIZES.held), x = new Float64Array(states.length);
  const u = new Float64Array(inputs.length), o = new Float64Array(outputs.length);
  const measured = new Float64Array(loop.measuredAt.length), wanted = new Float64Array(loop.setpoints.length);
  const shown = new Float64Array(loop.setpoints.length), command = new Float64Array(loop.commanded.length);
  const memory = Float64Array.from(loop.initialMemory), later = new Float64Array(memory.length);
  const signals = inputs.map(() => [[], [], []]), counts = inputs.map(() => 0);
  const at = [], begins = [], commonEnds = [], commonValues = [], commonSlopes = [];
@driver_arrays@  prepare(numbers, c);
  const s = new Solver(c, start, initial);
  let row = 0, result = status.done, samples = 0, piece = 0, segment = 0;
  const setpointsNow = (time, wanted) => {
    const {ends, values, slopes} = setpoint;
    piece = setpoints_at(ends, values, slopes, ends.length - 1, start, piece, time, wanted);
  };
  const applied = Float64Array.from(segments.values[0]);
  const write = (time) => {
    s.stateAt(time, x);
    s.inputsAt(time, u);
    outputsOf(x, u, c, o);
    setpointsNow(time, shown);
    [time, ...x, ...u, ...o, ...shown, ...measured, ...command].forEach((value, i) => columns[names[i]].push(value));
  };
  const runSegment = (end, instant, margin, values, slopes) => {
    const begin = s.t;
    let found = status.done;
    s.setSegment(end, values, slopes);
    s.h = FIRST_STEP;
    if (instant) {
      write(begin);
      while (row < times.length && times[row] <= begin + loop.near) row++;
    }
    while (row < times.length && times[row] <= begin + CLOSE) write(times[row++]);
    while (s.t < end && found === status.done) {
      found = s.step();
      while (found === status.done && row < times.length && times[row] < Math.min(s.t + CLOSE, end - margin))
        write(times[row++]);
    }
    while (row < times.length && margin > CLOSE && times[row] < end) row++; // rows close to the instant `end`
    return found;
  };
  const runInterval = (begin, end) => {
    while (commonValues.length < counts.reduce((sum, count) => sum + count, 0)) {
      commonValues.push(new Float64Array(inputs.length));
      commonSlopes.push(new Float64Array(inputs.length));
    }
    const count = merge_columns(signals, counts, at, begins, begin, commonEnds, commonValues, commonSlopes, 0);
    let found = status.done;
    for (let k = 0; k < count && found === status.done; k++) {
      const following = commonEnds[k], margin = following < end ? loop.near : CLOSE;
      found = runSegment(following, k > 0, margin, commonValues[k], commonSlopes[k]);
    }
    s.inputsAt(end, applied);
    return found;
  };
  const instantOf = (k) => (k === 0 ? start : k < loop.samples ? start + loop.sampleTime * k : loop.finish);
  for (let k = 0; k < loop.samples && result === status.done; k++) {
    const begin = instantOf(k), end = instantOf(k + 1);
    outputsOf(s.x, applied, c, o);
    loop.measuredAt.forEach(([kind, i], j) => (measured[j] = kind === 0 ? s.x[i] : o[i]));
    setpointsNow(begin, wanted);
    control_sample(measured, wanted, memory, ofController, command, later);
    if (![...measured, ...wanted, ...command].every(Number.isFinite)) result = status.notFinite;
    else {
      memory.set(later);
      samples++;
      const {ends, values, slopes} = segments, last = ends.length - 1;
      let pieces;
      [segment, pieces] = cut_segments(
        ends, values, slopes, last, start, segment, begin, end, command, loop.commanded, signals);
      counts.fill(pieces);
@apply_drivers@      result = runInterval(begin, end);
    }
  }
  while (result === status.done && row < times.length) write(times[row++]);
  return {columns, status: result, time: s.t, steps: s.steps, rejected: s.rejected, samples};
}
