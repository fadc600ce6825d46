
/* result = seed d(unknown)/d(known), the transposed product. */
static int model_backward(model_instance *m, const unsigned *unknown, size_t unknowns, const unsigned *known,
                          size_t knowns, const double *seed, double *result)
{
  double v[MODEL_STATES + MODEL_INPUTS + 1] = {0.0}, rows[MODEL_ROWS + 1] = {0.0}, D[MODEL_PARTIALS + 1];
  size_t i;
  int k;
  if (!model_known(unknown, unknowns, known, knowns)) return 1;
  model_ready(m);
  model_partials(m->s.x, m->u, m->c, D);
  for (i = 0; i < unknowns; i++) {
    const int row = model_row(unknown[i]);
    if (row < 0) v[-1 - row] += seed[i];
    else rows[row] += seed[i];
  }
  for (k = 0; k < MODEL_PARTIALS; k++) v[model_columns[k]] += D[k] * rows[model_rows[k]];
  for (i = 0; i < knowns; i++) result[i] = v[model_variable(known[i])];
  return 0;
}
