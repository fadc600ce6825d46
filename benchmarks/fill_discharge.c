/* The hanging plants of filling.py, optimised for speed: everything inlined, no branches, a step is one function.
   MUSCLES is the number of muscles on the mass; the states are their air masses, then position and speed. The benchmark
   defines EXPLICIT_STAGES from the tableau, a RATES(i, terms) for each stage after the first, and WEIGHTED, the sum of
   slopes. SKIP skips closed valves and the extrapolation beyond the validity range, with branches but less work. */
#include <math.h>

#ifndef MUSCLES
#define MUSCLES 1
#endif
enum { STATES = MUSCLES + 2, POSITION = MUSCLES, SPEED = MUSCLES + 1 };

typedef struct {
  double inverse_length, inverse_volume, cc, rt, ambient, supply;
  double fill, discharge, critical, inverse_subsonic, laminar;
  double low_x, scale_x, low_q, scale_q, least, greatest, stiffness, damping, growth;
  double a[21];
} Muscle;

typedef struct { double inverse_mass, gravity; Muscle muscles[MUSCLES]; } Plant;

#define INLINE static inline __attribute__((always_inline))
INLINE double larger(double a, double b) { return a > b ? a : b; }
INLINE double smaller(double a, double b) { return a < b ? a : b; }

INLINE double flow(const Muscle *p, double up, double down) {
  double high = larger(up, down), low = smaller(up, down);
  double beyond = larger(low - p->critical * high, 0.0) * p->inverse_subsonic;
  double ellipse = sqrt(larger(high * high - beyond * beyond, 1.0));
  double q = smaller(ellipse, p->laminar * (high - low));
  return up >= down ? q : -q;
}

INLINE double surface_value(const double *a, double x, double q) {
  double r0 = a[0] + x * (a[1] + x * (a[2] + x * (a[3] + x * (a[4] + x * a[5]))));
  double r1 = a[6] + x * (a[7] + x * (a[8] + x * (a[9] + x * a[10])));
  double r2 = a[11] + x * (a[12] + x * (a[13] + x * a[14]));
  double r3 = a[15] + x * (a[16] + x * a[17]), r4 = a[18] + x * a[19];
  return r0 + q * (r1 + q * (r2 + q * (r3 + q * (r4 + q * a[20]))));
}

INLINE double surface(const Muscle *p, double x, double q) {
  const double *a = p->a;
#ifdef SKIP
  if (x >= -1.0 && x <= 1.0 && q >= -1.0 && q <= 1.0) return surface_value(a, x, q);
#endif
  double xi = smaller(larger(x, -1.0), 1.0), qi = smaller(larger(q, -1.0), 1.0);
  double r0 = a[0] + xi * (a[1] + xi * (a[2] + xi * (a[3] + xi * (a[4] + xi * a[5]))));
  double r1 = a[6] + xi * (a[7] + xi * (a[8] + xi * (a[9] + xi * a[10])));
  double r2 = a[11] + xi * (a[12] + xi * (a[13] + xi * a[14]));
  double r3 = a[15] + xi * (a[16] + xi * a[17]), r4 = a[18] + xi * a[19];
  double d0 = a[1] + xi * (2 * a[2] + xi * (3 * a[3] + xi * (4 * a[4] + xi * 5 * a[5])));
  double d1 = a[7] + xi * (2 * a[8] + xi * (3 * a[9] + xi * 4 * a[10]));
  double d2 = a[12] + xi * (2 * a[13] + xi * 3 * a[14]), d3 = a[16] + xi * 2 * a[17];
  double f = r0 + qi * (r1 + qi * (r2 + qi * (r3 + qi * (r4 + qi * a[20]))));
  double by_x = d0 + qi * (d1 + qi * (d2 + qi * (d3 + qi * a[19])));
  double by_q = r1 + qi * (2 * r2 + qi * (3 * r3 + qi * (4 * r4 + qi * 5 * a[20])));
  by_x = by_x < 0 ? by_x : 0;
  by_q = by_q > 0 ? by_q : 0;
  return f + by_x * (x - xi) + by_q * (q - qi);
}

/* Returns the tension of one muscle; `air_rate` is the mass flow into it. */
INLINE double muscle(const Muscle *p, double air, double position, double speed, double fill, double discharge,
                     double *air_rate) {
  double contraction = position * p->inverse_length, s = 1.0 - contraction;
  double pressure = air * p->rt / (p->inverse_volume * s * (1.0 - p->cc * s * s)), gauge = pressure - p->ambient;
  double x = (contraction - p->low_x) * p->scale_x - 1.0, q = (gauge - p->low_q) * p->scale_q - 1.0;
  double force = smaller(larger(surface(p, x, q), p->least), p->greatest);
#ifdef SKIP
  double into = 0.0;
  if (fill != 0.0) into += fill * p->fill * flow(p, p->supply, pressure);
  if (discharge != 0.0) into -= discharge * p->discharge * flow(p, pressure, p->ambient);
  *air_rate = into;
#else
  *air_rate = fill * p->fill * flow(p, p->supply, pressure) - discharge * p->discharge * flow(p, pressure, p->ambient);
#endif
  return larger(force - p->stiffness * position - (p->damping + p->growth * gauge) * speed, 0.0);
}

/* k = rates at y for the valve openings u: fill and discharge of every muscle. */
INLINE void rates(const Plant *p, const double *y, const double *u, double *k) {
  double total = 0.0;
  for (int i = 0; i < MUSCLES; i++)
    total += muscle(&p->muscles[i], y[i], y[POSITION], y[SPEED], u[2 * i], u[2 * i + 1], &k[i]);
  k[POSITION] = y[SPEED];
  k[SPEED] = total * p->inverse_mass - p->gravity;
}

#ifdef EXPLICIT_STAGES
#define RATES(i, TERMS) \
  double k##i[STATES]; \
  for (int j = 0; j < STATES; j++) x[j] = y[j] + h * (TERMS); \
  rates(p, x, u, k##i);

INLINE void plant_step(const Plant *p, double *y, const double *u, double h) {
  double x[STATES], k0[STATES];
  rates(p, y, u, k0);
  EXPLICIT_STAGES
  for (int j = 0; j < STATES; j++) y[j] += h * (WEIGHTED);
}

/* Writes a row every `every` steps; the steps of each segment must be a multiple of it. */
void run_plant(const Plant *plant, const double *start, int segments, const int *steps, const double *inputs, double h, int every,
         double *rows) {
  Plant local = *plant;
  double y[STATES];
  for (int j = 0; j < STATES; j++) *rows++ = y[j] = start[j];
  for (int s = 0; s < segments; s++) {
    double u[2 * MUSCLES];
    for (int j = 0; j < 2 * MUSCLES; j++) u[j] = inputs[2 * MUSCLES * s + j];
    for (int done = 0; done < steps[s]; done += every) {
      for (int i = 0; i < every; i++) plant_step(&local, y, u, h);
      for (int j = 0; j < STATES; j++) *rows++ = y[j];
    }
  }
}
#endif
