@provenance@
@about@
#include "@file@.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define SAMPLES @samples@

static const @number@ measured[SAMPLES][MODEL_MEASUREMENTS + 1] = {@measured@};
static const @number@ setpoints[SAMPLES][MODEL_SETPOINTS + 1] = {@setpoints@};
static const double commands[SAMPLES][MODEL_COMMANDS + 1] = {@commands@};

@comparison@
int main(void)
{
  @number@ memory[MODEL_MEMORY + 1], command[MODEL_COMMANDS + 1] = {0};
  long different = 0;
  int k, i;
  memcpy(memory, model_initial_memory, sizeof memory);
  for (k = 0; k < SAMPLES; k++) {
    if (model_step(memory, measured[k], setpoints[k], command) != 0) {
      printf("sample %d: a measurement or a command is not finite\n", k);
      return 1;
    }
    for (i = 0; i < MODEL_COMMANDS; i++) different += differs((double)command[i], commands[k][i], i);
  }
  print_result(different);
  printf("; memory %lu bytes, parameters %lu bytes\n", (unsigned long)sizeof model_initial_memory,
         (unsigned long)sizeof model_parameters);
  return different != 0;
}
