/** A sample of the controller; its constants are deviations from the operating point, scaled. */
export const @sample@ = (() => {
@tables@
@functions@
  return (measurement, setpoint, before, parameters, command, result) => {
@work@
    const later = Float64Array.from(before);
@memory@
    const y = at_measured.map((value, i) => measurement[i] - value);
    const r = at_controlled.map((value, i) => setpoint[i] - value);
    predictive_sample(@arguments@);
    for (let i = 0; i < operating.length; i++) command[i] = operating[i] + sizes[i] * inputs[i];
    for (let i = 0; i < later.length; i++) result[i] = later[i];
  };
})();
