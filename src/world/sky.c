// The sky of a world: pictures turned into panoramas of float rgb, crosses of six sides unfolded, the clear sky baked
// with its sun; then the set of lights of each cell. Cold.

#include "shade/atmosphere.h"
#include "shade/light_sample.h"
#include "world/lamps.h"

static double radians(float degrees) { return (double)degrees * (3.14159265358979323846 / 180); }

// The scene's own sky is the first, those that cells name follow.
static size_t sky_count(const Prepare *p) { return p->scene->skies.count + 1; }
static const Sky *sky_at(const Prepare *p, size_t i) { return i ? &p->scene->skies.items[i - 1].sky : &p->scene->sky; }

static bool find_picture(Prepare *p, size_t i)
{
  const Sky *sky = sky_at(p, i);
  p->sky_parts[i] = -1;
  if (sky->kind != SKY_IMAGE) return true;
  if (!sky->image.file)
    return err_set(p->err, ERR_BAD_SCENE, "the sky names no file; give it one, \"file\": \"studio.exr\"");
  Text path = {0};
  bool ok = scene_file_path(p->scene, sky->image.file, p->options, &path, p->err);
  if (ok) {
    p->sky_parts[i] = parts_add_image(p->parts, p->previous, text_get(&path), NULL, 0);
    if (p->sky_parts[i] < 0) ok = prepare_failed_memory(p);
  } else {
    err_where(p->err, "sky");
  }
  text_finish(&path);
  return ok;
}

bool prepare_sky(Prepare *p)
{
  p->sky_parts = arena_alloc(&p->scratch, sky_count(p), sizeof *p->sky_parts);
  if (!p->sky_parts) return prepare_failed_memory(p);
  for (size_t i = 0; i < sky_count(p); i++)
    if (!find_picture(p, i)) return false;
  return true;
}

// A sky's texel: pictures hold sRGB or light; negative and odd values count as 0.
static Vec3 sky_value(const Image *from, uint32_t x, uint32_t y)
{
  const bool decode = from->type == PIXEL_U8 || from->type == PIXEL_U16;
  Vec3 out = v3_all(0);
  for (uint32_t c = 0; c < 3; c++) {
    const float v = image_value(from, x, y, from->channels >= 3 ? c : 0);
    out[c] = decode ? srgb_decode(v) : v > 0 && v < FLT_MAX ? v : 0;
  }
  return out;
}

// --- crosses ----------------------------------------------------------------------------------------
// Sides are squares of `side` texels:      top              top
//                                     left front right back   left front right
//                                          bottom           bottom
//                                                           back, upside down
// front is -z, right +x, and every edge that two sides share in the picture, they share in space.
typedef struct Cross {
  const Image *image;
  uint32_t side;
  bool stands;
  Image *panorama;
} Cross;

typedef struct CubePlace {
  int face;   // of cube_faces
  float u, v; // 0..1 from its upper left corner
} CubePlace;

static const struct CubeFace {
  Vec3 out, right, down;          // as seen from inside
  uint8_t column, row;            // lying
  uint8_t stand_column, stand_row;
} cube_faces[6] = {
    {{1, 0, 0}, {0, 0, 1}, {0, -1, 0}, 2, 1, 2, 1},   {{-1, 0, 0}, {0, 0, -1}, {0, -1, 0}, 0, 1, 0, 1},
    {{0, 1, 0}, {1, 0, 0}, {0, 0, -1}, 1, 0, 1, 0},   {{0, -1, 0}, {1, 0, 0}, {0, 0, 1}, 1, 2, 1, 2},
    {{0, 0, -1}, {1, 0, 0}, {0, -1, 0}, 1, 1, 1, 1},  {{0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, 3, 1, 1, 3},
};

static CubePlace cube_place(Vec3 d)
{
  const float x = fabsf(d[0]), y = fabsf(d[1]), z = fabsf(d[2]);
  const int face = x >= y && x >= z ? (d[0] > 0 ? 0 : 1) : y >= z ? (d[1] > 0 ? 2 : 3) : d[2] < 0 ? 4 : 5;
  const struct CubeFace *f = &cube_faces[face];
  const float most = v3_dot(d, f->out);
  return (CubePlace){face, 0.5f + 0.5f * v3_dot(d, f->right) / most, 0.5f + 0.5f * v3_dot(d, f->down) / most};
}

static uint32_t texel_at(float u, uint32_t side)
{
  const float at = clamp_f(u * (float)side, 0, (float)(side - 1));
  return (uint32_t)at;
}

// A texel of a face; beyond its edge, the one that lies there on its neighbour.
static Vec3 cube_texel(const Cross *c, int face, float column, float row)
{
  const float side = (float)c->side, u = (column + 0.5f) / side, v = (row + 0.5f) / side;
  CubePlace p = {face, u, v};
  if (u < 0 || u > 1 || v < 0 || v > 1) {
    const struct CubeFace *f = &cube_faces[face];
    p = cube_place(f->out + (2 * u - 1) * f->right + (2 * v - 1) * f->down);
  }
  const struct CubeFace *f = &cube_faces[p.face];
  uint32_t x = texel_at(p.u, c->side), y = texel_at(p.v, c->side);
  if (c->stands && p.face == 5) { // upside down
    x = c->side - 1 - x;
    y = c->side - 1 - y;
  }
  return sky_value(c->image, (c->stands ? f->stand_column : f->column) * c->side + x,
                   (c->stands ? f->stand_row : f->row) * c->side + y);
}

static Vec3 cube_color(const Cross *c, Vec3 d)
{
  const CubePlace p = cube_place(d);
  const float x = p.u * (float)c->side - 0.5f, y = p.v * (float)c->side - 0.5f, x0 = floorf(x), y0 = floorf(y);
  const Vec3 above = v3_mix(cube_texel(c, p.face, x0, y0), cube_texel(c, p.face, x0 + 1, y0), x - x0);
  const Vec3 below = v3_mix(cube_texel(c, p.face, x0, y0 + 1), cube_texel(c, p.face, x0 + 1, y0 + 1), x - x0);
  return v3_mix(above, below, y - y0);
}

static void unfold_row(void *user, size_t y, int worker)
{
  (void)worker;
  const Cross *c = user;
  const Image *to = c->panorama;
  float *out = (float *)to->pixels + 3 * y * to->width;
  float sine, cosine, s, co;
  f_sincos(PI * ((float)y + 0.5f) / (float)to->height, &sine, &cosine);
  for (uint32_t x = 0; x < to->width; x++) {
    f_sincos(2 * PI * (((float)x + 0.5f) / (float)to->width - 0.5f), &s, &co);
    const Vec3 color = cube_color(c, v3(sine * s, cosine, -sine * co));
    for (int k = 0; k < 3; k++) *out++ = color[k];
  }
}

static bool sky_alloc(Prepare *p, uint32_t width, uint32_t height, Image *to)
{
  *to = (Image){width, height, 3, PIXEL_F32, arena_alloc(&p->world->arena, (size_t)width * height, 3 * sizeof(float))};
  return to->pixels || prepare_failed_memory(p);
}

// A panorama of four sides' width has no fewer texels anywhere than the sides have in their middle, and in their
// corners two thirds as many along each axis.
static bool unfold_cross(Prepare *p, const Image *from, Image *to)
{
  const bool stands = from->height > from->width;
  const uint32_t side = (stands ? from->height : from->width) / 4;
  if (!side || from->width != (stands ? 3 : 4) * side || from->height != (stands ? 4 : 3) * side)
    return err_set(p->err, ERR_BAD_SCENE,
                   "the sky's picture is %u x %u, and a cross is 4:3 or 3:4 of whole squares; crop it, or take the "
                   "layout \"panorama\"",
                   from->width, from->height);
  if (!sky_alloc(p, 4 * side, 2 * side, to)) return false;
  Cross c = {from, side, stands, to};
  return jobs_run(p->jobs, to->height, unfold_row, &c, p->cancel) ||
         err_set(p->err, ERR_CANCELLED, "preparing the sky was cancelled");
}

static bool sky_pixels(Prepare *p, const SkyImage *sky, int32_t part, Image *to)
{
  const Image *from = &p->parts->images.items[part]->image;
  if (sky->layout == LAYOUT_CROSS) return unfold_cross(p, from, to);
  if (!sky_alloc(p, from->width, from->height, to)) return false;
  float *out = to->pixels;
  for (uint32_t y = 0; y < from->height; y++)
    for (uint32_t x = 0; x < from->width; x++) {
      const Vec3 color = sky_value(from, x, y);
      for (int k = 0; k < 3; k++) *out++ = color[k];
    }
  return true;
}

// --- the clear sky ------------------------------------------------------------------------------------
// A sky, and the sun that comes with it.
typedef struct BakedSky {
  bool is_made, has_sun;
  SkyMap map;
  Sun sun;
} BakedSky;

static bool bake_sun_sky(Prepare *p, const SkySun *sky, BakedSky *out)
{
  SkyMap *map = &out->map;
  const double radius = radians(sky->sun_size) / 2;
  const Atmosphere a = {.elevation = (float)radians(sky->elevation), .altitude = sky->altitude, .air = sky->air,
                        .dust = sky->dust, .ozone = sky->ozone, .albedo = v3_load(sky->albedo),
                        .sun_radius = (float)radius};
  AtmosphereLight light;
  if (!sky_alloc(p, ATMOSPHERE_WIDE, ATMOSPHERE_HIGH, &map->image) ||
      !atmosphere_bake(&a, map->image.pixels, &light, p->jobs, p->cancel, p->err))
    return false;
  map->kind = SKY_MAP_IMAGE;
  map->gain = sky->gain;
  map->horizon_angle = light.horizon;
  map->rotation = -(float)radians(sky->azimuth);
  const double up = radians(sky->elevation), around = radians(sky->azimuth);
  const float direction[3] = {(float)(cos(up) * sin(around)), (float)sin(up), (float)(-cos(up) * cos(around))};
  const Vec3 irradiance = light.sun * (sky->sun_intensity * sky->gain);
  if (v3_is_zero(irradiance)) return true;
  if (!prepare_add_sun(p, direction, irradiance, sky->sun_size)) return false;
  out->has_sun = true;
  out->sun = p->suns.items[--p->suns.count];
  p->sun_cells.count--;
  return true;
}

static bool bake(Prepare *p, size_t i, BakedSky *out)
{
  const Sky *sky = sky_at(p, i);
  SkyMap *map = &out->map;
  if (out->is_made) return true;
  *out = (BakedSky){.is_made = true, .map = {.gain = 1}};
  switch ((SkyKind)sky->kind) {
  case SKY_CONSTANT:
    map->kind = SKY_MAP_CONSTANT;
    map->color = v3_load(sky->constant.color);
    map->gain = sky->constant.gain;
    return true;
  case SKY_GRADIENT:
    map->kind = SKY_MAP_GRADIENT;
    map->color = v3_load(sky->gradient.zenith);
    map->horizon = v3_load(sky->gradient.horizon);
    map->ground = v3_load(sky->gradient.ground);
    map->gain = sky->gradient.gain;
    return true;
  case SKY_IMAGE:
    map->kind = SKY_MAP_IMAGE;
    map->gain = sky->image.gain;
    map->rotation = (float)radians(sky->image.rotation);
    return sky_pixels(p, &sky->image, p->sky_parts[i], &map->image) || err_where(p->err, "sky");
  case SKY_SUN: return bake_sun_sky(p, &sky->sun, out);
  }
  unreachable();
}

// --- the lights of each cell ------------------------------------------------------------------------------
static size_t sky_of_cell(const Prepare *p, size_t cell)
{
  return cell ? (size_t)(p->scene->cells.items[cell - 1].common.sky + 1) : 0;
}

static bool set_skies(Prepare *p, LampList *lists, BakedSky *skies)
{
  for (size_t c = 0; c < p->world->cell_count; c++) {
    BakedSky *sky = &skies[sky_of_cell(p, c)];
    if (!bake(p, sky_of_cell(p, c), sky)) return false;
    if (sky->has_sun && !array_push(&lists[c].suns, sky->sun)) return prepare_failed_memory(p);
    lists[c].sky = &sky->map;
  }
  return true;
}

static bool build_set(Prepare *p, size_t c, const LampList *list, const LightProfile *profiles)
{
  WorldCell *cell = &p->cells[c];
  LightSet *set = c ? arena_alloc(&p->world->arena, 1, sizeof *set) : &p->world->lights;
  if (!set) return prepare_failed_memory(p);
  *set = (LightSet){0};
  cell->lights = set;
  if (!light_set_build(set, list->emitters.items, list->emitters.count, list->suns.items, list->suns.count, list->sky, p->cancel,
                       p->err))
    return false;
  set->profiles = profiles;
  const size_t groups = light_group_count(set);
  if (groups > p->world->light_groups) p->world->light_groups = groups;
  return true;
}

bool prepare_light_set(Prepare *p)
{
  const size_t count = p->profiles.count, cells = p->world->cell_count;
  LightProfile *profiles = arena_alloc(&p->world->arena, count ? count : 1, sizeof *profiles);
  BakedSky *skies = arena_alloc(&p->scratch, sky_count(p), sizeof *skies);
  LampList *lists = arena_alloc(&p->scratch, cells, sizeof *lists);
  if (!profiles || !skies || !lists) return prepare_failed_memory(p);
  for (size_t i = 0; i < count; i++) profiles[i] = p->profiles.items[i];
  memset(skies, 0, sky_count(p) * sizeof *skies);
  memset(lists, 0, cells * sizeof *lists);
  bool ok = lamps_by_cell(p, lists) && set_skies(p, lists, skies) && lamps_through_gates(p, lists);
  for (size_t c = 0; ok && c < cells; c++) ok = build_set(p, c, &lists[c], profiles);
  for (size_t c = 0; c < cells; c++) {
    array_finish(&lists[c].emitters);
    array_finish(&lists[c].suns);
  }
  return ok;
}
