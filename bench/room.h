// Room: a furnished hall as a benchmark mesh, what rays meet indoors. A closed shell of twelve triangles stands next to
// cups of a thousand, and many long pieces lie askew (parquet, trusses, handrails, tables turned by some degrees), so
// that their boxes overlap: the case in which trees with spatial splits gain most. A pure function of the detail.

#ifndef BENCH_ROOM_H
#define BENCH_ROOM_H

#include "mesh_out.h"

void room_make(MeshOut *m,
               int detail); // 106,344 triangles at detail 19; its curved pieces grow with the square

#endif
