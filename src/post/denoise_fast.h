// The fast denoiser, for live use: five passes of the edge-avoiding wavelet filter (atrous.h) over the light alone,
// that is radiance divided by albedo, so that textures are not in its way; multiplied back in the end. One picture, no
// history of earlier ones. Lone bright pixels stay: held to their neighbours' light, small highlights went, too (1 dB).

#ifndef RAYFOLD_POST_DENOISE_FAST_H
#define RAYFOLD_POST_DENOISE_FAST_H

#include "base/jobs.h"
#include "post/guided.h"
#include "post/kernels.h"

// What is kept from one picture to the next, so that a live view asks for no memory. Begins as zero.
typedef struct FastScratch {
  float *planes; // owned
  size_t room;   // floats
} FastScratch;

void fast_scratch_finish(FastScratch *s);

// scratch: NULL for one picture alone. out: rgba of the picture's size, alpha as it was. False with ERR_CANCELLED or ERR_NO_MEMORY.
bool denoise_fast(const Guided *g, const PostKernels *kernels, FastScratch *scratch, Jobs *jobs, const Cancel *cancel,
                  float *out, Err *err);

#endif
