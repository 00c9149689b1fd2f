// Texts made from the field tables: the JSON Schema for editors and panels, the manual page, and what `rayfold info`
// says of a scene. Nothing in them is written down a second time.

#ifndef RAYFOLD_SCENE_PAGES_H
#define RAYFOLD_SCENE_PAGES_H

#include "scene/kinds.h"

// JSON Schema, draft 2020-12. Beside the standard keywords, each field has "x-rayfold": { "type", "unit" }. False
// when memory is out; so with all here.
bool scene_schema(Text *out);

// docs/scene.md: the scene file and the edit language, Markdown.
bool scene_manual(Text *out);

// A summary for people, some lines: counts, triangles, memory, bounds, notes.
bool scene_info(const Scene *s, Text *out);

#endif
