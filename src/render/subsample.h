// Subsample: a whole picture from a tenth of its pixels. Squares whose corners saw the same things and nearly the same
// colour are filled between them, others are cut in four, down to single pixels. What a pixel is, a function given by
// the caller tells; this file knows no rays.
//
//     o-------o-------o      o  corner, traced first, shared by its blocks
//     |       |   |   |      x  centre, traced before a block of 4 or more pixels is filled
//     |   x   |---o---|
//     |       |   | x |      signature: whatever must be alike for colours to be mixed (objects met on the way, lights
//     o-------o-------o      that reach them), as one number. Equal numbers, equal paths.
//
// Akimoto et al. 1991 interpolate between pixels of equal ray trees; a picture made that way flashes where things move,
// because highlights are not linear, small things slip between corners, and blocks disagree with finer neighbours.
// Against these: a limit on contrast as well, the centre, and one round in which a filled block that contradicts what
// its neighbours traced on the common edge is cut, too.
//
// All of a level is asked for before the next is looked at, so packets are full and the result depends on neither
// threads nor order. The caller's function must give the same answer for the same pixel.

#ifndef RAYFOLD_RENDER_SUBSAMPLE_H
#define RAYFOLD_RENDER_SUBSAMPLE_H

#include "base/jobs.h"

#include <stdint.h>

enum { SUBSAMPLE_PACKET = 64 }; // pixels a call, at most

typedef struct SubsamplePixel {
  uint16_t x, y;
} SubsamplePixel;

typedef struct SubsampleResult {
  float rgb[3]; // as shown, 0..1: contrast is judged and colours are mixed as the eye gets them
  uint32_t signature;
  uint32_t object; // what is there; of a filled block, that of its first corner
} SubsampleResult;

// Tells the colours of count pixels. Called from any worker of the pool, from several at once.
typedef void SubsampleTrace(void *user, const SubsamplePixel *pixels, size_t count, SubsampleResult *out, int worker);

typedef struct SubsampleSettings {
  int block;            // side of the largest blocks: 4, 8 or 16; less traces every pixel
  float most_contrast;  // between corners, a channel
  float most_error;     // of the centre and of what neighbours traced, a channel
  bool has_probe, has_round; // trace centres; look at neighbours' edges
  bool shows_blocks;    // a view: filled blocks of one colour red, others blue
  bool is_bgr;          // writes blue, green, red, 255: a window's 0xffrrggbb
} SubsampleSettings;

typedef struct SubsampleStats {
  uint64_t traced, equal, mixed; // pixels; equal and mixed are those of blocks filled, their corners included
} SubsampleStats;

typedef struct Subsampler Subsampler;

// 8, 8/255, 5/255, and all cures on.
SubsampleSettings subsample_defaults(void);

Subsampler *subsampler_create(int width, int height, Err *err); // 1..65535 a side; NULL when memory is out
void subsampler_destroy(Subsampler *s);                         // accepts NULL

// Makes a picture of 8-bit red, green, blue, 255, rows from the top, and of objects unless that is NULL. False when
// cancelled; both are then in part old.
bool subsampler_run(Subsampler *s, const SubsampleSettings *settings, SubsampleTrace *trace, void *user, Jobs *jobs,
                    const Cancel *cancel, uint8_t *rgba, uint32_t *objects, SubsampleStats *stats);

#endif
