// See camera.h: from the numbers of a scene's camera to an eye.

#include "render/camera.h"
#include "space/chart.h"

static float radians_of(float degrees)
{
  return degrees * (PI / 180);
}

// Right, up and back of an eye that looks along `back` reversed.
static Frame look_frame(Vec3 position, Vec3 back, Vec3 up)
{
  Vec3 right = v3_cross(up, back);
  // Within a thousandth of a degree of the view axis the cross product is mostly rounding.
  if (!(v3_length(right) > 1e-5f * v3_length(up)))
    right = v3_cross(fabsf(back[1]) < 0.9f ? v3(0, 1, 0) : v3(0, 0, -1), back);
  right = v3_normalize(right);
  return (Frame){right, v3_normalize(v3_cross(back, right)), back, position};
}

bool eye_from_camera(const Camera *c, Eye *out, Err *err)
{
  const char *name = c->name ? c->name : "camera";
  const Vec3 position = v3_load(c->common.position), target = v3_load(c->common.target),
             up = v3_load(c->common.up);
  const Vec3 back = position - target;
  const float distance = v3_length(back);
  if (!v3_is_finite(position) || !v3_is_finite(up) || !isfinite(distance)) {
    return err_set(err, ERR_BAD_SCENE, "%s: position, target or up is not finite or too far away", name);
  }
  if (!(distance > 0)) {
    return err_set(err, ERR_BAD_SCENE, "%s: position and target are the same point; move one of them", name);
  }
  *out = (Eye){.frame = look_frame(position, back / distance, up), .cell = (uint32_t)(c->common.cell + 1)};
  switch ((CameraKind)c->kind) {
  case CAMERA_PERSPECTIVE: {
    const float half = radians_of(c->perspective.fov) / 2;
    out->kind = EYE_PERSPECTIVE;
    out->tan_half_fov = f_sin(half) / f_cos(half);
    out->focus = c->perspective.focus > 0 ? c->perspective.focus : distance;
    out->aperture = c->perspective.aperture;
    out->blades = c->perspective.blades;
    break;
  }
  case CAMERA_ORTHOGRAPHIC:
    out->kind = EYE_ORTHOGRAPHIC;
    out->height = c->orthographic.height;
    break;
  case CAMERA_PANORAMIC:
    out->kind = EYE_PANORAMIC;
    out->span = radians_of(c->panoramic.span);
    break;
  }
  return true;
}

void eye_bend(const Camera *c, float kappa, Eye *e)
{
  if (kappa == 0) return;
  const Vec3 p = e->frame.p, way = v3_load(c->common.target) - p, d = v3_normalize(way);
  e->frame = look_frame(p, -v3_normalize(chart_to_local(kappa, p, d)), v3_load(c->common.up));
  if (!(c->kind == CAMERA_PERSPECTIVE && c->perspective.focus > 0))
    e->focus = chart_length(kappa, chart_span(kappa, p, d, v3_length(way)));
}
