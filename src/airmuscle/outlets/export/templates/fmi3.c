@provenance@
/* Functions of FMI 3.0, Model Exchange and Co-Simulation. */
#include "fmi3Functions.h"
#include "@file@_instance.h"
@adjoint@
typedef struct {
  model_instance m;
  fmi3LogMessageCallback log;
  fmi3InstanceEnvironment environment;
  int warns;
} Component;
#define C ((Component *)instance)
#define UNUSED(x) ((void)(x))

static void report(void *owner, int is_error, const char *text)
{
  Component *i = owner;
  if (i->log && (is_error || i->warns))
    i->log(i->environment, is_error ? fmi3Error : fmi3Warning, is_error ? "logStatusError" : "logStatusWarning", text);
}

static fmi3Status refuse(fmi3Instance instance, const char *text)
{
  report(instance, 1, text);
  return fmi3Error;
}

static fmi3Status none(fmi3Instance instance, size_t count)
{
  return count ? refuse(instance, "all variables are of the type Float64") : fmi3OK;
}

static fmi3Instance create(fmi3String name, fmi3String token, fmi3InstanceEnvironment environment,
                           fmi3LogMessageCallback log, fmi3Boolean warns)
{
  Component *i;
  if (!name || !name[0] || !token || strcmp(token, MODEL_TOKEN) != 0) {
    if (log)
      log(environment, fmi3Error, "logStatusError", "the instance has no name, or its token is not that of this FMU");
    return NULL;
  }
  i = calloc(1, sizeof *i);
  if (!i) return NULL;
  i->log = log;
  i->environment = environment;
  i->warns = warns;
  model_reset(&i->m);
  return i;
}

const char *fmi3GetVersion(void)
{
  return fmi3Version;
}

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories,
                               const fmi3String categories[])
{
  size_t i;
  int named = nCategories == 0;
  for (i = 0; i < nCategories; i++) named |= strcmp(categories[i], "logStatusWarning") == 0;
  if (named) C->warns = loggingOn;
  return fmi3OK;
}

/* Instances */

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken,
                                          fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                          fmi3InstanceEnvironment instanceEnvironment,
                                          fmi3LogMessageCallback logMessage)
{
  UNUSED(resourcePath), UNUSED(visible);
  return create(instanceName, instantiationToken, instanceEnvironment, logMessage, loggingOn);
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String instanceName, fmi3String instantiationToken,
                                         fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                         fmi3Boolean eventModeUsed, fmi3Boolean earlyReturnAllowed,
                                         const fmi3ValueReference requiredIntermediateVariables[],
                                         size_t nRequiredIntermediateVariables,
                                         fmi3InstanceEnvironment instanceEnvironment,
                                         fmi3LogMessageCallback logMessage,
                                         fmi3IntermediateUpdateCallback intermediateUpdate)
{
  UNUSED(resourcePath), UNUSED(visible), UNUSED(earlyReturnAllowed),
    UNUSED(requiredIntermediateVariables), UNUSED(nRequiredIntermediateVariables), UNUSED(intermediateUpdate);
  if (eventModeUsed) {
    if (logMessage) logMessage(instanceEnvironment, fmi3Error, "logStatusError", "there is no event mode");
    return NULL;
  }
  return create(instanceName, instantiationToken, instanceEnvironment, logMessage, loggingOn);
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String instanceName, fmi3String instantiationToken,
                                               fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                               fmi3InstanceEnvironment instanceEnvironment,
                                               fmi3LogMessageCallback logMessage,
                                               fmi3ClockUpdateCallback clockUpdate,
                                               fmi3LockPreemptionCallback lockPreemption,
                                               fmi3UnlockPreemptionCallback unlockPreemption)
{
  UNUSED(instanceName), UNUSED(instantiationToken), UNUSED(resourcePath), UNUSED(visible), UNUSED(loggingOn),
    UNUSED(instanceEnvironment), UNUSED(logMessage), UNUSED(clockUpdate), UNUSED(lockPreemption),
    UNUSED(unlockPreemption);
  return NULL;
}

void fmi3FreeInstance(fmi3Instance instance)
{
  free(instance);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                       fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime)
{
  UNUSED(stopTimeDefined), UNUSED(stopTime);
  C->m.s.t = startTime;
  if (toleranceDefined) model_set_default_tolerance(&C->m, tolerance);
  return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
  model_initialise(&C->m);
  return model_check(&C->m, report, instance) ? fmi3Error : fmi3OK;
}

fmi3Status fmi3EnterEventMode(fmi3Instance instance)
{
  UNUSED(instance);
  return fmi3OK;
}

fmi3Status fmi3Terminate(fmi3Instance instance)
{
  UNUSED(instance);
  return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance instance)
{
  model_reset(&C->m);
  return fmi3OK;
}

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                          size_t nValueReferences, fmi3Float64 values[], size_t nValues)
{
  size_t i;
  if (nValues != nValueReferences) return refuse(instance, "every variable has one value");
  for (i = 0; i < nValues; i++)
    if (model_get(&C->m, valueReferences[i], values + i)) return refuse(instance, "a value reference is unknown");
  return fmi3OK;
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                          size_t nValueReferences, const fmi3Float64 values[], size_t nValues)
{
  char text[480];
  size_t i;
  if (nValues != nValueReferences) return refuse(instance, "every variable has one value");
  for (i = 0; i < nValues; i++)
    if (model_set(&C->m, valueReferences[i], values[i]))
      return refuse(instance, model_refusal(valueReferences[i], values[i], text, sizeof text));
  return fmi3OK;
}

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
  if (!*FMUState) *FMUState = malloc(sizeof(model_instance));
  if (!*FMUState) return refuse(instance, "no memory for the state");
  memcpy(*FMUState, &C->m, sizeof(model_instance));
  return fmi3OK;
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState)
{
  if (!FMUState) return refuse(instance, "there is no state to set");
  memcpy(&C->m, FMUState, sizeof(model_instance));
  return fmi3OK;
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
  UNUSED(instance);
  if (FMUState) {
    free(*FMUState);
    *FMUState = NULL;
  }
  return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size)
{
  UNUSED(instance), UNUSED(FMUState);
  *size = sizeof(MODEL_TOKEN) + sizeof(model_instance);
  return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState, fmi3Byte serializedState[],
                                 size_t size)
{
  if (!FMUState || size < sizeof(MODEL_TOKEN) + sizeof(model_instance))
    return refuse(instance, "the serialised state is too short");
  memcpy(serializedState, MODEL_TOKEN, sizeof(MODEL_TOKEN));
  memcpy(serializedState + sizeof(MODEL_TOKEN), FMUState, sizeof(model_instance));
  return fmi3OK;
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[], size_t size,
                                   fmi3FMUState *FMUState)
{
  if (size != sizeof(MODEL_TOKEN) + sizeof(model_instance) ||
      memcmp(serializedState, MODEL_TOKEN, sizeof(MODEL_TOKEN)) != 0)
    return refuse(instance, "the serialised state is that of another FMU");
  if (!*FMUState) *FMUState = malloc(sizeof(model_instance));
  if (!*FMUState) return refuse(instance, "no memory for the state");
  memcpy(*FMUState, serializedState + sizeof(MODEL_TOKEN), sizeof(model_instance));
  return fmi3OK;
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[],
                                        size_t nUnknowns, const fmi3ValueReference knowns[], size_t nKnowns,
                                        const fmi3Float64 seed[], size_t nSeed, fmi3Float64 sensitivity[],
                                        size_t nSensitivity)
{
  if (nSeed != nKnowns || nSensitivity != nUnknowns) return refuse(instance, "the number of seeds or results does not fit");
  return model_forward(&C->m, unknowns, nUnknowns, knowns, nKnowns, seed, sensitivity)
           ? refuse(instance, "derivatives are those of rates, states and outputs with respect to states and inputs")
           : fmi3OK;
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                    const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                    size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity)
{
  if (nSeed != nUnknowns || nSensitivity != nKnowns) return refuse(instance, "the number of seeds or results does not fit");
  return model_backward(&C->m, unknowns, nUnknowns, knowns, nKnowns, seed, sensitivity)
           ? refuse(instance, "derivatives are those of rates, states and outputs with respect to states and inputs")
           : fmi3OK;
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance)
{
  UNUSED(instance);
  return fmi3OK;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate,
                                    fmi3Boolean *terminateSimulation,
                                    fmi3Boolean *nominalsOfContinuousStatesChanged,
                                    fmi3Boolean *valuesOfContinuousStatesChanged, fmi3Boolean *nextEventTimeDefined,
                                    fmi3Float64 *nextEventTime)
{
  UNUSED(instance);
  *discreteStatesNeedUpdate = *terminateSimulation = fmi3False;
  *nominalsOfContinuousStatesChanged = *valuesOfContinuousStatesChanged = *nextEventTimeDefined = fmi3False;
  *nextEventTime = 0.0;
  return fmi3OK;
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance)
{
  model_settle(&C->m);
  return fmi3OK;
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi3Boolean *enterEventMode, fmi3Boolean *terminateSimulation)
{
  UNUSED(noSetFMUStatePriorToCurrentPoint);
  *enterEventMode = *terminateSimulation = fmi3False;
  return model_check(&C->m, report, instance) ? fmi3Error : fmi3OK;
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time)
{
  C->m.s.t = time;
  return fmi3OK;
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 continuousStates[],
                                   size_t nContinuousStates)
{
  if (nContinuousStates != MODEL_STATES) return refuse(instance, "the number of states is another one");
  memcpy(C->m.s.x, continuousStates, sizeof(double) * MODEL_STATES);
  C->m.old_rates = C->m.old_outputs = 1;
  return fmi3OK;
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 derivatives[],
                                             size_t nContinuousStates)
{
  if (nContinuousStates != MODEL_STATES) return refuse(instance, "the number of states is another one");
  model_ready(&C->m);
  model_rhs(C->m.s.x, C->m.u, C->m.c, derivatives);
  return fmi3OK;
}

fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 eventIndicators[], size_t nEventIndicators)
{
  if (nEventIndicators != MODEL_INDICATORS) return refuse(instance, "the number of event indicators is another one");
  model_get_indicators(&C->m, eventIndicators);
  return fmi3OK;
}

fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 continuousStates[], size_t nContinuousStates)
{
  if (nContinuousStates != MODEL_STATES) return refuse(instance, "the number of states is another one");
  memcpy(continuousStates, C->m.s.x, sizeof(double) * MODEL_STATES);
  return fmi3OK;
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 nominals[],
                                             size_t nContinuousStates)
{
  if (nContinuousStates != MODEL_STATES) return refuse(instance, "the number of states is another one");
  memcpy(nominals, model_nominal, sizeof(double) * MODEL_STATES);
  return fmi3OK;
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *nEventIndicators)
{
  UNUSED(instance);
  *nEventIndicators = MODEL_INDICATORS;
  return fmi3OK;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *nContinuousStates)
{
  UNUSED(instance);
  *nContinuousStates = MODEL_STATES;
  return fmi3OK;
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint,
                      fmi3Float64 communicationStepSize, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                      fmi3Boolean *eventHandlingNeeded, fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn,
                      fmi3Float64 *lastSuccessfulTime)
{
  int failed;
  UNUSED(noSetFMUStatePriorToCurrentPoint);
  *eventHandlingNeeded = *terminateSimulation = *earlyReturn = fmi3False;
  failed = model_do_step(&C->m, currentCommunicationPoint, communicationStepSize, report, instance);
  *lastSuccessfulTime = C->m.s.t;
  return failed ? fmi3Error : fmi3OK;
}

#include "fmi3_absent.h"
