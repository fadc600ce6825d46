/* Constants of the sample; deviations from the operating point, scaled. */
@tables@
@functions@
static void @sample@(const @number@ *restrict measurement, const @number@ *restrict setpoint, const @number@ *restrict memory, const @number@ *restrict parameters, @number@ *restrict command, @number@ *restrict later)
{
@work@
  @number@ y[@measured@], r[@controlled@];
  @number@ *predicted = later + @predicted_at@, *plan = later + @plan_at@, *inputs = later + @inputs_at@;
  @number@ *active = later + @active_at@;
  int counts[2], i;
  (void)parameters;
  for (i = 0; i < @memories@; i++) later[i] = memory[i];
  for (i = 0; i < @measured@; i++) y[i] = measurement[i] - @prefix@at_measured[i];
  for (i = 0; i < @controlled@; i++) r[i] = setpoint[i] - @prefix@at_controlled[i];
  for (i = 0; i < 2; i++) counts[i] = (int)memory[@counts_at@ + i];
  predictive_sample(@arguments@);
  for (i = 0; i < 2; i++) later[@counts_at@ + i] = (@number@)counts[i];
  for (i = 0; i < @commands@; i++) command[i] = @prefix@operating[i] + @prefix@sizes[i] * inputs[i];
}
