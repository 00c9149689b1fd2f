// The unit that is compiled once per instruction set: RAYFOLD_LEVEL is ref, v2, v3 or v4. Everything it includes is
// static; the table is all that leaves it.

#include "render/hot.h"

#include "accel/batch.h"
#include "accel/traverse.h"
#include "post/atrous.h"
#include "post/conv.h"
#include "post/fast_rows.h"
#include "render/tile.h"

static void hot_closest_n(const Accel *accel, const PackedRay *rays, Hit *hits, size_t count)
{
  RayCounters counters = {0};
  if (count == 1) {
    const Ray ray = ray_unpack(rays);
    accel_closest(accel, &ray, RAY_ALL, NULL, NULL, &counters, hits);
    return;
  }
  accel_ask(&(Batch){accel, rays, count, RAY_ALL, .counters = &counters, .hits = hits});
}

static void hot_any_n(const Accel *accel, const PackedRay *rays, uint8_t *blocked, size_t count)
{
  RayCounters counters = {0};
  if (count == 1) {
    const Ray ray = ray_unpack(rays);
    *blocked = accel_any(accel, &ray, RAY_ALL, NULL, NULL, &counters);
    return;
  }
  accel_ask(&(Batch){accel, rays, count, RAY_ALL, .counters = &counters, .blocked = blocked});
}

static void hot_piece(const World *world, const Ray *ray, const Way *way, Hit *hit, SpaceExit *end)
{
  RayCounters counters = {0};
  *end = way_piece(world, ray, way, RAY_ALL, 0, &counters, hit);
}

#define JOINED(a, b)      a##b
#define TABLE_OF(level)   JOINED(hot_, level)
#define TEXT_OF(level)    #level
#define LEVEL_NAME(level) TEXT_OF(level)

extern const HotTable TABLE_OF(RAYFOLD_LEVEL);
const HotTable TABLE_OF(RAYFOLD_LEVEL) = {LEVEL_NAME(RAYFOLD_LEVEL), tile_render, sizeof(Whitted), pixels_look_at,
                                           hot_closest_n, hot_any_n, hot_piece,
                                           {conv_rows, atrous_rows, fast_take_rows, fast_extend_rows, fast_prepare_rows,
                                            fast_give_rows}};
