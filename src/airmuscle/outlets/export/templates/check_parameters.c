int model_check_parameters(const @number@ *p)
{
  int i;
  for (i = 0; i < MODEL_PARAMETERS; i++) {
    if (!isfinite(p[i]) || p[i] < model_parameter_minimum[i] || p[i] > model_parameter_maximum[i]) return i;
  }
  return -1;
}
