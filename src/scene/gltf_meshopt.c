// EXT_meshopt_compression: the only file that knows the meshoptimizer library. Its decoders are written for
// untrusted data; what they assert about counts and strides has been checked by the caller.

#include "scene/gltf.h"

#if RAYFOLD_HAVE_MESHOPT
#include <meshoptimizer.h>

bool meshopt_is_built_in(void)
{
  return true;
}

static bool decode(MeshoptMode mode, const uint8_t *data, size_t size, size_t count, size_t stride,
                   uint8_t *out)
{
  switch (mode) {
  case MESHOPT_ATTRIBUTES: return !meshopt_decodeVertexBuffer(out, count, stride, data, size);
  case MESHOPT_TRIANGLES: return !meshopt_decodeIndexBuffer(out, count, stride, data, size);
  case MESHOPT_INDICES: return !meshopt_decodeIndexSequence(out, count, stride, data, size);
  }
  unreachable();
}

bool meshopt_decode(MeshoptMode mode, MeshoptFilter filter, const uint8_t *data, size_t size, size_t count,
                    size_t stride, uint8_t *out)
{
  if (!decode(mode, data, size, count, stride, out)) return false;
  switch (filter) {
  case MESHOPT_NONE: return true;
  case MESHOPT_OCTAHEDRAL: meshopt_decodeFilterOct(out, count, stride); return true;
  case MESHOPT_QUATERNION: meshopt_decodeFilterQuat(out, count, stride); return true;
  case MESHOPT_EXPONENTIAL: meshopt_decodeFilterExp(out, count, stride); return true;
  }
  unreachable();
}

#else

bool meshopt_is_built_in(void)
{
  return false;
}

bool meshopt_decode(MeshoptMode mode, MeshoptFilter filter, const uint8_t *data, size_t size, size_t count,
                    size_t stride, uint8_t *out)
{
  (void)mode, (void)filter, (void)data, (void)size, (void)count, (void)stride, (void)out;
  return false;
}

#endif
