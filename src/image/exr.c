// OpenEXR by its C library, OpenEXRCore. Halves stay halves, floats and integers become floats. The result covers
// the display window; what the data window does not reach is zero, what it has beyond is cut. Of several parts the
// first is read, of mip levels the finest; deep pictures and subsampled colours are refused.
//
// The library parses and decompresses; rows are taken out of its chunks here, because its own unpacking had several
// reads beyond a chunk's end (OpenEXR 3.1, fixed step by step until 3.4).
//
//   a chunk, unpacked:   line 0: [ A A A ... | B B B ... | G ... | R ... ]   line 1: ...   channels by name

#include "image/format.h"

#include "base/mem.h"

#include <string.h>

static bool is_exr(const uint8_t *bytes, size_t size)
{
  return size >= 4 && !memcmp(bytes, "\x76\x2f\x31\x01", 4);
}

#if RAYFOLD_HAVE_OPENEXR
#include <openexr.h>

enum { PART = 0 };

// The library's memory, so that a file cannot ask for more than a picture may have, and finds nothing old in it.
static void *take_memory(size_t size)
{
  return size <= IMAGE_MOST_BYTES ? mem_zero(size, 1) : NULL;
}

// --- reading --------------------------------------------------------------------------------------

typedef struct ExrRead {
  exr_context_t exr;
  const uint8_t *bytes;
  size_t size;
  const char *name;
  Image *out;
  Err *err;
  const exr_attr_chlist_t *channels; // the library's
  int32_t chosen[4];                 // channel index per channel of out; -1 is none (zeros)
  exr_attr_box2i_t data, display;
  int32_t chunk_x, chunk_y; // where the chunk being decoded begins
} ExrRead;

static void on_read_error(exr_const_context_t exr, exr_result_t code, const char *message)
{
  void *user = NULL;
  if (!exr || exr_get_user_data(exr, &user) || !user) return;
  const ExrRead *r = user;
  if (code == EXR_ERR_FEATURE_NOT_IMPLEMENTED)
    err_set(r->err, ERR_BAD_SCENE,
            "%s: this version of OpenEXRCore cannot decompress it (%s); save it with another compression, "
            "such as "
            "ZIP or PIZ",
            r->name, message);
  else
    image_damaged(r->name, "OpenEXR", message, r->err);
}

// Short at the end of the file, where the library asks for a whole buffer while it parses the header.
static int64_t take_bytes(exr_const_context_t exr, void *user, void *to, uint64_t size, uint64_t offset,
                          exr_stream_error_func_ptr_t report)
{
  const ExrRead *r = user;
  (void)exr, (void)report;
  const uint64_t left = offset < r->size ? r->size - offset : 0, n = size < left ? size : left;
  memcpy(to, r->bytes + (left ? offset : 0), n);
  return (int64_t)n;
}

static int64_t total_size(exr_const_context_t exr, void *user)
{
  (void)exr;
  return (int64_t)((const ExrRead *)user)->size;
}

// The part of a channel's name that says what it is: "R" of "diffuse.R".
static const char *short_name(const char *name)
{
  const char *dot = strrchr(name, '.');
  return dot ? dot + 1 : name;
}

static bool is_in_layer(const char *name, const char *layer, size_t length)
{
  return (size_t)(short_name(name) - name) == length && !strncmp(name, layer, length);
}

static int32_t find_channel(const ExrRead *r, const char *layer, size_t length, const char *wanted)
{
  for (int32_t i = 0; i < r->channels->num_channels; i++) {
    const char *name = r->channels->entries[i].name.str;
    if (is_in_layer(name, layer, length) && !strcmp(short_name(name), wanted)) return i;
  }
  return -1;
}

// Fills chosen from one layer ("" or "name."); how many channels that makes, 0 if it has no colour. Grey from Y.
static uint32_t choose_from(ExrRead *r, const char *layer, size_t length)
{
  static const char *const colours[] = {"R", "G", "B"};
  int32_t found = -1;
  for (int c = 0; c < 3; c++) {
    r->chosen[c] = find_channel(r, layer, length, colours[c]);
    if (r->chosen[c] >= 0) found = r->chosen[c];
  }
  uint32_t count = 3;
  if (found < 0) {
    r->chosen[0] = find_channel(r, layer, length, "Y");
    // X beside Y makes it a coordinate, not a brightness.
    if (r->chosen[0] < 0 || find_channel(r, layer, length, "X") >= 0) return 0;
    count = 1;
  }
  const int32_t alpha = find_channel(r, layer, length, "A");
  if (alpha >= 0) r->chosen[count++] = alpha;
  return count;
}

// The picture itself is the layer without a name; where there is none, the first layer with colour.
static uint32_t choose_channels(ExrRead *r)
{
  uint32_t count = choose_from(r, "", 0);
  for (int32_t i = 0; !count && i < r->channels->num_channels; i++) {
    const char *name = r->channels->entries[i].name.str;
    count = choose_from(r, name, (size_t)(short_name(name) - name));
  }
  if (count) return count;
  Text list = {0};
  for (int32_t i = 0; i < r->channels->num_channels && i < 20; i++)
    text_add(&list, " %s", r->channels->entries[i].name.str);
  err_set(r->err, ERR_BAD_SCENE, "%s: it has no channel R, G, B or Y to make a picture of, only%s", r->name,
          text_get(&list));
  text_finish(&list);
  return 0;
}

// The smallest type that holds all chosen channels; false when one is subsampled.
static bool choose_type(const ExrRead *r, uint32_t count, PixelType *type)
{
  *type = PIXEL_F16;
  for (uint32_t c = 0; c < count; c++) {
    if (r->chosen[c] < 0) continue;
    const exr_attr_chlist_entry_t *e = &r->channels->entries[r->chosen[c]];
    if (e->pixel_type != EXR_PIXEL_HALF) *type = PIXEL_F32;
    if (e->x_sampling != 1 || e->y_sampling != 1)
      return err_set(r->err, ERR_BAD_SCENE,
                     "%s: channel %s is stored at a lower resolution; save it at full one", r->name,
                     e->name.str);
  }
  return true;
}

static uint64_t span(int32_t low, int32_t high)
{
  return high < low ? 0 : (uint64_t)((int64_t)high - low + 1);
}

static bool read_header(ExrRead *r)
{
  exr_storage_t storage;
  if (exr_get_storage(r->exr, PART, &storage) || exr_get_channels(r->exr, PART, &r->channels) ||
      exr_get_data_window(r->exr, PART, &r->data) || exr_get_display_window(r->exr, PART, &r->display))
    return image_damaged(r->name, "OpenEXR", "its header is not complete", r->err);
  if (storage != EXR_STORAGE_SCANLINE && storage != EXR_STORAGE_TILED)
    return err_set(r->err, ERR_BAD_SCENE, "%s: deep OpenEXR pictures are not read; flatten it first",
                   r->name);
  const uint32_t count = choose_channels(r);
  PixelType type;
  if (!count || !choose_type(r, count, &type)) return false;
  const uint64_t data_width = span(r->data.min.x, r->data.max.x),
                 data_height = span(r->data.min.y, r->data.max.y);
  if (!image_check_size(data_width, data_height, count, type, r->name, r->err)) return false;
  const exr_attr_box2i_t d = r->display;
  if (!image_create(r->out, span(d.min.x, d.max.x), span(d.min.y, d.max.y), count, type, r->name, r->err))
    return false;
  memset(r->out->pixels, 0, (size_t)r->out->width * r->out->height * count * pixel_size(type));
  return true;
}

// One value as the result's type. Files are little-endian, as everything we run on.
static void store_value(void *to, PixelType to_type, const uint8_t *from, exr_pixel_type_t type)
{
  uint16_t half;
  uint32_t bits;
  float x;
  switch (type) {
  case EXR_PIXEL_HALF:
    memcpy(&half, from, sizeof half);
    if (to_type == PIXEL_F16) {
      memcpy(to, &half, sizeof half);
      return;
    }
    x = half_to_float(half);
    break;
  case EXR_PIXEL_UINT:
    memcpy(&bits, from, sizeof bits);
    x = (float)bits;
    break;
  default: memcpy(&x, from, sizeof x);
  }
  memcpy(to, &x, sizeof x);
}

// A channel's share of one line, cut to the display window; x is where the line begins in the file's coordinates.
static void store_line(const ExrRead *r, uint32_t channel, int64_t x, int64_t y, const uint8_t *from,
                       int64_t width)
{
  const exr_pixel_type_t type = r->channels->entries[r->chosen[channel]].pixel_type;
  const int64_t size = type == EXR_PIXEL_HALF ? 2 : 4;
  const int64_t skip = x < r->display.min.x ? r->display.min.x - x : 0;
  const int64_t end = x + width - 1 > r->display.max.x ? (int64_t)r->display.max.x - x + 1 : width;
  if (y < r->display.min.y || y > r->display.max.y || skip >= end) return;
  const size_t step = r->out->channels * pixel_size(r->out->type);
  char *to = image_pixel(r->out, (uint32_t)(x + skip - r->display.min.x), (uint32_t)(y - r->display.min.y));
  to += channel * pixel_size(r->out->type);
  for (int64_t i = skip; i < end; i++, to += step) store_value(to, r->out->type, from + i * size, type);
}

// Called by the library for each chunk, decompressed.
static exr_result_t unpack_chunk(exr_decode_pipeline_t *d)
{
  const ExrRead *r = d->decoding_user_data;
  const uint8_t *p = d->unpacked_buffer;
  uint64_t left = p ? d->chunk.unpacked_size : 0;
  if (d->channel_count != r->channels->num_channels) return EXR_ERR_CORRUPT_CHUNK;
  for (int32_t line = 0; line < d->chunk.height; line++) {
    const int64_t y = (int64_t)r->chunk_y + line;
    for (int32_t c = 0; c < d->channel_count; c++) {
      const exr_attr_chlist_entry_t *e = &r->channels->entries[c];
      if (e->y_sampling < 1 || y % e->y_sampling) continue;
      const int64_t width = d->channels[c].width;
      const uint64_t size = width > 0 ? (uint64_t)width * (e->pixel_type == EXR_PIXEL_HALF ? 2 : 4) : 0;
      if (size > left) return EXR_ERR_CORRUPT_CHUNK;
      for (uint32_t k = 0; k < r->out->channels; k++)
        if (r->chosen[k] == c) store_line(r, k, r->chunk_x, y, p, width);
      p += size;
      left -= size;
    }
  }
  return EXR_ERR_SUCCESS;
}

// The pipeline is made with the first chunk and fed the others, which keeps its buffers.
static bool decode_chunk(ExrRead *r, exr_decode_pipeline_t *d, const exr_chunk_info_t *chunk)
{
  if (!d->channels) {
    if (exr_decoding_initialize(r->exr, PART, chunk, d) ||
        exr_decoding_choose_default_routines(r->exr, PART, d))
      return false;
    d->decoding_user_data = r;
    d->unpack_and_convert_fn = unpack_chunk;
  } else if (exr_decoding_update(r->exr, PART, chunk, d)) {
    return false;
  }
  return !exr_decoding_run(r->exr, PART, d);
}

static bool read_lines(ExrRead *r, exr_decode_pipeline_t *d)
{
  int32_t lines = 0;
  if (exr_get_scanlines_per_chunk(r->exr, PART, &lines) || lines < 1) return false;
  for (int64_t y = r->data.min.y; y <= r->data.max.y; y += lines) {
    exr_chunk_info_t chunk;
    if (exr_read_scanline_chunk_info(r->exr, PART, (int)y, &chunk)) return false;
    r->chunk_x = r->data.min.x;
    r->chunk_y = (int32_t)y;
    if (!decode_chunk(r, d, &chunk)) return false;
  }
  return true;
}

static bool read_tiles(ExrRead *r, exr_decode_pipeline_t *d)
{
  int32_t width = 0, height = 0;
  if (exr_get_tile_sizes(r->exr, PART, 0, 0, &width, &height) || width < 1 || height < 1) return false;
  const int64_t columns = (int64_t)(span(r->data.min.x, r->data.max.x) + (uint64_t)width - 1) / width;
  const int64_t rows = (int64_t)(span(r->data.min.y, r->data.max.y) + (uint64_t)height - 1) / height;
  for (int64_t i = 0; i < rows; i++)
    for (int64_t j = 0; j < columns; j++) {
      exr_chunk_info_t chunk;
      if (exr_read_tile_chunk_info(r->exr, PART, (int)j, (int)i, 0, 0, &chunk)) return false;
      r->chunk_x = (int32_t)(r->data.min.x + j * width);
      r->chunk_y = (int32_t)(r->data.min.y + i * height);
      if (!decode_chunk(r, d, &chunk)) return false;
    }
  return true;
}

static bool read_exr(Image *out, const uint8_t *bytes, size_t size, const char *name, Err *err)
{
  ExrRead r = {.bytes = bytes, .size = size, .name = name, .out = out, .err = err};
  exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
  init.error_handler_fn = on_read_error;
  init.alloc_fn = take_memory;
  init.free_fn = mem_free;
  init.user_data = &r;
  init.read_fn = take_bytes;
  init.size_fn = total_size;
  init.flags = EXR_CONTEXT_FLAG_DISABLE_CHUNK_RECONSTRUCTION;
  exr_decode_pipeline_t d = EXR_DECODE_PIPELINE_INITIALIZER;
  bool ok = !exr_start_read(&r.exr, name, &init) && read_header(&r);
  if (ok) {
    exr_storage_t storage = EXR_STORAGE_SCANLINE;
    exr_get_storage(r.exr, PART, &storage);
    ok = storage == EXR_STORAGE_TILED ? read_tiles(&r, &d) : read_lines(&r, &d);
    exr_decoding_destroy(r.exr, &d);
  }
  if (r.exr) exr_finish(&r.exr);
  return ok || image_damaged(name, "OpenEXR", "its header or a block of it is broken", err);
}

// --- writing --------------------------------------------------------------------------------------

typedef struct ExrChannel {
  char name[256];
  const float *first; // its value in the first pixel
  size_t step;        // floats from pixel to pixel
  bool is_float;
} ExrChannel;

typedef struct ExrWrite {
  exr_context_t exr;
  FileOut *file;
  uint64_t position; // of the file's stream
  const ImageOut *img;
  Err *err;
  ExrChannel *channels; // owned
  size_t channel_count;
  uint8_t *lines;       // owned: one chunk's values, channel after channel
  exr_result_t failure; // the library's first
} ExrWrite;

// Keeps the first failure. The library's callback for errors is of no use here: while a file is written it is called
// with a lock held that asking for our data would wait for.
static bool is_fine(ExrWrite *w, exr_result_t result)
{
  if (!w->failure) w->failure = result;
  return !result;
}

static void ignore_error(exr_const_context_t exr, exr_result_t code, const char *message)
{
  (void)exr, (void)code, (void)message;
}

// The library writes in order, but for the table of chunks, which it fills in at the end.
static int64_t put_bytes(exr_const_context_t exr, void *user, const void *from, uint64_t size,
                         uint64_t offset, exr_stream_error_func_ptr_t report)
{
  ExrWrite *w = user;
  (void)exr, (void)report;
  if (offset != w->position && fseeko(w->file->stream, (off_t)offset, SEEK_SET))
    return err_set(w->err, ERR_IO, "cannot write \"%s\": no going back in it", w->file->path), -1;
  if (!file_write(w->file, from, size, w->err)) return -1;
  w->position = offset + size;
  return (int64_t)size;
}

static size_t count_channels(const ImageOut *img)
{
  size_t n = 0;
  for (size_t i = 0; i < img->plane_count; i++) n += strlen(img->planes[i].channels);
  return n;
}

static bool list_channels(ExrWrite *w)
{
  w->channel_count = count_channels(w->img);
  w->channels = mem_zero(w->channel_count, sizeof *w->channels);
  if (!w->channels) return err_memory(w->err, w->file->path, w->channel_count * sizeof *w->channels);
  ExrChannel *c = w->channels;
  for (size_t i = 0; i < w->img->plane_count; i++) {
    const Plane *p = &w->img->planes[i];
    const uint32_t count = plane_channel_count(p);
    for (uint32_t k = 0; k < count; k++, c++) {
      *c = (ExrChannel){.first = p->pixels + k, .step = count, .is_float = p->is_exact || w->img->bits == 32};
      const int n =
          snprintf(c->name, sizeof c->name, "%s%s%c", p->name, p->name[0] ? "." : "", p->channels[k]);
      if (n < 0 || (size_t)n >= sizeof c->name)
        return err_set(w->err, ERR_BAD_ARGUMENT, "cannot write \"%s\": the name of plane %zu is too long",
                       w->file->path, i);
    }
  }
  return true;
}

static bool begin(ExrWrite *w)
{
  exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
  init.error_handler_fn = ignore_error;
  init.alloc_fn = take_memory;
  init.free_fn = mem_free;
  init.user_data = w;
  init.write_fn = put_bytes;
  int part;
  if (!is_fine(w, exr_start_write(&w->exr, w->file->path, EXR_WRITE_FILE_DIRECTLY, &init)) ||
      !is_fine(w, exr_set_longname_support(w->exr, 1)) ||
      !is_fine(w, exr_add_part(w->exr, "picture", EXR_STORAGE_SCANLINE, &part)) ||
      !is_fine(w, exr_initialize_required_attr_simple(w->exr, part, (int32_t)w->img->width,
                                                      (int32_t)w->img->height, EXR_COMPRESSION_ZIP)))
    return false;
  for (size_t i = 0; i < w->channel_count; i++) {
    const ExrChannel *c = &w->channels[i];
    const exr_pixel_type_t type = c->is_float ? EXR_PIXEL_FLOAT : EXR_PIXEL_HALF;
    if (!is_fine(w, exr_add_channel(w->exr, part, c->name, type, EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1)))
      return false;
  }
  const char *comment = w->img->comment;
  // Level 2 takes half the time of zlib's default 6 for files 4 % larger.
  return (!comment || is_fine(w, exr_attr_set_string(w->exr, part, "comments", comment))) &&
         is_fine(w, exr_set_zip_compression_level(w->exr, part, 2)) && is_fine(w, exr_write_header(w->exr));
}

static const ExrChannel *channel_named(const ExrWrite *w, const char *name)
{
  for (size_t i = 0; i < w->channel_count; i++)
    if (!strcmp(w->channels[i].name, name)) return &w->channels[i];
  return NULL;
}

// One channel of the chunk's lines, in the file's type.
static void gather(uint8_t *to, const ExrChannel *c, const ImageOut *img, uint32_t y, uint32_t line_count)
{
  const float *from = c->first + (size_t)y * img->width * c->step;
  const size_t count = (size_t)img->width * line_count;
  uint16_t *halves = (uint16_t *)(void *)to;
  float *floats = (float *)(void *)to;
  for (size_t i = 0; i < count; i++) {
    if (c->is_float)
      floats[i] = from[i * c->step];
    else
      halves[i] = half_from_float(from[i * c->step]);
  }
}

static bool encode_chunk(ExrWrite *w, exr_encode_pipeline_t *e, uint32_t y)
{
  exr_chunk_info_t chunk;
  const bool is_first = !e->channels;
  if (!is_fine(w, exr_write_scanline_chunk_info(w->exr, PART, (int)y, &chunk)) ||
      !is_fine(w, is_first ? exr_encoding_initialize(w->exr, PART, &chunk, e)
                           : exr_encoding_update(w->exr, PART, &chunk, e)))
    return false;
  uint8_t *to = w->lines;
  for (int16_t i = 0; i < e->channel_count; i++) {
    exr_coding_channel_info_t *c = &e->channels[i];
    const ExrChannel *from = channel_named(w, c->channel_name);
    const int32_t size = from->is_float ? 4 : 2;
    gather(to, from, w->img, y, (uint32_t)chunk.height);
    c->encode_from_ptr = to;
    c->user_bytes_per_element = (int16_t)size;
    c->user_data_type = from->is_float ? EXR_PIXEL_FLOAT : EXR_PIXEL_HALF;
    c->user_pixel_stride = size;
    c->user_line_stride = size * (int32_t)w->img->width;
    to += (size_t)size * w->img->width * (size_t)chunk.height;
  }
  if (is_first && !is_fine(w, exr_encoding_choose_default_routines(w->exr, PART, e))) return false;
  return is_fine(w, exr_encoding_run(w->exr, PART, e));
}

static bool encode(ExrWrite *w)
{
  int32_t line_count = 0;
  if (!is_fine(w, exr_get_scanlines_per_chunk(w->exr, PART, &line_count))) return false;
  const size_t line_size = (size_t)w->img->width * w->channel_count * sizeof(float);
  w->lines = mem_alloc(line_size, (size_t)line_count);
  if (!w->lines) return err_memory(w->err, w->file->path, line_size * (size_t)line_count);
  exr_encode_pipeline_t e = EXR_ENCODE_PIPELINE_INITIALIZER;
  bool ok = true;
  for (uint32_t y = 0; ok && y < w->img->height; y += (uint32_t)line_count) ok = encode_chunk(w, &e, y);
  exr_encoding_destroy(w->exr, &e);
  return ok;
}

static bool write_exr(FileOut *f, const ImageOut *img, Err *err)
{
  ExrWrite w = {.file = f, .img = img, .err = err};
  bool ok = list_channels(&w) && begin(&w) && encode(&w);
  if (w.exr && !is_fine(&w, exr_finish(&w.exr))) ok = false; // writes the table of chunks
  mem_free(w.channels);
  mem_free(w.lines);
  if (w.failure == EXR_ERR_OUT_OF_MEMORY)
    return err_memory(err, f->path, (size_t)img->width * img->height * 4);
  return ok ||
         err_set(err, ERR_IO, "cannot write \"%s\": %s", f->path, exr_get_default_error_message(w.failure));
}
#endif

const Format format_exr = {
    .name = "OpenEXR",
    .extensions = {".exr"},
    .package = "libopenexr-dev",
    .is_linear = true,
    .is_start = is_exr,
#if RAYFOLD_HAVE_OPENEXR
    .read = read_exr,
    .write = write_exr,
#endif
};
