// From an object of kind field and the objects that are its parts to one distance field (geom/sdf.h): the tree of parts as
// a tape, their maps composed so that each primitive goes into its own space in one step, their materials as slots. Boxes
// are those of {value <= grow}, asked of the parts with what rounding, melting and noise above them may add: values are
// bounds of distances, so a box may not simply be widened.

#include "world/prepare.h"

#include "base/hash.h"
#include "geom/sdf_cells.h"

#include <string.h>

typedef struct Builder {
  Prepare *p;
  const CsgPlace *place;
  SdfBody *body;
  Arena *arena;
  uint32_t *materials; // slot -> the world's
  bool has_fractal;
} Builder;

// How a value joins what its group had before.
typedef struct Joining {
  SdfOperation operation;
  SdfMix mix;
  float smooth; // in units of values
  bool is_first;
} Joining;

// Where a part is: its space within the innermost warped one, what its values are scaled by, and who wears it.
typedef struct Spot {
  Frame frame;
  double scale;
  uint32_t material;
  double grow; // the box wanted is that of {value <= grow}
  int depth;
} Spot;

static const Object *object_at(const Builder *b, int32_t i)
{
  return &b->place->source->scene->objects.items[i];
}

static bool fail_at(const Builder *b, int32_t i, const char *message)
{
  return prepare_failed_object(b->p, b->place->source->scene, i, message);
}

// Least and largest stretch of a map: the singular values, by Jacobi's rotations of its square.
static void frame_stretch(const Frame *f, double *least, double *most)
{
  const Vec3 c[3] = {f->x, f->y, f->z};
  double a[3][3];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      a[i][j] = (double)c[i][0] * (double)c[j][0] + (double)c[i][1] * (double)c[j][1] + (double)c[i][2] * (double)c[j][2];
  for (int round = 0; round < 12; round++)
    for (int p = 0; p < 2; p++)
      for (int q = p + 1; q < 3; q++) {
        if (a[p][q] == 0) continue;
        const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        const double t = (theta < 0 ? -1 : 1) / (fabs(theta) + sqrt(theta * theta + 1)), cosine = 1 / sqrt(t * t + 1), sine = t * cosine;
        for (int k = 0; k < 3; k++) {
          const double x = a[k][p], y = a[k][q];
          a[k][p] = cosine * x - sine * y;
          a[k][q] = sine * x + cosine * y;
        }
        for (int k = 0; k < 3; k++) {
          const double x = a[p][k], y = a[q][k];
          a[p][k] = cosine * x - sine * y;
          a[q][k] = sine * x + cosine * y;
        }
      }
  *least = sqrt(fmax(fmin(a[0][0], fmin(a[1][1], a[2][2])), 0));
  *most = sqrt(fmax(a[0][0], fmax(a[1][1], a[2][2])));
}

static void set_map(SdfStep *s, const Frame *own_from_around)
{
  const Frame *f = own_from_around;
  for (int k = 0; k < 3; k++) {
    s->map[3 * k] = f->x[k];
    s->map[3 * k + 1] = f->y[k];
    s->map[3 * k + 2] = f->z[k];
    s->map[9 + k] = f->p[k];
  }
  const Frame one = frame_identity();
  s->is_moved = v3_is_zero(f->x - one.x) && v3_is_zero(f->y - one.y) && v3_is_zero(f->z - one.z);
}

static bool add_step(Builder *b, int32_t i, SdfStep s)
{
  if (b->body->steps.count == SDF_MOST_STEPS) return fail_at(b, i, "is one part too many: a field has at most 8192 parts and groups");
  return array_push(&b->body->steps, s) || prepare_failed_memory(b->p);
}

static SdfStep step_joining(const Joining *j, SdfKind kind, double scale)
{
  SdfStep s;
  memset(&s, 0, sizeof s); // steps are compared as bytes
  s.kind = (uint8_t)kind;
  s.operation = (uint8_t)j->operation;
  s.mix = (uint8_t)j->mix;
  s.smooth = j->smooth;
  s.inv_smooth = j->smooth > 0 ? 1 / j->smooth : 0;
  s.sixth = j->smooth / 6;
  s.is_pushed = j->is_first;
  s.scale = (float)scale;
  return s;
}

// The slot of a material, the same for all parts that wear it.
static bool slot_of(Builder *b, int32_t i, uint32_t material, uint16_t *slot)
{
  Sdf *s = &b->body->sdf;
  for (uint16_t k = 0; k < s->leaf_count; k++)
    if (b->materials[k] == material) return *slot = k, true;
  if (s->leaf_count == SDF_MOST_LEAVES) return fail_at(b, i, "brings one material too many: a field has at most 4096");
  b->materials[s->leaf_count] = material;
  *slot = s->leaf_count++;
  return true;
}

// --- primitives ---------------------------------------------------------------------------------------
static void set_size(SdfStep *s, double x, double y, double z, double w)
{
  s->size[0] = (float)x;
  s->size[1] = (float)y;
  s->size[2] = (float)z;
  s->size[3] = (float)w;
}

static Bounds box_of(double x, double y, double z)
{
  return bounds_of_half(x, -y, y, z);
}

static bool add_formula(Builder *b, int32_t i, const ShapeFormula *shape, SdfStep *s)
{
  Formula f;
  char message[200];
  memset(&f, 0, sizeof f);
  if (!formula_compile(shape->formula, &f, message))
    return err_set(b->p->err, ERR_BAD_SCENE, "objects[%d]: the formula, %s", i, message);
  if (b->body->formulas.count == UINT16_MAX) return fail_at(b, i, "is one formula too many");
  s->formula = (uint16_t)b->body->formulas.count;
  return array_push(&b->body->formulas, f) || prepare_failed_memory(b->p);
}

// Kind and sizes; the box of {value <= grow} in its own space, where it is not cut by a frame.
static bool set_primitive(Builder *b, int32_t i, double grow, SdfStep *s, Bounds *box)
{
  const Shape *shape = &object_at(b, i)->shape;
  switch ((ShapeKind)shape->kind) {
  case SHAPE_SPHERE: {
    const double r = (double)shape->sphere.radius;
    s->kind = SDF_SPHERE;
    set_size(s, r, 0, 0, 0);
    *box = box_of(r + grow, r + grow, r + grow);
    return true;
  }
  case SHAPE_BOX:
  case SHAPE_ROUND_BOX: {
    const bool is_round = shape->kind == SHAPE_ROUND_BOX;
    const float *size = is_round ? shape->round_box.size : shape->box.size;
    const float least = min_f(size[0], min_f(size[1], size[2])) / 2;
    const double round = is_round ? (double)min_f(shape->round_box.round, least) : 0;
    const double x = (double)size[0] / 2, y = (double)size[1] / 2, z = (double)size[2] / 2;
    s->kind = SDF_BOX;
    set_size(s, x - round, y - round, z - round, round);
    *box = box_of(x + grow, y + grow, z + grow);
    return true;
  }
  case SHAPE_PLANE:
    s->kind = SDF_PLANE;
    *box = (Bounds){v3(-INFINITY, -INFINITY, -INFINITY), v3(INFINITY, INFINITY, (float)grow)};
    return true;
  case SHAPE_CYLINDER: {
    const double r = (double)shape->cylinder.radius, half = (double)shape->cylinder.height / 2;
    if (!shape->cylinder.capped && half > 0) return fail_at(b, i, "is an open tube, which has no inside; a field needs it capped");
    s->kind = SDF_CYLINDER;
    set_size(s, r, half > 0 ? half : INFINITY, 0, 0);
    *box = box_of(r + grow, half > 0 ? half + grow : INFINITY, r + grow);
    return true;
  }
  case SHAPE_CONE: {
    const double low = (double)shape->cone.radius, high = (double)shape->cone.top_radius, half = (double)shape->cone.height / 2;
    if (!shape->cone.capped) return fail_at(b, i, "is an open cone, which has no inside; a field needs it capped");
    s->kind = SDF_CONE;
    set_size(s, low, high, half, 0);
    *box = box_of(fmax(low, high) + grow, half + grow, fmax(low, high) + grow);
    return true;
  }
  case SHAPE_TORUS: {
    const double ring = (double)shape->torus.radius, tube = (double)min_f(shape->torus.tube_radius, shape->torus.radius);
    s->kind = SDF_TORUS;
    set_size(s, ring, tube, 0, 0);
    *box = box_of(ring + tube + grow, tube + grow, ring + tube + grow);
    return true;
  }
  case SHAPE_CAPSULE: {
    const double r = (double)shape->capsule.radius, half = (double)shape->capsule.height / 2;
    s->kind = SDF_CAPSULE;
    set_size(s, r, half, 0, 0);
    *box = box_of(r + grow, r + half + grow, r + grow);
    return true;
  }
  case SHAPE_ELLIPSOID: {
    const float *r = shape->ellipsoid.radius;
    const double more = 1 + grow / (double)min_f(r[0], min_f(r[1], r[2]));
    s->kind = SDF_ELLIPSOID;
    set_size(s, (double)r[0], (double)r[1], (double)r[2], 0);
    *box = box_of((double)r[0] * more, (double)r[1] * more, (double)r[2] * more);
    return true;
  }
  case SHAPE_OCTAHEDRON: {
    const double r = (double)shape->octahedron.radius;
    s->kind = SDF_OCTAHEDRON;
    set_size(s, r, 0, 0, 0);
    *box = box_of(r + grow, r + grow, r + grow);
    return true;
  }
  case SHAPE_MENGER: {
    const double half = (double)shape->menger.size / 2;
    s->kind = SDF_MENGER;
    s->count = (uint16_t)shape->menger.levels;
    set_size(s, half, 0, 0, 0);
    *box = box_of(half + grow, half + grow, half + grow);
    return true;
  }
  case SHAPE_MANDELBULB: {
    const double r = (double)shape->mandelbulb.radius, reach = r + 4 * grow; // the estimate grows by a fourth at least
    s->kind = SDF_MANDELBULB;
    s->count = (uint16_t)shape->mandelbulb.rounds;
    s->power = (uint8_t)shape->mandelbulb.power;
    set_size(s, r, 0, 0, 0);
    b->has_fractal = true;
    *box = box_of(reach, reach, reach);
    return true;
  }
  case SHAPE_FORMULA: {
    const float *size = shape->formula.size;
    const double x = (double)size[0] / 2, y = (double)size[1] / 2, z = (double)size[2] / 2;
    s->kind = SDF_FORMULA;
    set_size(s, x, y, z, 0);
    *box = box_of(x + grow, y + grow, z + grow);
    return add_formula(b, i, &shape->formula, s);
  }
  case SHAPE_MESH:
  case SHAPE_QUAD:
  case SHAPE_DISK:
  case SHAPE_TRIANGLE:
  case SHAPE_ENDLESS_CONE:
  case SHAPE_VOXELS:
  case SHAPE_CSG:
    return fail_at(b, i, "cannot be part of a field; take a sphere, box, round_box, torus, cylinder, cone, capsule, plane, "
                         "ellipsoid, octahedron, menger, mandelbulb, formula or field");
  case SHAPE_FIELD: break;
  }
  unreachable();
}

static Bounds placed(const Frame *f, const Bounds *box)
{
  const Frame one = frame_identity();
  return memcmp(f, &one, sizeof one) ? accel_world_bounds(f, box) : *box;
}

static bool add_primitive(Builder *b, int32_t i, const Spot *at, const Joining *j, Bounds *box)
{
  SdfStep s = step_joining(j, SDF_SPHERE, at->scale);
  const Frame inverse = frame_inverse(&at->frame);
  Bounds own;
  set_map(&s, &inverse);
  if (!set_primitive(b, i, at->grow / at->scale, &s, &own) || !slot_of(b, i, at->material, &s.leaf)) return false;
  *box = placed(&at->frame, &own);
  return add_step(b, i, s);
}

// --- groups -------------------------------------------------------------------------------------------
static bool changes_space(const ShapeField *f)
{
  return f->twist != 0 || f->bend != 0 || !v3_is_zero(v3_load(f->repeat)) || !v3_is_zero(v3_load(f->elongate));
}

static bool changes_value(const ShapeField *f)
{
  return f->round > 0 || f->onion > 0 || f->noise != 0;
}

static SdfWarp warp_of(const ShapeField *f)
{
  SdfWarp w;
  memset(&w, 0, sizeof w);
  w.has_space = changes_space(f);
  w.is_mirrored = f->mirrored;
  w.bend = f->bend * (PI / 180);
  w.twist = f->twist * (PI / 180);
  for (int k = 0; k < 3; k++) {
    const float copies = floorf(f->copies[k]);
    w.spacing[k] = f->repeat[k];
    w.elongate[k] = f->elongate[k] / 2;
    w.first[k] = copies > 0 ? 0 : -1e9f;
    w.last[k] = copies > 0 ? copies - 1 : 1e9f;
    w.shift[k] = copies > 0 ? (copies - 1) * f->repeat[k] / 2 : 0;
  }
  w.round = f->round;
  w.onion = f->onion / 2;
  w.noise = f->noise;
  w.noise_frequency = f->noise != 0 ? 1 / f->noise_size : 0;
  w.seed = (uint32_t)f->noise_seed;
  return w;
}

// The way back: from the box of what lies in warped space to one around all its images. Refuses what cannot be.
static bool unwarp_box(Builder *b, int32_t i, SdfWarp *w, Bounds *box)
{
  for (int k = 0; k < 3; k++) {
    if (w->elongate[k] > 0) {
      box->lo[k] -= w->elongate[k];
      box->hi[k] += w->elongate[k];
    }
    if (!(w->spacing[k] > 0)) continue;
    const float reach = max_f(fabsf(box->lo[k]), fabsf(box->hi[k]));
    if (!w->is_mirrored) {
      w->gap[k] = w->spacing[k] / 2 - reach;
      if (!(w->gap[k] > 1e-4f * w->spacing[k]))
        return err_set(b->p->err, ERR_BAD_SCENE,
                       "objects[%d]: along %c its parts reach %.4g m from the middle, but copies every %.4g m have room for "
                       "less than %.4g; repeat them farther apart, or let them be mirrored",
                       i, "xyz"[k], (double)reach, (double)w->spacing[k], (double)w->spacing[k] / 2);
    }
    const bool has_ends = w->last[k] < 1e9f;
    const float all = has_ends ? (w->last[k] - w->first[k]) / 2 * w->spacing[k] + reach : INFINITY;
    box->lo[k] = -all;
    box->hi[k] = all;
  }
  if ((w->twist != 0 || w->bend != 0) && !bounds_is_finite(box))
    return fail_at(b, i, "goes on for ever, so it can be neither twisted nor bent");
  for (int turn = 0; turn < 2; turn++) { // the twist was asked last, so it is undone first
    if ((turn == 0 ? w->twist : w->bend) == 0) continue;
    const int other = turn == 0 ? 2 : 1;
    const float x = max_f(fabsf(box->lo[0]), fabsf(box->hi[0])), y = max_f(fabsf(box->lo[other]), fabsf(box->hi[other]));
    const float r = sqrtf(x * x + y * y) * (1 + 0x1p-20f);
    box->lo[0] = box->lo[other] = -r;
    box->hi[0] = box->hi[other] = r;
  }
  return true;
}

static SdfOperation operation_of(const ShapeField *f)
{
  return (SdfOperation)f->operation; // the same order
}

// A hard union in a hard union is one union.
static bool flows_into(const ShapeField *f, const Joining *j, bool has_one_part)
{
  if (has_one_part) return true;
  return f->operation == SDF_UNION && f->smooth == 0 && j->operation == SDF_UNION && j->smooth == 0;
}

static bool add_group(Builder *b, int32_t i, const Spot *at, const Joining *j, Bounds *box);

static bool add_part(Builder *b, int32_t part, const Spot *group, const Joining *j, Bounds *box)
{
  const Object *o = object_at(b, part);
  const Source *source = b->place->source;
  const Frame own = object_frame(&o->common);
  Spot at = *group;
  double least, most;
  frame_stretch(&own, &least, &most);
  if (!(least > 0)) return fail_at(b, part, "is flat");
  at.frame = frame_product(&group->frame, &own);
  at.scale *= least;
  if (b->place->material < 0 && o->common.material >= 0) at.material = source->material_base + (uint32_t)o->common.material;
  return o->shape.kind == SHAPE_FIELD ? add_group(b, part, &at, j, box) : add_primitive(b, part, &at, j, box);
}

// What melting may add to a value that is less than 0 with one part alone: each of n joins takes k / 6 off, but none
// where it is k below the other already.
static double melting(const ShapeField *f, int parts)
{
  return f->operation == SDF_UNION ? (double)f->smooth * fmin(parts - 1, 7) / 6 : 0;
}

static int count_parts(const Source *s, int32_t i)
{
  int count = 0;
  for (int32_t part = s->first_part[i]; part >= 0; part = s->next_part[part]) count++;
  return count;
}

// All parts of a group, one after another; the box of what they make.
static bool add_parts(Builder *b, int32_t i, const Spot *inside, const Joining *outer, bool flows, Bounds *box)
{
  const Source *source = b->place->source;
  const ShapeField *f = &object_at(b, i)->shape.field;
  Joining j = {operation_of(f), (SdfMix)f->mix, (float)((double)f->smooth * inside->scale), true};
  bool is_first = true;
  if (flows) j = *outer;
  for (int32_t part = source->first_part[i]; part >= 0; part = source->next_part[part]) {
    Bounds one;
    if (!add_part(b, part, inside, &j, &one)) return false;
    const bool narrows = f->operation == SDF_INTERSECTION || f->operation == SDF_SOFT_MAXIMUM;
    if (is_first) {
      *box = one;
    } else if (narrows) {
      box->lo = v3_max(box->lo, one.lo);
      box->hi = v3_min(box->hi, one.hi);
    } else if (f->operation == SDF_UNION) {
      bounds_add(box, &one);
    }
    is_first = j.is_first = false;
  }
  return true;
}

static bool add_group(Builder *b, int32_t i, const Spot *at, const Joining *j, Bounds *box)
{
  const ShapeField *f = &object_at(b, i)->shape.field;
  const int parts = count_parts(b->place->source, i);
  const bool has_space = changes_space(f), has_value = changes_value(f);
  Spot inside = *at;
  Frame inverse = frame_inverse(&at->frame);
  if (!parts)
    return fail_at(b, i, "is a field without parts; name it in \"part_of\" of the objects it is made of, below it in the list");
  if (++inside.depth >= SDF_MOST_DEPTH) return fail_at(b, i, "is nested too deep: fields in fields go at most 15 deep");
  inside.grow += at->scale * (melting(f, parts) + (double)f->round + (double)f->onion / 2 + fabs((double)f->noise) * SDF_NOISE_HIGH);
  if (!has_space && !has_value) {
    const bool flows = flows_into(f, j, parts == 1);
    if (!add_parts(b, i, &inside, j, flows, box)) return false;
    return flows || j->is_first || add_step(b, i, step_joining(j, SDF_JOIN, at->scale));
  }
  if (b->body->warps.count == UINT16_MAX) return fail_at(b, i, "is one warped field too many");
  const uint16_t warp_i = (uint16_t)b->body->warps.count;
  if (!array_push(&b->body->warps, warp_of(f))) return prepare_failed_memory(b->p);
  SdfStep enter = step_joining(j, SDF_ENTER, at->scale), end = step_joining(j, SDF_LEAVE, at->scale);
  enter.warp = end.warp = warp_i;
  set_map(&enter, &inverse);
  set_map(&end, &inverse);
  if (has_space) {
    inside.frame = frame_identity();
    if (!add_step(b, i, enter)) return false;
  }
  if (!add_parts(b, i, &inside, j, false, box) || !add_step(b, i, end)) return false;
  if (!has_space) return true;
  if (!unwarp_box(b, i, &b->body->warps.items[warp_i], box)) return false;
  *box = placed(&at->frame, box);
  return true;
}

// --- the whole ------------------------------------------------------------------------------------------
static uint64_t body_key(const SdfBody *b)
{
  uint64_t key = hash_bytes(b->sdf.leaf_count, b->steps.items, b->steps.count * sizeof *b->steps.items);
  key = hash_bytes(key, b->warps.items, b->warps.count * sizeof *b->warps.items);
  key = hash_bytes(key, b->formulas.items, b->formulas.count * sizeof *b->formulas.items);
  return hash_bytes(key, &b->sdf.detail, sizeof b->sdf.detail);
}

static bool bodies_equal(const SdfBody *a, const SdfBody *b)
{
  return a->key == b->key && a->steps.count == b->steps.count && a->warps.count == b->warps.count &&
         a->formulas.count == b->formulas.count &&
         !memcmp(a->steps.items, b->steps.items, a->steps.count * sizeof *a->steps.items) &&
         (!a->warps.count || !memcmp(a->warps.items, b->warps.items, a->warps.count * sizeof *a->warps.items)) &&
         (!a->formulas.count || !memcmp(a->formulas.items, b->formulas.items, a->formulas.count * sizeof *a->formulas.items));
}

static SdfBody *find_body(const WorldParts *p, const SdfBody *like)
{
  for (size_t i = 0; p && i < p->fields.count; i++)
    if (bodies_equal(p->fields.items[i], like)) return sdf_body_share(p->fields.items[i]);
  return NULL;
}

// The body with its cells: that of this world or the last if it is the same. Owned by the world's parts.
static const SdfBody *finish_body(Builder *b)
{
  SdfBody *made = b->body, *found;
  made->key = body_key(made);
  found = find_body(b->p->parts, made);
  if (!found) found = find_body(b->p->previous, made);
  if (found) {
    sdf_body_release(made);
    made = found;
  } else if (!sdf_body_make(made, b->p->err)) {
    sdf_body_release(made);
    return NULL;
  }
  if (array_push(&b->p->parts->fields, made)) return made;
  sdf_body_release(made);
  prepare_failed_memory(b->p);
  return NULL;
}

static void set_scale(Builder *b, int32_t i, const Bounds *box)
{
  Sdf *s = &b->body->sdf;
  const Shape *shape = &object_at(b, i)->shape;
  const bool has_ends = bounds_is_finite(box);
  const float size = has_ends ? max_f(v3_max_lane(box->hi - box->lo), 1e-20f) : 4;
  s->bounds = *box;
  if (has_ends) { // so that a surface never lies in its box
    s->bounds.lo -= v3_all(1e-4f * size);
    s->bounds.hi += v3_all(1e-4f * size);
  }
  s->detail = shape->kind == SHAPE_FIELD && shape->field.detail > 0 ? shape->field.detail : size / 4000;
  s->normal_step = b->has_fractal ? s->detail : 2e-5f * size;
}

// Colours of the slots, for the field to mix, and materials without colour of their own to take them.
static bool mix_colors(Builder *b, Sdf *s)
{
  float(*colors)[3] = arena_alloc(b->arena, s->leaf_count, sizeof *colors);
  if (!colors) return prepare_failed_memory(b->p);
  for (uint32_t k = 0; k < s->leaf_count; k++) {
    SurfaceMaterial m = b->materials[k] == UINT32_MAX ? surface_default() : b->p->materials.items[b->materials[k]];
    const bool is_mixable = m.kind != SURFACE_MIX;
    v3_store(colors[k], is_mixable ? m.color : v3_all(1));
    if (!is_mixable) continue;
    const char *name = b->materials[k] == UINT32_MAX ? NULL : b->p->material_names.items[b->materials[k]];
    m.color = v3_all(1);
    b->materials[k] = (uint32_t)b->p->materials.count;
    if (!prepare_add_material(b->p, &m, name)) return false;
  }
  s->colors = (const float(*)[3])colors;
  return true;
}

static bool build(Builder *b, int32_t object_i, Bounds *box)
{
  const Object *o = object_at(b, object_i);
  const CsgPlace *place = b->place;
  const Spot whole = {.frame = frame_identity(), .scale = 1,
                      .material = place->material >= 0      ? (uint32_t)place->material
                                  : o->common.material >= 0 ? place->source->material_base + (uint32_t)o->common.material
                                                            : UINT32_MAX};
  const Joining alone = {.is_first = true};
  if (o->shape.kind == SHAPE_FIELD) return add_group(b, object_i, &whole, &alone, box);
  return add_primitive(b, object_i, &whole, &alone, box);
}

bool prepare_field(Prepare *p, const CsgPlace *place, int32_t object_i, Instance *instance, WorldInstance *shading)
{
  Builder b = {.p = p, .place = place, .arena = &p->world->arena, .body = sdf_body_create(p->err)};
  Bounds box;
  bool has_color = false;
  if (!b.body) return false;
  b.materials = arena_alloc(&p->scratch, SDF_MOST_LEAVES, sizeof *b.materials);
  if (!b.materials || !build(&b, object_i, &box)) {
    sdf_body_release(b.body);
    return b.materials ? false : prepare_failed_memory(p);
  }
  set_scale(&b, object_i, &box);
  b.body->sdf.has_ids = b.body->sdf.leaf_count > 1;
  const SdfBody *body = finish_body(&b);
  Sdf *sdf = arena_alloc(b.arena, 1, sizeof *sdf);
  if (!body || !sdf) return body ? prepare_failed_memory(p) : false;
  *sdf = body->sdf;
  for (size_t i = 0; i < body->steps.count; i++) has_color |= body->steps.items[i].mix == SDF_MIX_COLOR;
  if (has_color && sdf->has_ids && !mix_colors(&b, sdf)) return false;
  uint16_t *slots = arena_alloc(b.arena, sdf->leaf_count, sizeof *slots);
  uint32_t *materials = arena_alloc(b.arena, sdf->leaf_count, sizeof *materials);
  if (!slots || !materials) return prepare_failed_memory(p);
  for (uint16_t i = 0; i < sdf->leaf_count; i++) {
    slots[i] = i;
    materials[i] = b.materials[i];
  }
  instance->kind = INSTANCE_SDF;
  instance->sdf = sdf;
  shading->slots = slots;
  shading->materials = materials;
  shading->slot_count = sdf->leaf_count;
  p->world->geometry_bytes += sdf_body_bytes(body);
  return prepare_add_instance(p, instance, shading, -1);
}
