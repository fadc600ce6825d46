/** The distance from a number to the next. */
function ulp(value) {
  const bits = new DataView(new ArrayBuffer(8));
  bits.setFloat64(0, Math.abs(value));
  bits.setBigInt64(0, bits.getBigInt64(0) + 1n);
  return bits.getFloat64(0) - Math.abs(value);
}

/** Pulse width modulation; settings: frequency, smallest pulse; state: origin, periods begun, end of the last pulse. */
function modulate({settings, state}, signal, begin) {
  const end = signal.at(-1).end, [frequency] = settings, period = 1 / frequency;
  const last = end - 4 * ulp(end), smallest = Math.max(settings[1], 1e-9 * period, 4 * ulp(end));
  const [origin, begun] = state, total = Math.ceil((end - origin) * frequency - begun) + 1;
  let pulseEnd = state[2], segmentBegin = begin, k = 0, periods = 0;
  let levels = [[begin, pulseEnd > begin ? 1 : 0]];
  if (pulseEnd > begin && pulseEnd < end) levels.push([pulseEnd, 0]);
  for (let i = 0; i < total; i++) {
    let time = origin + (begun + i) / frequency;
    if (!(time < last)) continue;
    time = Math.max(time, begin);
    while (k < signal.length - 1 && signal[k].end <= time) segmentBegin = signal[k++].end;
    const duty = signal[k].value + (time - segmentBegin) * signal[k].slope;
    const width = period * Math.min(Math.max(duty, 0), 1);
    pulseEnd = width < smallest ? -Infinity : period - width < smallest ? Infinity : time + width;
    if (periods === 0 && time === begin) levels = [];
    const level = pulseEnd > time ? 1 : 0;
    if (levels.length === 0 || level !== levels.at(-1)[1]) levels.push([time, level]);
    if (pulseEnd > time && pulseEnd < end) levels.push([pulseEnd, 0]);
    periods++;
  }
  state[1] = begun + periods;
  state[2] = pulseEnd;
  return levels.map(([, value], i) => ({end: i + 1 < levels.length ? levels[i + 1][0] : end, value, slope: 0}));
}

/** Instants at which a signal passes 0.5, with the new state of the coil. */
function switchings(signal, begin, coil) {
  const found = [];
  for (const {end, value, slope} of signal) {
    const first = value >= 0.5, last = value + slope * (end - begin) >= 0.5;
    if (first !== coil > 0) found.push([begin, (coil = first ? 1 : 0)]);
    if (last !== first) found.push([Math.min(begin + (0.5 - value) / slope, end), (coil = last ? 1 : 0)]);
    begin = end;
  }
  return found;
}

/** A solenoid valve; settings: delays and ramps of opening and closing; state: coil, pending instant, target, opening. */
function switchWithDelay({settings, state}, signal, begin) {
  const end = signal.at(-1).end, result = [];
  let [coil, pending, target, opening] = state, edge = begin;
  const move = (stop) => {
    if (!(stop > edge)) return;
    const ramp = target > opening ? settings[2] : settings[3], distance = Math.abs(target - opening);
    const left = distance - (ramp > 0 ? (stop - edge) / ramp : Infinity);
    const after = left > 1e-12 ? target + (opening - target >= 0 ? left : -left) : target;
    const arrival = Math.min(edge + (after === target ? ramp * distance : Infinity), stop);
    if (arrival > edge) result.push({end: arrival, value: opening, slope: (after - opening) / (arrival - edge)});
    if (stop > arrival) result.push({end: stop, value: after, slope: 0});
    opening = after;
  };
  for (const [instant, current] of [...switchings(signal, begin, coil), [Infinity, coil]]) {
    if (pending < Math.min(instant, end) && coil !== target) {
      move(pending);
      edge = pending;
      target = coil;
    }
    if (instant === Infinity) break;
    coil = current;
    pending = instant + (current > 0 ? settings[0] : settings[1]);
  }
  move(end);
  state.splice(0, 4, coil, pending >= end ? pending : Infinity, target, opening);
  return result;
}

/** The signal of an input after one of its drivers. */
function driven(driver, signal, begin) {
  return driver.kind === 0 ? modulate(driver, signal, begin) : switchWithDelay(driver, signal, begin);
}

