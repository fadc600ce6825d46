@steps@
/* Solver: one step at a time within a segment, in which the inputs are linear in time. */

void model_begin(model_solver *s, double t, const double *x)
{
  int i;
  s->t = s->t_before = s->start = s->end = t;
  s->h = MODEL_FIRST_STEP;
  s->h_taken = 0.0;
  s->rtol = MODEL_RTOL;
  s->steps = s->rejected = s->done = 0;
  s->moving = 0;
  for (i = 0; i < MODEL_STATES; i++) s->x[i] = s->x_before[i] = x[i];
}

void model_set_segment(model_solver *s, double end, const double *u, const double *w)
{
  int i;
  s->start = s->t;
  s->end = end;
  s->done = 0;
  s->moving = 0;
  for (i = 0; i < MODEL_INPUTS; i++) {
    s->u[i] = u[i];
    s->w[i] = w[i];
    if (w[i] != 0.0) s->moving = 1;
  }
}

void model_inputs_at(const model_solver *s, double time, double *u)
{
  set_inputs(s->u, time - s->start, s->w, u);
}

int model_step(model_solver *s, const double *c)
{
  @single_step_work@
  double reached, taken, following;
  int i, rejections, result;
  @single_step@
  s->rejected += rejections;
  s->h = following;
  if (result != MODEL_DONE) return result;
  for (i = 0; i < MODEL_STATES; i++) {
    s->x_before[i] = s->x[i];
    s->x[i] = yn[i];
  }
  s->t_before = s->t;
  s->t = reached;
  s->h_taken = taken;
  s->steps++;
  s->done++;
  return MODEL_DONE;
}

void model_state_at(const model_solver *s, const double *c, double time, double *between)
{
  @state_between_work@
  int i;
  (void)c;
  if (s->steps > 0 && time < s->t - MODEL_CLOSE) {
    @state_between@
    return;
  }
  for (i = 0; i < MODEL_STATES; i++) between[i] = s->x[i];
}
