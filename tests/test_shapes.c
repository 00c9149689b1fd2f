// Shapes given by formulas: where rays meet them against the sign of their formula along the ray, areas and volumes
// against closed forms, no surface hit again by what leaves it, the same answers from every walk and instruction set,
// bodies made of others against the same expression of signs, and what the scene reader refuses.

#include "tests/test.h"

#include "accel/brute.h"
#include "accel/place.h"
#include "base/mem.h"
#include "geom/offset.h"
#include "render/hot.h"
#include "tests/random.h"
#include "world/world.h"

enum { SHAPES = 12, FIRST_OPEN = 9 };

static Solid shape_of(int i)
{
  switch (i) {
  case 0: return solid_sphere(1.2f);
  case 1: return (Solid){.kind = SOLID_BOX, .is_closed = true, .size = {1, 0.5f, 0.75f}};
  case 2: return solid_frustum(0.7f, 0.7f, 2, true);
  case 3: return solid_frustum(1, 0, 1.5f, true);
  case 4: return solid_frustum(0.4f, 1, 1.25f, true);
  case 5: return (Solid){.kind = SOLID_TORUS, .is_closed = true, .size = {1, 0.3f}};
  case 6: return (Solid){.kind = SOLID_PLANE, .is_closed = true};
  case 7: return solid_frustum(0.5f, 0.5f, 0, true);
  case 8: return solid_cone(0.7);
  case 9: return solid_frustum(0.8f, 0.8f, 1.5f, false);
  case 10: return solid_frustum(1, 0.25f, 1.5f, false);
  default: return (Solid){.kind = SOLID_TRIANGLE};
  }
}

// A ray that finds the bad places: along and across the axis, towards the tip, from inside, from far away, tangent.
static SolidRay nasty_solid_ray(int i)
{
  const float far = i % 5 == 0 ? 1e4f : 1;
  const Vec3 target = v3(rnd_between(-1.3f, 1.3f), rnd_between(-1.3f, 1.3f), rnd_between(-1.3f, 1.3f));
  Vec3 d = rnd_direction(), o = target - (i % 7 ? 3 * far * d : 0.3f * d);
  if (i % 11 == 1) d = v3(0, i & 1 ? 1 : -1, 0), o = target - 3 * d;
  if (i % 13 == 2) d[i % 3] = 0;
  if (i % 17 == 3) d = v3(d[0], 0.7f * sqrtf(d[0] * d[0] + d[2] * d[2]), d[2]);    // beside a cone's side
  if (i % 19 == 4) o = v3(0, 0.75f, 0) - 4 * d;                                      // to the tip of shape 3
  if (i % 23 == 5) o = -4 * d;                                                       // to the centre
  if (i % 29 == 6) o = v3(1.2f, 0, -3), d = v3(0, 0, 1);                             // touching the sphere
  return (SolidRay){{o[0], o[1], o[2]}, {d[0], d[1], d[2]}};
}

// Inside, to the sign of the formula, wherever that is sure.
TEST(crossings_are_where_the_formula_changes_its_sign)
{
  const int rays = TEST_IS_SLOW ? 2000 : 10000;
  for (int s = 0; s < FIRST_OPEN; s++) {
    const Solid solid = shape_of(s);
    int hits = 0, wrong = 0;
    for (int i = 0; i < rays; i++) {
      const SolidRay r = nasty_solid_ray(i);
      const Crossings c = solid_cross(&solid, &r);
      double p[3];
      for (int k = 0; k < c.count; k++) {
        solid_point(&r, c.at[k].t, p);
        // Through a tip both roots are the root of what rounding left: 1e-8 beside it. Far away a double ends.
        const double off = i % 19 == 4 ? 1e-7 : 1e-10 + 1e-14 * fabs(c.at[k].t);
        wrong += !(fabs(solid_field(&solid, p)) < off) || (k && c.at[k].t < c.at[k - 1].t);
      }
      hits += c.count > 0;
      const double middle = -solid_dot(r.o, r.d) / solid_dot(r.d, r.d);
      for (int k = 0; k < 24; k++) {
        const double t = middle + (double)rnd_between(-2.5f, 2.5f);
        bool inside = c.begins_inside;
        for (int n = 0; n < c.count; n++) inside ^= c.at[n].t < t;
        solid_point(&r, t, p);
        const double field = solid_field(&solid, p);
        wrong += fabs(field) > 1e-9 && inside != (field < 0);
      }
    }
    CHECK_MSG(wrong == 0 && hits > rays / 10, "shape %d: %d wrong, %d hits", s, wrong, hits);
  }
}

// Open shapes: every change of sign within their ends is a crossing, and each crossing is on the skin.
TEST(open_shapes_lose_no_crossing)
{
  const int rays = TEST_IS_SLOW ? 1000 : 5000, steps = 100;
  for (int s = FIRST_OPEN; s < SHAPES - 1; s++) {
    const Solid solid = shape_of(s);
    int wrong = 0, hits = 0;
    for (int i = 0; i < rays; i++) {
      const SolidRay r = nasty_solid_ray(i);
      const Crossings c = solid_cross(&solid, &r);
      const double middle = -solid_dot(r.o, r.d) / solid_dot(r.d, r.d);
      double p[3];
      hits += c.count;
      for (int k = 0; k < c.count; k++) {
        solid_point(&r, c.at[k].t, p);
        wrong += !(fabs(solid_field(&solid, p)) < 1e-10) || p[1] < solid.low - 1e-9 || p[1] > solid.high + 1e-9;
      }
      for (int k = 0; k < steps; k++) {
        const double a = middle - 2 + 4.0 * k / steps, b = middle - 2 + 4.0 * (k + 1) / steps;
        double q[3];
        solid_point(&r, a, p);
        solid_point(&r, b, q);
        const double fa = solid_field(&solid, p), fb = solid_field(&solid, q);
        const bool is_between = fmin(p[1], q[1]) > solid.low && fmax(p[1], q[1]) < solid.high;
        if (!is_between || (fa < 0) == (fb < 0) || fabs(fa) < 1e-9 || fabs(fb) < 1e-9) continue;
        int found = 0;
        for (int n = 0; n < c.count; n++) found += c.at[n].t > a && c.at[n].t < b;
        wrong += found != 1;
      }
    }
    CHECK_MSG(wrong == 0 && hits > rays / 10, "shape %d: %d wrong, %d crossings", s, wrong, hits);
  }
}

// Lines of every direction and place through a ball: by Cauchy and Crofton they cross a skin area / (2 pi R^2) times on
// average, and are inside for volume / (pi R^2) metres.
TEST(areas_and_volumes)
{
  const double pi = 3.14159265358979323846, slant3 = sqrt(1 + 1.5 * 1.5), slant4 = sqrt(0.36 + 1.25 * 1.25);
  const double areas[7] = {4 * pi * 1.44, 2 * (2 * 1 + 1 * 1.5 + 2 * 1.5), 2 * pi * 0.7 * (2 + 0.7), pi * (slant3 + 1),
                           pi * (1.4 * slant4 + 1 + 0.16), 4 * pi * pi * 0.3, 2 * pi * 0.8 * 1.5};
  const double volumes[6] = {4 / 3.0 * pi * 1.728, 2 * 1 * 1.5, pi * 0.49 * 2, pi * 1.5 / 3,
                             pi * 1.25 / 3 * (1 + 0.4 + 0.16), 2 * pi * pi * 0.09};
  const int count = TEST_IS_SLOW ? 20000 : 100000;
  const double radius = 2;
  for (int s = 0; s < 7; s++) {
    const Solid solid = shape_of(s == 6 ? 9 : s);
    double crossings = 0, inside = 0;
    for (int i = 0; i < count; i++) {
      const Vec3 d = rnd_direction();
      const Frame f = frame_around(d);
      const float r = (float)radius * sqrtf(rnd()), a = 2 * PI * rnd();
      const Vec3 o = r * f_cos(a) * f.x + r * f_sin(a) * f.y - 5 * d;
      const SolidRay ray = {{o[0], o[1], o[2]}, {d[0], d[1], d[2]}};
      const Crossings c = solid_cross(&solid, &ray);
      crossings += c.count;
      for (int k = 0; k + 1 < c.count; k += 2) inside += c.at[k + 1].t - c.at[k].t;
    }
    const double area = crossings / count * 2 * pi * radius * radius, volume = inside / count * pi * radius * radius;
    const double tolerance = 6 / sqrt(count); // of six standard errors about
    CHECK_MSG(fabs(area / areas[s] - 1) < tolerance, "shape %d: area %g, not %g", s, area, areas[s]);
    if (s < 6) CHECK_MSG(fabs(volume / volumes[s] - 1) < tolerance, "shape %d: volume %g, not %g", s, volume, volumes[s]);
  }
}

// Degenerate numbers give crossings that are numbers, or none.
TEST(fuzzed_shapes_and_rays_give_no_nan)
{
  const float values[] = {0, 1, -1, 1e-6f, 1e6f, 1e-30f, 1e30f, -0.0f, 0.5f, 3e38f, 1e-38f, 7};
  const int kinds = sizeof values / sizeof *values, count = TEST_IS_SLOW ? 20000 : 100000;
  int bad = 0;
  for (int i = 0; i < count; i++) {
    float v[10];
    for (int k = 0; k < 10; k++) v[k] = rnd() < 0.6f ? values[(int)(rnd() * (float)kinds) % kinds] : rnd_between(-2, 2);
    Solid s = shape_of(i % SHAPES);
    if (i % 4 == 0) s = solid_frustum(fabsf(v[6]), fabsf(v[7]), fabsf(v[8]), i & 8);
    if (i % 4 == 1) s = (Solid){.kind = SOLID_TORUS, .is_closed = true, .size = {fabsf(v[6]) + 1e-6f, fabsf(v[7]) + 1e-6f}};
    if (s.kind == SOLID_TORUS && s.size[1] > s.size[0]) s.size[1] = s.size[0];
    const SolidRay r = {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
    if (v[3] == 0 && v[4] == 0 && v[5] == 0) continue;
    const Crossings c = solid_cross(&s, &r);
    bad += c.count < 0 || c.count > MOST_CROSSINGS || (s.is_closed && s.kind != SOLID_PLANE && c.count == 3);
    for (int k = 0; k < c.count; k++) {
      double p[3];
      bad += !(c.at[k].t - c.at[k].t == 0);
      solid_point(&r, c.at[k].t, p);
      const Vec3 n = solid_normal(&s, c.at[k].part, p);
      const Vec2 uv = solid_uv(&s, c.at[k].part, p);
      bad += n[0] != n[0] || n[1] != n[1] || n[2] != n[2] || uv.x != uv.x || uv.y != uv.y;
    }
  }
  CHECK_MSG(bad == 0, "%d", bad);
}

// --- placed ---------------------------------------------------------------------------------------------

static Frame placed_frame(int i, float scale)
{
  Frame f = frame_around(rnd_direction());
  const Vec3 stretch = i % 3 ? v3(1, 1, 1) : v3(1, 0.6f, 1.7f);
  f.x *= scale * stretch[0];
  f.y *= scale * stretch[1];
  f.z *= scale * stretch[2] * (i % 4 == 3 ? -1 : 1);
  f.p = scale * rnd_between(0, 3) * rnd_direction();
  return f;
}

static Instance placed_solid(const Solid *solid, Frame f)
{
  return (Instance){.world_from_object = f, .object_from_world = frame_inverse(&f), .solid = solid, .kind = INSTANCE_SOLID,
                    .mask = RAY_ALL};
}

// G4. What leaves a convex skin outwards never meets it again, and what goes in comes out once; a torus is met again
// only where the way there leads through its outside.
TEST(nothing_hits_where_it_left)
{
  const int per_shape = TEST_IS_SLOW ? 500 : 4000;
  const float scales[] = {1e-3f, 0.1f, 1, 30, 1e3f, 1e6f};
  int again = 0, leaks = 0, met = 0;
  RayCounters unused = {0};
  for (int s = 0; s < SHAPES; s++) {
    const Solid solid = shape_of(s);
    for (int k = 0; k < 6; k++) {
      const float scale = scales[k];
      const Instance i = placed_solid(&solid, placed_frame(s + k, scale));
      Accel *a = accel_build(&i, 1, NULL, NULL, NULL);
      for (int n = 0; n < per_shape / 6; n++) {
        const Vec3 target = frame_point(&i.world_from_object, rnd() * rnd_direction());
        const Vec3 d = rnd_direction();
        Ray ray = {target - scale * rnd_between(0, 5) * d, d, 0, INFINITY};
        Hit hit;
        if (!accel_closest(a, &ray, RAY_ALL, NULL, NULL, &unused, &hit)) continue;
        const SurfacePoint p = accel_surface(a, NULL, &ray, &hit);
        Vec3 w = rnd_direction();
        if (n % 3 == 0) w = v3_normalize(w + 30 * v3_cross(p.ng, w)); // flat along the skin
        const bool is_out = v3_dot(w, p.ng) > 0;
        ray = (Ray){offset_origin(&p, w), w, 0, INFINITY};
        const bool found = accel_closest(a, &ray, RAY_ALL, NULL, NULL, &unused, &hit);
        met++;
        if (solid.kind == SOLID_TORUS || !solid.is_closed) {
          again += found && hit.t < 4 * p.error;
          continue;
        }
        again += is_out && found;
        const bool goes_on = solid.kind == SOLID_PLANE || s == 7 || s == 8;
        leaks += !is_out && !found && !goes_on;
      }
      accel_destroy(a);
    }
  }
  CHECK_MSG(met > per_shape * SHAPES / 4, "%d", met);
  CHECK_MSG(again == 0, "%d of %d met again", again, met);
  CHECK_MSG(leaks == 0, "%d of %d leaked", leaks, met);
}

// The point is on the skin to the last bits, the normal is the field's gradient, and tangents are perpendicular.
TEST(points_and_normals)
{
  RayCounters unused = {0};
  for (int s = 0; s < SHAPES - 1; s++) {
    const Solid solid = shape_of(s);
    const Instance i = placed_solid(&solid, placed_frame(1, 1));
    Accel *a = accel_build(&i, 1, NULL, NULL, NULL);
    for (int n = 0; n < 500; n++) {
      const Vec3 target = frame_point(&i.world_from_object, rnd() * rnd_direction()), d = rnd_direction();
      const float away = n % 4 ? 3 : 3e5f; // far away a ray's own digits end, not the point's
      const Ray ray = {target - away * d, d, 0, INFINITY};
      Hit hit;
      if (!accel_closest(a, &ray, RAY_ALL, NULL, NULL, &unused, &hit)) continue;
      const SurfacePoint p = accel_surface(a, NULL, &ray, &hit);
      const Vec3 o = frame_point(&i.object_from_world, p.p);
      const double at[3] = {o[0], o[1], o[2]};
      CHECK_MSG(fabs(solid_field(&solid, at)) < 3 * (double)p.error, "shape %d: off by %g, error %g", s,
                solid_field(&solid, at), (double)p.error);
      CHECK(p.error < 1e-5f * (1 + v3_max_lane(v3_abs(p.p))));
      CHECK_NEAR(v3_length(p.ng), 1, 1e-5);
      CHECK_NEAR(v3_dot(p.n, p.tangent), 0, 1e-5);
      CHECK(v3_is_finite(p.tangent) && p.uv[0].x == p.uv[0].x && p.uv[0].y == p.uv[0].y);
      const Vec3 out = frame_point(&i.object_from_world, p.p + 1e-3f * p.ng),
                 in = frame_point(&i.object_from_world, p.p - 1e-3f * p.ng);
      const double outer[3] = {out[0], out[1], out[2]}, inner[3] = {in[0], in[1], in[2]};
      CHECK(solid_field(&solid, outer) > solid_field(&solid, inner));
      CHECK(p.is_back == (v3_dot(p.ng, d) > 0));
      // uv where the derivatives lead, if neither is at its seam.
      Vec3 dpdu, dpdv;
      solid_derivatives(&solid, hit.prim, at, &dpdu, &dpdv);
      const float step = 1e-3f / (1 + v3_length(dpdu) + v3_length(dpdv));
      const Vec3 moved = o + step * dpdu + 2 * step * dpdv;
      const double to[3] = {moved[0], moved[1], moved[2]};
      const Vec2 from_uv = solid_uv(&solid, hit.prim, at), to_uv = solid_uv(&solid, hit.prim, to);
      const bool is_plain = fabsf(from_uv.x - 0.5f) < 0.45f && fabsf(from_uv.y - 0.5f) < 0.4f && v3_length(dpdu) > 0.5f;
      if (is_plain && away < 4) {
        CHECK_NEAR((to_uv.x - from_uv.x) / step, 1, 0.02);
        CHECK_NEAR((to_uv.y - from_uv.y) / step, 2, 0.02);
      }
    }
    accel_destroy(a);
  }
}

// --- bodies ---------------------------------------------------------------------------------------------

static int add_step(Csg *c, CsgLeaf *leaves, Solid solid, Vec3 at, float turn)
{
  CsgLeaf *l = &leaves[c->leaf_count];
  *l = (CsgLeaf){.solid = solid, .world_from_leaf = frame_around(v3_normalize(v3(turn, 0.3f * turn, 1)))};
  l->world_from_leaf.p = at;
  l->leaf_from_world = frame_inverse(&l->world_from_leaf);
  const Bounds own = solid_bounds(&solid), b = accel_world_bounds(&l->world_from_leaf, &own);
  for (int k = 0; k < 3; k++) l->box[2 * k] = b.lo[k], l->box[2 * k + 1] = b.hi[k];
  c->steps[c->step_count++] = (uint8_t)c->leaf_count;
  return (int)c->leaf_count++;
}

// (sphere and box) without a cylinder, together with a torus without a half-space.
static Csg sample_body(CsgLeaf *leaves, float turn)
{
  Csg c = {.leaves = leaves, .bounds = {v3_all(-4), v3_all(4)}};
  add_step(&c, leaves, shape_of(0), v3(0, 0, 0), turn);
  add_step(&c, leaves, shape_of(1), v3(0.3f, 0, 0.2f), turn);
  c.steps[c.step_count++] = STEP_INTERSECTION;
  leaves[add_step(&c, leaves, shape_of(2), v3(0.2f, 0, 0), 2 * turn)].is_flipped = true;
  c.steps[c.step_count++] = STEP_DIFFERENCE;
  add_step(&c, leaves, shape_of(5), v3(0.5f, 0.3f, 0), turn);
  leaves[add_step(&c, leaves, shape_of(6), v3(0, 0, -0.2f), turn)].is_flipped = true;
  c.steps[c.step_count++] = STEP_DIFFERENCE;
  c.steps[c.step_count++] = STEP_UNION;
  return c;
}

// The body's sign at a point, and how sure it is.
static bool body_inside(const Csg *c, Vec3 p, double *sure)
{
  uint32_t inside = 0;
  *sure = INFINITY;
  for (uint32_t l = 0; l < c->leaf_count; l++) {
    const float at[3] = {p[0], p[1], p[2]}, none[3] = {0, 0, 0};
    const SolidRay o = csg_leaf_ray(&c->leaves[l], at, none);
    const double field = solid_field(&c->leaves[l].solid, o.o);
    inside |= (uint32_t)(field < 0) << l;
    *sure = fmin(*sure, fabs(field));
  }
  return csg_value(c, inside);
}

typedef struct Skin {
  double t[MOST_CSG_CROSSINGS];
  int count;
} Skin;

static bool note_crossing(void *user, double t, uint32_t prim)
{
  Skin *s = user;
  (void)prim;
  s->t[s->count++] = t;
  return false;
}

TEST(bodies_are_where_their_expression_says)
{
  const int rays = TEST_IS_SLOW ? 2000 : 10000;
  int wrong = 0, hits = 0;
  for (int i = 0; i < rays; i++) {
    CsgLeaf leaves[MOST_LEAVES];
    const Csg c = sample_body(leaves, i & 1 ? 0 : 0.4f);
    const SolidRay r = nasty_solid_ray(i);
    const Vec3 o = v3((float)r.o[0], (float)r.o[1], (float)r.o[2]), d = v3((float)r.d[0], (float)r.d[1], (float)r.d[2]);
    TreeRay ray;
    Skin skin = {.count = 0};
    if (!tree_ray_init(&ray, o, d, 0)) continue;
    csg_first(&c, &ray, note_crossing, &skin);
    hits += skin.count;
    double sure;
    const bool at_start = body_inside(&c, o, &sure);
    if (sure < 1e-3) continue;
    const float middle = max_f(-v3_dot(o, d), 0);
    for (int k = 0; k < 16; k++) {
      const float t = max_f(middle + rnd_between(-3, 3), 0);
      bool inside = at_start;
      for (int n = 0; n < skin.count; n++) inside ^= skin.t[n] < (double)t;
      const bool truth = body_inside(&c, o + t * d, &sure);
      wrong += sure > 1e-2 && inside != truth; // a float's digits at 1e4 m
    }
  }
  CHECK_MSG(wrong == 0 && hits > rays / 4, "%d wrong, %d hits", wrong, hits);
}

// Two boxes side by side have no wall between them, and a cut flush with a face leaves nothing.
TEST(skins_in_one_place_are_crossed_together)
{
  CsgLeaf leaves[MOST_LEAVES];
  const Solid box = {.kind = SOLID_BOX, .is_closed = true, .size = {0.5f, 0.5f, 0.5f}};
  Csg both = {.leaves = leaves};
  add_step(&both, leaves, box, v3(-0.5f, 0, 0), 0);
  add_step(&both, leaves, box, v3(0.5f, 0, 0), 0);
  both.steps[both.step_count++] = STEP_UNION;
  TreeRay r;
  CHECK(tree_ray_init(&r, v3(-3, 0.1f, 0.2f), v3(1, 0, 0), 0));
  Skin skin = {.count = 0};
  csg_first(&both, &r, note_crossing, &skin);
  CHECK(skin.count == 2);
  CHECK_NEAR(skin.t[0], 2, 1e-12);
  CHECK_NEAR(skin.t[1], 4, 1e-12);
  both.steps[both.step_count - 1] = STEP_DIFFERENCE;
  leaves[1].world_from_leaf.p = leaves[0].world_from_leaf.p;
  leaves[1].leaf_from_world = leaves[0].leaf_from_world;
  memcpy(leaves[1].box, leaves[0].box, sizeof leaves[0].box);
  skin.count = 0;
  csg_first(&both, &r, note_crossing, &skin);
  CHECK(skin.count == 0);
}

// --- all walks agree ------------------------------------------------------------------------------------

// G2: brute force, single rays, batches and every instruction set give the same bits.
TEST(every_walk_gives_the_same_hits)
{
  enum { RAYS = 3000, THINGS = 40 };
  static Solid solids[THINGS];
  static Instance things[THINGS];
  static CsgLeaf leaves[MOST_LEAVES];
  static PackedRay rays[RAYS];
  static Hit brute[RAYS], single[RAYS], batch[RAYS];
  static uint8_t blocked[RAYS];
  Csg body = sample_body(leaves, 0.4f);
  for (int i = 0; i < THINGS; i++) {
    solids[i] = shape_of(i % SHAPES);
    things[i] = placed_solid(&solids[i], placed_frame(i, i % SHAPES == 6 ? 0.001f : 0.4f));
    things[i].world_from_object.p = 4 * rnd() * rnd_direction();
    things[i].object_from_world = frame_inverse(&things[i].world_from_object);
  }
  things[7] = (Instance){.world_from_object = frame_identity(), .object_from_world = frame_identity(), .csg = &body,
                         .kind = INSTANCE_CSG, .mask = RAY_ALL};
  things[13].kind = INSTANCE_SPHERE;
  things[13].size[0] = 0.5f;
  Accel *a = accel_build(things, THINGS, NULL, NULL, NULL);
  RayCounters c = {0};
  int hits = 0;
  for (int i = 0; i < RAYS; i++) {
    const Vec3 o = i < RAYS / 2 ? v3(0, 1, 9) : 6 * rnd() * rnd_direction();
    Vec3 d = i < RAYS / 2 ? v3((float)(i % 40) / 40 - 0.5f, (float)(i / 40) / 40 - 0.5f, -1) : rnd_direction();
    if (i % 50 == 7) d[i % 3] = 0;
    const Ray ray = {o, d, i % 9 ? 0 : 0.5f, i % 8 ? INFINITY : 6};
    rays[i] = ray_pack(&ray);
    hits += accel_closest_brute(a, &ray, RAY_ALL, NULL, NULL, &c, &brute[i]);
  }
  CHECK(hits > RAYS / 4);
  for (int level = 0; level < ISA_COUNT; level++) {
    if (level > (int)cpu_best_isa()) continue;
    const HotTable *hot = hot_table((IsaLevel)level);
    for (int i = 0; i < RAYS; i++) hot->closest_n(a, &rays[i], &single[i], 1);
    hot->closest_n(a, rays, batch, RAYS);
    hot->any_n(a, rays, blocked, RAYS);
    int wrong = 0;
    for (int i = 0; i < RAYS; i++) {
      wrong += memcmp(&brute[i], &single[i], 20) || memcmp(&brute[i], &batch[i], 20) ||
               blocked[i] != (brute[i].instance != NO_HIT);
    }
    CHECK_MSG(wrong == 0, "%s: %d of %d", hot->name, wrong, RAYS);
  }
  accel_destroy(a);
}

// --- scenes ---------------------------------------------------------------------------------------------

static Scene *scene_of(const char *objects, Err *err)
{
  char text[4096];
  const char *path = "test_shapes.tmp.json";
  snprintf(text, sizeof text, "{\"rayfold\": 1, \"objects\": [%s]}", objects);
  FILE *f = fopen(path, "wb");
  if (!f) return NULL;
  fwrite(text, 1, strlen(text), f);
  fclose(f);
  Scene *s = scene_load(path, NULL, err);
  remove(path);
  return s;
}

static void check_refused(const char *objects, const char *why)
{
  Err err = {0};
  Scene *s = scene_of(objects, &err);
  World *w = s ? world_prepare(s, NULL, NULL, NULL, NULL, &err) : NULL;
  CHECK(!w);
  CHECK_TEXT(err.text, why);
  world_release(w);
  scene_destroy(s);
}

#define OBJECT(more, shape) "{" more "\"shape\": {\"kind\": " shape "}}"

TEST(what_makes_no_sense_is_refused)
{
  check_refused(OBJECT("", "\"triangle\", \"a\": [0,0,0], \"b\": [1,1,1], \"c\": [2,2,2]"), "line");
  check_refused(OBJECT("", "\"cone\", \"radius\": 0"), "above 0");
  check_refused(OBJECT("", "\"csg\""), "without parts");
  check_refused(OBJECT("\"part_of\": \"nobody\",", "\"sphere\""), "nobody");
  check_refused(OBJECT("\"name\": \"a\",", "\"sphere\"") "," OBJECT("\"part_of\": \"a\",", "\"sphere\""), "kind csg or field");
  check_refused(OBJECT("\"name\": \"a\",", "\"csg\"") "," OBJECT("\"part_of\": \"a\",", "\"quad\""), "no inside");
  check_refused(OBJECT("\"name\": \"a\",", "\"csg\"") "," OBJECT("\"part_of\": \"a\",", "\"cone\", \"capped\": false"),
                "no inside");
  check_refused(OBJECT("\"name\": \"a\",", "\"csg\"") "," OBJECT("\"part_of\": \"a\",",
                "\"mesh\", \"positions\": [0,0,0,1,0,0,0,1,0], \"triangles\": [0,1,2]"), "mesh");
}

// A lens, the common part of two balls: its volume and its rim, and materials of its parts.
TEST(a_lens_of_two_spheres)
{
  Err err = {0};
  Scene *s = scene_of(OBJECT("\"name\": \"lens\", \"translate\": [1, 2, 3],", "\"csg\", \"operation\": \"intersection\"") ","
                      OBJECT("\"part_of\": \"lens\", \"translate\": [0, 0, 0.5],", "\"sphere\"") ","
                      OBJECT("\"part_of\": \"lens\", \"translate\": [0, 0, -0.5],", "\"sphere\""), &err);
  World *w = s ? world_prepare(s, NULL, NULL, NULL, NULL, &err) : NULL;
  CHECK_MSG(w, "%s", err.text);
  if (!w) return;
  CHECK(w->instance_count == 1);
  CHECK_NEAR(w->lo[2], 2.5, 1e-5);
  CHECK_NEAR(w->hi[2], 3.5, 1e-5);
  const int side = TEST_IS_SLOW ? 60 : 200;
  double volume = 0;
  RayCounters unused = {0};
  for (int i = 0; i < side * side; i++) {
    const float x = ((float)(i % side) + 0.5f) / (float)side * 2 - 1, y = ((float)(i / side) + 0.5f) / (float)side * 2 - 1;
    Ray ray = {v3(1 + x, 2 + y, 0), v3(0, 0, 1), 0, INFINITY};
    Hit in, out;
    if (!accel_closest(w->accel, &ray, RAY_ALL, NULL, NULL, &unused, &in)) continue;
    const SurfacePoint p = accel_surface(w->accel, NULL, &ray, &in);
    CHECK(!p.is_back && p.ng[2] < 0);
    CHECK(in.prim / SOLID_PARTS == 0); // the ball behind bounds it in front
    ray.o = offset_origin(&p, ray.d);
    CHECK(accel_closest(w->accel, &ray, RAY_ALL, NULL, NULL, &unused, &out));
    CHECK(out.prim / SOLID_PARTS == 1);
    volume += (double)out.t * 4 / (side * side);
  }
  CHECK_NEAR(volume, 2 * 3.14159265358979 * 0.25 / 3 * 2.5, 0.01); // two caps of height h = 1/2: pi h^2 (3 - h) / 3
  world_release(w);
  scene_destroy(s);
}

TEST_MAIN
