// Colour codes: the sRGB transfer curve, half floats, and rows of a picture on their way to a display format. The
// tables make 8 bits exact in both directions; 16 bits go by powf(), whose error is far below a step of theirs.
// Knows no colour space but Rec.709 primaries with the sRGB curve.

#include "image/format.h"

#include "base/mem.h"
#include "base/vec.h"

#include <string.h>

// The three tables are computed from the curve with 200 bits: the decoded values rounded to float; code_edge[i], the
// smallest float that is encoded as i + 1, so where 255 times the curve reaches i + 1/2; and code_guess[k], a code
// not above any of floats whose root lies in [k, k + 1) / 256, and at most two below.
// clang-format off
const float srgb_from_u8[256] = {
  0.0f, 0.000303527f, 0.000607054f, 0.000910581f, 0.001214108f, 0.001517635f, 0.001821162f, 0.0021246888f,
  0.002428216f, 0.0027317428f, 0.00303527f, 0.0033465358f, 0.0036765074f, 0.004024717f, 0.004391442f,
  0.0047769533f, 0.0051815165f, 0.0056053917f, 0.006048833f, 0.0065120906f, 0.00699541f, 0.007499032f,
  0.008023193f, 0.008568126f, 0.009134059f, 0.009721218f, 0.010329823f, 0.010960094f, 0.011612245f,
  0.012286488f, 0.0129830325f, 0.013702083f, 0.014443844f, 0.015208514f, 0.015996294f, 0.016807375f,
  0.017641954f, 0.01850022f, 0.019382361f, 0.020288562f, 0.02121901f, 0.022173885f, 0.023153367f,
  0.024157632f, 0.02518686f, 0.026241222f, 0.027320892f, 0.02842604f, 0.029556835f, 0.030713445f,
  0.031896032f, 0.033104766f, 0.034339808f, 0.035601314f, 0.03688945f, 0.038204372f, 0.039546236f,
  0.0409152f, 0.04231141f, 0.04373503f, 0.045186203f, 0.046665087f, 0.048171826f, 0.049706567f,
  0.051269457f, 0.052860647f, 0.054480277f, 0.05612849f, 0.05780543f, 0.059511237f, 0.061246052f,
  0.063010015f, 0.064803265f, 0.06662594f, 0.06847817f, 0.070360094f, 0.07227185f, 0.07421357f, 0.07618538f,
  0.07818742f, 0.08021982f, 0.08228271f, 0.08437621f, 0.08650046f, 0.08865558f, 0.09084171f, 0.093058966f,
  0.09530747f, 0.09758735f, 0.099898726f, 0.10224173f, 0.104616486f, 0.107023105f, 0.10946171f, 0.11193243f,
  0.114435375f, 0.116970666f, 0.11953843f, 0.122138776f, 0.12477182f, 0.12743768f, 0.13013647f, 0.13286832f,
  0.13563333f, 0.13843161f, 0.14126329f, 0.14412847f, 0.14702727f, 0.14995979f, 0.15292615f, 0.15592647f,
  0.15896083f, 0.16202937f, 0.1651322f, 0.1682694f, 0.17144111f, 0.1746474f, 0.17788842f, 0.18116425f,
  0.18447499f, 0.18782078f, 0.19120169f, 0.19461784f, 0.19806932f, 0.20155625f, 0.20507874f, 0.20863687f,
  0.21223076f, 0.2158605f, 0.2195262f, 0.22322796f, 0.22696587f, 0.23074006f, 0.23455058f, 0.23839757f,
  0.24228112f, 0.24620132f, 0.25015828f, 0.2541521f, 0.25818285f, 0.26225066f, 0.2663556f, 0.2704978f,
  0.2746773f, 0.27889428f, 0.28314874f, 0.28744084f, 0.29177064f, 0.29613826f, 0.30054379f, 0.3049873f,
  0.30946892f, 0.31398872f, 0.31854677f, 0.3231432f, 0.3277781f, 0.33245152f, 0.33716363f, 0.34191442f,
  0.34670407f, 0.3515326f, 0.35640013f, 0.3613068f, 0.3662526f, 0.3712377f, 0.37626213f, 0.38132602f,
  0.38642943f, 0.39157248f, 0.39675522f, 0.40197778f, 0.4072402f, 0.4125426f, 0.41788507f, 0.42326766f,
  0.4286905f, 0.43415365f, 0.43965718f, 0.4452012f, 0.4507858f, 0.45641103f, 0.462077f, 0.4677838f,
  0.47353148f, 0.47932017f, 0.48514995f, 0.49102086f, 0.49693298f, 0.5028865f, 0.50888133f, 0.5149177f,
  0.52099556f, 0.5271151f, 0.5332764f, 0.5394795f, 0.54572445f, 0.55201143f, 0.5583404f, 0.5647115f,
  0.57112485f, 0.57758045f, 0.58407843f, 0.59061885f, 0.59720176f, 0.60382736f, 0.61049557f, 0.6172066f,
  0.6239604f, 0.63075715f, 0.63759685f, 0.6444797f, 0.65140563f, 0.65837485f, 0.6653873f, 0.67244315f,
  0.6795425f, 0.6866853f, 0.69387174f, 0.7011019f, 0.70837575f, 0.7156935f, 0.7230551f, 0.73046076f,
  0.7379104f, 0.7454042f, 0.7529422f, 0.7605245f, 0.76815116f, 0.7758222f, 0.7835378f, 0.7912979f,
  0.7991027f, 0.80695224f, 0.8148466f, 0.82278574f, 0.8307699f, 0.838799f, 0.8468732f, 0.8549926f,
  0.8631572f, 0.8713671f, 0.8796224f, 0.8879231f, 0.8962694f, 0.9046612f, 0.91309863f, 0.92158186f,
  0.9301109f, 0.9386857f, 0.9473065f, 0.9559733f, 0.9646863f, 0.9734453f, 0.9822506f, 0.9911021f, 1.0f,
};

static const float code_edge[256] = {
  0.0001517635f, 0.0004552905f, 0.0007588175f, 0.0010623445f, 0.0013658715f, 0.0016693985f, 0.0019729256f,
  0.0022764525f, 0.0025799794f, 0.0028835065f, 0.003188301f, 0.0035092595f, 0.003848315f, 0.0042057484f,
  0.004581833f, 0.0049768374f, 0.0053910245f, 0.005824651f, 0.0062779696f, 0.0067512277f, 0.0072446684f,
  0.007758531f, 0.0082930485f, 0.008848454f, 0.009424971f, 0.0100228265f, 0.010642237f, 0.011283422f,
  0.0119465925f, 0.01263196f, 0.013339732f, 0.014070112f, 0.014823304f, 0.015599503f, 0.01639891f,
  0.017221717f, 0.018068116f, 0.018938296f, 0.019832443f, 0.020750746f, 0.021693384f, 0.022660539f,
  0.023652392f, 0.024669116f, 0.025710888f, 0.026777884f, 0.027870271f, 0.028988222f, 0.030131903f,
  0.031301484f, 0.032497123f, 0.03371899f, 0.034967244f, 0.036242045f, 0.037543554f, 0.03887193f,
  0.04022732f, 0.04160989f, 0.043019786f, 0.044457164f, 0.045922175f, 0.047414966f, 0.04893569f,
  0.050484486f, 0.05206151f, 0.0536669f, 0.055300802f, 0.05696336f, 0.058654718f, 0.060375012f,
  0.062124386f, 0.063902974f, 0.06571092f, 0.06754836f, 0.06941541f, 0.07131224f, 0.07323896f, 0.07519571f,
  0.07718262f, 0.07919982f, 0.08124745f, 0.083325624f, 0.08543449f, 0.08757416f, 0.08974477f, 0.091946445f,
  0.0941793f, 0.09644348f, 0.098739095f, 0.10106628f, 0.10342514f, 0.105815805f, 0.10823841f, 0.11069305f,
  0.11317987f, 0.11569897f, 0.11825049f, 0.12083452f, 0.1234512f, 0.12610064f, 0.12878296f, 0.13149826f,
  0.13424668f, 0.1370283f, 0.13984329f, 0.14269169f, 0.14557366f, 0.14848931f, 0.15143874f, 0.15442206f,
  0.1574394f, 0.16049084f, 0.1635765f, 0.1666965f, 0.16985095f, 0.17303993f, 0.17626357f, 0.17952198f,
  0.18281525f, 0.1861435f, 0.18950684f, 0.19290535f, 0.19633916f, 0.19980836f, 0.20331305f, 0.20685335f,
  0.21042934f, 0.21404114f, 0.21768886f, 0.22137257f, 0.2250924f, 0.22884843f, 0.23264077f, 0.23646952f,
  0.24033478f, 0.24423665f, 0.24817522f, 0.2521506f, 0.25616285f, 0.26021212f, 0.2642985f, 0.26842204f,
  0.2725829f, 0.2767811f, 0.28101683f, 0.2852901f, 0.28960103f, 0.29394975f, 0.2983363f, 0.3027608f,
  0.30722338f, 0.31172407f, 0.31626296f, 0.3208402f, 0.32545584f, 0.33011f, 0.33480275f, 0.3395342f,
  0.34430438f, 0.34911346f, 0.3539615f, 0.35884857f, 0.3637748f, 0.36874023f, 0.373745f, 0.37878916f,
  0.38387278f, 0.388996f, 0.3941589f, 0.39936155f, 0.40460402f, 0.40988642f, 0.41520885f, 0.42057136f,
  0.42597407f, 0.43141705f, 0.43690038f, 0.44242412f, 0.44798842f, 0.45359334f, 0.45923892f, 0.46492532f,
  0.47065255f, 0.47642073f, 0.48222995f, 0.48808026f, 0.49397177f, 0.49990457f, 0.50587875f, 0.51189435f,
  0.5179514f, 0.5240502f, 0.5301906f, 0.5363727f, 0.54259676f, 0.5488627f, 0.55517066f, 0.5615207f,
  0.56791294f, 0.5743474f, 0.58082414f, 0.58734334f, 0.59390503f, 0.6005093f, 0.60715616f, 0.61384577f,
  0.62057817f, 0.6273534f, 0.63417166f, 0.64103293f, 0.6479373f, 0.6548849f, 0.66187567f, 0.66890985f,
  0.6759874f, 0.68310845f, 0.6902731f, 0.6974814f, 0.7047334f, 0.71202916f, 0.7193689f, 0.72675246f,
  0.7341801f, 0.74165183f, 0.74916774f, 0.7567279f, 0.7643323f, 0.7719812f, 0.7796745f, 0.78741235f,
  0.7951948f, 0.8030219f, 0.81089383f, 0.8188106f, 0.8267722f, 0.83477885f, 0.84283054f, 0.8509273f,
  0.8590693f, 0.8672565f, 0.8754891f, 0.8837671f, 0.89209056f, 0.9004596f, 0.9088742f, 0.91733456f,
  0.9258407f, 0.9343926f, 0.9429904f, 0.9516342f, 0.96032405f, 0.96906f, 0.97784215f, 0.98667055f,
  0.99554527f, INFINITY,
};

static const uint8_t code_guess[256] = {
  0, 0, 0, 0, 1, 1, 2, 2, 3, 4, 5, 6, 7, 8, 10, 11, 13, 14, 15, 17, 18, 19, 21, 22, 23, 25, 26, 27, 29, 30,
  31, 32, 34, 35, 36, 37, 38, 40, 41, 42, 43, 44, 46, 47, 48, 49, 50, 51, 53, 54, 55, 56, 57, 58, 60, 61,
  62, 63, 64, 65, 66, 67, 69, 70, 71, 72, 73, 74, 75, 76, 77, 78, 79, 81, 82, 83, 84, 85, 86, 87, 88, 89,
  90, 91, 92, 93, 94, 95, 96, 98, 99, 100, 101, 102, 103, 104, 105, 106, 107, 108, 109, 110, 111, 112, 113,
  114, 115, 116, 117, 118, 119, 120, 121, 122, 123, 124, 125, 126, 127, 128, 129, 130, 131, 132, 133, 134,
  135, 136, 137, 138, 139, 140, 141, 142, 143, 144, 145, 146, 147, 148, 149, 150, 151, 152, 153, 153, 154,
  155, 156, 157, 158, 159, 160, 161, 162, 163, 164, 165, 166, 167, 168, 169, 170, 171, 172, 173, 173, 174,
  175, 176, 177, 178, 179, 180, 181, 182, 183, 184, 185, 186, 187, 187, 188, 189, 190, 191, 192, 193, 194,
  195, 196, 197, 198, 199, 199, 200, 201, 202, 203, 204, 205, 206, 207, 208, 209, 210, 210, 211, 212, 213,
  214, 215, 216, 217, 218, 219, 219, 220, 221, 222, 223, 224, 225, 226, 227, 228, 228, 229, 230, 231, 232,
  233, 234, 235, 236, 236, 237, 238, 239, 240, 241, 242, 243, 244, 244, 245, 246, 247, 248, 249, 250, 251,
  251, 252, 253, 254,
};
// clang-format on

// IEC 61966-2-1.
float srgb_encode(float linear)
{
  if (!(linear > 0)) return 0;
  if (linear >= 1) return 1;
  return linear <= 0.0031308f ? 12.92f * linear : 1.055f * powf(linear, 1 / 2.4f) - 0.055f;
}

// The curve is close to a root, so the root finds a code to start from, at most two too low. The steps have no
// branch: a picture of 1280 x 720 takes 4.5 ms so, 31 ms with a loop here, and 13 ms with powf().
uint8_t srgb_to_u8(float linear)
{
  if (!(linear > 0)) return 0;
  if (linear >= 1) return 255;
  unsigned code = code_guess[(unsigned)(sqrtf(linear) * 256)];
  code += linear >= code_edge[code];
  code += linear >= code_edge[code];
  return (uint8_t)code;
}

// --- half floats ----------------------------------------------------------------------------------
// binary16: sign, 5 bits of exponent (bias 15), 10 bits of fraction.

static uint32_t float_bits(float x)
{
  uint32_t bits;
  memcpy(&bits, &x, sizeof bits);
  return bits;
}

static float bits_float(uint32_t bits)
{
  float x;
  memcpy(&x, &bits, sizeof x);
  return x;
}

uint16_t half_from_float(float x)
{
  const uint32_t bits = float_bits(x), sign = bits >> 16 & 0x8000, rest = bits & 0x7fffffff;
  if (rest > 0x7f800000) return (uint16_t)(sign | 0x7e00 | (rest >> 13 & 0x1ff)); // NaN, quiet
  if (rest >= 0x477ff000) return (uint16_t)(sign | 0x7c00); // 65520 and above round to infinity
  // Below 2^-14 a half has fixed steps of 2^-24. Adding 0.5, whose float has just these steps, rounds to them.
  if (rest < 0x38800000) return (uint16_t)(sign | (float_bits(bits_float(rest) + 0.5f) - 0x3f000000));
  // Adding just under half a step, or half a step when the kept part is odd, rounds to nearest even.
  return (uint16_t)(sign | ((rest - 0x38000000 + 0xfff + (rest >> 13 & 1)) >> 13));
}

float half_to_float(uint16_t h)
{
  const uint32_t sign = (uint32_t)(h & 0x8000) << 16, rest = h & 0x7fff;
  if (rest >= 0x7c00) return bits_float(sign | 0x7f800000 | (rest & 0x3ff) << 13);
  if (rest < 0x400) return bits_float(sign | float_bits((float)rest * 0x1p-24f));
  return bits_float(sign | ((rest << 13) + 0x38000000));
}

// --- rows for display formats ---------------------------------------------------------------------

// Where each wanted channel comes from in a plane of `have` channels; -1 is opaque alpha.
static void map_channels(int from[4], uint32_t have, uint32_t want)
{
  const bool has_alpha = have == 2 || have == 4, wants_alpha = want == 2 || want == 4;
  const uint32_t colours = have < 3 ? 1 : 3, wanted = wants_alpha ? want - 1 : want;
  for (uint32_t c = 0; c < wanted; c++) from[c] = c < colours ? (int)c : 0;
  if (wants_alpha) from[wanted] = has_alpha ? (int)have - 1 : -1;
}

static float unit(float x)
{
  return x > 0 ? min_f(x, 1) : 0;
} // NaN gives 0

void display_row_u8(uint8_t *out, uint32_t channels, const ImageOut *img, uint32_t y)
{
  const uint32_t have = plane_channel_count(img->planes);
  const float *in = img->planes->pixels + (size_t)y * img->width * have;
  const uint32_t alpha = channels == 2 || channels == 4 ? channels - 1 : channels;
  int from[4];
  map_channels(from, have, channels);
  for (uint32_t x = 0; x < img->width; x++, in += have, out += channels) {
    for (uint32_t c = 0; c < alpha; c++) out[c] = srgb_to_u8(in[from[c]]);
    if (alpha < channels) out[alpha] = from[alpha] < 0 ? 255 : (uint8_t)(unit(in[from[alpha]]) * 255 + 0.5f);
  }
}

void display_row_u16(uint16_t *out, uint32_t channels, const ImageOut *img, uint32_t y)
{
  const uint32_t have = plane_channel_count(img->planes);
  const float *in = img->planes->pixels + (size_t)y * img->width * have;
  const uint32_t alpha = channels == 2 || channels == 4 ? channels - 1 : channels;
  int from[4];
  map_channels(from, have, channels);
  for (uint32_t x = 0; x < img->width; x++, in += have, out += channels) {
    for (uint32_t c = 0; c < alpha; c++) out[c] = (uint16_t)(srgb_encode(in[from[c]]) * 65535 + 0.5f);
    if (alpha < channels)
      out[alpha] = from[alpha] < 0 ? 65535 : (uint16_t)(unit(in[from[alpha]]) * 65535 + 0.5f);
  }
}

uint8_t *display_pixels(uint32_t channels, const ImageOut *img, Err *err)
{
  const size_t row = (size_t)img->width * channels;
  uint8_t *out = mem_alloc(row, img->height);
  if (!out) {
    err_memory(err, "a picture of 8 bits", row * img->height);
    return NULL;
  }
  for (uint32_t y = 0; y < img->height; y++) display_row_u8(out + y * row, channels, img, y);
  return out;
}
