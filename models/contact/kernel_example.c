/* A wheel of 0.46 m on a rail head of 0.3 m is dragged sideways: where its creep force meets a given one.

   cc -O2 -shared -fPIC -o example.so kernel_example.c; whoever loads it hands over the two pointers. */
#include <math.h>
#include "kernel.h"

/* Lateral creepage at which the force on the wheel is -force (N) under a load (N), or not a number where friction
   cannot hold it. */
double creepage_for(twinrig_contact contact, const double *net, double load, double mu, double force) {
  twinrig_in in = {0.5 / 0.46, 0.5 / 0.3, load, mu, 0.0, 0.0, 0.0, 82.03e9, 0.28};
  twinrig_out out;
  double low = 0.0, high = 0.1;
  in.xi_y = high;
  if (contact(TWINRIG_BY_LOAD, net, &in, &out) != TWINRIG_FINE || -out.fy < force) return NAN;
  for (int i = 0; i < 60; i++) {
    in.xi_y = 0.5 * (low + high);
    if (contact(TWINRIG_BY_LOAD, net, &in, &out) != TWINRIG_FINE) return NAN;
    if (-out.fy < force) low = in.xi_y; else high = in.xi_y;
  }
  return in.xi_y;
}
