/* The contact kernel of twinrig as a C function: Hertz' contact, and creep forces by FASTSIM or by the linear theory.

   SI units. x in the direction of rolling, z from the wheel into the rail, y to the right of x. Creepages and spin are
   the velocity of the wheel relative to the rail by the rolling speed: rigid slip (xi_x - spin y, xi_y + spin x).
   Forces act on the wheel; pressure and load are positive in compression. Both bodies are taken as of one material:
   1/G = (1/G1 + 1/G2) / 2 and nu/G = (nu1/G1 + nu2/G2) / 2. With E: G = E / (2 (1 + nu)). */
#ifndef TWINRIG_CONTACT_H
#define TWINRIG_CONTACT_H
#include <stdint.h>

enum { /* given: what shape_x, shape_y and pressing are */
  TWINRIG_BY_LOAD = 0,          /* A, B of the undeformed distance A x^2 + B y^2 (1/m), above 0; load (N) */
  TWINRIG_BY_APPROACH = 1,      /* A, B (1/m); approach (m) of distant points from first touch */
  TWINRIG_AXES_BY_LOAD = 2,     /* semi-axes a along x, b along y (m); load (N) */
  TWINRIG_AXES_BY_APPROACH = 3  /* semi-axes (m); approach (m) */
};

enum { /* status: what the function returns; but for the first all of the output is not a number */
  TWINRIG_FINE = 0,
  TWINRIG_NOT_FINITE = 1,    /* an input is infinite or not a number */
  TWINRIG_NOT_PLAUSIBLE = 2, /* an input is out of its range, or no ellipse of contact that rolls comes of them */
  TWINRIG_NOT_KNOWN = 3      /* given is none of the above */
};

typedef struct {
  double shape_x, shape_y;
  double pressing;   /* zero or less: no contact, all of the output is exactly zero */
  double mu;         /* 0 to 10 */
  double xi_x, xi_y; /* -10 to 10 */
  double spin;       /* 1/m */
  double G, nu;      /* Pa; 0 to 1/2 */
} twinrig_in;

typedef struct {
  double fx, fy;   /* N */
  double mz;       /* N m, about the centre of contact */
  double a, b;     /* m */
  double approach; /* m */
  double load;     /* N */
  double stick;    /* share of the area that sticks */
} twinrig_out;

/* net: the table of cells that comes with the function, or that of the undeformed distance of bodies whose contact is no
   ellipse (by approach only; shape_x and shape_y are not read, a and b are half the lengths of the patch). It must not
   be changed. */
typedef int32_t (*twinrig_contact)(int32_t given, const double *net, const twinrig_in *in, twinrig_out *out);
#endif
