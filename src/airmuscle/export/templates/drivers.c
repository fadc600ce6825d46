/* Drivers between commands and inputs: pulse width modulation, and solenoids with delays and ramps. */
#define MODULATOR 0
#define NEVER ((double)INFINITY)
static double events[2][CAPACITY], result[3][CAPACITY];

/* Set ends and slopes of levels that are held. */
static void hold_levels(int levels, double end)
{
  int i;
  for (i = 0; i < levels; i++) {
    result[0][i] = i + 1 < levels ? result[0][i + 1] : end;
    result[2][i] = 0.0;
  }
}

/* Modulate a signal; settings: frequency, smallest pulse; state: origin of the carrier, periods begun, end of the last
   pulse. Returns the number of segments of the result. */
static int modulate(const double *setting, double *state, double signal[3][CAPACITY], int count, double begin)
{
  const double end = signal[0][count - 1], frequency = setting[0], period = 1.0 / frequency;
  const double ulp = nextafter(fabs(end), NEVER) - fabs(end), last = end - 4.0 * ulp;
  const double smallest = fmax(setting[1], fmax(1e-9 * period, 4.0 * ulp));
  const double origin = state[0], begun = state[1];
  const long total = (long)ceil((end - origin) * frequency - begun) + 1;
  double pulse_end = state[2], segment_begin = begin;
  int levels = 1, k = 0, periods = 0;
  long i;
  result[0][0] = begin;
  result[1][0] = pulse_end > begin ? 1.0 : 0.0;
  if (pulse_end > begin && pulse_end < end) {
    result[0][1] = pulse_end;
    result[1][1] = 0.0;
    levels = 2;
  }
  for (i = 0; i < total; i++) {
    double time = origin + (begun + (double)i) / frequency, width, level;
    if (!(time < last)) continue;
    time = fmax(time, begin);
    while (k < count - 1 && signal[0][k] <= time) segment_begin = signal[0][k++];
    width = period * fmin(fmax(signal[1][k] + (time - segment_begin) * signal[2][k], 0.0), 1.0);
    pulse_end = width < smallest ? -NEVER : period - width < smallest ? NEVER : time + width;
    if (periods == 0 && time <= begin) levels = 0;
    level = pulse_end > time ? 1.0 : 0.0;
    if (levels == 0 || (level > 0.5) != (result[1][levels - 1] > 0.5)) {
      result[0][levels] = time;
      result[1][levels++] = level;
    }
    if (pulse_end > time && pulse_end < end) {
      result[0][levels] = pulse_end;
      result[1][levels++] = 0.0;
    }
    periods++;
  }
  hold_levels(levels, end);
  state[1] = begun + periods;
  state[2] = pulse_end;
  return levels;
}

/* Instants at which a signal passes 0.5, and the new states of the coil; returns how many there are. */
static int find_switchings(double signal[3][CAPACITY], int count, double begin, double coil)
{
  int switchings = 0, k;
  for (k = 0; k < count; k++) {
    const double value = signal[1][k], slope = signal[2][k];
    const int first = value >= 0.5, last = value + slope * (signal[0][k] - begin) >= 0.5;
    if (first != (coil > 0.0)) {
      coil = first ? 1.0 : 0.0;
      events[0][switchings] = begin;
      events[1][switchings++] = coil;
    }
    if (last != first) {
      coil = last ? 1.0 : 0.0;
      events[0][switchings] = fmin(begin + (0.5 - value) / slope, signal[0][k]);
      events[1][switchings++] = coil;
    }
    begin = signal[0][k];
  }
  return switchings;
}

/* Move the opening from `edge` to `stop`, and rest; returns the opening, and appends segments. */
static double move_towards(const double *setting, double target, double opening, double edge, double stop, int *count)
{
  const double ramp = target > opening ? setting[2] : setting[3], distance = fabs(target - opening);
  const double left = distance - (ramp > 0.0 ? (stop - edge) / ramp : NEVER);
  const int arrives = !(left > 1e-12);
  const double after = arrives ? target : target + (opening - target >= 0.0 ? left : -left);
  const double arrival = fmin(edge + (arrives ? ramp * distance : NEVER), stop);
  if (arrival > edge) {
    result[0][*count] = arrival;
    result[1][*count] = opening;
    result[2][(*count)++] = (after - opening) / (arrival - edge);
  }
  if (stop > arrival) {
    result[0][*count] = stop;
    result[1][*count] = after;
    result[2][(*count)++] = 0.0;
  }
  return after;
}

/* Opening of a solenoid valve; settings: delays and ramps of opening and closing; state: coil, pending instant, target,
   opening. Returns the number of segments of the result. */
static int switch_with_delay(const double *setting, double *state, double signal[3][CAPACITY], int count, double begin)
{
  const double end = signal[0][count - 1];
  const int switchings = find_switchings(signal, count, begin, state[0]);
  double coil = state[0], pending = state[1], target = state[2], opening = state[3], edge = begin;
  int segments = 0, k;
  for (k = 0; k < switchings + 2; k++) {
    const double instant = k < switchings ? events[0][k] : NEVER;
    const int moves = pending < fmin(instant, end) && (coil > 0.0) != (target > 0.0);
    const double stop = k == switchings + 1 ? end : moves ? pending : edge;
    if (stop > edge) opening = move_towards(setting, target, opening, edge, stop, &segments);
    if (moves && k <= switchings) {
      edge = pending;
      target = coil;
    }
    if (k < switchings) {
      coil = events[1][k];
      pending = instant + (coil > 0.0 ? setting[0] : setting[1]);
    }
  }
  state[0] = coil;
  state[1] = pending >= end ? pending : NEVER;
  state[2] = target;
  state[3] = opening;
  return segments;
}

/* Replace the signals of inputs by what their drivers make of them. */
static void apply_drivers(double begin)
{
  int d, part, k;
  for (d = 0; d < DRIVERS; d++) {
    const int i = driver_inputs[d];
    counts[i] = driver_kinds[d] == MODULATOR
                    ? modulate(driver_settings[d], driver_states[d], signals[i], counts[i], begin)
                    : switch_with_delay(driver_settings[d], driver_states[d], signals[i], counts[i], begin);
    for (part = 0; part < 3; part++)
      for (k = 0; k < counts[i]; k++) signals[i][part][k] = result[part][k];
  }
}
