// See lamps.h.

#include "scene/scene.h"
#include "world/lamps.h"

// --- of the cell itself -----------------------------------------------------------------------------
static void renumber_table(int32_t *table, size_t count, const int32_t *number)
{
  for (size_t i = 0; i < count; i++)
    if (table[i] >= 0) table[i] = number[table[i]];
}

static void renumber(Prepare *p, const int32_t *number)
{
  for (size_t i = 0; i < p->shading.count; i++) {
    const WorldInstance *w = &p->shading.items[i];
    const int32_t part = p->mesh_parts.items[i];
    const size_t count = part >= 0 ? p->parts->meshes.items[part].data->triangle_count : 1;
    if (w->emitters) renumber_table((int32_t *)(size_t)w->emitters, count, number);
    const VoxelLights *l = w->voxel_lights;
    for (size_t k = 0; l && k <= l->mask; k++)
      if (l->keys[k]) renumber_table((int32_t *)(size_t)l->emitters + k, 1, number);
  }
}

bool lamps_by_cell(Prepare *p, LampList *lists)
{
  int32_t *number = arena_alloc(&p->scratch, p->emitters.count + 1, sizeof *number);
  if (!number) return prepare_failed_memory(p);
  for (size_t i = 0; i < p->emitters.count; i++) {
    LampList *list = &lists[p->emitter_cells.items[i]];
    number[i] = (int32_t)list->emitters.count;
    if (!array_push(&list->emitters, p->emitters.items[i])) return prepare_failed_memory(p);
  }
  for (size_t i = 0; i < p->suns.count; i++)
    if (!array_push(&lists[p->sun_cells.items[i]].suns, p->suns.items[i])) return prepare_failed_memory(p);
  if (p->world->cell_count > 1) renumber(p, number);
  return true;
}

// --- through gates ------------------------------------------------------------------------------------
// Breadth first over the gates that a straight line may go through one after the other, so that what is left out when
// there is no more room is what lies behind most gates. A lamp beyond is put where its light seems to come from.
enum { MOST_IMAGES = 64, MOST_SUN_IMAGES = 8, MOST_IMAGE_EMITTERS = 1 << 16 };

typedef struct Look { // through the gates that the word names
  LightImage image;
  uint32_t depth, from; // from: the last gate's partner, out of which one looks; NO_GATE: none
  int out;              // the side of it
  bool is_within;
} Look;

typedef struct Looker {
  Prepare *p;
  LampList *list;
  uint32_t cell;
  size_t emitter_limit, sun_images, count, own_count;
  Look looks[1 + MOST_IMAGES * 4];
  LightImage images[MOST_IMAGES];
} Looker;

static int gate_corners(const SpaceGate *g, Vec3 out[MOST_POINTS])
{
  const Frame f = frame_inverse(&g->own_from_cell);
  if (g->aperture == APERTURE_POLYGON) {
    for (int32_t i = 0; i < g->corner_count; i++) out[i] = frame_point(&f, v3(g->xy[2 * i], g->xy[2 * i + 1], 0));
    return g->corner_count;
  }
  const Vec3 size = g->aperture == APERTURE_SPHERE ? v3_all(g->size[0]) : v3_load(g->size);
  for (int i = 0; i < 8; i++) out[i] = frame_point(&f, v3(i & 1 ? size[0] : -size[0], i & 2 ? size[1] : -size[1], i & 4 ? size[2] : -size[2]));
  return 8; // a rectangle's are there twice
}

// Is some corner of `what` on that side of the flat gate's plane?
static bool reaches(const SpaceGate *plane, bool in_front, const SpaceGate *what)
{
  Vec3 corner[MOST_POINTS];
  if (gate_is_closed(plane)) return true;
  const int count = gate_corners(what, corner);
  for (int i = 0; i < count; i++) {
    const float off = v3_dot(plane->n, corner[i]) - plane->c;
    if (in_front ? off > 0 : off < 0) return true;
  }
  return false;
}

static bool may_go_through(const Looker *l, const Look *at, uint32_t gate, int side)
{
  const SpaceGate *g = &l->p->world->space.gates[gate];
  if (g->side[side].cell == NO_CELL || g->side[side].curve) return false; // an image may be beyond the chart's end
  if (at->from == NO_GATE) return true;
  if (at->from == gate) return at->is_within && side == GATE_BACK;
  const SpaceGate *from = &l->p->world->space.gates[at->from];
  return reaches(from, at->out == GATE_FRONT, g) && reaches(g, side == GATE_FRONT, from);
}

static Look look_through(const Looker *l, const Look *at, uint32_t gate, int side)
{
  const GateSide *s = &l->p->world->space.gates[gate].side[side];
  Look next = {.image = {.word = at->image.word | (uint64_t)(1 + 2 * gate + (uint32_t)side) << 16 * at->depth,
                         .cell = s->cell, .to_there = frame_product(&s->map, &at->image.to_there), .first_sun = NO_IMAGE},
               .depth = at->depth + 1, .from = s->gate, .is_within = s->is_into};
  if (s->gate == NO_GATE) return next;
  // One goes on along the ray: out of the front if the entered side's normal, mapped, goes with the partner's.
  const SpaceGate *g = &l->p->world->space.gates[gate], *partner = &l->p->world->space.gates[s->gate];
  const Vec3 onward = frame_vector(&s->map, side == GATE_FRONT ? -g->n : g->n);
  next.out = v3_dot(onward, partner->n) > 0 ? GATE_FRONT : GATE_BACK;
  return next;
}

// The lamp as it is seen; false: its image cannot be aimed at.
static bool image_of(const Emitter *e, const Look *look, uint32_t image, Emitter *out)
{
  const Frame back = frame_inverse(&look->image.to_there);
  const float scale = v3_length(back.x);
  const bool is_mirrored = frame_determinant(&back) < 0, is_point = e->kind == EMITTER_POINT || e->kind == EMITTER_SPOT;
  *out = *e;
  out->image = image;
  out->p = frame_point(&back, e->p);
  out->x = frame_vector(&back, e->x);
  out->y = frame_vector(&back, e->y);
  out->radius = e->radius * scale;
  out->area = e->area * scale * scale;
  if (is_point) { // as the limit of a small ball of one radiance
    out->color = e->color * (scale * scale);
    out->x = v3_normalize(out->x);
    out->y = v3_normalize(out->y);
    out->is_mirrored = e->is_mirrored != is_mirrored;
    return true;
  }
  if (!is_mirrored || e->kind == EMITTER_SPHERE) return true;
  if (e->kind != EMITTER_TRIANGLE && e->map >= 0) return false; // its picture would be turned
  const Vec3 x = out->x;
  out->x = out->y;
  out->y = x;
  for (int c = 0; c < 2; c++) {
    out->uv[1][c] = e->uv[2][c];
    out->uv[2][c] = e->uv[1][c];
  }
  return true;
}

// Lamps behind the gate one looks out of are not seen.
static bool is_ahead(const Looker *l, const Look *look, const Emitter *e)
{
  if (look->from == NO_GATE) return true;
  const SpaceGate *from = &l->p->world->space.gates[look->from];
  if (gate_is_closed(from)) return true;
  const Vec3 corner[5] = {e->p, e->p + e->x, e->p + e->y, e->p + e->x + e->y, e->p - e->x - e->y};
  const bool is_area = e->kind == EMITTER_TRIANGLE || e->kind == EMITTER_QUAD || e->kind == EMITTER_DISK;
  for (int i = 0; i < (is_area ? 5 : 1); i++) {
    const float off = v3_dot(from->n, corner[i]) - from->c;
    if ((look->out == GATE_FRONT ? off : -off) > -e->radius) return true;
  }
  return false;
}

static bool add_emitter_images(Looker *l, Look *look, const LampList *there, uint32_t image)
{
  const size_t count = there->emitters.count < l->p->cells[look->image.cell].own_emitters ? there->emitters.count
                                                                                        : l->p->cells[look->image.cell].own_emitters;
  int32_t *index = arena_alloc(&l->p->world->arena, count + 1, sizeof *index);
  if (!index) return prepare_failed_memory(l->p);
  for (size_t i = 0; i < count; i++) {
    Emitter e;
    const Emitter own = there->emitters.items[i];
    index[i] = -1;
    if (l->list->emitters.count >= l->emitter_limit || !is_ahead(l, look, &own) || !image_of(&own, look, image, &e)) continue;
    index[i] = (int32_t)l->list->emitters.count;
    if (!array_push(&l->list->emitters, e)) return prepare_failed_memory(l->p);
  }
  look->image.emitters = index;
  return true;
}

static bool add_sun_images(Looker *l, Look *look, const LampList *there, uint32_t image)
{
  const size_t count = l->p->cells[look->image.cell].own_suns;
  if (!count || l->sun_images + count > MOST_SUN_IMAGES) return true;
  const Frame back = frame_inverse(&look->image.to_there);
  look->image.first_sun = (uint32_t)l->list->suns.count;
  l->sun_images += count;
  for (size_t i = 0; i < count; i++) {
    Sun sun = there->suns.items[i];
    sun.direction = v3_normalize(frame_vector(&back, sun.direction));
    sun.image = image;
    if (!array_push(&l->list->suns, sun)) return prepare_failed_memory(l->p);
  }
  return true;
}

static bool look_on(Looker *l, LampList *lists, const Look *at)
{
  const Space *space = &l->p->world->space;
  for (uint32_t i = 0; i < 2 * space->gate_count; i++) {
    if (space->gates[i / 2].cell != at->image.cell || !may_go_through(l, at, i / 2, (int)(i & 1))) continue;
    if (l->count == sizeof l->looks / sizeof *l->looks || l->own_count == MOST_IMAGES) return true;
    Look next = look_through(l, at, i / 2, (int)(i & 1));
    const WorldCell *there = &l->p->cells[next.image.cell];
    if (there->own_emitters || there->own_suns) {
      const uint32_t image = (uint32_t)l->own_count + 1;
      if (!add_emitter_images(l, &next, &lists[next.image.cell], image) || !add_sun_images(l, &next, &lists[next.image.cell], image))
        return false;
      l->images[l->own_count++] = next.image;
    }
    l->looks[l->count++] = next;
  }
  return true;
}

static bool look_from(Looker *l, LampList *lists)
{
  const uint32_t most = (uint32_t)l->p->scene->render.light_gates;
  l->looks[0] = (Look){.image = {.cell = l->cell, .to_there = frame_identity(), .first_sun = NO_IMAGE}, .from = NO_GATE};
  l->count = 1;
  for (size_t i = 0; i < l->count; i++) {
    const Look at = l->looks[i];
    if (at.depth < most && !look_on(l, lists, &at)) return false;
  }
  LightImage *images = arena_alloc(&l->p->world->arena, l->own_count + 1, sizeof *images);
  if (!images) return prepare_failed_memory(l->p);
  for (size_t i = 0; i < l->own_count; i++) images[i] = l->images[i];
  l->p->cells[l->cell].images = images;
  l->p->cells[l->cell].image_count = (uint32_t)l->own_count;
  return true;
}

bool lamps_through_gates(Prepare *p, LampList *lists)
{
  for (size_t c = 0; c < p->world->cell_count; c++) {
    p->cells[c].own_emitters = lists[c].emitters.count;
    p->cells[c].own_suns = lists[c].suns.count;
  }
  if (!p->world->space.gate_count || !p->scene->render.light_gates) return true;
  Looker *l = arena_alloc(&p->scratch, 1, sizeof *l);
  if (!l) return prepare_failed_memory(p);
  for (size_t c = 0; c < p->world->cell_count; c++) {
    l->p = p;
    l->list = &lists[c];
    l->cell = (uint32_t)c;
    l->emitter_limit = lists[c].emitters.count + MOST_IMAGE_EMITTERS;
    l->sun_images = l->count = l->own_count = 0;
    if (!look_from(l, lists)) return false;
  }
  return true;
}
