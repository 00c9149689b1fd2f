// See value.h.

#include "scene/value.h"

#include "base/mem.h"
#include "base/number.h"
#include "image/image.h"
#include "scene/keys.h"

#include <ctype.h>
#include <math.h>
#include <string.h>

// --- ranges ---------------------------------------------------------------------------------------
static bool has_low(const Field *f)
{
  return f->low > -(double)NO_LIMIT;
}
static bool has_high(const Field *f)
{
  return f->high < (double)NO_LIMIT;
}

static void add_number(Text *out, double x)
{
  char digits[NUMBER_SIZE];
  number_format(digits, (float)x);
  text_add(out, "%s", digits);
}

static void add_limit(Text *out, const Field *f, double x)
{
  if (f->type == FIELD_integer || f->type == FIELD_size)
    text_add(out, "%.0f", x);
  else
    add_number(out, x);
}

void value_range(const Field *f, Text *out)
{
  switch (f->type) {
  case FIELD_real:
  case FIELD_integer:
  case FIELD_color:
  case FIELD_vec2:
  case FIELD_vec3:
  case FIELD_size: break;
  case FIELD_flag:
  case FIELD_matrix:
  case FIELD_text:
  case FIELD_file:
  case FIELD_choice:
  case FIELD_texture:
  case FIELD_object:
  case FIELD_material:
  case FIELD_medium:
  case FIELD_sky:
  case FIELD_cell:
  case FIELD_gate:
  case FIELD_points:
  case FIELD_path:
  case FIELD_keys: return;
  }
  if (!has_low(f) && !has_high(f)) return;
  text_add(out, has_low(f) && has_high(f) ? "between " : has_low(f) ? "at least " : "at most ");
  if (has_low(f)) add_limit(out, f, f->low);
  if (has_low(f) && has_high(f)) text_add(out, " and ");
  if (has_high(f)) add_limit(out, f, f->high);
  if (f->unit[0]) text_add(out, " %s", f->unit);
}

// A text like 3.40282347e+38 is a little above the largest float and still means it.
static bool is_in_range(const Field *f, double x)
{
  return (x >= f->low && x <= f->high) ||
         (isfinite((float)x) && (x >= f->low || !has_low(f)) && (x <= f->high || !has_high(f)));
}

static bool range_fail(const Field *f, double x, Err *err)
{
  Text range = {0};
  if (isfinite((float)x)) value_range(f, &range);
  if (!range.length) text_add(&range, "a number between -3.4e38 and 3.4e38");
  err_set(err, ERR_BAD_SCENE, "%s must be %s, but is %.7g", f->name, text_get(&range), x);
  text_finish(&range);
  return false;
}

// --- reading --------------------------------------------------------------------------------------
static const char *wanted(FieldType type)
{
  switch (type) {
  case FIELD_real: return "a number";
  case FIELD_integer: return "a whole number";
  case FIELD_flag: return "true or false";
  case FIELD_color: return "a colour: [r, g, b], one number for grey, or \"#rrggbb\"";
  case FIELD_vec2: return "a list of two numbers";
  case FIELD_vec3: return "a list of three numbers";
  case FIELD_size: return "a list of two whole numbers";
  case FIELD_matrix: return "a list of 16 numbers, column by column";
  case FIELD_text: return "a text";
  case FIELD_file: return "a file name";
  case FIELD_choice: return "one of its names";
  case FIELD_texture: return "the name of a texture";
  case FIELD_object: return "the name of an object";
  case FIELD_material: return "the name of a material";
  case FIELD_path: return "the path of a field";
  case FIELD_keys: return "a list of keys";
  case FIELD_medium: return "the name of a medium";
  case FIELD_sky: return "the name of one of \"skies\"";
  case FIELD_cell: return "the name of a cell";
  case FIELD_gate: return "the name of a gate";
  case FIELD_points: return "a list of 3 to 64 corners, each [x, y]";
  }
  unreachable();
}

static bool type_fail(const Field *f, const Json *v, Err *err)
{
  if (js_kind(v) == JSON_LIST)
    return err_set(err, ERR_BAD_SCENE, "%s must be %s, but is a list of %zu", f->name, wanted(f->type),
                   js_count(v));
  if (js_text(v))
    return err_set(err, ERR_BAD_SCENE, "%s must be %s, but is the text \"%.40s\"", f->name, wanted(f->type),
                   js_text(v));
  return err_set(err, ERR_BAD_SCENE, "%s must be %s, but is %s", f->name, wanted(f->type), js_kind_name(v));
}

static bool read_number(const Field *f, const Json *v, bool is_whole, double *out, Err *err)
{
  if (js_kind(v) != JSON_NUMBER) return type_fail(f, v, err);
  const double x = js_number(v, 0);
  if (!is_in_range(f, x)) return range_fail(f, x, err);
  if (is_whole && x != floor(x))
    return err_set(err, ERR_BAD_SCENE, "%s must be %s, but is %.7g", f->name, wanted(f->type), x);
  *out = x;
  return true;
}

static bool read_list(const Field *f, const Json *v, size_t count, bool is_whole, double *out, int *item,
                      Err *err)
{
  if (js_kind(v) != JSON_LIST || js_count(v) != count) return type_fail(f, v, err);
  for (size_t i = 0; i < count; i++) {
    const Json *x = js_at(v, i);
    if (js_kind(x) == JSON_NUMBER && read_number(f, x, is_whole, &out[i], err)) continue;
    *item = (int)i;
    return err_set(err, ERR_BAD_SCENE, "%s must be %s, but this is %s", f->name, wanted(f->type),
                   js_kind_name(x));
  }
  return true;
}

static int hex_digit(char c)
{
  return isdigit((unsigned char)c) ? c - '0' : (c | 0x20) - 'a' + 10;
}

// "#rrggbb" or "#rgb", sRGB.
static bool read_hex(const Field *f, const char *text, double out[3], Err *err)
{
  const size_t n = strlen(text);
  bool ok = text[0] == '#' && (n == 4 || n == 7);
  for (size_t i = 1; ok && i < n; i++) ok = isxdigit((unsigned char)text[i]);
  if (!ok)
    return err_set(err, ERR_BAD_SCENE, "%s must be %s, but is the text \"%.40s\"", f->name, wanted(f->type),
                   text);
  for (int i = 0; i < 3; i++) {
    const int byte =
        n == 4 ? 17 * hex_digit(text[1 + i]) : 16 * hex_digit(text[1 + 2 * i]) + hex_digit(text[2 + 2 * i]);
    out[i] = (double)srgb_from_u8[byte];
    if (!is_in_range(f, out[i])) return range_fail(f, out[i], err);
  }
  return true;
}

static bool read_three(const Field *f, const Json *v, float *at, int *item, Err *err)
{
  double x[3];
  if (js_kind(v) == JSON_NUMBER) {
    if (!read_number(f, v, false, &x[0], err)) return false;
    x[1] = x[2] = x[0];
  } else if (f->type == FIELD_color && js_text(v)) {
    if (!read_hex(f, js_text(v), x, err)) return false;
  } else if (!read_list(f, v, 3, false, x, item, err)) {
    return false;
  }
  for (int i = 0; i < 3; i++) at[i] = (float)x[i];
  return true;
}

// 16 numbers as glTF has them, or the 12 that are not fixed; NULL takes the matrix away.
static bool read_matrix(const Field *f, const Json *v, float *at, int *item, Err *err)
{
  if (js_kind(v) == JSON_NULL_) {
    memset(at, 0, 12 * sizeof *at);
    return true;
  }
  double x[16];
  const size_t rows = js_count(v) == 12 ? 3 : 4;
  if (!read_list(f, v, 4 * rows, false, x, item, err)) return false;
  for (size_t i = 3; rows == 4 && i < 16; i += 4)
    if (x[i] != (i == 15)) {
      *item = (int)i;
      return err_set(err, ERR_BAD_SCENE, "the last row of %s (every fourth number) must be 0 0 0 1", f->name);
    }
  bool is_zero = true;
  float m[12];
  for (size_t i = 0; i < 12; i++) {
    m[i] = (float)x[i / 3 * rows + i % 3];
    is_zero = is_zero && m[i] == 0;
  }
  if (is_zero)
    return err_set(err, ERR_BAD_SCENE, "%s must not be all zeros; leave it out for no change", f->name);
  memcpy(at, m, sizeof m);
  return true;
}

static bool read_text(Scene *s, const Field *f, const Json *v, const char **at, Err *err)
{
  if (js_kind(v) == JSON_NULL_) {
    *at = NULL;
    return true;
  }
  const char *text = js_text(v);
  if (!text) return type_fail(f, v, err);
  const size_t n = strlen(text);
  if (n > LONGEST_TEXT)
    return err_set(err, ERR_BAD_SCENE, "%s is too long: %zu bytes, and at most %d are allowed", f->name, n,
                   LONGEST_TEXT);
  if (f->type != FIELD_text && !n)
    return err_set(err, ERR_BAD_SCENE, "%s must name a %s, but is empty", f->name, f->type == FIELD_file ? "file" : "field");
  const char *copy = arena_text_n(&s->arena, text, n);
  if (!copy) return err_memory(err, f->name, n);
  *at = copy;
  return true;
}

static bool read_choice(const Field *f, const Json *v, int32_t *at, Err *err)
{
  enum { MOST = 64 };
  char names[MOST][40];
  const char *candidates[MOST];
  int32_t count = 0;
  for (; count < MOST && choice_name(f, count, names[count]); count++) candidates[count] = names[count];
  const char *text = js_text(v);
  for (int32_t i = 0; text && i < count; i++)
    if (!strcmp(text, names[i])) {
      *at = i;
      return true;
    }
  Text list = {0};
  for (int32_t i = 0; i < count; i++)
    text_add(&list, "%s\"%s\"", i == 0 ? "" : i + 1 < count ? ", " : " or ", names[i]);
  char hint[120];
  if (text)
    err_set(err, ERR_BAD_SCENE, "%s must be %s, but is \"%.40s\"%s", f->name, text_get(&list), text,
            text_hint(hint, text, candidates, (size_t)count));
  else
    err_set(err, ERR_BAD_SCENE, "%s must be %s, but is %s", f->name, text_get(&list), js_kind_name(v));
  text_finish(&list);
  return false;
}

static bool reference_fail(const Scene *s, const Section *to, const char *name, Err *err)
{
  const size_t count = section_count(s, to);
  const char **names = mem_alloc(count, sizeof *names);
  for (size_t i = 0; names && i < count; i++) names[i] = *group_name(to->group, section_at(s, to, i));
  char hint[120];
  err_set(err, ERR_BAD_SCENE, "%s \"%.100s\" is not defined%s", to->group->noun, name,
          text_hint(hint, name, names, names ? count : 0));
  mem_free(names);
  return false;
}

static bool read_reference(const Scene *s, const Field *f, const Json *v, int32_t *at, Err *err)
{
  if (js_kind(v) == JSON_NULL_) {
    *at = -1;
    return true;
  }
  const char *name = js_text(v);
  if (!name) return type_fail(f, v, err);
  const Section *to = section_of_reference(f->type);
  const int32_t i = section_index(s, to, name);
  if (i < 0) return reference_fail(s, to, name, err);
  *at = i;
  return true;
}

static bool read_keys(Scene *s, const Json *v, const Keys **at, int *item, Err *err)
{
  const char *member; // an error has the place of the key as a whole
  const Keys *keys = keys_read(s, v, item, &member, err);
  if (keys) *at = keys;
  return keys;
}

static bool read_points(Scene *s, const Field *f, const Json *v, const Points **at, int *item, Err *err)
{
  if (js_kind(v) == JSON_NULL_) {
    *at = NULL;
    return true;
  }
  const size_t count = js_count(v);
  if (js_kind(v) != JSON_LIST || count < LEAST_POINTS || count > MOST_POINTS) return type_fail(f, v, err);
  Points *p = arena_alloc(&s->arena, 1, sizeof *p + 2 * count * sizeof(float));
  if (!p) return err_memory(err, f->name, count);
  p->count = (int32_t)count;
  for (size_t i = 0; i < count; i++) {
    double x[2];
    int inner = -1;
    if (!read_list(f, js_at(v, i), 2, false, x, &inner, err)) {
      *item = (int)i;
      return false;
    }
    for (size_t k = 0; k < 2; k++) p->xy[2 * i + k] = (float)x[k];
  }
  *at = p;
  return true;
}

bool value_read(Scene *s, const Field *f, const Json *v, void *at, int *item, Err *err)
{
  double x[2];
  *item = -1;
  switch (f->type) {
  case FIELD_real:
    if (!read_number(f, v, false, x, err)) return false;
    *(float *)at = (float)x[0];
    return true;
  case FIELD_integer:
    if (!read_number(f, v, true, x, err)) return false;
    *(int32_t *)at = (int32_t)x[0];
    return true;
  case FIELD_flag:
    if (js_kind(v) != JSON_BOOL) return type_fail(f, v, err);
    *(bool *)at = js_bool(v, false);
    return true;
  case FIELD_vec2:
    if (!read_list(f, v, 2, false, x, item, err)) return false;
    for (int i = 0; i < 2; i++) ((float *)at)[i] = (float)x[i];
    return true;
  case FIELD_size:
    if (!read_list(f, v, 2, true, x, item, err)) return false;
    for (int i = 0; i < 2; i++) ((int32_t *)at)[i] = (int32_t)x[i];
    return true;
  case FIELD_color:
  case FIELD_vec3: return read_three(f, v, at, item, err);
  case FIELD_matrix: return read_matrix(f, v, at, item, err);
  case FIELD_text:
  case FIELD_file:
  case FIELD_path: return read_text(s, f, v, at, err);
  case FIELD_keys: return read_keys(s, v, at, item, err);
  case FIELD_points: return read_points(s, f, v, at, item, err);
  case FIELD_choice: return read_choice(f, v, at, err);
  case FIELD_texture:
  case FIELD_object:
  case FIELD_material:
  case FIELD_sky:
  case FIELD_cell:
  case FIELD_gate:
  case FIELD_medium: return read_reference(s, f, v, at, err);
  }
  unreachable();
}

// --- writing --------------------------------------------------------------------------------------
static void write_float(Text *out, float x, bool *is_finite)
{
  char digits[NUMBER_SIZE];
  if (isfinite(x)) {
    number_format(digits, x);
    text_add(out, "%s", digits);
    return;
  }
  text_add(out, "null");
  if (is_finite) *is_finite = false;
}

static void write_floats(Text *out, const float *x, int count, bool *is_finite)
{
  text_add(out, "[");
  for (int i = 0; i < count; i++) {
    if (i) text_add(out, ",");
    write_float(out, x[i], is_finite);
  }
  text_add(out, "]");
}

static bool is_all_zero(const float *x, int count)
{
  for (int i = 0; i < count; i++)
    if (x[i] != 0) return false;
  return true;
}

static void write_matrix(Text *out, const float *m, bool *is_finite)
{
  if (is_all_zero(m, 12)) {
    text_add(out, "null");
    return;
  }
  float x[16];
  for (int i = 0; i < 16; i++) x[i] = i % 4 < 3 ? m[i / 4 * 3 + i % 4] : i == 15;
  write_floats(out, x, 16, is_finite);
}

static void write_reference(const Scene *s, const Section *to, int32_t i, Text *out)
{
  if (i < 0 || (size_t)i >= section_count(s, to))
    text_add(out, "null");
  else
    js_put_text(out, *group_name(to->group, section_at(s, to, (size_t)i)));
}

static void write_points(const Points *p, Text *out, bool *is_finite)
{
  text_add(out, p ? "[" : "null");
  for (int32_t i = 0; p && i < p->count; i++) {
    if (i) text_add(out, ",");
    write_floats(out, p->xy + 2 * i, 2, is_finite);
  }
  if (p) text_add(out, "]");
}

void value_write(const Scene *s, const Field *f, const void *at, Text *out, bool *is_finite)
{
  char name[40];
  switch (f->type) {
  case FIELD_real: write_float(out, *(const float *)at, is_finite); return;
  case FIELD_integer: text_add(out, "%d", *(const int32_t *)at); return;
  case FIELD_flag: text_add(out, *(const bool *)at ? "true" : "false"); return;
  case FIELD_color:
  case FIELD_vec3: write_floats(out, at, 3, is_finite); return;
  case FIELD_vec2: write_floats(out, at, 2, is_finite); return;
  case FIELD_size: text_add(out, "[%d,%d]", ((const int32_t *)at)[0], ((const int32_t *)at)[1]); return;
  case FIELD_matrix: write_matrix(out, at, is_finite); return;
  case FIELD_keys:
    if (*(const Keys *const *)at)
      keys_write(*(const Keys *const *)at, out);
    else
      text_add(out, "null");
    return;
  case FIELD_points: write_points(*(const Points *const *)at, out, is_finite); return;
  case FIELD_text:
  case FIELD_file:
  case FIELD_path:
    if (*(const char *const *)at)
      js_put_text(out, *(const char *const *)at);
    else
      text_add(out, "null");
    return;
  case FIELD_choice:
    if (choice_name(f, *(const int32_t *)at, name))
      js_put_text(out, name);
    else
      text_add(out, "null");
    return;
  case FIELD_texture:
  case FIELD_object:
  case FIELD_material:
  case FIELD_sky:
  case FIELD_cell:
  case FIELD_gate:
  case FIELD_medium: write_reference(s, section_of_reference(f->type), *(const int32_t *)at, out); return;
  }
}

// --- questions ------------------------------------------------------------------------------------
size_t value_size(const Field *f)
{
  switch (f->type) {
  case FIELD_real: return sizeof(float);
  case FIELD_flag: return sizeof(bool);
  case FIELD_integer:
  case FIELD_choice:
  case FIELD_texture:
  case FIELD_object:
  case FIELD_material:
  case FIELD_medium:
  case FIELD_sky:
  case FIELD_cell:
  case FIELD_gate: return sizeof(int32_t);
  case FIELD_color:
  case FIELD_vec3: return 3 * sizeof(float);
  case FIELD_vec2: return 2 * sizeof(float);
  case FIELD_size: return 2 * sizeof(int32_t);
  case FIELD_matrix: return 12 * sizeof(float);
  case FIELD_text:
  case FIELD_file:
  case FIELD_path: return sizeof(const char *);
  case FIELD_keys: return sizeof(const Keys *);
  case FIELD_points: return sizeof(const Points *);
  }
  unreachable();
}

bool value_is_default(const Field *f, const void *at)
{
  if (f->type == FIELD_text || f->type == FIELD_file || f->type == FIELD_path)
    return text_equal(*(const char *const *)at, f->text);
  union {
    float numbers[12];
    bool flag;
  } standard = {{0}};
  Field alone = *f;
  alone.offset = 0;
  fields_default(&alone, 1, &standard);
  return !memcmp(&standard, at, value_size(f));
}

bool value_component(const Field *f, int i, Field *component)
{
  const bool is_pair = f->type == FIELD_vec2 || f->type == FIELD_size;
  if (!is_pair && f->type != FIELD_vec3 && f->type != FIELD_color) return false;
  if (i < 0 || i >= (is_pair ? 2 : 3)) return false;
  *component = *f;
  component->type = f->type == FIELD_size ? FIELD_integer : FIELD_real;
  component->offset += (size_t)i * 4;
  component->number[0] = f->number[i];
  return true;
}
