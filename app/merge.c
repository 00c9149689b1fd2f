// `rayfold merge`: films of one picture, from many runs or machines, into one film and its pictures.

#include "commands.h"
#include "kept_film.h"
#include "library.h"
#include "output.h"
#include "pictures.h"

#include <stdlib.h>
#include <string.h>

static const Option merge_options[] = {
    OPTION_PICTURES,
    {.name = "film",
     .kind = OPTION_FILE,
     .argument = "FILE",
     .sentence = "Write the film of all their samples, to be merged further or gone on with."},
    OPTION_NO_EFFECTS,
    OPTION_BITS,
    OPTION_QUALITY,
    OPTION_QUIET("No notes, no summary."),
    {0},
};

typedef struct Merge {
  const Args *args;
  rf_engine *engine;
  rf_film *film;       // of all so far
  rf_film_label label; // of the first
} Merge;

static ExitCode check_label(const Merge *m, const char *path, const rf_film_label *label)
{
  if (label->key == m->label.key) return EXIT_DONE;
  return fail(
      EXIT_BAD_SCENE,
      "%s and %s are of different pictures (of %.*s and %.*s, or with other settings); only films of one "
      "picture can be merged",
      m->args->operands[0], path, note_scene_length(m->label.note), m->label.note,
      note_scene_length(label->note), label->note);
}

static ExitCode add(Merge *m, const char *path)
{
  rf_film_label label;
  rf_film *film = rf_film_open(m->engine, path, &label);
  if (!film) return fail_library(m->engine);
  if (label.is_older && !args_has(m->args, "quiet"))
    say_note("%s is damaged; taking %s~, the one before", path, path);
  if (!m->film) {
    m->film = film;
    m->label = label;
    return EXIT_DONE;
  }
  ExitCode code = check_label(m, path, &label);
  if (!code && !rf_film_merge(m->film, film)) {
    const char *why;
    rf_error(m->engine, &why);
    code = fail(EXIT_BAD_SCENE, "%s: %s", path, why);
  }
  rf_free(label.note);
  rf_film_destroy(film);
  return code;
}

// As the scene said when the first film was begun.
static ExitCode find_develop(const Merge *m, rf_develop_def *out)
{
  rf_scene *scene = rf_scene_create(m->engine);
  const char *json = m->label.note + note_scene_length(m->label.note);
  if (!scene) return fail_library(m->engine);
  const bool ok = !*json || rf_set(scene, "develop", json + 1);
  *out = rf_scene_develop_def(scene);
  rf_scene_destroy(scene);
  return ok ? EXIT_DONE : fail_library(m->engine);
}

static ExitCode write_all(const Merge *m)
{
  const char *film = args_text(m->args, "film");
  rf_develop_def develop;
  ExitCode code = find_develop(m, &develop);
  if (!code && film && !rf_film_keep(m->film, film, m->label.key, m->label.note))
    code = fail_library(m->engine);
  if (!code) code = pictures_write(m->args, m->engine, m->film, 0, develop, FRAME_NONE);
  if (!code && pictures_have(m->args, picture_is_hash)) code = pictures_print_hash(rf_film_hash(m->film));
  if (code || args_has(m->args, "quiet")) return code;
  pictures_list(m->args, stderr);
  if (film) fprintf(stderr, "%s%s", args_has(m->args, "output") ? ", " : "", film);
  fprintf(stderr, ": %d spp of %zu film%s\n", film_sample_count(m->film), m->args->operand_count,
          m->args->operand_count == 1 ? "" : "s");
  return EXIT_DONE;
}

static ExitCode run_merge(const Args *args)
{
  Merge m = {.args = args};
  const char *film = args_text(args, "film");
  ExitCode code = engine_open(&m.engine, 0, NULL);
  if (!code && !film && !args_has(args, "output"))
    code = fail(EXIT_USAGE,
                "merge needs -o OUT or --film FILE, as in `rayfold merge a.rff b.rff -o picture.png`");
  if (!code) code = pictures_check(args, m.engine);
  if (!code && film) code = output_check(film);
  for (size_t i = 0; !code && i < args->operand_count; i++) code = add(&m, args->operands[i]);
  if (!code) code = write_all(&m);
  rf_film_destroy(m.film);
  rf_free(m.label.note);
  rf_engine_destroy(m.engine);
  return code;
}

const Command command_merge = {
    .name = "merge",
    .sentence = "Put films of one picture together.",
    .operands = "FILM...",
    .least = 1,
    .most = SIZE_MAX,
    .operand_kind = OPERAND_FILE,
    .usage = "[-o OUT] [--film FILE] [OPTION]...",
    .text =
        "FILMs (.rff) come from `rayfold render --film`, each with other samples of the same picture: take "
        "--samples 0:64 on one machine and --samples 64:128 on another. The picture is the same to the last "
        "bit "
        "as if one had taken them all. Films that share a sample, or are of different pictures, are refused.",
    .example = "rayfold merge a.rff b.rff -o picture.png",
    .options = merge_options,
    .run = run_merge,
};
