// See tone.h.

#include "post/tone.h"

#include "base/fmath.h"

// --- ACES -----------------------------------------------------------------------------------------
// Stephen Hill's fit of the ACES RRT and ODT (2016), with sRGB primaries taken to the rendering space and back. The
// factor 1/0.6 in front brings middle grey back to where an untouched picture has it.
static float aces_curve(float v)
{
  return (v * (v + 0.0245786f) - 0.000090537f) / (v * (0.983729f * v + 0.4329510f) + 0.238081f);
}

static Vec3 filmic(Vec3 c)
{
  c = c / 0.6f;
  const Vec3 v = c[0] * v3(0.59719f, 0.07600f, 0.02840f) + c[1] * v3(0.35458f, 0.90834f, 0.13383f) +
                 c[2] * v3(0.04823f, 0.01566f, 0.83777f);
  const Vec3 f = v3(aces_curve(v[0]), aces_curve(v[1]), aces_curve(v[2]));
  return f[0] * v3(1.60475f, -0.10208f, -0.00327f) + f[1] * v3(-0.53108f, 1.10813f, -0.07276f) +
         f[2] * v3(-0.07367f, -0.00605f, 1.07602f);
}

// --- AgX ------------------------------------------------------------------------------------------
// Troy Sobotka's AgX by Benjamin Wrensch's matrices and sixth-order contrast fit ("Minimal AgX implementation",
// 2023; mean squared error of the fit 3.7e-6). The curve ends in a 2.2 display encoding, which is undone.
static float agx_curve(float x)
{
  const float x2 = x * x, x4 = x2 * x2;
  return 15.5f * x4 * x2 - 40.14f * x4 * x + 31.96f * x4 - 6.868f * x2 * x + 0.4298f * x2 + 0.1191f * x - 0.00232f;
}

static float agx_channel(float v)
{
  const float low = -12.47393f, high = 4.026069f; // stops around 1
  const float stops = v > 0 ? f_log(v) * 1.44269504f : low;
  return agx_curve(clamp_f((stops - low) / (high - low), 0, 1));
}

static Vec3 agx(Vec3 c)
{
  const Vec3 v = c[0] * v3(0.842479062253094f, 0.0423282422610123f, 0.0423756549057051f) +
                 c[1] * v3(0.0784335999999992f, 0.878468636469772f, 0.0784336f) +
                 c[2] * v3(0.0792237451477643f, 0.0791661274605434f, 0.879142973793104f);
  const Vec3 f = v3(agx_channel(v[0]), agx_channel(v[1]), agx_channel(v[2]));
  const Vec3 out = f[0] * v3(1.19687900512017f, -0.0528968517574562f, -0.0529716355144438f) +
                   f[1] * v3(-0.0980208811401368f, 1.15190312990417f, -0.0980434501171241f) +
                   f[2] * v3(-0.0990297440797205f, -0.0989611768448433f, 1.15107367264116f);
  return v3(f_pow(max_f(out[0], 0), 2.2f), f_pow(max_f(out[1], 0), 2.2f), f_pow(max_f(out[2], 0), 2.2f));
}

// --- Khronos PBR Neutral --------------------------------------------------------------------------
// Khronos PBR Neutral Tone Mapper, specification 2024: 1:1 up to 0.8 less the Fresnel of ior 1.5, compressed above.
static Vec3 neutral(Vec3 c)
{
  const float start = 0.8f - 0.04f, desaturation = 0.15f, d = 1 - start;
  const float low = min_f(c[0], min_f(c[1], c[2]));
  c = c - v3_all(low < 0.08f ? low - 6.25f * low * low : 0.04f);
  const float peak = v3_max_lane(c);
  if (peak < start) return c;
  const float new_peak = 1 - d * d / (peak + d - start);
  const float grey = 1 - 1 / (desaturation * (peak - new_peak) + 1);
  return v3_mix(c * (new_peak / peak), v3_all(new_peak), grey);
}

// --------------------------------------------------------------------------------------------------
static float clip(float x) { return x > 0 ? min_f(x, 1) : 0; } // NaN gives 0

static float bounded(float x) { return x > 0 ? min_f(x, 1e30f) : 0; } // keeps the curves' quotients finite

static float gain_of(const Tone *t) { return f_exp(t->exposure * 0.693147181f); }

static Vec3 tone_with_gain(const Tone *t, float gain, Vec3 color)
{
  Vec3 c = v3(bounded(color[0] * gain), bounded(color[1] * gain), bounded(color[2] * gain));
  // Above this every curve has long reached white, and the squares in the fits still are finite.
  c = v3_min(c, v3_all(1e15f));
  switch (t->kind) {
  case TONE_CURVE_LINEAR: break;
  case TONE_CURVE_FILMIC: c = filmic(c); break;
  case TONE_CURVE_AGX: c = agx(c); break;
  case TONE_CURVE_NEUTRAL: c = neutral(c); break;
  }
  c = v3(clip(c[0]), clip(c[1]), clip(c[2]));
  if (t->gamma != 1) c = v3(f_pow(c[0], 1 / t->gamma), f_pow(c[1], 1 / t->gamma), f_pow(c[2], 1 / t->gamma));
  return c;
}

Vec3 tone_color(const Tone *t, Vec3 color) { return tone_with_gain(t, gain_of(t), color); }

enum { PIXELS_AN_ITEM = 16384 };

typedef struct ToneWork {
  const Tone *tone;
  float *rgba;
  size_t count;
  float gain;
} ToneWork;

static void tone_item(void *user, size_t item, int worker)
{
  const ToneWork *w = user;
  (void)worker;
  const size_t first = item * PIXELS_AN_ITEM;
  const size_t end = first + PIXELS_AN_ITEM < w->count ? first + PIXELS_AN_ITEM : w->count;
  if (w->tone->kind == TONE_CURVE_LINEAR && w->tone->gamma == 1) { // the same without steps in between
    for (size_t i = 4 * first; i < 4 * end; i++) w->rgba[i] = clip(w->rgba[i] * ((i & 3) < 3 ? w->gain : 1));
    return;
  }
  for (size_t i = first; i < end; i++) {
    float *p = w->rgba + 4 * i;
    v3_store(p, tone_with_gain(w->tone, w->gain, v3_load(p)));
    p[3] = clip(p[3]);
  }
}

void tone_pixels(const Tone *t, float *rgba, size_t pixel_count, Jobs *jobs)
{
  ToneWork w = {t, rgba, pixel_count, gain_of(t)};
  jobs_run(jobs, (pixel_count + PIXELS_AN_ITEM - 1) / PIXELS_AN_ITEM, tone_item, &w, NULL);
}
