// `rayfold convert`: a scene or model into another, a picture into another, told apart by their extensions.

#include "commands.h"
#include "library.h"
#include "output.h"
#include "stage.h"

#include <string.h>

#define SCENE_OUTPUTS ".json|.rfm|.ply|.obj|.stl|.vox|.grid"

static const Option convert_options[] = {
    {.name = "exposure",
     .kind = OPTION_REAL,
     .argument = "STOPS",
     .initial = "0",
     .low = -32,
     .high = 32,
     .sentence = "For a float picture into a display format: brightness; each stop doubles it."},
    {.name = "tone-curve",
     .kind = OPTION_CHOICE,
     .argument = "NAME",
     .initial = "filmic",
     .choices = "linear|filmic|agx|neutral",
     .sentence = "The same: from scene light to the screen."},
    {.name = "bits",
     .kind = OPTION_CHOICE,
     .argument = "N",
     .initial = "8 for .png, 16 for .exr",
     .choices = "8|16|32",
     .sentence = "Bits a channel: .png takes 8 or 16, .exr 16 or 32."},
    {.name = "quality",
     .kind = OPTION_INTEGER,
     .argument = "N",
     .initial = "92",
     .low = 1,
     .high = 100,
     .sentence = "Of .jpg and .webp."},
    {.name = "voxels",
     .kind = OPTION_INTEGER,
     .argument = "N",
     .low = 1,
     .high = 4096,
     .sentence = "Make voxels of a scene or model, N along its longest side; for .vox, .grid, .json and .rfm. Of a "
                 ".grid or .nvdb into .vox without this option: as many as it has."},
    {.name = "threshold",
     .kind = OPTION_REAL,
     .argument = "D",
     .initial = "0.5",
     .low = 0,
     .high = 1e30,
     .sentence = "The same: smoke fills a cell where its density is at least D; 0: it fills none."},
    {.name = "hollow", .kind = OPTION_FLAG, .sentence = "The same: only the skin of what is closed."},
    {.name = "element",
     .kind = OPTION_CHOICE,
     .argument = "KIND",
     .choices = "portal|warped|shrink|rotation|material",
     .sentence = "IN is a file of NoEucRT that holds one of these; its cells and gates, or material, become OUT, a .json."},
    OPTION_ALLOW_OUTSIDE,
    OPTION_QUIET("No notes."),
    {0},
};

// A model made into a scene is there to be edited, and shows what rendering the model itself shows.
static ExitCode add_stage(rf_engine *engine, rf_scene *scene, const char *in, bool is_quiet)
{
  if (!stage_is_wanted(engine, scene)) return EXIT_DONE;
  stage_turn(engine, scene, in, is_quiet);
  int width, height;
  rf_scene_render_def(scene, &width, &height);
  rf_world *world = rf_prepare(scene, NULL);
  const ExitCode code =
      world ? stage_build(engine, scene, world, (float)width / (float)height) : fail_library(engine);
  rf_world_destroy(world);
  return code;
}

static ExitCode make_voxels(rf_engine *engine, rf_scene **scene, const Args *args)
{
  rf_scene *made = rf_voxelise(*scene, (int)args_integer(args, "voxels", 0), !args_has(args, "hollow"),
                               (float)args_real(args, "threshold", 0.5));
  if (!made) return fail_library(engine);
  rf_scene_destroy(*scene);
  *scene = made;
  return EXIT_DONE;
}

static ExitCode convert_scene(rf_engine *engine, const char *in, const char *out, const Args *args)
{
  rf_scene *scene = NULL;
  const bool is_quiet = args_has(args, "quiet");
  ExitCode code = scene_open(&scene, engine, in, args);
  if (!code && !is_quiet) say_notes(scene);
  const bool is_grid_to_voxels = output_is_any(in, ".grid|.nvdb") && output_is_any(out, ".vox");
  if (!code && (args_has(args, "voxels") || is_grid_to_voxels)) code = make_voxels(engine, &scene, args);
  if (!code && output_is_any(out, ".json")) code = add_stage(engine, scene, in, is_quiet);
  // A saved model shows what the model shows, so it stands as that would be stood up.
  if (!code && output_is_any(out, ".rfm") && stage_is_wanted(engine, scene))
    stage_turn(engine, scene, in, is_quiet);
  if (!code && !rf_scene_save(scene, out)) code = fail_library(engine);
  rf_scene_destroy(scene);
  return code;
}

static ExitCode convert_picture(rf_engine *engine, const char *in, const char *out, const Args *args)
{
  rf_develop_def develop = rf_default_develop_def();
  rf_save_def save = rf_default_save_def();
  const char *tone_curve = args_text(args, "tone-curve");
  if (tone_curve) develop.tone_curve = tone_curve;
  develop.exposure = (float)args_real(args, "exposure", 0);
  save.bits = (int)args_integer(args, "bits", 0);
  save.quality = (int)args_integer(args, "quality", 0);
  return rf_image_convert(engine, in, out, &develop, &save) ? EXIT_DONE : fail_library(engine);
}

// What cannot be made of what, before anything is read.
static ExitCode check_pair(rf_engine *engine, const char *in, const char *out, bool is_scene)
{
  const bool is_picture_out = rf_can_save(engine, out), is_scene_out = output_is_any(out, SCENE_OUTPUTS);
  if (is_scene ? is_scene_out : is_picture_out) return output_check(out);
  if (is_scene && is_picture_out)
    return fail(EXIT_USAGE, "%s is a scene and %s a picture; use `rayfold render %s -o %s`", in, out, in,
                out);
  if (is_scene)
    return fail(EXIT_USAGE, "%s: a scene or model can become .json, .rfm, .ply, .obj, .stl, .vox or .grid", out);
  if (is_scene_out)
    return fail(EXIT_USAGE, "%s is not a scene or model (" SCENE_INPUTS "), but %s would be", in, out);
  return fail(EXIT_USAGE, "%s: a picture can become .png, .jpg, .webp, .exr, .hdr or .pfm", out);
}

static ExitCode run_convert(const Args *args)
{
  const char *in = args->operands[0], *out = args->operands[1];
  const bool is_scene = args_text(args, "element") || output_is_any(in, SCENE_INPUTS);
  rf_engine *engine = NULL;
  ExitCode code = engine_open(&engine, 0, NULL);
  if (!code) code = check_pair(engine, in, out, is_scene);
  if (!code) code = is_scene ? convert_scene(engine, in, out, args) : convert_picture(engine, in, out, args);
  rf_engine_destroy(engine);
  return code;
}

const Command command_convert = {
    .name = "convert",
    .sentence = "Convert a scene or model into another format, or a picture into another.",
    .operands = "IN OUT",
    .least = 2,
    .most = 2,
    .operand_kind = OPERAND_FILE,
    .usage = "[OPTION]...",
    .text = "A scene or model (.json .obj .gltf .glb .ply .stl .vox .grid .nvdb .rfm) becomes .json (with its meshes in "
            "files beside it, and camera and light if it has none), .rfm (one file with all that is ready made, "
            "trees too, which opens at once), one mesh in .ply, .obj or .stl, voxels in .vox, or voxels as smoke "
            "in .grid. A picture becomes .png, .jpg, .webp, .exr, .hdr or .pfm.",
    .example = "rayfold convert bunny.glb bunny.ply",
    .options = convert_options,
    .run = run_convert,
};
