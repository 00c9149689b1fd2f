// `rayfold bench`: measures this machine. `bench tree` climbs the ladder of bench/ladder/, the history of finding what
// a ray hits; the rungs are compiled into this program and not into the library, because then there is nothing to
// find and start, and one table of options, one help and one way of failing.

#include "commands.h"
#include "library.h"
#include "output.h"
#include "ray_file.h"

#include "ladder.h"
#include "ray_sets.h"
#include "room.h"

#include <stdlib.h>
#include <string.h>

static const Option bench_options[] = {
    {.name = "time",
     .kind = OPTION_REAL,
     .argument = "S",
     .initial = "1",
     .low = 0,
     .high = 3600,
     .sentence =
         "Seconds for each rung and each set of rays. A slow rung is given every so manieth ray, so that two "
         "runs fit."},
    {.name = "size",
     .kind = OPTION_INTEGER,
     .argument = "N",
     .initial = "512",
     .low = 8,
     .high = 4096,
     .sentence = "Width and height of the picture whose rays are traced, when no RAYS are given."},
    {.name = "output",
     .letter = 'o',
     .kind = OPTION_FILE,
     .argument = "OUT.svg",
     .sentence = "Also draw the graph into a file."},
    OPTION_QUIET("No table and no bars: only whether all rungs agree, and OUT."),
    {0},
};

typedef struct Bench { // all that one run owns
  const Args *args;
  bool is_quiet;
  MeshFile file;   // of a mesh that was given
  MeshOut made;    // or of our own
  LadderMesh mesh; // either
  const char *mesh_name;
  RayFile files[LADDER_SETS]; // of rays that were given
  rtb_rays sets_made[2];      // or of our own
  LadderSet sets[LADDER_SETS];
  Ladder ladder;
} Bench;

static ExitCode fail_memory(void)
{
  return fail(EXIT_INTERNAL, "not enough memory for the ladder; try a smaller mesh");
}

// --- meshes and rays that were given ---------------------------------------------------------------
static ExitCode read_mesh(Bench *b, const char *path)
{
  const ExitCode code = mesh_file_read(&b->file, path);
  if (code) return code;
  if (b->file.triangle_count >> 28)
    return fail(EXIT_BAD_SCENE, "%s: more triangles than the ladder counts to", path);
  if (!(b->file.diagonal < 1e15f))
    return fail(EXIT_BAD_SCENE, "%s: larger than the ladder can calculate with", path);
  b->mesh = (LadderMesh){b->file.positions, b->file.triangles, (uint32_t)b->file.vertex_count,
                         (uint32_t)b->file.triangle_count};
  b->mesh_name = b->file.name;
  return EXIT_DONE;
}

static ExitCode read_rays(Bench *b, const char *path, size_t s)
{
  RayFile *f = &b->files[s];
  const ExitCode code = ray_file_read(f, path);
  if (code) return code;
  if (f->is_any) return fail(EXIT_BAD_SCENE, "%s: asks for any hit; the ladder finds the nearest", path);
  b->sets[s] = (LadderSet){f->name, (const LadderRay *)(const void *)f->rays, f->count};
  b->ladder.set_count = s + 1;
  return EXIT_DONE;
}

static ExitCode read_files(Bench *b)
{
  const Args *a = b->args;
  ExitCode code = read_mesh(b, a->operands[1]);
  for (size_t i = 2; i < a->operand_count && !code; i++) code = read_rays(b, a->operands[i], i - 2);
  return code;
}

// --- or our own: the hall of bench/room.h, camera rays and what they bounce into --------------------
static ExitCode find_hits(const LadderMesh *mesh, rtb_rays *r)
{
  size_t bytes;
  LadderCounts counts = {0};
  void *tree = rung_library.build(mesh, &bytes);
  LadderHit *hits = malloc(r->h.nrays * sizeof *hits);
  if (tree && hits) {
    rung_library.closest(tree, (const LadderRay *)(const void *)r->ray, hits, r->h.nrays, &counts);
    for (uint64_t i = 0; i < r->h.nrays; i++) r->ref[i] = (rtb_hit){.t = hits[i].t, .prim = hits[i].prim};
  }
  const bool ok = tree && hits;
  free(hits);
  rung_library.destroy(tree);
  return ok ? EXIT_DONE : fail_memory();
}

static ExitCode make_rays(Bench *b)
{
  const int size = (int)args_integer(b->args, "size", 512);
  const RayCamera camera = {
      {0.7f, 1.8f, 3.2f}, {9, 1.3f, 6.2f}, {0, 1, 0}, {7.6f, 4.2f, 4.6f}, 62, size, size};
  rtb_rays *primary = &b->sets_made[0], *bounce = &b->sets_made[1];
  ray_set_primary(&camera, primary);
  ray_set_name(primary, "camera rays", RTB_CLOSEST, true, &b->made.mesh);
  const ExitCode code = find_hits(&b->mesh, primary);
  if (code) return code;
  const RaySetFrom from = {&b->made.mesh, primary, 1, RAY_COSINE, 2, camera.light};
  ray_set_secondary(&from, bounce);
  ray_set_name(bounce, "bounced rays", RTB_CLOSEST, false, &b->made.mesh);
  for (size_t s = 0; s < 2; s++)
    b->sets[s] = (LadderSet){b->sets_made[s].h.name, (const LadderRay *)(const void *)b->sets_made[s].ray,
                             b->sets_made[s].h.nrays};
  b->ladder.set_count = 2;
  return EXIT_DONE;
}

static ExitCode make_all(Bench *b)
{
  enum { DETAIL = 19 };
  room_make(&b->made, DETAIL);
  rtb_mesh_bounds(&b->made.mesh);
  const rtb_mesh *m = &b->made.mesh;
  b->mesh = (LadderMesh){m->verts, m->idx, (uint32_t)m->nverts, (uint32_t)m->ntris};
  b->mesh_name = "a furnished hall";
  return make_rays(b);
}

// --- the run ---------------------------------------------------------------------------------------
static void said(void *user, const Ladder *l, size_t rung)
{
  const Bench *b = user;
  if (!b->is_quiet) ladder_table_row(stdout, l, rung);
}

static void print_head(const Bench *b)
{
  printf("%s, %u triangles; one thread, processor time. Boxes and triangles are tests a ray;\n"
         "a test that answers for several at once counts as one.\n\n",
         b->mesh_name, b->mesh.triangle_count);
  ladder_table_head(stdout, &b->ladder);
}

// Slow rungs get some of the rays only.
static void print_shares(const Ladder *l, size_t s)
{
  const char *gap = "";
  for (size_t i = 0; i < l->rung_count; i++) {
    if (l->results[i].on[s].rays == l->sets[s].count) continue;
    if (!*gap) printf("Of %zu %s rungs got only: ", l->sets[s].count, l->sets[s].name);
    printf("%s%zu: %zu", gap, i + 1, l->results[i].on[s].rays);
    gap = ", ";
  }
  if (*gap) puts(".");
}

static void print_tail(const Bench *b)
{
  const Ladder *l = &b->ladder;
  fputc('\n', stdout);
  for (size_t i = 0; i < l->rung_count; i++)
    printf("%2zu %-21s%s\n", i + 1, l->results[i].rung->name, l->results[i].rung->gain);
  fputc('\n', stdout);
  for (size_t s = 0; s < l->set_count; s++) print_shares(l, s);
  ladder_bars(stdout, l);
}

static ExitCode print_agreement(const Bench *b)
{
  const Ladder *l = &b->ladder;
  size_t compared = 0, differing = 0;
  for (size_t i = 0; i < l->rung_count; i++)
    for (size_t s = 0; s < l->set_count; s++) {
      const RungOnSet *on = &l->results[i].on[s];
      compared += on->compared;
      differing += on->differing;
      if (on->differing)
        printf("\"%s\" differs from the rung before in %zu of %zu %s.\n", l->results[i].rung->name,
               on->differing, on->compared, l->sets[s].name);
    }
  if (!ladder_agrees(l))
    return fail(EXIT_INTERNAL, "the rungs do not find the same hits: one of them is wrong");
  printf("\nAll rungs find the same hits: %zu of %zu compared are equal.\n", compared - differing, compared);
  return EXIT_DONE;
}

static ExitCode write_graph(const Bench *b, const char *path)
{
  char *text = NULL, title[120];
  size_t size = 0;
  FILE *out = open_memstream(&text, &size);
  if (!out) return fail_memory();
  snprintf(title, sizeof title, "Rays a second, step by step: %.40s, %u triangles, one thread", b->mesh_name,
           b->mesh.triangle_count);
  ladder_svg(out, &b->ladder, title);
  const bool failed = ferror(out);
  const ExitCode code = fclose(out) || failed ? fail_memory() : output_write(path, text, size);
  free(text);
  return code;
}

static void bench_finish(Bench *b)
{
  mesh_file_finish(&b->file);
  free(b->made.mesh.verts);
  free(b->made.mesh.idx);
  for (int i = 0; i < LADDER_SETS; i++) ray_file_finish(&b->files[i]);
  for (int i = 0; i < 2; i++) rtb_rays_free(&b->sets_made[i]);
}

static ExitCode check_command_line(const Args *a)
{
  const char *out = args_text(a, "output");
  if (strcmp(a->operands[0], "tree"))
    return fail(EXIT_USAGE, "there is no bench \"%s\"; there is tree", a->operands[0]);
  if (a->operand_count == 2)
    return fail(EXIT_USAGE, "bench tree %s needs RAYS for this mesh, too", a->operands[1]);
  if (!ladder_can_run()) return fail(EXIT_USAGE, "bench tree needs AVX2, which this processor has not");
  return out ? output_check(out) : EXIT_DONE;
}

static ExitCode run_bench(const Args *args)
{
  ExitCode code = check_command_line(args);
  if (code) return code;
  const char *out = args_text(args, "output");
  Bench b = {.args = args, .is_quiet = args_has(args, "quiet")};
  b.ladder.mesh = &b.mesh;
  b.ladder.sets = b.sets;
  code = args->operand_count > 1 ? read_files(&b) : make_all(&b);
  if (!code && !b.is_quiet) print_head(&b);
  if (!code && !ladder_run(&b.ladder, args_real(args, "time", 1), said, &b)) code = fail_memory();
  if (!code && !b.is_quiet) print_tail(&b);
  if (!code) code = print_agreement(&b);
  if (!code && out) code = write_graph(&b, out);
  bench_finish(&b);
  return code ? code : stdout_finish("the table");
}

const Command command_bench = {
    .name = "bench",
    .sentence = "Measure on this machine what each step in the history of ray casting buys.",
    .operands = "tree [MESH RAYS...]",
    .least = 1,
    .most = 2 + LADDER_SETS,
    .operand_kind = OPERAND_FILE,
    .usage = "[--time S] [-o OUT.svg] [OPTION]...",
    .text =
        "Eleven programs answer the same question, which triangle does a ray hit first, from a list of all "
        "triangles to the library itself, and must all find the same hits. Printed are for each the time to "
        "build, the bytes a triangle, and for each set of rays how many a second and how many boxes and "
        "triangles "
        "are tested for one. docs/tree.md tells what each step is.\n"
        "Without MESH and RAYS (files as `rayfold trace` reads them) they trace a furnished hall of 106,344 "
        "triangles: the rays of a camera, and what bounces off where those hit.",
    .example = "rayfold bench tree -o tree.svg",
    .options = bench_options,
    .run = run_bench,
};
