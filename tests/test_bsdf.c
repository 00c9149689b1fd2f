// BSDFs against physics: densities that match the samples, energy, reciprocity, Snell and Fresnel; and how materials
// and surface points become them. Sizes are for every build; sanitizers run a part of them.

#include "tests/test.h"

#include "shade/bsdf.h"
#include "tests/chi_square.h"

enum { SCALE = TEST_IS_SLOW ? 8 : 1 };

// --- materials to test ----------------------------------------------------------------------------
static const TextureRef no_map = {-1, 0};

static SurfaceMaterial material_of(SurfaceKind kind)
{
  return (SurfaceMaterial){.kind = (uint8_t)kind,
                           .is_double_sided = true,
                           .color = v3_all(1),
                           .opacity = 1,
                           .specular_color = v3_all(1),
                           .ior = 1.5f,
                           .specular = 1,
                           .normal_scale = 1,
                           .alpha_cutoff = 0.5f,
                           .color_map = no_map,
                           .opacity_map = no_map,
                           .metallic_map = no_map,
                           .roughness_map = no_map,
                           .normal_map = no_map, .bump_map = no_map,
                           .emission_map = no_map,
                           .specular_map = no_map,
                           .specular_color_map = no_map,
                           .transmission_map = no_map,
                           .clearcoat_map = no_map,
                           .clearcoat_roughness_map = no_map,
                           .film_ior = 1.3f,
                           .sheen_color_map = no_map,
                           .sheen_roughness_map = no_map,
                           .anisotropy_map = no_map,
                           .iridescence_map = no_map,
                           .film_map = no_map,
                           .mix_map = no_map};
}

static SurfaceMaterial pbr(Vec3 color, float metallic, float roughness)
{
  SurfaceMaterial m = material_of(SURFACE_PBR);
  m.color = color;
  m.metallic = metallic;
  m.roughness = roughness;
  return m;
}

static SurfaceMaterial coated(SurfaceMaterial m, float coat, float roughness)
{
  m.clearcoat = coat;
  m.clearcoat_roughness = roughness;
  return m;
}

static SurfaceMaterial glassy(float transmission, float roughness, float ior, bool is_thin)
{
  SurfaceMaterial m = pbr(v3(0.9f, 1, 0.8f), 0, roughness);
  m.transmission = transmission;
  m.ior = ior;
  m.is_thin_walled = is_thin;
  return m;
}

static SurfaceMaterial glass(float roughness, float ior)
{
  SurfaceMaterial m = material_of(SURFACE_GLASS);
  m.roughness = roughness;
  m.ior = ior;
  return m;
}

static SurfaceMaterial velvet(SurfaceMaterial m, Vec3 color, float roughness)
{
  m.has_extras = true;
  m.sheen_color = color;
  m.sheen_roughness = roughness;
  return m;
}

static SurfaceMaterial brushed(SurfaceMaterial m, float strength, float turn)
{
  m.has_extras = true;
  m.anisotropy = strength;
  m.anisotropy_turn = turn;
  return m;
}

static SurfaceMaterial filmed(SurfaceMaterial m, float weight, float ior, float nanometres)
{
  m.has_extras = true;
  m.iridescence = weight;
  m.film_ior = ior;
  m.film_least = m.film_most = nanometres;
  return m;
}

static SurfaceMaterial dispersive(SurfaceMaterial m, float dispersion)
{
  m.dispersion = dispersion;
  return m;
}

static SurfaceMaterial phong(float diffuse, float specular, float exponent)
{
  SurfaceMaterial m = material_of(SURFACE_PHONG);
  m.color = v3_all(diffuse);
  m.specular_color = v3_all(specular);
  m.distribution = GLOSS_PHONG;
  m.gloss_width = exponent;
  m.gloss_f0 = v3_all(1);
  return m;
}

// Of a gaussian, c is set by hand: 1 over its integral of cosines.
static SurfaceMaterial facets(GlossKind kind, float diffuse, float f0, float width)
{
  SurfaceMaterial m = phong(diffuse, 1 - diffuse, width);
  m.kind = SURFACE_COOK_TORRANCE;
  m.distribution = (uint8_t)kind;
  m.gloss_f0 = v3_all(f0);
  double sum = 0;
  for (int i = 0; i < 5000; i++) {
    const double a = M_PI / 2 * (i + 0.5) / 5000;
    sum += exp(-a * a / (double)(width * width)) * sin(a) * cos(a) * M_PI * M_PI / 5000;
  }
  m.gloss_c = (float)(1 / sum);
  return m;
}

// Facing +y, so that the normal lies on the axis of the chi-square cells.
static SurfacePoint point_facing_up(bool is_back)
{
  const Vec3 up = v3(0, 1, 0);
  return (SurfacePoint){.ng = up,
                        .n = up,
                        .tangent = v3(1, 0, 0),
                        .tangent_sign = 1,
                        .color = {1, 1, 1, 1},
                        .is_back = is_back};
}

static Vec3 towards(float cosine, float phi)
{
  const float sine = safe_sqrt(1 - cosine * cosine);
  return v3(sine * f_cos(phi), cosine, sine * f_sin(phi));
}

static Bsdf bsdf_of(const SurfaceMaterial *m, Vec3 wo)
{
  const SurfacePoint s = point_facing_up(wo[1] < 0);
  Bsdf b;
  material_bsdf(m, NULL, &s, wo, &b);
  bsdf_disperse(m, 2, true, &b); // as a white path that has drawn blue
  return b;
}

enum { MOST_MATERIALS = 64 };

typedef struct Named {
  const char *name;
  SurfaceMaterial m;
} Named;

static SurfaceMaterial mirror(float roughness)
{
  SurfaceMaterial m = material_of(SURFACE_MIRROR);
  m.color = v3(0.9f, 0.8f, 0.7f);
  m.roughness = roughness;
  return m;
}

// What few materials have; looked at from all sides at night only.
static int rare_materials(Named out[MOST_MATERIALS])
{
  const Vec3 gold = v3(1, 0.77f, 0.34f), grey = v3(0.5f, 0.6f, 0.7f);
  const Named all[] = {{"velvet", velvet(pbr(grey, 0, 0.8f), v3(1, 0.8f, 0.3f), 0.4f)},
                       {"satin over metal", coated(velvet(pbr(gold, 1, 0.4f), v3_all(0.7f), 0.2f), 0.6f, 0.3f)},
                       {"velvet glass", velvet(glassy(0.8f, 0.4f, 1.5f, false), v3_all(1), 0.7f)},
                       {"velvet sheet", velvet(glassy(0.8f, 0.6f, 1.5f, true), v3_all(1), 0.5f)},
                       {"brushed metal", brushed(pbr(gold, 1, 0.3f), 0.7f, 0.6f)},
                       {"brushed plastic", brushed(pbr(grey, 0, 0.35f), 0.9f, 2)},
                       {"brushed glass", brushed(glassy(1, 0.4f, 1.5f, false), 0.6f, 1)},
                       {"oily metal", filmed(pbr(gold, 1, 0.3f), 0.8f, 1.5f, 450)},
                       {"oily plastic", filmed(pbr(grey, 0, 0.3f), 1, 1.8f, 300)},
                       {"oily glass", filmed(glassy(1, 0.4f, 1.5f, false), 1, 1.9f, 500)},
                       {"bubble", filmed(glassy(1, 0.4f, 1.5f, true), 1, 1.33f, 400)},
                       {"prism", dispersive(glassy(1, 0.3f, 1.7f, false), 2)},
                       {"phong 30", phong(0.5f, 0.5f, 30)},
                       {"phong 2", phong(0.2f, 0.8f, 2)},
                       {"beckmann", facets(GLOSS_BECKMANN, 0.4f, 0.2f, 0.3f)},
                       {"gaussian", facets(GLOSS_GAUSSIAN, 0.3f, 0.9f, 0.5f)}};
  memcpy(out, all, sizeof all);
  return (int)(sizeof all / sizeof *all);
}

static int rough_materials(Named out[MOST_MATERIALS])
{
  const Vec3 gold = v3(1, 0.77f, 0.34f), grey = v3(0.5f, 0.6f, 0.7f);
  SurfaceMaterial lambert = material_of(SURFACE_LAMBERT), tinted = pbr(grey, 0, 0.3f);
  tinted.specular = 0.6f;
  tinted.specular_color = v3(1, 0.5f, 2);
  const Named all[] = {{"lambert", lambert},
                       {"metal 0.2", pbr(gold, 1, 0.2f)},
                       {"metal 0.5", pbr(gold, 1, 0.5f)},
                       {"metal 1", pbr(gold, 1, 1)},
                       {"plastic 0", pbr(grey, 0, 0)},
                       {"plastic 0.25", pbr(grey, 0, 0.25f)},
                       {"plastic 0.8", pbr(grey, 0, 0.8f)},
                       {"mirror 0.45", mirror(0.45f)},
                       {"half metal", pbr(grey, 0.5f, 0.4f)},
                       {"tinted specular", tinted},
                       {"coated plastic", coated(pbr(grey, 0, 0.6f), 1, 0.2f)},
                       {"coated metal", coated(pbr(gold, 1, 0.4f), 0.7f, 0)},
                       {"glass 0.3", glass(0.3f, 1.5f)},
                       {"glass 0.7", glass(0.7f, 1.3f)},
                       {"pbr glass 0.4", glassy(1, 0.4f, 1.5f, false)},
                       {"half glass", coated(glassy(0.5f, 0.5f, 1.8f, false), 0.5f, 0.3f)},
                       {"thin", glassy(1, 0.5f, 1.5f, true)},
                       {"coated thin", coated(glassy(0.7f, 0.7f, 1.4f, true), 1, 0.25f)}};
  memcpy(out, all, sizeof all);
  return (int)(sizeof all / sizeof *all);
}

// --- sampling -------------------------------------------------------------------------------------
typedef struct Looked {
  Bsdf b;
  Vec3 wo;
  uint32_t seed;
} Looked;

static bool draw(const void *user, uint32_t i, Vec3 *d)
{
  const Looked *l = user;
  float u[4];
  chi_random(i ^ hash_u32(l->seed), u);
  u[3] = unit_float(hash_combine(77 + l->seed, i));
  BsdfSample s;
  if (!bsdf_sample(&l->b, l->wo, u[3], (Vec2){u[0], u[1]}, &s) || s.is_delta) return false;
  *d = s.wl;
  return true;
}

static double density(const void *user, Vec3 d)
{
  const Looked *l = user;
  float pdf;
  bsdf_eval(&l->b, l->wo, d, &pdf);
  return (double)pdf;
}

// P4, P5. Of the rare ones each from one side by day.
static void check_densities(const Named *all, int count, bool from_all_sides)
{
  const int angle_count = 4, cases = from_all_sides ? count * angle_count : count;
  const float cosines[] = {0.95f, 0.5f, 0.12f, -0.6f};
  const uint32_t samples = 100000 / SCALE;
  double worst_p = 1, worst_integral = 0;
  for (int i = 0; i < count; i++)
    for (int a = 0; a < angle_count; a++) {
      if (!from_all_sides && a != i % angle_count) continue;
      Looked l = {.wo = towards(cosines[a], 0.7f), .seed = (uint32_t)(i * 10 + a)};
      l.b = bsdf_of(&all[i].m, l.wo);
      const ChiCase c = {draw, density, &l, 0};
      const ChiResult r = chi_square(&c, samples);
      CHECK_MSG(r.p > sidak_level(cases), "%s at %g: p = %g", all[i].name, (double)cosines[a],
                r.p);
      const double noise = 4 * sqrt(r.accepted * (1 - r.accepted) / samples) + 1e-3;
      CHECK_MSG(fabs(r.integral - r.accepted) < noise, "%s at %g: integral %g, accepted %g", all[i].name,
                (double)cosines[a], r.integral, r.accepted);
      worst_p = fmin(worst_p, r.p);
      worst_integral = fmax(worst_integral, fabs(r.integral - r.accepted));
    }
  printf("  %d cases, least p %.4f (level %.1e), density and acceptance differ by at most %.1e\n",
         cases, worst_p, sidak_level(cases), worst_integral);
}

TEST(samples_follow_their_density)
{
  Named all[MOST_MATERIALS];
  int count = rough_materials(all);
  check_densities(all, count, true);
  count = rare_materials(all);
  check_densities(all, count, test_intensity() > 1);
}

TEST(densities_hold_beside_a_tilted_normal)
{
  const SurfaceMaterial m = pbr(v3_all(0.5f), 0.3f, 0.4f);
  SurfacePoint s = point_facing_up(false);
  s.n = v3_normalize(v3(0.6f, 1, -0.4f));
  Looked l = {.wo = towards(0.3f, 2.0f), .seed = 5};
  material_bsdf(&m, NULL, &s, l.wo, &l.b);
  const ChiCase c = {draw, density, &l, 0};
  const ChiResult r = chi_square(&c, 100000 / SCALE);
  CHECK_MSG(r.p > 0.01, "p = %g", r.p);
  CHECK(r.accepted < 0.99); // some directions fall below the surface
}

// P7: a million samples over the materials.
TEST(weights_are_value_over_density)
{
  Named all[2 * MOST_MATERIALS];
  const int common = rough_materials(all), count = common + rare_materials(all + common);
  double worst = 0;
  for (int i = 0; i < count; i++)
    for (uint32_t k = 0; k < (i < common ? 60000u : 15000u) / SCALE; k++) {
      float u[3];
      chi_random(k * 31 + (uint32_t)i, u);
      const Vec3 wo = towards(u[2] * 1.9f - 0.95f, 6 * u[0]);
      const Bsdf b = bsdf_of(&all[i].m, wo);
      BsdfSample s;
      if (!bsdf_sample(&b, wo, u[1], (Vec2){u[2], u[0]}, &s) || s.is_delta) continue;
      float pdf;
      const Vec3 f = bsdf_eval(&b, wo, s.wl, &pdf), off = f / pdf - s.weight;
      worst = fmax(worst, (double)(v3_length(off) / v3_length(s.weight)));
      worst = fmax(worst, fabs((double)(pdf / s.pdf - 1)));
      CHECK(v3_is_finite(s.weight) && fabsf(v3_length(s.wl) - 1) < 1e-5f);
      CHECK(s.is_transmission == (s.wl[1] * wo[1] < 0));
    }
  printf("  worst difference %.1e\n", worst);
  CHECK(worst < 1e-4);
}

// --- energy ---------------------------------------------------------------------------------------
static float reversed(uint32_t i, uint32_t base)
{
  double x = 0, digit = 1.0 / base;
  for (; i; i /= base, digit /= base) x += digit * (i % base);
  return fminf((float)x, 0x1.fffffep-1f);
}

// Part of light from all around that leaves towards wo: the mean weight over Hammersley's points, whose order by
// u_lobe leaves each lobe with a stretch of Halton's. What is transmitted is divided by eta^2 as radiance; as power
// it is not.
static double reflectance(const SurfaceMaterial *m, Vec3 wo, int count)
{
  const Bsdf b = bsdf_of(m, wo);
  double sum = 0;
  for (uint32_t i = 0; i < (uint32_t)count; i++) {
    BsdfSample s;
    const float u_lobe = ((float)i + 0.5f) / (float)count;
    if (!bsdf_sample(&b, wo, u_lobe, (Vec2){reversed(i, 2), reversed(i, 3)}, &s)) continue;
    const float scale = s.is_transmission && !b.is_thin ? b.eta * b.eta : 1;
    sum += (double)(v3_max_lane(s.weight) * scale);
  }
  return sum / count;
}

static int energy_grid = 20;

// The least and largest reflectance over roughness and angle, for a material of roughness 0..1.
static void sweep_energy(const char *name, SurfaceMaterial (*make)(float roughness), double least,
                         double most)
{
  double low = 2, high = 0;
  const int grid = SCALE > 1 ? 4 : energy_grid, steps = 4096;
  float low_r = 0, low_c = 0, high_r = 0, high_c = 0;
  for (int r = 0; r < grid; r++)
    for (int c = 0; c < grid; c++) {
      const float roughness = (float)r / (float)(grid - 1), cosine = ((float)c + 0.5f) / (float)grid;
      const SurfaceMaterial m = make(roughness);
      for (int side = 0; side < (m.transmission > 0 || m.kind == SURFACE_GLASS ? 2 : 1); side++) {
        const Vec3 wo = towards(side ? -cosine : cosine, 1);
        double e = reflectance(&m, wo, steps);
        if (e > most || e < least) e = reflectance(&m, wo, 16 * steps); // a suspect is looked at closely
        if (e < low) low = e, low_r = roughness, low_c = side ? -cosine : cosine;
        if (e > high) high = e, high_r = roughness, high_c = side ? -cosine : cosine;
      }
    }
  printf("  %-14s %.4f (roughness %.2f, cos %.2f) .. %.4f (roughness %.2f, cos %.2f)\n", name, low,
         (double)low_r, (double)low_c, high, (double)high_r, (double)high_c);
  CHECK_MSG(low >= least, "%s reflects only %.5f", name, low);
  CHECK_MSG(high <= most, "%s reflects %.5f", name, high);
}

static SurfaceMaterial white_metal(float r)
{
  return pbr(v3_all(1), 1, r);
}
static SurfaceMaterial white_plastic(float r)
{
  return pbr(v3_all(1), 0, r);
}
static SurfaceMaterial half_metal(float r)
{
  return pbr(v3_all(1), 0.5f, r);
}
static SurfaceMaterial white_coated(float r)
{
  return coated(pbr(v3_all(1), 1, 0.4f), 1, r);
}
static SurfaceMaterial coated_plastic(float r)
{
  return coated(pbr(v3_all(1), 0, r), 1, 0.3f);
}
static SurfaceMaterial clear_glass(float r)
{
  return glass(r, 1.5f);
}
static SurfaceMaterial dense_glass(float r)
{
  return glass(r, 2.4f);
}
static SurfaceMaterial thin_sheet(float r)
{
  SurfaceMaterial m = glassy(1, r, 1.5f, true);
  m.color = v3_all(1);
  return m;
}
static SurfaceMaterial bright_plastic(float r)
{
  SurfaceMaterial m = pbr(v3_all(1), 0, r);
  m.ior = 3;
  m.specular_color = v3_all(9);
  return m;
}
static SurfaceMaterial half_glass(float r)
{
  SurfaceMaterial m = coated(glassy(0.5f, r, 1.5f, false), 0.5f, 0.1f);
  m.color = v3_all(1);
  return m;
}

// P3.
TEST(no_material_gains_energy_and_white_ones_lose_little)
{
  sweep_energy("metal", white_metal, 0.99, 1.001);
  sweep_energy("plastic", white_plastic, 0.99, 1.001);
  sweep_energy("half metal", half_metal, 0.98, 1.001);
  sweep_energy("bright plastic", bright_plastic, 0.99, 1.001);
  sweep_energy("coated metal", white_coated, 0.9, 1.001);
  sweep_energy("coated plastic", coated_plastic, 0.9, 1.001);
  sweep_energy("glass", clear_glass, 0.4, 1.001);
  sweep_energy("dense glass", dense_glass, 0.3, 1.001);
  sweep_energy("thin sheet", thin_sheet, 0.5, 1.001);
  sweep_energy("half glass", half_glass, 0.5, 1.001);
}

static SurfaceMaterial white_velvet(float r)
{
  return velvet(pbr(v3_all(1), 0, 0.9f), v3_all(1), r);
}
static SurfaceMaterial velvet_metal(float r)
{
  return velvet(pbr(v3_all(1), 1, r), v3_all(1), 0.35f);
}
static SurfaceMaterial velvet_glass(float r)
{
  SurfaceMaterial m = velvet(glassy(0.6f, r, 1.5f, false), v3_all(1), 0.5f);
  m.color = v3_all(1);
  return m;
}
static SurfaceMaterial brushed_metal(float r)
{
  return brushed(pbr(v3_all(1), 1, r), 0.5f, 0.3f);
}
static SurfaceMaterial brushed_plastic(float r)
{
  return brushed(pbr(v3_all(1), 0, r), 0.4f, 0.8f);
}
static SurfaceMaterial brushed_most(float r)
{
  return brushed(pbr(v3_all(1), 0.5f, r), r, 1.2f);
}
static SurfaceMaterial oily_metal(float r)
{
  return filmed(pbr(v3_all(1), 1, r), 1, 1.5f, 500);
}
static SurfaceMaterial oily_plastic(float r)
{
  return filmed(pbr(v3_all(1), 0, r), 1, 1.8f, 100 + 500 * r);
}
static SurfaceMaterial oily_glass(float r)
{
  SurfaceMaterial m = filmed(glassy(1, r, 1.5f, r > 0.5f), 1, 1.8f, 350);
  m.color = v3_all(1);
  return m;
}
static SurfaceMaterial any_phong(float r)
{
  return phong(0.4f, 0.6f, 1000 * r * r * r);
}
static SurfaceMaterial any_beckmann(float r)
{
  return facets(GLOSS_BECKMANN, 0.3f, 1, 0.02f + 0.98f * r);
}
static SurfaceMaterial any_gaussian(float r)
{
  return facets(GLOSS_GAUSSIAN, 0.3f, 1, 0.02f + 0.98f * r);
}

// P3. What stretched bumps and films lose is said in bsdf.h.
TEST(no_rarer_material_gains_energy_either)
{
  energy_grid = test_intensity() > 1 ? 20 : 7;
  sweep_energy("velvet", white_velvet, 0.85, 1.001);
  sweep_energy("velvet metal", velvet_metal, 0.9, 1.001);
  sweep_energy("velvet glass", velvet_glass, 0.5, 1.001);
  sweep_energy("brushed metal", brushed_metal, 0.8, 1.001);
  sweep_energy("brushed plastic", brushed_plastic, 0.75, 1.001);
  sweep_energy("brushed most", brushed_most, 0.4, 1.001);
  sweep_energy("oily metal", oily_metal, 0.6, 1.001);
  sweep_energy("oily plastic", oily_plastic, 0.6, 1.001);
  sweep_energy("oily glass", oily_glass, 0.3, 1.001);
  sweep_energy("phong", any_phong, 0.4, 1.001);
  sweep_energy("beckmann", any_beckmann, 0.4, 1.001);
  sweep_energy("gaussian", any_gaussian, 0.4, 1.001);
}

// The table against a direct integral over the distribution of normals, which shares no code with it.
TEST(albedo_table_is_right)
{
  double worst = 0;
  for (int k = 0; k < 60 / SCALE + 1; k++) {
    const float r = 0.15f + 0.85f * unit_float(hash_u32((uint32_t)k)), a = r * r;
    const float mu = 0.05f + 0.95f * unit_float(hash_u32((uint32_t)k + 999));
    const Vec3 wo = v3(safe_sqrt(1 - mu * mu), 0, mu);
    double full = 0, edge = 0;
    const int n = 300 / (SCALE > 1 ? 2 : 1);
    for (int i = 0; i < n; i++)
      for (int j = 0; j < n; j++) { // normals with density D (h.z): tan^2 = a^2 v / (1 - v), denser at v = 1
        const double x = 1 - (i + 0.5) / n, v = 1 - x * x * x, phi = M_PI * (j + 0.5) / n;
        const double t2 = (double)(a * a) * v / (1 - v);
        const double hz = 1 / sqrt(1 + t2), s = sqrt(1 - hz * hz);
        const Vec3 h = v3((float)(s * sin(M_PI / 2 - phi)), (float)(s * sin(phi)), (float)hz);
        const float oh = v3_dot(wo, h);
        const Vec3 wl = v3_reflect(wo, h);
        if (oh <= 0 || wl[2] <= 0) continue;
        const double part = 12 * x * x * (double)(ggx_visibility(mu, wl[2], a) * wl[2] * oh) / hz;
        full += part;
        edge += part * (double)fresnel_schlick(oh);
      }
    const GgxAlbedo table = ggx_albedo_at(r, mu);
    worst =
        fmax(worst, fmax(fabs(full / n / n - (double)table.full), fabs(edge / n / n - (double)table.edge)));
  }
  printf("  worst difference %.1e\n", worst);
  CHECK(worst < 3e-3);
}

// --- symmetry ---------------------------------------------------------------------------------------
static void check_pair(const Named *n, Vec3 a, Vec3 b, double *worst)
{
  const Bsdf from_a = bsdf_of(&n->m, a), from_b = bsdf_of(&n->m, b);
  float pdf;
  const Vec3 f = bsdf_eval(&from_a, a, b, &pdf) / fabsf(b[1]);
  Vec3 g = bsdf_eval(&from_b, b, a, &pdf) / fabsf(a[1]);
  // Radiance divided by the squared index is what is symmetric (Veach 1997, section 5.2).
  if (a[1] * b[1] < 0 && !from_a.is_thin) g *= from_b.eta * from_b.eta;
  // Next to total reflection hardly anything passes, and the difference 1 - F has no digits left.
  const float scale = v3_length(f) + v3_length(g) + 1e-3f;
  *worst = fmax(*worst, (double)(v3_length(f - g) * 2 / scale));
}

// P6: a million pairs over the materials, for reflection and for transmission.
TEST(scattering_is_reciprocal)
{
  Named all[2 * MOST_MATERIALS];
  const int common = rough_materials(all), count = common + rare_materials(all + common);
  double worst_reflection = 0, worst_transmission = 0;
  for (int i = 0; i < count; i++)
    for (uint32_t k = 0; k < (i < common ? 60000u : 15000u) / SCALE; k++) {
      float u[3], v[3];
      chi_random(2 * k + 1000000u * (uint32_t)i, u);
      chi_random(2 * k + 1 + 1000000u * (uint32_t)i, v);
      const Vec3 a = towards(0.01f + 0.98f * u[0], 6.2f * u[1]),
                 b = towards(0.01f + 0.98f * v[0], 6.2f * v[1]);
      check_pair(&all[i], a, b, &worst_reflection);
      check_pair(&all[i], a, -b, &worst_transmission);
    }
  printf("  reflection %.1e, transmission %.1e\n", worst_reflection, worst_transmission);
  CHECK(worst_reflection < 1e-5);
  CHECK(worst_transmission < 1e-5);
}

// --- Snell and Fresnel --------------------------------------------------------------------------------
// Fresnel's own formulas in the angles, which share nothing with the code's.
static double fresnel_by_angles(double i, double eta)
{
  const double sin_t = sin(i) / eta;
  if (sin_t >= 1) return 1;
  if (i < 1e-6) return pow((eta - 1) / (eta + 1), 2);
  const double t = asin(sin_t), s = sin(i - t) / sin(i + t), p = tan(i - t) / tan(i + t);
  return (s * s + p * p) / 2;
}

// P10.
TEST(snell_and_fresnel)
{
  const float indices[] = {1.0003f, 1.1f, 1.33f, 1.5f, 1.8f, 2.42f, 4, 1 / 1.33f, 1 / 1.5f, 1 / 2.42f};
  double worst_f = 0, worst_t = 0;
  int total = 0;
  for (int n = 0; n < 10; n++)
    for (int k = 0; k < 10000; k++) {
      const float eta = indices[n], cos_i = (float)cos(M_PI / 2 * (k + 0.5) / 10000);
      float cos_t;
      const float f = fresnel_dielectric(cos_i, eta, &cos_t);
      worst_f = fmax(worst_f, fabs((double)f - fresnel_by_angles(acos((double)cos_i), (double)eta)));
      if (f == 1) {
        total++;
        CHECK(cos_t == 0);
        continue;
      }
      const Vec3 wo = v3(safe_sqrt((1 - cos_i) * (1 + cos_i)), 0, cos_i);
      const Vec3 wl = refract(wo, v3(0, 0, 1), eta, cos_i, cos_t);
      const double sine = sqrt((1 - (double)cos_i) * (1 + (double)cos_i)) / (double)eta;
      worst_t = fmax(worst_t, fmax(fabs((double)wl[0] + sine), fabs((double)wl[2] + sqrt(1 - sine * sine))));
    }
  printf("  reflectance off by %.1e, direction by %.1e, %d total reflections\n", worst_f, worst_t, total);
  CHECK(worst_f < 1e-6);
  CHECK(worst_t < 1e-6);
  CHECK(total > 10000);
}

TEST(clear_glass_splits_as_fresnel_says)
{
  const SurfaceMaterial m = glass(0, 1.5f);
  for (int side = 0; side < 2; side++) {
    const float cosine = 0.8f;
    const Vec3 wo = towards(side ? -cosine : cosine, 0.3f);
    const Bsdf b = bsdf_of(&m, wo);
    const double f = fresnel_by_angles(acos((double)cosine), side ? 1 / 1.5 : 1.5);
    BsdfSample s;
    int reflected = 0;
    for (uint32_t i = 0; i < 20000; i++) {
      CHECK(bsdf_sample(&b, wo, unit_float(hash_u32(i)), (Vec2){0.5f, 0.5f}, &s) && s.is_delta);
      const double power = (double)s.weight[0] * (s.is_transmission ? (double)(b.eta * b.eta) : 1);
      CHECK_NEAR(power, 1, 1e-5);
      reflected += !s.is_transmission;
      if (s.is_transmission)
        CHECK_NEAR(v3_length(v3(s.wl[0], 0, s.wl[2])), sqrt(1 - 0.64) / (double)b.eta, 1e-6);
    }
    CHECK_NEAR(reflected / 20000.0, f, 0.01);
  }
}

// --- materials and points -------------------------------------------------------------------------------
TEST(a_flat_normal_map_changes_nothing)
{
  float texel[3] = {0.5f, 0.5f, 1};
  const TextureMap map = {
      .image = {1, 1, 3, PIXEL_F32, texel}, .uv_map = {{1, 0, 0}, {0, 1, 0}}, .gain = {1, 1, 1}, .alpha_gain = 1};
  SurfaceMaterial m = pbr(v3_all(1), 0, 0.5f);
  m.normal_map = (TextureRef){0, 0};
  SurfacePoint s = point_facing_up(false);
  s.n = v3_normalize(v3(0.3f, 1, 0.2f));
  s.tangent = v3_normalize(v3_cross(s.n, v3(0, 0, 1)));
  Bsdf b;
  material_bsdf(&m, &map, &s, towards(0.9f, 0), &b);
  CHECK(v3_length(b.frame.z - s.n) < 1e-6f);
  texel[0] = 1; // leans along the tangent, by 45 degrees
  material_bsdf(&m, &map, &s, towards(0.9f, 0), &b);
  CHECK(v3_length(b.frame.z - v3_normalize(s.n + s.tangent)) < 1e-6f);
  m.normal_scale = 0;
  material_bsdf(&m, &map, &s, towards(0.9f, 0), &b);
  CHECK(v3_length(b.frame.z - s.n) < 1e-6f);
}

// A plane of heights z = x / 4 and one of 4 x: the first leans as heights do, the second is held above the surface.
TEST(a_bump_map_leans_the_normal_by_its_slope)
{
  static float texel[64 * 64];
  for (int i = 0; i < 64 * 64; i++) texel[i] = ((float)(i % 64) + 0.5f) / 64;
  const TextureMap map = {.image = {64, 64, 1, PIXEL_F32, texel},
                          .uv_map = {{1, 0, 0}, {0, 1, 0}},
                          .gain = {1, 1, 1},
                          .alpha_gain = 1};
  SurfaceMaterial m = pbr(v3_all(1), 0, 0.5f);
  m.bump_map = (TextureRef){0, 0};
  m.bump_scale = 0.5f;
  SurfacePoint s = point_facing_up(false); // y is up; one of u is two metres along x
  s.uv[0] = (Vec2){0.4f, 0.6f};
  s.grad_u[0] = v3(0.5f, 0, 0);
  s.grad_v[0] = v3(0, 0, -0.5f);
  Bsdf b;
  material_bsdf(&m, &map, &s, towards(0.9f, 0), &b);
  CHECK(v3_length(b.frame.z - v3_normalize(v3(-0.25f, 1, 0))) < 1e-5f);
  m.bump_scale = -0.5f;
  material_bsdf(&m, &map, &s, towards(0.9f, 0), &b);
  CHECK(v3_length(b.frame.z - v3_normalize(v3(0.25f, 1, 0))) < 1e-5f);
  m.bump_scale = 1e6f;
  for (uint32_t i = 0; i < 200; i++) {
    const Vec3 wo = towards(unit_float(hash_u32(i)), (float)i);
    material_bsdf(&m, &map, &s, wo, &b);
    CHECK(v3_dot(b.frame.z, wo) > 0 && v3_dot(b.frame.z, b.ng) > 0);
  }
}

TEST(normals_always_see_the_viewer)
{
  float texel[3];
  const TextureMap map = {
      .image = {1, 1, 3, PIXEL_F32, texel}, .uv_map = {{1, 0, 0}, {0, 1, 0}}, .gain = {1, 1, 1}, .alpha_gain = 1};
  SurfaceMaterial m = pbr(v3_all(1), 0, 0.5f);
  m.normal_map = (TextureRef){0, 0};
  for (uint32_t i = 0; i < 5000; i++) {
    chi_random(i, texel);
    const bool is_back = i & 1;
    const Vec3 wo = towards((is_back ? -1.0f : 1.0f) * unit_float(hash_u32(i)), (float)i);
    SurfacePoint s = point_facing_up(is_back);
    Bsdf b;
    material_bsdf(&m, &map, &s, wo, &b);
    CHECK_MSG(v3_dot(b.frame.z, wo) > 0 && v3_dot(b.frame.z, b.ng) > 0, "i = %u", i);
    CHECK(fabsf(v3_length(b.frame.z) - 1) < 1e-5f);
  }
}

TEST(light_does_not_leak)
{
  SurfaceMaterial m = glass(0.5f, 1.5f);
  SurfacePoint s = point_facing_up(false);
  s.n = v3_normalize(v3(1, 0.3f, 0));
  const Vec3 wo = v3_normalize(v3(1, 1, 0));
  Bsdf b;
  material_bsdf(&m, NULL, &s, wo, &b);
  float pdf;
  const Vec3 below = v3_normalize(v3(1, -0.2f, 0)), above = v3_normalize(v3(-1, 1, 0));
  CHECK(v3_is_zero(bsdf_eval(&b, wo, below, &pdf)) && pdf == 0); // seen by n, not by ng
  CHECK(v3_is_zero(bsdf_eval(&b, wo, above, &pdf)) && pdf == 0); // seen by ng, not by n
}

TEST(emission_and_opacity)
{
  SurfaceMaterial m = material_of(SURFACE_EMISSION);
  m.emission = v3(1, 2, 3);
  SurfacePoint s = point_facing_up(false);
  CHECK(v3_is_zero(material_emission(&m, NULL, &s) - v3(1, 2, 3)));
  s.is_back = true;
  CHECK(!v3_is_zero(material_emission(&m, NULL, &s)));
  m.is_double_sided = false;
  CHECK(v3_is_zero(material_emission(&m, NULL, &s)));
  Bsdf b;
  BsdfSample sample;
  material_bsdf(&m, NULL, &s, v3(0, -1, 0), &b);
  CHECK(!bsdf_sample(&b, v3(0, -1, 0), 0.5f, (Vec2){0.5f, 0.5f}, &sample) && v3_is_zero(bsdf_albedo(&b)));

  SurfaceMaterial p = pbr(v3_all(1), 0, 0.5f);
  p.opacity = 0.6f;
  CHECK(material_opacity(&p, NULL, &s) == 1);
  p.alpha_mode = SURFACE_BLEND;
  CHECK(material_opacity(&p, NULL, &s) == 0.6f);
  p.alpha_mode = SURFACE_MASK;
  CHECK(material_opacity(&p, NULL, &s) == 1);
  p.alpha_cutoff = 0.7f;
  CHECK(material_opacity(&p, NULL, &s) == 0);
}

TEST(mirror_lambert_and_vertex_colour)
{
  SurfaceMaterial m = material_of(SURFACE_MIRROR);
  m.color = v3(0.9f, 0.8f, 0.7f);
  const Vec3 wo = towards(0.6f, 1);
  Bsdf b = bsdf_of(&m, wo);
  BsdfSample s;
  CHECK(bsdf_sample(&b, wo, 0.3f, (Vec2){0.1f, 0.9f}, &s) && s.is_delta);
  CHECK(v3_length(s.weight - m.color) < 1e-6f && v3_length(s.wl - v3(-wo[0], wo[1], -wo[2])) < 1e-6f);
  float pdf;
  CHECK(v3_is_zero(bsdf_eval(&b, wo, s.wl, &pdf)) && pdf == 0);

  m.kind = SURFACE_LAMBERT;
  SurfacePoint p = point_facing_up(true);
  p.color[0] = 0.5f;
  material_bsdf(&m, NULL, &p, -wo, &b);
  const Vec3 f = bsdf_eval(&b, -wo, v3(0, -1, 0), &pdf);
  CHECK_NEAR(f[0], 0.45 / M_PI, 1e-6);
  CHECK_NEAR(f[1], 0.8 / M_PI, 1e-6);
  CHECK_NEAR(bsdf_albedo(&b)[2], 0.7, 1e-6);
}

TEST(nothing_is_nan)
{
  const float odd[] = {0, 1e-30f, 0.029f, 0.03f, 0.5f, 1, 7, NAN, INFINITY, -1};
  for (int r = 0; r < 10; r++)
    for (uint32_t i = 0; i < 2000 / SCALE; i++) {
      float u[3];
      chi_random(i, u);
      SurfaceMaterial m = glassy(u[0], odd[r], 1 + 4 * u[1], i & 1);
      m = coated(m, u[2], odd[(r + i) % 10]);
      m.metallic = odd[i % 10];
      const Vec3 wo = towards((i & 2 ? 1.0f : -1.0f) * (i % 5 ? u[2] : 1e-7f), u[1]);
      const Bsdf b = bsdf_of(&m, wo);
      BsdfSample s;
      if (!bsdf_sample(&b, wo, u[1], (Vec2){u[0], u[2]}, &s)) continue;
      CHECK_MSG(v3_is_finite(s.weight) && v3_is_finite(s.wl) && s.pdf > 0, "roughness %g", (double)odd[r]);
    }
}

TEST_MAIN
