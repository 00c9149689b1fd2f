// Mips: a picture's chain of ever smaller ones, down to 1 x 1, each texel the mean of the area it stands for, in linear
// light. Sizes are halved and rounded down; where that does not come out even, texels are weighted by the part of them
// that is covered, so a level's mean is the picture's at any size. All levels of a chain keep the picture's type and
// channels and lie in one block of a third of its bytes.
//
// A box, not a Kaiser window: it never overshoots (an albedo stays in 0..1), keeps the mean exactly, and what it leaves
// of aliasing is hidden by the many samples of a pixel.

#ifndef RAYFOLD_IMAGE_MIPS_H
#define RAYFOLD_IMAGE_MIPS_H

#include "image/image.h"

enum { MIPS_MOST = 15 }; // halves of IMAGE_MOST_SIDE

typedef struct Mips {
  Image levels[MIPS_MOST]; // from half the picture's size on; their pixels lie in `block`
  uint32_t count;
  size_t size;             // of the block, bytes
  void *block;             // owned
} Mips;                    // zero is none

// What the values mean.
typedef struct MipsMeaning {
  bool is_srgb;     // colour channels of integers are decoded before and encoded after the mean
  bool is_coverage; // alpha is coverage: colours count by it, so that what lies in holes does not bleed out
} MipsMeaning;

bool mips_begin(Mips *m, const Image *finest); // makes room; false: no memory
void mips_finish(Mips *m);                     // accepts zero

// Fills rows [y0, y1) of levels[level], from the level above, which must be whole.
void mips_rows(Mips *m, const Image *finest, MipsMeaning meaning, uint32_t level, uint32_t y0, uint32_t y1);

#endif
