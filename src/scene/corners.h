// Corners: vertices made of separately numbered parts. OBJ and some PLY files give each corner of a face its own
// position, texture coordinate and normal number; a mesh wants one number a vertex. Equal corners become one vertex.
//
// The position's number is the hash: each position heads a chain of the vertices made with it, newest first, so
// that faces written next to each other find theirs in one step. A chain is searched for a bounded length; past
// it a corner may become a second, equal vertex, which costs memory and nothing else.

#ifndef RAYFOLD_SCENE_CORNERS_H
#define RAYFOLD_SCENE_CORNERS_H

#include "base/array.h"

#include <stdint.h>

#define CORNER_NONE UINT32_MAX // no texture coordinate, no normal, no vertex

typedef struct Corner {
  uint32_t position, texcoord, normal;
  uint32_t next; // in the chain of its position
} Corner;

typedef struct Corners {
  ARRAY(Corner) vertices;
  ARRAY(uint32_t) heads; // one a position
} Corners;               // zero is none

// Room for positions numbered below count.
bool corners_grow(Corners *c, size_t count);
void corners_finish(Corners *c);

// The vertex of a corner; CORNER_NONE when memory is out or numbers are. The position must be below the count
// that corners_grow() was last given.
static inline uint32_t corners_vertex(Corners *c, uint32_t position, uint32_t texcoord, uint32_t normal)
{
  enum { LONGEST_SEARCH = 32 };
  uint32_t *head = &c->heads.items[position];
  const Corner *v = c->vertices.items;
  int steps = 0;
  for (uint32_t i = *head; i != CORNER_NONE && steps < LONGEST_SEARCH; i = v[i].next, steps++)
    if (v[i].texcoord == texcoord && v[i].normal == normal) return i;
  if (c->vertices.count >= CORNER_NONE) return CORNER_NONE;
  if (!array_push(&c->vertices, (Corner){position, texcoord, normal, *head})) return CORNER_NONE;
  return *head = (uint32_t)(c->vertices.count - 1);
}

#endif
