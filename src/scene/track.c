// See track.h. Numbers go through `width` floats a key, whatever the field's type; all that is no number keeps its
// JSON and steps. The arithmetic is in double and rounded once, so that a key's own value comes out exactly.

#include "scene/track.h"

#include "scene/element.h"
#include "scene/quaternion.h"
#include "scene/rig.h"
#include "scene/target.h"

#include <string.h>

enum { MOST_NUMBERS = 12 };

typedef struct TrackValues {
  FieldType type; // of the field they were read for
  size_t width;   // numbers a key; 0: texts
  float *numbers; // width a key, then as many `in` and as many `out` slopes
  const char **texts;
} TrackValues;

// --- binding --------------------------------------------------------------------------------------
static size_t width_of(FieldType type)
{
  switch (type) {
  case FIELD_real:
  case FIELD_integer: return 1;
  case FIELD_vec2:
  case FIELD_size: return 2;
  case FIELD_color:
  case FIELD_vec3: return 3;
  case FIELD_matrix: return 12;
  case FIELD_flag:
  case FIELD_choice:
  case FIELD_texture:
  case FIELD_object:
  case FIELD_material:
  case FIELD_medium:
  case FIELD_sky:
  case FIELD_cell:
  case FIELD_gate:
  case FIELD_points:
  case FIELD_text:
  case FIELD_file:
  case FIELD_path:
  case FIELD_keys: return 0;
  }
  unreachable();
}

typedef struct Binder {
  Scene *scene;
  const Track *track;
  const Field *field;
  const char **member;
  Err *err;
} Binder;

static bool fail(const Binder *b, const char *member, const char *message)
{
  *b->member = member;
  return err_set(b->err, ERR_BAD_SCENE, "%s", message);
}

// The key's JSON into at, as the field has it in memory. slope: any number will do.
static bool read_value(const Binder *b, const char *json, bool is_slope, void *at)
{
  Field f = *b->field;
  int item;
  if (is_slope) f.low = -(f.high = NO_LIMIT);
  JsonDoc *doc = js_parse(json, strlen(json), "value", b->err);
  const bool ok = doc && value_read(b->scene, &f, js_root(doc), at, &item, b->err);
  js_free(doc);
  return ok;
}

static void to_floats(FieldType type, size_t width, const void *value, float *out)
{
  const bool is_whole = type == FIELD_integer || type == FIELD_size;
  for (size_t i = 0; i < width; i++)
    out[i] = is_whole ? (float)((const int32_t *)value)[i] : ((const float *)value)[i];
}

static bool bind_number(const Binder *b, const char *member, const char *json, size_t width, float *out)
{
  union {
    float reals[MOST_NUMBERS];
    int32_t wholes[MOST_NUMBERS];
  } value = {{0}};
  *b->member = member;
  if (!json) return true; // a slope that is not given is 0
  if (!read_value(b, json, strcmp(member, "value") != 0, &value)) return false;
  to_floats(b->field->type, width, &value, out);
  return true;
}

static bool bind_numbers(const Binder *b, size_t i, TrackValues *v)
{
  const Key *k = &b->track->fields.keys->items[i];
  const size_t all = v->width * b->track->fields.keys->count, at = v->width * i;
  return bind_number(b, "value", k->value, v->width, v->numbers + at) &&
         bind_number(b, "in", k->in, v->width, v->numbers + all + at) &&
         bind_number(b, "out", k->out, v->width, v->numbers + 2 * all + at);
}

// Kept as the field would write it, so that a moment which changes nothing can tell.
static bool bind_text(const Binder *b, size_t i, TrackValues *v)
{
  const Key *k = &b->track->fields.keys->items[i];
  union {
    int32_t index;
    bool flag;
  } value = {0};
  Text text = {0};
  *b->member = "value";
  if (!read_value(b, k->value, false, &value)) return false;
  value_write(b->scene, b->field, &value, &text, NULL);
  v->texts[i] = arena_text(&b->scene->arena, text_get(&text));
  text_finish(&text);
  return v->texts[i] || err_memory(b->err, "keys", 0);
}

static bool bind_keys(const Binder *b, int *item, const TrackValues **out)
{
  const size_t count = b->track->fields.keys->count;
  Arena *arena = &b->scene->arena;
  TrackValues *v = arena_alloc(arena, 1, sizeof *v);
  if (!v) return err_memory(b->err, "keys", sizeof *v);
  *v = (TrackValues){.type = b->field->type, .width = width_of(b->field->type)};
  if (v->width) {
    v->numbers = arena_alloc(arena, 3 * count, v->width * sizeof *v->numbers);
    if (v->numbers) memset(v->numbers, 0, 3 * count * v->width * sizeof *v->numbers);
  } else {
    v->texts = arena_alloc(arena, count, sizeof *v->texts);
  }
  if (!v->numbers && !v->texts) return err_memory(b->err, "keys", count * sizeof(Key));
  for (size_t i = 0; i < count; i++) {
    *item = (int)i;
    if (v->width ? !bind_numbers(b, i, v) : !bind_text(b, i, v)) return false;
  }
  *item = -1;
  *b->member = NULL;
  *out = v;
  return true;
}

static bool is_turned(const Field *f)
{
  return f->type == FIELD_vec3 && !strcmp(f->unit, "deg");
}

static bool check_target(const Binder *b, const Target *t)
{
  if (t->part != TARGET_FIELD) return fail(b, "path", "a track moves one field, as objects.ball.translate");
  if (t->section->group == &group_track || t->section->group == &group_timeline)
    return fail(b, "path", "the animation itself cannot be animated");
  if (t->field.type == FIELD_file || t->field.type == FIELD_text)
    return fail(b, "path", "texts and files cannot be animated");
  if (b->track->fields.turn == TURN_SHORTEST && !is_turned(&t->field))
    return fail(b, "turn", "turn \"shortest\" is for fields of three angles, such as an object's rotate");
  const Keys *keys = b->track->fields.keys;
  for (size_t i = 0; i < keys->count; i++)
    if (b->track->fields.turn == TURN_SHORTEST && keys->items[i].easing == KEY_SPLINE)
      return fail(b, "turn", "turn \"shortest\" knows no splines; take another easing, or turn \"angles\"");
  return true;
}

bool track_bind(Scene *s, Track *track, int *item, const char **member, Err *err)
{
  Target t;
  Binder b = {s, track, NULL, member, err};
  *item = -1;
  *member = "path";
  bool ok = target_find(s, track->fields.path, &t, err);
  if (ok && t.is_new) ok = err_set(err, ERR_BAD_SCENE, "%.200s: there is no such %s", track->fields.path, t.group->noun);
  ok = ok && check_target(&b, &t);
  b.field = &t.field;
  ok = ok && bind_keys(&b, item, &track->values);
  target_finish(&t);
  return ok;
}

// --- a moment's value -----------------------------------------------------------------------------
// Where a moment falls among the keys: key i and a part of the way to the next, 0 at the last.
typedef struct Place {
  size_t i;
  double u, span; // 0..1; seconds from key i to the next
} Place;

// Brings a moment from beyond the keys to one between them.
static double fold(double t, double start, double end, Beyond beyond)
{
  const double length = end - start;
  if (beyond == BEYOND_HOLD || !(length > 0)) return t < start ? start : end;
  const double turns = floor((t - start) / length);
  const double into = t - start - turns * length;
  return beyond == BEYOND_LOOP || fmod(turns, 2) == 0 ? start + into : end - into;
}

static Place find_place(const Track *track, double seconds)
{
  const Keys *k = track->fields.keys;
  const double start = (double)k->items[0].time, end = (double)k->items[k->count - 1].time;
  double t = seconds;
  if (t < start) t = fold(t, start, end, (Beyond)track->fields.before);
  if (t > end) t = fold(t, start, end, (Beyond)track->fields.after);
  // A frame's time is a quotient, a key's was written as a decimal: they meet as floats.
  const float at = (float)t;
  size_t low = 0, high = k->count - 1;
  while (low < high) {
    const size_t middle = low + (high - low + 1) / 2;
    if (k->items[middle].time <= at) low = middle;
    else high = middle - 1;
  }
  if (low + 1 == k->count) return (Place){low, 0, 0};
  const double span = (double)k->items[low + 1].time - (double)k->items[low].time;
  const double u = (t - (double)k->items[low].time) / span;
  return (Place){low, u < 0 ? 0 : u > 1 ? 1 : u, span};
}

// The curve x(s) = u, y(s) of CSS Easing Functions Level 1, section 2.2: x rises, so halving finds s.
static double bezier_ease(const float b[4], double u)
{
  double low = 0, high = 1;
  for (int i = 0; i < 60; i++) {
    const double s = (low + high) / 2, r = 1 - s;
    const double x = 3 * r * r * s * (double)b[0] + 3 * r * s * s * (double)b[2] + s * s * s;
    if (x < u) low = s;
    else high = s;
  }
  const double s = (low + high) / 2, r = 1 - s;
  return 3 * r * r * s * (double)b[1] + 3 * r * s * s * (double)b[3] + s * s * s;
}

// Cubic Hermite: values a and b, slopes m and n a second (glTF 2.0, appendix C.5).
static double hermite(double a, double m, double b, double n, double u, double span)
{
  const double u2 = u * u, u3 = u2 * u;
  return (2 * u3 - 3 * u2 + 1) * a + span * (u3 - 2 * u2 + u) * m + (3 * u2 - 2 * u3) * b + span * (u3 - u2) * n;
}

static int32_t easing_at(const Track *t, size_t i)
{
  const int32_t own = t->fields.keys->items[i].easing;
  return own == KEY_AS_TRACK ? t->fields.easing : own;
}

// The key before or after, over the seam of a loop; *time as if time went on. False: there is none.
static bool neighbour(const Track *t, size_t i, int step, size_t *at, double *time)
{
  const Keys *k = t->fields.keys;
  const size_t last = k->count - 1;
  const double length = (double)k->items[last].time - (double)k->items[0].time;
  const bool is_loop = t->fields.before == BEYOND_LOOP || t->fields.after == BEYOND_LOOP;
  const bool is_seam = step < 0 ? i == 0 : i == last;
  if (is_seam && (!is_loop || last < 2)) return false;
  // In a loop the last key stands where the first does.
  *at = !is_seam ? i + (size_t)step : step < 0 ? last - 1 : 1;
  *time = (double)k->items[*at].time + (is_seam ? step * length : 0);
  return true;
}

// Catmull and Rom's slope for keys at any distance: that of the line from neighbour to neighbour.
static double chord(const Track *t, const float *numbers, size_t i, size_t c)
{
  const Keys *k = t->fields.keys;
  const size_t w = t->values->width;
  size_t a = i, b = i;
  double ta = (double)k->items[i].time, tb = ta;
  (void)neighbour(t, i, -1, &a, &ta);
  (void)neighbour(t, i, 1, &b, &tb);
  return tb > ta ? ((double)numbers[b * w + c] - (double)numbers[a * w + c]) / (tb - ta) : 0;
}

// How far between two keys, for the easings that go straight from one to the other.
static double ease(const Track *t, const Place *p)
{
  const int32_t easing = easing_at(t, p->i);
  switch (easing) {
  case EASING_STEP: return 0;
  case EASING_SMOOTH: return p->u * p->u * (3 - 2 * p->u);
  case KEY_BEZIER: return bezier_ease(t->fields.keys->items[p->i].bezier, p->u);
  default: return p->u;
  }
}

static double component(const Track *t, const Place *p, size_t c)
{
  const TrackValues *v = t->values;
  const size_t w = v->width, all = w * t->fields.keys->count, i = p->i * w + c;
  const double a = (double)v->numbers[i], b = (double)v->numbers[i + w];
  const int32_t easing = easing_at(t, p->i);
  if (easing == KEY_SPLINE)
    return hermite(a, (double)v->numbers[2 * all + i], b, (double)v->numbers[all + i + w], p->u, p->span);
  if (easing == EASING_CUBIC)
    return hermite(a, chord(t, v->numbers, p->i, c), b, chord(t, v->numbers, p->i + 1, c), p->u, p->span);
  const double e = ease(t, p);
  return e == 1 ? b : a + e * (b - a);
}

static void turn(const Track *t, const Place *p, float out[3])
{
  const float *angles = t->values->numbers + 3 * p->i;
  const Quaternion a = quaternion_from_angles(angles), b = quaternion_from_angles(angles + 3);
  if (easing_at(t, p->i) != EASING_CUBIC) {
    quaternion_to_angles(quaternion_slerp(a, b, ease(t, p)), out);
    return;
  }
  size_t before = p->i, after = p->i + 1;
  double t0 = (double)t->fields.keys->items[p->i].time, t1 = t0, t2 = t0 + p->span, t3 = t2;
  (void)neighbour(t, p->i, -1, &before, &t0);
  (void)neighbour(t, p->i + 1, 1, &after, &t3);
  // Four neighbours on one side of the sphere, then as plain numbers, then back to unit length.
  Quaternion q[4] = {quaternion_from_angles(t->values->numbers + 3 * before), a, b,
                     quaternion_from_angles(t->values->numbers + 3 * after)};
  for (int k = 2; k < 4; k++) q[k] = quaternion_toward(q[k - 1], q[k]);
  q[0] = quaternion_toward(q[1], q[0]);
  Quaternion r;
  for (int c = 0; c < 4; c++) {
    const double m = t2 > t0 ? (q[2].v[c] - q[0].v[c]) / (t2 - t0) : 0;
    const double n = t3 > t1 ? (q[3].v[c] - q[1].v[c]) / (t3 - t1) : 0;
    r.v[c] = hermite(q[1].v[c], m, q[2].v[c], n, p->u, p->span);
  }
  quaternion_to_angles(r, out);
}

static void numbers_at(const Track *t, const Field *f, const Place *p, float *out)
{
  const TrackValues *v = t->values;
  if (p->u == 0 || easing_at(t, p->i) == EASING_STEP) {
    memcpy(out, v->numbers + v->width * p->i, v->width * sizeof *out);
  } else if (t->fields.turn == TURN_SHORTEST) {
    turn(t, p, out);
  } else {
    // A curve may swing past its keys, but no field may leave its range.
    for (size_t c = 0; c < v->width; c++)
      out[c] = clamp_f((float)component(t, p, c), (float)f->low, (float)f->high);
  }
}

// --- setting fields -------------------------------------------------------------------------------
static bool set_numbers(const Track *t, const Field *f, const Place *p, void *at)
{
  union {
    float reals[MOST_NUMBERS];
    int32_t wholes[MOST_NUMBERS];
  } value;
  numbers_at(t, f, p, value.reals);
  if (f->type == FIELD_integer || f->type == FIELD_size)
    for (size_t c = 0; c < t->values->width; c++) value.wholes[c] = (int32_t)rintf(value.reals[c]);
  if (!memcmp(at, &value, t->values->width * 4)) return false;
  memcpy(at, &value, t->values->width * 4);
  return true;
}

static bool set_text(Scene *s, const Field *f, const char *json, void *at, bool *is_moved, Err *err)
{
  Text now = {0};
  int item;
  value_write(s, f, at, &now, NULL);
  *is_moved = strcmp(text_get(&now), json) != 0;
  text_finish(&now);
  if (!*is_moved) return true;
  JsonDoc *doc = js_parse(json, strlen(json), "value", err);
  const bool ok = doc && value_read(s, f, js_root(doc), at, &item, err);
  js_free(doc);
  return ok;
}

static unsigned moved_by(const Target *t)
{
  const Group *g = t->section->group;
  if (g == &group_camera || g == &group_cameras) return MOVED_CAMERA;
  return g == &group_render || g == &group_develop ? 0 : MOVED_WORLD;
}

static bool set_target(Scene *s, Track *track, const Target *t, double seconds, unsigned *moved, Err *err)
{
  void *element = section_at(s, t->section, t->index);
  void *at = target_field(t, element);
  const Place place = find_place(track, seconds);
  bool is_moved = false;
  if (track->values->width)
    is_moved = set_numbers(track, &t->field, &place, at);
  else if (!set_text(s, &t->field, track->values->texts[place.i], at, &is_moved, err))
    return false;
  if (section_given(s, t->section)) *section_given(s, t->section) = true;
  if (is_moved) *moved |= moved_by(t);
  return true;
}

// An edit may have put another kind there since; then the values are read anew.
static bool rebind(Scene *s, Track *track, const Target *t, Err *err)
{
  int item;
  const char *member;
  return (track->values && track->values->type == t->field.type) || track_bind(s, track, &item, &member, err);
}

static bool track_show(Scene *s, Track *track, double seconds, unsigned *moved, Err *err)
{
  Target t;
  bool ok = target_find(s, track->fields.path, &t, err);
  if (ok && (t.is_new || t.part != TARGET_FIELD))
    ok = err_set(err, ERR_BAD_SCENE, "%.200s: there is no such field", track->fields.path);
  ok = ok && rebind(s, track, &t, err) && set_target(s, track, &t, seconds, moved, err);
  target_finish(&t);
  return ok;
}

// After all tracks, as one may mend what another breaks.
static bool track_check(const Scene *s, const Track *track, Err *err)
{
  Target t;
  bool ok = target_find(s, track->fields.path, &t, err);
  void *element = ok ? section_at(s, t.section, t.index) : NULL;
  ok = ok && element_check(t.section->group, element, NULL, err);
  target_finish(&t);
  return ok;
}

static bool fail_track(const Scene *s, size_t i, double seconds, Err *err)
{
  Text where = {0};
  section_path(s, section_find(group_track.name), i, &where);
  err_where(err, "%s at %g s", text_get(&where), seconds);
  text_finish(&where);
  return false;
}

static bool set_time(Scene *s, const char *clip, bool is_strict, double seconds, unsigned *moved, Err *err)
{
  s->has_time = true;
  s->time = seconds;
  if (!rig_pose(s, clip, is_strict, false, seconds, moved, err)) return false;
  for (size_t i = 0; i < s->tracks.count; i++)
    if (!track_show(s, &s->tracks.items[i], seconds, moved, err)) return fail_track(s, i, seconds, err);
  for (size_t i = 0; i < s->tracks.count; i++)
    if (!track_check(s, &s->tracks.items[i], err)) return fail_track(s, i, seconds, err);
  for (size_t i = 0; i < s->models.count; i++) {
    unsigned inner = 0;
    Scene *model = s->models.items[i].scene;
    if (!set_time(model, clip ? clip : model->timeline.clip, false, seconds, &inner, err)) return false;
    if (inner & MOVED_WORLD) *moved |= MOVED_WORLD;
  }
  return true;
}

bool scene_set_time(Scene *s, double seconds, unsigned *moved, Err *err)
{
  unsigned ignored;
  if (!moved) moved = &ignored;
  *moved = 0;
  return set_time(s, s->timeline.clip, s->rig || !s->models.count, seconds, moved, err);
}

static void extend(double *start, double *end, double a, double b)
{
  if (a < *start) *start = a;
  if (b > *end) *end = b;
}

static bool own_range(const Scene *s, double *start, double *end)
{
  for (size_t i = 0; i < s->tracks.count; i++) {
    const Keys *k = s->tracks.items[i].fields.keys;
    extend(start, end, (double)k->items[0].time, (double)k->items[k->count - 1].time);
  }
  const RigClip *clip = s->rig ? rig_find_clip(s->rig, s->timeline.clip) : NULL;
  if (clip) extend(start, end, (double)clip->start, (double)clip->end);
  for (size_t i = 0; i < s->models.count; i++) {
    double a, b;
    if (scene_time_range(s->models.items[i].scene, &a, &b)) extend(start, end, a, b);
  }
  return *start <= *end;
}

bool scene_time_range(const Scene *s, double *start, double *end)
{
  *start = DBL_MAX;
  *end = -DBL_MAX;
  if (!own_range(s, start, end)) return false;
  if (s->timeline.range[0] < s->timeline.range[1]) {
    *start = (double)s->timeline.range[0];
    *end = (double)s->timeline.range[1];
  }
  return true;
}
