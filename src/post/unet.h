// U-Net: the network of Open Image Denoise (Afra 2019; after Ronneberger et al. 2015), sixteen convolutions over five
// sizes of picture. Sizes and channels come from the weights; the order of the layers is fixed.
//
// A plan holds the maps for pictures of one size and is used for one after another. It knows nothing of colours: what
// goes in and comes out is denoise.c's affair.

#ifndef RAYFOLD_POST_UNET_H
#define RAYFOLD_POST_UNET_H

#include "base/jobs.h"
#include "post/kernels.h"
#include "post/tza.h"

enum { UNET_LAYERS = 16, UNET_ALIGN = 16 }; // a picture's sides must be multiples of UNET_ALIGN

typedef struct UnetLayer {
  uint32_t in, skip, out; // channels; skip 0: no second input
  const float *weights, *bias;
  size_t phase_size, block_size;
} UnetLayer;

typedef struct Unet {
  UnetLayer layers[UNET_LAYERS];
  float *memory; // owned: weights and biases, packed for the kernels
} Unet;          // zero is none

bool unet_init(Unet *out, const Tza *weights, Err *err);
void unet_finish(Unet *u); // accepts zero

typedef struct UnetPlan {
  const Unet *unet;
  Map maps[UNET_LAYERS + 1]; // by the layer that writes it; the last is the input
  float *memory;             // owned
  float *scratch;            // scratch_size floats a worker, in memory
  size_t scratch_size;
} UnetPlan; // zero is none

// About 400 bytes a pixel. Maps share memory where they can, so a map's content is gone once a later one is made.
bool unet_plan_init(UnetPlan *out, const Unet *u, uint32_t width, uint32_t height, int workers, Err *err);
void unet_plan_finish(UnetPlan *p); // accepts zero

static inline Map *unet_input(UnetPlan *p)
{
  return &p->maps[UNET_LAYERS];
}
static inline const Map *unet_output(const UnetPlan *p)
{
  return &p->maps[UNET_LAYERS - 1];
}

// Runs all layers from input to output; the input is used up. False if cancelled.
bool unet_run(UnetPlan *p, const PostKernels *kernels, Jobs *jobs, const Cancel *cancel);

#endif
