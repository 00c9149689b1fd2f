// How fast is a mesh's tree built, and how good is it? Not a test: a tool to run by hand.
//
//   tool_build [-c] [-q fast|best] [-t THREADS] [-n REPEATS] [-i LEVEL] MESH.rtm [RAYS.rays ...]
//
// -c builds a compact tree. For the mesh one line, times being wall time, bytes a triangle kept by the tree and at most
// during the build:
//   build,rayfold,MESH,TRIANGLES,QUALITY,THREADS,BEST s,MEDIAN s,BEST Mtri/s,MEDIAN Mtri/s,KEPT,PEAK,NODE SAH,LEAF SAH
// The cost (SAH) is the expected number of nodes and of leaf blocks a random line through the scene's box visits:
// areas of their boxes over that of the scene's, summed (Goldsmith and Salmon 1987; MacDonald and Booth 1990).
// For each ray file one line, Mrays/s being thread CPU time on one thread:
//   rays,rayfold,MESH,QUALITY,RAYS,NODES a ray,BLOCKS a ray,BEST Mrays/s,FLIPS,FAR
// FLIPS and FAR as the file's stored hits say: hit against miss, and distances that differ by 1e-4 and more.

#include "tests/rtm.h"

#include "accel/traverse.h"
#include "base/mem.h"
#include "render/hot.h"

#include <stdio.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

static const char *const quality_names[] = {"fast", "best"};

typedef struct Options {
  int threads, repeats;
  IsaLevel level;
  TreeOptions tree;
} Options;

static const char *quality(const Options *o)
{
  return o->tree.layout == TREE_COMPACT ? "compact" : quality_names[o->tree.quality];
}

static int by_value(const void *a, const void *b)
{
  const double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

static MeshTree *build(const MeshFile *m, const Options *o, Jobs *jobs)
{
  Err err = {0};
  MeshTree *t = mesh_tree_build(m->positions, m->vertex_count, m->triangles, m->triangle_count, o->tree, jobs,
                                NULL, &err);
  if (!t) die(err.text, m->name);
  return t;
}

// --- cost ---------------------------------------------------------------------------------------

static double lane_area(const Node8 *n, int lane)
{
  const Bounds b = {v3(n->box[0][lane], n->box[2][lane], n->box[4][lane]),
                    v3(n->box[1][lane], n->box[3][lane], n->box[5][lane])};
  return bounds_half_area(&b);
}

static void tree_cost(const MeshTree *t, double *nodes, double *leaves)
{
  const double all = bounds_half_area(&t->bounds);
  *nodes = t->node_count ? 1 : 0;
  *leaves = t->node_count ? 0 : 1;
  for (uint32_t i = 0; i < t->node_count; i++) {
    Node8 space;
    const Node8 *n = mesh_node(t, i, &space);
    for (int lane = 0; lane < 8; lane++) {
      const uint32_t code = n->child[lane];
      if (code == EMPTY_TREE) continue;
      *(code & LEAF_BIT ? leaves : nodes) += lane_area(n, lane) / all;
    }
  }
}

// --- memory -------------------------------------------------------------------------------------

static double status_bytes(const char *key)
{
  char line[256];
  double kilobytes = 0;
  FILE *f = fopen("/proc/self/status", "r");
  while (f && fgets(line, sizeof line, f)) {
    if (!strncmp(line, key, strlen(key))) kilobytes = strtod(line + strlen(key), NULL);
  }
  if (f) fclose(f);
  return 1024 * kilobytes;
}

// Resident memory at its highest during a build, beyond what was there before: in a process of its own.
static double peak_bytes(const MeshFile *m, const Options *o)
{
  int pipe_ends[2];
  double bytes = 0;
  if (pipe(pipe_ends)) return 0;
  const pid_t child = fork();
  if (child == 0) {
    FILE *reset = fopen("/proc/self/clear_refs", "w");
    if (reset) {
      fputs("5", reset);
      fclose(reset);
    }
    const double before = status_bytes("VmRSS:");
    Jobs *jobs = jobs_create(o->threads, NULL);
    MeshTree *t = build(m, o, jobs);
    bytes = status_bytes("VmHWM:") - before;
    mesh_tree_release(t);
    _exit(write(pipe_ends[1], &bytes, sizeof bytes) != sizeof bytes);
  }
  if (child < 0 || read(pipe_ends[0], &bytes, sizeof bytes) != sizeof bytes) bytes = 0;
  waitpid(child, NULL, 0);
  return bytes;
}

// --- rays ---------------------------------------------------------------------------------------

static void measure_rays(const MeshFile *m, MeshTree *tree, const char *path, const Options *o)
{
  RayFile r = read_rays(path);
  const Instance one = {.world_from_object = frame_identity(),
                        .object_from_world = frame_identity(),
                        .mesh = tree,
                        .kind = INSTANCE_MESH,
                        .mask = RAY_ALL,
                        .is_identity = true};
  Accel *a = accel_build(&one, 1, NULL, NULL, NULL);
  const HotTable *hot = hot_table(o->level);
  Hit *hits = mem_alloc(r.count, sizeof *hits);
  uint8_t *blocked = mem_alloc(r.count, sizeof *blocked);
  if (!a || !hits || !blocked) die("no memory", path);

  double best = INFINITY;
  for (int i = 0; i <= o->repeats; i++) { // the first run warms the caches
    const double start = seconds(CLOCK_THREAD_CPUTIME_ID);
    if (r.is_any)
      hot->any_n(a, r.rays, blocked, r.count);
    else
      hot->closest_n(a, r.rays, hits, r.count);
    const double time = seconds(CLOCK_THREAD_CPUTIME_ID) - start;
    if (i && time < best) best = time;
  }

  RayCounters c = {0};
  uint64_t flips = 0, far = 0;
  const double size = sqrt(2 * bounds_half_area(&tree->bounds));
  for (uint64_t i = 0; i < r.count; i++) {
    const Ray ray = {v3_load(r.rays[i].o), v3_load(r.rays[i].d), r.rays[i].tmin, r.rays[i].tmax};
    Hit hit = {0};
    const bool found = r.is_any ? accel_any(a, &ray, RAY_ALL, NULL, NULL, &c)
                                : accel_closest(a, &ray, RAY_ALL, NULL, NULL, &c, &hit);
    const bool expected = r.hits[i].prim != NO_HIT;
    flips += found != expected;
    if (found && expected && !r.is_any)
      far += fabs(hit.t - r.hits[i].t) > 1e-4 * fmax(r.hits[i].t, 1e-3 * size);
  }
  printf("rays,rayfold,%s,%s,%s,%.3f,%.3f,%.3f,%llu,%llu\n", m->name, quality(o), r.name,
         (double)c.nodes / (double)r.count - 1, (double)c.prims / (double)r.count,
         1e-6 * (double)r.count / best, (unsigned long long)flips, (unsigned long long)far);
  fflush(stdout);
  accel_destroy(a);
  mem_free(hits);
  mem_free(blocked);
  mem_free(r.rays);
  mem_free(r.hits);
}

static MeshTree *measure_build(const MeshFile *m, const Options *o)
{
  enum { MOST_REPEATS = 100 };
  double times[MOST_REPEATS];
  const int repeats = o->repeats < MOST_REPEATS ? o->repeats : MOST_REPEATS;
  const double peak = peak_bytes(m, o);
  Jobs *jobs = jobs_create(o->threads, NULL);
  MeshTree *tree = NULL;
  for (int i = 0; i < repeats; i++) {
    mesh_tree_release(tree);
    const double start = seconds(CLOCK_MONOTONIC);
    tree = build(m, o, jobs);
    times[i] = seconds(CLOCK_MONOTONIC) - start;
  }
  qsort(times, (size_t)repeats, sizeof *times, by_value);
  double nodes, leaves;
  tree_cost(tree, &nodes, &leaves);
  const double n = (double)m->triangle_count, median = times[repeats / 2];
  printf("build,rayfold,%s,%.0f,%s,%d,%.4f,%.4f,%.2f,%.2f,%.1f,%.1f,%.3f,%.3f\n", m->name, n, quality(o),
         o->threads, times[0], median, 1e-6 * n / times[0], 1e-6 * n / median,
         (double)mesh_tree_bytes(tree) / n, peak / n, nodes, leaves);
  fflush(stdout);
  jobs_destroy(jobs);
  return tree;
}

static IsaLevel level_named(const char *name)
{
  for (int i = 0; i < ISA_COUNT; i++) {
    if (!strcmp(isa_names[i], name)) return (IsaLevel)i;
  }
  die("no such level", name);
  return ISA_REF;
}

static TreeQuality quality_named(const char *name)
{
  for (int i = TREE_FAST; i <= TREE_BEST; i++) {
    if (!strcmp(quality_names[i], name)) return (TreeQuality)i;
  }
  die("no such quality", name);
  return TREE_FAST;
}

int main(int argc, char **argv)
{
  Options o = {.threads = 1, .repeats = 5, .level = cpu_best_isa()};
  int i;
  while ((i = getopt(argc, argv, "ct:n:i:q:")) != -1) {
    if (i == 'c')
      o.tree.layout = TREE_COMPACT;
    else if (i == 't')
      o.threads = atoi(optarg);
    else if (i == 'n')
      o.repeats = atoi(optarg) > 0 ? atoi(optarg) : 1;
    else if (i == 'q')
      o.tree.quality = quality_named(optarg);
    else if (i == 'i')
      o.level = level_named(optarg);
    else
      return 64;
  }
  if (optind >= argc) {
    die("usage: [-c] [-q fast|best] [-t THREADS] [-n REPEATS] [-i LEVEL] MESH.rtm [RAYS.rays ...]", argv[0]);
  }
  MeshFile m = read_mesh(argv[optind++]);
  MeshTree *tree = measure_build(&m, &o);
  for (; optind < argc; optind++) measure_rays(&m, tree, argv[optind], &o);
  mesh_tree_release(tree);
  mem_free(m.positions);
  mem_free(m.triangles);
  return 0;
}
