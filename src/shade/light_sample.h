// Aiming at lights, and how likely a direction would have been aimed at. Hot. A vertex asks each group once:
//
//   group 0            one of the emitters, chosen by what it may send here (absent if there are none)
//   then               each sun
//   last               the sky, if it varies; a constant one is left to the BSDF, which does it without noise
//
// Densities are per solid angle and include the choice within the group, so that multiple importance sampling weighs
// a group's sample against the BSDF's. Delta lights have a density that is a probability, and is_delta set.

#ifndef RAYFOLD_SHADE_LIGHT_SAMPLE_H
#define RAYFOLD_SHADE_LIGHT_SAMPLE_H

#include "base/fmath.h"
#include "shade/light.h"
#include "shade/texture_lookup.h"

typedef struct LightSample {
  Vec3 wl;       // unit, towards the light
  Vec3 radiance; // arriving from there if nothing is between; of delta lights: irradiance at normal incidence
  float distance; // to the light; INFINITY for suns and sky
  float pdf;
  bool is_delta;
  uint32_t image; // as the lamp's
} LightSample;

static inline size_t light_group_count(const LightSet *set)
{
  return (set->emitter_count > 0) + set->sun_count + set->sky.is_sampled;
}

// The last index i with cdf[i] <= u, so that cdf[i] <= u < cdf[i + 1]; never a step of no width.
static inline size_t cdf_find(const float *cdf, size_t count, float u)
{
  size_t low = 0, high = count;
  while (high - low > 1) {
    const size_t middle = (low + high) / 2;
    if (cdf[middle] <= u)
      low = middle;
    else
      high = middle;
  }
  return low;
}

// A direction within a cone around a unit axis, uniform in solid angle 2 pi one_minus_cos.
static inline Vec3 cone_direction(Vec3 axis, float one_minus_cos, Vec2 u)
{
  const float h = u.x * one_minus_cos; // 1 - cos theta
  const float sine = safe_sqrt(h * (2 - h));
  float s, c;
  f_sincos(2 * PI * u.y, &s, &c);
  const Frame f = frame_around(axis);
  return v3_normalize(sine * c * f.x + sine * s * f.y + (1 - h) * f.z);
}

// --- emitters -------------------------------------------------------------------------------------
// The density of a direction to a point `distance` away on a surface of this area, whose normal makes cos_light.
static inline float area_pdf(float area, float distance, float cos_light)
{
  return distance * distance / (area * max_f(cos_light, 1e-12f));
}

// Seen from p, is the sphere something outside? On its own skin or inside it has no cone.
static inline bool sphere_is_outside(const Emitter *e, float distance2)
{
  return distance2 > e->radius * e->radius * 1.0001f;
}

// 1 - cos of the half angle of the cone the sphere fills: sin^2 / (1 + cos), which keeps its digits when small.
static inline float sphere_one_minus_cos(const Emitter *e, float distance2)
{
  const float sin2 = e->radius * e->radius / distance2;
  return sin2 / (1 + safe_sqrt(1 - sin2));
}

static inline Vec3 emitter_texture(const Emitter *e, const TextureMap *maps, float u, float v)
{
  if (e->map < 0) return v3_all(1);
  const SurfacePoint s = {.uv = {{u, v}, {u, v}}};
  return texture_color(maps, (TextureRef){e->map, 0}, &s);
}

// A point of a flat emitter, uniform by area, with its texture coordinates. By solid angle (Urena, Fajardo and King 2013) a
// Cornell box at 64 samples had 7 % less relMSE and took 23 % more CPU time: a loss.
static inline Vec3 flat_point(const Emitter *e, Vec2 u, Vec2 *uv)
{
  if (e->kind == EMITTER_TRIANGLE) {
    // Uniform barycentric weights (Turk, Graphics Gems 1990).
    const float root = sqrtf(u.x), b1 = root * (1 - u.y), b2 = root * u.y, b0 = 1 - root;
    uv->x = b0 * e->uv[0][0] + b1 * e->uv[1][0] + b2 * e->uv[2][0];
    uv->y = b0 * e->uv[0][1] + b1 * e->uv[1][1] + b2 * e->uv[2][1];
    return e->p + b1 * e->x + b2 * e->y;
  }
  if (e->kind == EMITTER_DISK) {
    float s, c;
    f_sincos(2 * PI * u.y, &s, &c);
    const float r = sqrtf(u.x);
    *uv = (Vec2){0.5f + 0.5f * r * c, 0.5f + 0.5f * r * s};
    return e->p + r * c * e->x + r * s * e->y;
  }
  *uv = u;
  return e->p + u.x * e->x + u.y * e->y;
}

static inline bool flat_sample(const Emitter *e, const TextureMap *maps, Vec3 p, Vec2 u, LightSample *out)
{
  Vec2 uv;
  const Vec3 d = flat_point(e, u, &uv) - p, n = v3_normalize(v3_cross(e->x, e->y));
  out->distance = v3_length(d);
  if (!(out->distance > 0)) return false;
  out->wl = d / out->distance;
  const float cosine = -v3_dot(out->wl, n), cos_light = e->is_two_sided ? fabsf(cosine) : cosine;
  if (!(cos_light > 0)) return false;
  out->radiance = e->color * emitter_texture(e, maps, uv.x, uv.y);
  out->pdf = area_pdf(e->area, out->distance, cos_light);
  return true;
}

// From inside, where a sphere only shines if it is two-sided: a point uniform by area.
static inline bool sphere_sample_inside(const Emitter *e, Vec3 p, Vec2 u, LightSample *out)
{
  if (!e->is_two_sided) return false;
  const float z = 1 - 2 * u.x, r = safe_sqrt(1 - z * z);
  float s, c;
  f_sincos(2 * PI * u.y, &s, &c);
  const Vec3 n = v3(r * c, r * s, z), d = e->p + e->radius * n - p;
  out->distance = v3_length(d);
  if (!(out->distance > 0)) return false;
  out->wl = d / out->distance;
  out->radiance = e->color;
  out->pdf = area_pdf(e->area, out->distance, fabsf(v3_dot(out->wl, n)));
  return true;
}

// From outside: uniform in the solid angle the sphere fills (Shirley, Wang and Zimmerman 1996, section 3.2).
static inline bool sphere_sample(const Emitter *e, Vec3 p, Vec2 u, LightSample *out)
{
  const Vec3 to_centre = e->p - p;
  const float distance2 = v3_dot(to_centre, to_centre);
  if (!sphere_is_outside(e, distance2)) return sphere_sample_inside(e, p, u, out);
  const float cone = sphere_one_minus_cos(e, distance2);
  out->wl = cone_direction(v3_normalize(to_centre), cone, u);
  const float along = v3_dot(out->wl, to_centre);
  const float miss2 = v3_dot(to_centre - along * out->wl, to_centre - along * out->wl);
  out->distance = along - safe_sqrt(e->radius * e->radius - miss2);
  out->radiance = e->color;
  out->pdf = 1 / (2 * PI * cone);
  return out->distance > 0;
}

static inline float spot_falloff(const Emitter *e, float cosine)
{
  if (cosine <= e->cos_outer) return 0;
  if (cosine >= e->cos_inner) return 1;
  const float t = (cosine - e->cos_outer) / (e->cos_inner - e->cos_outer);
  return t * t * (3 - 2 * t);
}

// The step of ascending angles that `at` falls into, and how far; beyond the ends they are held.
static inline uint32_t profile_step(const float *angles, uint32_t count, float at, float *rest)
{
  uint32_t low = 0, high = count - 1;
  while (high - low > 1) {
    const uint32_t middle = (low + high) / 2;
    if (angles[middle] <= at)
      low = middle;
    else
      high = middle;
  }
  *rest = high > low ? clamp_f((at - angles[low]) / (angles[high] - angles[low]), 0, 1) : 0;
  return low;
}

// Linear between the file's angles, in degrees; nothing outside its vertical ones.
static inline float profile_value(const LightProfile *f, float vertical, float horizontal)
{
  const uint32_t rows = f->vertical_count;
  if (vertical < f->vertical[0] || vertical > f->vertical[rows - 1]) return 0;
  float across, around;
  const uint32_t v = profile_step(f->vertical, rows, vertical, &across);
  const uint32_t h = profile_step(f->horizontal, f->horizontal_count, horizontal, &around);
  const float *a = f->value + (size_t)h * rows + v, *b = f->horizontal_count > 1 ? a + rows : a;
  return (1 - around) * ((1 - across) * a[0] + across * a[1]) + around * ((1 - across) * b[0] + across * b[1]);
}

// What a profile leaves of the light that goes along unit d, away from the lamp.
static inline float emitter_profile(const LightSet *set, const Emitter *e, Vec3 d)
{
  if (!e->profile) return 1;
  const float degrees = 180 / PI, hand = e->is_mirrored ? -degrees : degrees,
              turn = f_atan2(v3_dot(d, v3_cross(e->y, e->x)), v3_dot(d, e->y)) * hand;
  return profile_value(&set->profiles[e->profile - 1], f_acos(clamp_f(v3_dot(d, e->x), -1, 1)) * degrees,
                       turn < 0 ? turn + 360 : turn);
}

static inline bool point_sample(const LightSet *set, const Emitter *e, Vec3 p, LightSample *out)
{
  const Vec3 d = e->p - p;
  out->distance = v3_length(d);
  if (!(out->distance > 0)) return false;
  out->wl = d / out->distance;
  out->radiance = e->color / (out->distance * out->distance);
  if (e->kind == EMITTER_SPOT) out->radiance = out->radiance * spot_falloff(e, -v3_dot(out->wl, e->x));
  out->radiance = out->radiance * emitter_profile(set, e, -out->wl);
  out->is_delta = true;
  out->pdf = 1;
  return !v3_is_zero(out->radiance);
}

static inline bool emitter_sample(const LightSet *set, const TextureMap *maps, Vec3 p, Vec3 n, float u_select,
                                  Vec2 u, LightSample *out)
{
  uint32_t i;
  float pmf;
  if (!light_tree_pick(&set->tree, p, n, u_select, &i, &pmf)) return false;
  const Emitter *e = &set->emitters[i];
  bool ok = false;
  switch ((EmitterKind)e->kind) {
  case EMITTER_POINT:
  case EMITTER_SPOT: ok = point_sample(set, e, p, out); break;
  case EMITTER_TRIANGLE:
  case EMITTER_QUAD:
  case EMITTER_DISK: ok = flat_sample(e, maps, p, u, out); break;
  case EMITTER_SPHERE: ok = sphere_sample(e, p, u, out); break;
  }
  out->pdf *= pmf;
  out->image = e->image;
  return ok && out->pdf > 0 && isfinite(out->pdf);
}

// The density light_sample() has for a direction from p that meets emitter i at this distance, its normal making
// cos_light with the ray; n as there.
static inline float light_pdf_emitter(const LightSet *set, uint32_t i, Vec3 p, Vec3 n, float distance,
                                      float cos_light)
{
  const Emitter *e = &set->emitters[i];
  const float pmf = light_tree_pmf(&set->tree, p, n, i);
  if (e->kind == EMITTER_SPHERE) {
    const float distance2 = v3_dot(e->p - p, e->p - p);
    if (sphere_is_outside(e, distance2))
      return pmf / (2 * PI * sphere_one_minus_cos(e, distance2));
    if (!e->is_two_sided) return 0;
  }
  if (!(e->area > 0)) return 0; // points are never met
  return pmf * area_pdf(e->area, distance, fabsf(cos_light));
}

// --- suns -----------------------------------------------------------------------------------------
static inline bool sun_is_delta(const Sun *s)
{
  return s->one_minus_cos == 0;
}

static inline bool sun_covers(const Sun *s, Vec3 d)
{
  const Vec3 off = d - s->direction; // |off|^2 = 2 (1 - cos)
  return !sun_is_delta(s) && v3_dot(off, off) <= 2 * s->one_minus_cos;
}

// What a ray that leaves the scene along unit d sees of this sun, and its density there.
static inline Vec3 sun_radiance(const Sun *s, Vec3 d)
{
  return sun_covers(s, d) ? s->radiance : v3_all(0);
}
static inline float sun_pdf(const Sun *s, Vec3 d)
{
  return sun_covers(s, d) ? 1 / (2 * PI * s->one_minus_cos) : 0;
}

// All suns' disks, for rays that miss everything and are not weighed against sampling.
static inline Vec3 sun_radiance_seen(const LightSet *set, Vec3 d)
{
  Vec3 sum = v3_all(0);
  for (size_t i = 0; i < set->sun_count; i++) sum += sun_radiance(&set->suns[i], d);
  return sum;
}

static inline bool sun_sample(const Sun *s, Vec2 u, LightSample *out)
{
  out->distance = INFINITY;
  out->image = s->image;
  out->radiance = s->radiance;
  out->is_delta = sun_is_delta(s);
  out->wl = out->is_delta ? s->direction : cone_direction(s->direction, s->one_minus_cos, u);
  out->pdf = out->is_delta ? 1 : 1 / (2 * PI * s->one_minus_cos);
  return true;
}

// --- sky ------------------------------------------------------------------------------------------
static inline Vec3 sky_texel(const Image *img, uint32_t x, uint32_t y)
{
  const size_t at = ((size_t)y * img->width + x) * img->channels;
  if (img->type == PIXEL_F32) return v3_load((const float *)img->pixels + at);
  const uint16_t *h = (const uint16_t *)img->pixels + at;
  return v3(half_to_float(h[0]), half_to_float(h[1]), half_to_float(h[2]));
}

// Linear in height from the horizon up to the zenith and down to the ground.
static inline Vec3 sky_gradient(const SkyMap *sky, float y)
{
  return y >= 0 ? v3_mix(sky->horizon, sky->color, min_f(y, 1))
                : v3_mix(sky->horizon, sky->ground, min_f(-y, 1));
}

// Rows of the panorama: an angle from the zenith to v and back, and solid angle over (u, v).
static inline float sky_row(const SkyMap *sky, float theta)
{
  const float h = sky->horizon_angle;
  if (h == 0) return theta / PI;
  return theta < h ? 0.5f - 0.5f * safe_sqrt(1 - theta / h) : 0.5f + 0.5f * safe_sqrt((theta - h) / (PI - h));
}

static inline float sky_theta(const SkyMap *sky, float v)
{
  const float h = sky->horizon_angle, part = 2 * v - 1;
  if (h == 0) return v * PI;
  return part < 0 ? h * (1 - part * part) : h + (PI - h) * (part * part);
}

static inline float sky_row_weight(const SkyMap *sky, float v)
{
  const float h = sky->horizon_angle, part = 2 * v - 1, sine = f_sin(sky_theta(sky, v));
  return h == 0 ? 2 * PI * PI * sine : 8 * PI * sine * (part < 0 ? -part * h : part * (PI - h));
}

// Where a direction lies in the panorama: u runs right with -z in the middle, v down from the zenith; 0..1.
static inline Vec2 sky_uv(const SkyMap *sky, Vec3 d)
{
  const float turn = (f_atan2(d[0], -d[2]) + sky->rotation) / (2 * PI);
  const float u = 0.5f + turn;
  return (Vec2){min_f(u - floorf(u), 0x1.fffffep-1f), clamp_f(sky_row(sky, f_acos(d[1])), 0, 0x1.fffffep-1f)};
}

static inline Vec3 sky_direction(const SkyMap *sky, Vec2 uv)
{
  float sin_phi, cos_phi, sin_theta, cos_theta;
  f_sincos((uv.x - 0.5f) * 2 * PI - sky->rotation, &sin_phi, &cos_phi);
  f_sincos(sky_theta(sky, uv.y), &sin_theta, &cos_theta);
  return v3(sin_theta * sin_phi, cos_theta, -sin_theta * cos_phi);
}

static inline Vec3 sky_image(const SkyMap *sky, Vec2 uv)
{
  const Image *img = &sky->image;
  if (!img->pixels) return v3_all(0);
  const float x = uv.x * (float)img->width - 0.5f,
              y = clamp_f(uv.y * (float)img->height - 0.5f, 0, (float)(img->height - 1));
  const float x_floor = floorf(x), y_floor = floorf(y);
  const uint32_t x0 = x_floor < 0 ? img->width - 1 : (uint32_t)x_floor, x1 = x0 + 1 < img->width ? x0 + 1 : 0;
  const uint32_t y0 = (uint32_t)y_floor, y1 = y0 + 1 < img->height ? y0 + 1 : y0;
  const Vec3 above = v3_mix(sky_texel(img, x0, y0), sky_texel(img, x1, y0), x - x_floor);
  const Vec3 below = v3_mix(sky_texel(img, x0, y1), sky_texel(img, x1, y1), x - x_floor);
  return v3_mix(above, below, y - y_floor);
}

// Radiance from unit direction d, far away.
static inline Vec3 sky_radiance(const SkyMap *sky, Vec3 d)
{
  switch ((SkyMapKind)sky->kind) {
  case SKY_MAP_CONSTANT: return sky->color * sky->gain;
  case SKY_MAP_GRADIENT: return sky_gradient(sky, d[1]) * sky->gain;
  case SKY_MAP_IMAGE: return sky_image(sky, sky_uv(sky, d)) * sky->gain;
  }
  unreachable();
}

// Density per solid angle: that of (u, v) over the Jacobian, for rows at equal angles 2 pi^2 sin theta (pbrt, "Infinite
// area lights").
static inline float sky_grid_pdf(const SkyMap *sky, Vec2 uv)
{
  const size_t width = sky->grid_width, height = sky->grid_height;
  const size_t x = (size_t)min_f(uv.x * (float)width, (float)(width - 1));
  const size_t y = (size_t)min_f(uv.y * (float)height, (float)(height - 1));
  const float *row = sky->cell_cdf + y * (width + 1);
  const float p = (sky->row_cdf[y + 1] - sky->row_cdf[y]) * (row[x + 1] - row[x]);
  const float weight = sky_row_weight(sky, uv.y);
  return weight > 0 ? p * (float)(width * height) / weight : 0;
}

static inline float sky_pdf(const SkyMap *sky, Vec3 d)
{
  return sky->is_sampled ? sky_grid_pdf(sky, sky_uv(sky, d)) : 0;
}

// Where in its step u fell, 0..1.
static inline float cdf_rest(const float *cdf, size_t i, float u)
{
  return clamp_f((u - cdf[i]) / max_f(cdf[i + 1] - cdf[i], 1e-30f), 0, 0x1.fffffep-1f);
}

static inline bool sky_sample(const SkyMap *sky, Vec2 u, LightSample *out)
{
  const size_t width = sky->grid_width, height = sky->grid_height;
  const size_t y = cdf_find(sky->row_cdf, height, u.y);
  const float *row = sky->cell_cdf + y * (width + 1);
  const size_t x = cdf_find(row, width, u.x);
  const Vec2 uv = {((float)x + cdf_rest(row, x, u.x)) / (float)width,
                   ((float)y + cdf_rest(sky->row_cdf, y, u.y)) / (float)height};
  out->wl = v3_normalize(sky_direction(sky, uv));
  out->distance = INFINITY;
  out->radiance = sky_radiance(sky, out->wl);
  out->pdf = sky_grid_pdf(sky, uv);
  return out->pdf > 0;
}

// --------------------------------------------------------------------------------------------------
// One sample of a group as seen from p. n: the shading normal there, zero if light counts from both sides. False: this
// sample carries no light; it still counts as a sample of value zero.
static inline bool light_sample(const LightSet *set, const TextureMap *maps, size_t group, Vec3 p, Vec3 n,
                                float u_select, Vec2 u, LightSample *out)
{
  *out = (LightSample){0};
  if (set->emitter_count > 0) {
    if (group == 0) return emitter_sample(set, maps, p, n, u_select, u, out);
    group--;
  }
  if (group < set->sun_count) return sun_sample(&set->suns[group], u, out);
  return sky_sample(&set->sky, u, out);
}

#endif
