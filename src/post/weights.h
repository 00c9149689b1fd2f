// Weights: where the trained networks are looked for, and a network from there.

#ifndef RAYFOLD_POST_WEIGHTS_H
#define RAYFOLD_POST_WEIGHTS_H

#include "post/unet.h"

// Reads the network in the file `name`. folder: where it is; NULL looks into rayfold/ of the user's and the system's
// data folders ($XDG_DATA_HOME, then $XDG_DATA_DIRS, with the defaults of the XDG base directory specification 0.8).
// ERR_NOT_FOUND says how to get it.
bool weights_load(Unet *out, const char *folder, const char *name, Err *err);

#endif
