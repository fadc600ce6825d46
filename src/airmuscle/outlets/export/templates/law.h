@provenance@
#ifndef MODEL_H
#define MODEL_H

#ifdef __cplusplus
extern "C" {
#endif

#define MODEL_PARAMETERS @parameters@
#define MODEL_PRECOMPUTED @held@

extern const double model_defaults[MODEL_PARAMETERS + 1];
extern const double model_parameter_minimum[MODEL_PARAMETERS + 1];
extern const double model_parameter_maximum[MODEL_PARAMETERS + 1];
extern const char *const model_parameter_names[MODEL_PARAMETERS + 1];

/* The index of the first of p[MODEL_PARAMETERS + 1] that is not finite or beyond its bounds; -1 if there is none. No
   other function checks parameters: call it first for values that are not constants of your program. */
int model_check_parameters(const double *p);
/* c[MODEL_PRECOMPUTED + 1]: all that the law needs of the parameters p[MODEL_PARAMETERS + 1]; call it first. */
void model_prepare(const double *p, double *c);
/* result[3] = @results@ at @first@ [@first_unit@] and @second@ [@second_unit@]. */
void model_evaluate(double @first@, double @second@, const double *c, double *result);

#ifdef __cplusplus
}
#endif
#endif
