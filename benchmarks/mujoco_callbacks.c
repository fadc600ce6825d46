/* The muscles of fill_discharge.c as MuJoCo actuators: the activation is the air mass, the force is the tension. */
#include <mujoco/mujoco.h>

#include "fill_discharge.c"

static Plant plant;
static double openings[2 * MUSCLES], tensions[MUSCLES];

void hold(const Plant *given) { plant = *given; }
void open_valves(const double *given) {
  for (int i = 0; i < 2 * MUSCLES; i++) openings[i] = given[i];
}

/* MuJoCo evaluates the rates of all activations before the forces, at the same state: tensions are computed once. */
static mjtNum air_rate(const mjModel *m, const mjData *d, int i) {
  double rate;
  tensions[i] = muscle(&plant.muscles[i], d->act[i], d->qpos[0], d->qvel[0], openings[2 * i], openings[2 * i + 1], &rate);
  return rate;
}
static mjtNum no_gain(const mjModel *m, const mjData *d, int i) { return 0; }
static mjtNum tension(const mjModel *m, const mjData *d, int i) { return tensions[i]; }

void install(void) { mjcb_act_dyn = air_rate; mjcb_act_gain = no_gain; mjcb_act_bias = tension; }
void remove_all(void) { mjcb_act_dyn = 0; mjcb_act_gain = 0; mjcb_act_bias = 0; }
