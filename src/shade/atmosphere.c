// Baking of the sky. Distances in kilometres from the planet's centre; a place is (r, mu): its radius, and the cosine
// of a direction there to the vertical.
//
//   transmittance[r][mu]  of the way out of the air           one table for the sun's light at any place
//   later[r][mu of sun]   light of second and higher orders    at a place, even in direction, per solid angle
//   sky[theta][phi]       what the eye sees                    theta crowded at the horizon

#include "shade/atmosphere.h"

#include "base/fmath.h"
#include "base/mem.h"
#include "shade/spectrum.h"

enum { BANDS = 8, BAND_STEPS = 4 }; // a band is 40 nm wide, the tables go in steps of 10 nm

// Extraterrestrial sun, W/m2 nm, means over 10 nm from 400 nm (ASTM G-173).
static const float solar[BANDS * BAND_STEPS] = {
    1.72765f, 1.73054f, 1.6887f,  1.61253f, 1.91198f, 2.03474f, 2.02042f, 2.02212f, 1.93377f, 1.95809f, 1.91686f,
    1.8298f,  1.8685f,  1.8931f,  1.85149f, 1.8504f,  1.8341f,  1.8345f,  1.8147f,  1.78158f, 1.7533f,  1.6965f,
    1.68194f, 1.64654f, 1.6048f,  1.52143f, 1.55622f, 1.5113f,  1.474f,   1.4482f,  1.41018f, 1.36775f};
// Cross-section of ozone at 233 K in 1e-25 m2, likewise (Serdyuchenko et al. 2011, University of Bremen).
static const float ozone_section[BANDS * BAND_STEPS] = {
    0.01527f, 0.02763f, 0.0552f, 0.08451f, 0.1582f, 0.2316f, 0.3669f, 0.4924f, 0.7752f, 0.9016f, 1.48f,
    1.602f,   2.139f,   2.755f,  3.091f,   3.5f,    4.266f,  4.672f,  4.398f,  4.701f,  5.019f,  4.305f,
    3.74f,    3.215f,   2.662f,  2.238f,   1.852f,  1.473f,  1.209f,  0.9423f, 0.7455f, 0.6566f};

#define GROUND 6360.0f // km
#define TOP    6460.0f
// Bruneton and Neyret 2008, and the reference implementation of 2017: scale heights of air and of dust.
#define AIR_HEIGHT  8.0f
#define DUST_HEIGHT 1.2f
#define DUST_EXTINCTION 4.44e-3f // per km at the ground
#define DUST_ALBEDO     0.9f
#define DUST_G          0.8f
#define OZONE_MIDDLE    25.0f // a tent, 15 km to either side
#define OZONE_HALF      15.0f

enum {
  T_RADII = 64, T_COSINES = 128,  // transmittance
  M_RADII = 12, M_COSINES = 32,   // later orders
  M_DIRECTIONS = 64, M_STEPS = 12,
  VIEW_STEPS = 32,
};
// Against tables of 120 view steps, 128 directions of 40 steps and 32 x 64 places, in 1 s: with the sun at 60, 20 and 3
// degrees no texel is off by more than 0.8, 0.7 and 1.6 %, at -3 on average 2 % and in the darkest 12 %; 56 ms.

typedef struct Spectrum {
  float of[BANDS];
} Spectrum;

typedef struct Bake {
  Atmosphere a;
  Spectrum rayleigh, ozone; // per km at full density
  Spectrum ground;          // albedo
  Vec3 color[BANDS];        // of a band's sunlight, all together of luminance ATMOSPHERE_SUN
  float eye, horizon, sun_sine, sun_cosine;
  float *pixels;
  Vec3 below;               // irradiance on the ground by the sky
  Spectrum transmittance[T_RADII][T_COSINES];
  Spectrum later[M_RADII][M_COSINES];
} Bake;

// --- colours ----------------------------------------------------------------------------------------
static void set_bands(Bake *b)
{
  const float ozone_density = 300 * 2.687e20f / (OZONE_HALF * 1000); // 300 Dobson units, molecules per m3
  Vec3 all = v3_all(0);
  for (int i = 0; i < BANDS; i++) {
    float section = 0, um = 0.420f + 0.04f * (float)i;
    b->color[i] = v3_all(0);
    for (int k = 0; k < BAND_STEPS; k++) {
      const int at = i * BAND_STEPS + k;
      b->color[i] += solar[at] * rec709_of(405 + 10 * (float)at);
      section += ozone_section[at] * 1e-25f / BAND_STEPS;
    }
    all += b->color[i];
    b->rayleigh.of[i] = b->a.air * 1.24062e-3f / (um * um * um * um); // Bruneton 2017
    b->ozone.of[i] = b->a.ozone * section * ozone_density * 1000;
    b->ground.of[i] = b->a.albedo[um < 0.49f ? 2 : um < 0.58f ? 1 : 0];
  }
  for (int i = 0; i < BANDS; i++) b->color[i] = b->color[i] * (ATMOSPHERE_SUN / luminance(all));
}

static Vec3 color_of(const Bake *b, const Spectrum *s)
{
  Vec3 sum = v3_all(0);
  for (int i = 0; i < BANDS; i++) sum += s->of[i] * b->color[i];
  return v3_max(sum, v3_all(0)); // a deep red lies outside Rec.709
}

// --- the air ----------------------------------------------------------------------------------------
typedef struct Density {
  float air, dust, ozone;
} Density;

static Density density_at(float r)
{
  const float h = max_f(r - GROUND, 0);
  return (Density){f_exp(-h / AIR_HEIGHT), f_exp(-h / DUST_HEIGHT),
                   max_f(1 - fabsf(h - OZONE_MIDDLE) / OZONE_HALF, 0)};
}

static float extinction(const Bake *b, Density d, int band)
{
  return b->rayleigh.of[band] * d.air + b->a.dust * DUST_EXTINCTION * d.dust + b->ozone.of[band] * d.ozone;
}

static float scattering(const Bake *b, Density d, int band)
{
  return b->rayleigh.of[band] * d.air + b->a.dust * (DUST_EXTINCTION * DUST_ALBEDO) * d.dust;
}

static float to_top(float r, float mu)
{
  return max_f(safe_sqrt(sqr_f(r * mu) + (TOP - r) * (TOP + r)) - r * mu, 0);
}

// The way to the horizon, where a ray just touches the ground.
static float to_horizon(float r)
{
  return safe_sqrt((r - GROUND) * (r + GROUND));
}

// The way to the ground; below zero: the ray misses it.
static float to_ground(float r, float mu)
{
  const float inside = sqr_f(r * mu) - (r - GROUND) * (r + GROUND); // in this form it keeps its digits near the ground
  return mu < 0 && inside >= 0 ? max_f(-r * mu - sqrtf(inside), 0) : -1;
}

static float radius_along(float r, float mu, float t)
{
  return clamp_f(sqrtf(t * t + 2 * r * mu * t + r * r), GROUND, TOP);
}

// By the midpoint rule, in steps that grow as rays leave the dense air: 80 miss 0.15 % of the dust over the zenith, where
// as many equal ones missed 5 %.
static Spectrum transmittance_along(const Bake *b, float r, float mu, int steps)
{
  Density sum = {0, 0, 0};
  const float end = to_top(r, mu);
  for (int i = 0; i < steps; i++) {
    const float u0 = (float)i / (float)steps, u1 = (float)(i + 1) / (float)steps;
    const float t0 = end * (u0 * u0 * u0), t1 = end * (u1 * u1 * u1);
    const Density d = density_at(radius_along(r, mu, (t0 + t1) / 2));
    const float step = t1 - t0;
    sum = (Density){sum.air + d.air * step, sum.dust + d.dust * step, sum.ozone + d.ozone * step};
  }
  Spectrum s;
  for (int i = 0; i < BANDS; i++) s.of[i] = f_exp(-extinction(b, sum, i));
  return s;
}

// The table's coordinates are those of Bruneton and Neyret 2008, section 4, in the form of 2017.
static void fill_transmittance(void *user, size_t row, int worker)
{
  (void)worker;
  Bake *b = user;
  const float most = to_horizon(TOP), rho = most * (float)row / (T_RADII - 1);
  const float r = sqrtf(rho * rho + GROUND * GROUND), least = TOP - r;
  for (int i = 0; i < T_COSINES; i++) {
    const float d = least + (rho + most - least) * (float)i / (T_COSINES - 1);
    const float mu = d > 0 ? clamp_f((most * most - rho * rho - d * d) / (2 * r * d), -1, 1) : 1;
    b->transmittance[row][i] = transmittance_along(b, r, mu, 80);
  }
}

static Spectrum mix4(const Spectrum *a, const Spectrum *b, const Spectrum *c, const Spectrum *d, float x, float y)
{
  Spectrum s;
  for (int i = 0; i < BANDS; i++)
    s.of[i] = (1 - y) * ((1 - x) * a->of[i] + x * b->of[i]) + y * ((1 - x) * c->of[i] + x * d->of[i]);
  return s;
}

// The place in a table of n steps: the step, and how far into it.
static int table_place(float x, int n, float *rest)
{
  const float at = clamp_f(x, 0, 1) * (float)(n - 1);
  const int i = at >= (float)(n - 2) ? n - 2 : (int)at;
  *rest = at - (float)i;
  return i;
}

// What is left of the sun's light at r, its disk partly below the horizon.
static Spectrum sun_left(const Bake *b, float r, float mu)
{
  const float most = to_horizon(TOP), rho = to_horizon(r), least = TOP - r;
  const float cos_h = -rho / r, rim = max_f(GROUND / r * b->a.sun_radius, 1e-5f);
  const float x = clamp_f((mu - cos_h + rim) / (2 * rim), 0, 1), seen = x * x * (3 - 2 * x);
  if (seen == 0) return (Spectrum){{0}};
  float x_rest, y_rest;
  const int y = table_place(rho / most, T_RADII, &y_rest);
  const int i = table_place((to_top(r, max_f(mu, cos_h)) - least) / (rho + most - least), T_COSINES, &x_rest);
  Spectrum s = mix4(&b->transmittance[y][i], &b->transmittance[y][i + 1], &b->transmittance[y + 1][i],
                    &b->transmittance[y + 1][i + 1], x_rest, y_rest);
  for (int k = 0; k < BANDS; k++) s.of[k] *= seen;
  return s;
}

// --- later orders -------------------------------------------------------------------------------------
// Cosines of the sun from -0.41 to 1, crowded where the planet's shadow begins.
static float later_cosine(int i)
{
  const float root = -0.64f + 1.64f * (float)i / (M_COSINES - 1);
  return root * fabsf(root);
}

// The sun's light that the ground sends back, of direct light only.
static float ground_sends(const Bake *b, const Spectrum *sun, float mu, int band)
{
  return b->ground.of[band] * max_f(mu, 0) * sun->of[band] / PI;
}

typedef struct Orders {
  Spectrum second, again; // second order, and what comes back of light that is 1 from everywhere
} Orders;

// Adds what arrives from one direction.
static void add_direction(const Bake *b, float r, float mu, float sun, float sun_sine, Vec3 d, Orders *o)
{
  const float ground = to_ground(r, d[1]), end = ground >= 0 ? ground : to_top(r, d[1]), step = end / M_STEPS;
  const float toward = d[0] * sun_sine + d[1] * sun; // cosine between d and the sun
  Spectrum left;
  for (int k = 0; k < BANDS; k++) left.of[k] = 1;
  for (int i = 0; i < M_STEPS; i++) {
    const float t = ((float)i + 0.5f) * step, at = radius_along(r, mu, t);
    const Spectrum lit = sun_left(b, at, clamp_f((r * sun + t * toward) / at, -1, 1));
    const Density here = density_at(at);
    for (int k = 0; k < BANDS; k++) {
      const float out = extinction(b, here, k), pass = f_exp(-out * step);
      const float sent = left.of[k] * scattering(b, here, k) * (out > 1e-9f ? (1 - pass) / out : step);
      o->second.of[k] += sent * lit.of[k] / (4 * PI);
      o->again.of[k] += sent;
      left.of[k] *= pass;
    }
  }
  if (ground < 0) return;
  const float below = clamp_f((r * sun + end * toward) / GROUND, -1, 1);
  const Spectrum lit = sun_left(b, GROUND, below);
  for (int k = 0; k < BANDS; k++) o->second.of[k] += left.of[k] * ground_sends(b, &lit, below, k);
}

static void fill_later(void *user, size_t row, int worker)
{
  (void)worker;
  Bake *b = user;
  const float part = (float)row / (M_RADII - 1), r = GROUND + 0.001f + (TOP - GROUND - 0.002f) * part * part;
  for (int c = 0; c < M_COSINES; c++) {
    const float sun = later_cosine(c), sun_sine = safe_sqrt(1 - sun * sun);
    Orders o = {{{0}}, {{0}}};
    for (int i = 0; i < M_DIRECTIONS; i++) { // a spiral, even on the sphere
      const float y = 1 - (2 * (float)i + 1) / M_DIRECTIONS, flat = safe_sqrt(1 - y * y);
      float sine, cosine;
      f_sincos((float)i * 2.3999632f, &sine, &cosine);
      add_direction(b, r, y, sun, sun_sine, v3(flat * cosine, y, flat * sine), &o);
    }
    for (int k = 0; k < BANDS; k++) // Hillaire 2020, equation 10
      b->later[row][c].of[k] =
          o.second.of[k] / M_DIRECTIONS / max_f(1 - o.again.of[k] / M_DIRECTIONS, 0.01f);
  }
}

static Spectrum later_at(const Bake *b, float r, float sun)
{
  float x_rest, y_rest;
  const int y = table_place(safe_sqrt((r - GROUND) / (TOP - GROUND)), M_RADII, &y_rest);
  const float root = sun < 0 ? -sqrtf(-sun) : sqrtf(sun);
  const int x = table_place((root + 0.64f) / 1.64f, M_COSINES, &x_rest);
  return mix4(&b->later[y][x], &b->later[y][x + 1], &b->later[y + 1][x], &b->later[y + 1][x + 1], x_rest, y_rest);
}

// --- what the eye sees ----------------------------------------------------------------------------------
// Light that one step of a view ray sends to the eye, for light that is 1 there: by kinds.
typedef struct ViewStep {
  float t, r;
  Spectrum air, dust; // scattered towards the eye by either, phase functions left out
} ViewStep;

typedef struct View {
  float mu, sine, ground; // ground below zero: none
  ViewStep steps[VIEW_STEPS];
  Spectrum left;          // at the end
} View;

// Steps grow with the square of their number: what is near counts most.
static void view_begin(const Bake *b, float theta, View *v)
{
  f_sincos(theta, &v->sine, &v->mu);
  const float ground = to_ground(b->eye, v->mu), horizon = to_horizon(b->eye);
  v->ground = theta <= b->horizon ? -1 : ground >= 0 ? ground : horizon; // rounding must open no gap
  const float end = v->ground >= 0 ? v->ground : to_top(b->eye, v->mu);
  for (int k = 0; k < BANDS; k++) v->left.of[k] = 1;
  for (int i = 0; i < VIEW_STEPS; i++) {
    const float t0 = end * sqr_f((float)i / VIEW_STEPS), t1 = end * sqr_f((float)(i + 1) / VIEW_STEPS);
    ViewStep *s = &v->steps[i];
    s->t = (t0 + t1) / 2;
    s->r = radius_along(b->eye, v->mu, s->t);
    const Density d = density_at(s->r);
    for (int k = 0; k < BANDS; k++) {
      const float out = extinction(b, d, k), pass = f_exp(-out * (t1 - t0));
      const float sent = v->left.of[k] * (out > 1e-9f ? (1 - pass) / out : t1 - t0);
      s->air.of[k] = sent * b->rayleigh.of[k] * d.air;
      s->dust.of[k] = sent * b->a.dust * (DUST_EXTINCTION * DUST_ALBEDO) * d.dust;
      v->left.of[k] *= pass;
    }
  }
}

static float phase_air(float c)
{
  return 3 / (16 * PI) * (1 + c * c);
}

// Cornette and Shanks 1992.
static float phase_dust(float c)
{
  const float g = DUST_G, base = 1 + g * g - 2 * g * c;
  return 3 / (8 * PI) * (1 - g * g) / (2 + g * g) * (1 + c * c) / (base * sqrtf(base));
}

static Vec3 view_color(const Bake *b, const View *v, float phi)
{
  float sin_phi, cos_phi;
  f_sincos(phi, &sin_phi, &cos_phi);
  const float c = clamp_f(v->sine * cos_phi * b->sun_cosine + v->mu * b->sun_sine, -1, 1);
  const float air = phase_air(c), dust = phase_dust(c);
  Spectrum sum = {{0}};
  for (int i = 0; i < VIEW_STEPS; i++) {
    const ViewStep *s = &v->steps[i];
    const float mu = clamp_f((b->eye * b->sun_sine + s->t * c) / s->r, -1, 1);
    const Spectrum sun = sun_left(b, s->r, mu), later = later_at(b, s->r, mu);
    for (int k = 0; k < BANDS; k++)
      sum.of[k] += (s->air.of[k] * air + s->dust.of[k] * dust) * sun.of[k] +
                   (s->air.of[k] + s->dust.of[k]) * later.of[k];
  }
  if (v->ground < 0) return color_of(b, &sum);
  const float mu = clamp_f((b->eye * b->sun_sine + v->ground * c) / GROUND, -1, 1);
  const Spectrum sun = sun_left(b, GROUND, mu);
  Spectrum shade = v->left;
  for (int k = 0; k < BANDS; k++) sum.of[k] += v->left.of[k] * ground_sends(b, &sun, mu, k);
  for (int k = 0; k < BANDS; k++) shade.of[k] *= b->ground.of[k];
  // The sky's own light on the ground has its colour already.
  Vec3 white = v3_all(0);
  for (int k = 0; k < BANDS; k++) white += b->color[k];
  return color_of(b, &sum) + color_of(b, &shade) / white * b->below / PI;
}

// The sky is the same on both sides of the sun.
static void fill_row(Bake *b, size_t row)
{
  View v;
  const float part = 2 * ((float)row + 0.5f) / ATMOSPHERE_HIGH - 1, curve = part * part;
  view_begin(b, part < 0 ? b->horizon * (1 - curve) : b->horizon + (PI - b->horizon) * curve, &v);
  float *out = b->pixels + row * ATMOSPHERE_WIDE * 3;
  for (int x = ATMOSPHERE_WIDE / 2; x < ATMOSPHERE_WIDE; x++) {
    const Vec3 color = view_color(b, &v, 2 * PI * ((float)x + 0.5f) / ATMOSPHERE_WIDE - PI);
    for (int c = 0; c < 3; c++) out[3 * x + c] = out[3 * (ATMOSPHERE_WIDE - 1 - x) + c] = color[c];
  }
}

static void fill_above(void *user, size_t row, int worker)
{
  (void)worker;
  fill_row(user, row);
}

static void fill_below(void *user, size_t row, int worker)
{
  (void)worker;
  fill_row(user, row + ATMOSPHERE_HIGH / 2);
}

// What the sky above sends to level ground.
static Vec3 sky_irradiance(const Bake *b)
{
  Vec3 sum = v3_all(0);
  for (int y = 0; y < ATMOSPHERE_HIGH / 2; y++) {
    const float part = 1 - 2 * ((float)y + 0.5f) / ATMOSPHERE_HIGH;
    float sine, cosine;
    f_sincos(b->horizon * (1 - part * part), &sine, &cosine);
    const float weight = 4 * b->horizon * part / ATMOSPHERE_HIGH * sine * max_f(cosine, 0) * 2 * PI / ATMOSPHERE_WIDE;
    for (int x = 0; x < ATMOSPHERE_WIDE; x++) sum += weight * v3_load(b->pixels + 3 * (y * ATMOSPHERE_WIDE + x));
  }
  return sum;
}

bool atmosphere_bake(const Atmosphere *a, float *pixels, AtmosphereLight *out, Jobs *jobs, const Cancel *cancel,
                     Err *err)
{
  Bake *b = mem_zero(1, sizeof *b);
  if (!b) return err_memory(err, "the sky's tables", sizeof *b);
  b->a = *a;
  b->pixels = pixels;
  b->eye = GROUND + max_f(a->altitude, 1) / 1000; // a float's step at this radius is half a metre
  b->horizon = PI - f_acos(to_horizon(b->eye) / b->eye);
  f_sincos(a->elevation, &b->sun_sine, &b->sun_cosine);
  set_bands(b);
  const bool ok = jobs_run(jobs, T_RADII, fill_transmittance, b, cancel) &&
                  jobs_run(jobs, M_RADII, fill_later, b, cancel) &&
                  jobs_run(jobs, ATMOSPHERE_HIGH / 2, fill_above, b, cancel);
  b->below = sky_irradiance(b);
  const Spectrum sun = sun_left(b, b->eye, b->sun_sine);
  *out = (AtmosphereLight){b->horizon, color_of(b, &sun)};
  const bool is_whole = ok && jobs_run(jobs, ATMOSPHERE_HIGH / 2, fill_below, b, cancel);
  mem_free(b);
  return is_whole || err_set(err, ERR_CANCELLED, "preparing the sky was cancelled");
}
