// Whitted's rows: rays and places of a packet, a lane each, and the few words all of whitted.h is said in. A packet is up
// to 64 rays that go at once; a number of each is a row, and a group is as many lanes as a register holds. Sets of
// lanes are 64 bits.
//
//   list  rows of all rays still to go, the newest last      go  rows of the 64 that go      at  rows of where they end

#ifndef RAYFOLD_RENDER_WHITTED_ROWS_H
#define RAYFOLD_RENDER_WHITTED_ROWS_H

#include "accel/lanes.h"
#include "render/wave.h"

enum {
  WHITTED_SIZE = LANES, // rays that go at once
  MOST_LEVELS = 24,     // max_depth counts up to here
  WHITTED_LIST = WHITTED_SIZE * (MOST_LEVELS + 2),
  MOST_LIGHTS = 32,     // one bit each in a signature
  MOST_PANES = 32,      // transparent surfaces a shadow ray may pass
  ROW_SLACK = 16,       // room behind rows: lanes squeezed together are written in whole registers
  WHITTED_ROW = WHITTED_SIZE + ROW_SLACK,
  LIST_ROW = WHITTED_LIST + ROW_SLACK,
};
_Static_assert((int)WHITTED_SIZE == (int)WAVE_SIZE, "a block's pixels are one packet");

// Rows of rays, three for each vector: what they may still bring to their pixels; what is absorbed a metre; their cones.
enum { GO_O = 0, GO_D = 3, GO_WEIGHT = 6, GO_FADE = 9, GO_WIDTH = 12, GO_SPREAD, GO_ROWS };
// And of integers: the place in the pixel's tree of rays, as a hash of mirrors and refractions so far; the pixel, and from
// these bits on the level and whether it was refracted all the way; the cell it begins in.
enum { GO_WAY, GO_INFO, GO_CELL, GO_INT_ROWS };
enum { INFO_LEVEL = 8, INFO_REFRACTED = 16 };

// Rows of places: P, the normal on the eye's side and the outward one; what the surface is; how much light it sends so
// far; of the light that is asked for, its direction, distance and how much of it arrives.
enum {
  AT_P = 0, AT_N = 3, AT_NG = 6, AT_DIFFUSE = 9, AT_SPECULAR = 12, AT_F0 = 15, AT_MIRROR = 18, AT_PASSED = 21,
  AT_FADE = 24, AT_LIGHT = 27, AT_WL = 30, AT_ARRIVING = 33, AT_DISTANCE = 36, AT_EXPONENT, AT_FACETS, AT_HEIGHT, AT_IOR,
  AT_SMOOTH, AT_ERROR, AT_WIDTH, AT_ROWS
};

// The model a surface is lit by.
typedef enum WhittedModel { WHITTED_OWN, WHITTED_LAMBERT, WHITTED_PHONG, WHITTED_COOK_TORRANCE, WHITTED_MODELS } WhittedModel;

// A surface's numbers, at one place or at all places of a material without textures.
typedef struct WhittedSkin {
  const SurfaceMaterial *m;
  Vec3 diffuse, specular, f0; // of the classic models
  Vec3 mirror, passed;        // weights of the rays sent on
  Vec3 glow;                  // what it sends without lights
  float exponent, facets;     // of phong; of cook_torrance the m
  const TextureMap *checker;  // multiplies diffuse and glow; NULL: nothing does
  bool is_plain;              // lanes can do it
} WhittedSkin;

typedef struct Whitted {
  const RenderPass *pass;
  RayCounters *counters;
  const LaneSet *lanes; // NULL: rays ask the trees
  WhittedSkin skins[LANE_SHAPES];
  uint32_t walls, panes; // of the set's shapes that throw shadows, those that let no light through and the others
  bool has_lane_shadows; // lanes can do both

  size_t count; // pixels
  uint32_t x[WHITTED_SIZE], y[WHITTED_SIZE], sample;
  FilmSample seen[WHITTED_SIZE];
  uint32_t signature[WHITTED_SIZE];
  double sums[3][WHITTED_SIZE]; // multiples of 2^-28, as the film's
  bool has_signatures;

  size_t height; // of the list
  float list[GO_ROWS][LIST_ROW];
  uint32_t list_int[GO_INT_ROWS][LIST_ROW];

  size_t going;
  float go[GO_ROWS][WHITTED_ROW];
  uint32_t go_int[GO_INT_ROWS][WHITTED_ROW];

  uint64_t met, lives; // who hit something; who takes light and sends rays on
  float t[WHITTED_ROW];
  uint32_t shape[WHITTED_ROW], part[WHITTED_ROW]; // of the set's
  Hit hits[WHITTED_SIZE];                         // of the trees
  float at[AT_ROWS][WHITTED_ROW];
  uint32_t object[WHITTED_ROW], lit[WHITTED_ROW], pattern[WHITTED_ROW]; // pattern: a hash of the tile of a checker
  uint64_t is_back, is_thin, is_pbr, is_glass, has_own_weights, model[WHITTED_MODELS];
  // Of places that lanes cannot do.
  SurfacePoint surface[WHITTED_SIZE];
  const SurfaceMaterial *material[WHITTED_SIZE];
  BatchHabit habits[4];
  // In worlds with gates.
  Way ways[WHITTED_SIZE];           // of the rays that go
  float last_gate[WHITTED_SIZE];    // along them, 0: none
  uint64_t plans[WHITTED_SIZE];     // the gates that the light is aimed through
  PackedRay eye_rays[WHITTED_SIZE]; // of the pixels
  bool has_curved; // cells; there AT_P, AT_NG and rays that go are of the chart, what is shaded with is local (local.h)
} Whitted;

static inline Wide3 whitted_go3(const Whitted *t, int row, int lane) { return w3_load(&t->go[row][lane], WHITTED_ROW); }
static inline Wide3 whitted_at3(const Whitted *t, int row, int lane) { return w3_load(&t->at[row][lane], WHITTED_ROW); }
static inline void whitted_put3(Whitted *t, int row, int lane, unsigned bits, Wide3 x)
{
  w3_put(&t->at[row][lane], WHITTED_ROW, bits, x);
}
static inline Vec3 whitted_row3(const float (*rows)[WHITTED_ROW], size_t i)
{
  return v3(rows[0][i], rows[1][i], rows[2][i]);
}
static inline void whitted_set3(float (*rows)[WHITTED_ROW], size_t i, Vec3 v)
{
  for (int k = 0; k < 3; k++) rows[k][i] = v[k];
}
static inline Ray whitted_ray(const Whitted *t, size_t i)
{
  return (Ray){whitted_row3(t->go + GO_O, i), whitted_row3(t->go + GO_D, i), 0, INFINITY};
}
static inline uint64_t whitted_all(const Whitted *t) { return t->going == 64 ? UINT64_MAX : (1ull << t->going) - 1; }
static inline void whitted_mark(uint64_t *set, int lane, unsigned bits) { *set |= (uint64_t)bits << lane; }
static inline uint32_t whitted_level(const Whitted *t, size_t i) { return t->go_int[GO_INFO][i] >> INFO_LEVEL & 0xff; }
static inline uint32_t whitted_pixel(const Whitted *t, size_t i) { return t->go_int[GO_INFO][i] & 0xff; }

static inline float whitted_kappa(const Whitted *t, size_t i)
{
  return t->has_curved ? world_curvature(t->pass->world, t->go_int[GO_CELL][i]) : 0;
}

static inline Sampler whitted_sampler(const Whitted *t, size_t i)
{
  const uint32_t pixel = whitted_pixel(t, i);
  return sampler_begin(t->x[pixel], t->y[pixel], t->sample, t->pass->seed);
}

// Of a ray, for trace_counts(), which asks only where there are surfaces that may not count.
static inline uint32_t whitted_seed(const Whitted *t, size_t i, uint32_t which)
{
  if (!t->pass->world->has_filters) return 0;
  const Sampler s = whitted_sampler(t, i);
  return hash_combine(hash_combine(hash_combine(s.pixel_seed, s.sample), t->go_int[GO_WAY][i]), which);
}

// Who lives and is lit by a model: bits of the group that begins at a lane.
static inline unsigned whitted_bits(uint64_t set, int lane) { return (unsigned)(set >> lane) & WIDEST_BITS; }

// Rays ask the trees here, or go through gates (ways.h).
static inline void whitted_ask(Whitted *t, uint32_t cell, const PackedRay *rays, size_t count, RayMask mask,
                               const TraceQuery *queries, int habit, Hit *hits, uint8_t *blocked)
{
  accel_ask(&(Batch){.accel = t->pass->world->cells[cell].accel, .rays = rays, .count = count, .mask = mask, .filter = trace_counts,
                     .user = queries, .user_stride = sizeof *queries, .counters = t->counters,
                     .habit = &t->habits[habit], .hits = hits, .blocked = blocked});
}

#endif
