@provenance@
@constants@
@functions@
/**
 * The law at @first@ [@first_unit@] and @second@ [@second_unit@]: an object with @results@.
 */
export function law(@first@, @second@, p = defaults) {
  const c = new Float64Array(@held@), result = new Float64Array(results.length);
  prepare(p, c);
  evaluate(@first@, @second@, c, result);
  return Object.fromEntries(results.map((name, i) => [name, result[i]]));
}
