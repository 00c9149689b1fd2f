// IES files: what they mean, what is refused and where, and the light of a lamp that has one.

#include "tests/render_sample.h"

#include "scene/ies.h"
#include "shade/light_sample.h"
#include "tests/chi_square.h"

#include <unistd.h>

#define HEAD "IESNA:LM-63-2002\n[TEST] 1\n[MANUFAC] nobody\nTILT=NONE\n"

static bool read_text(const char *text, Ies *out, Err *err)
{
  *err = (Err){0};
  return ies_read(out, "lamp.ies", text, strlen(text), err);
}

static float at(const Ies *s, uint32_t h, uint32_t v)
{
  return s->candela[h * s->vertical_count + v];
}

TEST(distributions_are_read_and_unfolded)
{
  Ies s;
  Err err;
  // One plane; numbers break over lines anywhere, commas are gaps, factors multiply.
  CHECK(read_text(HEAD "1 1000 2 3\n1 1 1 0,0 0\n0.5 1 50\n0 45\n90\n0\n100 50 25\n\n", &s, &err));
  CHECK_MSG(err.kind == ERR_NONE, "%s", err.text);
  CHECK(s.vertical_count == 3 && s.horizontal_count == 1 && s.peak == 100 && at(&s, 0, 2) == 25);
  ies_finish(&s);
  // A quarter: 0, 45, 90 become 0, 45, ... 360.
  CHECK(read_text(HEAD "1 -1 1 2 3 1 2 0 0 0 1 1 0\n0 180\n0 45 90\n1 2 3 4 5 6\n", &s, &err));
  const float quarter[] = {1, 3, 5, 3, 1, 3, 5, 3, 1};
  CHECK(s.horizontal_count == 9);
  for (uint32_t i = 0; i < 9 && s.horizontal_count == 9; i++)
    CHECK(s.horizontal[i] == 45 * (float)i && at(&s, i, 0) == quarter[i] && at(&s, i, 1) == quarter[i] + 1);
  ies_finish(&s);
  // A half, 0 to 180.
  CHECK(read_text(HEAD "1 -1 1 2 3 1 2 0 0 0 1 1 0\n0 90\n0 60 180\n1 2 3 4 5 6\n", &s, &err));
  const float half_angles[] = {0, 60, 180, 300, 360}, half[] = {1, 3, 5, 3, 1};
  CHECK(s.horizontal_count == 5);
  for (uint32_t i = 0; i < 5 && s.horizontal_count == 5; i++)
    CHECK(s.horizontal[i] == half_angles[i] && at(&s, i, 0) == half[i]);
  ies_finish(&s);
  // The other half, 90 to 270: its mirror image is 270 over 0 to 90.
  CHECK(read_text(HEAD "1 -1 1 2 3 1 2 0 0 0 1 1 0\n0 90\n90 180 270\n1 2 3 4 5 6\n", &s, &err));
  const float side[] = {3, 1, 3, 5, 3};
  CHECK(s.horizontal_count == 5);
  for (uint32_t i = 0; i < 5 && s.horizontal_count == 5; i++)
    CHECK_MSG(s.horizontal[i] == 90 * (float)i && at(&s, i, 0) == side[i], "%u: %g at %g", i, (double)at(&s, i, 0),
              (double)s.horizontal[i]);
  ies_finish(&s);
  // All around.
  CHECK(read_text("IESNA91\r\nTILT=NONE\r\n1 -1 1 2 3 1 2 0 0 0 1 1 0\r\n90 180\r\n0 100 360\r\n1 2 3 4 1 2\r\n\x1a", &s, &err));
  CHECK(s.horizontal_count == 3 && s.peak == 4);
  ies_finish(&s);
}

TEST(what_is_wrong_is_said_with_its_line)
{
  static const struct {
    const char *text, *where, *what;
  } bad[] = {
      {"", "lamp.ies", "first line"},
      {"hello\n", "lamp.ies:1", "IESNA:LM-63-2002"},
      {"IESNA:LM-63-1995\n[A] b\n", "lamp.ies", "TILT=NONE"},
      {"IESNA:LM-63-1995\nTILT=INCLUDE\n", "lamp.ies:2", "INCLUDE"},
      {HEAD "1 -1 1 2 1 1 2 0 0 0 1 1 0\n0 90\n0\n1\n", "lamp.ies", "cut off"},
      {HEAD "1 -1 1 2 1 1 2 0 0 0 1 1 0\n0 90\n0\n1 2 3\n", "lamp.ies:8", "3"},
      {HEAD "1 -1 1 2 1 1 2 0 0 0 1 1 0\n0 90\n0\n1 x\n", "lamp.ies:8", "x"},
      {HEAD "1 -1 1 2 1 1 2 0 0 0 1 1 0\n0 90\n0\n1 -2\n", "lamp.ies:8", "below 0"},
      {HEAD "1 -1 1 2 1 1 2 0 0 0 1 1 0\n0 90\n0\n0 0\n", "lamp.ies", "no light"},
      {HEAD "1 -1 1 2 1 1 2 0 0 0 1 1 0\n90 0\n0\n1 2\n", "lamp.ies:6", "grow"},
      {HEAD "1 -1 1 2 1 1 2 0 0 0 1 1 0\n10 90\n0\n1 2\n", "lamp.ies", "0 or 90"},
      {HEAD "1 -1 1 2 2 1 2 0 0 0 1 1 0\n0 90\n0 70\n1 2 3 4\n", "lamp.ies", "horizontal"},
      {HEAD "1 -1 1 2 1 2 2 0 0 0 1 1 0\n0 90\n0\n1 2\n", "lamp.ies:5", "type 2"},
      {HEAD "1 -1 1 2.5 1 1 2 0 0 0 1 1 0\n", "lamp.ies:5", "whole number"},
      {HEAD "1 -1 1 9999 9999 1 2 0 0 0 1 1 0\n", "lamp.ies:5", "9999"},
      {HEAD "1 -1 0 2 1 1 2 0 0 0 1 1 0\n", "lamp.ies:5", "multiplier"},
      {HEAD "1 -1 1 2 1 1 2 0 0 0 1 1 0\n0 90\n0\nnan 1\n", "lamp.ies:8", "nan"},
  };
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
    Ies s;
    Err err;
    CHECK_MSG(!read_text(bad[i].text, &s, &err) && s.candela == NULL, "%s", bad[i].text);
    CHECK_TEXT(err.text, bad[i].where);
    CHECK_TEXT(err.text, bad[i].what);
  }
  const char *good = HEAD "1 -1 1 2 3 1 2 0 0 0 1 1 0\n0 180\n0 45 90\n1 2 3 4 5 6\n";
  for (long n = 1; n < 20; n++) {
    Ies s;
    Err err;
    mem_fail_after(n);
    const bool ok = read_text(good, &s, &err);
    mem_fail_after(0);
    CHECK(ok || err.kind == ERR_NO_MEMORY);
    ies_finish(&s);
    if (ok) break;
    CHECK(n < 19);
  }
}

// --- lamps in scenes --------------------------------------------------------------------------------
static char folder[] = "/tmp/rayfold-ies-XXXXXX", path[64];

static void write_lamp(const char *text)
{
  if (!*path) {
    CHECK(mkdtemp(folder) != NULL);
    snprintf(path, sizeof path, "%s/lamp.ies", folder);
  }
  FILE *f = fopen(path, "wb");
  CHECK(f && fputs(text, f) >= 0 && !fclose(f));
}

static void remove_lamp(void)
{
  unlink(path);
  rmdir(folder);
}

// Radiant intensity towards unit d, as a surface one metre away has it.
static double intensity(const World *w, Vec3 p, Vec3 d)
{
  LightSample s;
  if (!light_sample(&w->lights, NULL, 0, p + d, v3_all(0), 0.5f, (Vec2){0.5f, 0.5f}, &s)) return 0;
  return (double)s.radiance[0];
}

TEST(a_lamp_shines_as_its_file_says)
{
  // Candela fall from 200 straight down to 0 at the horizontal, four planes of their own.
  write_lamp(HEAD "1 -1 10 3 5 1 2 0 0 0 1 1 0\n0 45 90\n0 90 180 270 360\n20 10 0 20 4 0 20 6 0 20 8 0 20 10 0\n");
  Scene *s = new_scene(0);
  s->allow_outside = true;
  Light *l = add_light(s, LIGHT_POINT);
  set3(l->point.position, 1, 2, 3);
  set3(l->point.intensity, 5, 5, 5);
  l->point.ies = path;
  World *w = world_of(s);
  const Vec3 p = v3(1, 2, 3);
  const float h = sqrtf(0.5f);
  CHECK_NEAR(intensity(w, p, v3(0, -1, 0)), 5, 1e-4); // the brightest has the light's intensity
  CHECK_NEAR(intensity(w, p, v3(h, -h, 0)), 2.5, 1e-3);
  CHECK_NEAR(intensity(w, p, v3(0, -h, -h)), 1, 1e-3); // a quarter turn, counter-clockwise from above
  CHECK_NEAR(intensity(w, p, v3(-h, -h, 0)), 1.5, 1e-3);
  CHECK_NEAR(intensity(w, p, v3(0, -h, h)), 2, 1e-3);
  CHECK(intensity(w, p, v3(0, h, h)) == 0);
  CHECK_NEAR(intensity(w, p, v3_normalize(v3(1, -sqrtf(2), -1))), 1.75, 1e-3); // between two planes
  world_release(w);
  s->lights.items[0].point.ies_rotation = 90;
  w = world_of(s);
  CHECK_NEAR(intensity(w, p, v3(0, -h, -h)), 2.5, 1e-3);
  world_release(w);
  Light *spot = add_light(s, LIGHT_SPOT); // the same about another axis
  set3(spot->spot.position, 0, 0, 0);
  set3(spot->spot.target, 1, 0, 0);
  set3(spot->spot.intensity, 1, 1, 1);
  spot->spot.angle = spot->spot.inner_angle = 60;
  spot->spot.ies = path;
  set3(s->lights.items[0].point.intensity, 0, 0, 0);
  w = world_of(s);
  CHECK_NEAR(intensity(w, v3_all(0), v3(1, 0, 0)), 1, 1e-4);
  double sum = 0;
  for (int i = 0; i < 4; i++) { // on the four planes in some order
    const float a = (float)(i * M_PI / 2);
    sum += intensity(w, v3_all(0), v3(h, h * cosf(a), h * sinf(a)));
  }
  CHECK_NEAR(sum, 0.5 + 0.2 + 0.3 + 0.4, 1e-3);
  CHECK(intensity(w, v3_all(0), v3_normalize(v3(1, 2, 0))) == 0); // outside the cone
  world_release(w);
  scene_destroy(s);
  remove_lamp();
}

// A distribution of candela cos v over the lower half sphere has the power pi I.
TEST(the_power_of_a_lamp)
{
  *path = 0;
  strcpy(folder, "/tmp/rayfold-ies-XXXXXX");
  static char text[20000];
  int n = snprintf(text, sizeof text, HEAD "1 -1 1 181 1 1 2 0 0 0 1 1 0\n");
  for (int i = 0; i <= 180; i++) n += snprintf(text + n, sizeof text - (size_t)n, "%g\n", i / 2.0);
  n += snprintf(text + n, sizeof text - (size_t)n, "0\n");
  for (int i = 0; i <= 180; i++) n += snprintf(text + n, sizeof text - (size_t)n, "%.7g\n", 300 * fabs(cos(i * M_PI / 360)));
  write_lamp(text);
  Scene *s = new_scene(0);
  s->allow_outside = true;
  Light *l = add_light(s, LIGHT_POINT);
  set3(l->point.position, 0, 0, 0);
  set3(l->point.intensity, 2, 2, 2);
  l->point.ies = path;
  World *w = world_of(s);
  double sum = 0;
  const int count = 100000;
  for (uint32_t i = 0; i < (uint32_t)count; i++) {
    float u[3];
    chi_random(i, u);
    sum += intensity(w, v3_all(0), cone_direction(v3(0, 1, 0), 2, (Vec2){unit_float(i * 3242174889u), u[1]}));
  }
  CHECK_NEAR(sum / count * 4 * M_PI / (2 * M_PI), 1, 5e-3);
  CHECK_NEAR(w->lights.emitters[0].mean_map, 0.25, 1e-3); // what it is chosen by
  world_release(w);
  s->lights.items[0].point.ies = "no/such.ies";
  Err err = {0};
  CHECK(!world_prepare(s, NULL, NULL, NULL, NULL, &err));
  CHECK_TEXT(err.text, "lights[0]");
  CHECK_TEXT(err.text, "such.ies");
  scene_destroy(s);
  remove_lamp();
}

TEST_MAIN
