/**
 * Run from `initial` at `start` through `segments` {ends, values, slopes}; rows at `times`. Every argument is optional:
 * by default the exported run. `parameters` and `initial` are arrays, or objects of some values by name. Throws
 * RangeError for unknown names, wrong lengths, numbers that are not finite and parameters beyond their bounds. Returns {columns: {time, ...}, status, time, steps, rejected}.
 */
export function simulate(changes = {}) {
  const usual = {parameters: defaults, ...run};
  checkKeys("simulate", changes, Object.keys(usual));
  const given = {...usual, ...changes}, {start, segments, times} = given;
  const numbers = valuesOf("parameters", given.parameters, parameters, defaults);
  checkBounds("parameters", numbers, parameters, parameterMinimum, parameterMaximum);
  const initial = valuesOf("initial", given.initial, states, run.initial);
  checkSegments("segments", segments, inputs);
  const names = ["time", ...states, ...inputs, ...outputs];
  const columns = Object.fromEntries(names.map((name) => [name, []]));
  const c = new Float64Array(SIZES.held), x = new Float64Array(states.length);
  const u = new Float64Array(inputs.length), o = new Float64Array(outputs.length);
  prepare(numbers, c);
  const s = new Solver(c, start, initial);
  let row = 0, result = status.done;
  const write = (limit) => {
    for (; row < times.length && times[row] <= limit; row++) {
      s.stateAt(times[row], x);
      s.inputsAt(times[row], u);
      outputsOf(x, u, c, o);
      [times[row], ...x, ...u, ...o].forEach((value, i) => columns[names[i]].push(value));
    }
  };
  for (let k = 0; k < segments.ends.length && result === status.done; k++) {
    const end = segments.ends[k];
    s.setSegment(end, segments.values[k], segments.slopes[k]);
    s.h = FIRST_STEP;
    write(s.t + CLOSE);
    while (s.t < end && result === status.done) {
      result = s.step();
      if (result === status.done && s.t < end) write(s.t + CLOSE);
    }
    // the row at the end of a segment has the inputs of the next one
    while (result === status.done && row < times.length && times[row] < end - CLOSE) write(times[row]);
  }
  if (result === status.done) write(s.t + CLOSE);
  return {columns, status: result, time: s.t, steps: s.steps, rejected: s.rejected};
}
