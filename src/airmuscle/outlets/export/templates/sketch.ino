@provenance@
/* Sketch: every @period@ us it measures, computes the commands and applies them. Write read_measurements and
   write_commands for your sensors and valves; all quantities are in SI units. */
#include <@file@.h>

#include <string.h>

static @number@ memory[MODEL_MEMORY + 1], measurement[MODEL_MEASUREMENTS + 1];
static @number@ setpoint[MODEL_SETPOINTS + 1], command[MODEL_COMMANDS + 1];
static unsigned long next_sample;

static void read_measurements(void)
{
@reads@
}

static void write_commands(void)
{
@writes@
}

void setup()
{
  memcpy(memory, model_initial_memory, sizeof memory);
@setpoints@
  next_sample = micros();
}

void loop()
{
  if ((long)(micros() - next_sample) < 0) return;
  next_sample += @period@UL;
  read_measurements();
  if (model_step(memory, measurement, setpoint, command) != 0) memset(command, 0, sizeof command); /* a sensor failed */
  write_commands();
}
