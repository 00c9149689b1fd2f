// Materials of a glTF file: the metallic-roughness model and the extensions that our pbr material has words for.
// Others are named in a note, once for each material. Occlusion textures are ignored without a word: a path tracer
// finds out by itself what occludes what.

#include "scene/gltf.h"

#include <stdio.h>
#include <string.h>

static bool add_base(Gltf *g, const Json *json, Pbr *pbr)
{
  const Json *mr = js_get(json, "pbrMetallicRoughness");
  float base[4] = {1, 1, 1, 1};
  pbr->metallic = 1;
  pbr->roughness = 1;
  if (!gltf_ranged(g, mr, "baseColorFactor", 4, 0, 1, base) ||
      !gltf_texture(g, mr, "baseColorTexture", &pbr->base_color_texture) ||
      !gltf_ranged(g, mr, "metallicFactor", 1, 0, 1, &pbr->metallic) ||
      !gltf_ranged(g, mr, "roughnessFactor", 1, 0, 1, &pbr->roughness) ||
      !gltf_texture(g, mr, "metallicRoughnessTexture", &pbr->metallic_texture))
    return false;
  pbr->roughness_texture = pbr->metallic_texture; // metallic in blue, roughness in green: our defaults
  memcpy(pbr->base_color, base, sizeof pbr->base_color);
  pbr->opacity = base[3];
  return true;
}

static bool add_alpha(Gltf *g, const Json *json, Pbr *pbr)
{
  const char *mode = js_text(js_get(json, "alphaMode"));
  pbr->alpha_mode = text_equal(mode, "MASK")    ? ALPHA_MASK
                    : text_equal(mode, "BLEND") ? ALPHA_BLEND
                                                : ALPHA_OPAQUE;
  if (js_get(json, "alphaMode") && pbr->alpha_mode == ALPHA_OPAQUE && !text_equal(mode, "OPAQUE"))
    return gltf_fail(g, json, "alphaMode", "\"alphaMode\" is \"OPAQUE\", \"MASK\" or \"BLEND\"");
  pbr->double_sided = false;
  return gltf_ranged(g, json, "alphaCutoff", 1, 0, 1, &pbr->alpha_cutoff) &&
         gltf_flag(g, json, "doubleSided", &pbr->double_sided);
}

static bool add_normal_and_glow(Gltf *g, const Json *json, Pbr *pbr)
{
  const Json *strength = gltf_extension(json, "KHR_materials_emissive_strength");
  return gltf_texture(g, json, "normalTexture", &pbr->normal_texture) &&
         gltf_ranged(g, js_get(json, "normalTexture"), "scale", 1, -16, 16, &pbr->normal_scale) &&
         gltf_ranged(g, json, "emissiveFactor", 3, 0, FLT_MAX, pbr->emissive) &&
         gltf_texture(g, json, "emissiveTexture", &pbr->emissive_texture) &&
         gltf_ranged(g, strength, "emissiveStrength", 1, 0, FLT_MAX, &pbr->emissive_strength);
}

static bool add_ior(Gltf *g, const Json *json, Pbr *pbr)
{
  const Json *ior = gltf_extension(json, "KHR_materials_ior");
  if (!gltf_floats(g, ior, "ior", 1, &pbr->ior)) return false;
  // 0 is the extension's word for "reflects all"; 5 is as near as our range goes.
  pbr->ior = pbr->ior == 0 ? 5 : clamp_f(pbr->ior, 1, 5);
  return true;
}

static bool add_specular(Gltf *g, const Json *json, Pbr *pbr)
{
  const Json *s = gltf_extension(json, "KHR_materials_specular");
  return gltf_ranged(g, s, "specularFactor", 1, 0, 1, &pbr->specular) &&
         gltf_texture(g, s, "specularTexture", &pbr->specular_texture) &&
         gltf_ranged(g, s, "specularColorFactor", 3, 0, FLT_MAX, pbr->specular_color) &&
         gltf_texture(g, s, "specularColorTexture", &pbr->specular_color_texture);
}

// Transmission alone is a thin sheet; a volume with a thickness makes the mesh the border of a solid. How thick
// matters to rasterisers only: rays find out. An attenuation distance of infinity, the default, is our 0.
static bool add_transmission(Gltf *g, const Json *json, Pbr *pbr)
{
  const Json *t = gltf_extension(json, "KHR_materials_transmission");
  const Json *volume = gltf_extension(json, "KHR_materials_volume");
  float thickness = 0;
  if (!gltf_ranged(g, t, "transmissionFactor", 1, 0, 1, &pbr->transmission) ||
      !gltf_texture(g, t, "transmissionTexture", &pbr->transmission_texture) ||
      !gltf_ranged(g, volume, "thicknessFactor", 1, 0, FLT_MAX, &thickness) ||
      !gltf_ranged(g, volume, "attenuationDistance", 1, 0, FLT_MAX, &pbr->attenuation_distance) ||
      !gltf_ranged(g, volume, "attenuationColor", 3, 0, 1, pbr->attenuation_color))
    return false;
  pbr->thin_walled = t && thickness <= 0;
  return true;
}

static bool add_clearcoat(Gltf *g, const Json *json, Pbr *pbr, const char *name)
{
  const Json *c = gltf_extension(json, "KHR_materials_clearcoat");
  if (js_get(c, "clearcoatNormalTexture"))
    note_once(&g->scene->notes,
              "%s: a clearcoat's own normal texture is not supported: that of material \"%s\" is "
              "ignored",
              g->path, name);
  return gltf_ranged(g, c, "clearcoatFactor", 1, 0, 1, &pbr->clearcoat) &&
         gltf_texture(g, c, "clearcoatTexture", &pbr->clearcoat_texture) &&
         gltf_ranged(g, c, "clearcoatRoughnessFactor", 1, 0, 1, &pbr->clearcoat_roughness) &&
         gltf_texture(g, c, "clearcoatRoughnessTexture", &pbr->clearcoat_roughness_texture);
}

// The old specular-glossiness model, where a file has nothing newer. Its specular colour is the reflectance at normal
// incidence; ours is specular_color times that of ior 1.5, which is 0.04.
static bool add_specular_glossiness(Gltf *g, const Json *old, Pbr *pbr, const char *name)
{
  float diffuse[4] = {1, 1, 1, 1}, specular[3] = {1, 1, 1}, glossiness = 1;
  if (!gltf_ranged(g, old, "diffuseFactor", 4, 0, 1, diffuse) ||
      !gltf_texture(g, old, "diffuseTexture", &pbr->base_color_texture) ||
      !gltf_ranged(g, old, "specularFactor", 3, 0, 1, specular) ||
      !gltf_ranged(g, old, "glossinessFactor", 1, 0, 1, &glossiness) ||
      !gltf_texture(g, old, "specularGlossinessTexture", &pbr->specular_color_texture))
    return false;
  for (int k = 0; k < 3; k++) {
    pbr->base_color[k] = diffuse[k];
    pbr->specular_color[k] = specular[k] / 0.04f;
  }
  pbr->opacity = diffuse[3];
  pbr->metallic = 0;
  pbr->roughness = 1 - glossiness;
  note_once(&g->scene->notes,
            "%s: material \"%s\" is of the old specular-glossiness kind and is converted; the alpha "
            "of its specularGlossinessTexture is ignored",
            g->path, name);
  return true;
}

static bool add_sheen(Gltf *g, const Json *json, Pbr *pbr)
{
  const Json *s = gltf_extension(json, "KHR_materials_sheen");
  return gltf_ranged(g, s, "sheenColorFactor", 3, 0, 1, pbr->sheen_color) &&
         gltf_texture(g, s, "sheenColorTexture", &pbr->sheen_color_texture) &&
         gltf_ranged(g, s, "sheenRoughnessFactor", 1, 0, 1, &pbr->sheen_roughness) &&
         gltf_texture(g, s, "sheenRoughnessTexture", &pbr->sheen_roughness_texture);
}

// Their rotation is in radians, any number of turns; ours in degrees within one.
static bool add_anisotropy(Gltf *g, const Json *json, Pbr *pbr)
{
  const Json *a = gltf_extension(json, "KHR_materials_anisotropy");
  float turn = 0;
  if (!gltf_ranged(g, a, "anisotropyStrength", 1, 0, 1, &pbr->anisotropy) ||
      !gltf_floats(g, a, "anisotropyRotation", 1, &turn) ||
      !gltf_texture(g, a, "anisotropyTexture", &pbr->anisotropy_texture))
    return false;
  pbr->anisotropy_rotation = fmodf(turn * (180 / PI), 360);
  return true;
}

static bool add_iridescence(Gltf *g, const Json *json, Pbr *pbr)
{
  const Json *i = gltf_extension(json, "KHR_materials_iridescence");
  return gltf_ranged(g, i, "iridescenceFactor", 1, 0, 1, &pbr->iridescence) &&
         gltf_texture(g, i, "iridescenceTexture", &pbr->iridescence_texture) &&
         gltf_ranged(g, i, "iridescenceIor", 1, 1, 5, &pbr->iridescence_ior) &&
         gltf_ranged(g, i, "iridescenceThicknessMinimum", 1, 0, 10000, &pbr->iridescence_thickness_min) &&
         gltf_ranged(g, i, "iridescenceThicknessMaximum", 1, 0, 10000, &pbr->iridescence_thickness_max) &&
         gltf_texture(g, i, "iridescenceThicknessTexture", &pbr->iridescence_thickness_texture);
}

static bool add_dispersion(Gltf *g, const Json *json, Pbr *pbr)
{
  return gltf_ranged(g, gltf_extension(json, "KHR_materials_dispersion"), "dispersion", 1, 0, 20, &pbr->dispersion);
}

static void note_ignored(Gltf *g, const Json *json, const char *name)
{
  if (gltf_extension(json, "KHR_materials_diffuse_transmission"))
    note_once(&g->scene->notes,
              "KHR_materials_diffuse_transmission is not supported yet: diffuse_transmission of material \"%s\" is "
              "ignored",
              name);
}

static bool fill_pbr(Gltf *g, const Json *json, Pbr *pbr, const char *name)
{
  const Json *old = gltf_extension(json, "KHR_materials_pbrSpecularGlossiness");
  if (!add_base(g, json, pbr) || !add_alpha(g, json, pbr) || !add_normal_and_glow(g, json, pbr) ||
      !add_ior(g, json, pbr) || !add_specular(g, json, pbr) || !add_transmission(g, json, pbr) ||
      !add_clearcoat(g, json, pbr, name) || !add_sheen(g, json, pbr) || !add_anisotropy(g, json, pbr) ||
      !add_iridescence(g, json, pbr) || !add_dispersion(g, json, pbr))
    return false;
  if (old && !js_get(json, "pbrMetallicRoughness") && !add_specular_glossiness(g, old, pbr, name))
    return false;
  note_ignored(g, json, name);
  return true;
}

// KHR_materials_unlit: the base colour as it is, from both sides, lighting nothing.
static bool fill_unlit(Gltf *g, const Json *json, Emission *emission, const char *name)
{
  const Json *mr = js_get(json, "pbrMetallicRoughness");
  const char *mode = js_text(js_get(json, "alphaMode"));
  float base[4] = {1, 1, 1, 1};
  if (!gltf_ranged(g, mr, "baseColorFactor", 4, 0, 1, base) ||
      !gltf_texture(g, mr, "baseColorTexture", &emission->color_texture))
    return false;
  memcpy(emission->color, base, sizeof emission->color);
  emission->strength = 1;
  emission->double_sided = true;
  emission->lights_others = false;
  if (mode && !text_equal(mode, "OPAQUE"))
    note_once(&g->scene->notes, "%s: unlit material \"%s\" is shown opaque", g->path, name);
  return true;
}

static bool add_material(Gltf *g, size_t i)
{
  const Json *json = gltf_item(g, "materials", i);
  if (js_kind(json) != JSON_DICT) return gltf_fail_item(g, "materials", i, "a material must be a dictionary");
  const bool is_unlit = gltf_extension(json, "KHR_materials_unlit");
  char name[GLTF_NAME_SIZE];
  gltf_name(json, "material", i, name);
  const int32_t at = scene_add_material(g->scene, is_unlit ? MATERIAL_EMISSION : MATERIAL_PBR, name);
  if (at < 0) return err_memory(g->err, "materials", sizeof(Material));
  Material *m = &g->scene->materials.items[at];
  return is_unlit ? fill_unlit(g, json, &m->emission, name) : fill_pbr(g, json, &m->pbr, name);
}

bool gltf_add_materials(Gltf *g)
{
  const size_t count = gltf_count(g, "materials");
  if (!gltf_charge(g, count, sizeof(Material), "materials")) return false;
  for (size_t i = 0; i < count; i++)
    if (!add_material(g, i)) return false;
  return true;
}
