// See stats.h.

#include "stats.h"

#include "commands.h"
#include "library.h"
#include "output.h"

#include <inttypes.h>
#include <stdlib.h>
#include <sys/resource.h>

void stats_add(rf_render_stats *sum, const rf_render_stats *more)
{
  sum->seconds += more->seconds;
  sum->camera_rays += more->camera_rays;
  sum->bounce_rays += more->bounce_rays;
  sum->shadow_rays += more->shadow_rays;
  sum->nodes += more->nodes;
  sum->prims += more->prims;
  sum->bad_samples += more->bad_samples;
  sum->samples += more->samples;
  sum->mean_samples += more->mean_samples;
  sum->noise = more->noise;
  sum->quiet = more->quiet;
}

uint64_t stats_rays(const rf_render_stats *r)
{
  return r->camera_rays + r->bounce_rays + r->shadow_rays;
}

static uint64_t peak_memory(void)
{
  struct rusage usage;
  return getrusage(RUSAGE_SELF, &usage) ? 0 : (uint64_t)usage.ru_maxrss * 1024; // Linux counts in KiB
}

// Processor seconds of all threads so far.
static double cpu_seconds(void)
{
  struct rusage u;
  if (getrusage(RUSAGE_SELF, &u)) return 0;
  return (double)(u.ru_utime.tv_sec + u.ru_stime.tv_sec) + 1e-6 * (double)(u.ru_utime.tv_usec + u.ru_stime.tv_usec);
}

static void print_stats(FILE *out, const Stats *s)
{
  char version[32];
  const rf_render_stats *r = &s->rendered;
  const uint64_t rays = stats_rays(r);
  fprintf(out, "{\n  \"version\": \"%s\",\n  \"isa\": \"%s\",\n  \"threads\": %d,\n  \"scene\": ",
          program_version(version), s->isa, s->threads);
  json_print_text(out, s->scene);
  fprintf(out, ",\n  \"size\": [%d, %d],\n  \"samples\": %d,\n  \"mean_samples\": %.3f,\n"
          "  \"noise\": %.6f,\n  \"tiles_done\": %.4f,\n  \"bad_samples\": %" PRIu64 ",\n", s->width,
          s->height, r->samples, r->mean_samples, r->noise, r->quiet, r->bad_samples);
  fprintf(out,
          "  \"seconds\": {\"load\": %.6f, \"prepare\": %.6f, \"render\": %.6f, \"denoise\": %.6f, "
          "\"write\": %.6f},\n",
          s->load, s->prepare, s->render, s->denoise, s->write);
  fprintf(out, "  \"cpu_seconds\": %.3f,\n", cpu_seconds());
  fprintf(out,
          "  \"rays\": {\"camera\": %" PRIu64 ", \"bounce\": %" PRIu64 ", \"shadow\": %" PRIu64
          ", \"all\": %" PRIu64 ", \"per_second\": %.0f},\n",
          r->camera_rays, r->bounce_rays, r->shadow_rays, rays,
          s->render > 0 ? (double)rays / s->render : 0.0);
  fprintf(out, "  \"nodes\": %" PRIu64 ",\n  \"prims\": %" PRIu64 ",\n", r->nodes, r->prims);
  fprintf(out, "  \"triangles\": %" PRIu64 ",\n  \"unique_triangles\": %" PRIu64 ",\n", s->world.triangles,
          s->world.unique_triangles);
  fprintf(out,
          "  \"memory\": {\"geometry\": %" PRIu64 ", \"textures\": %" PRIu64 ", \"peak\": %" PRIu64 "},\n",
          s->world.geometry_bytes, s->world.texture_bytes, peak_memory());
  fprintf(out, "  \"hash\": \"%016" PRIx64 "\"\n}\n", s->hash);
}

ExitCode stats_write(const Stats *s, const char *path)
{
  char *text = NULL;
  size_t size = 0;
  FILE *out = open_memstream(&text, &size);
  if (!out) return fail(EXIT_INTERNAL, "not enough memory for the statistics");
  print_stats(out, s);
  const bool failed = ferror(out);
  ExitCode code = fclose(out) || failed ? fail(EXIT_INTERNAL, "not enough memory for the statistics")
                                        : output_write(path, text, size);
  free(text);
  return code;
}
