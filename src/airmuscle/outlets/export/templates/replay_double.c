/* Whether a command has other bits than the expected one. */
static int differs(double command, double expected, int i)
{
  (void)i;
  return memcmp(&command, &expected, sizeof expected) != 0;
}

static void print_result(long different)
{
  printf("%d samples, %ld commands differ", SAMPLES, different);
}
