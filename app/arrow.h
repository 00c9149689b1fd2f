// Arrow: what is carried along a way and turned by nothing but space, and how it is turned when it comes home.

#ifndef RAYFOLD_APP_ARROW_H
#define RAYFOLD_APP_ARROW_H

#include <rayfold/rayfold.h>

// Walks a copy of the arrow the last straight piece to where it was taken up, *way metres, and tells by what angle it points
// aside then, 0 to pi. False: no straight way leads there from here.
bool arrow_turn(const rf_world *w, const rf_body *arrow, const rf_body *home, double *turn, double *way);

#endif
