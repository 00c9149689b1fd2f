// See element.h: what the tables cannot say about an element. Each check names the field to blame and how to mend.

#include "scene/element.h"
#include "scene/gates.h"

#include "base/formula.h"

#include <math.h>

static bool check_camera(const Camera *c, const char **field, Err *err)
{
  const Vec3 view = v3_load(c->common.target) - v3_load(c->common.position), up = v3_load(c->common.up);
  const float view_length = v3_length(view), up_length = v3_length(up);
  *field = "target";
  if (!(view_length > 0))
    return err_set(err, ERR_BAD_SCENE,
                   "the camera's target is its position, so it looks nowhere; move one of them");
  if (!isfinite(view_length))
    return err_set(err, ERR_BAD_SCENE, "the camera's target is too far away; keep distances below 1e18 m");
  *field = "up";
  if (!(up_length > 0) || !isfinite(up_length))
    return err_set(err, ERR_BAD_SCENE, "the camera's up must be a direction, such as [0, 1, 0]");
  if (!(v3_length(v3_cross(view / view_length, up / up_length)) > 1e-6f))
    return err_set(err, ERR_BAD_SCENE,
                   "the camera's up is parallel to its view; take another axis, such as [0, 0, 1]");
  return true;
}

static bool check_object(const Object *object, const char **field, Err *err)
{
  const ObjectCommon *o = &object->common;
  bool is_matrix = false, is_moved = false;
  for (int i = 0; i < 12; i++) is_matrix |= o->matrix[i] != 0;
  for (int i = 0; i < 3; i++) is_moved |= o->translate[i] != 0 || o->rotate[i] != 0 || o->scale[i] != 1;
  *field = "matrix";
  if (is_matrix && is_moved)
    return err_set(err, ERR_BAD_SCENE,
                   "matrix is the whole map, so translate, rotate and scale must be absent");
  if (!is_matrix) *field = "scale";
  for (int i = 0; i < 3; i++)
    if (!is_matrix && o->scale[i] == 0)
      return err_set(err, ERR_BAD_SCENE,
                     "a scale of 0 makes the object flat; use a small number, such as 0.001");
  const Frame frame = object_frame(o);
  const float d = frame_determinant(&frame);
  if (d == 0 || !isfinite(d) || !isfinite(1 / d))
    return err_set(err, ERR_BAD_SCENE,
                   "%s makes the object flat, or too small or large for the numbers of the engine", *field);
  *field = "medium";
  const int32_t kind = object->shape.kind;
  if (o->medium >= 0 && kind != SHAPE_MESH && kind != SHAPE_SPHERE && kind != SHAPE_BOX && kind != SHAPE_VOXELS)
    return err_set(err, ERR_BAD_SCENE, "only a sphere, a box, a mesh or voxels can be filled with a medium");
  if (o->medium >= 0 && kind == SHAPE_VOXELS && o->material >= 0)
    return err_set(err, ERR_BAD_SCENE, "voxels that a medium fills are smoke and have no surface; leave out the material");
  return true;
}

static bool check_triangle(const ShapeTriangle *t, const char **field, Err *err)
{
  *field = "c";
  const Vec3 a = v3_load(t->a), n = v3_cross(v3_load(t->b) - a, v3_load(t->c) - a);
  const float area2 = v3_length(n);
  return (area2 > 1e-30f && isfinite(area2)) ||
         err_set(err, ERR_BAD_SCENE, "the triangle's corners lie on a line, or too near or far for the engine's numbers");
}

static bool check_formula(const ShapeFormula *f, const char **field, Err *err)
{
  Formula compiled;
  char message[200];
  *field = "formula";
  return formula_compile(f->formula, &compiled, message) || err_set(err, ERR_BAD_SCENE, "the formula, %s", message);
}

static bool check_shape(const Shape *s, const char **field, Err *err)
{
  *field = NULL;
  if (s->kind == SHAPE_TRIANGLE) return check_triangle(&s->triangle, field, err);
  if (s->kind == SHAPE_CONE && s->cone.radius == 0 && s->cone.top_radius == 0) {
    *field = "radius";
    return err_set(err, ERR_BAD_SCENE, "a cone needs a \"radius\" or a \"top_radius\" above 0");
  }
  if (s->kind == SHAPE_FORMULA) return check_formula(&s->formula, field, err);
  if (s->kind != SHAPE_MESH || s->mesh.file || s->mesh_i >= 0) return true;
  return err_set(err, ERR_BAD_SCENE, "a mesh needs a \"file\", or \"positions\" and \"triangles\"");
}

static bool check_aim(const float position[3], const float target[3], const char **field, Err *err)
{
  *field = "target";
  const float length = v3_length(v3_load(target) - v3_load(position));
  if (length > 0 && isfinite(length)) return true;
  return err_set(err, ERR_BAD_SCENE,
                 length > 0 ? "the light's target is too far away"
                            : "the light's target is its position, so it shines nowhere; move one");
}

static bool check_light(const Light *l, const char **field, Err *err)
{
  switch (l->kind) {
  case LIGHT_SPOT: return check_aim(l->spot.position, l->spot.target, field, err);
  case LIGHT_RECT: return check_aim(l->rect.position, l->rect.target, field, err);
  case LIGHT_DISK: return check_aim(l->disk.position, l->disk.target, field, err);
  case LIGHT_SUN: {
    *field = "direction";
    const float length = v3_length(v3_load(l->sun.direction));
    return (length > 0 && isfinite(length)) ||
           err_set(err, ERR_BAD_SCENE, "the sun's direction must not be zero; [0, 1, 0] is from above");
  }
  default: return true;
  }
}

static bool check_material(const Material *m, const char **field, Err *err)
{
  *field = "subsurface";
  if (m->kind != MATERIAL_PRINCIPLED || m->principled.subsurface <= 0) return true;
  return err_set(err, ERR_BAD_SCENE, "subsurface is not supported: light that wanders below a skin needs a medium inside; "
                                     "leave it at 0 and choose the base_color it gives the skin");
}

bool element_check(const Group *g, const void *element, const char **field, Err *err)
{
  const char *ignored;
  if (!field) field = &ignored;
  *field = NULL;
  if (g == &group_camera || g == &group_cameras) return check_camera(element, field, err);
  if (g == &group_object) return check_object(element, field, err);
  if (g == &group_shape) return check_shape(element, field, err);
  if (g == &group_material) return check_material(element, field, err);
  if (g == &group_cell) return cell_check(element, field, err);
  if (g == &group_gate) return gate_check(element, field, err);
  if (g == &group_light) return check_light(element, field, err);
  const bool is_embedded = g == &group_texture && ((const Texture *)element)->embedded;
  const Field *f;
  void *at;
  for (size_t i = 0; !is_embedded && (f = group_field_at(g, element, i, &at)); i++)
    if (field_is_required(f) && !*(const void **)at)
      return err_set(err, ERR_BAD_SCENE, "a %s%s%s%s needs a \"%s\"", g->noun, g->has_kind ? " of kind \"" : "",
                     g->has_kind ? group_kind(g, element)->name : "", g->has_kind ? "\"" : "", f->name);
  return true;
}
