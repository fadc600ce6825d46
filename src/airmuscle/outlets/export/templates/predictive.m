% A sample of the controller; its constants are deviations from the operating point, scaled.
function [command, later] = @sample@(measurement, setpoint, memory, parameters)
@tables@
@memory@
  y = measurement(:) - at_measured(:);
  r = setpoint(:) - at_controlled(:);
  [@results@] = predictive_sample(@arguments@);
  command = operating(:) + sizes(:) .* inputs(:);
  later = [@later@];
end

@functions@
