@provenance@
/* One instance of a sampled controller, for the functions of FMI 2.0 and 3.0: Co-Simulation alone. At a sampling instant
   the commands follow from the inputs at once; they are held, and the memory is advanced, by the step that begins there. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MODEL_TOKEN "@token@"
#define MODEL_SAMPLE_TIME @period@
#define MODEL_STATES 0
#define MODEL_INDICATORS 0
#define MODEL_MEASUREMENTS @measurements@
#define MODEL_SETPOINTS @setpoints@
#define MODEL_COMMANDS @commands@
#define MODEL_PARAMETERS @parameters@
#define MODEL_MEMORY @memory@
/* Value references; 0 is time. */
#define MODEL_FIRST_INPUT 1u
#define MODEL_FIRST_SETPOINT (MODEL_FIRST_INPUT + MODEL_MEASUREMENTS)
#define MODEL_FIRST_COMMAND (MODEL_FIRST_SETPOINT + MODEL_SETPOINTS)
#define MODEL_FIRST_PARAMETER (MODEL_FIRST_COMMAND + MODEL_COMMANDS)
#define MODEL_END (MODEL_FIRST_PARAMETER + MODEL_PARAMETERS)
/* Inputs of which derivatives by time can be given: none, because a controller samples. */
#define MODEL_LINEAR_INPUTS 0

static const double model_initial_memory[MODEL_MEMORY + 1] = {@initial_memory@};
static const double model_start_inputs[] = {@start_inputs@};
static const double model_defaults[MODEL_PARAMETERS + 1] = {@parameter_values@};
static const double model_parameter_minimum[MODEL_PARAMETERS + 1] = {@parameter_minimum@};
static const double model_parameter_maximum[MODEL_PARAMETERS + 1] = {@parameter_maximum@};
static const char *const model_parameter_names[MODEL_PARAMETERS + 1] = {@parameter_names@};

static const double model_nominal[1] = {1.0};

@functions@
/* `s` and the fields below it are those that a plant has; a controller has no continuous states. */
typedef struct {
  struct {
    double t, x[1];
  } s;
  double u[1], w[1], c[1], begin;
  double input[MODEL_MEASUREMENTS + MODEL_SETPOINTS + 1], command[MODEL_COMMANDS + 1];
  double memory[MODEL_MEMORY + 1], p[MODEL_PARAMETERS + 1];
  long samples;
  int old_rates, old_outputs, begun;
} model_instance;

typedef void (*model_report)(void *owner, int is_error, const char *text);

static void model_reset(model_instance *m)
{
  memset(m, 0, sizeof *m);
  memcpy(m->memory, model_initial_memory, sizeof model_initial_memory);
  memcpy(m->p, model_defaults, sizeof model_defaults);
  memcpy(m->input, model_start_inputs, sizeof model_start_inputs);
  m->s.t = @start@;
}

/* Whether a sample is due at a time, within rounding; the first one is at the start. */
static int model_is_due(const model_instance *m, double time)
{
  if (!m->begun) return 1;
  return time >= m->begin + MODEL_SAMPLE_TIME * ((double)m->samples - 1e-9);
}

/* A sample: the commands, and the memory after it. 1 where a number is not finite. */
static int model_take(const model_instance *m, double *command, double *later)
{
  int i;
  model_sample(m->input, m->input + MODEL_MEASUREMENTS, m->memory, m->p, command, later);
  for (i = 0; i < MODEL_COMMANDS; i++)
    if (!isfinite(command[i])) return 1;
  return 0;
}

static int model_get(model_instance *m, unsigned v, double *value)
{
  double command[MODEL_COMMANDS + 1], later[MODEL_MEMORY + 1];
  if (v == 0) *value = m->s.t;
  else if (v < MODEL_FIRST_COMMAND) *value = m->input[v - MODEL_FIRST_INPUT];
  else if (v < MODEL_FIRST_PARAMETER) {
    if (!model_is_due(m, m->s.t)) *value = m->command[v - MODEL_FIRST_COMMAND];
    else {
      (void)model_take(m, command, later);
      *value = command[v - MODEL_FIRST_COMMAND];
    }
  } else if (v < MODEL_END) *value = m->p[v - MODEL_FIRST_PARAMETER];
  else return 1;
  return 0;
}

static void model_set_default_tolerance(model_instance *m, double value)
{
  (void)m, (void)value;
}

static const char *model_refusal(unsigned v, double value, char *text, size_t size)
{
  const unsigned k = v - MODEL_FIRST_PARAMETER;
  if (v < MODEL_FIRST_PARAMETER || v >= MODEL_END || !isfinite(value))
    return "a variable cannot be set, or its value is not finite";
  snprintf(text, size, "%.300s is %.6g; allowed are %.6g to %.6g", model_parameter_names[k], value, model_parameter_minimum[k],
           model_parameter_maximum[k]);
  return text;
}

static int model_set(model_instance *m, unsigned v, double value)
{
  if (!isfinite(value)) return 1;
  if (v >= MODEL_FIRST_INPUT && v < MODEL_FIRST_COMMAND) m->input[v - MODEL_FIRST_INPUT] = value;
  else if (v >= MODEL_FIRST_PARAMETER && v < MODEL_END) {
    if (value < model_parameter_minimum[v - MODEL_FIRST_PARAMETER] || value > model_parameter_maximum[v - MODEL_FIRST_PARAMETER]) return 1;
    m->p[v - MODEL_FIRST_PARAMETER] = value;
  } else return 1;
  return 0;
}

static void model_initialise(model_instance *m) { (void)m; }

static int model_check(model_instance *m, model_report report, void *owner)
{
  (void)m, (void)report, (void)owner;
  return 0;
}

/* Advance from time t by h: a sample at its beginning if one is due, and at every sampling instant before its end. */
static int model_do_step(model_instance *m, double t, double h, model_report report, void *owner)
{
  const model_instance before = *m;
  const double end = t + h;
  double later[MODEL_MEMORY + 1];
  if (!(h > 0.0 && isfinite(end)) || fabs(t - m->s.t) > 1e-6 * h + 1e-12 * fabs(t)) {
    report(owner, 1, "a step must begin where the last one ended, and have a positive, finite size");
    return 1;
  }
  if (!m->begun) m->begin = t;
  m->s.t = t;
  while (model_is_due(m, m->s.t)) {
    if (model_take(m, m->command, later)) {
      *m = before;
      report(owner, 1, "a command is not finite");
      return 1;
    }
    memcpy(m->memory, later, sizeof m->memory);
    m->begun = 1;
    m->samples++;
    if (m->begin + MODEL_SAMPLE_TIME * (double)m->samples < end - 1e-9 * MODEL_SAMPLE_TIME)
      m->s.t = m->begin + MODEL_SAMPLE_TIME * (double)m->samples;
  }
  m->s.t = end;
  return 0;
}

/* What a controller has not. */
static void model_ready(model_instance *m) { (void)m; }
static void model_settle(model_instance *m) { (void)m; }
static void model_get_indicators(model_instance *m, double *z) { (void)m, (void)z; }
static void model_rhs(const double *x, const double *u, const double *c, double *f) { (void)x, (void)u, (void)c, (void)f; }

static int model_forward(model_instance *m, const unsigned *unknown, size_t unknowns, const unsigned *known,
                         size_t knowns, const double *seed, double *result)
{
  (void)m, (void)unknown, (void)unknowns, (void)known, (void)knowns, (void)seed, (void)result;
  return 1;
}

static int model_backward(model_instance *m, const unsigned *unknown, size_t unknowns, const unsigned *known,
                          size_t knowns, const double *seed, double *result)
{
  return model_forward(m, unknown, unknowns, known, knowns, seed, result);
}
