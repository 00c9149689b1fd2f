// Eye: a camera made ready to shoot rays, and the ray of a place on the film. Pose and lens only: it knows no scene
// and no picture size of its own, so the same eye serves any resolution.

#ifndef RAYFOLD_RENDER_CAMERA_H
#define RAYFOLD_RENDER_CAMERA_H

#include "base/err.h"
#include "base/fmath.h"
#include "base/ray.h"
#include "scene/scene.h"

typedef enum EyeKind { EYE_PERSPECTIVE, EYE_ORTHOGRAPHIC, EYE_PANORAMIC } EyeKind;

typedef struct Eye {
  EyeKind kind;
  Frame frame;        // right, up, back, place; orthonormal
  float tan_half_fov; // perspective: of half the vertical field of view
  float focus;        // metres along the view axis to the sharp plane
  float aperture;     // radius of the lens in metres; 0: a pinhole
  int32_t blades;     // of the aperture; under 3: round
  float height;       // orthographic: metres from the picture's bottom to its top
  float span;         // panoramic: radians from its left to its right; half of that from bottom to top
  uint32_t cell;      // of the world, in which the frame is
} Eye;

// The eye of a scene's camera. Fails if it looks nowhere (target and position agree) or a number is not finite. An
// up that lies along the view is replaced by another axis.
bool eye_from_camera(const Camera *c, Eye *out, Err *err);
// In a cell of this curvature: its axes are then true ones, its place and target those of the chart.
void eye_bend(const Camera *c, float kappa, Eye *e);

// --- hot ----------------------------------------------------------------------------------------

// A place in the unit disk, areas kept (Shirley and Chiu, "A low distortion map between disk and square", 1997).
static inline Vec2 lens_disk(Vec2 u)
{
  const float a = 2 * u.x - 1, b = 2 * u.y - 1;
  if (a == 0 && b == 0) return (Vec2){0, 0};
  const bool is_wide = fabsf(a) > fabsf(b);
  const float r = is_wide ? a : b;
  const float angle = is_wide ? PI / 4 * (b / a) : PI / 2 - PI / 4 * (a / b);
  float sine, cosine;
  f_sincos(angle, &sine, &cosine);
  return (Vec2){r * cosine, r * sine};
}

// A place in the regular polygon with `blades` corners on the unit circle, one of them on top: a sector is chosen by
// u.x, the rest of u.x and u.y fill its triangle evenly.
static inline Vec2 lens_polygon(int32_t blades, Vec2 u)
{
  const float scaled = u.x * (float)blades, sector = floorf(scaled);
  const float step = 2 * PI / (float)blades, rest = scaled - sector;
  const float from_middle = sqrtf(rest), along = u.y;
  float s0, c0, s1, c1;
  f_sincos(step * sector, &s0, &c0);
  f_sincos(step * (sector + 1), &s1, &c1);
  return (Vec2){from_middle * (s0 + along * (s1 - s0)), from_middle * (c0 + along * (c1 - c0))};
}

static inline Vec2 lens_point(const Eye *e, Vec2 u)
{
  const Vec2 p = e->blades >= 3 ? lens_polygon(e->blades, u) : lens_disk(u);
  return (Vec2){e->aperture * p.x, e->aperture * p.y};
}

// The ray of a place on a film of width x height pixels (x to the right, y down, (0, 0) the upper left corner); its
// direction has unit length. lens in [0, 1)^2.
static inline Ray eye_ray(const Eye *e, float width, float height, Vec2 film, Vec2 lens)
{
  const float x = 2 * film.x / width - 1, y = 1 - 2 * film.y / height; // -1..1
  Vec3 o = v3_all(0), d = v3(0, 0, -1);                                // in the eye's frame
  switch (e->kind) {
  case EYE_PERSPECTIVE:
    d = v3(x * e->tan_half_fov * (width / height), y * e->tan_half_fov, -1);
    if (e->aperture > 0) {
      const Vec2 p = lens_point(e, lens);
      o = v3(p.x, p.y, 0);
      d = e->focus * d - o;
    }
    break;
  case EYE_ORTHOGRAPHIC: o = v3(x * e->height / 2 * (width / height), y * e->height / 2, 0); break;
  case EYE_PANORAMIC: {
    float sin_x, cos_x, sin_y, cos_y;
    f_sincos(x * e->span / 2, &sin_x, &cos_x);
    f_sincos(y * e->span / 4, &sin_y, &cos_y);
    d = v3(cos_y * sin_x, sin_y, -cos_y * cos_x);
    break;
  }
  }
  return (Ray){frame_point(&e->frame, o), v3_normalize(frame_vector(&e->frame, d)), 0, INFINITY};
}

// What the ray of direction d stands for: a pixel's side at one metre, the geometric mean of its two sides off the
// picture's middle. A lens is a point here: what it blurs, its own samples blur.
static inline Cone eye_cone(const Eye *e, float height, Vec3 d)
{
  switch (e->kind) {
  case EYE_PERSPECTIVE: {
    const float cosine = max_f(-v3_dot(d, e->frame.z), 0);
    return (Cone){0, 2 * e->tan_half_fov / height * cosine * sqrtf(cosine)};
  }
  case EYE_ORTHOGRAPHIC: return (Cone){e->height / height, 0};
  case EYE_PANORAMIC: return (Cone){0, e->span / 2 / height};
  }
  unreachable();
}

#endif
