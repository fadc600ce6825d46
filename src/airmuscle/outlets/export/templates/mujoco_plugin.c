@provenance@
/* MuJoCo engine plugin: a muscle with its valves as an actuator with states in `act`. The length of the transmission is
   that of the muscle less a constant; its force is the tension, which pulls.

   Under Euler, implicit and implicitfast the muscle is integrated by Rodas4 within a step of MuJoCo, together with the
   load that it feels: the inertia of the transmission and the other forces, held over the step. The positions of MuJoCo
   are those of this motion at the end of each step, its velocities the mean ones of each step. The force is therefore
   the mean of the tension over two steps, the one before and this one, weighted by the time towards their common
   instant; the last element of `act` is the part of the step before. RK4 of MuJoCo receives the rates as they are. */
#include "@file@.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <mujoco/mujoco.h>

#define MASS MODEL_PARAMETER_MECHANISM_MASS
#define GRAVITY MODEL_PARAMETER_MECHANISM_GRAVITY
#define POSITION MODEL_STATE_POSITION
#define SPEED MODEL_STATE_SPEED
#define FORCE MODEL_OUTPUT_FORCE
#define ACT (MODEL_STATES - 1)
/* Greatest inertia [kg]; that of a transmission which cannot move. */
#define HELD 1e7
/* The control opens the input FIRST; if there is a SECOND (not -1), a negative control opens that one instead. */
#define FIRST @first@
#define SECOND @second@
/* Attributes: the parameters by their paths, then the length of the transmission at which the muscle is at rest. */
#define ATTRIBUTES @attributes@

static const char *const attributes[] = {@attribute_names@};
static const int places[] = {@places@};
static const int own_states[] = {@own_states@};
static const double rest_length = @rest_length@;

/* `force` contains the tension of every actuator in the last evaluation, because qfrc_actuator is a sum. */
typedef struct {
  double p[MODEL_PARAMETERS + 1], rest;
  int warned;
  double force[];
} muscle;

static muscle *muscle_of(const mjData *d, int instance)
{
  return (muscle *)d->plugin_data[instance];
}

/* A number from the configuration of an instance, or the value given; 1 for a text that is not a finite number. */
static int number(const mjModel *m, int instance, const char *attribute, double *value)
{
  const char *text = mj_getPluginConfig(m, instance, attribute);
  char *end;
  double found;
  if (!text || !text[0]) return 0;
  found = strtod(text, &end);
  while (*end == ' ') end++;
  if (*end || !isfinite(found)) return 1;
  *value = found;
  return 0;
}

static int state_count(const mjModel *m, int instance)
{
  (void)m, (void)instance;
  return 0; /* all states are in act */
}

static int init(const mjModel *m, mjData *d, int instance)
{
  muscle *made;
  int i;
  for (i = 0; i < m->nu; i++)
    if (m->actuator_plugin[i] == instance && m->actuator_actnum[i] != ACT) {
      mju_warning("@name@: the actuator needs actdim=\"%d\" and dyntype=\"user\"", ACT);
      return -1;
    }
  made = calloc(1, sizeof *made + (size_t)m->nu * sizeof(double));
  if (!made) return -1;
  memcpy(made->p, model_defaults, sizeof made->p);
  made->rest = rest_length;
  for (i = 0; i < ATTRIBUTES; i++)
    if (number(m, instance, attributes[i], i < ATTRIBUTES - 1 ? made->p + places[i] : &made->rest)) {
      mju_warning("@name@: the attribute %s is not a finite number", attributes[i]);
      free(made);
      return -1;
    }
  i = model_check_parameters(made->p);
  if (i >= 0) {
    mju_warning("@name@: %s is %.6g; allowed are %.6g to %.6g", model_parameter_names[i], made->p[i],
                model_parameter_minimum[i], model_parameter_maximum[i]);
    free(made);
    return -1;
  }
  d->plugin_data[instance] = (uintptr_t)made;
  return 0;
}

static void destroy(mjData *d, int instance)
{
  free(muscle_of(d, instance));
  d->plugin_data[instance] = 0;
}

static void copy(mjData *to, const mjModel *m, const mjData *from, int instance)
{
  if (muscle_of(to, instance) && muscle_of(from, instance))
    memcpy(muscle_of(to, instance), muscle_of(from, instance), sizeof(muscle) + (size_t)m->nu * sizeof(double));
}

static void reset(const mjModel *m, mjtNum *state, void *data, int instance)
{
  (void)state, (void)instance;
  memset(((muscle *)data)->force, 0, (size_t)m->nu * sizeof(double));
}

/* Inputs, within their ranges, and states of an actuator. */
static void point_of(const mjModel *m, const mjData *d, const muscle *own, int i, double *u, double *x)
{
  double control = d->ctrl[i];
  const double *act = d->act + m->actuator_actadr[i];
  int k;
  if (m->actuator_ctrllimited[i])
    control = fmin(fmax(control, m->actuator_ctrlrange[2 * i]), m->actuator_ctrlrange[2 * i + 1]);
  for (k = 0; k < MODEL_INPUTS; k++) u[k] = 0.0;
  if (SECOND >= 0 && control < 0.0) u[SECOND >= 0 ? SECOND : 0] = -control;
  else if (FIRST >= 0) u[FIRST >= 0 ? FIRST : 0] = control;
  for (k = 0; k < MODEL_INPUTS; k++) u[k] = fmin(fmax(u[k], model_input_minimum[k]), model_input_maximum[k]);
  for (k = 0; k < MODEL_STATES - 2; k++) x[own_states[k]] = act[k];
  x[POSITION] = own->rest - d->actuator_length[i];
  x[SPEED] = -d->actuator_velocity[i];
}

/* The load of an actuator: its inertia, and its acceleration by all other forces. Those of constraints and of other
   actuators are the last ones. */
static void load_of(const mjModel *m, mjData *d, const muscle *own, int i, double *p)
{
  const int count = d->moment_rownnz[i], first = d->moment_rowadr[i];
  double inverse = 0.0, other = 0.0, *moment, *moved, *force;
  int k;
  mj_markStack(d);
  moment = mj_stackAllocNum(d, (size_t)m->nv);
  moved = mj_stackAllocNum(d, (size_t)m->nv);
  force = mj_stackAllocNum(d, (size_t)m->nv);
  mju_zero(moment, m->nv);
  for (k = 0; k < count; k++) moment[d->moment_colind[first + k]] = d->actuator_moment[first + k];
  for (k = 0; k < m->nv; k++)
    force[k] = d->qfrc_passive[k] - d->qfrc_bias[k] + d->qfrc_applied[k] + d->qfrc_constraint[k] + d->qfrc_actuator[k] +
               own->force[i] * moment[k];
  for (k = 1; k < m->nbody; k++)
    mj_applyFT(m, d, d->xfrc_applied + 6 * k, d->xfrc_applied + 6 * k + 3, d->xipos + 3 * k, k, force);
  mj_solveM(m, d, moved, moment, 1);
  for (k = 0; k < m->nv; k++) {
    inverse += moment[k] * moved[k];
    other += force[k] * moved[k];
  }
  mj_freeStack(d);
  p[MASS] = 1.0 / fmax(inverse, 1.0 / HELD);
  p[GRAVITY] = other;
}

static double tension(const double *x, const double *u, const double *c)
{
  double o[MODEL_OUTPUTS + 1];
  model_outputs(x, u, c, o);
  return o[FORCE];
}

/* A step h of MuJoCo: the states at its end, and the integrals of the tension times the time left and times the time
   past. */
static int advance(model_solver *s, const double *u, const double *c, double h, double *left, double *past)
{
  const double still[MODEL_INPUTS + 1] = {0.0};
  double before, middle, after = tension(s->x, u, c), x[MODEL_STATES];
  *left = *past = 0.0;
  model_set_segment(s, h, u, still);
  while (s->t < h) {
    const int failed = model_step(s, c);
    if (failed) return failed;
    model_state_at(s, c, s->t_before + 0.5 * (s->t - s->t_before), x);
    before = after;
    middle = 4.0 * tension(x, u, c);
    after = tension(s->x, u, c);
    {
      const double weight = (s->t - s->t_before) / 6.0, half = 0.5 * (s->t + s->t_before);
      const double all = weight * (before + middle + after);
      const double moment = weight * (before * s->t_before + middle * half + after * s->t);
      *past += moment;
      *left += h * all - moment;
    }
  }
  return isfinite(*left) && isfinite(*past) ? MODEL_DONE : MODEL_NOT_FINITE;
}

/* Whether an actuator is the first of exported muscles at a degree of freedom. */
static int is_first(const mjModel *m, const mjData *d, int i, int dof)
{
  int other, k;
  for (other = 0; other < i; other++) {
    const int instance = m->actuator_plugin[other];
    if (instance < 0 || strncmp(mjp_getPluginAtSlot(m->plugin[instance])->name, "airmuscle.", 10) != 0) continue;
    for (k = 0; k < d->moment_rownnz[other]; k++)
      if (d->moment_colind[d->moment_rowadr[other] + k] == dof) return 0;
  }
  return 1;
}

/* MuJoCo takes the damping of a joint at the velocity after the step, which is an error of first order; with half the
   change of velocity, estimated by the last acceleration, it is that of the mean velocity. */
static void centre_damping(const mjModel *m, mjData *d, int i)
{
  int k;
  for (k = 0; k < d->moment_rownnz[i]; k++) {
    const int dof = d->moment_colind[d->moment_rowadr[i] + k];
    if (m->dof_damping[dof] > 0.0 && is_first(m, d, i, dof))
      d->qfrc_passive[dof] += 0.5 * m->opt.timestep * m->dof_damping[dof] * d->qacc[dof];
  }
}

/* The states after a step of MuJoCo as mean rates, and the force over it. */
static void integrate(const mjModel *m, mjData *d, muscle *own, int i, double *u, double *x)
{
  const double h = m->opt.timestep, *act = d->act + m->actuator_actadr[i];
  double c[MODEL_PRECOMPUTED + 1], last = act[ACT - 1], left, past, *rate = d->act_dot + m->actuator_actadr[i];
  model_solver s;
  int k;
  centre_damping(m, d, i);
  load_of(m, d, own, i, own->p);
  model_prepare(own->p, c);
  if (last == 0.0) last = tension(x, u, c); /* the first step */
  x[SPEED] += 0.5 * h * (last / own->p[MASS] - own->p[GRAVITY]);
  model_begin(&s, 0.0, x);
  s.h = 0.0;
  if (advance(&s, u, c, h, &left, &past)) {
    if (d->time == 0.0 && mju_norm(act, ACT) == 0.0) { /* MuJoCo tries a compiled model before its states are set */
      mju_zero(rate, ACT);
      own->force[i] = 0.0;
      return;
    }
    mju_error("@name@: the muscle of actuator %d cannot be integrated from %.6g s on; its states in act (of which a "
              "mass or a temperature of 0 is none, see initialise) or its load are not physical, or the step of %.4g s "
              "is too large for the other parts of the model", i, d->time, h);
  }
  for (k = 0; k < MODEL_STATES - 2; k++) rate[k] = (s.x[own_states[k]] - act[k]) / h;
  rate[ACT - 1] = (2.0 * past / (h * h) - act[ACT - 1]) / h;
  own->force[i] = left / (h * h) + 0.5 * last;
}

/* An estimate of the fastest rate constant [1/s] of the muscle: the change of the rates over a step of Euler's method. */
static double fastest(const double *x, const double *u, const double *c, const double *f, double h)
{
  double moved[MODEL_STATES], g[MODEL_STATES], step = 0.0, change = 0.0;
  int k;
  memcpy(moved, x, sizeof moved);
  for (k = 0; k < MODEL_STATES - 2; k++) moved[own_states[k]] += 1e-3 * h * f[own_states[k]];
  model_rhs(moved, u, c, g);
  for (k = 0; k < MODEL_STATES - 2; k++) {
    const int j = own_states[k];
    step += pow((moved[j] - x[j]) / model_nominal[j], 2);
    change += pow((g[j] - f[j]) / model_nominal[j], 2);
  }
  return step > 0.0 ? sqrt(change / step) : 0.0;
}

static void act_dot(const mjModel *m, mjData *d, int instance)
{
  muscle *own = muscle_of(d, instance);
  const double h = m->opt.timestep;
  double u[MODEL_INPUTS + 1], x[MODEL_STATES], f[MODEL_STATES], c[MODEL_PRECOMPUTED + 1];
  int i, k;
  for (i = 0; i < m->nu; i++)
    if (m->actuator_plugin[i] == instance) {
      if (!isfinite(d->ctrl[i])) { /* states and force remain; of NaN MuJoCo warns by itself */
        if (isinf(d->ctrl[i])) mj_warning(d, mjWARN_BADCTRL, i);
        mju_zero(d->act_dot + m->actuator_actadr[i], ACT);
        continue;
      }
      point_of(m, d, own, i, u, x);
      if (m->opt.integrator != mjINT_RK4) {
        integrate(m, d, own, i, u, x);
        continue;
      }
      model_prepare(own->p, c);
      model_rhs(x, u, c, f);
      own->force[i] = tension(x, u, c);
      for (k = 0; k < MODEL_STATES - 2; k++) d->act_dot[m->actuator_actadr[i] + k] = f[own_states[k]];
      d->act_dot[m->actuator_actadr[i] + ACT - 1] = 0.0;
      if (!own->warned && h * fastest(x, u, c, f, h) > 2.0) {
        own->warned = 1;
        mju_warning("@name@: a step of %.4g s does not resolve the muscle under RK4; use Euler or implicitfast, under "
                    "which it is integrated within the step, or a smaller step", h);
      }
    }
}

static void compute(const mjModel *m, mjData *d, int instance, int capability)
{
  int i;
  (void)capability;
  for (i = 0; i < m->nu; i++)
    if (m->actuator_plugin[i] == instance) d->actuator_force[i] = -muscle_of(d, instance)->force[i];
}

mjPLUGIN_LIB_INIT(model_plugin)
{
  mjpPlugin plugin;
  mjp_defaultPlugin(&plugin);
  plugin.name = "@name@";
  plugin.nattribute = ATTRIBUTES;
  plugin.attributes = attributes;
  plugin.capabilityflags = mjPLUGIN_ACTUATOR;
  plugin.nstate = state_count;
  plugin.init = init;
  plugin.destroy = destroy;
  plugin.copy = copy;
  plugin.reset = reset;
  plugin.compute = compute;
  plugin.actuator_act_dot = act_dot;
  mjp_registerPlugin(&plugin);
}
