// `rayfold trace`: files of rays through a mesh, as fast as it goes, one line of figures for each. The counterpart of
// the yardstick in bench/ that measures Embree: same files, same lines, same manner of timing.

#include "commands.h"
#include "library.h"
#include "output.h"
#include "trace_build.h"
#include "trace_run.h"

#include <stdlib.h>
#include <string.h>

static const Option trace_options[] = {
    {.name = "threads",
     .kind = OPTION_INTEGER,
     .argument = "N",
     .initial = "1",
     .low = 1,
     .high = MOST_TRACE_THREADS,
     .repeats = true,
     .sentence = "Threads that trace, and with --build those that build. One line for each N."},
    {.name = "api",
     .kind = OPTION_CHOICE,
     .argument = "NAME",
     .initial = "batch",
     .choices = "single|batch",
     .repeats = true,
     .sentence =
         "How the library is asked: a ray a call (rf_intersect, rf_occluded) or many (the _n forms)."},
    {.name = "repeat",
     .kind = OPTION_INTEGER,
     .argument = "N",
     .initial = "5",
     .low = 1,
     .high = 1000,
     .sentence = "Runs at least, after one to warm up."},
    {.name = "time",
     .kind = OPTION_REAL,
     .argument = "S",
     .initial = "0.5",
     .low = 0,
     .high = 3600,
     .sentence = "Seconds at least that the runs of a line take together."},
    {.name = "quality",
     .kind = OPTION_CHOICE,
     .argument = "NAME",
     .initial = "fast",
     .choices = "fast|best",
     .sentence = "How the tree is built: `render.tree` of a scene. The hits do not depend on it."},
    {.name = "build",
     .kind = OPTION_FLAG,
     .sentence = "Also measure how fast the tree is built and what it holds: a \"build,\" line."},
    {.name = "compact",
     .kind = OPTION_FLAG,
     .sentence = "Keep the tree in an eighth of the memory, as render.compact does; slower to trace."},
    {.name = "isa",
     .kind = OPTION_CHOICE,
     .argument = "LEVEL",
     .initial = "auto",
     .choices = "auto|ref|v2|v3|v4",
     .sentence = "Instruction set to use. The hits do not depend on it."},
    {.name = "label",
     .kind = OPTION_TEXT,
     .argument = "TEXT",
     .initial = "rayfold",
     .sentence = "The first field of each line."},
    {.name = "output",
     .letter = 'o',
     .kind = OPTION_FILE,
     .argument = "HITS",
     .sentence = "Write a ray file with the hits found; for one RAYS."},
    {0},
};

typedef struct Trace { // all that one run owns
  const Args *args;
  const char *label, *quality;
  MeshFile mesh; // its arrays only until the scene has them
  rf_engine *engine;
  rf_scene *scene;
  rf_world *world;
} Trace;

static const char *api_names[] = {[TRACE_SINGLE] = "single", [TRACE_BATCH] = "batch"};

// --- what was asked --------------------------------------------------------------------------------
// The i-th value of an option that repeats, or its default: start with *i = 0; NULL past the last.
static const char *next_or(const Args *a, const char *name, const char *otherwise, size_t *i)
{
  if (args_has(a, name)) return args_next(a, name, i);
  return (*i)++ ? NULL : otherwise;
}

static ExitCode check_command_line(const Args *a)
{
  const char *out = args_text(a, "output"), *label = args_text(a, "label");
  if (a->operand_count < 2 && !args_has(a, "build"))
    return fail(EXIT_USAGE, "trace needs RAYS, or --build to measure building alone");
  if (out && a->operand_count != 2) return fail(EXIT_USAGE, "-o %s takes the hits of one RAYS", out);
  if (label && strpbrk(label, ",\n")) return fail(EXIT_USAGE, "--label %s: no commas", label);
  return out ? output_check(out) : EXIT_DONE;
}

// --- the scene -------------------------------------------------------------------------------------
static ExitCode open_scene(Trace *t, int threads)
{
  const ExitCode code = engine_open(&t->engine, threads, args_text(t->args, "isa"));
  if (code) return code;
  rf_mesh_def def = rf_default_mesh_def();
  def.positions = t->mesh.positions;
  def.triangles = t->mesh.triangles;
  def.vertex_count = t->mesh.vertex_count;
  def.triangle_count = t->mesh.triangle_count;
  t->scene = rf_scene_create(t->engine);
  const char *quality = args_text(t->args, "quality");
  const bool is_best = quality && !strcmp(quality, "best");
  const bool ok = t->scene && rf_set(t->scene, "render.tree", is_best ? "\"best\"" : "\"fast\"") &&
                  (!args_has(t->args, "compact") || rf_set(t->scene, "render.compact", "true"));
  return ok && rf_add_mesh(t->scene, NULL, &def).id ? EXIT_DONE : fail_library(t->engine);
}

static void close_scene(Trace *t)
{
  rf_world_destroy(t->world);
  rf_scene_destroy(t->scene);
  rf_engine_destroy(t->engine);
  t->world = NULL;
  t->scene = NULL;
  t->engine = NULL;
}

// --- build lines -----------------------------------------------------------------------------------
static void print_build(const Trace *t, int threads, const TraceBuild *b)
{
  const double count = (double)t->mesh.triangle_count;
  printf("build,%s,%s,%zu,%s,%d,%.4f,%.4f,%.2f,%.2f,%.1f,", t->label, t->mesh.name, t->mesh.triangle_count,
         t->quality, threads, b->best, b->median, 1e-6 * count / b->best, 1e-6 * count / b->median,
         b->kept_bytes / count);
  if (b->peak_bytes < 0)
    printf("-,");
  else
    printf("%.1f,", b->peak_bytes / count);
  printf("%.4f\n", b->cpu);
}

static ExitCode measure_builds(Trace *t)
{
  const char *threads;
  for (size_t i = 0; (threads = next_or(t->args, "threads", "1", &i));) {
    TraceBuild b;
    const int n = atoi(threads);
    ExitCode code = open_scene(t, n);
    if (!code)
      code = trace_build(t->engine, t->scene, (int)args_integer(t->args, "repeat", 5),
                         args_real(t->args, "time", 0.5), &b);
    close_scene(t);
    if (code) return code;
    print_build(t, n, &b);
    fflush(stdout);
  }
  return EXIT_DONE;
}

// --- ray lines -------------------------------------------------------------------------------------
static void print_rays(const Trace *t, const TraceRun *run, const TraceTimes *times)
{
  const double count = (double)run->rays->count;
  const RayCheck c = ray_file_check(run->rays, run->results, t->mesh.diagonal);
  printf("rays,%s,%s,%s,%s,%s,%d,%zu,%.3f,%.3f,%.1f,%zu,%zu,%zu\n", t->label, t->mesh.name, t->quality,
         run->rays->name, api_names[run->api], run->threads, run->rays->count, 1e-6 * count / times->best,
         1e-6 * count / times->median, 100 * (double)c.hits / count, c.flips, c.far, c.other);
  fflush(stdout); // a line when it is known, also into a pipe
}

static ExitCode measure_rays(const Trace *t, TraceRun *run)
{
  const char *api, *threads;
  for (size_t i = 0; (api = next_or(t->args, "api", "batch", &i));)
    for (size_t k = 0; (threads = next_or(t->args, "threads", "1", &k));) {
      TraceTimes times;
      run->api = strcmp(api, "single") ? TRACE_BATCH : TRACE_SINGLE;
      run->threads = atoi(threads);
      if (!trace_measure(run, (int)args_integer(t->args, "repeat", 5), args_real(t->args, "time", 0.5),
                         &times))
        return fail(EXIT_INTERNAL, "cannot start %d threads", run->threads);
      print_rays(t, run, &times);
    }
  return EXIT_DONE;
}

static ExitCode trace_file(const Trace *t, const char *path)
{
  RayFile rays;
  TraceRun run = {.world = t->world, .rays = &rays};
  const char *out = args_text(t->args, "output");
  ExitCode code = ray_file_read(&rays, path);
  if (!code && rays.triangle_count != t->mesh.triangle_count)
    fprintf(stderr, "note: %s was made for a mesh of %zu triangles, not %zu\n", path, rays.triangle_count,
            t->mesh.triangle_count);
  if (!code && !(run.results = calloc(rays.count, sizeof *run.results)))
    code = fail(EXIT_INTERNAL, "not enough memory for the hits of %zu rays", rays.count);
  if (!code) code = measure_rays(t, &run);
  if (!code && out) code = ray_file_write(&rays, run.results, out);
  free(run.results);
  ray_file_finish(&rays);
  return code;
}

static ExitCode trace_files(Trace *t)
{
  ExitCode code = open_scene(t, 0);
  if (code) return code;
  free(t->mesh.bytes); // the scene has its own; a big mesh need not be in memory twice while we measure
  t->mesh.bytes = NULL;
  t->world = rf_prepare(t->scene, NULL);
  if (!t->world) code = fail_library(t->engine);
  for (size_t i = 1; i < t->args->operand_count && !code; i++) code = trace_file(t, t->args->operands[i]);
  close_scene(t);
  return code;
}

static ExitCode run_trace(const Args *args)
{
  Trace t = {.args = args, .label = args_text(args, "label"), .quality = args_text(args, "quality")};
  if (!t.label) t.label = "rayfold";
  if (!t.quality) t.quality = "fast";
  if (args_has(args, "compact")) t.quality = strcmp(t.quality, "best") ? "compact" : "compact_best";
  ExitCode code = check_command_line(args);
  if (!code) code = mesh_file_read(&t.mesh, args->operands[0]);
  if (!code && args_has(args, "build")) code = measure_builds(&t);
  if (!code && args->operand_count > 1) code = trace_files(&t);
  close_scene(&t);
  mesh_file_finish(&t.mesh);
  return code ? code : stdout_finish("the figures");
}

const Command command_trace = {
    .name = "trace",
    .sentence = "Trace files of rays through a mesh and print how fast that goes.",
    .operands = "MESH [RAYS]...",
    .least = 1,
    .most = 64,
    .operand_kind = OPERAND_FILE,
    .usage = "[--threads N]... [--api NAME]... [--build] [-o HITS] [OPTION]...",
    .text =
        "MESH and RAYS are files of the yardstick in bench/ (.rtm, .rays), which measures Embree on them. "
        "For "
        "each RAYS, "
        "--api and --threads it prints a line of fields divided by commas: rays, label, mesh, quality of the "
        "tree, name of the rays, api, threads, number of rays, million rays a second of the best run and of "
        "the median run, hits in percent, and how the hits differ from those in RAYS: flips (a hit in one, "
        "none "
        "in the other), far (another distance) and other (the same distance on another triangle).\n"
        "A run reads every ray of 32 bytes and writes its result of 16. Threads are tied to processors and "
        "take "
        "4096 rays at a time. With RTB_CPU in the environment, times are the mean processor time of the "
        "threads "
        "instead of wall time: on a machine with other work that is the steadier figure.\n"
        "A build line holds: build, label, mesh, triangles, quality, threads, seconds of the best and of the "
        "median build, the same as million triangles a second, bytes a triangle that the tree keeps, bytes a "
        "triangle that building took at most, and the least processor time of all threads together.",
    .example = "rayfold trace city.rtm city.primary.rays city.bounce.rays --threads 1 --threads 2",
    .options = trace_options,
    .run = run_trace,
};
