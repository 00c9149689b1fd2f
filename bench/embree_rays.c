// Embree rays: how fast does Embree build and trace, on fixed sets of rays? Also makes the sets, with Embree's robust
// mode finding the reference hits. Builds against Embree 3 (Debian's libembree-dev), or with -DEMBREE4 against 4.
// Usage below; the lines it prints are described in README.md.

#define _GNU_SOURCE
#include "ray_sets.h"

#ifdef EMBREE4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif
#include <pmmintrin.h>
#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <xmmintrin.h>

static const char usage[] =
    "usage: embree_rays [OPTION]... MESH COMMAND\n"
    "  gen CAM PREFIX       write PREFIX.{primary,shadow,bounce,ao,bounce2,chords}.rays\n"
    "  view CAM OUT.ppm     a picture shaded by normals, to check the camera\n"
    "  build                time and memory of building, in three qualities\n"
    "  rays FILE.rays...    Mrays/s for each file, interface and count of threads\n"
    "options:\n"
    "  -q low|medium|high   quality of the tree (medium)\n"
    "  -r                   robust scene flag\n"
    "  -k                   compact scene flag\n"
    "  -t 1,2               counts of threads (1,2)\n"
    "  -a 1,4,8,16,m        interfaces: single rays, packets, m: stream of 256, Embree 3 only (1,8,16,m)\n"
    "  -n RUNS              at least so many runs (5)\n"
    "  -s SECONDS           and so much time for each line (0.5)\n"
    "  -c 0|1|auto          coherent flag (auto: what the ray file says)\n"
    "  -d CONFIG            text for rtcNewDevice, as isa=avx2\n"
    "  -l LABEL             first field of the lines (embree)\n";

enum { MOST_THREADS = 64, MOST_RUNS = 1000, CHUNK = 4096 };

static struct Settings {
  const char *config, *label, *mesh_name, *apis;
  enum RTCBuildQuality quality;
  int scene_flags, runs, coherent; // coherent -1: what the file says
  int threads[16], thread_count;
  double seconds;
} settings = {.config = "",
              .label = "embree",
              .apis = "1,8,16,m",
              .quality = RTC_BUILD_QUALITY_MEDIUM,
              .runs = 5,
              .coherent = -1,
              .threads = {1, 2},
              .thread_count = 2,
              .seconds = 0.5};

static const char *quality_name(void)
{
  switch (settings.quality) {
  case RTC_BUILD_QUALITY_LOW: return "low";
  case RTC_BUILD_QUALITY_HIGH: return "high";
  default: return "medium";
  }
}

// --- device and scene ------------------------------------------------------------------------------
static atomic_llong memory_now, memory_peak;

static bool count_memory(void *user, ssize_t bytes, bool post)
{
  (void)user, (void)post;
  const long long now = atomic_fetch_add(&memory_now, bytes) + bytes;
  long long peak = atomic_load(&memory_peak);
  while (now > peak && !atomic_compare_exchange_weak(&memory_peak, &peak, now)) {}
  return true;
}

static void say_error(void *user, enum RTCError e, const char *text)
{
  (void)user;
  fprintf(stderr, "embree error %d: %s\n", e, text);
}

static RTCDevice new_device(int threads)
{
  char config[512];
  snprintf(config, sizeof config, "threads=%d,%s", threads, settings.config);
  RTCDevice d = rtcNewDevice(config);
  if (!d) {
    fprintf(stderr, "Embree makes no device of \"%s\"\n", config);
    exit(70);
  }
  rtcSetDeviceErrorFunction(d, say_error, NULL);
  rtcSetDeviceMemoryMonitorFunction(d, count_memory, NULL);
  return d;
}

// Only the commit is timed: the mesh's arrays are shared.
static RTCScene build(RTCDevice d, const rtb_mesh *m, double *seconds)
{
  RTCScene s = rtcNewScene(d);
  rtcSetSceneBuildQuality(s, settings.quality);
  rtcSetSceneFlags(s, (enum RTCSceneFlags)settings.scene_flags);
  RTCGeometry g = rtcNewGeometry(d, RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetGeometryBuildQuality(g, settings.quality);
  rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, m->verts, 0, 12, m->nverts);
  rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, m->idx, 0, 12, m->ntris);
  rtcCommitGeometry(g);
  rtcAttachGeometry(s, g);
  rtcReleaseGeometry(g);
  const double start = rtb_now();
  rtcCommitScene(s);
  if (seconds) *seconds = rtb_now() - start;
  return s;
}

// --- the two generations of the interface ----------------------------------------------------------
typedef struct Context {
#ifdef EMBREE4
  struct RTCIntersectArguments intersect;
  struct RTCOccludedArguments occluded;
#else
  struct RTCIntersectContext context;
#endif
} Context;

static void context_init(Context *c, bool coherent)
{
#ifdef EMBREE4
  rtcInitIntersectArguments(&c->intersect);
  rtcInitOccludedArguments(&c->occluded);
  c->intersect.flags = c->occluded.flags =
      coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
  c->intersect.feature_mask = c->occluded.feature_mask = RTC_FEATURE_FLAG_TRIANGLE;
#else
  rtcInitIntersectContext(&c->context);
  c->context.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
#endif
}

#ifdef EMBREE4
#define INTERSECT(n, scene, c, r, ...) rtcIntersect##n(__VA_ARGS__ scene, r, &(c)->intersect)
#define OCCLUDED(n, scene, c, r, ...)  rtcOccluded##n(__VA_ARGS__ scene, r, &(c)->occluded)
#else
#define INTERSECT(n, scene, c, r, ...) rtcIntersect##n(__VA_ARGS__ scene, &(c)->context, r)
#define OCCLUDED(n, scene, c, r, ...)  rtcOccluded##n(__VA_ARGS__ scene, &(c)->context, r)
#endif
#define COMMA ,

static inline void set_ray(struct RTCRay *r, const rtb_ray *q)
{
  r->org_x = q->ox;
  r->org_y = q->oy;
  r->org_z = q->oz;
  r->tnear = q->tmin;
  r->dir_x = q->dx;
  r->dir_y = q->dy;
  r->dir_z = q->dz;
  r->tfar = q->tmax;
  r->time = 0;
  r->mask = UINT32_MAX;
  r->id = 0;
  r->flags = 0;
}

static inline void set_ray_hit(struct RTCRayHit *h, const rtb_ray *q)
{
  set_ray(&h->ray, q);
  h->hit.geomID = RTC_INVALID_GEOMETRY_ID;
  h->hit.primID = RTB_MISS;
  h->hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
}

static inline rtb_hit closest_result(const struct RTCRayHit *h)
{
  const bool is_hit = h->hit.geomID != RTC_INVALID_GEOMETRY_ID;
  return (rtb_hit){h->ray.tfar, is_hit ? h->hit.primID : RTB_MISS, h->hit.u, h->hit.v};
}

// Embree marks a ray that is blocked by tfar = -inf.
static inline rtb_hit any_result(float tfar)
{
  return (rtb_hit){tfar, tfar < 0 ? 0 : RTB_MISS, 0, 0};
}

// --- a chunk of rays by each interface -------------------------------------------------------------
typedef void TraceChunk(RTCScene s, Context *c, rtb_query query, const rtb_ray *q, rtb_hit *out, size_t n);

static void trace_single(RTCScene s, Context *c, rtb_query query, const rtb_ray *q, rtb_hit *out, size_t n)
{
  if (query == RTB_CLOSEST)
    for (size_t i = 0; i < n; i++) {
      struct RTCRayHit h;
      set_ray_hit(&h, q + i);
      INTERSECT(1, s, c, &h, );
      out[i] = closest_result(&h);
    }
  else
    for (size_t i = 0; i < n; i++) {
      struct RTCRay r;
      set_ray(&r, q + i);
      OCCLUDED(1, s, c, &r, );
      out[i] = any_result(r.tfar);
    }
}

// A packet's rays past the end are copies of its first, and not valid.
#define TRACE_PACKET(N)                                                                                   \
  static void trace_packet##N(RTCScene s, Context *c, rtb_query query, const rtb_ray *q, rtb_hit *out,    \
                              size_t n)                                                                   \
  {                                                                                                       \
    for (size_t i = 0; i < n; i += N) {                                                                   \
      struct RTCRayHit##N h;                                                                              \
      int valid[N] __attribute__((aligned(64)));                                                          \
      for (size_t k = 0; k < N; k++) {                                                                    \
        const rtb_ray *p = q + (i + k < n ? i + k : i);                                                   \
        valid[k] = i + k < n ? -1 : 0;                                                                    \
        h.ray.org_x[k] = p->ox, h.ray.org_y[k] = p->oy, h.ray.org_z[k] = p->oz, h.ray.tnear[k] = p->tmin; \
        h.ray.dir_x[k] = p->dx, h.ray.dir_y[k] = p->dy, h.ray.dir_z[k] = p->dz, h.ray.tfar[k] = p->tmax;  \
        h.ray.time[k] = 0, h.ray.mask[k] = UINT32_MAX, h.ray.id[k] = 0, h.ray.flags[k] = 0;               \
        h.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID, h.hit.primID[k] = RTB_MISS;                            \
        h.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;                                                     \
      }                                                                                                   \
      if (query == RTB_CLOSEST)                                                                           \
        INTERSECT(N, s, c, &h, valid COMMA);                                                              \
      else                                                                                                \
        OCCLUDED(N, s, c, &h.ray, valid COMMA);                                                           \
      for (size_t k = 0; k < N && i + k < n; k++) {                                                       \
        const bool is_hit = h.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID;                                   \
        out[i + k] = query == RTB_ANY ? any_result(h.ray.tfar[k])                                         \
                                      : (rtb_hit){h.ray.tfar[k], is_hit ? h.hit.primID[k] : RTB_MISS,     \
                                                  h.hit.u[k], h.hit.v[k]};                                \
      }                                                                                                   \
    }                                                                                                     \
  }
TRACE_PACKET(4)
TRACE_PACKET(8)
TRACE_PACKET(16)

#ifdef EMBREE4
#define trace_stream trace_single // Embree 4 has no streams
#else
static void trace_stream(RTCScene s, Context *c, rtb_query query, const rtb_ray *q, rtb_hit *out, size_t n)
{
  enum { BATCH = 256 };
  struct RTCRayHit h[BATCH];
  for (size_t i = 0; i < n; i += BATCH) {
    const unsigned m = (unsigned)(n - i < BATCH ? n - i : BATCH);
    for (unsigned k = 0; k < m; k++) set_ray_hit(&h[k], q + i + k);
    if (query == RTB_CLOSEST)
      rtcIntersect1M(s, &c->context, h, m, sizeof *h);
    else
      rtcOccluded1M(s, &c->context, &h[0].ray, m, sizeof *h);
    for (unsigned k = 0; k < m; k++)
      out[i + k] = query == RTB_ANY ? any_result(h[k].ray.tfar) : closest_result(&h[k]);
  }
}
#endif

static const struct Api {
  const char *letter, *name;
  TraceChunk *trace;
} apis[] = {{"1", "single", trace_single},
            {"4", "packet4", trace_packet4},
            {"8", "packet8", trace_packet8},
            {"16", "packet16", trace_packet16},
            {"m", "stream", trace_stream}};

// --- threads: chunks off one counter ---------------------------------------------------------------
typedef struct Worker {
  RTCScene scene;
  const rtb_rays *rays;
  rtb_hit *out;
  TraceChunk *trace;
  bool coherent;
  int cpu;
  atomic_size_t *next;
  double busy; // seconds of processor time
} Worker;

static void *work(void *user)
{
  Worker *w = user;
  cpu_set_t set;
  CPU_ZERO(&set);
  CPU_SET(w->cpu, &set);
  sched_setaffinity(0, sizeof set, &set); // of this thread; failure is harmless
  _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
  _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
  Context c;
  context_init(&c, w->coherent);
  const double start = rtb_cpu();
  const size_t n = w->rays->h.nrays;
  for (size_t i; (i = atomic_fetch_add(w->next, CHUNK)) < n;)
    w->trace(w->scene, &c, (rtb_query)w->rays->h.query, w->rays->ray + i, w->out + i,
             n - i < CHUNK ? n - i : CHUNK);
  w->busy = rtb_cpu() - start;
  return NULL;
}

static double run(RTCScene s, const rtb_rays *r, rtb_hit *out, TraceChunk *trace, int threads)
{
  pthread_t th[MOST_THREADS];
  Worker w[MOST_THREADS];
  atomic_size_t next = 0;
  double busy = 0;
  const bool coherent = settings.coherent < 0 ? r->h.coherent != 0 : settings.coherent != 0;
  const double start = rtb_now();
  for (int i = 0; i < threads; i++) {
    w[i] = (Worker){s, r, out, trace, coherent, i, &next, 0};
    if (pthread_create(&th[i], NULL, work, &w[i])) {
      fprintf(stderr, "cannot start %d threads\n", threads);
      exit(70);
    }
  }
  for (int i = 0; i < threads; i++) {
    pthread_join(th[i], NULL);
    busy += w[i].busy / threads;
  }
  return rtb_by_cpu() ? busy : rtb_now() - start;
}

// --- making the ray sets ---------------------------------------------------------------------------
static void find_hits(RTCScene s, rtb_rays *r)
{
  Context c;
  context_init(&c, false);
  trace_single(s, &c, (rtb_query)r->h.query, r->ray, r->ref, r->h.nrays);
}

static bool write_set(const char *prefix, const rtb_rays *r)
{
  char path[1024];
  uint64_t hits = 0;
  for (uint64_t i = 0; i < r->h.nrays; i++) hits += r->ref[i].prim != RTB_MISS;
  snprintf(path, sizeof path, "%s.%s.rays", prefix, r->h.name);
  if (!rtb_rays_write(path, r)) return false;
  printf("%s: %llu rays, %.1f%% hit\n", path, (unsigned long long)r->h.nrays,
         r->h.nrays ? 100.0 * (double)hits / (double)r->h.nrays : 0);
  return true;
}

typedef struct SetPlan {
  const char *name;
  int source; // of the sets before; -1: none
  uint32_t stride, seed;
  RayKind kind;
  rtb_query query;
  bool is_coherent;
} SetPlan;

static int generate(const rtb_mesh *m, const char *camera, const char *prefix)
{
  enum { SETS = 6 };
  static const SetPlan plans[SETS] = {{"primary", -1, 1, 0, RAY_COSINE, RTB_CLOSEST, true},
                                      {"shadow", 0, 4, 1, RAY_TO_LIGHT, RTB_ANY, true},
                                      {"bounce", 0, 4, 2, RAY_COSINE, RTB_CLOSEST, false},
                                      {"ao", 0, 4, 3, RAY_NEAR, RTB_ANY, false},
                                      {"bounce2", 2, 1, 5, RAY_COSINE, RTB_CLOSEST, false},
                                      {"chords", -1, 1, 4, RAY_COSINE, RTB_CLOSEST, false}};
  RayCamera c;
  rtb_rays sets[SETS] = {0};
  if (!ray_camera_read(camera, &c)) return 65;
  settings.scene_flags = RTC_SCENE_FLAG_ROBUST;
  RTCDevice d = new_device(2);
  RTCScene s = build(d, m, NULL);
  bool ok = true;
  for (int i = 0; i < SETS && ok; i++) {
    const SetPlan *p = &plans[i];
    if (p->source >= 0) {
      const RaySetFrom from = {m, &sets[p->source], p->stride, p->kind, p->seed, c.light};
      ray_set_secondary(&from, &sets[i]);
    } else if (i == 0) {
      ray_set_primary(&c, &sets[i]);
    } else {
      ray_set_chords(m, 262144, &sets[i]);
    }
    ray_set_name(&sets[i], p->name, p->query, p->is_coherent, m);
    find_hits(s, &sets[i]);
    ok = write_set(prefix, &sets[i]);
  }
  for (int i = 0; i < SETS; i++) rtb_rays_free(&sets[i]);
  rtcReleaseScene(s);
  rtcReleaseDevice(d);
  return ok ? 0 : 73;
}

// --- a look through the camera ---------------------------------------------------------------------
static void shade(const rtb_mesh *m, const rtb_rays *r, uint64_t i, bool is_lit, unsigned char pixel[3])
{
  rtb_v3 n;
  const rtb_ray *q = &r->ray[i];
  pixel[0] = 90, pixel[1] = 130, pixel[2] = 190;
  if (r->ref[i].prim == RTB_MISS || !ray_normal(m, r->ref[i].prim, rtb_v(q->dx, q->dy, q->dz), &n)) return;
  const float light = is_lit ? 1.0f : 0.45f;
  pixel[0] = (unsigned char)(light * (128 + 120 * n.x));
  pixel[1] = (unsigned char)(light * (128 + 120 * n.y));
  pixel[2] = (unsigned char)(light * (128 + 120 * n.z));
}

static int view(const rtb_mesh *m, const char *camera, const char *out)
{
  RayCamera c;
  rtb_rays primary, shadow;
  if (!ray_camera_read(camera, &c)) return 65;
  c.w = 512, c.h = 511; // not a square: row by row
  FILE *f = fopen(out, "wb");
  if (!f) {
    perror(out);
    return 73;
  }
  RTCDevice d = new_device(2);
  RTCScene s = build(d, m, NULL);
  ray_set_primary(&c, &primary);
  ray_set_name(&primary, "primary", RTB_CLOSEST, true, m);
  find_hits(s, &primary);
  ray_set_secondary(&(RaySetFrom){m, &primary, 1, RAY_TO_LIGHT, 1, c.light}, &shadow);
  ray_set_name(&shadow, "shadow", RTB_ANY, true, m);
  find_hits(s, &shadow);
  fprintf(f, "P6\n%d %d\n255\n", c.w, c.h);
  for (uint64_t i = 0, k = 0; i < primary.h.nrays; i++) {
    unsigned char pixel[3];
    const bool is_hit = primary.ref[i].prim != RTB_MISS;
    shade(m, &primary, i, is_hit && k < shadow.h.nrays && shadow.ref[k].prim == RTB_MISS, pixel);
    k += is_hit; // a hit on a triangle without area starts no shadow ray; none is seen in practice
    fwrite(pixel, 1, 3, f);
  }
  return fclose(f) ? 73 : 0;
}

// --- building --------------------------------------------------------------------------------------
static double process_seconds(void)
{
  struct timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void measure_build(const rtb_mesh *m, int threads)
{
  double times[64], sum = 0, cpu = 1e30;
  long long kept = 0, peak = 0;
  int n = 0;
  RTCDevice d = new_device(threads);
  for (; n < 64 && (n < 3 || (sum < settings.seconds && n < settings.runs)); n++) {
    const long long before = atomic_load(&memory_now);
    atomic_store(&memory_peak, before);
    const double start = process_seconds();
    RTCScene s = build(d, m, &times[n]);
    cpu = fmin(cpu, process_seconds() - start);
    kept = atomic_load(&memory_now) - before;
    peak = atomic_load(&memory_peak) - before;
    sum += times[n];
    rtcReleaseScene(s);
  }
  rtcReleaseDevice(d);
  const double median = rtb_median(times, n), best = times[0], count = (double)m->ntris;
  printf("build,%s,%s,%llu,%s,%d,%.4f,%.4f,%.2f,%.2f,%.1f,%.1f,%.4f\n", settings.label, settings.mesh_name,
         (unsigned long long)m->ntris, quality_name(), threads, best, median, 1e-6 * count / best,
         1e-6 * count / median, (double)kept / count, (double)peak / count, cpu);
  fflush(stdout);
}

static int measure_builds(const rtb_mesh *m)
{
  static const enum RTCBuildQuality qualities[] = {RTC_BUILD_QUALITY_LOW, RTC_BUILD_QUALITY_MEDIUM,
                                                   RTC_BUILD_QUALITY_HIGH};
  for (int t = 0; t < settings.thread_count; t++)
    for (int q = 0; q < 3; q++) {
      settings.quality = qualities[q];
      measure_build(m, settings.threads[t]);
    }
  return 0;
}

// --- tracing ---------------------------------------------------------------------------------------
static void measure_rays(RTCScene s, const rtb_mesh *m, const rtb_rays *r, rtb_hit *out,
                         const struct Api *api, int threads)
{
  static double times[MOST_RUNS];
  double sum = 0;
  int n = 0;
  run(s, r, out, api->trace, threads); // to warm up
  for (; n < MOST_RUNS && (n < settings.runs || sum < settings.seconds); n++)
    sum += times[n] = run(s, r, out, api->trace, threads);
  const double median = rtb_median(times, n), best = times[0], count = (double)r->h.nrays;
  const rtb_check c = rtb_compare(r, out, m->diag);
  printf("rays,%s,%s,%s,%s,%s,%d,%llu,%.3f,%.3f,%.1f,%llu,%llu,%llu\n", settings.label, settings.mesh_name,
         quality_name(), r->h.name, api->name, threads, (unsigned long long)r->h.nrays, 1e-6 * count / best,
         1e-6 * count / median, 100.0 * (double)c.hits / count, (unsigned long long)c.flips,
         (unsigned long long)c.far_t, (unsigned long long)c.otherprim);
  fflush(stdout);
}

static const struct Api *find_api(const char *text, size_t length)
{
  for (size_t i = 0; i < sizeof apis / sizeof *apis; i++)
    if (strlen(apis[i].letter) == length && !strncmp(apis[i].letter, text, length)) return &apis[i];
  fprintf(stderr, "there is no interface \"%.*s\"\n", (int)length, text);
  exit(64);
}

static int measure_files(const rtb_mesh *m, int count, char **files)
{
  RTCDevice d = new_device(2);
  RTCScene s = build(d, m, NULL);
  int code = 0;
  for (int i = 0; i < count && !code; i++) {
    rtb_rays r;
    if (!rtb_rays_read(files[i], &r)) {
      code = 66;
      break;
    }
    if (r.h.ntris != m->ntris) fprintf(stderr, "note: %s was made for another mesh\n", files[i]);
    rtb_hit *out = rtb_alloc(r.h.nrays, sizeof *out);
    for (const char *a = settings.apis; *a;) {
      const size_t length = strcspn(a, ",");
      const struct Api *api = find_api(a, length);
      for (int t = 0; t < settings.thread_count; t++) measure_rays(s, m, &r, out, api, settings.threads[t]);
      a += length + (a[length] == ',');
    }
    free(out);
    rtb_rays_free(&r);
  }
  rtcReleaseScene(s);
  rtcReleaseDevice(d);
  return code;
}

// --- the command line ------------------------------------------------------------------------------
static void read_threads(const char *list)
{
  settings.thread_count = 0;
  for (char *end; *list && settings.thread_count < 16; list = end + (*end == ',')) {
    const long n = strtol(list, &end, 10);
    if (n < 1 || n > MOST_THREADS || (*end && *end != ',')) exit((fputs(usage, stderr), 64));
    settings.threads[settings.thread_count++] = (int)n;
  }
}

static enum RTCBuildQuality read_quality(const char *name)
{
  return *name == 'l'   ? RTC_BUILD_QUALITY_LOW
         : *name == 'h' ? RTC_BUILD_QUALITY_HIGH
                        : RTC_BUILD_QUALITY_MEDIUM;
}

static bool take_option(char letter, const char *value)
{
  switch (letter) {
  case 'q': settings.quality = read_quality(value); return true;
  case 't': read_threads(value); return true;
  case 'a': settings.apis = value; return true;
  case 'n': settings.runs = atoi(value); return settings.runs > 0;
  case 's': settings.seconds = atof(value); return true;
  case 'c': settings.coherent = *value == 'a' ? -1 : atoi(value); return true;
  case 'd': settings.config = value; return true;
  case 'l': settings.label = value; return true;
  default: return false;
  }
}

int main(int argc, char **argv)
{
  int i = 1;
  for (; i < argc && argv[i][0] == '-'; i++) {
    const char letter = argv[i][1];
    if (letter == 'r')
      settings.scene_flags |= RTC_SCENE_FLAG_ROBUST;
    else if (letter == 'k')
      settings.scene_flags |= RTC_SCENE_FLAG_COMPACT;
    else if (++i >= argc || !take_option(letter, argv[i]))
      break;
  }
  rtb_mesh m;
  const int left = argc - i - 2; // operands behind the command
  const char *command = left >= 0 ? argv[i + 1] : "";
  const bool is_gen = !strcmp(command, "gen"), is_view = !strcmp(command, "view");
  const bool is_build = !strcmp(command, "build"), is_rays = !strcmp(command, "rays");
  if (!((is_gen || is_view) && left == 2) && !(is_build && left == 0) && !(is_rays && left > 0)) {
    fputs(usage, stderr);
    return 64;
  }
  settings.mesh_name = strrchr(argv[i], '/') ? strrchr(argv[i], '/') + 1 : argv[i];
  if (!rtb_mesh_read(argv[i], &m)) return 66;
  if (is_gen) return generate(&m, argv[i + 2], argv[i + 3]);
  if (is_view) return view(&m, argv[i + 2], argv[i + 3]);
  return is_build ? measure_builds(&m) : measure_files(&m, left, argv + i + 2);
}
