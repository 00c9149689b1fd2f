// From a scene's materials and textures to the form shading reads: names become indices, degrees and percentages
// become the numbers of the formulas. Pixels are attached later, when all pictures are decoded.

#include "base/fmath.h"
#include "scene/mix_check.h"
#include "shade/gloss.h"
#include "world/prepare.h"
#include "world/translate.h"

// The 2x3 matrix of scale first, then rotation, then offset (KHR_texture_transform, in our v-up coordinates).
static void uv_map(const TextureCommon *t, float m[2][3])
{
  const double a = (double)t->rotation * (3.14159265358979323846 / 180);
  const float c = (float)cos(a), s = (float)sin(a);
  m[0][0] = c * t->scale[0];
  m[0][1] = -s * t->scale[1];
  m[0][2] = t->offset[0];
  m[1][0] = s * t->scale[0];
  m[1][1] = c * t->scale[1];
  m[1][2] = t->offset[1];
}

static bool image_source(Prepare *p, const Scene *scene, const Texture *t, int32_t *part)
{
  if (t->embedded) {
    *part = parts_add_image(p->parts, p->previous, NULL, t->embedded, t->embedded_size);
  } else {
    if (!t->image.file)
      return err_set(p->err, ERR_BAD_SCENE, "texture \"%s\" names no file; give it one, \"file\": \"picture.png\"",
                     t->name);
    Text path = {0};
    const bool ok = scene_file_path(scene, t->image.file, p->options, &path, p->err);
    if (ok) *part = parts_add_image(p->parts, p->previous, text_get(&path), NULL, 0);
    text_finish(&path);
    if (!ok) return err_where(p->err, "texture \"%s\"", t->name);
  }
  return *part >= 0 || prepare_failed_memory(p);
}

static void two_colors(TextureMap *m, const float a[3], const float b[3])
{
  for (int i = 0; i < 3; i++) {
    m->color_a[i] = a[i];
    m->color_b[i] = b[i];
  }
}

static void make_noise(TextureMap *m, const TextureNoise *n)
{
  m->kind = TEXTURE_MAP_NOISE;
  m->space = (uint8_t)n->space;
  m->frequency = 1 / n->size;
  m->octaves = n->octaves;
  m->lacunarity = n->lacunarity;
  m->persistence = n->persistence;
  m->contrast = n->contrast;
  m->seed = (uint32_t)n->seed;
  two_colors(m, n->color_a, n->color_b);
}

static bool make_map(Prepare *p, const Scene *scene, const Texture *t, bool is_color, int32_t *map)
{
  TextureMap m = {.texcoord = (uint8_t)t->common.texcoord};
  int32_t part = -1;
  uv_map(&t->common, m.uv_map);
  switch ((TextureKind)t->kind) {
  case TEXTURE_IMAGE: {
    const TextureImage *image = &t->image;
    m.kind = TEXTURE_MAP_IMAGE;
    m.wrap_u = (uint8_t)image->wrap_u;
    m.wrap_v = (uint8_t)image->wrap_v;
    m.is_nearest = image->filter == TEXEL_NEAREST;
    m.minify = (uint8_t)image->minify;
    m.alpha_gain = image->alpha_gain;
    m.is_srgb = image->encoding == ENCODING_SRGB || (image->encoding == ENCODING_AUTO && is_color);
    for (int i = 0; i < 3; i++) {
      m.gain[i] = image->gain[i];
      m.bias[i] = image->bias[i];
    }
    if (!image_source(p, scene, t, &part)) return false;
    break;
  }
  case TEXTURE_CHECKER:
    m.kind = TEXTURE_MAP_CHECKER;
    two_colors(&m, t->checker.color_a, t->checker.color_b);
    break;
  case TEXTURE_NOISE: make_noise(&m, &t->noise); break;
  case TEXTURE_GRADIENT:
    m.kind = TEXTURE_MAP_GRADIENT;
    m.is_radial = t->gradient.shape == GRADIENT_RADIAL;
    m.wrap_u = (uint8_t)t->gradient.wrap;
    two_colors(&m, t->gradient.color_a, t->gradient.color_b);
    break;
  case TEXTURE_BRICK:
    m.kind = TEXTURE_MAP_BRICK;
    m.length = t->brick.length;
    m.mortar = t->brick.mortar;
    m.stagger = t->brick.stagger;
    two_colors(&m, t->brick.color_a, t->brick.color_b);
    break;
  case TEXTURE_WAVE:
    m.kind = TEXTURE_MAP_WAVE;
    two_colors(&m, t->wave.color_a, t->wave.color_b);
    break;
  }
  const int32_t no_mips = -1;
  if (!array_push(&p->textures, m) || !array_push(&p->texture_parts, part) || !array_push(&p->texture_mips, no_mips))
    return prepare_failed_memory(p);
  *map = (int32_t)p->textures.count - 1;
  return true;
}

int32_t prepare_texture(Prepare *p, Source *source, int32_t texture, bool is_color, bool *ok)
{
  if (texture < 0 || (size_t)texture >= source->scene->textures.count || !*ok) return -1;
  p->met_texture = true;
  int32_t *map = &(is_color ? source->color_maps : source->data_maps)[texture];
  if (*map < 0) *ok = make_map(p, source->scene, &source->scene->textures.items[texture], is_color, map);
  return *map;
}

static bool add_mips(Prepare *p)
{
  for (size_t i = 0; i < p->textures.count; i++) {
    TextureMap *t = &p->textures.items[i];
    const int32_t image_i = p->texture_parts.items[i];
    if (image_i < 0) continue;
    t->image = p->parts->images.items[image_i]->image;
    if (t->minify == TEXTURE_UNFILTERED || (t->image.width == 1 && t->image.height == 1)) continue;
    const MipsMeaning meaning = {t->is_srgb, t->is_coverage};
    p->texture_mips.items[i] = parts_add_mips(p->parts, p->previous, image_i, meaning);
    if (p->texture_mips.items[i] < 0) return prepare_failed_memory(p);
  }
  return true;
}

bool prepare_texture_pixels(Prepare *p)
{
  if (!add_mips(p) || !parts_make_mips(p->parts, p->jobs, p->cancel, p->err)) return false;
  for (size_t i = 0; i < p->textures.count; i++) {
    if (p->texture_mips.items[i] < 0) continue;
    const Mips *mips = &p->parts->mips.items[p->texture_mips.items[i]]->mips;
    p->textures.items[i].levels = mips->levels;
    p->textures.items[i].level_count = mips->count;
  }
  for (size_t i = 0; i < p->parts->mips.count; i++) p->world->texture_bytes += p->parts->mips.items[i]->mips.size;
  for (size_t i = 0; i < p->parts->images.count; i++) {
    const Image *img = &p->parts->images.items[i]->image;
    p->world->texture_bytes += (size_t)img->width * img->height * img->channels * pixel_size(img->type);
  }
  return true;
}

// --- materials ------------------------------------------------------------------------------------
// Beer-Lambert: white light is attenuation_color after attenuation_distance, so sigma = -ln(color) / distance
// (KHR_materials_volume). A black channel would be infinite; 1e-4 is as black as a picture needs.
static Vec3 absorption(const float color[3], float distance)
{
  if (distance <= 0) return v3_all(0);
  Vec3 sigma = v3_all(0);
  for (int i = 0; i < 3; i++) sigma[i] = -(float)log(fmax((double)color[i], 1e-4)) / distance;
  return sigma;
}

SurfaceMaterial surface_default(void)
{
  const TextureRef none = {-1, 0};
  return (SurfaceMaterial){
      .kind = SURFACE_PBR, .is_double_sided = true, .color = v3_all(0.8f), .specular_color = v3_all(1), .opacity = 1,
      .alpha_cutoff = 0.5f, .roughness = 0.5f, .ior = 1.5f, .specular = 1, .normal_scale = 1, .color_map = none,
      .opacity_map = none, .metallic_map = none, .roughness_map = none, .normal_map = none, .bump_map = none, .emission_map = none,
      .specular_map = none, .specular_color_map = none, .transmission_map = none, .clearcoat_map = none,
      .clearcoat_roughness_map = none, .sheen_color_map = none, .sheen_roughness_map = none, .anisotropy_map = none,
      .iridescence_map = none, .film_map = none, .film_ior = 1.3f, .mix_map = none};
}

static bool is_dark(const float c[3]) { return c[0] <= 0 && c[1] <= 0 && c[2] <= 0; }

// What few materials have.
static void add_extras(Prepare *p, Source *source, const Pbr *m, SurfaceMaterial *s, bool *ok)
{
  s->has_extras = !is_dark(m->sheen_color) || m->anisotropy > 0 || m->iridescence > 0;
  if (!s->has_extras) return;
  s->sheen_color = v3_load(m->sheen_color);
  s->sheen_roughness = m->sheen_roughness;
  s->anisotropy = m->anisotropy;
  s->anisotropy_turn = m->anisotropy_rotation * (PI / 180);
  s->iridescence = m->iridescence;
  s->film_ior = m->iridescence_ior;
  s->film_least = m->iridescence_thickness_min;
  s->film_most = m->iridescence_thickness_max;
  s->sheen_color_map = (TextureRef){prepare_texture(p, source, m->sheen_color_texture, true, ok), 0};
  s->sheen_roughness_map = (TextureRef){prepare_texture(p, source, m->sheen_roughness_texture, false, ok), 3};
  s->anisotropy_map = (TextureRef){prepare_texture(p, source, m->anisotropy_texture, false, ok), 0};
  s->iridescence_map = (TextureRef){prepare_texture(p, source, m->iridescence_texture, false, ok), 0};
  s->film_map = (TextureRef){prepare_texture(p, source, m->iridescence_thickness_texture, false, ok), 1};
}

static SurfaceMaterial from_pbr(Prepare *p, Source *source, const Pbr *m, bool *ok)
{
  SurfaceMaterial s = surface_default();
  s.alpha_mode = (uint8_t)m->alpha_mode;
  s.is_double_sided = m->double_sided;
  s.is_thin_walled = m->thin_walled;
  s.color = v3_load(m->base_color);
  s.emission = v3_load(m->emissive) * m->emissive_strength;
  s.is_light = !v3_is_zero(s.emission);
  s.needs_filter = m->alpha_mode != ALPHA_OPAQUE || !m->double_sided;
  s.specular_color = v3_load(m->specular_color);
  s.absorption = absorption(m->attenuation_color, m->attenuation_distance);
  s.opacity = m->opacity;
  s.alpha_cutoff = m->alpha_cutoff;
  s.metallic = m->metallic;
  s.roughness = m->roughness;
  s.ior = m->ior;
  s.specular = m->specular;
  s.transmission = m->transmission;
  s.clearcoat = m->clearcoat;
  s.clearcoat_roughness = m->clearcoat_roughness;
  s.normal_scale = m->normal_scale;
  s.dispersion = m->dispersion;
  s.color_map = (TextureRef){prepare_texture(p, source, m->base_color_texture, true, ok), 0};
  s.opacity_map = (TextureRef){prepare_texture(p, source, m->opacity_texture, false, ok), (uint8_t)m->opacity_channel};
  s.metallic_map =
      (TextureRef){prepare_texture(p, source, m->metallic_texture, false, ok), (uint8_t)m->metallic_channel};
  s.roughness_map =
      (TextureRef){prepare_texture(p, source, m->roughness_texture, false, ok), (uint8_t)m->roughness_channel};
  s.normal_map = (TextureRef){prepare_texture(p, source, m->normal_texture, false, ok), 0};
  s.bump_map = (TextureRef){prepare_texture(p, source, m->bump_texture, false, ok), 0};
  s.bump_scale = m->bump_scale;
  s.emission_map = (TextureRef){prepare_texture(p, source, m->emissive_texture, true, ok), 0};
  s.specular_map = (TextureRef){prepare_texture(p, source, m->specular_texture, false, ok), (uint8_t)m->specular_channel};
  s.specular_color_map = (TextureRef){prepare_texture(p, source, m->specular_color_texture, true, ok), 0};
  s.transmission_map = (TextureRef){prepare_texture(p, source, m->transmission_texture, false, ok), (uint8_t)m->transmission_channel};
  s.clearcoat_map = (TextureRef){prepare_texture(p, source, m->clearcoat_texture, false, ok), (uint8_t)m->clearcoat_channel};
  s.clearcoat_roughness_map =
      (TextureRef){prepare_texture(p, source, m->clearcoat_roughness_texture, false, ok), (uint8_t)m->clearcoat_roughness_channel};
  add_extras(p, source, m, &s, ok);
  return s;
}

// --- highlights of older tracers ------------------------------------------------------------------
// Reflects no more than all: what is matt and what is glossy are scaled where they add up to more.
static void set_parts(SurfaceMaterial *s, const float diffuse[3], const float specular[3])
{
  for (int k = 0; k < 3; k++) {
    const float sum = diffuse[k] + specular[k], scale = sum > 1 ? 1 / sum : 1;
    s->color[k] = diffuse[k] * scale;
    s->specular_color[k] = specular[k] * scale;
  }
}

static SurfaceMaterial from_phong(Prepare *p, Source *source, const Phong *m, bool *ok)
{
  SurfaceMaterial s = surface_default();
  s.kind = SURFACE_PHONG;
  set_parts(&s, m->diffuse, m->specular);
  s.ambient = v3_load(m->ambient);
  s.distribution = GLOSS_PHONG;
  s.gloss_width = m->exponent;
  s.gloss_f0 = v3_all(1);
  s.mirrored = v3_load(m->reflect);
  s.passed = v3_load(m->transmit);
  s.ior = m->ior;
  s.absorption = absorption(m->attenuation_color, m->attenuation_distance);
  s.color_map.map = prepare_texture(p, source, m->diffuse_texture, true, ok);
  return s;
}

// The height at which facets of the Gaussian distribution cover the surface once: 1 / integral of exp(-(a / m)^2) cos a
// over the hemisphere, by 2000 midpoints (error below 1e-6 for m >= 0.02). No libm: a picture depends on it.
static float gaussian_height(float m)
{
  enum { STEPS = 2000 };
  double sum = 0;
  for (int i = 0; i < STEPS; i++) {
    const double a = (i + 0.5) / STEPS * (3.14159265358979323846 / 2);
    sum += fmath_exp(-a * a / ((double)m * m)) * (double)(f_cos((float)a) * f_sin((float)a));
  }
  return (float)(1 / (sum * 3.14159265358979323846 * 3.14159265358979323846 / STEPS));
}

static SurfaceMaterial from_cook_torrance(Prepare *p, Source *source, const CookTorrance *m, bool *ok)
{
  SurfaceMaterial s = surface_default();
  s.kind = SURFACE_COOK_TORRANCE;
  set_parts(&s, m->diffuse, m->specular);
  s.ambient = v3_load(m->ambient);
  s.distribution = m->distribution == FACETS_GAUSSIAN ? GLOSS_GAUSSIAN : GLOSS_BECKMANN;
  s.gloss_width = m->roughness;
  s.gloss_f0 = v3_load(m->f0);
  s.gloss_given_c = m->c;
  const float most = gaussian_height(m->roughness);
  s.gloss_c = m->c > 0 ? min_f(m->c, most) : most;
  s.mirrored = v3_load(m->reflect);
  s.passed = v3_load(m->transmit);
  s.ior = m->ior;
  s.absorption = absorption(m->attenuation_color, m->attenuation_distance);
  s.color_map.map = prepare_texture(p, source, m->diffuse_texture, true, ok);
  return s;
}

static SurfaceMaterial from_material(Prepare *p, Source *source, const Material *m, bool *ok)
{
  SurfaceMaterial s = surface_default();
  switch ((MaterialKind)m->kind) {
  case MATERIAL_PBR: return from_pbr(p, source, &m->pbr, ok);
  case MATERIAL_LAMBERT:
    s.kind = SURFACE_LAMBERT;
    s.color = v3_load(m->lambert.albedo);
    s.color_map.map = prepare_texture(p, source, m->lambert.albedo_texture, true, ok);
    return s;
  case MATERIAL_MIRROR:
    s.kind = SURFACE_MIRROR;
    s.roughness = m->mirror.roughness;
    s.color = v3_load(m->mirror.color);
    return s;
  case MATERIAL_GLASS:
    s.kind = SURFACE_GLASS;
    s.color = v3_load(m->glass.color);
    s.ior = m->glass.ior;
    s.roughness = m->glass.roughness;
    s.transmission = 1;
    s.dispersion = m->glass.dispersion;
    s.absorption = absorption(m->glass.attenuation_color, m->glass.attenuation_distance);
    return s;
  case MATERIAL_EMISSION:
    s.kind = SURFACE_EMISSION;
    s.is_double_sided = m->emission.double_sided;
    s.emission = v3_load(m->emission.color) * m->emission.strength;
    s.is_light = m->emission.lights_others && !v3_is_zero(s.emission);
    s.emission_map.map = prepare_texture(p, source, m->emission.color_texture, true, ok);
    return s;
  case MATERIAL_PRINCIPLED: {
    const Pbr pbr = pbr_of_principled(&m->principled);
    return from_pbr(p, source, &pbr, ok);
  }
  case MATERIAL_PHONG: return from_phong(p, source, &m->phong, ok);
  case MATERIAL_COOK_TORRANCE: return from_cook_torrance(p, source, &m->cook_torrance, ok);
  case MATERIAL_STUDIO: {
    const Pbr pbr = pbr_of_studio(&m->studio);
    return from_pbr(p, source, &pbr, ok);
  }
  case MATERIAL_MIX:
    s.kind = SURFACE_MIX;
    s.mix_amount = m->mix.amount;
    s.mix_map = (TextureRef){prepare_texture(p, source, m->mix.amount_texture, false, ok),
                             (uint8_t)m->mix.amount_channel};
    return s;
  }
  unreachable();
}

// --- mixes ----------------------------------------------------------------------------------------
// What shines of a mix is aimed at if one colour (times one texture) says what that is everywhere.
static void join_emission(Prepare *p, SurfaceMaterial *s, const SurfaceMaterial *a, const SurfaceMaterial *b)
{
  const bool has_a = !v3_is_zero(a->emission), has_b = !v3_is_zero(b->emission), is_even = s->mix_map.map < 0;
  const SurfaceMaterial *one = has_a ? a : b, *other = has_b ? b : a;
  s->emission = v3_mix(a->emission, b->emission, s->mix_amount);
  s->emission_map = one->emission_map;
  if ((!has_a && !has_b) || (is_even && v3_is_zero(s->emission))) return;
  if (v3_is_zero(s->emission)) s->emission = one->emission; // not zero everywhere, whatever the texture says
  const bool is_alike = one->emission_map.map == other->emission_map.map && one->is_light == other->is_light &&
                        one->is_double_sided == s->is_double_sided && other->is_double_sided == s->is_double_sided;
  s->is_light = one->is_light && is_alike && is_even;
  if ((one->is_light || other->is_light) && !s->is_light)
    note_once(&p->world->notes, "a mix that shines differently from place to place is not aimed at, which costs noise");
}

// Fills in a mix from its two parts, and those first. Ends because mix_check() found no circle.
static void join_mix(Prepare *p, const Source *source, size_t i)
{
  const Material *m = &source->scene->materials.items[i];
  if (m->kind != MATERIAL_MIX) return;
  SurfaceMaterial *s = &p->materials.items[source->material_base + i];
  const int32_t part_i[2] = {m->mix.first, m->mix.second};
  SurfaceMaterial none = surface_default();
  const SurfaceMaterial *part[2];
  int32_t distance[2];
  for (int k = 0; k < 2; k++) {
    part[k] = &none;
    distance[k] = (int32_t)(source->scene->materials.count - i); // the grey one behind the last
    if (part_i[k] < 0) continue;
    join_mix(p, source, (size_t)part_i[k]);
    part[k] = &p->materials.items[source->material_base + (size_t)part_i[k]];
    distance[k] = part_i[k] - (int32_t)i;
  }
  s->mix_first = distance[0];
  s->mix_second = distance[1];
  s->is_double_sided = part[0]->is_double_sided || part[1]->is_double_sided;
  const bool is_opaque = part[0]->alpha_mode == SURFACE_OPAQUE && part[1]->alpha_mode == SURFACE_OPAQUE;
  s->alpha_mode = is_opaque ? SURFACE_OPAQUE : SURFACE_BLEND;
  s->needs_filter = !is_opaque || !s->is_double_sided;
  s->has_maps |= part[0]->has_maps || part[1]->has_maps;
  join_emission(p, s, part[0], part[1]);
}

bool prepare_add_material(Prepare *p, const SurfaceMaterial *m, const char *name)
{
  const char *copy = arena_text(&p->world->arena, name);
  return ((copy || !name) && array_push(&p->materials, *m) && array_push(&p->material_names, copy)) ||
         prepare_failed_memory(p);
}

static bool join_mixes(Prepare *p, const Source *source)
{
  bool has_mix = false;
  const size_t count = source->scene->materials.count;
  for (size_t i = 0; i < count; i++) has_mix |= source->scene->materials.items[i].kind == MATERIAL_MIX;
  if (!has_mix) return true;
  const SurfaceMaterial grey = surface_default();
  if (!prepare_add_material(p, &grey, NULL)) return false;
  for (size_t i = 0; i < count; i++) join_mix(p, source, i);
  return true;
}

bool prepare_materials(Prepare *p, Source *source)
{
  bool ok = mix_check(source->scene, NULL, -1, NULL, NULL, p->err);
  source->material_base = (uint32_t)p->materials.count;
  for (size_t i = 0; i < source->scene->materials.count && ok; i++) {
    const Material *m = &source->scene->materials.items[i];
    p->met_texture = false;
    SurfaceMaterial s = from_material(p, source, m, &ok);
    s.has_maps = p->met_texture;
    // Coverage weighs the colours it covers. A texture that others use as opaque loses nothing where alpha is 1.
    if (ok && s.alpha_mode != SURFACE_OPAQUE && s.color_map.map >= 0)
      p->textures.items[s.color_map.map].is_coverage = true;
    ok = ok && prepare_add_material(p, &s, m->name);
    if (!ok) err_where(p->err, "material \"%s\"", m->name);
  }
  return ok && join_mixes(p, source);
}
