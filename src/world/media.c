// From a scene's media to the form light is followed through, and the boundaries of the places they fill. Boundaries have
// a tree of their own: rays find surfaces as if there were no media, and then, in worlds that have any, where they
// go in and out.

#include "world/density.h"

// Where nothing takes light but something shines, it must be looked for all the same: about eight times on the way
// through a density, once a metre where it is everywhere.
static float least_chance(const Volume *v)
{
  if (v3_is_zero(v->emission) && !v->black_body) return 0;
  if (!v->density) return 1;
  float most = 0;
  const Density *d = v->density;
  for (size_t i = 0; i < (size_t)d->cells[0] * d->cells[1] * d->cells[2]; i++) most = fmaxf(most, d->most[i]);
  return most > 0 ? 8 / (most * v3_length(d->hi - d->lo)) : 0;
}

// By Kirchhoff's law what absorbs shines as a black body does.
static bool add_black_body(Prepare *p, const Medium *m, Volume *out)
{
  const MediumCommon *c = &m->common;
  const Vec3 hot = c->density * c->glow * v3_load(c->absorption);
  if (!(c->temperature > 0) || v3_is_zero(hot)) return true;
  BlackBody *b = p->world->black_body;
  if (!b) {
    b = p->world->black_body = arena_alloc(&p->world->arena, 1, sizeof *b);
    if (!b) return prepare_failed_memory(p);
    black_body_make(b);
  }
  if (!out->density || !out->density->heat.values) {
    out->emission += hot * black_body_at(b, c->temperature);
    return true;
  }
  out->black_body = b;
  out->hot = hot;
  out->kelvin = c->temperature;
  out->coldest = m->kind == MEDIUM_GRID ? m->grid.heat_offset : 0;
  return v3_is_finite(hot) || err_set(p->err, ERR_BAD_SCENE, "medium \"%s\": its glow is too large for a number", m->name);
}

static bool from_medium(Prepare *p, const Scene *s, const Medium *m, Volume *out)
{
  const MediumCommon *c = &m->common;
  out->scattering = c->density * v3_load(c->scattering);
  out->extinction = out->scattering + c->density * v3_load(c->absorption);
  out->emission = c->density * v3_load(c->emission);
  // A lobe of g = 1 would be no scattering at all, and one near it is lost in the rounding of cosines.
  out->phase = (Phase){fmaxf(fminf(c->anisotropy, 0.99f), -0.99f), fmaxf(fminf(c->second_anisotropy, 0.99f), -0.99f),
                       c->second_part};
  out->density = m->kind == MEDIUM_HOMOGENEOUS ? NULL : prepare_density(p, s, m);
  if (m->kind != MEDIUM_HOMOGENEOUS && !out->density) return false;
  if (!add_black_body(p, m, out)) return false;
  out->most = fmaxf(v3_max_lane(out->extinction), least_chance(out));
  return (v3_is_finite(out->extinction) && v3_is_finite(out->emission)) ||
         err_set(p->err, ERR_BAD_SCENE, "medium \"%s\": density times its coefficients is too large for a number", m->name);
}

bool prepare_volumes(Prepare *p, Source *source)
{
  const Scene *s = source->scene;
  source->volume_base = (uint32_t)p->volumes.count;
  for (size_t i = 0; i < s->media.count; i++) {
    Volume v = {0};
    if (!from_medium(p, s, &s->media.items[i], &v)) return false;
    if (!array_push(&p->volumes, v)) return prepare_failed_memory(p);
  }
  return true;
}

int32_t prepare_voxel_volume(Prepare *p, const char *name, int32_t volume_i, Voxels *v)
{
  Volume out = p->volumes.items[volume_i];
  if (out.density)
    return err_set(p->err, ERR_BAD_SCENE, "object \"%s\": voxels say themselves where their medium is; give them a homogeneous one",
                   name ? name : ""), -1;
  out.density = prepare_voxel_density(p, v);
  if (!out.density) return -1;
  out.most = fmaxf(v3_max_lane(out.extinction), least_chance(&out));
  return array_push(&p->volumes, out) ? (int32_t)p->volumes.count - 1 : (prepare_failed_memory(p), -1);
}

bool prepare_add_medium(Prepare *p, const Instance *boundary, const WorldMedium *medium, int32_t mesh_part)
{
  Instance i = *boundary;
  i.object_from_world = frame_inverse(&i.world_from_object);
  i.mask = RAY_ALL;
  i.has_filter = true; // walks go on from one boundary to the next by it
  return (array_push(&p->boundaries, i) && array_push(&p->media, *medium) && array_push(&p->boundary_parts, mesh_part) &&
          array_push(&p->boundary_cells, p->cell)) ||
         prepare_failed_memory(p);
}

// What it emits must be lost somewhere, or there would be no end to it.
static bool add_atmosphere(Prepare *p, int32_t i, uint32_t cell)
{
  if (i < 0) return true;
  const Volume *v = &p->volumes.items[p->sources.items[0].volume_base + (uint32_t)i];
  if (v->density)
    return err_set(p->err, ERR_BAD_SCENE, "the atmosphere \"%s\" is not homogeneous; put it into an object, such as a large box",
                   p->scene->media.items[i].name);
  for (int k = 0; k < 3; k++)
    if (v->emission[k] > 0 && !(v->extinction[k] > 0))
      return err_set(p->err, ERR_BAD_SCENE, "the atmosphere \"%s\" emits light and nothing absorbs or scatters it, so it would "
                     "be endlessly bright; give it absorption", p->scene->media.items[i].name);
  const WorldMedium m = {.volume = (uint32_t)(v - p->volumes.items), .object_i = NO_HIT};
  if (!array_push(&p->media, m)) return prepare_failed_memory(p);
  p->atmospheres[cell] = (uint32_t)p->media.count;
  return true;
}

static bool add_atmospheres(Prepare *p)
{
  if (!add_atmosphere(p, p->scene->render.atmosphere, 0)) return false;
  for (size_t i = 0; i < p->scene->cells.count; i++)
    if (!add_atmosphere(p, p->scene->cells.items[i].common.atmosphere, (uint32_t)i + 1)) return false;
  return true;
}

static void add_bounds(World *w, const Accel *a)
{
  float lo[3], hi[3];
  accel_bounds(a, lo, hi);
  for (int k = 0; k < 3; k++) {
    w->lo[k] = fminf(w->lo[k], lo[k]);
    w->hi[k] = fmaxf(w->hi[k], hi[k]);
  }
}

static bool are_few_boxes(const Prepare *p)
{
  enum { FEW = 4 };
  bool are = p->boundaries.count <= FEW && p->world->cell_count == 1;
  for (size_t i = 0; are && i < p->boundaries.count; i++) are = p->media.items[i].is_box;
  return are;
}

static void note_blind_integrators(Prepare *p)
{
  const int32_t integrator = p->scene->render.integrator;
  if (!p->boundaries.count && p->scene->render.atmosphere < 0) return;
  if (integrator == INTEGRATOR_CLASSIC || integrator == INTEGRATOR_WHITTED)
    note_once(&p->world->notes, "the scene has media, which the integrator \"%s\" does not see; take \"path\"",
              integrator == INTEGRATOR_CLASSIC ? "classic" : "whitted");
}

bool prepare_media(Prepare *p)
{
  World *w = p->world;
  note_blind_integrators(p);
  for (size_t i = 0; i < p->boundaries.count; i++) {
    const int32_t part = p->boundary_parts.items[i];
    if (part >= 0) p->boundaries.items[i].mesh = p->parts->meshes.items[part].tree;
  }
  if (p->boundaries.count) {
    Accel **trees = arena_alloc(&p->scratch, w->cell_count, sizeof *trees);
    if (!trees) return prepare_failed_memory(p);
    if (!accel_build_cells(p->boundaries.items, p->boundary_cells.items, p->boundaries.count, trees, w->cell_count, p->jobs,
                           p->cancel, p->err))
      return false;
    w->media_accel = trees[0];
    for (size_t c = 0; c < w->cell_count; c++) {
      p->cells[c].media_accel = trees[c];
      w->geometry_bytes += accel_bytes(trees[c]);
      add_bounds(w, trees[c]);
    }
    w->media_are_boxes = are_few_boxes(p);
  }
  return add_atmospheres(p);
}
