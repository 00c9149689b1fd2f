// Texture lookup: orientation, wrapping, filters, every stored type and channel count, and uv that make no sense.

#include "tests/test.h"

#include "shade/texture_lookup.h"

static TextureMap map_of(uint32_t width, uint32_t height, uint32_t channels, PixelType type, void *pixels)
{
  return (TextureMap){
      .image = {width, height, channels, type, pixels}, .uv_map = {{1, 0, 0}, {0, 1, 0}}, .gain = {1, 1, 1}, .alpha_gain = 1};
}

static const float *look(const TextureMap *t, float u, float v)
{
  static float rgba[4];
  const SurfacePoint s = {.uv = {{u, v}, {u + 0.5f, v}}};
  texture_lookup(t, &s, rgba);
  return rgba;
}

TEST(v_runs_up_and_texels_sit_at_half_integers)
{
  float pixels[] = {1, 2, 3, 4}; // top row 1 2, bottom row 3 4
  TextureMap t = map_of(2, 2, 1, PIXEL_F32, pixels);
  CHECK(look(&t, 0.25f, 0.25f)[0] == 3 && look(&t, 0.75f, 0.25f)[0] == 4);
  CHECK(look(&t, 0.25f, 0.75f)[0] == 1 && look(&t, 0.75f, 0.75f)[2] == 2);
  CHECK(look(&t, 0.5f, 0.5f)[1] == 2.5f && look(&t, 0.5f, 0.25f)[0] == 3.5f);
  t.is_nearest = true;
  CHECK(look(&t, 0.01f, 0.01f)[0] == 3 && look(&t, 0.99f, 0.99f)[0] == 2 && look(&t, 0.49f, 0.49f)[0] == 3);
}

TEST(edges_wrap_as_asked)
{
  float pixels[] = {0, 1, 2, 4};
  TextureMap t = map_of(4, 1, 1, PIXEL_F32, pixels);
  CHECK(look(&t, 1.125f, 0)[0] == 0 && look(&t, -0.125f, 0)[0] == 4);
  CHECK(look(&t, 0, 0)[0] == 2 && look(&t, 1, 0)[0] == 2); // between the last and the first
  t.wrap_u = TEXTURE_CLAMP;
  CHECK(look(&t, 0, 0)[0] == 0 && look(&t, 1, 0)[0] == 4 && look(&t, 9, 0)[0] == 4 &&
        look(&t, -9, 0)[0] == 0);
  t.wrap_u = TEXTURE_MIRROR;
  CHECK(look(&t, 1.125f, 0)[0] == 4 && look(&t, -0.125f, 0)[0] == 0 && look(&t, 1.875f, 0)[0] == 0);
  CHECK(look(&t, 1, 0)[0] == 4 && look(&t, 2.375f, 0)[0] == 1);
}

TEST(types_and_channels_are_expanded)
{
  uint8_t grey[] = {128}, grey_alpha[] = {255, 128}, rgba[] = {255, 0, 128, 128};
  TextureMap t = map_of(1, 1, 1, PIXEL_U8, grey);
  CHECK_NEAR(look(&t, 0, 0)[2], 128 / 255.0, 1e-7);
  CHECK(look(&t, 0, 0)[3] == 1);
  t.is_srgb = true;
  CHECK(look(&t, 0, 0)[0] == srgb_from_u8[128]);
  t = map_of(1, 1, 2, PIXEL_U8, grey_alpha);
  t.is_srgb = true;
  CHECK(look(&t, 0, 0)[1] == 1);
  CHECK_NEAR(look(&t, 0, 0)[3], 128 / 255.0, 1e-7); // alpha is never decoded
  t = map_of(1, 1, 4, PIXEL_U8, rgba);
  CHECK(look(&t, 0, 0)[0] == 1 && look(&t, 0, 0)[1] == 0);
  CHECK_NEAR(look(&t, 0, 0)[3], 128 / 255.0, 1e-7);
  uint16_t deep[] = {65535, 257 * 128, 0};
  t = map_of(1, 1, 3, PIXEL_U16, deep);
  t.is_srgb = true;
  CHECK(look(&t, 0, 0)[0] == 1 && look(&t, 0, 0)[2] == 0);
  CHECK_NEAR(look(&t, 0, 0)[1], srgb_from_u8[128], 1e-7);
  uint16_t half[] = {0x3c00, 0xc000, 0x0001}; // 1, -2, the smallest
  t = map_of(1, 1, 3, PIXEL_F16, half);
  CHECK(look(&t, 0, 0)[0] == 1 && look(&t, 0, 0)[1] == -2 && look(&t, 0, 0)[2] == 0x1p-24f);
}

TEST(halves_are_what_the_image_room_says)
{
  for (uint32_t h = 0; h < 65536; h++) {
    const float mine = texel_half((uint16_t)h), other = half_to_float((uint16_t)h);
    CHECK_MSG(mine == (isfinite(other) ? other : 0), "%04x: %g, %g", h, (double)mine, (double)other);
  }
}

TEST(map_gain_bias_and_sets)
{
  float pixels[] = {1, 2, 3, 4};
  TextureMap t = map_of(4, 1, 1, PIXEL_F32, pixels);
  t.gain[0] = 2, t.bias[0] = 1, t.bias[1] = -1;
  CHECK(look(&t, 0.125f, 0)[0] == 3 && look(&t, 0.125f, 0)[1] == 0 && look(&t, 0.125f, 0)[2] == 1);
  t.texcoord = 1;
  CHECK(look(&t, 0.125f, 0)[2] == 3);
  t.texcoord = 0;
  t.uv_map[0][0] = 0, t.uv_map[0][1] = 1, t.uv_map[0][2] = 0.25f; // u' = v + 1/4
  CHECK(look(&t, 0.9f, 0.125f)[2] == 2);
  const SurfacePoint s = {.uv = {{0, 0.125f}, {0, 0}}};
  const TextureRef none = {-1, 2}, blue = {0, 2};
  CHECK(texture_channel(&t, none, &s) == 1 && texture_channel(&t, blue, &s) == 2);
  CHECK(texture_color(&t, none, &s)[0] == 1 && texture_color(&t, blue, &s)[0] == 5);
}

TEST(checker_fields_are_half_of_uv_wide)
{
  TextureMap t = map_of(0, 0, 0, PIXEL_U8, NULL);
  t.kind = TEXTURE_MAP_CHECKER;
  t.color_a[0] = 1;
  t.color_b[0] = 0.5f;
  CHECK(look(&t, 0.1f, 0.1f)[0] == 1 && look(&t, 0.6f, 0.1f)[0] == 0.5f && look(&t, 0.6f, 0.6f)[0] == 1);
  CHECK(look(&t, -0.1f, 0.1f)[0] == 0.5f && look(&t, 1.1f, 7.1f)[0] == 1);
}

TEST(odd_numbers_give_some_texel)
{
  float pixels[] = {1, 1, NAN, INFINITY, 1, 1, 1, 1, 1};
  const float odd[] = {NAN,   INFINITY, -INFINITY,      1e30f, -1e30f,       3e9f,
                       -0.0f, -1e-30f,  0x1.fffffep-1f, 1,     2147483648.0f};
  for (int kind = 0; kind < 2; kind++)
    for (int wrap = 0; wrap < 9; wrap++)
      for (int i = 0; i < 121; i++) {
        TextureMap t = map_of(3, 3, 1, PIXEL_F32, pixels);
        t.kind = (uint8_t)kind;
        t.wrap_u = (uint8_t)(wrap % 3), t.wrap_v = (uint8_t)(wrap / 3);
        t.is_nearest = i & 1;
        const float *c = look(&t, odd[i % 11], odd[i / 11]);
        CHECK(c[0] >= 0 && c[0] <= 1 && c[3] == 1);
      }
  const TextureMap empty = map_of(0, 0, 0, PIXEL_U8, NULL);
  CHECK(look(&empty, 0.5f, 0.5f)[0] == 1);
}

TEST_MAIN
