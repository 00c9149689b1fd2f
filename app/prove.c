// `rayfold prove`: measures a world by its own rays: how long a straight look is, what the angles of a triangle make
// together, by how much an arrow is turned that is carried round, how large a cell is. Beside each stands what geometry
// says it should be.

#include "commands.h"
#include "library.h"
#include "output.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define DEGREES (180 / 3.14159265358979)
enum { MOST_POINTS = 64 };

static const Option prove_options[] = {
    {.name = "camera", .kind = OPTION_TEXT, .argument = "NAME", .initial = "the main one", .sentence = "Whose eye measures."},
    {.name = "cell", .kind = OPTION_TEXT, .argument = "NAME", .initial = "the camera's",
     .sentence = "Measure from the middle of this cell instead, or from --from in it."},
    {.name = "from", .kind = OPTION_TEXT, .argument = "X,Y,Z", .initial = "the camera's place",
     .sentence = "Measure from there, looking along -z."},
    {.name = "look", .kind = OPTION_TEXT, .argument = "X,Y", .initial = "0.5,0.5 if nothing is asked", .repeats = true,
     .sentence = "A place of the picture, from 0,0 at the upper left to 1,1: what is seen there, how far, through how many "
                 "gates."},
    {.name = "place", .kind = OPTION_TEXT, .argument = "X,Y,Z", .repeats = true,
     .sentence = "A place of the eye's cell, in its coordinates."},
    {.name = "leg", .kind = OPTION_TEXT, .argument = "X,Y,Z", .repeats = true,
     .sentence = "A leg of a way round: metres to the right, up and back, as the frame has it that is carried along. After the "
                 "last it goes straight home."},
    {.name = "open", .kind = OPTION_FLAG, .sentence = "Legs only: they should lead home by themselves, through gates."},
    {.name = "volume", .kind = OPTION_FLAG, .sentence = "The volume of the eye's cell within its walls of space."},
    {.name = "rays", .kind = OPTION_INTEGER, .argument = "N", .initial = "1000000", .low = 2, .high = 1000000000,
     .sentence = "Rays for --volume; its error falls with their root."},
    {.name = "seed", .kind = OPTION_INTEGER, .argument = "N", .initial = "0", .high = 4294967295.0, .sentence = "Which rays."},
    {.name = "json", .kind = OPTION_FLAG,
     .sentence = "Print one JSON object: metres, square metres, radians; null where there is nothing."},
    OPTION_ALLOW_OUTSIDE,
    OPTION_CACHE,
    {0},
};

typedef struct Prove { // all that one run owns
  const Args *args;
  rf_engine *engine;
  rf_scene *scene;
  rf_world *world;
  rf_eye eye;
  float width, height; // of the picture
  double curvature;
  rf_vec3 points[MOST_POINTS]; // as the eye sees them: right, up, back, as many metres away
  size_t point_count;
  FILE *out; // into memory: printed when all went well
  bool is_json, has_printed;
} Prove;

// --- small things -----------------------------------------------------------------------------------
static double dot(rf_vec3 a, rf_vec3 b) { return (double)a.x * b.x + (double)a.y * b.y + (double)a.z * b.z; }
static rf_vec3 scaled(rf_vec3 v, float s) { return (rf_vec3){v.x * s, v.y * s, v.z * s}; }

static rf_vec3 seen(const Prove *p, rf_vec3 v)
{
  const rf_frame *f = &p->eye.frame;
  return (rf_vec3){(float)dot(f->x, v), (float)dot(f->y, v), (float)dot(f->z, v)};
}

// "1,2,3": exactly so many numbers.
static bool read_numbers(const char *text, int count, float *out)
{
  for (int i = 0; i < count; i++) {
    char *end;
    out[i] = strtof(text, &end);
    if (end == text || !isfinite(out[i]) || *end != (i + 1 < count ? ',' : 0)) return false;
    text = end + 1;
  }
  return true;
}

static ExitCode read_vector(const char *option, const char *text, rf_vec3 *out)
{
  float v[3];
  if (!read_numbers(text, 3, v)) return fail(EXIT_USAGE, "--%s %s: it is X,Y,Z, three numbers without spaces", option, text);
  *out = (rf_vec3){v[0], v[1], v[2]};
  return EXIT_DONE;
}

static void number_or_null(Prove *p, const char *name, double value)
{
  if (isfinite(value))
    fprintf(p->out, ", \"%s\": %.9g", name, value);
  else
    fprintf(p->out, ", \"%s\": null", name);
}

static void begin_item(Prove *p, const char *kind)
{
  fprintf(p->out, "%s    {\"kind\": \"%s\"", p->has_printed ? ",\n" : "", kind);
  p->has_printed = true;
}

static const char *cell_title(const Prove *p, int cell)
{
  const char *name = rf_cell_name(p->scene, cell);
  return name ? name : "without a name";
}

// --- the eye ----------------------------------------------------------------------------------------
static ExitCode check_chart(const Prove *p, const char *option, const char *text, rf_vec3 place)
{
  if (1 + p->curvature * dot(place, place) > 0) return EXIT_DONE;
  return fail(EXIT_USAGE, "--%s %s is beyond the end of the cell's chart, which is %g m from its middle", option, text,
              1 / sqrt(fabs(p->curvature)));
}

static ExitCode place_eye(Prove *p)
{
  const char *cell = args_text(p->args, "cell"), *from = args_text(p->args, "from");
  int width, height;
  ExitCode code = EXIT_DONE;
  (void)rf_scene_render_def(p->scene, &width, &height);
  p->width = (float)width;
  p->height = (float)height;
  if (!rf_camera(p->scene, p->world, args_text(p->args, "camera"), p->width / p->height, &p->eye)) return fail_library(p->engine);
  if (cell && rf_find_cell(p->scene, cell) < 0) return fail(EXIT_USAGE, "--cell %s: the scene has no cell of that name", cell);
  if (cell || from) {
    p->eye.cell = cell ? rf_find_cell(p->scene, cell) : p->eye.cell;
    p->eye.frame = (rf_frame){{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}};
  }
  p->curvature = (double)rf_curvature(p->world, p->eye.cell);
  if (from) code = read_vector("from", from, &p->eye.frame.p);
  return code || !from ? code : check_chart(p, "from", from, p->eye.frame.p);
}

static void print_eye(const Prove *p)
{
  const rf_vec3 at = p->eye.frame.p;
  const double k = p->curvature, radius = 1 / sqrt(fabs(k));
  if (p->is_json) {
    const char *name = rf_cell_name(p->scene, p->eye.cell);
    fprintf(p->out, "{ \"cell\": ");
    if (name)
      json_print_text(p->out, name);
    else
      fputs("null", p->out);
    fprintf(p->out, ", \"curvature\": %.9g, \"eye\": [%.9g, %.9g, %.9g],\n  \"proofs\": [\n", k, (double)at.x,
            (double)at.y, (double)at.z);
    return;
  }
  fprintf(p->out, "cell %s: %s", cell_title(p, p->eye.cell), k == 0 ? "flat" : k > 0 ? "spherical" : "hyperbolic");
  if (k != 0) fprintf(p->out, ", radius of curvature %.6g m", radius);
  fprintf(p->out, "\neye at %.6g, %.6g, %.6g\n", (double)at.x, (double)at.y, (double)at.z);
}

// --- the ruler --------------------------------------------------------------------------------------
// What is seen in a direction of the eye's; lamps are passed, as the eye does not see them all.
static bool look(const Prove *p, rf_ray ray, rf_hit *hit, rf_arrival *at)
{
  for (int tries = 0; tries < 16; tries++) {
    if (!rf_look(p->world, p->eye.cell, &ray, hit, at)) return false;
    if (hit->object.id != UINT32_MAX) return true;
    ray.tmin = at->length * 1.0001f + 1e-5f;
  }
  return false;
}

static void print_look(Prove *p, const char *text, const rf_hit *hit, const rf_arrival *at)
{
  const rf_surface s = rf_surface_at(p->world, &at->ray, hit);
  if (p->is_json) {
    begin_item(p, "look");
    fprintf(p->out, ", \"at\": [%s], \"length\": %.9g, \"gates\": %d, \"scale\": %.9g, \"cell\": %d", text, (double)at->length,
            at->gates, (double)at->scale, at->cell);
    fprintf(p->out, ", \"place\": [%.9g, %.9g, %.9g], \"material\": ", (double)s.position.x, (double)s.position.y, (double)s.position.z);
    json_print_text(p->out, s.material_name ? s.material_name : "");
    fputc('}', p->out);
    return;
  }
  fprintf(p->out, "look %s: %.6g m straight on, through %d gate%s, to %.5g, %.5g, %.5g in cell %s", text, (double)at->length,
          at->gates, at->gates == 1 ? "" : "s", (double)s.position.x, (double)s.position.y, (double)s.position.z, cell_title(p, at->cell));
  if (s.material_name) fprintf(p->out, " (%s)", s.material_name);
  if (at->scale != 1) fprintf(p->out, ", where a metre is %.5g", (double)at->scale);
  fputc('\n', p->out);
}

static void print_nothing(Prove *p, const char *text, int gates)
{
  if (p->is_json) {
    begin_item(p, "look");
    fprintf(p->out, ", \"at\": [%s], \"length\": null, \"gates\": %d}", text, gates);
  } else {
    fprintf(p->out, "look %s: through %d gate%s, and nothing is met\n", text, gates, gates == 1 ? "" : "s");
  }
}

static ExitCode measure_look(Prove *p, const char *text)
{
  float at[2];
  rf_hit hit;
  rf_arrival end;
  if (!read_numbers(text, 2, at) || at[0] < 0 || at[0] > 1 || at[1] < 0 || at[1] > 1)
    return fail(EXIT_USAGE, "--look %s: it is X,Y, two numbers from 0 to 1", text);
  const rf_ray ray = rf_eye_ray(&p->eye, p->width, p->height, at[0] * p->width, at[1] * p->height);
  const bool is_met = look(p, ray, &hit, &end);
  if (is_met)
    print_look(p, text, &hit, &end);
  else
    print_nothing(p, text, end.gates);
  p->points[p->point_count++] = seen(p, scaled(ray.direction, is_met ? end.length : NAN));
  return EXIT_DONE;
}

static ExitCode measure_place(Prove *p, const char *text)
{
  rf_vec3 place;
  ExitCode code = read_vector("place", text, &place);
  if (!code) code = check_chart(p, "place", text, place);
  if (code) return code;
  const rf_vec3 way = rf_toward(p->world, p->eye.cell, p->eye.frame.p, place);
  const double length = sqrt(dot(way, way));
  p->points[p->point_count++] = seen(p, way);
  if (p->is_json) {
    begin_item(p, "place");
    fprintf(p->out, ", \"at\": [%.9g, %.9g, %.9g], \"length\": %.9g}", (double)place.x, (double)place.y, (double)place.z, length);
  } else {
    fprintf(p->out, "place %s: %.6g m straight on\n", text, length);
  }
  return EXIT_DONE;
}

static ExitCode measure_points(Prove *p)
{
  ExitCode code = EXIT_DONE;
  for (size_t i = 0; i < p->args->given_count && !code; i++) { // in the order in which they were given
    const Given *g = &p->args->given[i];
    const bool is_look = !strcmp(g->option->name, "look"), is_place = !strcmp(g->option->name, "place");
    if ((is_look || is_place) && p->point_count >= MOST_POINTS - 1)
      return fail(EXIT_USAGE, "no more than %d --look and --place", MOST_POINTS - 1);
    if (is_look) code = measure_look(p, g->value);
    if (is_place) code = measure_place(p, g->value);
  }
  return code;
}

// A part of a unit vector, without what rounding left.
static double tidy(float x) { return fabsf(x) < 5e-5f ? 0 : (double)x; }

// --- ways round -------------------------------------------------------------------------------------
static void print_round(Prove *p, const char *what, const rf_round *r)
{
  if (p->is_json) {
    begin_item(p, what);
    fprintf(p->out, ", \"is_home\": %s, \"sides\": %d, \"gates\": %d, \"length\": %.9g", r->is_home ? "true" : "false",
            r->sides, r->gates, r->length);
    number_or_null(p, "miss", r->miss);
    number_or_null(p, "turn", r->turn);
    fprintf(p->out, ", \"axis\": [%.6g, %.6g, %.6g], \"is_mirrored\": %s, \"scale\": %.9g", (double)r->axis.x,
            (double)r->axis.y, (double)r->axis.z, r->is_mirrored ? "true" : "false", r->scale);
    number_or_null(p, "angles", r->angles);
    number_or_null(p, "area", r->area);
    number_or_null(p, "expected_angles", (r->sides - 2) * M_PI + p->curvature * r->area);
    fputc('}', p->out);
    return;
  }
  fprintf(p->out, "%s, %d side%s: %.6g m, through %d gate%s\n", what, r->sides, r->sides == 1 ? "" : "s", r->length, r->gates,
          r->gates == 1 ? "" : "s");
  if (!r->is_home) {
    if (isnan(r->miss))
      fputs("  does not come home: it ends in another cell\n", p->out);
    else
      fprintf(p->out, "  does not come home: it ends %.6g m from where it began\n", r->miss);
    return;
  }
  fprintf(p->out, "  home:     within %.1e m\n", r->miss);
  if (isfinite(r->angles)) {
    const double flat = (r->sides - 2) * 180.0, more = p->curvature * r->area * DEGREES;
    fprintf(p->out, "  angles:   %.4f degrees together\n", r->angles * DEGREES);
    fprintf(p->out, "  area:     %.6g m2\n", r->area);
    fprintf(p->out, "  expected: %g + area x curvature = %.4f degrees\n", flat, flat + more);
  }
  fprintf(p->out, "  arrow:    carried round, it is turned by %.4f degrees", r->turn * DEGREES);
  if (dot(r->axis, r->axis) > 0.5) fprintf(p->out, " about %.4g, %.4g, %.4g", tidy(r->axis.x), tidy(r->axis.y), tidy(r->axis.z));
  fprintf(p->out, "%s\n", r->is_mirrored ? ", and left is right" : "");
  if (r->scale < 0.9999 || r->scale > 1.0001) fprintf(p->out, "  scale:    a metre carried round is %.6g m\n", r->scale);
}

static rf_body body_of(const Prove *p) { return (rf_body){.frame = p->eye.frame, .scale = 1, .cell = p->eye.cell}; }

static ExitCode measure_corners(Prove *p)
{
  const rf_body b = body_of(p);
  rf_round r;
  if (p->point_count < 2) return EXIT_DONE;
  for (size_t i = 0; i < p->point_count; i++)
    if (isnan(p->points[i].x)) return fail(EXIT_BAD_SCENE, "a --look meets nothing, and that is no corner; look at a surface");
  if (p->point_count == 2) p->points[p->point_count++] = (rf_vec3){0, 0, 0}; // the eye
  if (!rf_walk_corners(p->world, &b, p->points, p->point_count, &r)) return fail_library(p->engine);
  print_round(p, p->point_count == 3 ? "triangle" : "polygon", &r);
  return EXIT_DONE;
}

static ExitCode measure_legs(Prove *p)
{
  const rf_body b = body_of(p);
  rf_vec3 legs[MOST_POINTS];
  size_t count = 0;
  const char *text;
  rf_round r;
  for (size_t i = 0; (text = args_next(p->args, "leg", &i));) {
    if (count == MOST_POINTS) return fail(EXIT_USAGE, "no more than %d --leg", MOST_POINTS);
    const ExitCode code = read_vector("leg", text, &legs[count++]);
    if (code) return code;
  }
  if (!count) return EXIT_DONE;
  if (!rf_walk_round(p->world, &b, legs, count, !args_has(p->args, "open"), &r)) return fail_library(p->engine);
  print_round(p, "way", &r);
  return EXIT_DONE;
}

// --- volume -----------------------------------------------------------------------------------------
static ExitCode measure_volume(Prove *p)
{
  double volume, error;
  const uint32_t rays = (uint32_t)args_integer(p->args, "rays", 1000000), seed = (uint32_t)args_integer(p->args, "seed", 0);
  if (!args_has(p->args, "volume")) return EXIT_DONE;
  if (!rf_cell_volume(p->world, p->eye.cell, p->eye.frame.p, rays, seed, &volume, &error))
    return fail_usage(p->engine, "--volume");
  if (p->is_json) {
    begin_item(p, "volume");
    fprintf(p->out, ", \"volume\": %.9g, \"error\": %.3g, \"rays\": %u}", volume, error, rays);
    return EXIT_DONE;
  }
  fprintf(p->out, "volume: %.6g +- %.2g m3", volume, error);
  if (p->curvature != 0) {
    const double unit = pow(fabs(p->curvature), 1.5);
    fprintf(p->out, "; with a radius of curvature of one, %.6g +- %.2g", volume * unit, error * unit);
  }
  fprintf(p->out, " (%u rays)\n", rays);
  return EXIT_DONE;
}

// ----------------------------------------------------------------------------------------------------
static ExitCode check_command_line(const Args *a)
{
  if (args_has(a, "open") && !args_has(a, "leg")) return fail(EXIT_USAGE, "--open is about the legs of a way: give some --leg");
  if (args_has(a, "camera") && (args_has(a, "cell") || args_has(a, "from")))
    return fail(EXIT_USAGE, "--camera is a place already; leave out --cell and --from");
  return EXIT_DONE;
}

static ExitCode measure(Prove *p)
{
  ExitCode code = place_eye(p);
  if (code) return code;
  print_eye(p);
  code = measure_points(p);
  if (!code && !p->point_count && !args_has(p->args, "leg") && !args_has(p->args, "volume")) code = measure_look(p, "0.5,0.5");
  if (!code) code = measure_corners(p);
  if (!code) code = measure_legs(p);
  if (!code) code = measure_volume(p);
  if (p->is_json) fprintf(p->out, "%s  ] }\n", p->has_printed ? "\n" : "");
  return code;
}

static ExitCode run_prove(const Args *args)
{
  Prove p = {.args = args, .is_json = args_has(args, "json")};
  char *text = NULL;
  size_t size = 0;
  ExitCode code = check_command_line(args);
  if (!code && !(p.out = open_memstream(&text, &size))) code = fail(EXIT_INTERNAL, "not enough memory for the proofs");
  if (!code) code = engine_open(&p.engine, 0, NULL);
  if (!code) code = scene_open(&p.scene, p.engine, args->operands[0], args);
  if (!code && !(p.world = rf_prepare(p.scene, NULL))) code = fail_library(p.engine);
  if (!code) code = measure(&p);
  rf_world_destroy(p.world);
  rf_scene_destroy(p.scene);
  rf_engine_destroy(p.engine);
  if (p.out && fclose(p.out) && !code) code = fail(EXIT_INTERNAL, "not enough memory for the proofs");
  if (!code) fputs(text, stdout);
  free(text);
  return code ? code : stdout_finish("the proofs");
}

const Command command_prove = {
    .name = "prove",
    .sentence = "Measure a world by its own rays: lengths, angles of triangles, arrows carried round, volumes of cells.",
    .operands = "SCENE",
    .least = 1,
    .most = 1,
    .operand_kind = OPERAND_FILE,
    .usage = "[--look X,Y]... [--place X,Y,Z]... [--leg X,Y,Z]... [--volume] [OPTION]...",
    .text = "Each --look and --place is measured from the eye. Two of them make a triangle with it, three or more a figure of "
            "their own, which is walked round: the angles are those in which the walker arrives and goes on, the area follows "
            "from the places of the corners, and the arrow is what was carried along. In a space of constant curvature the "
            "three agree: angles less their sum in a plane = area x curvature = turn of the arrow.",
    .example = "rayfold prove scenes/worlds/dodecahedron.json --look 0.3,0.7 --look 0.7,0.6 --volume",
    .options = prove_options,
    .run = run_prove,
};
