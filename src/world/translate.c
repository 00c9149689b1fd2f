// See translate.h. In the formulas, primed names are pbr's.

#include "world/translate.h"

#include "base/vec.h"
#include "scene/kinds.h"

#define PLAIN_F0 0.04f // of ior 1.5, pbr's default

static Pbr pbr_default(void)
{
  Material m;
  group_default(&group_material, MATERIAL_PBR, &m);
  return m.pbr;
}

static void set_color(float to[3], Vec3 c)
{
  v3_store(to, v3_max(c, v3_all(0)));
}

// The base's colour at a luminance of one, which Disney's tints go to (Burley, "Physically based shading at Disney",
// 2012); white for black.
static Vec3 tint_of(const float base[3], float amount)
{
  const Vec3 c = v3_load(base);
  const float light = luminance(c);
  return v3_mix(v3_all(1), light > 0 ? c / light : v3_all(1), amount);
}

// Dielectric reflection of f0, an f90 of 1 whatever it is: specular_color' times 0.04 is f0. None at all for f0 = 0.
static void set_f0(Pbr *p, Vec3 f0, float f90)
{
  p->ior = 1.5f;
  p->specular = f90;
  if (f90 > 0) set_color(p->specular_color, f0 / (PLAIN_F0 * f90));
}

// anisotropic a makes widths alpha / aspect and alpha * aspect with aspect = sqrt(1 - 0.9 a) (Burley 2012); ours keeps
// the narrow one and widens the other by strength^2 of what is missing to 1, so both are met as long as the wide one is
// no wider than 1.
static void set_widths(Pbr *p, float roughness, float anisotropic)
{
  const float aspect = sqrtf(1 - 0.9f * anisotropic), alpha = roughness * roughness;
  const float narrow = alpha * aspect, wide = min_f(alpha / aspect, 1);
  p->roughness = sqrtf(narrow);
  p->anisotropy = narrow < 1 ? safe_sqrt((wide - narrow) / (1 - narrow)) : 0;
}

Pbr pbr_of_principled(const Principled *m)
{
  Pbr p = pbr_default();
  const bool is_clear = m->transmission > 0;
  set_color(p.base_color, v3_load(m->base_color));
  p.base_color_texture = m->base_color_texture;
  p.metallic = m->metallic;
  p.metallic_texture = m->metallic_texture;
  p.metallic_channel = 0;
  set_widths(&p, m->roughness, m->anisotropic);
  p.anisotropy_rotation = 360 * m->anisotropic_rotation;
  p.roughness_texture = m->roughness_texture;
  p.roughness_channel = 0;
  set_f0(&p, 0.08f * m->specular * tint_of(m->base_color, m->specular_tint), m->specular > 0 ? 1 : 0);
  if (is_clear) { // what refracts must reflect by its own index
    p.ior = m->ior;
    p.specular = 1;
    set_color(p.specular_color, v3_all(1));
  }
  p.transmission = m->transmission;
  set_color(p.sheen_color, v3_min(m->sheen * tint_of(m->base_color, m->sheen_tint), v3_all(1)));
  p.sheen_roughness = 0.5f;
  p.clearcoat = m->clearcoat;
  p.clearcoat_roughness = m->clearcoat_roughness;
  set_color(p.emissive, v3_load(m->emission));
  p.emissive_texture = m->emission_texture;
  p.emissive_strength = m->emission_strength;
  p.opacity = m->alpha;
  p.opacity_texture = m->alpha_texture;
  p.alpha_mode = m->alpha < 1 || m->alpha_texture >= 0 ? ALPHA_BLEND : ALPHA_OPAQUE;
  p.normal_texture = m->normal_texture;
  p.normal_scale = m->normal_strength;
  return p;
}

// The originals' equations cannot be met as they are: their highlights add light to what is scattered, and direct and
// scattered light, which directToScatter weighs, come alike to a path tracer. What each slider is for stays:
//
//   reflection         f0' = 0.04 s + (1 - 0.04 s) reflection: the body's reflection straight on, white, up to all of it;
//                      pbr takes it from the matt part (the original's 1 - refl)
//   specular (s)       f90' = s + (1 - s) reflection, and the 0.04 s above: the highlight of a dielectric, and none at 0
//   metallic           metallic'
//   roughness          roughness' = roughness: the widths of reflection and highlight, which the original kept in two
//                      numbers that pull apart
//   directToScatter    base_color' = color (1 + directToScatter) / 2
Pbr pbr_of_studio(const Studio *m)
{
  Pbr p = pbr_default();
  const float f0 = PLAIN_F0 * m->specular;
  set_color(p.base_color, v3_load(m->color) * ((1 + m->direct_to_scatter) / 2));
  p.base_color_texture = m->color_texture;
  p.metallic = m->metallic;
  p.roughness = m->roughness;
  set_f0(&p, v3_all(f0 + (1 - f0) * m->reflection), m->specular + (1 - m->specular) * m->reflection);
  return p;
}
