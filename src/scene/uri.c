// See uri.h. Sources: RFC 2397 (data URIs), RFC 3986 section 2.1 (percent escapes), RFC 4648 (base64).

#include "scene/uri.h"

#include "base/mem.h"

#include <ctype.h>
#include <string.h>
#include <strings.h>

bool uri_is_data(const char *uri)
{
  return !strncasecmp(uri, "data:", 5);
}

bool uri_is_remote(const char *uri)
{
  size_t n = 0;
  while (isalnum((unsigned char)uri[n]) || (n && strchr("+-.", uri[n]) && uri[n])) n++;
  return n > 1 && uri[n] == ':' && !uri_is_data(uri);
}

static int hex_digit(char c)
{
  if (c >= '0' && c <= '9') return c - '0';
  const char lower = (char)(c | 0x20);
  return lower >= 'a' && lower <= 'f' ? lower - 'a' + 10 : -1;
}

// The byte an escape stands for, or -1 if there is no escape at p.
static int escaped_byte(const char *p)
{
  if (p[0] != '%') return -1;
  const int high = hex_digit(p[1]);
  const int low = high < 0 ? -1 : hex_digit(p[2]);
  return low < 0 ? -1 : high * 16 + low;
}

bool uri_decode_name(Text *out, const char *uri, Err *err)
{
  text_clear(out);
  for (const char *p = uri; *p; p++) {
    const int byte = escaped_byte(p);
    if (byte == 0) return err_set(err, ERR_BAD_SCENE, "\"%.200s\" has a zero byte in it (%%00)", uri);
    const char c = byte < 0 ? *p : (char)byte;
    text_add_n(out, &c, 1);
    if (byte >= 0) p += 2;
  }
  return !out->failed || err_memory(err, "a file name", strlen(uri));
}

static size_t decode_percent(const char *text, uint8_t *out)
{
  size_t n = 0;
  for (const char *p = text; *p; p++) {
    const int byte = escaped_byte(p);
    out[n++] = byte < 0 ? (uint8_t)*p : (uint8_t)byte;
    if (byte >= 0) p += 2;
  }
  return n;
}

static int base64_digit(char c)
{
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  return c == '+' || c == '-' ? 62 : c == '/' || c == '_' ? 63 : -1;
}

static bool decode_base64(const char *text, uint8_t *out, size_t *size, Err *err)
{
  uint32_t bits = 0;
  size_t n = 0;
  int have = 0;
  const char *p = text;
  for (; *p && *p != '='; p++) {
    if (isspace((unsigned char)*p)) continue;
    const int digit = base64_digit(*p);
    if (digit < 0)
      return err_set(err, ERR_BAD_SCENE,
                     "character %zu of the base64 data is none of the alphabet; save the file again",
                     (size_t)(p - text) + 1);
    bits = bits << 6 | (uint32_t)digit;
    have += 6;
    if (have >= 8) {
      have -= 8;
      out[n++] = (uint8_t)(bits >> have);
    }
  }
  for (; *p; p++)
    if (*p != '=' && !isspace((unsigned char)*p))
      return err_set(err, ERR_BAD_SCENE, "the base64 data goes on after its padding; save the file again");
  *size = n;
  return true;
}

bool uri_decode_data(const char *uri, uint8_t **out, size_t *size, Err *err)
{
  *out = NULL;
  *size = 0;
  const char *comma = strchr(uri, ',');
  if (!comma) return err_set(err, ERR_BAD_SCENE, "a data URI has no comma, so no data; save the file again");
  const size_t head = (size_t)(comma - uri);
  const bool is_base64 = head >= 7 && !strncasecmp(comma - 7, ";base64", 7);
  const size_t length = strlen(comma + 1);
  uint8_t *bytes = mem_alloc(length + 1, 1);
  if (!bytes) return err_memory(err, "a data URI", length);
  bool ok = true;
  if (is_base64)
    ok = decode_base64(comma + 1, bytes, size, err);
  else
    *size = decode_percent(comma + 1, bytes);
  if (ok)
    *out = bytes;
  else
    mem_free(bytes);
  return ok;
}
