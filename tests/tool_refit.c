// What does it cost to follow moved vertices, and how good is the tree then? Not a test: a tool to run by hand.
//
//   tool_refit [-t THREADS] [-n REPEATS] [-w MOST_WEAR] MESH.rtm [RAYS.rays ...]
//
// For each way of moving the vertices, and each way to a tree of what comes of it, one line:
//   refit,MESH,TRIANGLES,MOVED,HOW,THREADS,BEST s of wall time,BEST s of all threads,BEST Mtri/s,REBUILT
// The second time is the processor's. HOW: "build" from nothing, "boxes" a refit that builds nothing anew, "refit".
// REBUILT: share of the triangles whose part was built anew. For each ray file, which keeps its rays while the mesh
// changes, one line more:
//   rays,MESH,MOVED,HOW,RAYS,NODES a ray,BLOCKS a ray

#include "tests/rtm.h"

#include "accel/refit.h"
#include "accel/traverse.h"

#include <unistd.h>

typedef enum Move { ONE, WAVE, TWIST_45, TWIST_180, CRUMPLE_2, CRUMPLE_10, SPLASH, MOVE_COUNT } Move;
static const char *const move_names[MOVE_COUNT] = {"one vertex",  "wave 1 %",     "twist 45", "twist 180",
                                                   "crumple 2 %", "crumple 10 %", "splash"};

typedef enum How { BUILD, BOXES, REFIT, HOW_COUNT } How;
static const char *const how_names[HOW_COUNT] = {"build", "boxes", "refit"};

typedef struct Options {
  int threads, repeats;
  float most_wear;
} Options;

// --- moving ---------------------------------------------------------------------------------------

typedef struct Extent {
  Vec3 lo, hi, middle, size;
  float largest;
} Extent;

static Extent extent_of(const MeshFile *m)
{
  Bounds b = bounds_empty();
  for (uint64_t i = 0; i < m->vertex_count; i++) bounds_add_point(&b, v3_load(m->positions + 3 * i));
  return (Extent){b.lo, b.hi, (b.lo + b.hi) / 2, b.hi - b.lo, v3_max_lane(b.hi - b.lo)};
}

static Vec3 twisted(const Extent *e, Vec3 u, float turn)
{
  const float angle = turn * u[1], c = cosf(angle), s = sinf(angle);
  return e->middle + e->largest * v3(c * u[0] + s * u[2], u[1], c * u[2] - s * u[0]);
}

// Short waves: neighbours part, and what was apart overlaps.
static Vec3 crumple(const Extent *e, Vec3 u)
{
  return e->largest * v3(sinf(97 * u[1] + 61 * u[2]), sinf(83 * u[2] + 71 * u[0]), sinf(89 * u[0] + 67 * u[1]));
}

static Vec3 moved(Move move, const Extent *e, Vec3 p, uint64_t i)
{
  const Vec3 u = (p - e->middle) / e->largest; // within -0.5 and 0.5
  const float from = v3_length(u - v3(0.2f, 0.1f, 0.1f));
  switch (move) {
  case ONE: return i == 0 ? p + v3_all(0.01f * e->largest) : p;
  case WAVE: return p + 0.01f * e->largest * v3(sinf(20 * u[1]), sinf(20 * u[2] + 1), sinf(20 * u[0] + 2));
  case TWIST_45: return twisted(e, u, PI / 4);
  case TWIST_180: return twisted(e, u, PI);
  case CRUMPLE_2: return p + 0.02f * crumple(e, u);
  case CRUMPLE_10: return p + 0.1f * crumple(e, u);
  case SPLASH: return from < 0.2f ? p + (1 - 5 * from) * 0.1f * crumple(e, u) : p; // the same in one place
  case MOVE_COUNT: break;
  }
  return p;
}

static float *moved_positions(const MeshFile *m, Move move)
{
  const Extent e = extent_of(m);
  float *positions = mem_alloc(3 * m->vertex_count, sizeof *positions);
  if (!positions) die("no memory", m->name);
  for (uint64_t i = 0; i < m->vertex_count; i++)
    v3_store(positions + 3 * i, moved(move, &e, v3_load(m->positions + 3 * i), i));
  return positions;
}

// --- measuring ------------------------------------------------------------------------------------

static MeshTree *make(How how, Refit *r, float most_wear)
{
  const MeshArrays *m = &r->mesh;
  if (how == BUILD)
    return mesh_tree_build(m->positions, m->vertex_count, m->triangles, m->triangle_count, (TreeOptions){0}, r->jobs, NULL, NULL);
  r->most_wear = how == BOXES ? INFINITY : most_wear;
  return refit_run(r, NULL);
}

static MeshTree *measure_tree(const MeshFile *m, const MeshTree *old, const float *positions, Move move, How how,
                              const Options *o)
{
  Jobs *jobs = jobs_create(o->threads, NULL);
  MeshTree *tree = NULL;
  Refit r;
  double wall = INFINITY, cpu = INFINITY;
  for (int i = 0; i < o->repeats; i++) {
    mesh_tree_release(tree);
    r = (Refit){.old = old, .mesh = {positions, m->vertex_count, m->triangles, m->triangle_count}, .jobs = jobs};
    const double start = seconds(CLOCK_MONOTONIC), cpu_start = seconds(CLOCK_PROCESS_CPUTIME_ID);
    tree = make(how, &r, o->most_wear);
    const double cpu_time = seconds(CLOCK_PROCESS_CPUTIME_ID) - cpu_start, time = seconds(CLOCK_MONOTONIC) - start;
    if (!tree) die("no memory", m->name);
    if (time < wall) wall = time;
    if (cpu_time < cpu) cpu = cpu_time;
  }
  const double n = (double)m->triangle_count;
  printf("refit,%s,%.0f,%s,%s,%d,%.5f,%.5f,%.2f,%.3f\n", m->name, n, move_names[move], how_names[how], o->threads, wall,
         cpu, 1e-6 * n / wall, how == BUILD ? 1 : (double)r.rebuilt_count / n);
  fflush(stdout);
  jobs_destroy(jobs);
  return tree;
}

static void measure_rays(const MeshFile *m, MeshTree *tree, const RayFile *rays, Move move, How how)
{
  const Instance one = {.world_from_object = frame_identity(), .object_from_world = frame_identity(), .mesh = tree,
                        .kind = INSTANCE_MESH, .mask = RAY_ALL, .is_identity = true};
  Accel *a = accel_build(&one, 1, NULL, NULL, NULL);
  if (!a) die("no memory", m->name);
  RayCounters c = {0};
  const uint64_t step = rays->count > 200000 ? rays->count / 200000 : 1;
  uint64_t traced = 0;
  for (uint64_t i = 0; i < rays->count; i += step, traced++) {
    const Ray ray = ray_unpack(&rays->rays[i]);
    Hit hit;
    if (rays->is_any) accel_any(a, &ray, RAY_ALL, NULL, NULL, &c);
    else accel_closest(a, &ray, RAY_ALL, NULL, NULL, &c, &hit);
  }
  printf("rays,%s,%s,%s,%s,%.3f,%.3f\n", m->name, move_names[move], how_names[how], rays->name,
         (double)c.nodes / (double)traced, (double)c.prims / (double)traced);
  fflush(stdout);
  accel_destroy(a);
}

int main(int argc, char **argv)
{
  enum { MOST_RAY_FILES = 16 };
  Options o = {1, 5, MOST_WEAR};
  int i;
  while ((i = getopt(argc, argv, "t:n:w:")) != -1) {
    if (i == 't') o.threads = atoi(optarg);
    else if (i == 'n') o.repeats = atoi(optarg) > 0 ? atoi(optarg) : 1;
    else if (i == 'w') o.most_wear = (float)atof(optarg);
    else return 64;
  }
  if (optind >= argc) die("usage: [-t THREADS] [-n REPEATS] [-w MOST_WEAR] MESH.rtm [RAYS.rays ...]", argv[0]);
  MeshFile m = read_mesh(argv[optind++]);
  RayFile rays[MOST_RAY_FILES];
  int ray_files = 0;
  for (; optind < argc && ray_files < MOST_RAY_FILES; optind++) rays[ray_files++] = read_rays(argv[optind]);
  MeshTree *old = mesh_tree_build(m.positions, m.vertex_count, m.triangles, m.triangle_count, (TreeOptions){0}, NULL, NULL, NULL);
  if (!old) die("no memory", m.name);
  for (int move = 0; move < MOVE_COUNT; move++) {
    float *positions = moved_positions(&m, (Move)move);
    for (int how = 0; how < HOW_COUNT; how++) {
      MeshTree *t = measure_tree(&m, old, positions, (Move)move, (How)how, &o);
      for (int k = 0; k < ray_files; k++) measure_rays(&m, t, &rays[k], (Move)move, (How)how);
      mesh_tree_release(t);
    }
    mem_free(positions);
  }
  mesh_tree_release(old);
  mem_free(m.positions);
  mem_free(m.triangles);
  for (i = 0; i < ray_files; i++) {
    mem_free(rays[i].rays);
    mem_free(rays[i].hits);
  }
  return 0;
}
