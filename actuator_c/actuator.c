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

#include "actuator.h"

#include <math.h>

const char *const actuator_state_names[ACTUATOR_STATES + 1] = {"air_mass", ""};
const char *const actuator_state_units[ACTUATOR_STATES + 1] = {"kg", ""};
const char *const actuator_input_names[ACTUATOR_INPUTS + 1] = {
  "fill", "discharge", "shortening", "shortening_speed", ""
};
const char *const actuator_input_units[ACTUATOR_INPUTS + 1] = {"1", "1", "m", "m/s", ""};
const char *const actuator_output_names[ACTUATOR_OUTPUTS + 1] = {
  "pressure", "contraction", "force", "volume", "mass_flow", ""
};
const char *const actuator_output_units[ACTUATOR_OUTPUTS + 1] = {"Pa", "1", "N", "m3", "kg/s", ""};
const char *const actuator_parameter_names[ACTUATOR_PARAMETERS + 1] = {
  "muscle.contractile.geometry.radius", "muscle.contractile.geometry.braid_angle",
  "muscle.contractile.geometry.resting_length", "muscle.contractile.wall_thickness", "muscle.contractile.c0",
  "muscle.contractile.c1", "muscle.contractile.c2", "muscle.contractile.c3", "muscle.geometry.radius",
  "muscle.geometry.braid_angle", "muscle.geometry.resting_length", "muscle.spring.stiffness", "muscle.damper.damping",
  "muscle.validity_range.min_pressure", "muscle.validity_range.max_pressure", "muscle.validity_range.min_contraction",
  "muscle.validity_range.max_contraction", "muscle.ratings.max_force", "muscle.ratings.min_pressure",
  "muscle.ratings.max_pressure", "muscle.ratings.max_contraction", "muscle.ratings.max_prestretch",
  "muscle.ratings.min_length", "muscle.ratings.max_length", "muscle.ratings.min_temperature",
  "muscle.ratings.max_temperature", "circuit.supply.pressure", "circuit.fill.conductance",
  "circuit.fill.critical_ratio", "circuit.fill.laminar_ratio", "circuit.discharge.conductance",
  "circuit.discharge.critical_ratio", "circuit.discharge.laminar_ratio", "mechanism.shortenings[0]", "gas.exponent",
  "ambient.pressure", "ambient.temperature", ""
};
const char *const actuator_parameter_units[ACTUATOR_PARAMETERS + 1] = {
  "m", "rad", "m", "m", "Pa", "Pa/m", "Pa/m^2", "Pa/m^3", "m", "rad", "m", "N/m", "N s/m", "Pa", "Pa", "1", "1", "N",
  "Pa", "Pa", "1", "1", "m", "m", "K", "K", "Pa", "m3/(s Pa)", "1", "1", "m3/(s Pa)", "1", "1", "m", "1", "Pa(a)", "K",
  ""
};
const double actuator_defaults[ACTUATOR_PARAMETERS + 1] = {
  0.01, 0.42616416607037827, 0.3, 0.0018000000000000002, 93232000.0, -715290000.0, 1548300000.0, -502950000.0, 0.01,
  0.42616416607037827, 0.3, 0.0, 0.0, 35000.0, 675000.0, 0.01333333333333333, 0.26, 1500.0, 0.0, 600000.0, 0.25, 0.04,
  0.04, 9.0, 1.0, 1000.0, 550000.0, 2.6167e-09, 0.433, 0.999, 2.6167e-09, 0.433, 0.999, 0.01, 1.2, 101325.0, 293.15,
  0.0
};
const double actuator_nominal[ACTUATOR_STATES] = {0.0001588126630832932};
const double actuator_state_minimum[ACTUATOR_STATES] = {-1.588126630832932e-07};
const double actuator_input_minimum[ACTUATOR_INPUTS + 1] = {0.0, 0.0, -1000.0, -1000.0, 0.0};
const double actuator_input_maximum[ACTUATOR_INPUTS + 1] = {1.0, 1.0, 1000.0, 1000.0, 0.0};

/* Printed functions. c holds what they need of the parameters; J the distinct non-zeros of df/dx, A the LU factors of
   d I - J, k the solution of (d I - J) k = f(x, u) + g. */
void actuator_prepare(const double *restrict p, double *restrict c) {
  const double v1 = p[27];
  const double v2 = 1.185 * v1;
  const double v3 = p[36];
  const double v4 = 287.05 * v3;
  const double v5 = p[35];
  const double v6 = v4 / v5;
  const double v7 = p[8];
  const double v8 = v7 * v7;
  const double v9 = 3.141592653589793 * v8;
  const double v10 = p[10];
  const double v11 = v9 * v10;
  const double v12 = 1.0 / v10;
  const double v13 = p[9];
  const double v14 = cos(v13);
  const double v15 = sin(v13);
  const double v16 = v15 * v15;
  const double v17 = 1.0 / v16;
  const double v18 = p[26];
  const double v19 = v18 + v5;
  const double v20 = p[29];
  const double v21 = p[28];
  const double v22 = v20 - v21;
  const double v23 = 1.0 - v21;
  const double v24 = v22 / v23;
  const double v25 = v24 * v24;
  const double v26 = 1.0 - v25;
  const double v27 = sqrt(v26);
  const double v28 = 1.0 - v20;
  const double v29 = v27 / v28;
  const double v30 = 1.0 / v23;
  const double v31 = p[30];
  const double v32 = 1.185 * v31;
  const double v33 = p[32];
  const double v34 = p[31];
  const double v35 = v33 - v34;
  const double v36 = 1.0 - v34;
  const double v37 = v35 / v36;
  const double v38 = v37 * v37;
  const double v39 = 1.0 - v38;
  const double v40 = sqrt(v39);
  const double v41 = 1.0 - v33;
  const double v42 = v40 / v41;
  const double v43 = 1.0 / v36;
  c[0] = v6;
  c[1] = v12;
  c[2] = v11;
  c[3] = v14;
  c[4] = v17;
  const double v44 = p[34];
  c[5] = v44;
  c[6] = v5;
  c[7] = v19;
  c[8] = v3;
  c[9] = v2;
  c[10] = v29;
  c[11] = v21;
  c[12] = v30;
  c[13] = v32;
  c[14] = v42;
  c[15] = v34;
  c[16] = v43;
  const double v45 = v44 + (-1.0);
  const double v46 = -v21;
  const double v47 = -v34;
  c[17] = v45;
  c[18] = v46;
  c[19] = v47;
  const double v48 = v44 - 1.0;
  c[20] = v48;
  const double v49 = p[1];
  const double v50 = cos(v49);
  const double v51 = p[2];
  const double v52 = v51 / v50;
  const double v53 = v52 * v52;
  const double v54 = tan(v49);
  const double v55 = v51 * v54;
  const double v56 = p[0];
  const double v57 = 6.283185307179586 * v56;
  const double v58 = v55 / v57;
  const double v59 = v58 * v58;
  const double v60 = 12.566370614359172 * v59;
  const double v61 = 1.0 / v60;
  const double v62 = 3.141592653589793 * v58;
  const double v63 = 1.0 / v62;
  const double v64 = v56 + v56;
  const double v65 = 1.0 / v64;
  const double v66 = 1.0 / v51;
  c[21] = v51;
  c[22] = v53;
  c[23] = v61;
  const double v67 = p[7];
  c[24] = v67;
  const double v68 = p[6];
  c[25] = v68;
  const double v69 = p[5];
  c[26] = v69;
  const double v70 = p[4];
  c[27] = v70;
  const double v71 = p[3];
  c[28] = v71;
  c[29] = v63;
  c[30] = v65;
  c[31] = v62;
  c[32] = v66;
  const double v72 = p[11];
  c[33] = v72;
  c[34] = v10;
  const double v73 = p[12];
  c[35] = v73;
}

void actuator_rhs(const double *restrict x, const double *restrict u, const double *restrict c, double *restrict f) {
  const double v1 = x[0];
  const double v2 = c[0];
  const double v3 = v1 * v2;
  const double v4 = u[2];
  const double v5 = c[1];
  const double v6 = v4 * v5;
  const double v7 = 1.0 - v6;
  const double v8 = c[2];
  const double v9 = v8 * v7;
  double v10 = 0.0;
  double v11 = 0.0;
  if (v9 != 0.0) {
  const double v12 = c[3];
  const double v13 = v7 * v12;
  const double v14 = v13 * v13;
  const double v15 = 1.0 - v14;
  const double v16 = v9 * v15;
  const double v17 = c[4];
  const double v18 = v16 * v17;
  const double v19 = 287.05 * v1;
  v10 = v18;
  v11 = v19;
  }
  const double v20 = v3 / v10;
  const double v21 = c[5];
  const double v22 = pow(v20, v21);
  const double v23 = c[6];
  const double v24 = v23 * v22;
  double v25 = 0.0;
  if (v9 != 0.0) {
  const double v26 = v24 * v10;
  const double v27 = v26 / v11;
  v25 = v27;
  }
  const double v28 = u[0];
  double v29 = 0.0;
  if (v28 != 0.0) {
  const double v30 = c[7];
  const double v31 = (v24 <= v30) ? 1.0 : 0.0;
  const double v32 = c[8];
  const double v33 = (v31 != 0.0) ? v32 : v25;
  const double v34 = 293.15 / v33;
  const double v35 = sqrt(v34);
  const double v36 = c[9];
  const double v37 = v36 * v35;
  const double v38 = v28 * v37;
  const double v39 = (v30 > v24) ? v30 : v24;
  const double v40 = (v24 < v30) ? v24 : v30;
  const double v41 = v39 - v40;
  const double v42 = c[10];
  const double v43 = v42 * v41;
  const double v44 = v39 * v39;
  const double v45 = c[11];
  const double v46 = v45 * v39;
  const double v47 = v40 - v46;
  const double v48 = (v47 > 0.0) ? v47 : 0.0;
  const double v49 = c[12];
  const double v50 = v48 * v49;
  const double v51 = v50 * v50;
  const double v52 = v44 - v51;
  const double v53 = (v52 > 1.0) ? v52 : 1.0;
  const double v54 = sqrt(v53);
  const double v55 = (v43 < v54) ? v43 : v54;
  const double v56 = -v55;
  const double v57 = (v31 != 0.0) ? v55 : v56;
  const double v58 = v38 * v57;
  v29 = v58;
  }
  const double v59 = u[1];
  double v60 = 0.0;
  if (v59 != 0.0) {
  const double v61 = (v23 <= v24) ? 1.0 : 0.0;
  const double v62 = c[8];
  const double v63 = (v61 != 0.0) ? v25 : v62;
  const double v64 = 293.15 / v63;
  const double v65 = sqrt(v64);
  const double v66 = c[13];
  const double v67 = v66 * v65;
  const double v68 = v59 * v67;
  const double v69 = (v24 > v23) ? v24 : v23;
  const double v70 = (v23 < v24) ? v23 : v24;
  const double v71 = v69 - v70;
  const double v72 = c[14];
  const double v73 = v72 * v71;
  const double v74 = v69 * v69;
  const double v75 = c[15];
  const double v76 = v75 * v69;
  const double v77 = v70 - v76;
  const double v78 = (v77 > 0.0) ? v77 : 0.0;
  const double v79 = c[16];
  const double v80 = v78 * v79;
  const double v81 = v80 * v80;
  const double v82 = v74 - v81;
  const double v83 = (v82 > 1.0) ? v82 : 1.0;
  const double v84 = sqrt(v83);
  const double v85 = (v73 < v84) ? v73 : v84;
  const double v86 = -v85;
  const double v87 = (v61 != 0.0) ? v85 : v86;
  const double v88 = v68 * v87;
  v60 = v88;
  }
  const double v89 = v29 - v60;
  f[0] = v89;
}

static void actuator_jac(const double *restrict x, const double *restrict u, const double *restrict c, double *restrict f, double *restrict J) {
  const double v1 = x[0];
  const double v2 = c[0];
  const double v3 = v1 * v2;
  const double v4 = u[2];
  const double v5 = c[1];
  const double v6 = v4 * v5;
  const double v7 = 1.0 - v6;
  const double v8 = c[2];
  const double v9 = v8 * v7;
  double v10 = 0.0;
  double v11 = 0.0;
  double v12 = 0.0;
  double v13 = 0.0;
  if (v9 != 0.0) {
  const double v14 = c[3];
  const double v15 = v7 * v14;
  const double v16 = v15 * v15;
  const double v17 = 1.0 - v16;
  const double v18 = v9 * v17;
  const double v19 = c[4];
  const double v20 = v18 * v19;
  const double v21 = 287.05 * v1;
  const double v22 = 1.0 / v21;
  const double v23 = v22 * v20;
  v10 = v20;
  v11 = v21;
  v12 = v22;
  v13 = v23;
  }
  const double v24 = v3 / v10;
  const double v25 = c[5];
  const double v26 = pow(v24, v25);
  const double v27 = c[6];
  const double v28 = v27 * v26;
  const double v29 = u[0];
  double v30 = 0.0;
  double v31 = 0.0;
  double v32 = 0.0;
  double v33 = 0.0;
  double v34 = 0.0;
  if (v29 != 0.0) {
  const double v35 = c[7];
  const double v36 = (v28 <= v35) ? 1.0 : 0.0;
  const double v37 = (v36 == 0.0) ? 1.0 : 0.0;
  const double v38 = (v35 > v28) ? v35 : v28;
  const double v39 = (v28 < v35) ? v28 : v35;
  const double v40 = v38 - v39;
  const double v41 = c[10];
  const double v42 = v41 * v40;
  const double v43 = v38 * v38;
  const double v44 = c[11];
  const double v45 = v44 * v38;
  const double v46 = v39 - v45;
  const double v47 = (0.0 <= v46) ? 1.0 : 0.0;
  const double v48 = (v46 > 0.0) ? v46 : 0.0;
  const double v49 = c[12];
  const double v50 = v48 * v49;
  const double v51 = v50 * v50;
  const double v52 = v43 - v51;
  const double v53 = (1.0 <= v52) ? 1.0 : 0.0;
  const double v54 = (v52 > 1.0) ? v52 : 1.0;
  const double v55 = sqrt(v54);
  const double v56 = (v42 <= v55) ? 1.0 : 0.0;
  const double v57 = (v56 == 0.0) ? 1.0 : 0.0;
  const double v58 = (v42 < v55) ? v42 : v55;
  const double v59 = -v58;
  const double v60 = (v36 != 0.0) ? v58 : v59;
  const double v61 = 1.0 / v55;
  const double v62 = 0.5 * v61;
  const double v63 = v50 + v50;
  const double v64 = v38 + v38;
  const double v65 = (v56 != 0.0) ? v41 : 0.0;
  const double v66 = (v47 != 0.0) ? v49 : 0.0;
  const double v67 = v63 * v66;
  const double v68 = -v67;
  const double v69 = (v53 != 0.0) ? v62 : 0.0;
  const double v70 = (v57 != 0.0) ? v69 : 0.0;
  const double v71 = -v37;
  const double v72 = v36 + v71;
  const double v73 = -v36;
  const double v74 = v65 * v73;
  const double v75 = c[18];
  const double v76 = v68 * v75;
  const double v77 = v64 + v76;
  const double v78 = (v36 != 0.0) ? v68 : v77;
  const double v79 = (v37 != 0.0) ? v65 : 0.0;
  const double v80 = v74 + v79;
  const double v81 = v70 * v78;
  const double v82 = v80 + v81;
  v30 = v36;
  v31 = v37;
  v32 = v60;
  v33 = v72;
  v34 = v82;
  }
  double v83 = 0.0;
  double v84 = 0.0;
  if (v9 != 0.0) {
  const double v85 = v28 * v10;
  const double v86 = v85 / v11;
  const double v87 = v86 * v12;
  const double v88 = -v87;
  const double v89 = 287.05 * v88;
  v83 = v86;
  v84 = v89;
  }
  double v90 = 0.0;
  double v91 = 0.0;
  double v92 = 0.0;
  if (v29 != 0.0) {
  const double v93 = c[8];
  const double v94 = (v30 != 0.0) ? v93 : v83;
  const double v95 = 293.15 / v94;
  const double v96 = sqrt(v95);
  const double v97 = c[9];
  const double v98 = v97 * v96;
  const double v99 = v29 * v98;
  const double v100 = v99 * v32;
  const double v101 = 1.0 / v96;
  const double v102 = 0.5 * v101;
  const double v103 = 1.0 / v94;
  const double v104 = v95 * v103;
  const double v105 = -v104;
  const double v106 = (v31 != 0.0) ? v105 : 0.0;
  const double v107 = v102 * v106;
  const double v108 = v97 * v107;
  const double v109 = v29 * v108;
  const double v110 = v32 * v109;
  const double v111 = v99 * v33;
  const double v112 = v111 * v34;
  v90 = v100;
  v91 = v110;
  v92 = v112;
  }
  const double v113 = u[1];
  double v114 = 0.0;
  double v115 = 0.0;
  double v116 = 0.0;
  if (v113 != 0.0) {
  const double v117 = (v27 <= v28) ? 1.0 : 0.0;
  const double v118 = (v117 == 0.0) ? 1.0 : 0.0;
  const double v119 = c[8];
  const double v120 = (v117 != 0.0) ? v83 : v119;
  const double v121 = 293.15 / v120;
  const double v122 = sqrt(v121);
  const double v123 = c[13];
  const double v124 = v123 * v122;
  const double v125 = v113 * v124;
  const double v126 = (v28 > v27) ? v28 : v27;
  const double v127 = (v27 < v28) ? v27 : v28;
  const double v128 = v126 - v127;
  const double v129 = c[14];
  const double v130 = v129 * v128;
  const double v131 = v126 * v126;
  const double v132 = c[15];
  const double v133 = v132 * v126;
  const double v134 = v127 - v133;
  const double v135 = (0.0 <= v134) ? 1.0 : 0.0;
  const double v136 = (v134 > 0.0) ? v134 : 0.0;
  const double v137 = c[16];
  const double v138 = v136 * v137;
  const double v139 = v138 * v138;
  const double v140 = v131 - v139;
  const double v141 = (1.0 <= v140) ? 1.0 : 0.0;
  const double v142 = (v140 > 1.0) ? v140 : 1.0;
  const double v143 = sqrt(v142);
  const double v144 = (v130 <= v143) ? 1.0 : 0.0;
  const double v145 = (v144 == 0.0) ? 1.0 : 0.0;
  const double v146 = (v130 < v143) ? v130 : v143;
  const double v147 = -v146;
  const double v148 = (v117 != 0.0) ? v146 : v147;
  const double v149 = v125 * v148;
  const double v150 = 1.0 / v143;
  const double v151 = 0.5 * v150;
  const double v152 = v138 + v138;
  const double v153 = v126 + v126;
  const double v154 = 1.0 / v122;
  const double v155 = 0.5 * v154;
  const double v156 = 1.0 / v120;
  const double v157 = v121 * v156;
  const double v158 = -v157;
  const double v159 = (v117 != 0.0) ? v158 : 0.0;
  const double v160 = v155 * v159;
  const double v161 = v123 * v160;
  const double v162 = v113 * v161;
  const double v163 = v148 * v162;
  const double v164 = (v144 != 0.0) ? v129 : 0.0;
  const double v165 = (v135 != 0.0) ? v137 : 0.0;
  const double v166 = v152 * v165;
  const double v167 = -v166;
  const double v168 = (v141 != 0.0) ? v151 : 0.0;
  const double v169 = (v145 != 0.0) ? v168 : 0.0;
  const double v170 = -v118;
  const double v171 = v117 + v170;
  const double v172 = v125 * v171;
  const double v173 = v164 * v170;
  const double v174 = c[19];
  const double v175 = v167 * v174;
  const double v176 = v153 + v175;
  const double v177 = (v117 != 0.0) ? v176 : v167;
  const double v178 = (v117 != 0.0) ? v164 : 0.0;
  const double v179 = v173 + v178;
  const double v180 = v169 * v177;
  const double v181 = v179 + v180;
  const double v182 = v172 * v181;
  const double v183 = -v163;
  const double v184 = -v182;
  v114 = v149;
  v115 = v183;
  v116 = v184;
  }
  const double v185 = v90 - v114;
  const double v186 = 1.0 / v10;
  const double v187 = v91 + v115;
  double v188 = 0.0;
  double v189 = 0.0;
  if (v186 != 0.0) {
  const double v190 = c[17];
  const double v191 = pow(v24, v190);
  const double v192 = v25 * v191;
  const double v193 = v186 * v2;
  const double v194 = v192 * v193;
  const double v195 = v27 * v194;
  const double v196 = v92 + v116;
  const double v197 = v196 * v195;
  v188 = v195;
  v189 = v197;
  }
  double v198 = 0.0;
  if (v9 != 0.0) {
  const double v199 = v13 * v188;
  v198 = v199;
  }
  const double v200 = v84 + v198;
  const double v201 = v187 * v200;
  const double v202 = v189 + v201;
  f[0] = v185;
  J[0] = v202;
}

static void actuator_factor(const double *restrict J, double d, double *restrict A) {
  const double v1 = J[0];
  const double v2 = d - v1;
  const double v3 = 1.0 / v2;
  A[0] = v3;
}

static void actuator_solve(const double *restrict A, const double *restrict b, double *restrict y) {
  const double v1 = b[0];
  const double v2 = A[0];
  const double v3 = v1 * v2;
  y[0] = v3;
}

static void actuator_stage(const double *restrict x, const double *restrict u, const double *restrict c, const double *restrict A, const double *restrict g, double *restrict k) {
  const double v1 = x[0];
  const double v2 = c[0];
  const double v3 = v1 * v2;
  const double v4 = u[2];
  const double v5 = c[1];
  const double v6 = v4 * v5;
  const double v7 = 1.0 - v6;
  const double v8 = c[2];
  const double v9 = v8 * v7;
  double v10 = 0.0;
  double v11 = 0.0;
  if (v9 != 0.0) {
  const double v12 = c[3];
  const double v13 = v7 * v12;
  const double v14 = v13 * v13;
  const double v15 = 1.0 - v14;
  const double v16 = v9 * v15;
  const double v17 = c[4];
  const double v18 = v16 * v17;
  const double v19 = 287.05 * v1;
  v10 = v18;
  v11 = v19;
  }
  const double v20 = v3 / v10;
  const double v21 = c[5];
  const double v22 = pow(v20, v21);
  const double v23 = c[6];
  const double v24 = v23 * v22;
  double v25 = 0.0;
  if (v9 != 0.0) {
  const double v26 = v24 * v10;
  const double v27 = v26 / v11;
  v25 = v27;
  }
  const double v28 = u[0];
  double v29 = 0.0;
  if (v28 != 0.0) {
  const double v30 = c[7];
  const double v31 = (v24 <= v30) ? 1.0 : 0.0;
  const double v32 = c[8];
  const double v33 = (v31 != 0.0) ? v32 : v25;
  const double v34 = 293.15 / v33;
  const double v35 = sqrt(v34);
  const double v36 = c[9];
  const double v37 = v36 * v35;
  const double v38 = v28 * v37;
  const double v39 = (v30 > v24) ? v30 : v24;
  const double v40 = (v24 < v30) ? v24 : v30;
  const double v41 = v39 - v40;
  const double v42 = c[10];
  const double v43 = v42 * v41;
  const double v44 = v39 * v39;
  const double v45 = c[11];
  const double v46 = v45 * v39;
  const double v47 = v40 - v46;
  const double v48 = (v47 > 0.0) ? v47 : 0.0;
  const double v49 = c[12];
  const double v50 = v48 * v49;
  const double v51 = v50 * v50;
  const double v52 = v44 - v51;
  const double v53 = (v52 > 1.0) ? v52 : 1.0;
  const double v54 = sqrt(v53);
  const double v55 = (v43 < v54) ? v43 : v54;
  const double v56 = -v55;
  const double v57 = (v31 != 0.0) ? v55 : v56;
  const double v58 = v38 * v57;
  v29 = v58;
  }
  const double v59 = u[1];
  double v60 = 0.0;
  if (v59 != 0.0) {
  const double v61 = (v23 <= v24) ? 1.0 : 0.0;
  const double v62 = c[8];
  const double v63 = (v61 != 0.0) ? v25 : v62;
  const double v64 = 293.15 / v63;
  const double v65 = sqrt(v64);
  const double v66 = c[13];
  const double v67 = v66 * v65;
  const double v68 = v59 * v67;
  const double v69 = (v24 > v23) ? v24 : v23;
  const double v70 = (v23 < v24) ? v23 : v24;
  const double v71 = v69 - v70;
  const double v72 = c[14];
  const double v73 = v72 * v71;
  const double v74 = v69 * v69;
  const double v75 = c[15];
  const double v76 = v75 * v69;
  const double v77 = v70 - v76;
  const double v78 = (v77 > 0.0) ? v77 : 0.0;
  const double v79 = c[16];
  const double v80 = v78 * v79;
  const double v81 = v80 * v80;
  const double v82 = v74 - v81;
  const double v83 = (v82 > 1.0) ? v82 : 1.0;
  const double v84 = sqrt(v83);
  const double v85 = (v73 < v84) ? v73 : v84;
  const double v86 = -v85;
  const double v87 = (v61 != 0.0) ? v85 : v86;
  const double v88 = v68 * v87;
  v60 = v88;
  }
  const double v89 = v29 - v60;
  const double v90 = g[0];
  const double v91 = v89 + v90;
  const double v92 = A[0];
  const double v93 = v91 * v92;
  k[0] = v93;
}

static void actuator_df_dt(const double *restrict x, const double *restrict u, const double *restrict c, const double *restrict w, double *restrict f) {
  const double v1 = x[0];
  const double v2 = c[0];
  const double v3 = v1 * v2;
  const double v4 = u[2];
  const double v5 = c[1];
  const double v6 = v4 * v5;
  const double v7 = 1.0 - v6;
  const double v8 = 287.05 * v1;
  const double v9 = w[2];
  const double v10 = v9 * v5;
  double v11 = 0.0;
  double v12 = 1.0;
  double v13 = 0.0;
  if (v7 != 0.0) {
  const double v14 = c[2];
  const double v15 = v14 * v7;
  const double v16 = c[3];
  const double v17 = v7 * v16;
  const double v18 = v17 * v17;
  const double v19 = 1.0 - v18;
  const double v20 = v17 + v17;
  const double v21 = v16 * v10;
  const double v22 = v20 * v21;
  const double v23 = v15 * v22;
  v11 = v15;
  v12 = v19;
  v13 = v23;
  }
  const double v24 = v11 * v12;
  double v25 = 0.0;
  if (v24 != 0.0) {
  const double v26 = c[4];
  const double v27 = v24 * v26;
  v25 = v27;
  }
  const double v28 = v3 / v25;
  const double v29 = c[5];
  const double v30 = pow(v28, v29);
  const double v31 = c[6];
  const double v32 = v31 * v30;
  const double v33 = c[7];
  const double v34 = (v32 <= v33) ? 1.0 : 0.0;
  const double v35 = (v34 == 0.0) ? 1.0 : 0.0;
  const double v36 = (v33 > v32) ? v33 : v32;
  const double v37 = (v32 < v33) ? v32 : v33;
  const double v38 = v36 - v37;
  const double v39 = c[10];
  const double v40 = v39 * v38;
  const double v41 = v36 * v36;
  const double v42 = c[11];
  const double v43 = v42 * v36;
  const double v44 = v37 - v43;
  const double v45 = (v44 > 0.0) ? v44 : 0.0;
  const double v46 = c[12];
  const double v47 = v45 * v46;
  const double v48 = v47 * v47;
  const double v49 = v41 - v48;
  const double v50 = (v49 > 1.0) ? v49 : 1.0;
  const double v51 = sqrt(v50);
  const double v52 = (v40 < v51) ? v40 : v51;
  const double v53 = -v52;
  const double v54 = (v34 != 0.0) ? v52 : v53;
  const double v55 = c[2];
  const double v56 = v55 * v10;
  const double v57 = v12 * v56;
  const double v58 = v13 - v57;
  const double v59 = (v31 <= v32) ? 1.0 : 0.0;
  const double v60 = (v32 > v31) ? v32 : v31;
  const double v61 = (v31 < v32) ? v31 : v32;
  const double v62 = v60 - v61;
  const double v63 = c[14];
  const double v64 = v63 * v62;
  const double v65 = v60 * v60;
  const double v66 = c[15];
  const double v67 = v66 * v60;
  const double v68 = v61 - v67;
  const double v69 = (v68 > 0.0) ? v68 : 0.0;
  const double v70 = c[16];
  const double v71 = v69 * v70;
  double v72 = 0.0;
  double v73 = 0.0;
  double v74 = 0.0;
  double v75 = 0.0;
  double v76 = 0.0;
  double v77 = 0.0;
  double v78 = 0.0;
  double v79 = 0.0;
  if (v58 != 0.0) {
  const double v80 = (0.0 <= v44) ? 1.0 : 0.0;
  const double v81 = c[4];
  const double v82 = v58 * v81;
  const double v83 = v32 * v82;
  const double v84 = c[20];
  const double v85 = pow(v28, v84);
  const double v86 = v29 * v85;
  const double v87 = v28 / v25;
  const double v88 = v87 * v82;
  const double v89 = v86 * v88;
  const double v90 = v31 * v89;
  const double v91 = -v90;
  const double v92 = (v34 != 0.0) ? v90 : v91;
  const double v93 = v39 * v92;
  const double v94 = v36 + v36;
  const double v95 = v94 * v90;
  const double v96 = -v95;
  const double v97 = (v35 != 0.0) ? v96 : 0.0;
  const double v98 = v47 + v47;
  const double v99 = v42 * v90;
  const double v100 = (v34 != 0.0) ? v91 : v99;
  const double v101 = v100 * v46;
  const double v102 = v98 * v101;
  const double v103 = -v102;
  const double v104 = (v80 != 0.0) ? v103 : 0.0;
  const double v105 = (0.0 <= v68) ? 1.0 : 0.0;
  const double v106 = (v59 != 0.0) ? v91 : v90;
  const double v107 = v63 * v106;
  const double v108 = v60 + v60;
  const double v109 = v108 * v90;
  const double v110 = -v109;
  const double v111 = (v59 != 0.0) ? v110 : 0.0;
  const double v112 = v71 + v71;
  const double v113 = v66 * v90;
  const double v114 = (v59 != 0.0) ? v113 : v91;
  const double v115 = v114 * v70;
  const double v116 = v112 * v115;
  const double v117 = -v116;
  const double v118 = (v105 != 0.0) ? v117 : 0.0;
  v72 = v83;
  v73 = v90;
  v74 = v93;
  v75 = v97;
  v76 = v104;
  v77 = v107;
  v78 = v111;
  v79 = v118;
  }
  double v119 = 0.0;
  double v120 = 0.0;
  if (v24 != 0.0) {
  const double v121 = v32 * v25;
  const double v122 = v121 / v8;
  const double v123 = v25 * v73;
  v119 = v122;
  v120 = v123;
  }
  const double v124 = c[8];
  const double v125 = (v34 != 0.0) ? v124 : v119;
  const double v126 = 293.15 / v125;
  const double v127 = sqrt(v126);
  const double v128 = c[9];
  const double v129 = v128 * v127;
  const double v130 = w[0];
  const double v131 = v129 * v130;
  const double v132 = v72 - v120;
  const double v133 = v132 / v8;
  const double v134 = u[0];
  double v135 = 0.0;
  double v136 = 0.0;
  if (v134 != 0.0) {
  const double v137 = (1.0 <= v49) ? 1.0 : 0.0;
  const double v138 = (v40 <= v51) ? 1.0 : 0.0;
  const double v139 = v126 / v125;
  const double v140 = v139 * v133;
  const double v141 = v127 + v127;
  const double v142 = v140 / v141;
  const double v143 = v128 * v142;
  const double v144 = v134 * v143;
  const double v145 = -v144;
  const double v146 = (v35 != 0.0) ? v145 : 0.0;
  const double v147 = v134 * v129;
  const double v148 = v75 + v76;
  const double v149 = v51 + v51;
  const double v150 = v148 / v149;
  const double v151 = (v137 != 0.0) ? v150 : 0.0;
  const double v152 = (v138 != 0.0) ? v74 : v151;
  const double v153 = -v152;
  const double v154 = (v34 != 0.0) ? v152 : v153;
  const double v155 = v147 * v154;
  v135 = v146;
  v136 = v155;
  }
  const double v156 = v131 + v135;
  const double v157 = v54 * v156;
  const double v158 = v157 + v136;
  const double v159 = v71 * v71;
  const double v160 = v65 - v159;
  const double v161 = (v160 > 1.0) ? v160 : 1.0;
  const double v162 = sqrt(v161);
  const double v163 = (v64 < v162) ? v64 : v162;
  const double v164 = -v163;
  const double v165 = (v59 != 0.0) ? v163 : v164;
  const double v166 = (v59 != 0.0) ? v119 : v124;
  const double v167 = 293.15 / v166;
  const double v168 = sqrt(v167);
  const double v169 = c[13];
  const double v170 = v169 * v168;
  const double v171 = w[1];
  const double v172 = v170 * v171;
  const double v173 = u[1];
  double v174 = 0.0;
  double v175 = 0.0;
  if (v173 != 0.0) {
  const double v176 = (1.0 <= v160) ? 1.0 : 0.0;
  const double v177 = (v64 <= v162) ? 1.0 : 0.0;
  const double v178 = v167 / v166;
  const double v179 = v178 * v133;
  const double v180 = v168 + v168;
  const double v181 = v179 / v180;
  const double v182 = v169 * v181;
  const double v183 = v173 * v182;
  const double v184 = -v183;
  const double v185 = (v59 != 0.0) ? v184 : 0.0;
  const double v186 = v173 * v170;
  const double v187 = v78 + v79;
  const double v188 = v162 + v162;
  const double v189 = v187 / v188;
  const double v190 = (v176 != 0.0) ? v189 : 0.0;
  const double v191 = (v177 != 0.0) ? v77 : v190;
  const double v192 = -v191;
  const double v193 = (v59 != 0.0) ? v191 : v192;
  const double v194 = v186 * v193;
  v174 = v185;
  v175 = v194;
  }
  const double v195 = v172 + v174;
  const double v196 = v165 * v195;
  const double v197 = v196 + v175;
  const double v198 = v158 - v197;
  f[0] = v198;
}

void actuator_outputs(const double *restrict x, const double *restrict u, const double *restrict c, double *restrict o) {
  const double v1 = x[0];
  const double v2 = c[0];
  const double v3 = v1 * v2;
  const double v4 = u[2];
  double v5 = 0.0;
  double v6 = 1.0;
  double v7 = 0.0;
  if (v4 != 0.0) {
  const double v8 = c[1];
  const double v9 = v4 * v8;
  const double v10 = 1.0 - v9;
  const double v11 = c[33];
  const double v12 = v11 * v9;
  const double v13 = c[34];
  const double v14 = v12 * v13;
  v5 = v9;
  v6 = v10;
  v7 = v14;
  }
  const double v15 = c[2];
  const double v16 = v15 * v6;
  double v17 = 0.0;
  double v18 = 0.0;
  if (v16 != 0.0) {
  const double v19 = c[3];
  const double v20 = v6 * v19;
  const double v21 = v20 * v20;
  const double v22 = 1.0 - v21;
  const double v23 = v16 * v22;
  const double v24 = c[4];
  const double v25 = v23 * v24;
  const double v26 = 287.05 * v1;
  v17 = v25;
  v18 = v26;
  }
  const double v27 = v3 / v17;
  const double v28 = c[5];
  const double v29 = pow(v27, v28);
  const double v30 = c[6];
  const double v31 = v30 * v29;
  const double v32 = v31 - v30;
  const double v33 = c[21];
  const double v34 = v33 * v6;
  double v35 = 0.0;
  double v36 = 0.0;
  double v37 = 0.0;
  if (v34 != 0.0) {
  const double v38 = v34 * v34;
  const double v39 = 3.0 * v38;
  const double v40 = c[24];
  const double v41 = v34 * v40;
  const double v42 = c[25];
  const double v43 = v42 + v41;
  const double v44 = v34 * v43;
  const double v45 = c[26];
  const double v46 = v45 + v44;
  const double v47 = v34 * v46;
  v35 = v38;
  v36 = v39;
  v37 = v47;
  }
  const double v48 = c[22];
  const double v49 = v48 - v36;
  const double v50 = c[23];
  const double v51 = v49 * v50;
  const double v52 = v32 * v51;
  const double v53 = c[27];
  const double v54 = v53 + v37;
  const double v55 = c[28];
  const double v56 = v54 * v55;
  const double v57 = 3.141592653589793 * v56;
  const double v58 = v48 - v35;
  const double v59 = sqrt(v58);
  const double v60 = c[29];
  const double v61 = v59 * v60;
  double v62 = 0.0;
  if (v34 != 0.0) {
  const double v63 = c[30];
  const double v64 = v61 * v63;
  const double v65 = v64 - 1.0;
  const double v66 = v57 * v65;
  const double v67 = v66 * v34;
  const double v68 = c[31];
  const double v69 = v68 * v59;
  const double v70 = v34 / v69;
  const double v71 = v67 * v70;
  v62 = v71;
  }
  const double v72 = v52 + v62;
  double v73 = 0.0;
  if (v4 != 0.0) {
  const double v74 = v34 - v33;
  const double v75 = v57 * v74;
  const double v76 = c[32];
  const double v77 = v75 * v76;
  const double v78 = v77 * v61;
  v73 = v78;
  }
  const double v79 = v72 + v73;
  const double v80 = -v79;
  const double v81 = (v80 > 0.0) ? v80 : 0.0;
  const double v82 = v81 - v7;
  const double v83 = c[35];
  const double v84 = u[3];
  const double v85 = v83 * v84;
  const double v86 = v82 - v85;
  const double v87 = (v86 > 0.0) ? v86 : 0.0;
  double v88 = 0.0;
  if (v16 != 0.0) {
  const double v89 = v31 * v17;
  const double v90 = v89 / v18;
  v88 = v90;
  }
  const double v91 = u[0];
  double v92 = 0.0;
  if (v91 != 0.0) {
  const double v93 = c[7];
  const double v94 = (v31 <= v93) ? 1.0 : 0.0;
  const double v95 = c[8];
  const double v96 = (v94 != 0.0) ? v95 : v88;
  const double v97 = 293.15 / v96;
  const double v98 = sqrt(v97);
  const double v99 = c[9];
  const double v100 = v99 * v98;
  const double v101 = v91 * v100;
  const double v102 = (v93 > v31) ? v93 : v31;
  const double v103 = (v31 < v93) ? v31 : v93;
  const double v104 = v102 - v103;
  const double v105 = c[10];
  const double v106 = v105 * v104;
  const double v107 = v102 * v102;
  const double v108 = c[11];
  const double v109 = v108 * v102;
  const double v110 = v103 - v109;
  const double v111 = (v110 > 0.0) ? v110 : 0.0;
  const double v112 = c[12];
  const double v113 = v111 * v112;
  const double v114 = v113 * v113;
  const double v115 = v107 - v114;
  const double v116 = (v115 > 1.0) ? v115 : 1.0;
  const double v117 = sqrt(v116);
  const double v118 = (v106 < v117) ? v106 : v117;
  const double v119 = -v118;
  const double v120 = (v94 != 0.0) ? v118 : v119;
  const double v121 = v101 * v120;
  v92 = v121;
  }
  const double v122 = u[1];
  double v123 = 0.0;
  if (v122 != 0.0) {
  const double v124 = (v30 <= v31) ? 1.0 : 0.0;
  const double v125 = c[8];
  const double v126 = (v124 != 0.0) ? v88 : v125;
  const double v127 = 293.15 / v126;
  const double v128 = sqrt(v127);
  const double v129 = c[13];
  const double v130 = v129 * v128;
  const double v131 = v122 * v130;
  const double v132 = (v31 > v30) ? v31 : v30;
  const double v133 = (v30 < v31) ? v30 : v31;
  const double v134 = v132 - v133;
  const double v135 = c[14];
  const double v136 = v135 * v134;
  const double v137 = v132 * v132;
  const double v138 = c[15];
  const double v139 = v138 * v132;
  const double v140 = v133 - v139;
  const double v141 = (v140 > 0.0) ? v140 : 0.0;
  const double v142 = c[16];
  const double v143 = v141 * v142;
  const double v144 = v143 * v143;
  const double v145 = v137 - v144;
  const double v146 = (v145 > 1.0) ? v145 : 1.0;
  const double v147 = sqrt(v146);
  const double v148 = (v136 < v147) ? v136 : v147;
  const double v149 = -v148;
  const double v150 = (v124 != 0.0) ? v148 : v149;
  const double v151 = v131 * v150;
  v123 = v151;
  }
  const double v152 = v92 - v123;
  o[0] = v32;
  o[1] = v5;
  o[2] = v87;
  o[3] = v17;
  o[4] = v152;
}

#define ACTUATOR_RTOL 1e-06
#define GAMMA 0.25
#define A21 1.544
#define A31 0.9466785280815826
#define A32 0.2557011698983284
#define A41 3.314825187068521
#define A42 2.896124015972201
#define A43 0.9986419139977817
#define A51 1.221224509226641
#define A52 6.019134481288629
#define A53 12.53708332932087
#define A54 (-0.687886036105895)
#define C21 (-5.6688)
#define C31 (-2.430093356833875)
#define C32 (-0.2063599157091915)
#define C41 (-0.1073529058151375)
#define C42 (-9.594562251023355)
#define C43 (-20.47028614809616)
#define C51 7.496443313967647
#define C52 (-10.24680431464352)
#define C53 (-33.99990352819905)
#define C54 11.7089089320616
#define C61 8.083246795921522
#define C62 (-7.981132988064893)
#define C63 (-31.52159432874371)
#define C64 16.31930543123136
#define C65 (-6.058818238834054)
#define D1 0.25
#define D2 (-0.1043)
#define D3 0.1035
#define D4 (-0.03620000000000023)
#define N2 0.386
#define N3 0.21
#define N4 0.63
#define H21 10.12623508344586
#define H22 (-7.487995877610167)
#define H23 (-34.80091861555747)
#define H24 (-7.992771707568823)
#define H25 1.025137723295662
#define H31 (-0.6762803392801253)
#define H32 6.087714651680015
#define H33 16.43084320892478
#define H34 24.76722511418386
#define H35 (-6.594389125716872)
#define ACTUATOR_JACOBIAN 1
#define ACTUATOR_FACTORS 1

/* Solver: one step at a time within a segment, in which the inputs are linear in time. */

void actuator_begin(actuator_solver *s, double t, const double *x)
{
  int i;
  s->t = s->t_before = s->start = s->end = t;
  s->h = ACTUATOR_FIRST_STEP;
  s->h_taken = 0.0;
  s->rtol = ACTUATOR_RTOL;
  s->steps = s->rejected = s->done = 0;
  s->moving = 0;
  for (i = 0; i < ACTUATOR_STATES; i++) s->x[i] = s->x_before[i] = x[i];
}

void actuator_set_segment(actuator_solver *s, double end, const double *u, const double *w)
{
  int i;
  s->start = s->t;
  s->end = end;
  s->done = 0;
  s->moving = 0;
  for (i = 0; i < ACTUATOR_INPUTS; i++) {
    s->u[i] = u[i];
    s->w[i] = w[i];
    if (w[i] != 0.0) s->moving = 1;
  }
}

void actuator_inputs_at(const actuator_solver *s, double time, double *u)
{
  int i;
  for (i = 0; i < ACTUATOR_INPUTS; i++) u[i] = s->u[i] + (time - s->start) * s->w[i];
}
/* Rodas4: Rosenbrock method of order four, adaptive, stiffly accurate. Hairer and Wanner, Solving Ordinary Differential
   Equations II (1996), section VI.4, method RODAS. */

static double actuator_norm(double value, double scale)
{
  return (value / scale) * (value / scale);
}

static double actuator_first_step(const actuator_solver *s, const double *f)
{
  double size = 0.0, rate = 0.0, h = s->end - s->t;
  int i;
  for (i = 0; i < ACTUATOR_STATES; i++) {
    const double scale = s->rtol * actuator_nominal[i] + s->rtol * fabs(s->x[i]);
    size += actuator_norm(s->x[i], scale);
    rate += actuator_norm(f[i], scale);
  }
  if (rate > 0.0) h = fmin(h, 0.1 * sqrt(sqrt(s->rtol)) * sqrt((size + 1.0) / rate));
  return h;
}

/* One attempt of size h: the new state yn, and the weighted norm of its error. */
static double actuator_attempt(actuator_solver *s, const double *c, double h, const double *f0, const double *ft,
                            const double *J, double *yn)
{
  double A[ACTUATOR_FACTORS + 1], x[ACTUATOR_STATES], g[ACTUATOR_STATES], u[ACTUATOR_INPUTS + 1];
  double k1[ACTUATOR_STATES], k2[ACTUATOR_STATES], k3[ACTUATOR_STATES], k4[ACTUATOR_STATES], k5[ACTUATOR_STATES], k6[ACTUATOR_STATES];
  const double r = 1.0 / h, *y = s->x;
  double error = 0.0;
  int i;
  actuator_factor(J, r / GAMMA, A);
  for (i = 0; i < ACTUATOR_STATES; i++) g[i] = f0[i] + h * D1 * ft[i];
  actuator_solve(A, g, k1);
  actuator_inputs_at(s, s->t + N2 * h, u);
  for (i = 0; i < ACTUATOR_STATES; i++) {
    x[i] = y[i] + A21 * k1[i];
    g[i] = r * (C21 * k1[i]) + h * D2 * ft[i];
  }
  actuator_stage(x, u, c, A, g, k2);
  actuator_inputs_at(s, s->t + N3 * h, u);
  for (i = 0; i < ACTUATOR_STATES; i++) {
    x[i] = y[i] + A31 * k1[i] + A32 * k2[i];
    g[i] = r * (C31 * k1[i] + C32 * k2[i]) + h * D3 * ft[i];
  }
  actuator_stage(x, u, c, A, g, k3);
  actuator_inputs_at(s, s->t + N4 * h, u);
  for (i = 0; i < ACTUATOR_STATES; i++) {
    x[i] = y[i] + A41 * k1[i] + A42 * k2[i] + A43 * k3[i];
    g[i] = r * (C41 * k1[i] + C42 * k2[i] + C43 * k3[i]) + h * D4 * ft[i];
  }
  actuator_stage(x, u, c, A, g, k4);
  actuator_inputs_at(s, s->t + h, u);
  for (i = 0; i < ACTUATOR_STATES; i++) {
    x[i] = y[i] + A51 * k1[i] + A52 * k2[i] + A53 * k3[i] + A54 * k4[i];
    g[i] = r * (C51 * k1[i] + C52 * k2[i] + C53 * k3[i] + C54 * k4[i]);
  }
  actuator_stage(x, u, c, A, g, k5);
  for (i = 0; i < ACTUATOR_STATES; i++) {
    x[i] += k5[i];
    g[i] = r * (C61 * k1[i] + C62 * k2[i] + C63 * k3[i] + C64 * k4[i] + C65 * k5[i]);
  }
  actuator_stage(x, u, c, A, g, k6);
  for (i = 0; i < ACTUATOR_STATES; i++) {
    yn[i] = x[i] + k6[i];
    error += actuator_norm(k6[i], s->rtol * actuator_nominal[i] + s->rtol * fmax(fabs(y[i]), fabs(yn[i])));
    s->dense[0][i] = H21 * k1[i] + H22 * k2[i] + H23 * k3[i] + H24 * k4[i] + H25 * k5[i];
    s->dense[1][i] = H31 * k1[i] + H32 * k2[i] + H33 * k3[i] + H34 * k4[i] + H35 * k5[i];
  }
  return sqrt(error / ACTUATOR_STATES) + 1e-16;
}

int actuator_step(actuator_solver *s, const double *c)
{
  double f0[ACTUATOR_STATES], ft[ACTUATOR_STATES], yn[ACTUATOR_STATES], J[ACTUATOR_JACOBIAN + 1], u[ACTUATOR_INPUTS + 1];
  double factor, error, kept;
  int i, rejected = 0, last;
  actuator_inputs_at(s, s->t, u);
  actuator_jac(s->x, u, c, f0, J);
  for (i = 0; i < ACTUATOR_STATES; i++) ft[i] = 0.0;
  if (s->moving) actuator_df_dt(s->x, u, c, s->w, ft);
  if (s->h <= 0.0) s->h = actuator_first_step(s, f0);
  for (;;) {
    last = s->t + 1.000001 * s->h >= s->end;
    kept = s->h;
    if (last) s->h = s->end - s->t;
    error = actuator_attempt(s, c, s->h, f0, ft, J, yn);
    if (!(error < 1e300)) {
      factor = 0.5;
    } else {
      factor = fmin(6.0, fmax(0.2, 0.9 / sqrt(sqrt(error))));
      if (error <= 1.0) break;
    }
    rejected = 1;
    s->rejected++;
    s->h *= factor;
    if (s->h < 1e-14 * fmax(fabs(s->t), s->end - s->start)) return error < 1e300 ? ACTUATOR_STEP_TOO_SMALL : ACTUATOR_NOT_FINITE;
  }
  for (i = 0; i < ACTUATOR_STATES; i++) {
    s->x_before[i] = s->x[i];
    s->x[i] = yn[i];
  }
  s->t_before = s->t;
  s->h_taken = s->h;
  s->t = last ? s->end : s->t + s->h;
  s->steps++;
  s->h *= rejected ? fmin(factor, 1.0) : factor;
  if (last && s->h < kept) s->h = kept; /* a step cut short by the end of a segment does not shorten the next */
  return ACTUATOR_DONE;
}

void actuator_state_at(const actuator_solver *s, const double *c, double time, double *x)
{
  const double q = s->h_taken > 0.0 ? (time - s->t_before) / s->h_taken : 1.0, p = 1.0 - q;
  int i;
  (void)c;
  if (!(s->h_taken > 0.0) || time >= s->t) {
    for (i = 0; i < ACTUATOR_STATES; i++) x[i] = s->x[i];
    return;
  }
  for (i = 0; i < ACTUATOR_STATES; i++)
    x[i] = s->x_before[i] * p + q * (s->x[i] + p * (s->dense[0][i] + q * s->dense[1][i]));
}

