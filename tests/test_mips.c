// Mips and footprints: levels keep the mean, filtered lookups of what is linear are exact, patterns are the mean over
// their box, and a floor to the horizon is its analytic mean.

#include "tests/render_sample.h"

#include "base/hash.h"
#include "geom/footprint.h"
#include "image/mips.h"
#include "geom/sphere.h"
#include "shade/texture_lookup.h"

static void make(Mips *m, const Image *img, MipsMeaning meaning)
{
  CHECK(mips_begin(m, img));
  for (uint32_t i = 0; i < m->count; i++) mips_rows(m, img, meaning, i, 0, m->levels[i].height);
}

static double linear_value(const Image *img, uint32_t x, uint32_t y, uint32_t c, bool is_srgb)
{
  const float v = image_value(img, x, y, c);
  return (double)(is_srgb ? srgb_decode(v) : v);
}

static double mean_of(const Image *img, uint32_t c, bool is_srgb)
{
  double sum = 0;
  for (uint32_t y = 0; y < img->height; y++)
    for (uint32_t x = 0; x < img->width; x++) sum += linear_value(img, x, y, c, is_srgb);
  return sum / ((double)img->width * img->height);
}

static void fill(Image *img, uint32_t seed)
{
  const size_t n = (size_t)img->width * img->height * img->channels;
  for (size_t i = 0; i < n; i++) {
    const uint32_t h = hash_combine(seed, (uint32_t)i);
    if (img->type == PIXEL_U8) ((uint8_t *)img->pixels)[i] = (uint8_t)h;
    if (img->type == PIXEL_U16) ((uint16_t *)img->pixels)[i] = (uint16_t)h;
    if (img->type == PIXEL_F32) ((float *)img->pixels)[i] = 10 * unit_float(h);
  }
}

TEST(every_level_has_the_mean_of_the_picture)
{
  static float pixels[4 * 97 * 64];
  static const uint32_t sizes[][2] = {{64, 64}, {97, 61}, {33, 5}, {1, 7}, {3, 3}, {5, 1}, {2, 1}};
  for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++)
    for (int type = PIXEL_U8; type <= PIXEL_F32; type++) {
      if (type == PIXEL_F16) continue; // shares all but two lines with F32
      const bool is_srgb = type == PIXEL_U8 || type == PIXEL_U16;
      Image img = {sizes[i][0], sizes[i][1], 3, (PixelType)type, pixels};
      fill(&img, (uint32_t)i);
      Mips m;
      make(&m, &img, (MipsMeaning){is_srgb, false});
      CHECK(m.count > 0 && m.levels[m.count - 1].width == 1 && m.levels[m.count - 1].height == 1);
      // A code of sRGB is at most 1/111 of light wide; a level is rounded once, and inherits the roundings above it.
      const double bound = type == PIXEL_U8 ? 1.0 / 111 : type == PIXEL_U16 ? 1.0 / 111 / 257 : 1e-5;
      for (uint32_t l = 0; l < m.count; l++)
        for (uint32_t c = 0; c < 3; c++) CHECK_NEAR(mean_of(&m.levels[l], c, is_srgb), mean_of(&img, c, is_srgb), bound);
      mips_finish(&m);
    }
}

TEST(what_lies_in_holes_does_not_bleed_out)
{
  uint8_t rgba[2 * 2 * 4] = {255, 0, 0, 255, 0, 255, 0, 0, 0, 255, 0, 0, 0, 255, 0, 0};
  const Image img = {2, 2, 4, PIXEL_U8, rgba};
  Mips m;
  make(&m, &img, (MipsMeaning){true, true});
  const uint8_t *p = m.levels[0].pixels;
  CHECK(m.count == 1 && p[0] == 255 && p[1] == 0 && p[2] == 0 && p[3] == 64);
  mips_finish(&m);
  make(&m, &img, (MipsMeaning){false, false});
  p = m.levels[0].pixels;
  CHECK(p[0] == 64 && p[1] == 191 && p[3] == 64);
  mips_finish(&m);
}

TEST(broken_texels_cost_only_themselves)
{
  float pixels[4] = {NAN, INFINITY, 2, 4};
  const Image img = {2, 2, 1, PIXEL_F32, pixels};
  Mips m;
  make(&m, &img, (MipsMeaning){0});
  CHECK(((float *)m.levels[0].pixels)[0] == 1.5f);
  mips_finish(&m);
}

// --- lookups ------------------------------------------------------------------------------------------
// A place in a plane whose uv are its x and y, seen with these axes.
static SurfacePoint place(float u, float v, Vec3 major, Vec3 minor)
{
  SurfacePoint s = {.uv = {{u, v}, {u, v}}, .p = v3(u, v, 0), .ng = v3(0, 0, 1), .major = major, .minor = minor};
  s.grad_u[0] = s.grad_u[1] = v3(1, 0, 0);
  s.grad_v[0] = s.grad_v[1] = v3(0, 1, 0);
  return s;
}

static TextureMap map_of(const Image *img, const Mips *m)
{
  return (TextureMap){.image = *img,
                      .levels = m->levels,
                      .level_count = m->count,
                      .wrap_u = TEXTURE_CLAMP,
                      .wrap_v = TEXTURE_CLAMP,
                      .uv_map = {{1, 0, 0}, {0, 1, 0}},
                      .gain = {1, 1, 1},
                      .alpha_gain = 1};
}

TEST(a_filtered_ramp_is_the_ramp)
{
  enum { SIDE = 256 };
  static float pixels[SIDE * SIDE];
  for (uint32_t y = 0; y < SIDE; y++)
    for (uint32_t x = 0; x < SIDE; x++) pixels[y * SIDE + x] = ((float)x + 0.5f) / SIDE + ((float)(SIDE - y) - 0.5f) / SIDE;
  const Image img = {SIDE, SIDE, 1, PIXEL_F32, pixels};
  Mips m;
  make(&m, &img, (MipsMeaning){0});
  TextureMap t = map_of(&img, &m);
  for (uint32_t i = 0; i < 4000; i++) {
    const float angle = 7 * unit_float(hash_u32(i)), size = 0.0005f * f_exp(5.5f * unit_float(hash_u32(i + 9999)));
    const float thin = unit_float(hash_u32(i + 77777));
    const Vec3 along = v3(f_cos(angle), f_sin(angle), 0), across = v3(-along[1], along[0], 0);
    const float u = 0.3f + 0.4f * unit_float(hash_u32(2 * i)), v = 0.3f + 0.4f * unit_float(hash_u32(2 * i + 1));
    const SurfacePoint s = place(u, v, size * along, size * thin * across);
    t.minify = i & 1 ? TEXTURE_TRILINEAR : TEXTURE_ANISOTROPIC;
    float rgba[4];
    texture_lookup(&t, &s, rgba);
    CHECK_NEAR(rgba[0], u + v, 3e-6);
  }
  mips_finish(&m);
}

// Around it an ellipse has the mean of a texture that does not change along the longer axis.
TEST(a_long_ellipse_stays_sharp_across)
{
  enum { SIDE = 256 };
  static uint8_t pixels[SIDE * SIDE];
  for (uint32_t y = 0; y < SIDE; y++)
    for (uint32_t x = 0; x < SIDE; x++) pixels[y * SIDE + x] = x / 16 & 1 ? 255 : 0;
  const Image img = {SIDE, SIDE, 1, PIXEL_U8, pixels};
  Mips m;
  make(&m, &img, (MipsMeaning){0});
  TextureMap t = map_of(&img, &m);
  float rgba[4];
  const SurfacePoint s = place(24.0f / SIDE, 0.5f, v3(0, 32.0f / SIDE, 0), v3(4.0f / SIDE, 0, 0)); // 1 : 8
  texture_lookup(&t, &s, rgba);
  CHECK(rgba[0] == 1); // the middle of a stripe
  t.minify = TEXTURE_TRILINEAR;
  texture_lookup(&t, &s, rgba);
  CHECK(rgba[0] > 0.4f && rgba[0] < 0.6f);
  mips_finish(&m);
}

// Conjugate axes that are not the ellipse's own: a sheared uv map.
TEST(axes_of_an_ellipse)
{
  for (uint32_t i = 0; i < 2000; i++) {
    float x[4];
    for (uint32_t k = 0; k < 4; k++) x[k] = 2 * unit_float(hash_combine(i, k)) - 1;
    TextureSpot s = {0};
    spot_ellipse(&s, (Vec2){x[0], x[1]}, (Vec2){x[2], x[3]});
    const double l2 = (double)(s.length * s.length), w2 = (double)(s.width * s.width);
    const double ax = (double)s.along.x, ay = (double)s.along.y;
    CHECK(s.length >= s.width);
    CHECK_NEAR(ax * ax + ay * ay, 1, 1e-5);
    // along along' length^2 + across across' width^2 is the matrix again.
    CHECK_NEAR(l2 * ax * ax + w2 * ay * ay, (double)(x[0] * x[0] + x[2] * x[2]), 2e-5);
    CHECK_NEAR((l2 - w2) * ax * ay, (double)(x[0] * x[1] + x[2] * x[3]), 2e-5);
  }
}

// --- patterns -----------------------------------------------------------------------------------------
static double mean_over_box(const TextureMap *t, Vec2 at, Vec2 width)
{
  enum { N = 400 };
  double sum = 0;
  for (int j = 0; j < N; j++)
    for (int i = 0; i < N; i++) {
      const Vec2 p = {at.x + width.x * (((float)i + 0.5f) / N - 0.5f), at.y + width.y * (((float)j + 0.5f) / N - 0.5f)};
      sum += (double)texture_flat_pattern(t, p, (Vec2){0, 0});
    }
  return sum / N / N;
}

TEST(patterns_are_the_mean_over_a_box)
{
  static const uint8_t kinds[] = {TEXTURE_MAP_CHECKER, TEXTURE_MAP_BRICK, TEXTURE_MAP_WAVE, TEXTURE_MAP_GRADIENT};
  for (size_t k = 0; k < sizeof kinds; k++)
    for (uint32_t i = 0; i < 24; i++) {
      TextureMap t = {.kind = kinds[k], .length = 2, .mortar = 0.1f, .stagger = 0.5f, .wrap_u = (uint8_t)(i % 3)};
      const Vec2 at = {8 * unit_float(hash_u32(i)) - 4, 8 * unit_float(hash_u32(i + 100)) - 4};
      Vec2 width = {4 * unit_float(hash_u32(i + 200)), 4 * unit_float(hash_u32(i + 300))};
      if (t.kind == TEXTURE_MAP_BRICK) width.y *= 0.05f; // several courses are taken for one
      if (t.kind == TEXTURE_MAP_BRICK && floorf(at.y - width.y) != floorf(at.y + width.y)) continue;
      CHECK_NEAR(texture_flat_pattern(&t, at, width), mean_over_box(&t, at, width), 0.006);
    }
}

TEST(noise_is_smooth_and_fades_to_its_mean)
{
  TextureMap t = {.kind = TEXTURE_MAP_NOISE, .frequency = 1, .lacunarity = 2, .persistence = 0.5f, .contrast = 1,
                  .octaves = 5, .seed = 3};
  double sum = 0, squares = 0;
  float most = 0;
  for (uint32_t i = 0; i < 20000; i++) {
    const Vec3 p = v3(1000 * unit_float(hash_u32(i)), 1000 * unit_float(hash_u32(i + 50000)), 0.5f);
    const float n = pattern_noise(&t, p, 0);
    sum += (double)n;
    squares += (double)n * (double)n;
    most = max_f(most, fabsf(pattern_noise(&t, p + v3(1e-4f, 0, 0), 0) - n));
    CHECK(n >= 0 && n <= 1);
    CHECK(pattern_noise(&t, p, 1) == 0.5f); // one feature a pixel: nothing is left
  }
  const double mean = sum / 20000, deviation = sqrt(squares / 20000 - mean * mean);
  CHECK_NEAR(mean, 0.5, 0.005);
  CHECK_MSG(deviation > 0.08 && deviation < 0.25, "%g", deviation);
  CHECK_MSG(most < 2e-3f, "%g", (double)most); // five octaves of slope at most about 2 each
  t.octaves = 1;
  CHECK(pattern_noise(&t, v3(3, -5, 7), 0) == 0.5f); // zero at whole places
}

// --- footprints ---------------------------------------------------------------------------------------
TEST(gradients_of_shapes_are_those_of_their_coordinates)
{
  const Frame f = frame_identity();
  for (uint32_t i = 0; i < 300; i++) {
    const float h = 1.6f * unit_float(hash_u32(i)) - 0.8f, a = 6 * unit_float(hash_u32(i + 999)) - 3;
    const float around = sqrtf(1 - h * h);
    const Vec3 p = 2 * v3(around * f_sin(a), h, around * f_cos(a));
    SurfacePoint s = {.p = p, .object_p = p, .ng = p / 2};
    footprint_of_sphere(&s, &f);
    const Vec2 uv = sphere_uv(2, p);
    const Vec3 step = 1e-3f * v3_normalize(v3_cross(s.ng, v3(1, 2, (float)i)));
    const Vec2 moved = sphere_uv(2, 2 * v3_normalize(p + step));
    if (fabsf(moved.x - uv.x) > 0.5f) continue; // across the seam
    CHECK_NEAR(v3_dot(s.grad_u[0], step), moved.x - uv.x, 2e-6);
    CHECK_NEAR(v3_dot(s.grad_v[0], step), moved.y - uv.y, 2e-6);
  }
}

// --- a floor to the horizon -----------------------------------------------------------------------------
enum { FLOOR_WIDTH = 96, FLOOR_HEIGHT = 64, HORIZON = FLOOR_HEIGHT / 2 };

static float *floor_albedo(int32_t spp, Picture *all)
{
  Scene *s = new_scene(1);
  const int32_t texture = scene_add_texture(s, TEXTURE_CHECKER, "checker"), m = add_lambert(s, 1, 1, 1);
  Texture *t = &s->textures.items[texture];
  set3(t->checker.color_a, 1, 1, 1);
  set3(t->checker.color_b, 0, 0, 0);
  t->common.scale[0] = t->common.scale[1] = 20000; // fields of half a metre
  t->common.rotation = 25;
  s->materials.items[m].lambert.albedo_texture = texture;
  add_quad(s, m, 0, 0, 0, -90, 0, 20000);
  s->render.integrator = INTEGRATOR_ALBEDO;
  World *w = world_of(s);
  Film *film = film_create(FLOOR_WIDTH, FLOOR_HEIGHT, ALL_PLANES, NULL);
  const RenderJob job = job_of(s, w, pinhole(0, 1, 0, 0, 1, -1, 50), film, (uint32_t)spp);
  CHECK(render_run(&job, NULL, hot_table(cpu_best_isa()), NULL, NULL, NULL));
  float *rgba = mem_alloc((size_t)4 * FLOOR_WIDTH * FLOOR_HEIGHT, sizeof *rgba);
  CHECK(film_resolve(film, FILM_BEAUTY, rgba));
  *all = summarize(film);
  film_destroy(film);
  world_release(w);
  scene_destroy(s);
  return rgba;
}

// In the second and third row below the horizon a pixel covers 10 periods and more of the fields along the view. With
// one sample a pixel is off the mean by at most 6 % of the fields' difference and in rms by 1 % (an unfiltered one: 50 %).
TEST(a_floor_to_the_horizon_has_no_moire)
{
  Picture all;
  float *rgba = floor_albedo(1, &all);
  double squares = 0, worst = 0;
  for (int y = HORIZON + 1; y < HORIZON + 3; y++)
    for (int x = 0; x < FLOOR_WIDTH; x++) {
      const double off = (double)rgba[4 * (y * FLOOR_WIDTH + x)] - 0.5;
      squares += off * off;
      worst = fmax(worst, fabs(off));
    }
  const double rms = sqrt(squares / (2 * FLOOR_WIDTH));
  CHECK_MSG(worst < 0.06 && rms < 0.01, "worst %g, rms %g", worst, rms);
  mem_free(rgba);
}

TEST_MAIN
