// Films through the public interface: rendering into them, developing, saving.

#include "api/api.h"

#include "base/mem.h"
#include "image/image.h"
#include "post/tone.h"
#include "render/camera.h"
#include "render/render.h"
#include "scene/kinds.h"

#include <pthread.h>
#include <string.h>

_Static_assert(RF_ALL_PLANES == (1 << FILM_PLANE_COUNT) - 1, "the two lists of planes are one");

rf_film *rf_film_create(rf_engine *e, int width, int height, unsigned planes)
{
  if (!e) return api_bad_argument("rf_film_create", "the engine is NULL"), NULL;
  if (width < 1 || height < 1) return api_bad_argument("rf_film_create", "%d x %d is no size", width, height), NULL;
  Err err = {0};
  rf_film *f = mem_zero(1, sizeof *f);
  if (!f) err_memory(&err, "a film", sizeof *f);
  if (f) f->film = film_create((uint32_t)width, (uint32_t)height, (planes & RF_ALL_PLANES) | RF_BEAUTY, &err);
  if (!api_fail(&err)) {
    mem_free(f);
    return NULL;
  }
  f->engine = e;
  return f;
}

void rf_film_clear(rf_film *f)
{
  if (!f) return;
  api_film_changed(f);
  film_clear(f->film);
}

void rf_film_destroy(rf_film *f)
{
  if (!f) return;
  api_film_changed(f);
  film_destroy(f->film);
  mem_free(f);
}

bool rf_film_merge(rf_film *dst, const rf_film *src)
{
  if (!dst || !src) return api_bad_argument("rf_film_merge", "films must not be NULL");
  Err err = {0};
  api_film_changed(dst);
  film_merge(dst->film, src->film, &err);
  return api_fail(&err);
}

bool rf_film_size(const rf_film *f, int *width, int *height)
{
  if (!f || !width || !height) return api_bad_argument("rf_film_size", "film and results must not be NULL");
  *width = (int)f->film->width;
  *height = (int)f->film->height;
  return true;
}

// --- rendering ------------------------------------------------------------------------------------
// Names of choices that a definition can hold for as long as it likes. Filled once, read ever after.
typedef struct ChoiceNames {
  const Group *group;
  const char *field;
  char names[16][40];
} ChoiceNames;
static ChoiceNames choices[] = {
    {&group_render, "integrator", {{0}}}, {&group_render, "filter", {{0}}}, {&group_develop, "tone_curve", {{0}}}};

static const Field *find_field(const Group *g, const char *field)
{
  const Kind *k = &g->kinds[0];
  for (size_t i = 0; i < k->field_count; i++)
    if (!strcmp(k->fields[i].name, field)) return &k->fields[i];
  return NULL;
}

static void fill_choices(void)
{
  for (size_t i = 0; i < sizeof choices / sizeof *choices; i++) {
    const Field *f = find_field(choices[i].group, choices[i].field);
    for (int32_t c = 0; c < 16 && choice_name(f, c, choices[i].names[c]); c++) continue;
  }
}

static const char *choice_text(const Group *g, const char *field, int32_t index)
{
  static pthread_once_t once = PTHREAD_ONCE_INIT;
  pthread_once(&once, fill_choices);
  for (size_t i = 0; i < sizeof choices / sizeof *choices; i++)
    if (choices[i].group == g && !strcmp(choices[i].field, field)) return choices[i].names[index & 15];
  return "";
}

// The index of a choice's name; -1 with the error recorded.
static int32_t choice_index(const Group *g, const char *field, const char *name, const char *function)
{
  const Field *f = find_field(g, field);
  char found[40];
  for (int32_t c = 0; choice_name(f, c, found); c++)
    if (name && !strcmp(found, name)) return c;
  api_bad_argument(function, "there is no %s \"%s\"; choose one of %s", field, name ? name : "(null)", f->unit);
  return -1;
}

static rf_render_def def_from(const RenderSettings *r)
{
  return (rf_render_def){.integrator = choice_text(&group_render, "integrator", r->integrator), .end_sample = r->spp,
                         .max_depth = r->max_depth, .roulette_depth = r->roulette_depth, .scatter = r->scatter,
                         .seed = (uint64_t)r->seed,
                         .filter = choice_text(&group_render, "filter", r->filter), .filter_width = r->filter_width,
                         .clamp = r->clamp, .transparent = r->transparent, .magic = MAGIC_RENDER};
}

rf_render_def rf_default_render_def(void)
{
  RenderSettings r;
  group_default(&group_render, 0, &r);
  return def_from(&r);
}

rf_render_def rf_scene_render_def(const rf_scene *s, int *width, int *height)
{
  if (!s) return rf_default_render_def();
  if (width) *width = s->scene->render.size[0];
  if (height) *height = s->scene->render.size[1];
  return def_from(&s->scene->render);
}

bool api_settings(const rf_render_def *def, const char *function, RenderSettings *out)
{
  if (!api_has_magic(def->magic, MAGIC_RENDER, function, "rf_render_def")) return false;
  group_default(&group_render, 0, out);
  out->integrator = choice_index(&group_render, "integrator", def->integrator, function);
  out->filter = choice_index(&group_render, "filter", def->filter, function);
  if (out->integrator < 0 || out->filter < 0) return false;
  if (def->first_sample < 0 || def->end_sample < def->first_sample || def->end_sample > FILM_MOST_SAMPLES)
    return api_bad_argument(function, "samples %d to %d: they must rise and stay within 0 and %d", def->first_sample,
                            def->end_sample, FILM_MOST_SAMPLES);
  const int most = (int)find_field(&group_render, "max_depth")->high;
  if (def->max_depth < 0 || def->max_depth > most || def->roulette_depth < 0 || def->roulette_depth > most)
    return api_bad_argument(function, "max_depth %d and roulette_depth %d: they must be between 0 and %d",
                            def->max_depth, def->roulette_depth, most);
  if (!(def->clamp >= 0) || !(def->filter_width >= 0) || def->filter_width > 16)
    return api_bad_argument(function, "clamp must not be negative, and filter_width between 0 and 16");
  if (def->parts < 0 || (def->parts > 0 && (def->part < 0 || def->part_end <= def->part || def->part_end > def->parts)))
    return api_bad_argument(function, "parts %d to %d of %d: they must rise and lie within 0 and %d", def->part,
                            def->part_end, def->parts, def->parts);
  const int most_scatter = (int)find_field(&group_render, "scatter")->high;
  if (def->scatter < 0 || def->scatter > most_scatter)
    return api_bad_argument(function, "scatter %d: it must be between 0 and %d", def->scatter, most_scatter);
  out->max_depth = def->max_depth;
  out->scatter = def->scatter;
  out->roulette_depth = def->roulette_depth;
  out->filter_width = def->filter_width;
  out->clamp = def->clamp;
  out->transparent = def->transparent;
  return true;
}

typedef struct ProgressLink {
  rf_go (*progress)(void *user, const rf_progress *p);
  void *user;
} ProgressLink;

static RenderGo pass_on(void *user, const RenderProgress *p)
{
  const ProgressLink *link = user;
  const rf_progress out = {.done = p->done, .seconds = p->seconds, .eta = p->eta, .samples = p->samples,
                           .left = p->left, .noise = p->noise, .quiet = p->quiet, .rays = p->rays};
  return (RenderGo)link->progress(link->user, &out);
}

rf_status api_render(rf_engine *e, const ApiSight *sight, const rf_render_def *def, rf_film *f,
                     rf_render_stats *stats)
{
  RenderSettings settings;
  if (!api_settings(def, "rf_render", &settings)) return RF_BAD_ARGUMENT;
  Err err = {0};
  ProgressLink link = {def->progress, def->user};
  RenderJob job = {.world = sight->world, .eye = sight->eye, .moments = sight->moments,
                   .moment_count = sight->moment_count, .settings = settings, .seed = def->seed, .film = f->film,
                   .first_sample = (uint32_t)def->first_sample, .end_sample = (uint32_t)def->end_sample,
                   .part = (uint32_t)def->part, .part_end = (uint32_t)def->part_end, .parts = (uint32_t)def->parts,
                   .budget_seconds = def->budget_seconds, .noise_target = def->noise_target,
                   .progress = def->progress ? pass_on : NULL, .user = &link};
  RenderStats taken = {0};
  api_film_changed(f);
  render_run(&job, e->jobs, e->hot, &e->cancel, &taken, &err);
  if (stats)
    *stats = (rf_render_stats){.seconds = taken.seconds, .camera_rays = taken.rays.camera_rays,
                               .bounce_rays = taken.rays.bounce_rays, .shadow_rays = taken.rays.shadow_rays,
                               .nodes = taken.rays.nodes, .prims = taken.rays.prims, .bad_samples = taken.bad_samples,
                               .samples = (int)taken.samples, .mean_samples = taken.mean_samples,
                               .noise = taken.noise, .quiet = taken.quiet, .is_complete = taken.is_complete};
  const rf_status status = (rf_status)err.kind;
  api_fail(&err);
  return status;
}

rf_status rf_render(const rf_world *w, const rf_eye *eye, const rf_render_def *def, rf_film *f,
                    rf_render_stats *stats)
{
  if (!w || !eye || !def || !f) {
    api_bad_argument("rf_render", "world, eye, definition and film must not be NULL");
    return RF_BAD_ARGUMENT;
  }
  const ApiSight sight = {.world = w->world, .eye = api_eye(eye)};
  return api_render(w->engine, &sight, def, f, stats);
}

// --- developing -----------------------------------------------------------------------------------
static rf_develop_def develop_from(const DevelopSettings *d)
{
  return (rf_develop_def){.exposure = d->exposure, .tone_curve = choice_text(&group_develop, "tone_curve", d->tone_curve),
                          .gamma = d->gamma, .magic = MAGIC_DEVELOP};
}

rf_develop_def rf_default_develop_def(void)
{
  DevelopSettings d;
  group_default(&group_develop, 0, &d);
  return develop_from(&d);
}

rf_develop_def rf_scene_develop_def(const rf_scene *s)
{
  return s ? develop_from(&s->scene->develop) : rf_default_develop_def();
}

bool api_tone(const rf_develop_def *def, const char *function, Tone *out)
{
  const rf_develop_def defaults = rf_default_develop_def();
  if (!def) def = &defaults;
  if (!api_has_magic(def->magic, MAGIC_DEVELOP, function, "rf_develop_def")) return false;
  const int32_t kind = choice_index(&group_develop, "tone_curve", def->tone_curve, function);
  if (kind < 0) return false;
  if (!(fabsf(def->exposure) <= 64) || !(def->gamma >= 0.01f && def->gamma <= 100))
    return api_bad_argument(function, "exposure %g and gamma %g: not usable", (double)def->exposure, (double)def->gamma);
  *out = (Tone){(ToneKind)kind, def->exposure, def->gamma};
  return true;
}

static bool image_create(rf_image *out, const Film *f, int channels, const char *function)
{
  *out = (rf_image){(int)f->width, (int)f->height, channels, mem_alloc((size_t)f->width * f->height,
                                                                       (size_t)channels * sizeof(float))};
  Err err = {0};
  if (!out->pixels) err_memory(&err, function, (unsigned long long)f->width * f->height * 16);
  return api_fail(&err);
}

bool rf_film_plane(const rf_film *f, rf_plane plane, rf_image *out)
{
  static const char function[] = "rf_film_plane";
  if (!f || !out) return api_bad_argument(function, "film and result must not be NULL");
  if (!plane || (plane & (plane - 1)) || plane > RF_ALL_PLANES) return api_bad_argument(function, "ask for one plane");
  const FilmPlane which = (FilmPlane)__builtin_ctz((unsigned)plane);
  if (!film_has(f->film, which))
    return api_bad_argument(function, "this film has no plane \"%s\"; ask for it in rf_film_create()",
                            film_plane_names[which]);
  if (!image_create(out, f->film, (int)strlen(film_plane_channels[which]), "a plane")) return false;
  film_resolve(f->film, which, out->pixels);
  return true;
}

// The picture to show: the clean one if there is one.
static bool picture_of(const rf_film *f, rf_image *out)
{
  if (!f->clean) return rf_film_plane(f, RF_BEAUTY, out);
  if (!image_create(out, f->film, 4, "a picture")) return false;
  memcpy(out->pixels, f->clean, (size_t)f->film->width * f->film->height * 4 * sizeof(float));
  return true;
}

bool rf_develop(const rf_film *f, const rf_develop_def *def, rf_image *out)
{
  Tone tone;
  if (!f || !out) return api_bad_argument("rf_develop", "film and result must not be NULL");
  if (!api_tone(def, "rf_develop", &tone) || !picture_of(f, out)) return false;
  tone_pixels(&tone, out->pixels, (size_t)out->width * (size_t)out->height, f->engine->jobs);
  return true;
}

// The hash of what the writer of "hash" would be given, so of the picture alone: which other planes the film has, and
// in how many samples the same picture was reached, makes no difference.
uint64_t rf_film_hash(const rf_film *f)
{
  rf_image picture;
  if (!f) return api_bad_argument("rf_film_hash", "the film is NULL"), 0;
  if (!rf_film_plane(f, RF_BEAUTY, &picture)) return 0;
  const Plane plane = {film_plane_names[FILM_BEAUTY], film_plane_channels[FILM_BEAUTY], picture.pixels, false};
  const ImageOut out = {.width = f->film->width, .height = f->film->height, .planes = &plane, .plane_count = 1};
  const uint64_t hash = image_hash(&out);
  rf_image_free(&picture);
  return hash;
}

// --- saving ---------------------------------------------------------------------------------------
rf_save_def rf_default_save_def(void) { return (rf_save_def){.magic = MAGIC_SAVE}; }

bool rf_can_save(rf_engine *e, const char *path)
{
  (void)e;
  bool is_linear;
  Err err = {0};
  if (!path) return api_bad_argument("rf_can_save", "the path is NULL");
  image_format(path, &is_linear, &err);
  return api_fail(&err);
}

// The film's planes among `wanted` as the writers want them; the first is the picture.
static bool gather_planes(const rf_film *f, unsigned wanted, rf_image images[FILM_PLANE_COUNT],
                          Plane planes[FILM_PLANE_COUNT], size_t *count)
{
  *count = 0;
  for (int i = 0; i < FILM_PLANE_COUNT; i++) {
    if (!film_has(f->film, (FilmPlane)i) || i == FILM_SAMPLES || !(wanted >> i & 1)) continue;
    rf_image *image = &images[*count];
    if (i == FILM_BEAUTY ? !picture_of(f, image) : !rf_film_plane(f, (rf_plane)(1 << i), image)) return false;
    planes[*count] = (Plane){film_plane_names[i], film_plane_channels[i], images[*count].pixels, i >= FILM_DEPTH};
    ++*count;
  }
  return true;
}

// Radiance is stored multiplied by coverage; display files want it divided out again.
static void divide_by_alpha(rf_image *img)
{
  for (size_t i = 0; i < (size_t)img->width * (size_t)img->height; i++) {
    float *p = img->pixels + 4 * i;
    for (int c = 0; c < 3 && p[3] > 0 && p[3] < 1; c++) p[c] /= p[3];
  }
}

bool rf_film_save(const rf_film *f, const rf_develop_def *develop, const rf_save_def *save, const char *path)
{
  static const char function[] = "rf_film_save";
  const rf_save_def defaults = rf_default_save_def();
  if (!f || !path) return api_bad_argument(function, "film and path must not be NULL");
  if (!save) save = &defaults;
  Tone tone;
  if (!api_has_magic(save->magic, MAGIC_SAVE, function, "rf_save_def") || !api_tone(develop, function, &tone))
    return false;
  Err err = {0};
  bool is_linear = false;
  rf_image images[FILM_PLANE_COUNT] = {0};
  Plane planes[FILM_PLANE_COUNT];
  size_t count = 0;
  const unsigned wanted = save->planes ? save->planes | RF_BEAUTY : RF_ALL_PLANES;
  bool ok = image_format(path, &is_linear, &err) && gather_planes(f, wanted, images, planes, &count);
  if (ok) {
    if (!is_linear || save->developed) {
      divide_by_alpha(&images[0]);
      tone_pixels(&tone, images[0].pixels, (size_t)images[0].width * (size_t)images[0].height, f->engine->jobs);
    }
    if (api_is_opaque(&images[0])) {
      api_drop_alpha(&images[0]);
      planes[0].channels = "RGB";
    }
    const ImageOut out = {.width = f->film->width, .height = f->film->height, .planes = planes, .plane_count = count,
                          .bits = save->bits, .quality = save->quality, .comment = save->comment};
    image_write(path, &out, &err);
  }
  for (size_t i = 0; i < FILM_PLANE_COUNT; i++) rf_image_free(&images[i]);
  return api_fail(&err) && ok;
}
