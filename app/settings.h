// Settings: the options that change a field of the scene, --set and those with a path in their table. Ranges and
// names are the library's to check; what it says comes with the option in front.

#ifndef RAYFOLD_APP_SETTINGS_H
#define RAYFOLD_APP_SETTINGS_H

#include "options.h"

typedef enum SettingsPart {
  SETTINGS_PLAIN,        // all but --set, which speaks of things in a scene: can be tried on an empty one
  SETTINGS_ALL,
  SETTINGS_BEFORE_STAGE, // all but what the stage of a bare model owns
  SETTINGS_OF_STAGE,     // only that
} SettingsPart;

// In the order of the command line, so that the last of two settings of one field holds.
ExitCode settings_apply(const Args *args, rf_engine *engine, rf_scene *scene, SettingsPart part);

// Only what --set says of one section, as "develop" and "develop.exposure", once more: for a section that was put
// aside. Sections whose edits add or remove things do not stand a second time.
ExitCode settings_repeat(const Args *args, rf_engine *engine, rf_scene *scene, const char *section);

#endif
