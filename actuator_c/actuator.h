/*
 * Plant
 * Exported by airmuscle 0.1.0.
 * SHA-256 of the model: f9be568aba81a5d17417655321a1321339459c80cc1984ae14e857de596995cd
 * SPDX-License-Identifier: BSD-3-Clause
 * Integrator and form of the equations are part of airmuscle, copyright the airmuscle developers, and may be used
 * under its BSD-3-Clause licence; parameters and signals are those of the user.
 *
 * The equations are those of the model. The program does not report where a run leaves the validity range of a
 * characteristic or of another component, as a simulation by airmuscle does.
 *
 * Parameters (SI):
 *   muscle.contractile.geometry.radius = 0.01 m  (radius of the braid at rest)
 *   muscle.contractile.geometry.braid_angle = 0.42616416607037827 rad  (angle between the threads and the axis at rest)
 *   muscle.contractile.geometry.resting_length = 0.3 m  (length between the fittings, unpressurised and unloaded)
 *   muscle.contractile.wall_thickness = 0.0018000000000000002 m  (wall thickness at rest; only its product with E has an effect)
 *   muscle.contractile.c0 = 93232000.0 Pa  (modulus of the wall, constant term)
 *   muscle.contractile.c1 = -715290000.0 Pa/m  (modulus of the wall, linear term)
 *   muscle.contractile.c2 = 1548300000.0 Pa/m^2  (modulus of the wall, quadratic term)
 *   muscle.contractile.c3 = -502950000.0 Pa/m^3  (modulus of the wall, cubic term)
 *   muscle.geometry.radius = 0.01 m  (radius of the braid at rest)
 *   muscle.geometry.braid_angle = 0.42616416607037827 rad  (angle between the threads and the axis at rest)
 *   muscle.geometry.resting_length = 0.3 m  (length between the fittings, unpressurised and unloaded)
 *   muscle.spring.stiffness = 0.0 N/m  (stiffness of the parallel spring)
 *   muscle.damper.damping = 0.0 N s/m  (damping coefficient)
 *   muscle.validity_range.min_pressure = 35000.0 Pa  (lower limit of the validity range in gauge pressure)
 *   muscle.validity_range.max_pressure = 675000.0 Pa  (upper limit of the validity range in gauge pressure)
 *   muscle.validity_range.min_contraction = 0.01333333333333333  (lower limit of the validity range in contraction)
 *   muscle.validity_range.max_contraction = 0.26  (upper limit of the validity range in contraction)
 *   muscle.ratings.max_force = 1500.0 N  (permitted force)
 *   muscle.ratings.min_pressure = 0.0 Pa  (least permitted gauge pressure)
 *   muscle.ratings.max_pressure = 600000.0 Pa  (greatest permitted gauge pressure)
 *   muscle.ratings.max_contraction = 0.25  (greatest permitted contraction)
 *   muscle.ratings.max_prestretch = 0.04  (greatest permitted elongation beyond the resting length)
 *   muscle.ratings.min_length = 0.04 m  (least nominal length)
 *   muscle.ratings.max_length = 9.0 m  (greatest nominal length)
 *   muscle.ratings.min_temperature = 1.0 K  (least permitted ambient temperature)
 *   muscle.ratings.max_temperature = 1000.0 K  (greatest permitted ambient temperature)
 *   circuit.supply.pressure = 550000.0 Pa  (gauge pressure of the supply)
 *   circuit.fill.conductance = 2.6167e-09 m3/(s Pa)  (sonic conductance, fully open)
 *   circuit.fill.critical_ratio = 0.433  (critical pressure ratio)
 *   circuit.fill.laminar_ratio = 0.999  (pressure ratio above which the flow is laminar)
 *   circuit.discharge.conductance = 2.6167e-09 m3/(s Pa)  (sonic conductance, fully open)
 *   circuit.discharge.critical_ratio = 0.433  (critical pressure ratio)
 *   circuit.discharge.laminar_ratio = 0.999  (pressure ratio above which the flow is laminar)
 *   mechanism.shortenings[0] = 0.01 m  (shortening of each muscle where no input is given)
 *   gas.exponent = 1.2  (polytropic exponent)
 *   ambient.pressure = 101325.0 Pa(a)  (absolute pressure of the surroundings)
 *   ambient.temperature = 293.15 K  (temperature of the surroundings)
 *
 * References:
 *   Chou, C.-P., Hannaford, B. (1996): "Measurement and modeling of McKibben pneumatic artificial muscles", IEEE
 *     Transactions on Robotics and Automation 12(1):90-102, doi:10.1109/70.481753. [V = b^3/(4 pi n^2) cos(theta)
 *     sin^2(theta)]
 *   Hairer, E., Wanner, G. (1996): "Solving Ordinary Differential Equations II: Stiff and Differential-Algebraic
 *     Problems", 2nd edition, Springer, Berlin, section VI.4, doi:10.1007/978-3-642-05221-7. [method RODAS]
 *   Hošovský, A. et al. (undated): "Pneumatic artificial muscle modelling based on modified Hill's muscle model",
 *     TU Košice. [polynomial of total degree five in contraction and pressure, 21 coefficients, limited to 0..1200
 *     N; the coefficients are not printed]
 *   ISO (2013): "Pneumatic fluid power: determination of flow-rate characteristics of components using
 *     compressible fluids", ISO 6358-1. [sonic conductance C, critical pressure ratio b; linear in the pressure
 *     difference near equal pressures]
 *   ISO (2003): "Fluid power: standard reference atmosphere", ISO 8778. [100 kPa, 293.15 K, 1.185 kg/m3]
 *   Martens, M., Boblan, I. (2017): "Modeling the Static Force of a Festo Pneumatic Muscle Actuator: A New
 *     Approach and a Comparison to Existing Models", Actuators 6(4):33, doi:10.3390/act6040033. [formula,
 *     parameters and measured force maps of the appendix, CC BY 4.0; numbers read from a public copy]
 */

#ifndef ACTUATOR_H
#define ACTUATOR_H

#ifdef __cplusplus
extern "C" {
#endif

#define ACTUATOR_STATES 1
#define ACTUATOR_INPUTS 4
#define ACTUATOR_PARAMETERS 37
#define ACTUATOR_PRECOMPUTED 36
#define ACTUATOR_OUTPUTS 5
/* First step of a segment (0: the solver finds it), and the distance within which a time belongs to a step [s]. */
#define ACTUATOR_FIRST_STEP 0.0
#define ACTUATOR_CLOSE 0.0

/* Indices of states, inputs, outputs and parameters. */
enum {
  ACTUATOR_STATE_AIR_MASS = 0
};
enum {
  ACTUATOR_INPUT_FILL = 0,
  ACTUATOR_INPUT_DISCHARGE = 1,
  ACTUATOR_INPUT_SHORTENING = 2,
  ACTUATOR_INPUT_SHORTENING_SPEED = 3
};
enum {
  ACTUATOR_OUTPUT_PRESSURE = 0,
  ACTUATOR_OUTPUT_CONTRACTION = 1,
  ACTUATOR_OUTPUT_FORCE = 2,
  ACTUATOR_OUTPUT_VOLUME = 3,
  ACTUATOR_OUTPUT_MASS_FLOW = 4
};
enum {
  ACTUATOR_PARAMETER_MUSCLE_CONTRACTILE_GEOMETRY_RADIUS = 0,
  ACTUATOR_PARAMETER_MUSCLE_CONTRACTILE_GEOMETRY_BRAID_ANGLE = 1,
  ACTUATOR_PARAMETER_MUSCLE_CONTRACTILE_GEOMETRY_RESTING_LENGTH = 2,
  ACTUATOR_PARAMETER_MUSCLE_CONTRACTILE_WALL_THICKNESS = 3,
  ACTUATOR_PARAMETER_MUSCLE_CONTRACTILE_C0 = 4,
  ACTUATOR_PARAMETER_MUSCLE_CONTRACTILE_C1 = 5,
  ACTUATOR_PARAMETER_MUSCLE_CONTRACTILE_C2 = 6,
  ACTUATOR_PARAMETER_MUSCLE_CONTRACTILE_C3 = 7,
  ACTUATOR_PARAMETER_MUSCLE_GEOMETRY_RADIUS = 8,
  ACTUATOR_PARAMETER_MUSCLE_GEOMETRY_BRAID_ANGLE = 9,
  ACTUATOR_PARAMETER_MUSCLE_GEOMETRY_RESTING_LENGTH = 10,
  ACTUATOR_PARAMETER_MUSCLE_SPRING_STIFFNESS = 11,
  ACTUATOR_PARAMETER_MUSCLE_DAMPER_DAMPING = 12,
  ACTUATOR_PARAMETER_MUSCLE_VALIDITY_RANGE_MIN_PRESSURE = 13,
  ACTUATOR_PARAMETER_MUSCLE_VALIDITY_RANGE_MAX_PRESSURE = 14,
  ACTUATOR_PARAMETER_MUSCLE_VALIDITY_RANGE_MIN_CONTRACTION = 15,
  ACTUATOR_PARAMETER_MUSCLE_VALIDITY_RANGE_MAX_CONTRACTION = 16,
  ACTUATOR_PARAMETER_MUSCLE_RATINGS_MAX_FORCE = 17,
  ACTUATOR_PARAMETER_MUSCLE_RATINGS_MIN_PRESSURE = 18,
  ACTUATOR_PARAMETER_MUSCLE_RATINGS_MAX_PRESSURE = 19,
  ACTUATOR_PARAMETER_MUSCLE_RATINGS_MAX_CONTRACTION = 20,
  ACTUATOR_PARAMETER_MUSCLE_RATINGS_MAX_PRESTRETCH = 21,
  ACTUATOR_PARAMETER_MUSCLE_RATINGS_MIN_LENGTH = 22,
  ACTUATOR_PARAMETER_MUSCLE_RATINGS_MAX_LENGTH = 23,
  ACTUATOR_PARAMETER_MUSCLE_RATINGS_MIN_TEMPERATURE = 24,
  ACTUATOR_PARAMETER_MUSCLE_RATINGS_MAX_TEMPERATURE = 25,
  ACTUATOR_PARAMETER_CIRCUIT_SUPPLY_PRESSURE = 26,
  ACTUATOR_PARAMETER_CIRCUIT_FILL_CONDUCTANCE = 27,
  ACTUATOR_PARAMETER_CIRCUIT_FILL_CRITICAL_RATIO = 28,
  ACTUATOR_PARAMETER_CIRCUIT_FILL_LAMINAR_RATIO = 29,
  ACTUATOR_PARAMETER_CIRCUIT_DISCHARGE_CONDUCTANCE = 30,
  ACTUATOR_PARAMETER_CIRCUIT_DISCHARGE_CRITICAL_RATIO = 31,
  ACTUATOR_PARAMETER_CIRCUIT_DISCHARGE_LAMINAR_RATIO = 32,
  ACTUATOR_PARAMETER_MECHANISM_SHORTENINGS_0 = 33,
  ACTUATOR_PARAMETER_GAS_EXPONENT = 34,
  ACTUATOR_PARAMETER_AMBIENT_PRESSURE = 35,
  ACTUATOR_PARAMETER_AMBIENT_TEMPERATURE = 36
};

/* Results of actuator_step. */
#define ACTUATOR_DONE 0
#define ACTUATOR_STEP_TOO_SMALL 2
#define ACTUATOR_NOT_FINITE 3

/* Names, and units in SI; one empty text follows the last, because an array cannot be empty. */
extern const char *const actuator_state_names[ACTUATOR_STATES + 1];
extern const char *const actuator_state_units[ACTUATOR_STATES + 1];
extern const char *const actuator_input_names[ACTUATOR_INPUTS + 1];
extern const char *const actuator_input_units[ACTUATOR_INPUTS + 1];
extern const char *const actuator_output_names[ACTUATOR_OUTPUTS + 1];
extern const char *const actuator_output_units[ACTUATOR_OUTPUTS + 1];
extern const char *const actuator_parameter_names[ACTUATOR_PARAMETERS + 1];
extern const char *const actuator_parameter_units[ACTUATOR_PARAMETERS + 1];

/* Values of the parameters, the scale of each state for absolute tolerances, limits of the states and of the inputs. */
extern const double actuator_defaults[ACTUATOR_PARAMETERS + 1];
extern const double actuator_nominal[ACTUATOR_STATES];
extern const double actuator_state_minimum[ACTUATOR_STATES];
extern const double actuator_input_minimum[ACTUATOR_INPUTS + 1];
extern const double actuator_input_maximum[ACTUATOR_INPUTS + 1];

/* A run: time, state, the step to be tried next, inputs u + (time - start) w until `end`, and the step before. */
typedef struct {
  double t, start, end, h, rtol, t_before, h_taken;
  double x[ACTUATOR_STATES], x_before[ACTUATOR_STATES], dense[2][ACTUATOR_STATES];
  double u[ACTUATOR_INPUTS + 1], w[ACTUATOR_INPUTS + 1];
  long steps, rejected, done;
  int moving;
} actuator_solver;

/* c[ACTUATOR_PRECOMPUTED + 1]: all that the functions need of the parameters p[ACTUATOR_PARAMETERS + 1]; call it first. */
void actuator_prepare(const double *p, double *c);
/* f[ACTUATOR_STATES]: rates of the states x under the inputs u. */
void actuator_rhs(const double *x, const double *u, const double *c, double *f);
/* o[ACTUATOR_OUTPUTS + 1]: outputs. */
void actuator_outputs(const double *x, const double *u, const double *c, double *o);
/* Begin a run at time t in state x. */
void actuator_begin(actuator_solver *s, double t, const double *x);
/* Inputs from now until `end`: u now, with slopes w. Set s->h = 0 where the inputs jump (Rodas4 finds a step anew). */
void actuator_set_segment(actuator_solver *s, double end, const double *u, const double *w);
/* One step, which meets the end of the segment exactly. */
int actuator_step(actuator_solver *s, const double *c);
/* State and inputs at a time within the last step. */
void actuator_state_at(const actuator_solver *s, const double *c, double time, double *x);
void actuator_inputs_at(const actuator_solver *s, double time, double *u);

#ifdef __cplusplus
}
#endif
#endif
