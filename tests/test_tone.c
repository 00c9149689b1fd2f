// Tone curves against what their authors publish, and against nonsense.

#include "tests/test.h"

#include "image/image.h"
#include "post/tone.h"

static Vec3 apply(ToneKind kind, float exposure, float r, float g, float b)
{
  const Tone t = {kind, exposure, 1};
  return tone_color(&t, v3(r, g, b));
}

TEST(linear_is_exposure_and_clip)
{
  CHECK_NEAR(apply(TONE_CURVE_LINEAR, 0, 0.25f, 0, 0)[0], 0.25, 0);
  CHECK_NEAR(apply(TONE_CURVE_LINEAR, 1, 0.25f, 0, 0)[0], 0.5, 1e-6);
  CHECK_NEAR(apply(TONE_CURVE_LINEAR, 0, 7, 0, 0)[0], 1, 0);
}

// The specification's words: below 0.8 - F90, colours lose the Fresnel offset of 0.04 and nothing else.
TEST(neutral_keeps_base_colours)
{
  for (float x = 0.08f; x < 0.75f; x += 0.01f) {
    const Vec3 c = apply(TONE_CURVE_NEUTRAL, 0, x + 0.04f, 0.08f + 0.04f, 0.1f + 0.04f);
    if (x + 0.04f - 0.04f < 0.76f) CHECK_NEAR(c[0], x, 1e-6);
    CHECK_NEAR(c[1], 0.08, 1e-6);
  }
}

// The same curves in double precision, written from the formulas a second time.
static double reference(ToneKind kind, const double in[3], int channel)
{
  double c[3], v[3];
  if (kind == TONE_CURVE_FILMIC) {
    static const double to[3][3] = {{.59719, .35458, .04823}, {.076, .90834, .01566}, {.0284, .13383, .83777}};
    static const double back[3][3] = {{1.60475, -.53108, -.07367}, {-.10208, 1.10813, -.00605}, {-.00327, -.07276, 1.07602}};
    for (int i = 0; i < 3; i++) {
      v[i] = 0;
      for (int k = 0; k < 3; k++) v[i] += to[i][k] * in[k] / 0.6;
      v[i] = (v[i] * (v[i] + .0245786) - .000090537) / (v[i] * (.983729 * v[i] + .432951) + .238081);
    }
    double out = 0;
    for (int k = 0; k < 3; k++) out += back[channel][k] * v[k];
    return fmin(fmax(out, 0), 1);
  }
  static const double to[3][3] = {{.842479062253094, .0784335999999992, .0792237451477643},
                                  {.0423282422610123, .878468636469772, .0791661274605434},
                                  {.0423756549057051, .0784336, .879142973793104}};
  static const double back[3][3] = {{1.19687900512017, -.0980208811401368, -.0990297440797205},
                                    {-.0528968517574562, 1.15190312990417, -.0989611768448433},
                                    {-.0529716355144438, -.0980434501171241, 1.15107367264116}};
  for (int i = 0; i < 3; i++) {
    v[i] = 0;
    for (int k = 0; k < 3; k++) v[i] += to[i][k] * in[k];
    const double x = fmin(fmax((log2(fmax(v[i], 1e-30)) + 12.47393) / 16.499999, 0), 1);
    c[i] = 15.5 * pow(x, 6) - 40.14 * pow(x, 5) + 31.96 * pow(x, 4) - 6.868 * x * x * x + .4298 * x * x + .1191 * x - .00232;
  }
  double out = 0;
  for (int k = 0; k < 3; k++) out += back[channel][k] * c[k];
  return fmin(fmax(pow(fmax(out, 0), 2.2), 0), 1);
}

// P16: ten thousand values, at most one step of an 8-bit file apart.
TEST(curves_match_their_formulas)
{
  unsigned state = 1;
  for (int i = 0; i < 10000; i++) {
    double in[3];
    for (int k = 0; k < 3; k++) {
      state = state * 1664525u + 1013904223u;
      in[k] = exp2((state >> 8) / 16777216.0 * 16 - 10);
    }
    for (int kind = TONE_CURVE_FILMIC; kind <= TONE_CURVE_AGX; kind++) {
      const Vec3 c = apply((ToneKind)kind, 0, (float)in[0], (float)in[1], (float)in[2]);
      for (int k = 0; k < 3; k++)
        CHECK(abs(srgb_to_u8(c[k]) - srgb_to_u8((float)reference((ToneKind)kind, in, k))) <= 1);
    }
  }
}

TEST(nonsense_stays_in_range)
{
  const float odd[] = {NAN, INFINITY, -INFINITY, -1, 0, 1e38f, 1e-38f};
  for (int kind = 0; kind < 4; kind++)
    for (int i = 0; i < 7; i++)
      for (int k = 0; k < 7; k++) {
        const Vec3 c = apply((ToneKind)kind, 3, odd[i], odd[k], 0.5f);
        for (int n = 0; n < 3; n++) CHECK_MSG(c[n] >= 0 && c[n] <= 1, "curve %d gives %g", kind, (double)c[n]);
      }
}

TEST(white_is_reached_and_order_kept)
{
  for (int kind = 0; kind < 4; kind++) {
    float last = 0;
    for (float x = 0.001f; x < 1000; x *= 1.2f) {
      const float y = apply((ToneKind)kind, 0, x, x, x)[1];
      CHECK(y >= last - 2e-4f); // AgX's polynomial fit dips by that much at its ends
      last = y;
    }
    CHECK(last > 0.95f);
  }
}

TEST_MAIN
