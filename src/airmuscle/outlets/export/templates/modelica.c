/* Functions that Modelica calls: rates and outputs at a state, under inputs, for parameters. */
#include "@file@.h"
#include "@file@.c"

void model_modelica_rates(const double *x, const double *u, const double *p, double *f);
void model_modelica_outputs(const double *x, const double *u, const double *p, double *o);

void model_modelica_rates(const double *x, const double *u, const double *p, double *f)
{
  double c[MODEL_PRECOMPUTED + 1];
  model_prepare(p, c);
  model_rhs(x, u, c, f);
}

void model_modelica_outputs(const double *x, const double *u, const double *p, double *o)
{
  double c[MODEL_PRECOMPUTED + 1];
  model_prepare(p, c);
  model_outputs(x, u, c, o);
}
