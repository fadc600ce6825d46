@provenance@
/* Run of the scenario; writes CSV to the file that is named, or to the standard output. */
#include "@file@.h"

#include <math.h>
#include <stdio.h>

#define ROWS @rows@
#define SEGMENTS @segments@
#define COLUMNS @columns@

static const char header[] = @header@;
static const int columns[COLUMNS] = {@columns_at@};
static const double start = @start@;
static const double initial[MODEL_STATES] = {@initial@};
static const double times[ROWS] = {@times@};
static const double ends[SEGMENTS] = {@ends@};
static const double values[SEGMENTS][MODEL_INPUTS + 1] = {@values@};
static const double slopes[SEGMENTS][MODEL_INPUTS + 1] = {@slopes@};

@valid@
static int write_row(FILE *out, double time, const double *x, const double *u, const double *c)
{
  double o[MODEL_OUTPUTS + 1];
  int i;
  model_outputs(x, u, c, o);
  fprintf(out, "%.17g", time);
  for (i = 0; i < COLUMNS; i++) {
    const int k = columns[i];
    const double value = k < MODEL_STATES                  ? x[k]
                         : k < MODEL_STATES + MODEL_INPUTS ? u[k - MODEL_STATES]
                                                           : o[k - MODEL_STATES - MODEL_INPUTS];
    fprintf(out, ",%.17g", value);
  }
  fputc('\n', out);
  return is_valid(x, o);
}

/* Rows up to `time`, in the segment that the solver is in. */
static int write_rows(FILE *out, int *row, double time, const model_solver *s, const double *c)
{
  double x[MODEL_STATES], u[MODEL_INPUTS + 1];
  while (*row < ROWS && times[*row] <= time) {
    model_state_at(s, c, times[*row], x);
    model_inputs_at(s, times[*row], u);
    if (!write_row(out, times[*row], x, u, c)) return 0;
    ++*row;
  }
  return 1;
}

static int run(FILE *out)
{
  model_solver s;
  double c[MODEL_PRECOMPUTED + 1];
  int segment, row = 0, status = MODEL_DONE;
  model_prepare(model_defaults, c);
  model_begin(&s, start, initial);
  for (segment = 0; segment < SEGMENTS; segment++) {
    const double end = ends[segment], close = MODEL_CLOSE;
    model_set_segment(&s, end, values[segment], slopes[segment]);
    s.h = MODEL_FIRST_STEP;
    if (!write_rows(out, &row, s.t + close, &s, c)) return MODEL_NOT_FINITE;
    while (s.t < end && status == MODEL_DONE) {
      status = model_step(&s, c);
      if (status == MODEL_DONE && s.t < end && !write_rows(out, &row, s.t + close, &s, c)) status = MODEL_NOT_FINITE;
    }
    if (status != MODEL_DONE) break;
    while (row < ROWS && times[row] < end - close) /* the row at the end has the inputs of the next segment */
      if (!write_rows(out, &row, times[row], &s, c)) return MODEL_NOT_FINITE;
  }
  if (status == MODEL_DONE && !write_rows(out, &row, s.t + MODEL_CLOSE, &s, c)) status = MODEL_NOT_FINITE;
  fprintf(stderr, "%ld steps, %ld rejected, time %.9g s\n", s.steps, s.rejected, s.t);
  return status;
}

@program@