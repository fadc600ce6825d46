@provenance@
/* Run of the control loop: the plant, its controller and the drivers of its inputs, from one sampling instant to the
   next; writes CSV to the file that is named, or to the standard output. */
#include "@file@.h"
#include "@file@_controller.h"

#include <math.h>
#include <stdio.h>

#define ROWS @rows@
#define SAMPLES @samples@
#define SEGMENTS @segments@
#define PIECES @pieces@
#define COLUMNS @columns@
#define DRIVERS @drivers@
#define CAPACITY @capacity@
#define SETPOINTS MODEL_CONTROLLER_SETPOINTS
#define MEASUREMENTS MODEL_CONTROLLER_MEASUREMENTS
#define COMMANDS MODEL_CONTROLLER_COMMANDS
#define NOT_COMMANDED 4

@kernels@
static const double SAMPLE_TIME = @sample_time@;
static const double NEAR = @near@;
static const double start = @start@;
static const double finish = @finish@;
static const char header[] = @header@;
/* Kind of each column (state, input, output, set point, measurement, command), and its number there. */
static const int columns[COLUMNS][2] = {@columns_at@};
static const int measured_at[MEASUREMENTS][2] = {@measured_at@};
static const int commanded[COMMANDS] = {@commanded@};
static const double initial[MODEL_STATES] = {@initial@};
static const double times[ROWS] = {@times@};
static const double ends[SEGMENTS] = {@ends@};
static double values[SEGMENTS][MODEL_INPUTS + 1] = {@values@};
static double slopes[SEGMENTS][MODEL_INPUTS + 1] = {@slopes@};
static const double setpoint_ends[PIECES] = {@setpoint_ends@};
static double setpoint_values[PIECES][SETPOINTS + 1] = {@setpoint_values@};
static double setpoint_slopes[PIECES][SETPOINTS + 1] = {@setpoint_slopes@};
@driver_tables@
/* The run: solver, parameters in the form that the functions need, memory and arrays of the controller, inputs just
   before a sample, and the next row, segment of the other inputs and segment of the set points. */
static model_solver s;
static double c[MODEL_PRECOMPUTED + 1], memory[MODEL_CONTROLLER_MEMORY + 1];
static double measured[MEASUREMENTS + 1], setpoint[SETPOINTS + 1], command[COMMANDS + 1], applied[MODEL_INPUTS + 1];
static int row, segment, piece;
/* Each input between two samples: ends, values at the starts, and slopes of its segments. */
static double signals[MODEL_INPUTS][3][CAPACITY];
static int counts[MODEL_INPUTS];
/* The common segments of all inputs between two samples. */
static double common_ends[MODEL_INPUTS * CAPACITY];
static double common_values[MODEL_INPUTS * CAPACITY][MODEL_INPUTS], common_slopes[MODEL_INPUTS * CAPACITY][MODEL_INPUTS];

static double instant_of(long sample)
{
  return sample == 0 ? start : sample < SAMPLES ? start + SAMPLE_TIME * (double)sample : finish;
}

static void setpoints_now(double time, double *result)
{
  piece = setpoints_at(setpoint_ends, setpoint_values, setpoint_slopes, PIECES - 1, start, piece, time, result);
}

@valid@
static int write_row(FILE *out, double time, const double *x, const double *u)
{
  double o[MODEL_OUTPUTS + 1], r[SETPOINTS + 1];
  const double *const arrays[] = {x, u, o, r, measured, command};
  int i;
  model_outputs(x, u, c, o);
  setpoints_now(time, r);
  fprintf(out, "%.17g", time);
  for (i = 0; i < COLUMNS; i++) fprintf(out, ",%.17g", arrays[columns[i][0]][columns[i][1]]);
  fputc('\n', out);
  return is_valid(x, o);
}

static int write_at(FILE *out, double time)
{
  double x[MODEL_STATES], u[MODEL_INPUTS + 1];
  model_state_at(&s, c, time, x);
  model_inputs_at(&s, time, u);
  return write_row(out, time, x, u);
}

/* One segment, in which the inputs are linear; `instant`: it begins between two samples, where a row is written. */
static int run_segment(FILE *out, double end, int instant, double margin, const double *u, const double *w)
{
  const double begin = s.t, close = MODEL_CLOSE;
  int status = MODEL_DONE;
  model_set_segment(&s, end, u, w);
  s.h = MODEL_FIRST_STEP;
  if (instant) {
    if (!write_at(out, begin)) return MODEL_NOT_FINITE;
    while (row < ROWS && times[row] <= begin + NEAR) row++;
  }
  while (row < ROWS && times[row] <= begin + close)
    if (!write_at(out, times[row++])) return MODEL_NOT_FINITE;
  while (s.t < end && status == MODEL_DONE) {
    status = model_step(&s, c);
    while (status == MODEL_DONE && row < ROWS && times[row] < fmin(s.t + close, end - margin))
      if (!write_at(out, times[row++])) status = MODEL_NOT_FINITE;
  }
  while (row < ROWS && margin > close && times[row] < end) row++; /* rows close to the instant `end` */
  return status;
}

/* Measure, command, and give each input its segments until the next sample. */
static int sample(double begin, double end)
{
  double o[MODEL_OUTPUTS + 1];
  const double *const arrays[] = {s.x, o};
  int i, k;
  model_outputs(s.x, applied, c, o);
  for (i = 0; i < MEASUREMENTS; i++) measured[i] = arrays[measured_at[i][0]][measured_at[i][1]];
  setpoints_now(begin, setpoint);
  if (model_controller_step(memory, measured, setpoint, command) != 0) return NOT_COMMANDED;
  segment = cut_segments(ends, values, slopes, SEGMENTS - 1, start, segment, begin, end, command, commanded, signals, &k);
  for (i = 0; i < MODEL_INPUTS; i++) counts[i] = k;
@apply_drivers@  return MODEL_DONE;
}

/* From one sample to the next, in the common segments of all inputs. */
static int run_interval(FILE *out, double begin, double end)
{
  double begins[MODEL_INPUTS];
  int at[MODEL_INPUTS], i, status = MODEL_DONE;
  const int count = merge_columns(signals, counts, at, begins, begin, common_ends, common_values, common_slopes, 0);
  for (i = 0; i < count && status == MODEL_DONE; i++) {
    const double margin = common_ends[i] < end ? NEAR : MODEL_CLOSE;
    status = run_segment(out, common_ends[i], i > 0, margin, common_values[i], common_slopes[i]);
  }
  model_inputs_at(&s, end, applied);
  for (i = 0; i < MODEL_STATES; i++)
    if (s.x[i] < model_state_minimum[i] && status == MODEL_DONE) status = MODEL_NOT_FINITE;
  return status;
}

static int run(FILE *out)
{
  int i, status = MODEL_DONE;
  long k;
  model_prepare(model_defaults, c);
  model_begin(&s, start, initial);
  for (i = 0; i < MODEL_CONTROLLER_MEMORY; i++) memory[i] = model_controller_initial_memory[i];
  for (i = 0; i < MODEL_INPUTS; i++) applied[i] = values[0][i];
  for (k = 0; k < SAMPLES && status == MODEL_DONE; k++) {
    status = sample(instant_of(k), instant_of(k + 1));
    if (status == MODEL_DONE) status = run_interval(out, instant_of(k), instant_of(k + 1));
  }
  while (status == MODEL_DONE && row < ROWS)
    if (!write_at(out, times[row++])) status = MODEL_NOT_FINITE;
  fprintf(stderr, "%ld samples, %ld steps, %ld rejected, time %.9g s\n", k, s.steps, s.rejected, s.t);
  return status;
}

@program@