// KHR_lights_punctual: point, spot and directional lights. A light has no size there, so shadows are hard.
//
// Units. The extension counts in candela and lux, we in W/sr and W/m2. The luminous efficacy of 555 nm light, 683 lm/W,
// leads from one to the other, as Blender has it ("Standard" lighting mode): a point of P watts is written by it as
// 683 P / 4 pi candela and is read here as P / 4 pi W/sr again. Many files are made for viewers that take the numbers
// as they are, though: their lights have an intensity of 1 to 50, which would be black by that rule. No lamp of any
// use is that weak in candela at the exposure we begin with, so: if no light of a file reaches 100, all are taken as
// they are, and a note says so. Emissive factors are taken as they are in any case, as everyone does.

#include "scene/gltf.h"

#include <string.h>

static const Json *lights_of(const Gltf *g)
{
  return js_get(gltf_extension(g->root, "KHR_lights_punctual"), "lights");
}

void gltf_choose_light_scale(Gltf *g)
{
  const float lumens_per_watt = 683, weakest_photometric = 100;
  const Json *lights = lights_of(g);
  const size_t count = js_kind(lights) == JSON_LIST ? js_count(lights) : 0;
  g->light_scale = 1;
  for (size_t i = 0; i < count; i++)
    if (js_number(js_get(js_at(lights, i), "intensity"), 1) >= (double)weakest_photometric)
      g->light_scale = 1 / lumens_per_watt;
  if (count && g->light_scale == 1)
    note_once(&g->scene->notes,
              "%s: its lights are too weak for candela and lux and are taken as W/sr and W/m2", g->path);
}

static bool add_point(Gltf *g, const char *name, const float *color, const Frame *pose)
{
  const int32_t at = scene_add_light(g->scene, LIGHT_POINT, name);
  if (at < 0) return err_memory(g->err, "lights", sizeof(Light));
  LightPoint *point = &g->scene->lights.items[at].point;
  v3_store(point->position, pose->p);
  memcpy(point->intensity, color, sizeof point->intensity);
  return true;
}

static bool add_sun(Gltf *g, const char *name, const float *color, const Frame *pose)
{
  const int32_t at = scene_add_light(g->scene, LIGHT_SUN, name);
  if (at < 0) return err_memory(g->err, "lights", sizeof(Light));
  LightSun *sun = &g->scene->lights.items[at].sun;
  v3_store(sun->direction, pose->z); // light travels along -z
  memcpy(sun->irradiance, color, sizeof sun->irradiance);
  sun->angle = 0;
  return true;
}

static bool add_spot(Gltf *g, const char *name, const Json *json, const float *color, const Frame *pose)
{
  const float degrees = 180 / PI;
  const Json *cone = js_get(json, "spot");
  float inner = 0, outer = PI / 4;
  if (!gltf_ranged(g, cone, "innerConeAngle", 1, 0, PI / 2, &inner) ||
      !gltf_ranged(g, cone, "outerConeAngle", 1, 0, PI / 2, &outer))
    return false;
  const int32_t at = scene_add_light(g->scene, LIGHT_SPOT, name);
  if (at < 0) return err_memory(g->err, "lights", sizeof(Light));
  LightSpot *spot = &g->scene->lights.items[at].spot;
  v3_store(spot->position, pose->p);
  v3_store(spot->target, pose->p - pose->z);
  memcpy(spot->intensity, color, sizeof spot->intensity);
  spot->angle = clamp_f(outer * degrees, 0.01f, 90);
  spot->inner_angle = min_f(inner * degrees, spot->angle);
  return true;
}

bool gltf_add_light(Gltf *g, const Json *node, size_t node_i, const Frame *world, bool *is_added)
{
  *is_added = false;
  const Json *use = gltf_extension(node, "KHR_lights_punctual"), *lights = lights_of(g);
  size_t light_i;
  if (!use) return true;
  if (!gltf_index_below(g, use, "light", js_kind(lights) == JSON_LIST ? js_count(lights) : 0, "lights",
                        &light_i))
    return false;
  if (light_i == GLTF_NONE) return gltf_fail_item(g, "nodes", node_i, "KHR_lights_punctual names no light");
  const Json *json = js_at(lights, light_i);
  float color[3] = {1, 1, 1}, intensity = 1;
  if (!gltf_ranged(g, json, "color", 3, 0, FLT_MAX, color) ||
      !gltf_ranged(g, json, "intensity", 1, 0, FLT_MAX, &intensity) ||
      !gltf_charge(g, 1, sizeof(Light) + GLTF_NAME_SIZE, "lights"))
    return false;
  for (int k = 0; k < 3; k++) color[k] = clamp_f(color[k] * intensity * g->light_scale, 0, FLT_MAX);
  // The node's scale counts neither for the aim nor for the strength.
  const Frame pose = {world->x, world->y, v3_normalize(world->z), world->p};
  const char *type = js_text(js_get(json, "type"));
  *is_added = true;
  char name[GLTF_NAME_SIZE];
  gltf_name(js_get(node, "name") ? node : json, "light", light_i, name);
  if (text_equal(type, "point")) return add_point(g, name, color, &pose);
  if (text_equal(type, "spot")) return add_spot(g, name, json, color, &pose);
  if (text_equal(type, "directional")) return add_sun(g, name, color, &pose);
  return gltf_fail(g, json, "type", "a light's \"type\" is \"point\", \"spot\" or \"directional\"");
}
