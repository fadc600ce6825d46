@provenance@
/* MuJoCo engine plugin: a muscle with its valves as an actuator with states in `act`. The length of the transmission is
   that of the muscle less a constant; its force is the tension, which pulls. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <mujoco/mujoco.h>

#define STATES @states@
#define INPUTS @inputs@
#define OUTPUTS @outputs@
#define PARAMETERS @parameters@
#define PRECOMPUTED @held@
#define SHORTENING @shortening@
#define SPEED @speed@
#define FORCE @force@
/* The control opens the input FIRST; if there is a SECOND (not -1), a negative control opens that one instead. */
#define FIRST @first@
#define SECOND @second@
/* Attributes: the parameters by their paths, then the length of the transmission at which the muscle is at rest. */
#define ATTRIBUTES (PARAMETERS + 1)

@constants@
@functions@
typedef struct {
  double c[PRECOMPUTED + 1], rest;
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
  double p[PARAMETERS + 1];
  muscle *made;
  int i;
  for (i = 0; i < m->nu; i++)
    if (m->actuator_plugin[i] == instance && m->actuator_actnum[i] != STATES) {
      mju_warning("@name@: the actuator needs actdim=\"%d\" and dyntype=\"user\"", STATES);
      return -1;
    }
  made = calloc(1, sizeof *made);
  if (!made) return -1;
  memcpy(p, defaults, sizeof p);
  made->rest = rest_length;
  for (i = 0; i < ATTRIBUTES; i++)
    if (number(m, instance, attributes[i], i < PARAMETERS ? p + i : &made->rest)) {
      mju_warning("@name@: the attribute %s is not a finite number", attributes[i]);
      free(made);
      return -1;
    }
  model_prepare(p, made->c);
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
  (void)m;
  if (muscle_of(to, instance) && muscle_of(from, instance)) *muscle_of(to, instance) = *muscle_of(from, instance);
}

static void reset(const mjModel *m, mjtNum *state, void *data, int instance)
{
  (void)m, (void)state, (void)data, (void)instance;
}

static void inputs_of(const mjModel *m, const mjData *d, const muscle *own, int i, double *u)
{
  double control = d->ctrl[i];
  int k;
  if (m->actuator_ctrllimited[i])
    control = fmin(fmax(control, m->actuator_ctrlrange[2 * i]), m->actuator_ctrlrange[2 * i + 1]);
  for (k = 0; k < INPUTS; k++) u[k] = 0.0;
  if (SECOND >= 0 && control < 0.0) u[SECOND >= 0 ? SECOND : 0] = -control;
  else if (FIRST >= 0) u[FIRST >= 0 ? FIRST : 0] = control;
  u[SHORTENING] = own->rest - d->actuator_length[i];
  u[SPEED] = -d->actuator_velocity[i];
}

static void act_dot(const mjModel *m, mjData *d, int instance)
{
  const muscle *own = muscle_of(d, instance);
  double u[INPUTS + 1];
  int i;
  for (i = 0; i < m->nu; i++)
    if (m->actuator_plugin[i] == instance) {
      inputs_of(m, d, own, i, u);
      model_rhs(d->act + m->actuator_actadr[i], u, own->c, d->act_dot + m->actuator_actadr[i]);
    }
}

static void compute(const mjModel *m, mjData *d, int instance, int capability)
{
  const muscle *own = muscle_of(d, instance);
  double u[INPUTS + 1], o[OUTPUTS + 1];
  int i;
  (void)capability;
  for (i = 0; i < m->nu; i++)
    if (m->actuator_plugin[i] == instance) {
      inputs_of(m, d, own, i, u);
      model_outputs(d->act + m->actuator_actadr[i], u, own->c, o);
      d->actuator_force[i] = -o[FORCE];
    }
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
