// Kinds of material that are made of others' words: mixes against the mean of their parts, what is refused, the studio's
// sliders over their whole cube, and what dispersion and thin films owe to physics.

#include "tests/render_sample.h"

#include "scene/kinds.h"
#include "scene/mix_check.h"
#include "shade/bsdf.h"
#include "world/translate.h"

// --- mixes ----------------------------------------------------------------------------------------
static int32_t add_mix(Scene *s, int32_t first, int32_t second, float amount)
{
  const int32_t m = scene_add_material(s, MATERIAL_MIX, "mix");
  s->materials.items[m].mix = (Mix){first, second, amount, -1, 0};
  return m;
}

// Mean of a white sky's light off a quad of material m that fills the picture, and a glow's own light.
static Picture look_at(Scene *s, int32_t m, uint32_t spp)
{
  s->objects.items[0].common.material = m;
  World *w = world_of(s);
  Film *f = film_create(8, 8, ALL_PLANES, NULL);
  RenderJob job = job_of(s, w, pinhole(0, 0, 4, 0, 0, 0, 20), f, spp);
  CHECK(render_run(&job, NULL, hot_table(ISA_REF), NULL, NULL, NULL));
  const Picture p = summarize(f);
  film_destroy(f);
  world_release(w);
  return p;
}

TEST(a_mix_is_the_mean_of_its_parts)
{
  Scene *s = new_scene(1);
  add_quad(s, -1, 0, 0, 0, 0, 0, 8);
  const int32_t red = add_lambert(s, 0.8f, 0.1f, 0.1f), glow = add_glow(s, 3, true), metal = add_pbr(s, 0.9f, 0.3f);
  s->materials.items[metal].pbr.metallic = 1;
  const int32_t inner = add_mix(s, red, glow, 0.25f), outer = add_mix(s, inner, metal, 0.5f);
  const Picture a = look_at(s, red, 64), b = look_at(s, glow, 4), c = look_at(s, metal, 64);
  const Picture got = look_at(s, inner, 256), deep = look_at(s, outer, 256);
  for (int k = 0; k < 3; k++) {
    const double want = 0.75 * (double)a.mean[k] + 0.25 * (double)b.mean[k];
    CHECK_NEAR(got.mean[k], want, 6 * got.error + 0.004);
    CHECK_NEAR(deep.mean[k], 0.5 * want + 0.5 * (double)c.mean[k], 6 * deep.error + 0.004);
  }
  scene_destroy(s);
}

// Textures of its parts are laid out as they are on these alone: noise in space, which needs the place.
TEST(a_mix_of_textured_parts)
{
  Scene *s = new_scene(1);
  add_quad(s, -1, 0.3f, 0.2f, 0, 0, 0, 8);
  const int32_t plain = add_lambert(s, 1, 1, 1), t = scene_add_texture(s, TEXTURE_NOISE, "noise");
  s->textures.items[t].noise = (TextureNoise){.space = 1, .size = 0.7f, .octaves = 3, .lacunarity = 2, .persistence = 0.5f,
                                              .contrast = 3, .color_b = {1, 1, 1}};
  s->materials.items[plain].lambert.albedo_texture = t;
  const int32_t mix = add_mix(s, plain, plain, 0.5f);
  const Picture want = look_at(s, plain, 64), got = look_at(s, mix, 64);
  CHECK(want.most > want.least + 0.3f);
  CHECK_NEAR(got.most, want.most, 0.02);
  CHECK_NEAR(got.least, want.least, 0.02);
  CHECK_NEAR(got.mean[0], want.mean[0], 0.01);
  scene_destroy(s);
}

TEST(circles_and_depths_are_refused_by_name)
{
  Err err = {0};
  Scene *s = scene_create(NULL);
  int32_t m = add_lambert(s, 1, 1, 1);
  for (int i = 0; i < MIX_DEEPEST; i++) m = add_mix(s, m, m, 0.5f);
  CHECK(mix_check(s, NULL, -1, NULL, NULL, &err));
  add_mix(s, -1, m, 0.5f);
  CHECK(!mix_check(s, NULL, -1, NULL, NULL, &err));
  CHECK_TEXT(err.text, "more than 4 deep");
  s->materials.count = 3;
  s->materials.items[1].mix.second = 2;
  int32_t at;
  const char *field;
  err = (Err){0};
  CHECK(!mix_check(s, NULL, -1, &at, &field, &err) && at == 1 && !strcmp(field, "second"));
  CHECK_TEXT(err.text, "must not contain itself: \"mix\" -> \"mix.2\" -> \"mix\"");
  CHECK(!world_prepare(s, NULL, NULL, NULL, NULL, NULL));
  scene_destroy(s);
}

// --- the studio's sliders -------------------------------------------------------------------------
static float slider(Studio *m, int which, float value)
{
  float *at[] = {&m->reflection, &m->direct_to_scatter, &m->specular, &m->roughness, &m->metallic};
  return value < 0 ? *at[which] : (*at[which] = value);
}

// Every place of the cube gives fields in pbr's ranges, and each slider moves what it is for in one direction.
TEST(the_studios_sliders_are_monotone_and_in_range)
{
  enum { STEPS = 5 };
  Material fresh;
  group_default(&group_material, MATERIAL_STUDIO, &fresh);
  int places = 0;
  for (int i = 0; i < STEPS * STEPS * STEPS * STEPS * STEPS; i++, places++) {
    Studio m = fresh.studio;
    for (int k = 0, rest = i; k < 5; k++, rest /= STEPS) slider(&m, k, (float)(rest % STEPS) / (STEPS - 1));
    const Pbr p = pbr_of_studio(&m);
    const float f0 = p.specular * p.specular_color[0] * 0.04f;
    CHECK(f0 >= 0 && f0 <= p.specular * 1.0001f && p.specular <= 1 && p.base_color[0] <= 0.7f && p.metallic <= 1);
    for (int k = 0; k < 5; k++) {
      Studio more = m;
      if (slider(&m, k, -1) >= 1) continue;
      slider(&more, k, slider(&m, k, -1) + 0.25f);
      const Pbr q = pbr_of_studio(&more);
      const float g0 = q.specular * q.specular_color[0] * 0.04f;
      CHECK(g0 >= f0 - 1e-6f && q.specular >= p.specular && q.roughness >= p.roughness && q.metallic >= p.metallic);
      CHECK(q.base_color[0] >= p.base_color[0]);
      const bool moves[] = {g0 > f0 || m.reflection >= 1, q.base_color[0] > p.base_color[0],
                            q.specular > p.specular || m.reflection >= 1, q.roughness > p.roughness,
                            q.metallic > p.metallic};
      CHECK(moves[k]);
    }
  }
  CHECK(places == 3125);
}

// --- principled -----------------------------------------------------------------------------------
TEST(principled_says_what_blender_means)
{
  Material fresh;
  group_default(&group_material, MATERIAL_PRINCIPLED, &fresh);
  Principled m = fresh.principled;
  Pbr p = pbr_of_principled(&m);
  CHECK_NEAR(p.specular * p.specular_color[0] * 0.04f, 0.04, 1e-6); // specular 0.5 is ior 1.5
  CHECK(p.anisotropy == 0 && fabsf(p.roughness - m.roughness) < 1e-6f);
  m.anisotropic = 0.8f;
  m.roughness = 0.4f;
  p = pbr_of_principled(&m);
  const double narrow = (double)(p.roughness * p.roughness);
  const double wide = narrow + (1 - narrow) * (double)(p.anisotropy * p.anisotropy);
  CHECK_NEAR(wide * narrow, 0.16 * 0.16, 1e-5); // Burley 2012: the product of the widths stays
  CHECK_NEAR(narrow / wide, 1 - 0.9 * 0.8, 1e-5);
}

// --- dispersion -----------------------------------------------------------------------------------
// Three white paths, one of each colour, bring together what no path could bring alone, and no more than all.
TEST(the_colours_of_dispersed_light_add_up)
{
  Scene *s = scene_create(NULL);
  const int32_t g = scene_add_material(s, MATERIAL_GLASS, "glass");
  s->materials.items[g].glass.dispersion = 2;
  add_sphere(s, g, 0, 0, 0, 1);
  World *w = world_of(s);
  const SurfacePoint at = {.ng = v3(0, 0, 1), .n = v3(0, 0, 1), .tangent = v3(1, 0, 0), .tangent_sign = 1,
                           .color = {1, 1, 1, 1}};
  const Vec3 wo = v3_normalize(v3(0.6f, 0, 0.8f));
  Vec3 sum = v3_all(0);
  float bend[3] = {0};
  for (int band = 0; band < 3; band++) {
    Bsdf b;
    material_bsdf(&w->materials[0], w->textures, &at, wo, &b);
    bsdf_disperse(&w->materials[0], band, true, &b);
    BsdfSample out;
    for (int i = 0; i < 4000; i++) {
      if (!bsdf_sample(&b, wo, ((float)i + 0.5f) / 4000, (Vec2){0.5f, 0.5f}, &out)) continue;
      sum += out.weight * (out.is_transmission ? b.eta * b.eta : 1) / (3 * 4000);
      if (out.is_transmission) bend[band] = fabsf(out.wl[0]);
    }
    CHECK_NEAR(bend[band], 0.6 / (1.5 + (band - 1) * 0.025), 1e-6); // Snell, indices of KHR_materials_dispersion
  }
  for (int k = 0; k < 3; k++) CHECK_NEAR(sum[k], 1, 2e-3);
  CHECK(bend[0] > bend[1] && bend[1] > bend[2]); // blue is bent most
  world_release(w);
  scene_destroy(s);
}

// --- thin films -----------------------------------------------------------------------------------
// Colours of a film against a sum over wavelengths of the same interference, seen by eyes given by another fit: the
// sums of Gaussians of Wyman, Sloan and Shirley 2013 (JCGT 2(2), listing 1).
static double bell(double x, double mean, double low, double high)
{
  const double t = (x - mean) * (x < mean ? low : high);
  return exp(-0.5 * t * t);
}

static void eye_at(double nm, double xyz[3])
{
  xyz[0] = 0.362 * bell(nm, 442.0, 0.0624, 0.0374) + 1.056 * bell(nm, 599.8, 0.0264, 0.0323) -
           0.065 * bell(nm, 501.1, 0.0490, 0.0382);
  xyz[1] = 0.821 * bell(nm, 568.8, 0.0213, 0.0247) + 0.286 * bell(nm, 530.9, 0.0613, 0.0322);
  xyz[2] = 1.217 * bell(nm, 437.0, 0.0845, 0.0278) + 0.681 * bell(nm, 459.0, 0.0385, 0.0725);
}

TEST(film_colours_are_those_of_the_spectrum)
{
  static const double to_rgb[3][3] = {{3.2404542, -1.5371385, -0.4985314},
                                      {-0.9692660, 1.8760108, 0.0415560},
                                      {0.0556434, -0.2040259, 1.0572252}};
  double worst = 0;
  for (int d = 0; d <= 1500; d += 50) {
    double sum[3] = {0}, whole[3] = {0};
    for (double nm = 360; nm <= 830; nm++) {
      double xyz[3];
      eye_at(nm, xyz);
      for (int k = 0; k < 3; k++) {
        sum[k] += xyz[k] * cos(2 * M_PI * d / nm);
        whole[k] += xyz[k];
      }
    }
    const Vec3 got = film_sensitivity((float)d, v3_all(0));
    for (int k = 0; k < 3; k++) {
      double rgb = 0, white = 0;
      for (int j = 0; j < 3; j++) {
        rgb += to_rgb[k][j] * sum[j] / whole[j];
        white += to_rgb[k][j];
      }
      worst = fmax(worst, fabs(rgb / white - (double)got[k]));
    }
  }
  printf("  worst difference %.3f\n", worst);
  CHECK(worst < 0.13); // the fits differ by that much where blue and green share; without the orders it is 1
}

TEST(a_film_of_no_thickness_is_no_film)
{
  for (int i = 0; i < 20; i++) {
    const float f0 = 0.04f + 0.9f * (float)i / 20;
    const ThinFilm f = thin_film(1, 1.4f, 1e-3f, v3_all(f0));
    const Vec3 r = film_reflectance(&f, 0.9f);
    CHECK_NEAR(r[0], f0 + (1 - f0) * fresnel_schlick(0.9f), 0.02);
    CHECK_NEAR(r[0], r[2], 1e-3);
  }
}

TEST_MAIN
