@provenance@
/* Replay of a recorded run in single precision. The expected commands are those of double precision. */
#include "@file@.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define SAMPLES @samples@
/* Allowed difference, as part of the range of a command (chosen). */
#define TOLERANCE @tolerance@

@ranges@@tables@
int main(void)
{
  float memory[MODEL_MEMORY + 1], command[MODEL_COMMANDS + 1] = {0.0f};
  double greatest = 0.0;
  long different = 0;
  int k, i;
  memcpy(memory, model_initial_memory, sizeof memory);
  for (k = 0; k < SAMPLES; k++) {
    if (model_step(memory, measured[k], setpoints[k], command) != 0) {
      printf("sample %d: a measurement or a command is not finite\n", k);
      return 1;
    }
    for (i = 0; i < MODEL_COMMANDS; i++) {
      const double difference = fabs((double)command[i] - commands[k][i]) / ranges[i];
      if (!(difference <= TOLERANCE)) different++;
      greatest = fmax(greatest, difference);
    }
  }
  printf("%d samples, %ld commands differ by more than %g of their range from double precision, the greatest by %.2g; "
         "memory %lu bytes, parameters %lu bytes\n", SAMPLES, different, TOLERANCE, greatest,
         (unsigned long)sizeof model_initial_memory, (unsigned long)sizeof model_parameters);
  return different != 0;
}
