% In addition: controller_parameters, those of the control law; setpoint, with the fields ends, values
% and slopes.
