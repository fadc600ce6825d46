/* One instance of the model, for the functions of FMI 2.0 and 3.0. */
#include "@file@.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MODEL_TOKEN "@token@"
#define MODEL_PARTIALS @partials@
#define MODEL_LIMITS @limits@
#define MODEL_INDICATORS @indicators@
/* An event follows where an indicator lies so far beyond the change of its sign, so that rounding causes none. */
#define MODEL_SLACK @slack@
#define MODEL_RTOL_START @rtol@
/* Pressures at the start, from which air masses follow. */
#define MODEL_PRESSURES @pressures@

/* Value references; 0 is time. The tolerance exists for an integrator that controls its error. */
#define MODEL_FIRST_STATE 1u
#define MODEL_FIRST_RATE (MODEL_FIRST_STATE + MODEL_STATES)
#define MODEL_FIRST_INPUT (MODEL_FIRST_RATE + MODEL_STATES)
#define MODEL_FIRST_OUTPUT (MODEL_FIRST_INPUT + MODEL_INPUTS)
#define MODEL_FIRST_PARAMETER (MODEL_FIRST_OUTPUT + MODEL_OUTPUTS)
#define MODEL_TOLERANCE (MODEL_FIRST_PARAMETER + MODEL_PARAMETERS)
#define MODEL_FIRST_PRESSURE (MODEL_TOLERANCE + (MODEL_RTOL_START > 0.0 ? 1u : 0u))
/* Event indicators have value references in FMI 3.0. */
#define MODEL_FIRST_INDICATOR (MODEL_FIRST_PRESSURE + MODEL_PRESSURES)
/* Inputs of which derivatives by time can be given. */
#define MODEL_LINEAR_INPUTS MODEL_INPUTS
#define MODEL_ROWS (MODEL_STATES + MODEL_OUTPUTS)

/* d(rates, outputs)/d(states, inputs): values of the non-zeros, whose places are in model_rows and model_columns. */
void model_partials(const double *restrict x, const double *restrict u, const double *restrict c, double *restrict D);
/* Differences that change sign where the rates are not smooth. */
void model_indicators(const double *restrict x, const double *restrict u, const double *restrict c, double *restrict z);

static const char *const model_names[] = {@names@};
static const double model_minimum[] = {@minimum@};
static const double model_start_states[MODEL_STATES] = {@start_states@};
static const double model_start_inputs[MODEL_INPUTS + 1] = {@start_inputs@};
static const double model_scales[MODEL_INDICATORS + 1] = {@scales@};
static const int model_rows[] = {@rows@};
static const int model_columns[] = {@columns@};
static const int model_pressure_rows[] = {@pressure_rows@};
static const int model_air_masses[] = {@air_masses@};
static const double model_start_pressures[] = {@start_pressures@};
/* Ranges that are reported once when a column leaves them. */
static const struct {
  int column;
  double low, high;
  const char *text;
} model_limits[] = {
@ranges@  {0, 0.0, 0.0, ""}
};

/* `u` are the inputs that act: `requested`, which were set, within their ranges. */
typedef struct {
  model_solver s;
  double requested[MODEL_INPUTS + 1];
  double u[MODEL_INPUTS + 1], w[MODEL_INPUTS + 1], p[MODEL_PARAMETERS + 1], c[MODEL_PRECOMPUTED + 1];
  double f[MODEL_STATES], o[MODEL_OUTPUTS + 1];
  int unprepared, old_rates, old_outputs, jumped;
  double pressure[MODEL_PRESSURES + 1];
  int is_initialised;
  unsigned char told[MODEL_LIMITS + 1], above[MODEL_INDICATORS + 1], is_given[MODEL_PRESSURES + 1];
} model_instance;

typedef void (*model_report)(void *owner, int is_error, const char *text);

static void model_reset(model_instance *m)
{
  memset(m, 0, sizeof *m);
  model_begin(&m->s, @start@, model_start_states);
  m->s.rtol = MODEL_RTOL_START;
  memcpy(m->u, model_start_inputs, sizeof m->u);
  memcpy(m->requested, model_start_inputs, sizeof m->requested);
  memcpy(m->p, model_defaults, sizeof m->p);
  memcpy(m->pressure, model_start_pressures, sizeof m->pressure);
  m->unprepared = m->old_rates = m->old_outputs = m->jumped = 1;
}

static void model_ready(model_instance *m)
{
  if (!m->unprepared) return;
  model_prepare(m->p, m->c);
  m->unprepared = 0;
  m->old_rates = m->old_outputs = m->jumped = 1;
}

/* Rates and outputs at the present states and inputs. */
static const double *model_rates_now(model_instance *m)
{
  model_ready(m);
  if (m->old_rates) model_rhs(m->s.x, m->u, m->c, m->f);
  m->old_rates = 0;
  return m->f;
}

static const double *model_outputs_now(model_instance *m)
{
  model_ready(m);
  if (m->old_outputs) model_outputs(m->s.x, m->u, m->c, m->o);
  m->old_outputs = 0;
  return m->o;
}

/* Event indicators relative to their scales, moved away from zero on the side on which the last event left them. */
static void model_get_indicators(model_instance *m, double *z)
{
  double values[MODEL_INDICATORS + 1];
  int i;
  model_ready(m);
  model_indicators(m->s.x, m->u, m->c, values);
  for (i = 0; i < MODEL_INDICATORS; i++) {
    const double value = isfinite(values[i]) ? values[i] / model_scales[i] : 0.0;
    z[i] = m->above[i] ? value + MODEL_SLACK : value - MODEL_SLACK;
  }
}

/* At an event: on which side each indicator lies from now on. */
static void model_settle(model_instance *m)
{
  double values[MODEL_INDICATORS + 1];
  int i;
  model_ready(m);
  model_indicators(m->s.x, m->u, m->c, values);
  for (i = 0; i < MODEL_INDICATORS; i++) m->above[i] = values[i] > 0.0;
}

/* End of the initialization: the air masses of the pressures that were given, by Newton steps; other states are kept. */
static void model_initialise(model_instance *m)
{
  double D[MODEL_PARTIALS + 1];
  int i, k, n;
  for (i = 0; i < MODEL_PRESSURES; i++)
    for (n = 0; m->is_given[i] && n < 30; n++) {
      const double missing = m->pressure[i] - model_outputs_now(m)[model_pressure_rows[i] - MODEL_STATES];
      double slope = 0.0;
      if (!(fabs(missing) > 1e-7)) break;
      model_partials(m->s.x, m->u, m->c, D);
      for (k = 0; k < MODEL_PARTIALS; k++)
        if (model_rows[k] == model_pressure_rows[i] && model_columns[k] == model_air_masses[i]) slope = D[k];
      if (!(slope > 0.0)) break;
      m->s.x[model_air_masses[i]] += missing / slope;
      m->old_rates = m->old_outputs = m->jumped = 1;
    }
  m->is_initialised = 1;
}

/* The value of a variable; 1 for an unknown value reference. */
static int model_get(model_instance *m, unsigned v, double *value)
{
  double z[MODEL_INDICATORS + 1];
  if (v == 0) *value = m->s.t;
  else if (v < MODEL_FIRST_RATE) *value = m->s.x[v - MODEL_FIRST_STATE];
  else if (v < MODEL_FIRST_INPUT) *value = model_rates_now(m)[v - MODEL_FIRST_RATE];
  else if (v < MODEL_FIRST_OUTPUT) *value = m->requested[v - MODEL_FIRST_INPUT];
  else if (v < MODEL_FIRST_PARAMETER) *value = model_outputs_now(m)[v - MODEL_FIRST_OUTPUT];
  else if (v < MODEL_TOLERANCE) *value = m->p[v - MODEL_FIRST_PARAMETER];
  else if (v == MODEL_TOLERANCE && MODEL_RTOL_START > 0.0) *value = m->s.rtol;
  else if (v >= MODEL_FIRST_PRESSURE && v < MODEL_FIRST_INDICATOR) *value = m->pressure[v - MODEL_FIRST_PRESSURE];
  else if (v >= MODEL_FIRST_INDICATOR && v < MODEL_FIRST_INDICATOR + MODEL_INDICATORS) {
    model_get_indicators(m, z);
    *value = z[v - MODEL_FIRST_INDICATOR];
  } else return 1;
  return 0;
}

/* The tolerance of an importer, which is often the default of the description; a start value of the variable has
   precedence. */
static void model_set_default_tolerance(model_instance *m, double value)
{
  if (m->s.rtol == MODEL_RTOL_START && value > 0.0 && value < 1.0) m->s.rtol = value;
}

/* Why a variable cannot be set to a value. */
static const char *model_refusal(unsigned v, double value, char *text, size_t size)
{
  const unsigned k = v - MODEL_FIRST_PARAMETER;
  if (v >= MODEL_FIRST_PRESSURE && v < MODEL_FIRST_INDICATOR && isfinite(value))
    return "a pressure at the start can be set until the end of the initialization only";
  if (v < MODEL_FIRST_PARAMETER || v >= MODEL_TOLERANCE || !isfinite(value))
    return "a variable cannot be set, or its value is not finite, or a tolerance is not in 0 to 1";
  snprintf(text, size, "%.300s is %.6g; allowed are %.6g to %.6g %.40s", model_parameter_names[k], value,
           model_parameter_minimum[k], model_parameter_maximum[k], model_parameter_units[k]);
  return text;
}

/* An input within its range. */
static double model_limited(int i, double value)
{
  return fmin(fmax(value, model_input_minimum[i]), model_input_maximum[i]);
}

/* Set a state, an input, a parameter or the tolerance; 1 for any other variable, a value that is not finite, or a
   parameter beyond its bounds. */
static int model_set(model_instance *m, unsigned v, double value)
{
  if (!isfinite(value)) return 1;
  if (v >= MODEL_FIRST_STATE && v < MODEL_FIRST_RATE) {
    m->s.x[v - MODEL_FIRST_STATE] = value;
    m->jumped = 1;
  } else if (v >= MODEL_FIRST_INPUT && v < MODEL_FIRST_OUTPUT) {
    const int i = (int)(v - MODEL_FIRST_INPUT);
    const double limited = model_limited(i, value);
    if (m->u[i] != limited) m->jumped = 1;
    m->requested[i] = value;
    m->u[i] = limited;
    m->w[i] = 0.0;
  } else if (v >= MODEL_FIRST_PARAMETER && v < MODEL_TOLERANCE) {
    if (value < model_parameter_minimum[v - MODEL_FIRST_PARAMETER] || value > model_parameter_maximum[v - MODEL_FIRST_PARAMETER]) return 1;
    m->p[v - MODEL_FIRST_PARAMETER] = value;
    m->unprepared = 1;
  } else if (v == MODEL_TOLERANCE && MODEL_RTOL_START > 0.0 && value > 0.0 && value < 1.0) {
    m->s.rtol = value;
  } else if (v >= MODEL_FIRST_PRESSURE && v < MODEL_FIRST_INDICATOR && !m->is_initialised) {
    m->pressure[v - MODEL_FIRST_PRESSURE] = value;
    m->is_given[v - MODEL_FIRST_PRESSURE] = 1;
  } else {
    return 1;
  }
  m->old_rates = m->old_outputs = 1;
  return 0;
}

static double model_column(const model_instance *m, int k)
{
  if (k < MODEL_STATES) return m->s.x[k];
  if (k < MODEL_STATES + MODEL_INPUTS) return m->requested[k - MODEL_STATES];
  return m->o[k - MODEL_STATES - MODEL_INPUTS];
}

/* Report each limit once that a column exceeds; 1 if a column has no finite value, or a state is below its bound. */
static int model_check(model_instance *m, model_report report, void *owner)
{
  char text[640];
  int k;
  (void)model_outputs_now(m);
  for (k = 0; k < MODEL_STATES + MODEL_INPUTS + MODEL_OUTPUTS; k++) {
    const double value = model_column(m, k);
    if (isfinite(value) && value >= model_minimum[k]) continue;
    snprintf(text, sizeof text, "%.200s is %.6g at %.6g s: not finite, or below its limit", model_names[k], value, m->s.t);
    report(owner, 1, text);
    return 1;
  }
  for (k = 0; k < MODEL_LIMITS; k++) {
    const double value = model_column(m, model_limits[k].column);
    if (m->told[k] || (value >= model_limits[k].low && value <= model_limits[k].high)) continue;
    m->told[k] = 1;
    snprintf(text, sizeof text, "%.500s (%.6g at %.6g s)", model_limits[k].text, value, m->s.t);
    report(owner, 0, text);
  }
  return 0;
}

static int model_advance(model_instance *m, double t, double h, model_report report, void *owner)
{
  const double end = t + h;
  double slope[MODEL_INPUTS + 1] = {0.0};
  int i, status = MODEL_DONE;
  if (!(h > 0.0 && isfinite(end)) || fabs(t - m->s.t) > 1e-6 * h + 1e-12 * fabs(t)) {
    report(owner, 1, "a step must begin where the last one ended, and have a positive, finite size");
    return 1;
  }
  model_ready(m);
  m->s.t = t;
  for (i = 0; i < MODEL_INPUTS; i++) {
    const double requested = m->requested[i] + m->w[i] * h;
    const double limited = model_limited(i, requested);
    /* An input that would leave its range goes to its limit. */
    slope[i] = limited == requested && m->u[i] == m->requested[i] ? m->w[i] : (limited - m->u[i]) / h;
  }
  model_set_segment(&m->s, end, m->u, slope);
  if (m->jumped) m->s.h = MODEL_FIRST_STEP;
  m->jumped = 0;
  while (m->s.t < end && status == MODEL_DONE) status = model_step(&m->s, m->c);
  for (i = 0; i < MODEL_INPUTS; i++) {
    m->requested[i] += m->w[i] * h;
    m->u[i] = model_limited(i, m->requested[i]);
  }
  m->old_rates = m->old_outputs = 1;
  if (status != MODEL_DONE) {
    report(owner, 1, status == MODEL_STEP_TOO_SMALL ? "the internal step became too small" : "a rate is not finite");
    return 1;
  }
  return model_check(m, report, owner);
}

/* Advance from time t by h; inputs are linear in time within the step. 1 if it failed, which is reported; the instance
   is then as before. */
static int model_do_step(model_instance *m, double t, double h, model_report report, void *owner)
{
  const model_instance before = *m;
  if (!model_advance(m, t, h, report, owner)) return 0;
  *m = before;
  return 1;
}

/* The row of a rate or output, or -1 - i for the state i; -1 - MODEL_STATES for anything else. */
static int model_row(unsigned v)
{
  if (v >= MODEL_FIRST_STATE && v < MODEL_FIRST_RATE) return -1 - (int)(v - MODEL_FIRST_STATE);
  if (v >= MODEL_FIRST_RATE && v < MODEL_FIRST_INPUT) return (int)(v - MODEL_FIRST_RATE);
  if (v >= MODEL_FIRST_OUTPUT && v < MODEL_FIRST_PARAMETER) return (int)(v - MODEL_FIRST_OUTPUT) + MODEL_STATES;
  return -1 - MODEL_STATES;
}

/* The column of a state or input, or -1. */
static int model_variable(unsigned v)
{
  if (v >= MODEL_FIRST_STATE && v < MODEL_FIRST_RATE) return (int)(v - MODEL_FIRST_STATE);
  if (v >= MODEL_FIRST_INPUT && v < MODEL_FIRST_OUTPUT) return (int)(v - MODEL_FIRST_INPUT) + MODEL_STATES;
  return -1;
}

static int model_known(const unsigned *unknown, size_t unknowns, const unsigned *known, size_t knowns)
{
  size_t i;
  for (i = 0; i < unknowns; i++)
    if (model_row(unknown[i]) == -1 - MODEL_STATES) return 0;
  for (i = 0; i < knowns; i++)
    if (model_variable(known[i]) < 0) return 0;
  return 1;
}

/* result = d(unknown)/d(known) seed; 1 if the variables are not rates, outputs or states by states or inputs. */
static int model_forward(model_instance *m, const unsigned *unknown, size_t unknowns, const unsigned *known,
                         size_t knowns, const double *seed, double *result)
{
  double v[MODEL_STATES + MODEL_INPUTS + 1] = {0.0}, rows[MODEL_ROWS + 1] = {0.0}, D[MODEL_PARTIALS + 1];
  size_t i;
  int k;
  if (!model_known(unknown, unknowns, known, knowns)) return 1;
  model_ready(m);
  model_partials(m->s.x, m->u, m->c, D);
  for (i = 0; i < knowns; i++) v[model_variable(known[i])] += seed[i];
  for (k = 0; k < MODEL_PARTIALS; k++) rows[model_rows[k]] += D[k] * v[model_columns[k]];
  for (i = 0; i < unknowns; i++) {
    const int row = model_row(unknown[i]);
    result[i] = row < 0 ? v[-1 - row] : rows[row];
  }
  return 0;
}
