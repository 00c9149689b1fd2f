// Lamps by cell: what a cell is lit by, its own and, through gates, those of others. See lamps.c.

#ifndef RAYFOLD_WORLD_LAMPS_H
#define RAYFOLD_WORLD_LAMPS_H

#include "world/prepare.h"

typedef struct LampList { // of a cell; zero is empty
  ARRAY(Emitter) emitters;
  ARRAY(Sun) suns;
  const SkyMap *sky;
} LampList;

// Hands each cell its own emitters and suns; instances then number their emitters within their cell.
bool lamps_by_cell(Prepare *p, LampList *lists);
// Adds images of the lamps beyond gates, and tells the cells where they are. After the skies' suns are in.
bool lamps_through_gates(Prepare *p, LampList *lists);

#endif
