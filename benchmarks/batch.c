/* Batch of plants with three states and different parameters: the equations of fill_discharge.c for LANES plants in
   parallel, RK4 with fixed step. Parameters, switching times and states are arrays (number, plant). Optimised for speed:
   everything that depends only on parameters is precomputed, there are no branches, a block of lanes fits the cache. */
#include <math.h>

#define COUNT 46
enum {
  INVERSE_MASS, GRAVITY, INVERSE_LENGTH, INVERSE_VOLUME, CC, RT, AMBIENT, SUPPLY,
  FILL, FILL_CRITICAL, FILL_SUBSONIC, FILL_LAMINAR, DISCHARGE, DISCHARGE_CRITICAL, DISCHARGE_SUBSONIC, DISCHARGE_LAMINAR,
  LOW_X, SCALE_X, LOW_Q, SCALE_Q, LEAST, GREATEST, STIFFNESS, DAMPING, GROWTH, A
};

typedef struct { double p[COUNT][LANES], at[4][LANES]; } Block;

#define INLINE static inline __attribute__((always_inline))
#define P(name) b->p[name][l]
INLINE double larger(double a, double b) { return a > b ? a : b; }
INLINE double smaller(double a, double b) { return a < b ? a : b; }

INLINE double flow(double up, double down, double critical, double subsonic, double laminar) {
  double high = larger(up, down), low = smaller(up, down);
  double beyond = larger(low - critical * high, 0.0) * subsonic;
  double ellipse = sqrt(larger(high * high - beyond * beyond, 1.0));
  double q = smaller(ellipse, laminar * (high - low));
  return up >= down ? q : -q;
}

INLINE double surface(const Block *b, int l, double x, double q) {
#define C(i) b->p[A + i][l]
  double xi = smaller(larger(x, -1.0), 1.0), qi = smaller(larger(q, -1.0), 1.0);
  double r0 = C(0) + xi * (C(1) + xi * (C(2) + xi * (C(3) + xi * (C(4) + xi * C(5)))));
  double r1 = C(6) + xi * (C(7) + xi * (C(8) + xi * (C(9) + xi * C(10))));
  double r2 = C(11) + xi * (C(12) + xi * (C(13) + xi * C(14)));
  double r3 = C(15) + xi * (C(16) + xi * C(17)), r4 = C(18) + xi * C(19);
  double d0 = C(1) + xi * (2 * C(2) + xi * (3 * C(3) + xi * (4 * C(4) + xi * 5 * C(5))));
  double d1 = C(7) + xi * (2 * C(8) + xi * (3 * C(9) + xi * 4 * C(10)));
  double d2 = C(12) + xi * (2 * C(13) + xi * 3 * C(14)), d3 = C(16) + xi * 2 * C(17);
  double f = r0 + qi * (r1 + qi * (r2 + qi * (r3 + qi * (r4 + qi * C(20)))));
  double by_x = d0 + qi * (d1 + qi * (d2 + qi * (d3 + qi * C(19))));
  double by_q = r1 + qi * (2 * r2 + qi * (3 * r3 + qi * (4 * r4 + qi * 5 * C(20))));
  return f + smaller(by_x, 0.0) * (x - xi) + larger(by_q, 0.0) * (q - qi);
}

INLINE void rates(const Block *b, int l, double air, double position, double speed, double fill, double discharge,
                  double *air_rate, double *velocity, double *acceleration) {
  double contraction = position * P(INVERSE_LENGTH), s = 1.0 - contraction;
  double pressure = air * P(RT) / (P(INVERSE_VOLUME) * s * (1.0 - P(CC) * s * s)), gauge = pressure - P(AMBIENT);
  double x = (contraction - P(LOW_X)) * P(SCALE_X) - 1.0, q = (gauge - P(LOW_Q)) * P(SCALE_Q) - 1.0;
  double force = smaller(larger(surface(b, l, x, q), P(LEAST)), P(GREATEST));
  double tension = larger(force - P(STIFFNESS) * position - (P(DAMPING) + P(GROWTH) * gauge) * speed, 0.0);
  *air_rate = fill * flow(P(SUPPLY), pressure, P(FILL_CRITICAL), P(FILL_SUBSONIC), P(FILL_LAMINAR)) -
              discharge * flow(pressure, P(AMBIENT), P(DISCHARGE_CRITICAL), P(DISCHARGE_SUBSONIC), P(DISCHARGE_LAMINAR));
  *velocity = speed;
  *acceleration = tension * P(INVERSE_MASS) - P(GRAVITY);
}

static void steps(const Block *b, double *air, double *position, double *speed, long from, long to, double h) {
  for (long step = from; step < to; step++) {
    double now = ((double)step + 0.5) * h;
#pragma omp simd
    for (int l = 0; l < LANES; l++) {
      double fill = now > b->at[0][l] && now < b->at[1][l] ? P(FILL) : 0.0;
      double discharge = now > b->at[2][l] && now < b->at[3][l] ? P(DISCHARGE) : 0.0;
      double m = air[l], y = position[l], v = speed[l], half = 0.5 * h, sixth = h / 6.0;
      double m1, y1, v1, m2, y2, v2, m3, y3, v3, m4, y4, v4;
      rates(b, l, m, y, v, fill, discharge, &m1, &y1, &v1);
      rates(b, l, m + half * m1, y + half * y1, v + half * v1, fill, discharge, &m2, &y2, &v2);
      rates(b, l, m + half * m2, y + half * y2, v + half * v2, fill, discharge, &m3, &y3, &v3);
      rates(b, l, m + h * m3, y + h * y3, v + h * v3, fill, discharge, &m4, &y4, &v4);
      air[l] = m + sixth * (m1 + 2 * (m2 + m3) + m4);
      position[l] = y + sixth * (y1 + 2 * (y2 + y3) + y4);
      speed[l] = v + sixth * (v1 + 2 * (v2 + v3) + v4);
    }
  }
}

/* Integrates `state` (3, plants) in place; `plants` is a multiple of LANES. Only blocks `first` to `last` are integrated, so
   that the caller can use several threads. */
void batch(const double *parameters, const double *at, double *state, long plants, long first, long last, long count,
           double h) {
  for (long block = first; block < last; block++) {
    Block b __attribute__((aligned(64)));
    double y[3][LANES] __attribute__((aligned(64)));
    long offset = block * LANES;
    for (int i = 0; i < COUNT; i++)
      for (int l = 0; l < LANES; l++) b.p[i][l] = parameters[i * plants + offset + l];
    for (int i = 0; i < 4; i++)
      for (int l = 0; l < LANES; l++) b.at[i][l] = at[i * plants + offset + l];
    for (int i = 0; i < 3; i++)
      for (int l = 0; l < LANES; l++) y[i][l] = state[i * plants + offset + l];
    steps(&b, y[0], y[1], y[2], 0, count, h);
    for (int i = 0; i < 3; i++)
      for (int l = 0; l < LANES; l++) state[i * plants + offset + l] = y[i][l];
  }
}
