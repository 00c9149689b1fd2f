// Pictures: a film into as many files as were named with -o. What several commands share: the options, what can be
// known to be wrong before the work, and the writing.

#ifndef RAYFOLD_APP_PICTURES_H
#define RAYFOLD_APP_PICTURES_H

#include "frames.h"
#include "options.h"

#define OPTION_PICTURES                                                                                    \
  {                                                                                                        \
    .name = "output", .letter = 'o', .kind = OPTION_FILE, .argument = "OUT", .repeats = true,              \
    .sentence =                                                                                            \
        "Where the picture goes; the extension picks the format: .png, .jpg and .webp hold the developed " \
        "picture, .exr (with all AOVs), .hdr and .pfm linear radiance. \"hash\" prints the hash of the "   \
        "picture, which does not depend on the AOVs beside it. May be repeated."                           \
  }
#define OPTION_NO_EFFECTS                                                             \
  {                                                                                   \
    .name = "no-effects", .kind = OPTION_FLAG,                                        \
    .sentence = "Ignore the scene's develop settings: linear tone curve, exposure 0." \
  }
#define OPTION_BITS                                                                               \
  {                                                                                               \
    .name = "bits", .kind = OPTION_CHOICE, .argument = "N", .initial = "8 for .png, 16 for .exr", \
    .choices = "8|16|32", .sentence = "Bits a channel: .png takes 8 or 16, .exr 16 or 32."        \
  }
#define OPTION_QUALITY                                                                                  \
  {                                                                                                     \
    .name = "quality", .kind = OPTION_INTEGER, .argument = "N", .initial = "92", .low = 1, .high = 100, \
    .sentence = "Of .jpg and .webp."                                                                    \
  }

// Is there one among them? is_such: picture_is_hash, picture_is_exr, picture_is_video.
bool pictures_have(const Args *a, bool (*is_such)(const char *output));
bool picture_is_hash(const char *output);
bool picture_is_exr(const char *output);
bool picture_is_video(const char *output);

// Formats, bits and folders of all of them.
ExitCode pictures_check(const Args *a, rf_engine *engine);

// One that fails does not keep the others from being written; the first failure is the answer. "hash" is left to
// whoever has it, like films. planes: those that an .exr gets, 0 for all. frame: what frame_name() takes.
// develop: the scene's; --no-effects is heeded here.
ExitCode pictures_write(const Args *a, rf_engine *engine, const rf_film *film, unsigned planes,
                        rf_develop_def develop, long frame);
rf_develop_def pictures_develop(const Args *a, rf_develop_def develop); // as --no-effects says
ExitCode pictures_print_hash(uint64_t hash);

// "a.png, b.exr" for the summary.
void pictures_list(const Args *a, FILE *out);

#endif
