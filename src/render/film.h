// Film: what the samples of a picture add up to, plane by plane. Every value of every sample is rounded to 64-bit
// fixed point first (unit 2^-28, held within +-FILM_LIMIT) and then only added as an integer. Integer sums are associative,
// so any order of tiles, any number of threads and any split of the samples gives the same bytes, and films of
// disjoint samples merge exactly. 2^19 samples fit before a sum could overflow; more are refused.
//
//   count     uint32 a pixel: samples taken, always there
//   sums      int64, channels of a pixel side by side; a plane is allocated only when asked for
//   first     uint64 a pixel of the id planes: sample number << 32 | id, the lowest number wins
//   moments   of the variance: sum of fixed-point luminances and of their squares, exact in 128 bits
//
// Which samples are in is known by cells of 16 x 16 pixels, so that each part of a picture may have samples of its own.
//
// One thread writes one tile; whoever reads waits for the end of a pass. It knows nothing of filters: a sample belongs
// to one pixel (filter.h puts it there), so all weights are 1.

#ifndef RAYFOLD_RENDER_FILM_H
#define RAYFOLD_RENDER_FILM_H

#include "base/array.h"
#include "base/err.h"
#include "base/vec.h"

#include <stddef.h>
#include <stdint.h>

typedef enum FilmPlane { // the order of rf_plane's bits
  FILM_BEAUTY, // rgb radiance and alpha; rgb holds what reaches the eye, so it is multiplied by alpha already
  FILM_ALBEDO,
  FILM_NORMAL,      // world space, towards the viewer; the mean, so shorter than 1 at edges
  FILM_DEPTH,       // metres along the view axis, mean over the samples that hit something; 0: none did
  FILM_POSITION,    // world space, the same; within 65 536 m of the origin
  FILM_OBJECT_ID,   // 1 + index, of the lowest-numbered sample; 0: nothing there
  FILM_MATERIAL_ID, // likewise
  FILM_VARIANCE,    // of the pixel's mean luminance; 0 while there are less than two samples
  FILM_SAMPLES,     // how many the pixel got
  FILM_PLANE_COUNT,
} FilmPlane;

enum { FILM_MOST_SIDE = 32768, FILM_MOST_SAMPLES = 1 << 19, FILM_CELL = 16 };
// The largest float below 2^16: 2^19 of 2^16 would be one too many for 63 bits.
#define FILM_LIMIT 0x1.fffffep15f

extern const char *const film_plane_names[FILM_PLANE_COUNT];    // "", "albedo", ...: as files call them
extern const char *const film_plane_channels[FILM_PLANE_COUNT]; // "RGBA", "RGB", "XYZ", ...

typedef struct FilmMoments {
  unsigned __int128 squares; // unit 2^-56
  int64_t sum;               // unit 2^-28
} FilmMoments;

typedef struct CellRange {
  uint32_t cell;       // numbered row by row
  uint32_t first, end; // samples [first, end) of each of its pixels
} CellRange;

typedef struct CellBox {
  uint32_t x0, y0, x1, y1; // pixels [x0, x1) x [y0, y1)
} CellBox;

typedef struct Film {
  uint32_t width, height;
  uint32_t planes;             // bits 1 << FilmPlane; beauty and samples are always set
  uint32_t *count;             // owned, as all arrays here
  int64_t *sums[FILM_DEPTH];   // beauty 4, albedo 3, normal 3 channels
  int64_t *depth;              // 2 channels: sum, hits
  int64_t *position;           // 4 channels: sums, hits
  uint64_t *object, *material; // UINT64_MAX: no sample yet
  FilmMoments *moments;
  ARRAY(CellRange) ranges;   // samples claimed so far, sorted by cell and first, apart from each other
  bool is_partial;           // a pass was broken off: some pixels lack some of the claimed samples
} Film;

// What one sample saw. Directions and ids count only if is_hit.
typedef struct FilmSample {
  Vec3 radiance, albedo, normal, position;
  float alpha, depth;
  uint32_t object, material; // 1 + index
  bool is_hit;
} FilmSample;

// One array of a film, so that what holds for all is written once.
typedef struct FilmArray {
  void **data;       // NULL inside: this film lacks the plane
  size_t pixel_size; // bytes
  FilmPlane plane;
  uint8_t fill; // byte of a cleared array
} FilmArray;

enum { FILM_ARRAY_COUNT = 9 };
void film_list_arrays(Film *f, FilmArray out[FILM_ARRAY_COUNT]);

// Bytes a film of this size takes; false if that overflows.
bool film_bytes(uint32_t width, uint32_t height, uint32_t planes, size_t *bytes);

// planes: bits 1 << FilmPlane. NULL on no memory or a side out of 1..FILM_MOST_SIDE.
Film *film_create(uint32_t width, uint32_t height, uint32_t planes, Err *err);
void film_destroy(Film *f); // accepts NULL
void film_clear(Film *f);
// The same in parts that may go to several threads: all rows, then film_forget().
void film_clear_rows(Film *f, uint32_t first, uint32_t end);
void film_forget(Film *f);

// Notes that these samples are about to be added; fails if some of them are in already or there would be too many, and
// then changes nothing. The ranges are sorted as the film's are.
bool film_claim_cells(Film *f, const CellRange *ranges, size_t count, Err *err);
bool film_claim(Film *f, uint32_t first, uint32_t end, Err *err); // of every cell

uint32_t film_columns(const Film *f); // of cells
uint32_t film_cells(const Film *f);
CellBox film_cell_box(const Film *f, uint32_t cell);

// Adds the samples of src. Both must have the same size and planes and no sample of a pixel in common; on failure dst
// is unchanged.
bool film_merge(Film *dst, const Film *src, Err *err);

// The plane as floats, rows from the top, strlen(film_plane_channels[plane]) values a pixel. False: not in this film.
bool film_resolve(const Film *f, FilmPlane plane, float *out);
// Rows [first, end) of a plane the film has, written where they belong in all of it.
void film_resolve_rows(const Film *f, FilmPlane plane, uint32_t first, uint32_t end, float *out);

// The noise of each cell into noise[film_cells()], and as result that of the picture, their root mean square: the
// standard error of its pixels' mean luminances (root mean square) over the cell's mean luminance. A cell that is darker
// than the picture is measured by the geometric mean of both: the eye sees noise in the dark less, and what is black
// needs no samples for ever (Dammertz et al., "A Hierarchical Automatic Stopping Condition for Monte Carlo Global
// Illumination", 2010, divide by the root of the luminance). Pixels without a sample do not count. 0 without the
// variance plane. noise may be NULL.
double film_noise(const Film *f, float *noise);

// A hash of the size and of every sum: equal films, equal hashes.
uint64_t film_hash(const Film *f);

static inline bool film_has(const Film *f, FilmPlane plane)
{
  return f->planes >> plane & 1;
}

// Nearest multiple of 2^-28, held within +-FILM_LIMIT; 0 for NaN. The product is exact, the rounding is to even.
static inline int64_t film_fixed(float x)
{
  const float held = x > FILM_LIMIT ? FILM_LIMIT : x < -FILM_LIMIT ? -FILM_LIMIT : x == x ? x : 0;
  return llrintf(held * 0x1p28f);
}

static inline void film_add_vector(int64_t *sums, Vec3 v)
{
  for (int k = 0; k < 3; k++) sums[k] += film_fixed(v[k]);
}

static inline void film_add_id(uint64_t *first, uint32_t sample, uint32_t id)
{
  const uint64_t entry = (uint64_t)sample << 32 | id;
  if (entry < *first) *first = entry;
}

// Adds one sample to a pixel. False if its radiance is not finite; it then counts as black.
static inline bool film_add(Film *f, uint32_t x, uint32_t y, uint32_t sample, const FilmSample *s)
{
  const size_t i = (size_t)y * f->width + x;
  const bool is_good = v3_is_finite(s->radiance);
  const Vec3 radiance = is_good ? s->radiance : v3_all(0);
  f->count[i]++;
  film_add_vector(f->sums[FILM_BEAUTY] + 4 * i, radiance);
  f->sums[FILM_BEAUTY][4 * i + 3] += film_fixed(s->alpha);
  if (f->moments) {
    const int64_t l = film_fixed(luminance(radiance));
    f->moments[i].sum += l;
    f->moments[i].squares += (unsigned __int128)((__int128)l * l);
  }
  if (f->object) film_add_id(f->object + i, sample, s->is_hit ? s->object : 0);
  if (f->material) film_add_id(f->material + i, sample, s->is_hit ? s->material : 0);
  if (!s->is_hit) return is_good;
  if (f->sums[FILM_ALBEDO]) film_add_vector(f->sums[FILM_ALBEDO] + 3 * i, s->albedo);
  if (f->sums[FILM_NORMAL]) film_add_vector(f->sums[FILM_NORMAL] + 3 * i, s->normal);
  if (f->depth) {
    f->depth[2 * i] += film_fixed(s->depth);
    f->depth[2 * i + 1]++;
  }
  if (f->position) {
    film_add_vector(f->position + 4 * i, s->position);
    f->position[4 * i + 3]++;
  }
  return is_good;
}

#endif
