// From a medium's parameters to a density light can be followed through: read from a file, baked from noise, or left as
// a formula; and the bounds over its box. A density is made once and shared with the next worlds.

#include "world/density.h"

#include "base/hash.h"
#include "image/grid.h"
#include "shade/pattern.h"

#include <string.h>
#include <sys/stat.h>

enum { CELL_SIDE = 8, MOST_CELLS = 64, BALL_CELLS = 16 }; // values a cell is wide; cells a side at most

void density_part_release(DensityPart *part)
{
  if (!part || atomic_fetch_sub_explicit(&part->users, 1, memory_order_acq_rel) != 1) return;
  mem_free(part->density.most);
  mem_free(part->density.heat.values);
  switch ((DensityKind)part->density.kind) {
  case DENSITY_GRID: mem_free(part->density.grid.values); break;
  case DENSITY_BALL: break;
  case DENSITY_VOXELS:
    voxels_release(part->density.voxels.cells);
    mem_free(part->density.voxels.tints);
    mem_free(part->density.voxels.glows);
  }
  mem_free(part);
}

// --- bounds -----------------------------------------------------------------------------------------
static bool allocate_cells(Density *d, Err *err)
{
  const size_t count = (size_t)d->cells[0] * d->cells[1] * d->cells[2];
  d->most = mem_zero(count, sizeof *d->most);
  return d->most || err_memory(err, "the bounds of a medium", count * sizeof *d->most);
}

// The largest of the values that places in the cell are mixed from.
static float grid_cell_most(const Density *d, const uint32_t cell[3])
{
  size_t first[3], end[3];
  for (int k = 0; k < 3; k++) {
    const double width = (double)d->grid.size[k] / d->cells[k]; // in voxels
    const double low = cell[k] * width - 1.5, high = (cell[k] + 1) * width + 1.5;
    first[k] = low > 0 ? (size_t)low : 0;
    end[k] = high < d->grid.size[k] ? (size_t)high + 1 : d->grid.size[k];
    if (end[k] > d->grid.size[k]) end[k] = d->grid.size[k];
  }
  float most = 0;
  for (size_t z = first[2]; z < end[2]; z++)
    for (size_t y = first[1]; y < end[1]; y++) {
      const float *row = d->grid.values + (z * d->grid.size[1] + y) * d->grid.size[0];
      for (size_t x = first[0]; x < end[0]; x++) most = fmaxf(most, row[x]);
    }
  return most;
}

// The range of a sine over [a, b].
static void sine_range(double a, double b, double range[2])
{
  const double pi = 3.14159265358979323846;
  range[0] = fmin(sin(a), sin(b));
  range[1] = fmax(sin(a), sin(b));
  if (floor((b - pi / 2) / (2 * pi)) > floor((a - pi / 2) / (2 * pi))) range[1] = 1;
  if (floor((b + pi / 2) / (2 * pi)) > floor((a + pi / 2) / (2 * pi))) range[0] = -1;
}

static float ball_cell_most(const Density *d, const uint32_t cell[3])
{
  double near2 = 0, waves[2] = {1, 1};
  for (int k = 0; k < 3; k++) {
    const double width = ((double)d->hi[k] - (double)d->lo[k]) / d->cells[k], low = (double)d->lo[k] + cell[k] * width,
                 high = low + width, from = (double)d->ball.waves_origin[k];
    double sine[2];
    near2 += low > 0 ? low * low : high < 0 ? high * high : 0;
    sine_range((double)d->ball.waves * (low - from), (double)d->ball.waves * (high - from), sine);
    const double product[4] = {waves[0] * sine[0], waves[0] * sine[1], waves[1] * sine[0], waves[1] * sine[1]};
    waves[0] = fmin(fmin(product[0], product[1]), fmin(product[2], product[3]));
    waves[1] = fmax(fmax(product[0], product[1]), fmax(product[2], product[3]));
  }
  const double inside = fmax(0, 1 - sqrt(near2) / (double)d->ball.radius);
  return (float)(inside * (0.5 + 0.5 * waves[1]));
}

static bool add_bounds(Density *d, Err *err)
{
  for (int k = 0; k < 3; k++) {
    const uint32_t wanted = d->kind == DENSITY_GRID ? (d->grid.size[k] + CELL_SIDE - 1) / CELL_SIDE : BALL_CELLS;
    d->cells[k] = wanted < MOST_CELLS ? wanted : MOST_CELLS;
  }
  if (!allocate_cells(d, err)) return false;
  uint32_t c[3];
  size_t i = 0;
  for (c[2] = 0; c[2] < d->cells[2]; c[2]++)
    for (c[1] = 0; c[1] < d->cells[1]; c[1]++)
      for (c[0] = 0; c[0] < d->cells[0]; c[0]++) {
        const float most = d->kind == DENSITY_GRID ? grid_cell_most(d, c) : ball_cell_most(d, c);
        d->most[i++] = most * (1 + 1e-4f); // rounding may put a place into the next cell, and mixes a little above
      }
  return true;
}

// --- noise into densities -----------------------------------------------------------------------------
// Octaves, each half as large and strong as the one before (fractional Brownian motion).
static float noise_octaves(Vec3 p, int octaves, uint32_t seed)
{
  float sum = 0, strength = 1;
  for (int i = 0; i < octaves; i++) {
    sum += strength * noise_at(p, seed + (uint32_t)i);
    strength /= 2;
    p = 2 * p + v3(0.37f, 0.71f, 0.13f); // so that their lattices do not meet
  }
  return sum;
}

// A divergence-free field: the curl of three noises (Bridson et al., "Curl-noise for procedural fluid flow", 2007).
static Vec3 noise_curl(Vec3 p, uint32_t seed)
{
  const float e = 1e-2f;
  Vec3 slope[3]; // slope[a][b]: of noise a along b
  for (uint32_t a = 0; a < 3; a++)
    for (int b = 0; b < 3; b++) {
      Vec3 step = v3_all(0);
      step[b] = e;
      slope[a][b] = (noise_at(p + step, seed + 17 * a) - noise_at(p - step, seed + 17 * a)) / (2 * e);
    }
  return v3(slope[2][1] - slope[1][2], slope[0][2] - slope[2][0], slope[1][0] - slope[0][1]);
}

// 1 in the middle of the box, 0 on the ellipsoid that fits into it.
static float inside_of(const float size[3], Vec3 p)
{
  return 1 - v3_length(2 * p / v3_load(size));
}

// Lumps are added to the ellipsoid's own fall-off before it is cut, so that they stand out of it.
static float cloud_density(const MediumCloud *c, Vec3 p)
{
  const float inside = inside_of(c->size, p);
  if (inside <= 0) return 0;
  const float lumps = noise_octaves(p / c->lump, c->octaves, (uint32_t)c->seed);
  const float d = inside + c->raggedness * (0.7f * lumps - 0.5f);
  return clamp_f(d / c->softness, 0, 1) * min_f(8 * inside, 1);
}

// Thin sheets, where noise is near 0, drawn out along a flow that neither gathers nor thins.
static float wisps_density(const MediumWisps *w, Vec3 p)
{
  enum { STEPS = 6 };
  const float inside = inside_of(w->size, p);
  if (inside <= 0) return 0;
  Vec3 q = p / w->lump;
  for (int i = 0; i < STEPS; i++) q -= (w->swirl * 0.25f / STEPS) * noise_curl(q, (uint32_t)w->seed);
  const float sheet = max_f(1 - 3 * fabsf(noise_octaves(q, 4, (uint32_t)w->seed + 100)), 0);
  const float lumps = clamp_f(0.5f + 1.5f * noise_at(0.5f * q, (uint32_t)w->seed + 200), 0, 1);
  return sheet * sheet * lumps * min_f(2 * inside, 1);
}

// A drop, pointed above, that whirls tear more the higher it has come. What is whirled came from below, so noise stands
// still in what rises. Returns how far inside of it a place is: 0 at its skin, 1 in its middle.
static float flame_inside(const MediumFlame *f, Vec3 p)
{
  enum { STEPS = 4 };
  const Vec3 half = 0.5f * v3_load(f->size);
  const float up = 0.5f + 0.5f * p[1] / half[1];
  const float edge = v3_max_lane(v3(fabsf(p[0] / half[0]), fabsf(p[1] / half[1]), fabsf(p[2] / half[2])));
  Vec3 q = p, moved = v3(0, f->rise, 0);
  for (int i = 0; i < STEPS; i++)
    q -= (f->swirl * f->lump * 0.25f * up / STEPS) * noise_curl((q - moved) / f->lump, (uint32_t)f->seed);
  const float h = clamp_f(0.5f + 0.5f * q[1] / half[1], 0, 1);
  const float wide = 1.6f * sqrtf(h) * (1 - h) * (1.2f - 0.35f * h) + 1e-3f;
  const float off = sqrtf(sqr_f(q[0] / half[0]) + sqr_f(q[2] / half[2])) / wide;
  return clamp_f(1 - off, 0, 1) * clamp_f(8 * (1 - edge), 0, 1);
}

// Burnt gas fills it; soot is thickest between the middle, where nothing has burnt yet, and the skin.
static float flame_density(const MediumFlame *f, Vec3 p)
{
  const float inside = flame_inside(f, p);
  const float lumps = noise_octaves((p - v3(0, f->rise, 0)) / f->lump, 3, (uint32_t)f->seed + 50);
  return inside * (1.5f - inside) * clamp_f(0.75f + 0.6f * lumps, 0, 1.5f);
}

static float flame_heat(const MediumFlame *f, Vec3 p)
{
  const float up = 0.5f + p[1] / f->size[1];
  return (0.62f + 0.38f * sqrtf(flame_inside(f, p))) * (1 - 0.22f * clamp_f(up, 0, 1));
}

// --- densities --------------------------------------------------------------------------------------
typedef struct Baking {
  const Medium *medium;
  Density *density;
} Baking;

static Vec3 voxel_middle(const Density *d, size_t x, size_t y, size_t z)
{
  const Vec3 size = d->hi - d->lo;
  return d->lo + v3(size[0] * (((float)x + 0.5f) / (float)d->grid.size[0]), size[1] * (((float)y + 0.5f) / (float)d->grid.size[1]),
                    size[2] * (((float)z + 0.5f) / (float)d->grid.size[2]));
}

static void bake_slice(void *user, size_t z, int worker)
{
  const Baking *b = user;
  Density *d = b->density;
  (void)worker;
  for (size_t y = 0; y < d->grid.size[1]; y++)
    for (size_t x = 0; x < d->grid.size[0]; x++) {
      const Vec3 p = voxel_middle(d, x, y, z);
      const size_t i = (z * d->grid.size[1] + y) * d->grid.size[0] + x;
      if (b->medium->kind == MEDIUM_CLOUD)
        d->grid.values[i] = cloud_density(&b->medium->cloud, p);
      else if (b->medium->kind == MEDIUM_WISPS)
        d->grid.values[i] = wisps_density(&b->medium->wisps, p);
      else
        d->grid.values[i] = flame_density(&b->medium->flame, p);
      if (d->heat.values) d->heat.values[i] = flame_heat(&b->medium->flame, p);
    }
}

// resolution: values along the longest side.
static bool bake(const Medium *m, const float size[3], int32_t resolution, Density *out, Jobs *jobs, const Cancel *cancel,
                 Err *err)
{
  Grid g = {0};
  const float longest = fmaxf(fmaxf(size[0], size[1]), size[2]);
  out->kind = DENSITY_GRID;
  out->hi = 0.5f * v3_load(size);
  out->lo = -out->hi;
  for (int k = 0; k < 3; k++) {
    g.size[k] = (uint32_t)fmaxf(roundf((float)resolution * size[k] / longest), 1);
    out->grid.size[k] = g.size[k];
  }
  if (!grid_allocate(&g, m->name, err)) return false;
  out->grid.values = g.values;
  out->grid.lo = out->lo;
  out->grid.hi = out->hi;
  if (m->kind == MEDIUM_FLAME) {
    if (!grid_allocate(&g, m->name, err)) return false;
    out->heat = out->grid;
    out->heat.values = g.values;
  }
  Baking b = {m, out};
  return jobs_run(jobs, out->grid.size[2], bake_slice, &b, cancel) ||
         err_set(err, ERR_CANCELLED, "preparing was cancelled");
}

static bool read_values(const Scene *s, const char *name, const char *file, const LoadOptions *options,
                        DensityValues *out, Err *err)
{
  Text path = {0};
  Grid g = {0};
  const bool ok = scene_file_path(s, file, options, &path, err) && grid_read(&g, text_get(&path), err);
  text_finish(&path);
  if (!ok) return err_where(err, "medium \"%s\"", name);
  *out = (DensityValues){v3_load(g.lo), v3_load(g.hi), {g.size[0], g.size[1], g.size[2]}, g.values};
  return true;
}

static bool has_heat(const Medium *m)
{
  return m->grid.heat && *m->grid.heat;
}

static bool read_files(const Scene *s, const Medium *m, const LoadOptions *options, Density *out, Err *err)
{
  out->kind = DENSITY_GRID;
  if (!read_values(s, m->name, m->grid.file, options, &out->grid, err)) return false;
  out->lo = out->grid.lo;
  out->hi = out->grid.hi;
  return !has_heat(m) || read_values(s, m->name, m->grid.heat, options, &out->heat, err);
}

static bool make(Prepare *p, const Scene *s, const Medium *m, Density *out)
{
  switch ((MediumKind)m->kind) {
  case MEDIUM_HOMOGENEOUS: return true; // never asked for
  case MEDIUM_GRID: return read_files(s, m, p->options, out, p->err);
  case MEDIUM_BALL:
    out->kind = DENSITY_BALL;
    out->hi = v3_all(m->ball.radius);
    out->lo = -out->hi;
    out->ball.radius = m->ball.radius;
    out->ball.waves = m->ball.waves;
    out->ball.waves_origin = v3_load(m->ball.waves_origin);
    return true;
  case MEDIUM_CLOUD: return bake(m, m->cloud.size, m->cloud.resolution, out, p->jobs, p->cancel, p->err);
  case MEDIUM_WISPS: return bake(m, m->wisps.size, m->wisps.resolution, out, p->jobs, p->cancel, p->err);
  case MEDIUM_FLAME: return bake(m, m->flame.size, m->flame.resolution, out, p->jobs, p->cancel, p->err);
  }
  unreachable();
}

// Of a file: its name, size and time.
static bool add_file(const Prepare *p, const Scene *s, const Medium *m, const char *file, uint64_t *key)
{
  Text path = {0};
  struct stat st = {0};
  if (!scene_file_path(s, file, p->options, &path, p->err)) {
    text_finish(&path);
    return err_where(p->err, "medium \"%s\"", m->name);
  }
  (void)stat(text_get(&path), &st); // a missing file is reported when it is opened
  const uint64_t state[4] = {(uint64_t)st.st_size, (uint64_t)st.st_mtim.tv_sec, (uint64_t)st.st_mtim.tv_nsec,
                             (uint64_t)st.st_ino};
  *key = hash_bytes(hash_bytes(*key, text_get(&path), path.length), state, sizeof state);
  text_finish(&path);
  return true;
}

// Of what a density is made of: its parameters, or its files.
static bool density_key(const Prepare *p, const Scene *s, const Medium *m, uint64_t *key)
{
  const uint64_t kind = (uint64_t)m->kind + 1;
  switch ((MediumKind)m->kind) {
  case MEDIUM_HOMOGENEOUS: *key = 0; return true;
  case MEDIUM_BALL: *key = hash_bytes(kind, &m->ball, sizeof m->ball); return true;
  case MEDIUM_CLOUD: *key = hash_bytes(kind, &m->cloud, sizeof m->cloud); return true;
  case MEDIUM_WISPS: *key = hash_bytes(kind, &m->wisps, sizeof m->wisps); return true;
  case MEDIUM_FLAME: *key = hash_bytes(kind, &m->flame, sizeof m->flame); return true;
  case MEDIUM_GRID:
    if (!m->grid.file)
      return err_set(p->err, ERR_BAD_SCENE, "medium \"%s\" names no file; give it one, \"file\": \"smoke.grid\"", m->name);
    *key = kind;
    return add_file(p, s, m, m->grid.file, key) && (!has_heat(m) || add_file(p, s, m, m->grid.heat, key));
  }
  unreachable();
}

static DensityPart *find_part(const WorldParts *p, uint64_t key)
{
  for (size_t i = 0; p && i < p->densities.count; i++)
    if (p->densities.items[i]->key == key) return p->densities.items[i];
  return NULL;
}

DensityPart *prepare_density_part(Prepare *p, uint64_t key, bool *is_made)
{
  DensityPart *part = find_part(p->parts, key);
  *is_made = true;
  if (part) return part;
  if (!array_reserve(&p->parts->densities, p->parts->densities.count + 1)) return prepare_failed_memory(p), NULL;
  part = find_part(p->previous, key);
  if (part) {
    atomic_fetch_add_explicit(&part->users, 1, memory_order_relaxed);
    array_push(&p->parts->densities, part);
    return part;
  }
  part = mem_zero(1, sizeof *part);
  if (!part) return prepare_failed_memory(p), NULL;
  *is_made = false;
  atomic_init(&part->users, 1);
  part->key = key;
  array_push(&p->parts->densities, part);
  return part;
}

const Density *prepare_density(Prepare *p, const Scene *s, const Medium *m)
{
  uint64_t key = 0;
  bool is_made;
  DensityPart *part = density_key(p, s, m, &key) ? prepare_density_part(p, key, &is_made) : NULL;
  if (!part) return NULL;
  return is_made || (make(p, s, m, &part->density) && add_bounds(&part->density, p->err)) ? &part->density : NULL;
}
