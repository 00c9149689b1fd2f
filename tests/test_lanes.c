// Shapes asked in lanes against the trees: the same nearest hits on random shapes and rays, points on their surfaces that
// do not meet them again, and whitted pictures that agree.

#include "tests/render_sample.h"

#include "accel/lanes.h"
#include "accel/place.h"
#include "accel/traverse.h"
#include "base/hash.h"
#include "geom/offset.h"

static uint32_t drawn;
static float draw(float low, float high) { return low + (high - low) * unit_float(hash_u32(drawn++)); }

static Object *add_random(Scene *s, int kind)
{
  static const ShapeKind kinds[] = {SHAPE_SPHERE, SHAPE_CYLINDER, SHAPE_CONE, SHAPE_QUAD, SHAPE_DISK, SHAPE_TRIANGLE, SHAPE_SPHERE,
                                    SHAPE_CYLINDER, SHAPE_PLANE, SHAPE_ENDLESS_CONE, SHAPE_CONE};
  Object *o = add_object(s, kinds[kind], -1, draw(-3, 3), draw(-3, 3), draw(-3, 3));
  set3(o->common.rotate, draw(0, 360), draw(0, 360), draw(0, 360));
  if (kind == 6) set3(o->common.scale, 0.5f, 1, 1.5f);
  if (kind == 7) o->shape.cylinder.height = 0;
  if (kind == 10) o->shape.cone.capped = false;
  return o;
}

enum { KINDS = 11 };

// A ray from the middle's surroundings to another point there.
static Ray random_ray(float far)
{
  const Vec3 o = v3(draw(-far, far), draw(-far, far), draw(-far, far)), to = v3(draw(-3, 3), draw(-3, 3), draw(-3, 3));
  return (Ray){o, v3_normalize(to - o), 0, INFINITY};
}

static LaneNearest nearest(const World *w, const Ray *ray)
{
  const LaneRays r = {w3_of(ray->o), w3_of(ray->d), 1};
  LaneNearest n = {.t = wx_set(INFINITY)};
  lanes_closest(w->lanes, UINT32_MAX, RAY_BOUNCE, &r, &n);
  return n;
}

static float first_lane(wx x)
{
  float lane[WIDEST];
  wx_store(lane, x);
  return lane[0];
}
static uint32_t first_int(wxu x)
{
  uint32_t lane[WIDEST];
  wxu_store(lane, x);
  return lane[0];
}
static Vec3 first_vec(Wide3 a) { return v3(first_lane(a.x), first_lane(a.y), first_lane(a.z)); }

static void first_surface(const World *w, const Ray *ray, const LaneNearest *n, Vec3 *p, Vec3 *ng, float *error)
{
  const LaneShape *s = &w->lanes->shapes[first_int(n->shape)];
  const uint32_t part = first_int(n->part);
  Wide3 at, normal;
  lane_shape_surface(s, w3_of(ray->o), w3_of(ray->d), n->t, part == 1 ? WIDEST_BITS : 0, part == 2 ? WIDEST_BITS : 0, &at, &normal);
  *p = first_vec(at);
  *ng = first_vec(normal);
  *error = first_lane(lane_error(s, at));
}

// Where lanes and trees see the same instance they agree on place, part and normal; elsewhere the ray grazes.
TEST(hits_are_those_of_the_trees)
{
  int rays = 0, met = 0, other = 0;
  for (int round = 0; round < 4; round++) {
    Scene *s = new_scene(0);
    for (int k = 0; k < KINDS; k++) add_random(s, k);
    World *w = world_of(s);
    CHECK(w->lanes && w->lanes->count == KINDS);
    for (int i = 0; w->lanes && i < 4000; i++, rays++) {
      const Ray ray = random_ray(i % 2 ? 5 : 100);
      RayCounters c = {0};
      Hit hit;
      const bool has_hit = accel_closest(w->accel, &ray, RAY_BOUNCE, NULL, NULL, &c, &hit);
      const LaneNearest n = nearest(w, &ray);
      const uint32_t instance = w->lanes->shapes[first_int(n.shape)].instance;
      if (has_hit != (n.met & 1) || (has_hit && (instance != hit.instance || first_int(n.part) != hit.prim))) {
        other++;
        continue;
      }
      if (!has_hit) continue;
      met++;
      const SurfacePoint at = accel_surface(w->accel, NULL, &ray, &hit);
      Vec3 p, ng;
      float error;
      first_surface(w, &ray, &n, &p, &ng, &error);
      // What t loses at a slant comes out along the surface, and turns the normal of what is bent.
      const float slant = max_f(fabsf(v3_dot(at.ng, ray.d)), 0.01f), reach = 1e-6f * (v3_length(ray.o) + hit.t + v3_length(at.p));
      CHECK_MSG(v3_length(p - at.p) < 10 * reach / slant, "%g of %g, kind %d", (double)v3_length(p - at.p), (double)hit.t,
                w->lanes->shapes[first_int(n.shape)].kind);
      CHECK_MSG(v3_length(ng - at.ng) < 1e-3f, "%g", (double)v3_length(ng - at.ng));
      CHECK(fabsf(v3_dot(p - at.p, at.ng)) < error);
    }
    world_release(w);
    scene_destroy(s);
  }
  CHECK_MSG(met > rays / 2 && other < rays / 2000, "%d of %d met, %d other", met, rays, other);
}

// A ray that leaves a convex shape outwards never meets it again, at any scale and however flat it goes.
TEST(no_shape_is_met_by_what_leaves_it)
{
  int left = 0, again = 0;
  for (int k = 0; k < KINDS; k++) {
    for (int round = 0; round < 3; round++) {
      const float scale = round == 0 ? 1 : round == 1 ? 0.01f : 100;
      Scene *s = new_scene(0);
      Object *o = add_random(s, k);
      for (int i = 0; i < 3; i++) o->common.translate[i] *= scale;
      if (k != 6) set3(o->common.scale, scale, scale, scale);
      const bool is_convex = k != 10;
      World *w = world_of(s);
      for (int i = 0; w->lanes && is_convex && i < 1000; i++) {
        Ray ray = random_ray(5);
        ray.o *= scale;
        ray.d = v3_normalize(v3_load(o->common.translate) + scale * v3(draw(-1, 1), draw(-1, 1), draw(-1, 1)) - ray.o);
        LaneNearest n = nearest(w, &ray);
        if (!(n.met & 1)) continue;
        Vec3 p, ng;
        float error;
        first_surface(w, &ray, &n, &p, &ng, &error);
        const bool is_behind = v3_dot(ray.d, ng) > 0, is_flat = w->lanes->shapes[0].kind != LANE_BALL && w->lanes->shapes[0].kind != LANE_ROUND;
        if (is_behind && !is_flat) continue; // from inside
        if (is_behind) ng = -ng;
        const Vec3 along = v3_normalize(v3_cross(ng, v3(draw(-1, 1), draw(-1, 1), draw(-1, 1))));
        const Ray away = {offset_point(p, ng, error, ng), v3_normalize(along + draw(0, i % 2 ? 1 : 1e-3f) * ng), 0, INFINITY};
        left++;
        n = nearest(w, &away);
        again += n.met & 1;
      }
      world_release(w);
      scene_destroy(s);
    }
  }
  CHECK_MSG(left > 10000 && again == 0, "%d of %d", again, left);
}

static int32_t add_look(Scene *s, int i)
{
  const bool is_phong = i % 2;
  const int32_t m = scene_add_material(s, is_phong ? MATERIAL_PHONG : MATERIAL_COOK_TORRANCE, NULL);
  float *diffuse = is_phong ? s->materials.items[m].phong.diffuse : s->materials.items[m].cook_torrance.diffuse;
  float *reflect = is_phong ? s->materials.items[m].phong.reflect : s->materials.items[m].cook_torrance.reflect;
  float *transmit = is_phong ? s->materials.items[m].phong.transmit : s->materials.items[m].cook_torrance.transmit;
  set3(diffuse, 0.3f, 0.5f, 0.4f);
  if (i % 3 == 0) set3(reflect, 0.4f, 0.3f, 0.3f);
  if (i % 4 == 0) set3(transmit, 0.7f, 0.8f, 0.9f);
  return m;
}

// The same world with and without lanes.
TEST(pictures_are_those_of_the_trees)
{
  Scene *s = new_scene(0);
  s->render.integrator = INTEGRATOR_WHITTED;
  s->render.max_depth = 5;
  s->render.filter = FILTER_BOX;
  s->whitted.light_units = LIGHT_UNITS_CLASSIC;
  set3(s->whitted.ambient, 0.1f, 0.1f, 0.1f);
  s->sky.kind = SKY_GRADIENT;
  set3(s->sky.gradient.zenith, 0.2f, 0.4f, 0.9f);
  for (int k = 0; k < KINDS; k++) {
    if (k == 8) continue; // a plane through everything hides it
    Object *o = add_random(s, k);
    o->common.material = add_look(s, k);
    if (k == 3) o->common.role = ROLE_BACKGROUND;
  }
  // By itself: of bodies in one another lanes take what each absorbs, the trees what the last that was entered does.
  const int32_t green = add_look(s, 8);
  set3(s->materials.items[green].cook_torrance.attenuation_color, 0.5f, 0.9f, 0.9f);
  s->materials.items[green].cook_torrance.attenuation_distance = 1;
  add_sphere(s, green, -1, 5, 5, 0.7f);
  const int32_t floor = add_look(s, 1);
  s->materials.items[floor].phong.diffuse_texture = scene_add_texture(s, TEXTURE_CHECKER, "tiles");
  Object *o = add_object(s, SHAPE_PLANE, floor, 0, -3, 0);
  set3(o->common.rotate, -90, 0, 0);
  for (int i = 0; i < 2; i++) {
    Light *l = add_light(s, LIGHT_POINT);
    set3(l->point.position, i ? 6.0f : -5.0f, 6, 5);
    set3(l->point.intensity, 0.5f, 0.4f, 0.4f);
  }
  Light *sun = add_light(s, LIGHT_SUN);
  set3(sun->sun.direction, 1, 2, 1);
  World *w = world_of(s);
  CHECK(w->lanes);
  enum { SIDE = 96 };
  static float seen[2][SIDE * SIDE][4];
  for (int k = 0; k < 2; k++) {
    Film *f = film_create(SIDE, SIDE, ALL_PLANES, NULL);
    const RenderJob job = job_of(s, w, pinhole(1, 2, 11, 0, 0, 0, 45), f, 1);
    CHECK(render_run(&job, NULL, hot_table(cpu_best_isa()), NULL, NULL, NULL));
    CHECK(film_resolve(f, FILM_BEAUTY, seen[k][0]));
    film_destroy(f);
    w->lanes = NULL;
  }
  int off = 0;
  double sum = 0, light = 0;
  for (int i = 0; i < SIDE * SIDE; i++) {
    const float d = max_f(fabsf(seen[0][i][0] - seen[1][i][0]), fabsf(seen[0][i][2] - seen[1][i][2]));
    off += d > 0.004f;
    sum += (double)d;
    light += (double)seen[0][i][2];
  }
  CHECK_MSG(off < SIDE * SIDE / 500 && sum < 1e-3 * light && light > 0.1 * SIDE * SIDE, "%d pixels off, by %g of %g", off, sum, light);
  world_release(w);
  scene_destroy(s);
}

TEST_MAIN
