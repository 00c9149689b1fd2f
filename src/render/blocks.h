// Blocks: a frame of the integrator whitted from a part of its pixels (subsample.h), straight to the window's pixels: no
// film is written, cleared and read. What it traces is what a film with the first sample of the pass would hold.

#ifndef RAYFOLD_RENDER_BLOCKS_H
#define RAYFOLD_RENDER_BLOCKS_H

#include "post/tone.h"
#include "render/hot.h"
#include "render/subsample.h"

typedef struct Blocks Blocks;

Blocks *blocks_create(uint32_t width, uint32_t height, Jobs *jobs, const HotTable *hot, Err *err); // NULL when memory is out
void blocks_destroy(Blocks *b);                                                                    // accepts NULL

// pass: its film need not be set. settings: is_bgr is set here. pixels, 0xffrrggbb, and objects are those of the whole
// picture. Fails only when it is cancelled.
bool blocks_render(Blocks *b, const RenderPass *pass, const SubsampleSettings *settings, const Tone *tone,
                   const Cancel *cancel, uint32_t *pixels, uint32_t *objects, SubsampleStats *stats,
                   RayCounters *rays, Err *err);

#endif
