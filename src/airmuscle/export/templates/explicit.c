/* Explicit Runge-Kutta method of fixed step size; the last step of a segment is shortened. */

static void model_advance(const model_solver *s, const double *c, double t, const double *y, double h, double *yn)
{
  double k[MODEL_STAGES][MODEL_STATES], x[MODEL_STATES], u[MODEL_INPUTS + 1];
  int stage, j, i;
  for (stage = 0; stage < MODEL_STAGES; stage++) {
    model_inputs_at(s, t + NODES[stage] * h, u);
    for (i = 0; i < MODEL_STATES; i++) x[i] = 0.0;
    for (j = 0; j < stage; j++)
      if (ROWS[stage][j] != 0.0)
        for (i = 0; i < MODEL_STATES; i++) x[i] += ROWS[stage][j] * k[j][i];
    for (i = 0; i < MODEL_STATES; i++) x[i] = y[i] + h * x[i];
    model_rhs(x, u, c, k[stage]);
  }
  for (i = 0; i < MODEL_STATES; i++) x[i] = 0.0;
  for (stage = 0; stage < MODEL_STAGES; stage++)
    for (i = 0; i < MODEL_STATES; i++) x[i] += WEIGHTS[stage] * k[stage][i];
  for (i = 0; i < MODEL_STATES; i++) yn[i] = y[i] + h * x[i];
}

int model_step(model_solver *s, const double *c)
{
  const long total = (long)ceil((s->end - s->start) / s->h - 1e-6);
  const double reached = s->done + 1 >= total ? s->end : s->start + (double)(s->done + 1) * s->h;
  double yn[MODEL_STATES], size = 0.0;
  int i;
  model_advance(s, c, s->t, s->x, s->done + 1 < total ? s->h : s->end - s->t, yn);
  for (i = 0; i < MODEL_STATES; i++) {
    s->x_before[i] = s->x[i];
    s->x[i] = yn[i];
    size += fabs(yn[i]);
  }
  if (!(size < 1e300)) return MODEL_NOT_FINITE;
  s->t_before = s->t;
  s->t = reached;
  s->done++;
  s->steps++;
  return MODEL_DONE;
}

void model_state_at(const model_solver *s, const double *c, double time, double *x)
{
  int i;
  if (time >= s->t - MODEL_CLOSE || s->steps == 0)
    for (i = 0; i < MODEL_STATES; i++) x[i] = s->x[i];
  else
    model_advance(s, c, s->t_before, s->x_before, time - s->t_before, x);
}
