/* Rodas4: Rosenbrock method of order four, adaptive, stiffly accurate. Hairer and Wanner, Solving Ordinary Differential
   Equations II (1996), section VI.4, method RODAS. */

static double model_norm(double value, double scale)
{
  return (value / scale) * (value / scale);
}

static double model_first_step(const model_solver *s, const double *f)
{
  double size = 0.0, rate = 0.0, h = s->end - s->t;
  int i;
  for (i = 0; i < MODEL_STATES; i++) {
    const double scale = s->rtol * model_nominal[i] + s->rtol * fabs(s->x[i]);
    size += model_norm(s->x[i], scale);
    rate += model_norm(f[i], scale);
  }
  if (rate > 0.0) h = fmin(h, 0.1 * sqrt(sqrt(s->rtol)) * sqrt((size + 1.0) / rate));
  return h;
}

/* One attempt of size h: the new state yn, and the weighted norm of its error. */
static double model_attempt(model_solver *s, const double *c, double h, const double *f0, const double *ft,
                            const double *J, double *yn)
{
  double A[MODEL_FACTORS + 1], x[MODEL_STATES], g[MODEL_STATES], u[MODEL_INPUTS + 1];
  double k1[MODEL_STATES], k2[MODEL_STATES], k3[MODEL_STATES], k4[MODEL_STATES], k5[MODEL_STATES], k6[MODEL_STATES];
  const double r = 1.0 / h, *y = s->x;
  double error = 0.0;
  int i;
  model_factor(J, r / GAMMA, A);
  for (i = 0; i < MODEL_STATES; i++) g[i] = f0[i] + h * D1 * ft[i];
  model_solve(A, g, k1);
  model_inputs_at(s, s->t + N2 * h, u);
  for (i = 0; i < MODEL_STATES; i++) {
    x[i] = y[i] + A21 * k1[i];
    g[i] = r * (C21 * k1[i]) + h * D2 * ft[i];
  }
  model_stage(x, u, c, A, g, k2);
  model_inputs_at(s, s->t + N3 * h, u);
  for (i = 0; i < MODEL_STATES; i++) {
    x[i] = y[i] + A31 * k1[i] + A32 * k2[i];
    g[i] = r * (C31 * k1[i] + C32 * k2[i]) + h * D3 * ft[i];
  }
  model_stage(x, u, c, A, g, k3);
  model_inputs_at(s, s->t + N4 * h, u);
  for (i = 0; i < MODEL_STATES; i++) {
    x[i] = y[i] + A41 * k1[i] + A42 * k2[i] + A43 * k3[i];
    g[i] = r * (C41 * k1[i] + C42 * k2[i] + C43 * k3[i]) + h * D4 * ft[i];
  }
  model_stage(x, u, c, A, g, k4);
  model_inputs_at(s, s->t + h, u);
  for (i = 0; i < MODEL_STATES; i++) {
    x[i] = y[i] + A51 * k1[i] + A52 * k2[i] + A53 * k3[i] + A54 * k4[i];
    g[i] = r * (C51 * k1[i] + C52 * k2[i] + C53 * k3[i] + C54 * k4[i]);
  }
  model_stage(x, u, c, A, g, k5);
  for (i = 0; i < MODEL_STATES; i++) {
    x[i] += k5[i];
    g[i] = r * (C61 * k1[i] + C62 * k2[i] + C63 * k3[i] + C64 * k4[i] + C65 * k5[i]);
  }
  model_stage(x, u, c, A, g, k6);
  for (i = 0; i < MODEL_STATES; i++) {
    yn[i] = x[i] + k6[i];
    error += model_norm(k6[i], s->rtol * model_nominal[i] + s->rtol * fmax(fabs(y[i]), fabs(yn[i])));
    s->dense[0][i] = H21 * k1[i] + H22 * k2[i] + H23 * k3[i] + H24 * k4[i] + H25 * k5[i];
    s->dense[1][i] = H31 * k1[i] + H32 * k2[i] + H33 * k3[i] + H34 * k4[i] + H35 * k5[i];
  }
  return sqrt(error / MODEL_STATES) + 1e-16;
}

int model_step(model_solver *s, const double *c)
{
  double f0[MODEL_STATES], ft[MODEL_STATES], yn[MODEL_STATES], J[MODEL_JACOBIAN + 1], u[MODEL_INPUTS + 1];
  double factor, error, kept;
  int i, rejected = 0, last;
  model_inputs_at(s, s->t, u);
  model_jac(s->x, u, c, f0, J);
  for (i = 0; i < MODEL_STATES; i++) ft[i] = 0.0;
  if (s->moving) model_df_dt(s->x, u, c, s->w, ft);
  if (s->h <= 0.0) s->h = model_first_step(s, f0);
  for (;;) {
    last = s->t + 1.000001 * s->h >= s->end;
    kept = s->h;
    if (last) s->h = s->end - s->t;
    error = model_attempt(s, c, s->h, f0, ft, J, yn);
    if (!(error < 1e300)) {
      factor = 0.5;
    } else {
      factor = fmin(6.0, fmax(0.2, 0.9 / sqrt(sqrt(error))));
      if (error <= 1.0) break;
    }
    rejected = 1;
    s->rejected++;
    s->h *= factor;
    if (s->h < 1e-14 * fmax(fabs(s->t), s->end - s->start)) return error < 1e300 ? MODEL_STEP_TOO_SMALL : MODEL_NOT_FINITE;
  }
  for (i = 0; i < MODEL_STATES; i++) {
    s->x_before[i] = s->x[i];
    s->x[i] = yn[i];
  }
  s->t_before = s->t;
  s->h_taken = s->h;
  s->t = last ? s->end : s->t + s->h;
  s->steps++;
  s->h *= rejected ? fmin(factor, 1.0) : factor;
  if (last && s->h < kept) s->h = kept; /* a step cut short by the end of a segment does not shorten the next */
  return MODEL_DONE;
}

void model_state_at(const model_solver *s, const double *c, double time, double *x)
{
  const double q = s->h_taken > 0.0 ? (time - s->t_before) / s->h_taken : 1.0, p = 1.0 - q;
  int i;
  (void)c;
  if (!(s->h_taken > 0.0) || time >= s->t) {
    for (i = 0; i < MODEL_STATES; i++) x[i] = s->x[i];
    return;
  }
  for (i = 0; i < MODEL_STATES; i++)
    x[i] = s->x_before[i] * p + q * (s->x[i] + p * (s->dense[0][i] + q * s->dense[1][i]));
}
