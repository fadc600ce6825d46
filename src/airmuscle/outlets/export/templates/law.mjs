@provenance@
@constants@
@functions@
/**
 * The law at @first@ [@first_unit@] and @second@ [@second_unit@]: an object with @results@. Throws RangeError for
 * parameters beyond their bounds.
 */
export function law(@first@, @second@, p = defaults) {
  const c = new Float64Array(@held@), result = new Float64Array(results.length);
  const wrong = parameters.findIndex((name, i) => !(p[i] >= parameterMinimum[i] && p[i] <= parameterMaximum[i]));
  if (wrong >= 0)
    throw new RangeError(`${parameters[wrong]} is ${p[wrong]}; allowed are ${parameterMinimum[wrong]} to ${parameterMaximum[wrong]}.`);
  prepare(p, c);
  evaluate(@first@, @second@, c, result);
  return Object.fromEntries(results.map((name, i) => [name, result[i]]));
}
