@provenance@
#ifndef MODEL_H
#define MODEL_H

#ifdef __cplusplus
extern "C" {
#endif

#define MODEL_MEMORY @memory@
#define MODEL_MEASUREMENTS @measurements@
#define MODEL_SETPOINTS @setpoints@
#define MODEL_COMMANDS @commands@
#define MODEL_PARAMETERS @parameters@

/* Indices in the arrays. */
@enumerations@
/* The memory before the first sample. */
extern const @number@ model_initial_memory[MODEL_MEMORY + 1];
/* Parameters that can be changed; all others are constants. */
extern @number@ model_parameters[MODEL_PARAMETERS + 1];
extern const @number@ model_parameter_minimum[MODEL_PARAMETERS + 1];
extern const @number@ model_parameter_maximum[MODEL_PARAMETERS + 1];
extern const char *const model_parameter_names[MODEL_PARAMETERS + 1];
/* The index of the first of p[MODEL_PARAMETERS + 1] that is not finite or beyond its bounds; -1 if there is none.
   model_step does not check model_parameters: call it before you set them to values that are not constants. */
int model_check_parameters(const @number@ *p);

/* One sample, SI units: from memory[MODEL_MEMORY + 1], measurement and setpoint to command, and to the memory of the
   next sample. Returns 0; or 1 if a measurement, a set point or a command is not finite: then memory and command are
   unchanged. No recursion, no memory allocation, no loop without a constant bound. */
int model_step(@number@ *memory, const @number@ *measurement, const @number@ *setpoint, @number@ *command);

#ifdef __cplusplus
}
#endif
#endif
