// How much of the light a GGX lobe reflects, by roughness and angle: what multiple scattering must add back and what
// layers below still get. Hot; the numbers are in ggx_table.c, written by tools/ggx_table.c.
//
// Rows run over roughness 0..1; a row over t = sqrt(cos) (1 + r) / (sqrt(cos) + r), which spreads the dip at grazing
// angles (as wide as the lobe) over the columns. Linear between: worst error 1.4e-3, mean 1.3e-4.

#ifndef RAYFOLD_SHADE_GGX_TABLE_H
#define RAYFOLD_SHADE_GGX_TABLE_H

#include "base/vec.h"

enum { GGX_TABLE_SIZE = 32 };
extern const uint16_t ggx_table[GGX_TABLE_SIZE][GGX_TABLE_SIZE][2]; // full; see rise in tools/ggx_table.c
extern const float ggx_table_mean[GGX_TABLE_SIZE][2]; // cosine-weighted means of 1 - full and of edge

// With Schlick's Fresnel term f0 + (f90 - f0) (1 - cos)^5 the albedo is f0 (full - edge) + f90 edge.
typedef struct GgxAlbedo {
  float full, edge;
} GgxAlbedo;

static inline float ggx_albedo(GgxAlbedo a, float f0, float f90)
{
  return f0 * (a.full - a.edge) + f90 * a.edge;
}

static inline GgxAlbedo ggx_albedo_at(float roughness, float cos)
{
  const float last = GGX_TABLE_SIZE - 1, most = GGX_TABLE_SIZE - 2;
  const float root = safe_sqrt(cos), sum = root + roughness;
  const float column = clamp_f(sum > 0 ? root * (1 + roughness) / sum : 1, 0, 1) * last,
              row = clamp_f(roughness, 0, 1) * last;
  const float c = min_f(floorf(column), most), r = min_f(floorf(row), most), x = column - c, y = row - r;
  const uint16_t(*a)[2] = &ggx_table[(int)r][(int)c], (*b)[2] = &ggx_table[(int)r + 1][(int)c];
  const float full = mix_f(mix_f(a[0][0], a[1][0], x), mix_f(b[0][0], b[1][0], x), y) * (1.0f / 65535);
  const float rise = mix_f(mix_f(a[0][1], a[1][1], x), mix_f(b[0][1], b[1][1], x), y) * (2.0f / 65535) - 1;
  const float seen = max_f(1 - cos - rise, 0), seen2 = seen * seen;
  return (GgxAlbedo){full, full * seen2 * seen2 * seen};
}

static inline float ggx_mean(float roughness, int which)
{
  const float row = clamp_f(roughness, 0, 1) * (GGX_TABLE_SIZE - 1),
              r = min_f(floorf(row), GGX_TABLE_SIZE - 2);
  return mix_f(ggx_table_mean[(int)r][which], ggx_table_mean[(int)r + 1][which], row - r);
}

// The means over the hemisphere, weighted by the cosine. The missing part has digits of its own, because narrow lobes
// miss so little.
static inline float ggx_mean_missing(float roughness)
{
  return ggx_mean(roughness, 0);
}
static inline GgxAlbedo ggx_albedo_mean(float roughness)
{
  return (GgxAlbedo){1 - ggx_mean(roughness, 0), ggx_mean(roughness, 1)};
}

#endif
