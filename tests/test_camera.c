// Cameras and pixel filters: rays against their closed forms, lenses filled evenly, filters of the right width.

#include "tests/test.h"

#include "base/hash.h"
#include "render/camera.h"
#include "render/filter.h"
#include "scene/scene.h"
#include "tests/chi_square.h"

static Camera perspective(float fov)
{
  Camera c = {.kind = CAMERA_PERSPECTIVE};
  c.common = (CameraCommon){{1, 2, 3}, {1, 2, -7}, {0, 1, 0}, 0, -1};
  c.perspective = (Perspective){.fov = fov};
  return c;
}

static Eye eye_of(const Camera *c)
{
  Eye e = {0};
  Err err = {0};
  CHECK_MSG(eye_from_camera(c, &e, &err), "%s", err.text);
  return e;
}

#define CHECK_VECTOR(a, x_, y_, z_, tolerance) \
  do {                                         \
    CHECK_NEAR((a)[0], x_, tolerance);         \
    CHECK_NEAR((a)[1], y_, tolerance);         \
    CHECK_NEAR((a)[2], z_, tolerance);         \
  } while (0)

TEST(perspective_rays_follow_the_tangent)
{
  const Camera c = perspective(60);
  const Eye e = eye_of(&c);
  const Vec2 lens = {0.3f, 0.8f};
  const Ray middle = eye_ray(&e, 200, 100, (Vec2){100, 50}, lens);
  CHECK_VECTOR(middle.o, 1, 2, 3, 1e-6);
  CHECK_VECTOR(middle.d, 0, 0, -1, 1e-6);
  const Ray top = eye_ray(&e, 200, 100, (Vec2){100, 0}, lens);
  CHECK_VECTOR(top.d, 0, 0.5, -sqrt(0.75), 1e-6); // 30 degrees up
  const Ray right = eye_ray(&e, 200, 100, (Vec2){200, 50}, lens);
  const double t = 2 * tan(PI / 6);
  CHECK_VECTOR(right.d, t / sqrt(1 + t * t), 0, -1 / sqrt(1 + t * t), 1e-6);
  CHECK(middle.tmin == 0 && isinf(middle.tmax));
}

TEST(the_frame_is_orthonormal_even_looking_along_up)
{
  const float targets[5][3] = {{0, -1, 0}, {0, 1, 0}, {1, 1, 1}, {1e-7f, -1, 0}, {0, 0, 1}};
  for (int k = 0; k < 5; k++) {
    Camera c = perspective(40);
    for (int i = 0; i < 3; i++) c.common.target[i] = c.common.position[i] + 5 * targets[k][i];
    const Eye e = eye_of(&c);
    CHECK_NEAR(frame_determinant(&e.frame), 1, 1e-5);
    CHECK_NEAR(v3_dot(e.frame.x, e.frame.y), 0, 1e-6);
    CHECK_NEAR(v3_dot(e.frame.y, e.frame.z), 0, 1e-6);
    const Ray r = eye_ray(&e, 10, 10, (Vec2){5, 5}, (Vec2){0, 0});
    const Vec3 d = v3_normalize(v3_load(targets[k]));
    CHECK_VECTOR(r.d, d[0], d[1], d[2], 1e-5);
  }
}

TEST(a_camera_that_looks_nowhere_is_refused)
{
  Camera c = perspective(40);
  memcpy(c.common.target, c.common.position, sizeof c.common.target);
  Eye e;
  Err err = {0}, nan = {0};
  CHECK(!eye_from_camera(&c, &e, &err));
  CHECK_TEXT(err.text, "same point");
  c.common.target[1] = NAN;
  CHECK(!eye_from_camera(&c, &e, &nan) && nan.kind == ERR_BAD_SCENE);
}

TEST(lens_rays_meet_in_the_sharp_plane)
{
  for (int32_t blades = 0; blades <= 8; blades++) {
    Camera c = perspective(50);
    c.perspective.aperture = 0.1f;
    c.perspective.focus = 4;
    c.perspective.blades = blades;
    const Eye e = eye_of(&c);
    const Vec2 film = {37, 81};
    const double t = tan(25 * PI / 180), x = 1 + 4 * t * (2 * 37 / 100.0 - 1),
                 y = 2 + 4 * t * (1 - 2 * 81 / 100.0);
    double mean[2] = {0, 0}, squares[2] = {0, 0}, corner = 0;
    enum {
      COLUMNS = 840,
      ROWS = 16,
      COUNT = COLUMNS * ROWS
    }; // 840: whole columns for every number of blades
    for (int i = 0; i < COUNT; i++) {
      const Vec2 u = {((float)(i % COLUMNS) + 0.5f) / COLUMNS, ((float)(i / COLUMNS) + 0.5f) / ROWS};
      const Ray r = eye_ray(&e, 100, 100, film, u);
      const Vec3 p = r.o + (4 / -r.d[2]) * r.d;
      CHECK_VECTOR(p, x, y, -1, 1e-5);
      CHECK_NEAR(v3_length(r.d), 1, 1e-6);
      const double l[2] = {(r.o[0] - 1) / 0.1, (r.o[1] - 2) / 0.1};
      corner = fmax(corner, sqrt(l[0] * l[0] + l[1] * l[1]));
      for (int k = 0; k < 2; k++) mean[k] += l[k] / COUNT, squares[k] += l[k] * l[k] / COUNT;
    }
    // Second moment of a regular polygon with n corners on the unit circle: (2 + cos(2 pi / n)) / 12; a disk: 1/4.
    const double moment = blades < 3 ? 0.25 : (2 + cos(2 * (double)PI / blades)) / 12;
    CHECK_NEAR(mean[0], 0, 0.01);
    CHECK_NEAR(mean[1], 0, 0.01);
    CHECK_NEAR(squares[0], moment, 0.004);
    CHECK_NEAR(squares[1], moment, 0.004);
    CHECK(corner <= 1 + 1e-5 && corner > 0.95);
  }
}

TEST(orthographic_rays_are_parallel)
{
  Camera c = {.kind = CAMERA_ORTHOGRAPHIC};
  c.common = (CameraCommon){{0, 0, 0}, {5, 0, 0}, {0, 1, 0}, 0, -1}; // looks along +x: right is +z
  c.orthographic = (Orthographic){.height = 4};
  const Eye e = eye_of(&c);
  const Ray r = eye_ray(&e, 300, 100, (Vec2){300, 0}, (Vec2){0, 0});
  CHECK_VECTOR(r.o, 0, 2, 6, 1e-5);
  CHECK_VECTOR(r.d, 1, 0, 0, 1e-6);
}

TEST(a_panorama_shows_the_sphere_once)
{
  Camera c = {.kind = CAMERA_PANORAMIC};
  c.common = (CameraCommon){{0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 0, -1};
  c.panoramic = (Panoramic){.span = 360};
  const Eye e = eye_of(&c);
  const Vec2 lens = {0, 0};
  const Vec3 middle = eye_ray(&e, 200, 100, (Vec2){100, 50}, lens).d;
  const Vec3 quarter = eye_ray(&e, 200, 100, (Vec2){150, 50}, lens).d;
  const Vec3 edge = eye_ray(&e, 200, 100, (Vec2){200, 50}, lens).d;
  const Vec3 top = eye_ray(&e, 200, 100, (Vec2){77, 0}, lens).d;
  CHECK_VECTOR(middle, 0, 0, -1, 1e-6);
  CHECK_VECTOR(quarter, 1, 0, 0, 1e-6);
  CHECK_VECTOR(edge, 0, 0, 1, 1e-6);
  CHECK_VECTOR(top, 0, 1, 0, 1e-6);
}

TEST(filters_have_their_shape)
{
  const struct {
    FilterKind kind;
    double half, deviation; // standard deviation in pixels
  } cases[3] = {
      {FILTER_BOX, 0.5, 1 / sqrt(12)}, {FILTER_BLACKMAN_HARRIS, 1.5, 0.4155}, {FILTER_GAUSSIAN, 1.5, 0.4933}};
  for (int c = 0; c < 3; c++) {
    Filter f;
    filter_build(&f, cases[c].kind, 0);
    double sum = 0, squares = 0;
    for (int i = 0; i < 65536; i++) {
      const double x = filter_place(&f, (float)((i + 0.5) / 65536));
      sum += x / 65536;
      squares += x * x / 65536;
    }
    CHECK_NEAR(sum, 0, 1e-4);
    CHECK_NEAR(sqrt(squares), cases[c].deviation, 2e-3);
    CHECK(f.place[0] == (float)-cases[c].half && f.place[FILTER_STEPS] == (float)cases[c].half);
    for (int i = 0; i < FILTER_STEPS; i++) CHECK(f.place[i] <= f.place[i + 1]);
  }
}

// --- P4: chi-square of what has no direction --------------------------------------------------------
enum { SAMPLES = 100000, CASES = 3 + 5 };

// The textbook's curve, in double.
static double filter_curve(FilterKind kind, double x) // x in [-1, 1] of the half width
{
  switch (kind) {
  case FILTER_BOX: return 1;
  case FILTER_BLACKMAN_HARRIS:
    return 0.35875 + 0.48829 * cos(M_PI * x) + 0.14128 * cos(2 * M_PI * x) + 0.01168 * cos(3 * M_PI * x);
  case FILTER_GAUSSIAN: return exp(-4.5 * x * x);
  }
  return 0;
}

TEST(filters_follow_their_curves)
{
  enum { SIDE = 40, FINE = 50 };
  static double line[SIDE], expected[SIDE * SIDE], counted[SIDE * SIDE];
  for (int kind = FILTER_BOX; kind <= FILTER_GAUSSIAN; kind++) {
    Filter f;
    filter_build(&f, (FilterKind)kind, 2);
    double total = 0;
    for (int i = 0; i < SIDE * FINE; i++)
      total += filter_curve((FilterKind)kind, (2 * i + 1.0) / (SIDE * FINE) - 1);
    for (int i = 0; i < SIDE; i++) {
      line[i] = 0;
      for (int k = i * FINE; k < (i + 1) * FINE; k++)
        line[i] += filter_curve((FilterKind)kind, (2 * k + 1.0) / (SIDE * FINE) - 1) / total;
    }
    for (int i = 0; i < SIDE * SIDE; i++) {
      expected[i] = line[i % SIDE] * line[i / SIDE] * SAMPLES;
      counted[i] = 0;
    }
    for (uint32_t i = 0; i < SAMPLES; i++) {
      float u[3];
      chi_random(i + 1000000u * (uint32_t)kind, u);
      const Vec2 at = filter_sample(&f, (Vec2){u[0], u[1]}); // -1 .. 1
      counted[(int)fminf((at.y + 1) / 2 * SIDE, SIDE - 1) * SIDE +
              (int)fminf((at.x + 1) / 2 * SIDE, SIDE - 1)]++;
    }
    const double p = chi_pearson(expected, counted, SIDE * SIDE, 0, 0);
    CHECK_MSG(p > sidak_level(CASES), "filter %d: p = %g", kind, p);
  }
}

static bool is_in_lens(int32_t blades, double x, double y)
{
  if (blades < 3) return x * x + y * y <= 1;
  const double step = 2 * M_PI / blades, turn = atan2(y, x), from_corner = turn - step * floor(turn / step);
  return hypot(x, y) * cos(from_corner - step / 2) <= cos(step / 2); // the middle of a side is nearest
}

TEST(lenses_are_filled_evenly)
{
  enum { SIDE = 32, FINE = 20 };
  static double expected[SIDE * SIDE], counted[SIDE * SIDE];
  static const int32_t blades[5] = {0, 3, 5, 6, 9};
  for (int c = 0; c < 5; c++) {
    double total = 0;
    for (int i = 0; i < SIDE * SIDE; i++) {
      expected[i] = counted[i] = 0;
      for (int k = 0; k < FINE * FINE; k++)
        expected[i] += is_in_lens(blades[c], ((i % SIDE) + (k % FINE + 0.5) / FINE) / SIDE * 2 - 1,
                                  ((i / SIDE) + (k / FINE + 0.5) / FINE) / SIDE * 2 - 1);
      total += expected[i];
    }
    for (int i = 0; i < SIDE * SIDE; i++) expected[i] *= SAMPLES / total;
    Eye e = {.kind = EYE_PERSPECTIVE,
             .frame = frame_identity(),
             .tan_half_fov = 1,
             .focus = 3,
             .aperture = 0.5f,
             .blades = blades[c]};
    // One corner looks up, to +y, in the eye; turned so that it lies on x, as is_in_lens() has it.
    for (uint32_t i = 0; i < SAMPLES; i++) {
      float u[3];
      chi_random(i + 1000000u * (uint32_t)c, u);
      const Vec3 o = eye_ray(&e, 10, 10, (Vec2){3, 8}, (Vec2){u[0], u[1]}).o / e.aperture;
      const float x = o[1], y = -o[0];
      counted[(int)clamp_f((y + 1) / 2 * SIDE, 0, SIDE - 1) * SIDE +
              (int)clamp_f((x + 1) / 2 * SIDE, 0, SIDE - 1)]++;
    }
    const double p = chi_pearson(expected, counted, SIDE * SIDE, 0, 0);
    CHECK_MSG(p > sidak_level(CASES), "%d blades: p = %g", blades[c], p);
  }
}

TEST_MAIN
