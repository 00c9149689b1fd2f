// Field tables: every parameter of every kind is one row, and from the row come the struct member, the default, the
// reader, the writer, the range check, the JSON schema, the manual and the edit language.
//
//   #define GLASS_FIELDS(F)    F(real,  ior,  1.5, 1, 3, "",  "Index of refraction.")    and so on, a row a line
//   FIELD_STRUCT(Glass, GLASS_FIELDS);             // typedef struct Glass { float ior; float tint[3]; } Glass;
//   #define FIELD_OWNER Glass
//   static const Field glass_fields[] = {GLASS_FIELDS(FIELD_ROW)};
//
// Row: F(type, name, default, low, high, unit, sentence). A choice has its names in the unit column, "a|b|c", and
// the default's index as default. A color, vec2, vec3 or size has its default in parentheses.

#ifndef RAYFOLD_SCENE_FIELD_H
#define RAYFOLD_SCENE_FIELD_H

#include <float.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef enum FieldType {
  FIELD_real,     // float
  FIELD_integer,  // int32_t
  FIELD_flag,     // bool
  FIELD_color,    // float[3], linear Rec.709; in files also one number (grey) or "#rrggbb" (sRGB)
  FIELD_vec2,     // float[2]
  FIELD_vec3,     // float[3]; in files also one number for all three
  FIELD_size,     // int32_t[2]
  FIELD_matrix,   // float[12], columns x, y, z, origin; all zero means "not given"
  FIELD_text,     // const char *, owned by the scene's arena; NULL means none
  FIELD_file,     // the same, a path relative to the file that names it
  FIELD_choice,   // int32_t, index into the names
  FIELD_texture,  // int32_t, index of a texture in the same scene, -1 none; in files its name
  FIELD_object,   // int32_t, index of an object in the same scene, -1 none; in files its name
  FIELD_material, // int32_t, index of a material in the same scene, -1 none; in files its name
  FIELD_path,     // const char *, the path of a field as edits name it; NULL means none
  FIELD_keys,     // const Keys *, owned by the scene's arena (scene/track.h); NULL means none
  FIELD_medium,   // int32_t, index of a medium in the same scene, -1 none; in files its name
  FIELD_sky,      // int32_t, index into the scene's skies, -1 none; in files its name
  FIELD_cell,     // int32_t, index of a cell in the same scene, -1 none; in files its name
  FIELD_gate,     // int32_t, index of a gate in the same scene, -1 none; in files its name
  FIELD_points,   // const Points *, owned by the scene's arena; NULL means none
} FieldType;

typedef struct Field {
  FieldType type;
  const char *name;
  size_t offset;           // in the struct the table belongs to
  double number[3];        // default, for all but texts and keys
  const char *text;        // default of text, file and path
  double low, high;        // inclusive; for each component
  const char *unit;        // "m", "deg", ... or a choice's names
  const char *sentence;
} Field;

#define FIELD_C_real(n)     float n;
#define FIELD_C_integer(n)  int32_t n;
#define FIELD_C_flag(n)     bool n;
#define FIELD_C_color(n)    float n[3];
#define FIELD_C_vec2(n)     float n[2];
#define FIELD_C_vec3(n)     float n[3];
#define FIELD_C_size(n)     int32_t n[2];
#define FIELD_C_matrix(n)   float n[12];
#define FIELD_C_text(n)     const char *n;
#define FIELD_C_file(n)     const char *n;
#define FIELD_C_choice(n)   int32_t n;
#define FIELD_C_texture(n)  int32_t n;
#define FIELD_C_material(n) int32_t n;
#define FIELD_C_object(n)   int32_t n;
#define FIELD_C_path(n)     const char *n;
#define FIELD_C_keys(n)     const struct Keys *n;
#define FIELD_C_medium(n)   int32_t n;
#define FIELD_C_sky(n)      int32_t n;
#define FIELD_C_cell(n)     int32_t n;
#define FIELD_C_gate(n)     int32_t n;
#define FIELD_C_points(n)   const struct Points *n;

#define FIELD_UNPAREN(...)  __VA_ARGS__
#define FIELD_D_real(d)     .number = {d}
#define FIELD_D_integer(d)  .number = {d}
#define FIELD_D_flag(d)     .number = {d}
#define FIELD_D_color(d)    .number = {FIELD_UNPAREN d}
#define FIELD_D_vec2(d)     .number = {FIELD_UNPAREN d}
#define FIELD_D_vec3(d)     .number = {FIELD_UNPAREN d}
#define FIELD_D_size(d)     .number = {FIELD_UNPAREN d}
#define FIELD_D_matrix(d)   .number = {d}
#define FIELD_D_text(d)     .text = d
#define FIELD_D_file(d)     .text = d
#define FIELD_D_choice(d)   .number = {d}
#define FIELD_D_texture(d)  .number = {d}
#define FIELD_D_material(d) .number = {d}
#define FIELD_D_object(d)   .number = {d}
#define FIELD_D_path(d)     .text = d
#define FIELD_D_keys(d)     .number = {0}
#define FIELD_D_medium(d)   .number = {d}
#define FIELD_D_sky(d)      .number = {d}
#define FIELD_D_cell(d)     .number = {d}
#define FIELD_D_gate(d)     .number = {d}
#define FIELD_D_points(d)   .number = {0}

#define FIELD_MEMBER(type, name, dflt, lo, hi, unit, sentence) FIELD_C_##type(name)
#define FIELD_ROW(type_, name_, dflt, lo, hi, unit_, sentence_)                             \
  {FIELD_##type_, #name_, offsetof(FIELD_OWNER, name_), FIELD_D_##type_(dflt), .low = (lo), \
   .high = (hi), .unit = (unit_), .sentence = (sentence_)},
#define FIELD_STRUCT(Name, LIST) \
  typedef struct Name {          \
    LIST(FIELD_MEMBER)           \
  } Name

// Corners of a flat outline, in order.
typedef struct Points {
  int32_t count;
  float xy[]; // 2 a corner
} Points;
enum { LEAST_POINTS = 3, MOST_POINTS = 64 };

#define NO_LIMIT FLT_MAX // as high: no upper bound but that of a float; -NO_LIMIT as low

// Must it be given, wherever its kind has no other way to get one?
static inline bool field_is_required(const Field *f)
{
  return (f->type == FIELD_file && !f->text) || f->type == FIELD_path || f->type == FIELD_keys;
}

// Sets every field to its default.
void fields_default(const Field *fields, size_t count, void *object);

#endif
