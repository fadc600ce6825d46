@provenance@
/* Replay of a recorded run. The expected commands are those of the printed operations in IEEE 754 double precision; they
   are met bit by bit if products and sums are not fused (gcc, clang: -ffp-contract=off, which -std=c99 implies for gcc). */
#include "@file@.h"

#include <stdio.h>
#include <string.h>

#define SAMPLES @samples@

@tables@
int main(void)
{
  double memory[MODEL_MEMORY + 1], command[MODEL_COMMANDS + 1] = {0.0};
  long different = 0;
  int k, i;
  memcpy(memory, model_initial_memory, sizeof memory);
  for (k = 0; k < SAMPLES; k++) {
    if (model_step(memory, measured[k], setpoints[k], command) != 0) {
      printf("sample %d: a measurement or a command is not finite\n", k);
      return 1;
    }
    for (i = 0; i < MODEL_COMMANDS; i++)
      if (memcmp(&command[i], &commands[k][i], sizeof(double)) != 0) different++;
  }
  printf("%d samples, %ld commands differ; memory %lu bytes, parameters %lu bytes\n", SAMPLES, different,
         (unsigned long)sizeof model_initial_memory, (unsigned long)sizeof model_parameters);
  return different != 0;
}
