// URIs as model files use them: data URIs decoded, file names freed of percent escapes. Nothing is fetched.

#ifndef RAYFOLD_SCENE_URI_H
#define RAYFOLD_SCENE_URI_H

#include "base/err.h"
#include "base/text.h"

#include <stddef.h>
#include <stdint.h>

bool uri_is_data(const char *uri);   // begins with "data:"
bool uri_is_remote(const char *uri); // has another scheme ("http:"); a drive letter is none

// The bytes of a data URI, base64 (plain or URL-safe alphabet, padding optional) or percent-encoded, in a new block
// of *size bytes for the caller to mem_free(). False with the reason.
bool uri_decode_data(const char *uri, uint8_t **out, size_t *size, Err *err);

// "a%20b.bin" is "a b.bin". Into out (cleared first). An escape for a zero byte is refused: it would end the name
// early. An escape that is none stays as it stands, as browsers do.
bool uri_decode_name(Text *out, const char *uri, Err *err);

#endif
