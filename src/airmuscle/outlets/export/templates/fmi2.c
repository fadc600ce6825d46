@provenance@
/* Functions of FMI 2.0, Model Exchange and Co-Simulation. */
#include "fmi2Functions.h"
#include "@file@_instance.h"

typedef struct {
  model_instance m;
  fmi2CallbackLogger logger;
  fmi2ComponentEnvironment environment;
  char name[256];
  int warns;
} Component;
#define C ((Component *)c)
#define UNUSED(x) ((void)(x))

static void report(void *owner, int is_error, const char *text)
{
  Component *i = owner;
  if (i->logger && (is_error || i->warns))
    i->logger(i->environment, i->name, is_error ? fmi2Error : fmi2Warning,
              is_error ? "logStatusError" : "logStatusWarning", "%s", text);
}

static fmi2Status refuse(fmi2Component c, const char *text)
{
  report(c, 1, text);
  return fmi2Error;
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[])
{
  size_t i;
  int named = n == 0;
  for (i = 0; i < n; i++) named |= strcmp(categories[i], "logStatusWarning") == 0;
  if (named) ((Component *)c)->warns = on != fmi2False;
  return fmi2OK;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging)
{
  Component *i;
  UNUSED(type), UNUSED(resources), UNUSED(visible);
  if (!functions) return NULL;
  if (!name || !name[0] || !guid || strcmp(guid, MODEL_TOKEN) != 0) {
    if (functions->logger)
      functions->logger(functions->componentEnvironment, name ? name : "?", fmi2Error, "logStatusError",
                        "the instance has no name, or its GUID is not that of this FMU");
    return NULL;
  }
  i = calloc(1, sizeof *i);
  if (!i) return NULL;
  i->logger = functions->logger;
  i->environment = functions->componentEnvironment;
  i->warns = logging != fmi2False;
  strncpy(i->name, name, sizeof i->name - 1);
  model_reset(&i->m);
  return i;
}

void fmi2FreeInstance(fmi2Component c) { free(c); }

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean stop_defined, fmi2Real stop)
{
  UNUSED(stop_defined), UNUSED(stop);
  C->m.s.t = start;
  if (tolerance_defined) model_set_default_tolerance(&C->m, tolerance);
  return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) { UNUSED(c); return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
  model_initialise(&C->m);
  return model_check(&C->m, report, c) ? fmi2Error : fmi2OK;
}
fmi2Status fmi2Terminate(fmi2Component c) { UNUSED(c); return fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) { model_reset(&C->m); return fmi2OK; }

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference v[], size_t n, fmi2Real values[])
{
  size_t i;
  for (i = 0; i < n; i++)
    if (model_get(&C->m, v[i], values + i)) return refuse(c, "a value reference is unknown");
  return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference v[], size_t n, const fmi2Real values[])
{
  char text[480];
  size_t i;
  for (i = 0; i < n; i++)
    if (model_set(&C->m, v[i], values[i])) return refuse(c, model_refusal(v[i], values[i], text, sizeof text));
  return fmi2OK;
}

#define ABSENT(type, kind)                                                                                       \
  fmi2Status fmi2Get##kind(fmi2Component c, const fmi2ValueReference v[], size_t n, type values[])               \
  {                                                                                                              \
    UNUSED(v), UNUSED(values);                                                                                   \
    return n ? refuse(c, "all variables are real numbers") : fmi2OK;                                             \
  }                                                                                                              \
  fmi2Status fmi2Set##kind(fmi2Component c, const fmi2ValueReference v[], size_t n, const type values[])         \
  {                                                                                                              \
    UNUSED(v), UNUSED(values);                                                                                   \
    return n ? refuse(c, "all variables are real numbers") : fmi2OK;                                             \
  }
ABSENT(fmi2Integer, Integer)
ABSENT(fmi2Boolean, Boolean)
ABSENT(fmi2String, String)

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
  if (!*state) *state = malloc(sizeof(model_instance));
  if (!*state) return refuse(c, "no memory for the state");
  memcpy(*state, &C->m, sizeof(model_instance));
  return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
  if (!state) return refuse(c, "there is no state to set");
  memcpy(&C->m, state, sizeof(model_instance));
  return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
  UNUSED(c);
  if (state) {
    free(*state);
    *state = NULL;
  }
  return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
  UNUSED(c), UNUSED(state);
  *size = sizeof(MODEL_TOKEN) + sizeof(model_instance);
  return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
  if (!state || size < sizeof(MODEL_TOKEN) + sizeof(model_instance)) return refuse(c, "the serialised state is too short");
  memcpy(bytes, MODEL_TOKEN, sizeof(MODEL_TOKEN));
  memcpy(bytes + sizeof(MODEL_TOKEN), state, sizeof(model_instance));
  return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
  if (size != sizeof(MODEL_TOKEN) + sizeof(model_instance) || memcmp(bytes, MODEL_TOKEN, sizeof(MODEL_TOKEN)) != 0)
    return refuse(c, "the serialised state is that of another FMU");
  if (!*state) *state = malloc(sizeof(model_instance));
  if (!*state) return refuse(c, "no memory for the state");
  memcpy(*state, bytes + sizeof(MODEL_TOKEN), sizeof(model_instance));
  return fmi2OK;
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknowns[], size_t n,
                                        const fmi2ValueReference knowns[], size_t k, const fmi2Real seed[],
                                        fmi2Real result[])
{
  return model_forward(&C->m, unknowns, n, knowns, k, seed, result)
           ? refuse(c, "derivatives are those of rates, states and outputs with respect to states and inputs")
           : fmi2OK;
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference v[], size_t n,
                                       const fmi2Integer order[], const fmi2Real values[])
{
  size_t i;
  for (i = 0; i < n; i++) {
    if (order[i] != 1 || v[i] < MODEL_FIRST_INPUT || v[i] >= MODEL_FIRST_INPUT + MODEL_LINEAR_INPUTS || !isfinite(values[i]))
      return refuse(c, "derivatives are accepted of inputs, of order one, and finite");
    C->m.w[v[i] - MODEL_FIRST_INPUT] = values[i];
  }
  return fmi2OK;
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference v[], size_t n,
                                        const fmi2Integer order[], fmi2Real values[])
{
  UNUSED(v), UNUSED(order), UNUSED(values);
  return n ? refuse(c, "there are no derivatives of outputs") : fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_return)
{
  UNUSED(no_return);
  return model_do_step(&C->m, t, h, report, c) ? fmi2Error : fmi2OK;
}

fmi2Status fmi2CancelStep(fmi2Component c) { return refuse(c, "steps are not asynchronous"); }

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value)
{
  UNUSED(c), UNUSED(kind), UNUSED(value);
  return fmi2Discard;
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
  if (kind != fmi2LastSuccessfulTime) return fmi2Discard;
  *value = C->m.s.t;
  return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value)
{
  UNUSED(c), UNUSED(kind), UNUSED(value);
  return fmi2Discard;
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)
{
  UNUSED(c), UNUSED(kind), UNUSED(value);
  return fmi2Discard;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value)
{
  UNUSED(c), UNUSED(kind), UNUSED(value);
  return fmi2Discard;
}

/* Model Exchange */
fmi2Status fmi2EnterEventMode(fmi2Component c) { UNUSED(c); return fmi2OK; }
fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) { model_settle(&C->m); return fmi2OK; }

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info)
{
  UNUSED(c);
  memset(info, 0, sizeof *info);
  return fmi2OK;
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_return, fmi2Boolean *event, fmi2Boolean *stop)
{
  UNUSED(no_return);
  *event = *stop = fmi2False;
  return model_check(&C->m, report, c) ? fmi2Error : fmi2OK;
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time) { C->m.s.t = time; return fmi2OK; }

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n)
{
  if (n != MODEL_STATES) return refuse(c, "the number of states is another one");
  memcpy(C->m.s.x, x, sizeof(double) * MODEL_STATES);
  C->m.old_rates = C->m.old_outputs = 1;
  return fmi2OK;
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real f[], size_t n)
{
  if (n != MODEL_STATES) return refuse(c, "the number of states is another one");
  model_ready(&C->m);
  model_rhs(C->m.s.x, C->m.u, C->m.c, f);
  return fmi2OK;
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real z[], size_t n)
{
  if (n != MODEL_INDICATORS) return refuse(c, "the number of event indicators is another one");
  model_get_indicators(&C->m, z);
  return fmi2OK;
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n)
{
  if (n != MODEL_STATES) return refuse(c, "the number of states is another one");
  memcpy(x, C->m.s.x, sizeof(double) * MODEL_STATES);
  return fmi2OK;
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x[], size_t n)
{
  if (n != MODEL_STATES) return refuse(c, "the number of states is another one");
  memcpy(x, model_nominal, sizeof(double) * MODEL_STATES);
  return fmi2OK;
}
