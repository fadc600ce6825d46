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
  s->refusal = MODEL_DONE;
  for (i = 0; i < MODEL_STATES; i++) s->x[i] = s->x_before[i] = x[i];
}

/* Why an input cannot go from `first` to `last`: a status. Rounding of a ramp may pass the limit by 1e-9 of its size. */
static int input_refusal(int i, double first, double last)
{
  const double slack = 1e-9 * fmax(fabs(first), fabs(last));
  if (!isfinite(first) || !isfinite(last)) return MODEL_NOT_FINITE;
  if (fmin(first, last) < model_input_minimum[i] - slack) return MODEL_OUT_OF_RANGE;
  return fmax(first, last) > model_input_maximum[i] + slack ? MODEL_OUT_OF_RANGE : MODEL_DONE;
}

void model_set_segment(model_solver *s, double end, const double *u, const double *w)
{
  int i;
  s->start = s->t;
  s->end = end;
  s->done = 0;
  s->moving = 0;
  s->refusal = MODEL_DONE;
  for (i = 0; i < MODEL_INPUTS; i++) {
    s->u[i] = u[i];
    s->w[i] = w[i];
    if (w[i] != 0.0) s->moving = 1;
    if (s->refusal == MODEL_DONE)
      s->refusal = input_refusal(i, u[i], w[i] != 0.0 ? u[i] + (end - s->t) * w[i] : u[i]);
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
  if (s->refusal != MODEL_DONE) return s->refusal;
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
