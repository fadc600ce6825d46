/* Functions of FMI 3.0 for types of variables and capabilities that the FMU does not have. */

fmi3Status fmi3GetFloat32(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                          size_t nValueReferences, fmi3Float32 values[], size_t nValues)
{
  UNUSED(valueReferences), UNUSED(values), UNUSED(nValues);
  return none(instance, nValueReferences);
}

fmi3Status fmi3GetInt8(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                       fmi3Int8 values[], size_t nValues)
{
  UNUSED(valueReferences), UNUSED(values), UNUSED(nValues);
  return none(instance, nValueReferences);
}

fmi3Status fmi3GetUInt8(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        fmi3UInt8 values[], size_t nValues)
{
  UNUSED(valueReferences), UNUSED(values), UNUSED(nValues);
  return none(instance, nValueReferences);
}

fmi3Status fmi3GetInt16(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        fmi3Int16 values[], size_t nValues)
{
  UNUSED(valueReferences), UNUSED(values), UNUSED(nValues);
  return none(instance, nValueReferences);
}

fmi3Status fmi3GetUInt16(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         fmi3UInt16 values[], size_t nValues)
{
  UNUSED(valueReferences), UNUSED(values), UNUSED(nValues);
  return none(instance, nValueReferences);
}

fmi3Status fmi3GetInt32(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        fmi3Int32 values[], size_t nValues)
{
  UNUSED(valueReferences), UNUSED(values), UNUSED(nValues);
  return none(instance, nValueReferences);
}

fmi3Status fmi3GetUInt32(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         fmi3UInt32 values[], size_t nValues)
{
  UNUSED(valueReferences), UNUSED(values), UNUSED(nValues);
  return none(instance, nValueReferences);
}

fmi3Status fmi3GetInt64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        fmi3Int64 values[], size_t nValues)
{
  UNUSED(valueReferences), UNUSED(values), UNUSED(nValues);
  return none(instance, nValueReferences);
}

fmi3Status fmi3GetUInt64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         fmi3UInt64 values[], size_t nValues)
{
  UNUSED(valueReferences), UNUSED(values), UNUSED(nValues);
  return none(instance, nValueReferences);
}

fmi3Status fmi3GetBoolean(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                          size_t nValueReferences, fmi3Boolean values[], size_t nValues)
{
  UNUSED(valueReferences), UNUSED(values), UNUSED(nValues);
  return none(instance, nValueReferences);
}

fmi3Status fmi3GetString(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         fmi3String values[], size_t nValues)
{
  UNUSED(valueReferences), UNUSED(values), UNUSED(nValues);
  return none(instance, nValueReferences);
}

fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         size_t valueSizes[], fmi3Binary values[], size_t nValues)
{
  UNUSED(valueReferences), UNUSED(valueSizes), UNUSED(values), UNUSED(nValues);
  return none(instance, nValueReferences);
}

fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        fmi3Clock values[])
{
  UNUSED(valueReferences), UNUSED(values);
  return none(instance, nValueReferences);
}

fmi3Status fmi3SetFloat32(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                          size_t nValueReferences, const fmi3Float32 values[], size_t nValues)
{
  UNUSED(valueReferences), UNUSED(values), UNUSED(nValues);
  return none(instance, nValueReferences);
}

fmi3Status fmi3SetInt8(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                       const fmi3Int8 values[], size_t nValues)
{
  UNUSED(valueReferences), UNUSED(values), UNUSED(nValues);
  return none(instance, nValueReferences);
}

fmi3Status fmi3SetUInt8(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        const fmi3UInt8 values[], size_t nValues)
{
  UNUSED(valueReferences), UNUSED(values), UNUSED(nValues);
  return none(instance, nValueReferences);
}

fmi3Status fmi3SetInt16(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        const fmi3Int16 values[], size_t nValues)
{
  UNUSED(valueReferences), UNUSED(values), UNUSED(nValues);
  return none(instance, nValueReferences);
}

fmi3Status fmi3SetUInt16(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         const fmi3UInt16 values[], size_t nValues)
{
  UNUSED(valueReferences), UNUSED(values), UNUSED(nValues);
  return none(instance, nValueReferences);
}

fmi3Status fmi3SetInt32(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        const fmi3Int32 values[], size_t nValues)
{
  UNUSED(valueReferences), UNUSED(values), UNUSED(nValues);
  return none(instance, nValueReferences);
}

fmi3Status fmi3SetUInt32(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         const fmi3UInt32 values[], size_t nValues)
{
  UNUSED(valueReferences), UNUSED(values), UNUSED(nValues);
  return none(instance, nValueReferences);
}

fmi3Status fmi3SetInt64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        const fmi3Int64 values[], size_t nValues)
{
  UNUSED(valueReferences), UNUSED(values), UNUSED(nValues);
  return none(instance, nValueReferences);
}

fmi3Status fmi3SetUInt64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         const fmi3UInt64 values[], size_t nValues)
{
  UNUSED(valueReferences), UNUSED(values), UNUSED(nValues);
  return none(instance, nValueReferences);
}

fmi3Status fmi3SetBoolean(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                          size_t nValueReferences, const fmi3Boolean values[], size_t nValues)
{
  UNUSED(valueReferences), UNUSED(values), UNUSED(nValues);
  return none(instance, nValueReferences);
}

fmi3Status fmi3SetString(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         const fmi3String values[], size_t nValues)
{
  UNUSED(valueReferences), UNUSED(values), UNUSED(nValues);
  return none(instance, nValueReferences);
}

fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         const size_t valueSizes[], const fmi3Binary values[], size_t nValues)
{
  UNUSED(valueReferences), UNUSED(valueSizes), UNUSED(values), UNUSED(nValues);
  return none(instance, nValueReferences);
}

fmi3Status fmi3SetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        const fmi3Clock values[])
{
  UNUSED(valueReferences), UNUSED(values);
  return none(instance, nValueReferences);
}

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance instance, fmi3ValueReference valueReference,
                                               size_t *nDependencies)
{
  UNUSED(valueReference), UNUSED(nDependencies);
  return refuse(instance, "this function belongs to a capability that the FMU does not have");
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance instance, fmi3ValueReference dependent,
                                       size_t elementIndicesOfDependent[], fmi3ValueReference independents[],
                                       size_t elementIndicesOfIndependents[], fmi3DependencyKind dependencyKinds[],
                                       size_t nDependencies)
{
  UNUSED(dependent), UNUSED(elementIndicesOfDependent), UNUSED(independents), UNUSED(elementIndicesOfIndependents),
    UNUSED(dependencyKinds), UNUSED(nDependencies);
  return refuse(instance, "this function belongs to a capability that the FMU does not have");
}

fmi3Status fmi3EnterConfigurationMode(fmi3Instance instance)
{
  return refuse(instance, "this function belongs to a capability that the FMU does not have");
}

fmi3Status fmi3ExitConfigurationMode(fmi3Instance instance)
{
  return refuse(instance, "this function belongs to a capability that the FMU does not have");
}

fmi3Status fmi3GetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                  size_t nValueReferences, fmi3Float64 intervals[],
                                  fmi3IntervalQualifier qualifiers[])
{
  UNUSED(valueReferences), UNUSED(nValueReferences), UNUSED(intervals), UNUSED(qualifiers);
  return refuse(instance, "this function belongs to a capability that the FMU does not have");
}

fmi3Status fmi3GetIntervalFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                   size_t nValueReferences, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
                                   fmi3IntervalQualifier qualifiers[])
{
  UNUSED(valueReferences), UNUSED(nValueReferences), UNUSED(counters), UNUSED(resolutions), UNUSED(qualifiers);
  return refuse(instance, "this function belongs to a capability that the FMU does not have");
}

fmi3Status fmi3GetShiftDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                               size_t nValueReferences, fmi3Float64 shifts[])
{
  UNUSED(valueReferences), UNUSED(nValueReferences), UNUSED(shifts);
  return refuse(instance, "this function belongs to a capability that the FMU does not have");
}

fmi3Status fmi3GetShiftFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                size_t nValueReferences, fmi3UInt64 counters[], fmi3UInt64 resolutions[])
{
  UNUSED(valueReferences), UNUSED(nValueReferences), UNUSED(counters), UNUSED(resolutions);
  return refuse(instance, "this function belongs to a capability that the FMU does not have");
}

fmi3Status fmi3SetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                  size_t nValueReferences, const fmi3Float64 intervals[])
{
  UNUSED(valueReferences), UNUSED(nValueReferences), UNUSED(intervals);
  return refuse(instance, "this function belongs to a capability that the FMU does not have");
}

fmi3Status fmi3SetIntervalFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                   size_t nValueReferences, const fmi3UInt64 counters[],
                                   const fmi3UInt64 resolutions[])
{
  UNUSED(valueReferences), UNUSED(nValueReferences), UNUSED(counters), UNUSED(resolutions);
  return refuse(instance, "this function belongs to a capability that the FMU does not have");
}

fmi3Status fmi3SetShiftDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                               size_t nValueReferences, const fmi3Float64 shifts[])
{
  UNUSED(valueReferences), UNUSED(nValueReferences), UNUSED(shifts);
  return refuse(instance, "this function belongs to a capability that the FMU does not have");
}

fmi3Status fmi3SetShiftFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                size_t nValueReferences, const fmi3UInt64 counters[],
                                const fmi3UInt64 resolutions[])
{
  UNUSED(valueReferences), UNUSED(nValueReferences), UNUSED(counters), UNUSED(resolutions);
  return refuse(instance, "this function belongs to a capability that the FMU does not have");
}

fmi3Status fmi3EnterStepMode(fmi3Instance instance)
{
  return refuse(instance, "this function belongs to a capability that the FMU does not have");
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                    size_t nValueReferences, const fmi3Int32 orders[], fmi3Float64 values[],
                                    size_t nValues)
{
  UNUSED(valueReferences), UNUSED(nValueReferences), UNUSED(orders), UNUSED(values), UNUSED(nValues);
  return refuse(instance, "this function belongs to a capability that the FMU does not have");
}

fmi3Status fmi3ActivateModelPartition(fmi3Instance instance, fmi3ValueReference clockReference,
                                      fmi3Float64 activationTime)
{
  UNUSED(clockReference), UNUSED(activationTime);
  return refuse(instance, "this function belongs to a capability that the FMU does not have");
}
