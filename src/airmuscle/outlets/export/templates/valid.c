static int is_valid(const double *x, const double *o)
{
  int i, finite = 1;
  for (i = 0; i < MODEL_STATES; i++)
    if (!isfinite(x[i]) || x[i] < model_state_minimum[i]) finite = 0;
  for (i = 0; i < MODEL_OUTPUTS; i++)
    if (!isfinite(o[i])) finite = 0;
  return finite;
}
