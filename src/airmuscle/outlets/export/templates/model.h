@provenance@
#ifndef MODEL_H
#define MODEL_H

#ifdef __cplusplus
extern "C" {
#endif

#define MODEL_STATES @states@
#define MODEL_INPUTS @inputs@
#define MODEL_PARAMETERS @parameters@
#define MODEL_PRECOMPUTED @held@
#define MODEL_OUTPUTS @outputs@
/* First step of a segment (0: the solver finds it), and the distance within which a time belongs to a step [s]. */
#define MODEL_FIRST_STEP @first_step@
#define MODEL_CLOSE @close@

/* Indices of states, inputs, outputs and parameters. */
@enumerations@
/* Results of model_step. */
#define MODEL_DONE 0
#define MODEL_STEP_TOO_SMALL 2
#define MODEL_NOT_FINITE 3
#define MODEL_OUT_OF_RANGE 5

/* Names, and units in SI; one empty text follows the last, because an array cannot be empty. */
extern const char *const model_state_names[MODEL_STATES + 1];
extern const char *const model_state_units[MODEL_STATES + 1];
extern const char *const model_input_names[MODEL_INPUTS + 1];
extern const char *const model_input_units[MODEL_INPUTS + 1];
extern const char *const model_output_names[MODEL_OUTPUTS + 1];
extern const char *const model_output_units[MODEL_OUTPUTS + 1];
extern const char *const model_parameter_names[MODEL_PARAMETERS + 1];
extern const char *const model_parameter_units[MODEL_PARAMETERS + 1];

/* Values of the parameters and their bounds, the scale of each state for absolute tolerances, limits of the states and of the inputs. */
extern const double model_defaults[MODEL_PARAMETERS + 1];
extern const double model_parameter_minimum[MODEL_PARAMETERS + 1];
extern const double model_parameter_maximum[MODEL_PARAMETERS + 1];
extern const double model_nominal[MODEL_STATES];
extern const double model_state_minimum[MODEL_STATES];
extern const double model_input_minimum[MODEL_INPUTS + 1];
extern const double model_input_maximum[MODEL_INPUTS + 1];

/* A run: time, state, the step to be tried next, inputs u + (time - start) w until `end`, and the step before. */
typedef struct {
  double t, start, end, h, rtol, t_before, h_taken;
  double x[MODEL_STATES], x_before[MODEL_STATES], d2[MODEL_STATES], d3[MODEL_STATES];
  double u[MODEL_INPUTS + 1], w[MODEL_INPUTS + 1];
  long steps, rejected;
  int moving, done, refusal;
} model_solver;

/* The index of the first of p[MODEL_PARAMETERS + 1] that is not finite or beyond its bounds; -1 if there is none. No
   other function checks parameters: call it first for values that are not constants of your program. */
int model_check_parameters(const double *p);
/* c[MODEL_PRECOMPUTED + 1]: all that the functions need of the parameters p[MODEL_PARAMETERS + 1]; call it first. */
void model_prepare(const double *p, double *c);
/* f[MODEL_STATES]: rates of the states x under the inputs u. */
void model_rhs(const double *x, const double *u, const double *c, double *f);
/* o[MODEL_OUTPUTS + 1]: outputs. */
void model_outputs(const double *x, const double *u, const double *c, double *o);
/* Begin a run at time t in state x. */
void model_begin(model_solver *s, double t, const double *x);
/* Inputs from now until `end`: u now, with slopes w. Set s->h = 0 where the inputs jump (Rodas4 finds a step anew).
   Where one is not finite, or beyond its range now or at the end, every step until then does nothing, and returns why. */
void model_set_segment(model_solver *s, double end, const double *u, const double *w);
/* One step, which meets the end of the segment exactly. */
int model_step(model_solver *s, const double *c);
/* State and inputs at a time within the last step. */
void model_state_at(const model_solver *s, const double *c, double time, double *x);
void model_inputs_at(const model_solver *s, double time, double *u);

#ifdef __cplusplus
}
#endif
#endif
