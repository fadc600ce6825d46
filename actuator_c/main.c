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

/* Run of the scenario; writes CSV to the file that is named, or to the standard output. */
#include "actuator.h"

#include <math.h>
#include <stdio.h>

#define ROWS 1001
#define SEGMENTS 2
#define COLUMNS 10

static const char header[] = "time [s],air_mass [kg],fill [1],discharge [1],shortening,shortening_speed [m/s],pressure [Pa],contraction [1],force [N],volume [m3],mass_flow [kg/s]\012";
static const int columns[COLUMNS] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9};
static const double start = 0.0;
static const double initial[ACTUATOR_STATES] = {0.0002562358950613493};
static const double times[ROWS] = {
  0.0, 0.001, 0.002, 0.003, 0.004, 0.005, 0.006, 0.007, 0.008, 0.009000000000000001, 0.01, 0.011, 0.012,
  0.013000000000000001, 0.014, 0.015, 0.016, 0.017, 0.018000000000000002, 0.019, 0.02, 0.021, 0.022, 0.023, 0.024,
  0.025, 0.026000000000000002, 0.027, 0.028, 0.029, 0.03, 0.031, 0.032, 0.033, 0.034, 0.035, 0.036000000000000004,
  0.037, 0.038, 0.039, 0.04, 0.041, 0.042, 0.043000000000000003, 0.044, 0.045, 0.046, 0.047, 0.048, 0.049, 0.05,
  0.051000000000000004, 0.052000000000000005, 0.053, 0.054, 0.055, 0.056, 0.057, 0.058, 0.059000000000000004, 0.06,
  0.061, 0.062, 0.063, 0.064, 0.065, 0.066, 0.067, 0.068, 0.069, 0.07, 0.07100000000000001, 0.07200000000000001, 0.073,
  0.074, 0.075, 0.076, 0.077, 0.078, 0.079, 0.08, 0.081, 0.082, 0.083, 0.084, 0.085, 0.08600000000000001,
  0.08700000000000001, 0.088, 0.089, 0.09, 0.091, 0.092, 0.093, 0.094, 0.095, 0.096, 0.097, 0.098, 0.099, 0.1, 0.101,
  0.10200000000000001, 0.10300000000000001, 0.10400000000000001, 0.105, 0.106, 0.107, 0.108, 0.109, 0.11, 0.111, 0.112,
  0.113, 0.114, 0.115, 0.116, 0.117, 0.11800000000000001, 0.11900000000000001, 0.12, 0.121, 0.122, 0.123, 0.124, 0.125,
  0.126, 0.127, 0.128, 0.129, 0.13, 0.131, 0.132, 0.133, 0.134, 0.135, 0.136, 0.137, 0.138, 0.139, 0.14,
  0.14100000000000001, 0.14200000000000002, 0.14300000000000002, 0.14400000000000002, 0.145, 0.146, 0.147, 0.148,
  0.149, 0.15, 0.151, 0.152, 0.153, 0.154, 0.155, 0.156, 0.157, 0.158, 0.159, 0.16, 0.161, 0.162, 0.163, 0.164, 0.165,
  0.166, 0.167, 0.168, 0.169, 0.17, 0.171, 0.17200000000000001, 0.17300000000000001, 0.17400000000000002,
  0.17500000000000002, 0.176, 0.177, 0.178, 0.179, 0.18, 0.181, 0.182, 0.183, 0.184, 0.185, 0.186, 0.187, 0.188, 0.189,
  0.19, 0.191, 0.192, 0.193, 0.194, 0.195, 0.196, 0.197, 0.198, 0.199, 0.2, 0.201, 0.202, 0.203, 0.20400000000000001,
  0.20500000000000002, 0.20600000000000002, 0.20700000000000002, 0.20800000000000002, 0.209, 0.21, 0.211, 0.212, 0.213,
  0.214, 0.215, 0.216, 0.217, 0.218, 0.219, 0.22, 0.221, 0.222, 0.223, 0.224, 0.225, 0.226, 0.227, 0.228, 0.229, 0.23,
  0.231, 0.232, 0.233, 0.234, 0.23500000000000001, 0.23600000000000002, 0.23700000000000002, 0.23800000000000002,
  0.23900000000000002, 0.24, 0.241, 0.242, 0.243, 0.244, 0.245, 0.246, 0.247, 0.248, 0.249, 0.25, 0.251, 0.252, 0.253,
  0.254, 0.255, 0.256, 0.257, 0.258, 0.259, 0.26, 0.261, 0.262, 0.263, 0.264, 0.265, 0.266, 0.267, 0.268, 0.269, 0.27,
  0.271, 0.272, 0.273, 0.274, 0.275, 0.276, 0.277, 0.278, 0.279, 0.28, 0.281, 0.28200000000000003, 0.28300000000000003,
  0.28400000000000003, 0.28500000000000003, 0.28600000000000003, 0.28700000000000003, 0.28800000000000003, 0.289, 0.29,
  0.291, 0.292, 0.293, 0.294, 0.295, 0.296, 0.297, 0.298, 0.299, 0.3, 0.301, 0.302, 0.303, 0.304, 0.305, 0.306, 0.307,
  0.308, 0.309, 0.31, 0.311, 0.312, 0.313, 0.314, 0.315, 0.316, 0.317, 0.318, 0.319, 0.32, 0.321, 0.322, 0.323, 0.324,
  0.325, 0.326, 0.327, 0.328, 0.329, 0.33, 0.331, 0.332, 0.333, 0.334, 0.335, 0.336, 0.337, 0.338, 0.339, 0.34, 0.341,
  0.342, 0.343, 0.34400000000000003, 0.34500000000000003, 0.34600000000000003, 0.34700000000000003,
  0.34800000000000003, 0.34900000000000003, 0.35000000000000003, 0.35100000000000003, 0.352, 0.353, 0.354, 0.355,
  0.356, 0.357, 0.358, 0.359, 0.36, 0.361, 0.362, 0.363, 0.364, 0.365, 0.366, 0.367, 0.368, 0.369, 0.37, 0.371, 0.372,
  0.373, 0.374, 0.375, 0.376, 0.377, 0.378, 0.379, 0.38, 0.381, 0.382, 0.383, 0.384, 0.385, 0.386, 0.387, 0.388, 0.389,
  0.39, 0.391, 0.392, 0.393, 0.394, 0.395, 0.396, 0.397, 0.398, 0.399, 0.4, 0.401, 0.402, 0.403, 0.404, 0.405, 0.406,
  0.40700000000000003, 0.40800000000000003, 0.40900000000000003, 0.41000000000000003, 0.41100000000000003,
  0.41200000000000003, 0.41300000000000003, 0.41400000000000003, 0.41500000000000004, 0.41600000000000004, 0.417,
  0.418, 0.419, 0.42, 0.421, 0.422, 0.423, 0.424, 0.425, 0.426, 0.427, 0.428, 0.429, 0.43, 0.431, 0.432, 0.433, 0.434,
  0.435, 0.436, 0.437, 0.438, 0.439, 0.44, 0.441, 0.442, 0.443, 0.444, 0.445, 0.446, 0.447, 0.448, 0.449, 0.45, 0.451,
  0.452, 0.453, 0.454, 0.455, 0.456, 0.457, 0.458, 0.459, 0.46, 0.461, 0.462, 0.463, 0.464, 0.465, 0.466, 0.467, 0.468,
  0.46900000000000003, 0.47000000000000003, 0.47100000000000003, 0.47200000000000003, 0.47300000000000003,
  0.47400000000000003, 0.47500000000000003, 0.47600000000000003, 0.47700000000000004, 0.47800000000000004,
  0.47900000000000004, 0.48, 0.481, 0.482, 0.483, 0.484, 0.485, 0.486, 0.487, 0.488, 0.489, 0.49, 0.491, 0.492, 0.493,
  0.494, 0.495, 0.496, 0.497, 0.498, 0.499, 0.5, 0.501, 0.502, 0.503, 0.504, 0.505, 0.506, 0.507, 0.508, 0.509, 0.51,
  0.511, 0.512, 0.513, 0.514, 0.515, 0.516, 0.517, 0.518, 0.519, 0.52, 0.521, 0.522, 0.523, 0.524, 0.525, 0.526, 0.527,
  0.528, 0.529, 0.53, 0.531, 0.532, 0.533, 0.534, 0.535, 0.536, 0.537, 0.538, 0.539, 0.54, 0.541, 0.542, 0.543, 0.544,
  0.545, 0.546, 0.547, 0.548, 0.549, 0.55, 0.551, 0.552, 0.553, 0.554, 0.555, 0.556, 0.557, 0.558, 0.559, 0.56, 0.561,
  0.562, 0.5630000000000001, 0.5640000000000001, 0.5650000000000001, 0.5660000000000001, 0.5670000000000001,
  0.5680000000000001, 0.5690000000000001, 0.5700000000000001, 0.5710000000000001, 0.5720000000000001,
  0.5730000000000001, 0.5740000000000001, 0.5750000000000001, 0.5760000000000001, 0.577, 0.578, 0.579, 0.58, 0.581,
  0.582, 0.583, 0.584, 0.585, 0.586, 0.587, 0.588, 0.589, 0.59, 0.591, 0.592, 0.593, 0.594, 0.595, 0.596, 0.597, 0.598,
  0.599, 0.6, 0.601, 0.602, 0.603, 0.604, 0.605, 0.606, 0.607, 0.608, 0.609, 0.61, 0.611, 0.612, 0.613, 0.614, 0.615,
  0.616, 0.617, 0.618, 0.619, 0.62, 0.621, 0.622, 0.623, 0.624, 0.625, 0.626, 0.627, 0.628, 0.629, 0.63, 0.631, 0.632,
  0.633, 0.634, 0.635, 0.636, 0.637, 0.638, 0.639, 0.64, 0.641, 0.642, 0.643, 0.644, 0.645, 0.646, 0.647, 0.648, 0.649,
  0.65, 0.651, 0.652, 0.653, 0.654, 0.655, 0.656, 0.657, 0.658, 0.659, 0.66, 0.661, 0.662, 0.663, 0.664, 0.665, 0.666,
  0.667, 0.668, 0.669, 0.67, 0.671, 0.672, 0.673, 0.674, 0.675, 0.676, 0.677, 0.678, 0.679, 0.68, 0.681, 0.682, 0.683,
  0.684, 0.685, 0.686, 0.687, 0.6880000000000001, 0.6890000000000001, 0.6900000000000001, 0.6910000000000001,
  0.6920000000000001, 0.6930000000000001, 0.6940000000000001, 0.6950000000000001, 0.6960000000000001,
  0.6970000000000001, 0.6980000000000001, 0.6990000000000001, 0.7000000000000001, 0.7010000000000001,
  0.7020000000000001, 0.7030000000000001, 0.704, 0.705, 0.706, 0.707, 0.708, 0.709, 0.71, 0.711, 0.712, 0.713, 0.714,
  0.715, 0.716, 0.717, 0.718, 0.719, 0.72, 0.721, 0.722, 0.723, 0.724, 0.725, 0.726, 0.727, 0.728, 0.729, 0.73, 0.731,
  0.732, 0.733, 0.734, 0.735, 0.736, 0.737, 0.738, 0.739, 0.74, 0.741, 0.742, 0.743, 0.744, 0.745, 0.746, 0.747, 0.748,
  0.749, 0.75, 0.751, 0.752, 0.753, 0.754, 0.755, 0.756, 0.757, 0.758, 0.759, 0.76, 0.761, 0.762, 0.763, 0.764, 0.765,
  0.766, 0.767, 0.768, 0.769, 0.77, 0.771, 0.772, 0.773, 0.774, 0.775, 0.776, 0.777, 0.778, 0.779, 0.78, 0.781, 0.782,
  0.783, 0.784, 0.785, 0.786, 0.787, 0.788, 0.789, 0.79, 0.791, 0.792, 0.793, 0.794, 0.795, 0.796, 0.797, 0.798, 0.799,
  0.8, 0.801, 0.802, 0.803, 0.804, 0.805, 0.806, 0.807, 0.808, 0.809, 0.81, 0.811, 0.812, 0.8130000000000001,
  0.8140000000000001, 0.8150000000000001, 0.8160000000000001, 0.8170000000000001, 0.8180000000000001,
  0.8190000000000001, 0.8200000000000001, 0.8210000000000001, 0.8220000000000001, 0.8230000000000001,
  0.8240000000000001, 0.8250000000000001, 0.8260000000000001, 0.8270000000000001, 0.8280000000000001,
  0.8290000000000001, 0.8300000000000001, 0.8310000000000001, 0.8320000000000001, 0.833, 0.834, 0.835, 0.836, 0.837,
  0.838, 0.839, 0.84, 0.841, 0.842, 0.843, 0.844, 0.845, 0.846, 0.847, 0.848, 0.849, 0.85, 0.851, 0.852, 0.853, 0.854,
  0.855, 0.856, 0.857, 0.858, 0.859, 0.86, 0.861, 0.862, 0.863, 0.864, 0.865, 0.866, 0.867, 0.868, 0.869, 0.87, 0.871,
  0.872, 0.873, 0.874, 0.875, 0.876, 0.877, 0.878, 0.879, 0.88, 0.881, 0.882, 0.883, 0.884, 0.885, 0.886, 0.887, 0.888,
  0.889, 0.89, 0.891, 0.892, 0.893, 0.894, 0.895, 0.896, 0.897, 0.898, 0.899, 0.9, 0.901, 0.902, 0.903, 0.904, 0.905,
  0.906, 0.907, 0.908, 0.909, 0.91, 0.911, 0.912, 0.913, 0.914, 0.915, 0.916, 0.917, 0.918, 0.919, 0.92, 0.921, 0.922,
  0.923, 0.924, 0.925, 0.926, 0.927, 0.928, 0.929, 0.93, 0.931, 0.932, 0.933, 0.934, 0.935, 0.936, 0.937,
  0.9380000000000001, 0.9390000000000001, 0.9400000000000001, 0.9410000000000001, 0.9420000000000001,
  0.9430000000000001, 0.9440000000000001, 0.9450000000000001, 0.9460000000000001, 0.9470000000000001,
  0.9480000000000001, 0.9490000000000001, 0.9500000000000001, 0.9510000000000001, 0.9520000000000001,
  0.9530000000000001, 0.9540000000000001, 0.9550000000000001, 0.9560000000000001, 0.9570000000000001,
  0.9580000000000001, 0.9590000000000001, 0.96, 0.961, 0.962, 0.963, 0.964, 0.965, 0.966, 0.967, 0.968, 0.969, 0.97,
  0.971, 0.972, 0.973, 0.974, 0.975, 0.976, 0.977, 0.978, 0.979, 0.98, 0.981, 0.982, 0.983, 0.984, 0.985, 0.986, 0.987,
  0.988, 0.989, 0.99, 0.991, 0.992, 0.993, 0.994, 0.995, 0.996, 0.997, 0.998, 0.999, 1.0
};
static const double ends[SEGMENTS] = {0.1, 1.0};
static const double values[SEGMENTS][ACTUATOR_INPUTS + 1] = {
  {0.0, 0.0, 0.01, 0.0, 0.0}, {1.0, 0.0, 0.01, 0.0, 0.0}
};
static const double slopes[SEGMENTS][ACTUATOR_INPUTS + 1] = {{0.0, 0.0, 0.0, 0.0, 0.0}, {0.0, 0.0, 0.0, 0.0, 0.0}};

static int write_row(FILE *out, double time, const double *x, const double *u, const double *c)
{
  double o[ACTUATOR_OUTPUTS + 1];
  int i, finite = 1;
  actuator_outputs(x, u, c, o);
  fprintf(out, "%.17g", time);
  for (i = 0; i < COLUMNS; i++) {
    const int k = columns[i];
    const double value = k < ACTUATOR_STATES                  ? x[k]
                         : k < ACTUATOR_STATES + ACTUATOR_INPUTS ? u[k - ACTUATOR_STATES]
                                                           : o[k - ACTUATOR_STATES - ACTUATOR_INPUTS];
    fprintf(out, ",%.17g", value);
  }
  fputc('\n', out);
  for (i = 0; i < ACTUATOR_STATES; i++)
    if (!isfinite(x[i]) || x[i] < actuator_state_minimum[i]) finite = 0;
  for (i = 0; i < ACTUATOR_OUTPUTS; i++)
    if (!isfinite(o[i])) finite = 0;
  return finite;
}

/* Rows up to `time`, in the segment that the solver is in. */
static int write_rows(FILE *out, int *row, double time, const actuator_solver *s, const double *c)
{
  double x[ACTUATOR_STATES], u[ACTUATOR_INPUTS + 1];
  while (*row < ROWS && times[*row] <= time) {
    actuator_state_at(s, c, times[*row], x);
    actuator_inputs_at(s, times[*row], u);
    if (!write_row(out, times[*row], x, u, c)) return 0;
    ++*row;
  }
  return 1;
}

static int run(FILE *out)
{
  actuator_solver s;
  double c[ACTUATOR_PRECOMPUTED + 1];
  int segment, row = 0, status = ACTUATOR_DONE;
  actuator_prepare(actuator_defaults, c);
  actuator_begin(&s, start, initial);
  for (segment = 0; segment < SEGMENTS; segment++) {
    const double end = ends[segment], close = ACTUATOR_CLOSE;
    actuator_set_segment(&s, end, values[segment], slopes[segment]);
    s.h = ACTUATOR_FIRST_STEP;
    if (!write_rows(out, &row, s.t + close, &s, c)) return ACTUATOR_NOT_FINITE;
    while (s.t < end && status == ACTUATOR_DONE) {
      status = actuator_step(&s, c);
      if (status == ACTUATOR_DONE && s.t < end && !write_rows(out, &row, s.t + close, &s, c)) status = ACTUATOR_NOT_FINITE;
    }
    if (status != ACTUATOR_DONE) break;
    while (row < ROWS && times[row] < end - close) /* the row at the end has the inputs of the next segment */
      if (!write_rows(out, &row, times[row], &s, c)) return ACTUATOR_NOT_FINITE;
  }
  if (status == ACTUATOR_DONE && !write_rows(out, &row, s.t + ACTUATOR_CLOSE, &s, c)) status = ACTUATOR_NOT_FINITE;
  fprintf(stderr, "%ld steps, %ld rejected, time %.9g s\n", s.steps, s.rejected, s.t);
  return status;
}

int main(int argc, char **argv)
{
  FILE *out = argc > 1 ? fopen(argv[1], "w") : stdout;
  int status;
  if (!out) {
    perror(argv[1]);
    return 1;
  }
  fputs(header, out);
  status = run(out);
  if (out != stdout && fclose(out) != 0) {
    perror(argv[1]);
    return 1;
  }
  if (status != ACTUATOR_DONE)
    fputs(status == ACTUATOR_STEP_TOO_SMALL ? "the step became too small\n"
                                         : "a state or an output is not finite, or below its limit\n", stderr);
  return status;
}
