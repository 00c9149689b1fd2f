// See field.h: what can be done with a table alone.

#include "scene/field.h"

#include <string.h>

static void set_default(const Field *f, void *object)
{
  void *at = (char *)object + f->offset;
  switch (f->type) {
  case FIELD_real: *(float *)at = (float)f->number[0]; return;
  case FIELD_flag: *(bool *)at = f->number[0] != 0; return;
  case FIELD_integer:
  case FIELD_choice:
  case FIELD_texture:
  case FIELD_object:
  case FIELD_material:
  case FIELD_sky:
  case FIELD_cell:
  case FIELD_gate:
  case FIELD_medium: *(int32_t *)at = (int32_t)f->number[0]; return;
  case FIELD_color:
  case FIELD_vec3:
    for (int i = 0; i < 3; i++) ((float *)at)[i] = (float)f->number[i];
    return;
  case FIELD_vec2:
    for (int i = 0; i < 2; i++) ((float *)at)[i] = (float)f->number[i];
    return;
  case FIELD_size:
    for (int i = 0; i < 2; i++) ((int32_t *)at)[i] = (int32_t)f->number[i];
    return;
  case FIELD_matrix: memset(at, 0, 12 * sizeof(float)); return;
  case FIELD_points: *(const Points **)at = NULL; return;
  case FIELD_keys: *(const struct Keys **)at = NULL; return;
  case FIELD_text:
  case FIELD_path:
  case FIELD_file: *(const char **)at = f->text; return;
  }
}

void fields_default(const Field *fields, size_t count, void *object)
{
  for (size_t i = 0; i < count; i++) set_default(&fields[i], object);
}
