// The high-quality denoiser: Open Image Denoise's U-Net on colour, albedo and normal, with its authors' weights. Done
// in tiles of at most DENOISE_TILE pixels that overlap by more than the network sees, so that memory stays below about
// 450 MB however large the picture, and a tiled picture has the bits of one done whole.

#ifndef RAYFOLD_POST_DENOISE_NET_H
#define RAYFOLD_POST_DENOISE_NET_H

#include "post/guided.h"
#include "post/unet.h"

enum { DENOISE_CHANNELS = 9, DENOISE_TILE = 1 << 20 };

// out: rgba of the picture's size, alpha as it was. Depth and variance are not looked at. tile_pixels: 0 for
// DENOISE_TILE. False with ERR_CANCELLED, ERR_NO_MEMORY, or weights for other inputs.
bool denoise_net(const Guided *g, const Unet *net, size_t tile_pixels, const PostKernels *kernels, Jobs *jobs,
                 const Cancel *cancel, float *out, Err *err);

#endif
