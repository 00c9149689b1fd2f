// The upper level: a tree over the instances' boxes in the world. Each box is that of the map's image of the object's
// box, widened by what rounding may do to a ray on its way into object space.

#include "accel/accel.h"

#include "accel/build.h"
#include "base/mem.h"

static Bounds object_bounds(const Instance *i)
{
  const float a = i->size[0], b = i->size[1];
  switch ((InstanceKind)i->kind) {
  case INSTANCE_MESH: return i->mesh ? i->mesh->bounds : bounds_empty();
  case INSTANCE_SPHERE: return (Bounds){v3(-a, -a, -a), v3(a, a, a)};
  case INSTANCE_QUAD: return (Bounds){v3(-a, -b, 0), v3(a, b, 0)};
  case INSTANCE_DISK: return (Bounds){v3(-a, -a, 0), v3(a, a, 0)};
  case INSTANCE_SOLID: return solid_bounds(i->solid);
  case INSTANCE_CSG: return i->csg->bounds;
  case INSTANCE_VOXELS: return voxel_bounds(i->voxels);
  case INSTANCE_SDF: return i->sdf->bounds;
  }
  unreachable();
}

static bool frame_is_finite(const Frame *f)
{
  return v3_is_finite(f->x) && v3_is_finite(f->y) && v3_is_finite(f->z) && v3_is_finite(f->p);
}

static bool frame_is_identity(const Frame *f)
{
  const Frame one = frame_identity();
  bool same = true;
  for (int k = 0; k < 3; k++) {
    same &= f->x[k] == one.x[k] && f->y[k] == one.y[k] && f->z[k] == one.z[k] && f->p[k] == 0;
  }
  return same;
}

static const Bounds endless = {{-INFINITY, -INFINITY, -INFINITY}, {INFINITY, INFINITY, INFINITY}};

// The box of the object's box in the world: each axis of the map adds its share to either side (Arvo, "Transforming
// axis-aligned bounding boxes", Graphics Gems 1990). Sums of four rounded terms are off by at most four ulps of the
// terms' sizes; the ray's transform back by about as much again, so eight.
Bounds accel_world_bounds(const Frame *m, const Bounds *b)
{
  if (!bounds_is_finite(b)) return endless;
  const Vec3 axes[3] = {m->x, m->y, m->z};
  Bounds w = {m->p, m->p};
  Vec3 size = lanes_max(m->p, -m->p);
  for (int k = 0; k < 3; k++) {
    const Vec3 from = axes[k] * b->lo[k], to = axes[k] * b->hi[k];
    w.lo += lanes_min(from, to);
    w.hi += lanes_max(from, to);
    size += lanes_max(lanes_max(from, -from), lanes_max(to, -to));
  }
  w.lo -= 0x1p-21f * size;
  w.hi += 0x1p-21f * size;
  return w;
}

static bool can_be_endless(const Instance *i)
{
  return i->kind == INSTANCE_SOLID || i->kind == INSTANCE_CSG || i->kind == INSTANCE_SDF;
}

static bool is_endless(const Instance *i, const Bounds *b)
{
  return can_be_endless(i) && !bounds_is_empty(b) && !bounds_is_finite(b);
}

// Empty when nothing can hit the instance: no extent, no inverse, or numbers that are not finite.
static Bounds instance_bounds(const Instance *i)
{
  const Bounds b = object_bounds(i);
  const float det = frame_determinant(&i->object_from_world);
  const bool is_placed = frame_is_finite(&i->world_from_object) && frame_is_finite(&i->object_from_world) &&
                         det != 0 && det == det;
  if (is_placed && is_endless(i, &b)) return endless;
  if (!is_placed || bounds_is_empty(&b) || !bounds_is_finite(&b)) return bounds_empty();
  if (i->is_identity) return b;
  const Bounds w = accel_world_bounds(&i->world_from_object, &b);
  return bounds_is_finite(&w) ? w : bounds_empty();
}

static uint32_t emit_instance(void *user, size_t leaf_i, const uint32_t *prims, uint32_t count)
{
  (void)user, (void)leaf_i, (void)count;
  return prims[0];
}

// Which instances go into a tree.
typedef struct Part {
  const uint32_t *cell_of; // NULL: all
  uint32_t cell;
} Part;

static bool part_has(const Part *p, size_t i) { return !p->cell_of || p->cell_of[i] == p->cell; }

static void copy_instance(Accel *a, const Instance *from)
{
  const size_t i = a->instance_count++;
  Instance *to = &a->instances[i];
  *to = *from;
  to->mesh = from->kind == INSTANCE_MESH ? mesh_tree_share(from->mesh) : NULL;
  to->is_identity = frame_is_identity(&to->world_from_object) && frame_is_identity(&to->object_from_world);
  const Bounds box = instance_bounds(to);
  for (int k = 0; k < 3; k++) {
    a->boxes[i][2 * k] = box.lo[k];
    a->boxes[i][2 * k + 1] = box.hi[k];
  }
}

static void add_instance(Accel *a, Build *b, size_t i)
{
  const float *at = a->boxes[i];
  const Bounds box = {v3(at[0], at[2], at[4]), v3(at[1], at[3], at[5])};
  if (bounds_is_empty(&box)) return;
  if (!bounds_is_finite(&box)) {
    a->endless[a->endless_count++] = (uint32_t)i;
    return;
  }
  b->refs[b->count++] = ref_of(&box, (uint32_t)i);
}

static size_t count_endless(const Instance *instances, size_t count, const Part *part)
{
  size_t n = 0;
  for (size_t i = 0; i < count; i++) {
    if (!can_be_endless(&instances[i]) || !part_has(part, i)) continue;
    const Bounds b = instance_bounds(&instances[i]);
    n += !bounds_is_empty(&b) && !bounds_is_finite(&b);
  }
  return n;
}

static bool fill_instances(Accel *a, const Instance *instances, size_t count, Err *err)
{
  a->instances = mem_alloc(count, sizeof *a->instances);
  a->boxes = mem_alloc(count, sizeof *a->boxes);
  if (!a->instances || !a->boxes) return err_memory(err, "the instances", count * sizeof *a->instances);
  for (size_t i = 0; i < count; i++) copy_instance(a, &instances[i]);
  return true;
}

static void borrow_instances(Accel *a, const Accel *from)
{
  a->instances = from->instances;
  a->boxes = from->boxes;
  a->instance_count = from->instance_count;
  a->is_borrowed = true;
}

static bool fill_accel(Accel *a, Build *b, const Instance *instances, size_t count, const Part *part, Err *err)
{
  if (count == 0) return true;
  const size_t endless_count = count_endless(instances, count, part);
  if (endless_count) a->endless = mem_alloc(endless_count, sizeof *a->endless);
  if (endless_count && !a->endless) return err_memory(err, "the instances", endless_count * sizeof *a->endless);
  if (!build_init(b, count, err)) return false;
  b->count = 0;
  for (size_t i = 0; i < count; i++)
    if (part_has(part, i)) add_instance(a, b, i);
  if (!build_split(b, err)) return false;
  a->bounds = b->bounds;
  a->node_count = b->node_count;
  if (a->node_count) {
    a->nodes = mem_alloc(a->node_count, sizeof *a->nodes);
    if (!a->nodes) return err_memory(err, "the tree of instances", a->node_count * sizeof *a->nodes);
  }
  a->root = build_emit(b, a->nodes, emit_instance, NULL);
  return true;
}

static Accel *build_part(const Instance *instances, size_t count, const Part *part, const Accel *owner, Jobs *jobs,
                         const Cancel *cancel, Err *err)
{
  if (count >= LEAF_BIT - 2) {
    err_set(err, ERR_BAD_SCENE, "%zu instances; at most %u are possible", count, LEAF_BIT - 3);
    return NULL;
  }
  Accel *a = mem_zero(1, sizeof *a);
  if (!a) {
    err_memory(err, "the tree of instances", sizeof *a);
    return NULL;
  }
  a->root = EMPTY_TREE;
  a->bounds = bounds_empty();
  Build b = {.leaf_size = 1, .jobs = jobs, .cancel = cancel};
  bool ok = true;
  if (owner)
    borrow_instances(a, owner);
  else if (count)
    ok = fill_instances(a, instances, count, err);
  ok = ok && fill_accel(a, &b, instances, count, part, err);
  build_finish(&b);
  if (ok) return a;
  accel_destroy(a);
  return NULL;
}

Accel *accel_build(const Instance *instances, size_t count, Jobs *jobs, const Cancel *cancel, Err *err)
{
  return build_part(instances, count, &(Part){0}, NULL, jobs, cancel, err);
}

bool accel_build_cells(const Instance *instances, const uint32_t *cell_of, size_t count, Accel **out, size_t cell_count,
                       Jobs *jobs, const Cancel *cancel, Err *err)
{
  size_t k = 0;
  for (; k < cell_count; k++) {
    const Part part = {cell_of, (uint32_t)k};
    out[k] = build_part(instances, count, &part, k ? out[0] : NULL, jobs, cancel, err);
    if (!out[k]) break;
  }
  if (k == cell_count) return true;
  for (out[k] = NULL; k > 0; out[k] = NULL) accel_destroy(out[--k]);
  return false;
}

void accel_destroy(Accel *a)
{
  if (!a) return;
  mem_free(a->nodes);
  if (!a->is_borrowed) {
    for (size_t i = 0; i < a->instance_count; i++) mesh_tree_release(a->instances[i].mesh);
    mem_free(a->instances);
    mem_free(a->boxes);
  }
  mem_free(a->endless);
  mem_free(a);
}

void accel_bounds(const Accel *a, float lo[3], float hi[3])
{
  v3_store(lo, a->bounds.lo);
  v3_store(hi, a->bounds.hi);
}

size_t accel_bytes(const Accel *a)
{
  return sizeof *a + a->node_count * sizeof *a->nodes +
         (a->is_borrowed ? 0 : a->instance_count * (sizeof *a->instances + sizeof *a->boxes)) +
         a->endless_count * sizeof *a->endless;
}

size_t accel_instance_count(const Accel *a) { return a->instance_count; }
const Instance *accel_instances(const Accel *a) { return a->instances; }
