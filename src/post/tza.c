// See tza.h.

#include "post/tza.h"

#include "base/mem.h"
#include "image/image.h"

#include <string.h>

typedef struct Cursor {
  const uint8_t *at;
  size_t left;
} Cursor;

// The next n bytes as a little-endian number; false past the end.
static bool take(Cursor *c, size_t n, uint64_t *out)
{
  if (c->left < n) return false;
  *out = 0;
  for (size_t i = 0; i < n; i++) *out |= (uint64_t)c->at[i] << 8 * i;
  c->at += n;
  c->left -= n;
  return true;
}

static bool take_name(Cursor *c, TzaTensor *t)
{
  uint64_t length;
  if (!take(c, 2, &length) || c->left < length) return false;
  t->name = (const char *)c->at;
  t->name_length = (size_t)length;
  c->at += length;
  c->left -= length;
  return true;
}

static bool take_shape(Cursor *c, TzaTensor *t)
{
  uint64_t dims, size;
  if (!take(c, 1, &dims) || dims < 1 || dims > TZA_MOST_DIMS) return false;
  t->dims = (uint32_t)dims;
  t->count = 1;
  for (uint32_t i = 0; i < t->dims; i++) {
    if (!take(c, 4, &size) || !size || !size_mul(t->count, (size_t)size, &t->count)) return false;
    t->size[i] = (uint32_t)size;
  }
  return true;
}

// Convolutions lie as "oihw", biases as "x"; nothing else is of use.
static bool take_layout(Cursor *c, const TzaTensor *t)
{
  const char *wanted = t->dims == 4 ? "oihw" : t->dims == 1 ? "x" : NULL;
  if (!wanted || c->left < t->dims || memcmp(c->at, wanted, t->dims)) return false;
  c->at += t->dims;
  c->left -= t->dims;
  return true;
}

static bool take_data(Cursor *c, TzaTensor *t, const uint8_t *bytes, size_t size)
{
  uint64_t type, offset;
  size_t length;
  if (!take(c, 1, &type) || (type != 'f' && type != 'h') || !take(c, 8, &offset)) return false;
  t->is_half = type == 'h';
  if (!size_mul(t->count, t->is_half ? 2 : 4, &length) || offset > size || length > size - offset)
    return false;
  t->data = bytes + offset;
  return true;
}

bool tza_read(Tza *out, const uint8_t *bytes, size_t size, Err *err)
{
  Cursor c = {bytes, size};
  uint64_t magic, major, minor, table, count;
  *out = (Tza){0};
  if (!take(&c, 2, &magic) || magic != 0x41d7)
    return err_set(err, ERR_BAD_SCENE, "this is no .tza file of network weights");
  if (!take(&c, 1, &major) || !take(&c, 1, &minor) || major != 2)
    return err_set(err, ERR_BAD_SCENE, "network weights of an unknown version; version 2 is understood");
  if (!take(&c, 8, &table) || table > size)
    return err_set(err, ERR_BAD_SCENE, "the table of the network's weights is missing; the file is cut off");
  c = (Cursor){bytes + table, size - (size_t)table};
  if (!take(&c, 4, &count) || count > TZA_MOST_TENSORS)
    return err_set(err, ERR_BAD_SCENE, "the table of the network's weights is damaged");
  for (; out->count < count; out->count++) {
    TzaTensor *t = &out->tensors[out->count];
    if (!take_name(&c, t) || !take_shape(&c, t) || !take_layout(&c, t) || !take_data(&c, t, bytes, size))
      return err_set(err, ERR_BAD_SCENE, "tensor %zu of the network's weights is damaged or cut off",
                     out->count);
  }
  return true;
}

const TzaTensor *tza_find(const Tza *t, const char *name)
{
  const size_t length = strlen(name);
  for (size_t i = 0; i < t->count; i++)
    if (t->tensors[i].name_length == length && !memcmp(t->tensors[i].name, name, length))
      return &t->tensors[i];
  return NULL;
}

float tza_value(const TzaTensor *t, size_t i)
{
  const uint8_t *p = t->data + i * (t->is_half ? 2 : 4);
  if (t->is_half) return half_to_float((uint16_t)(p[0] | p[1] << 8));
  const uint32_t bits = p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
  float x;
  memcpy(&x, &bits, 4);
  return x;
}
