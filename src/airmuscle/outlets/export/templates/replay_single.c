/* Allowed difference, as part of the range of a command (chosen). */
#define TOLERANCE @tolerance@

static const double ranges[MODEL_COMMANDS + 1] = {@ranges@};
static double greatest;

/* Whether a command differs by more than the tolerance from the expected one. */
static int differs(double command, double expected, int i)
{
  const double difference = fabs(command - expected) / ranges[i];
  greatest = fmax(greatest, difference);
  return !(difference <= TOLERANCE);
}

static void print_result(long different)
{
  printf("%d samples, %ld commands differ by more than %g of their range from double precision, the greatest by %.2g",
         SAMPLES, different, TOLERANCE, greatest);
}
