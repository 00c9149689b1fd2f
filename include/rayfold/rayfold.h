// rayfold.h: the whole public interface. What is not in this file may change tomorrow.
//
//   engine   threads, memory, log, errors. There is no global state: two engines never meet.
//   scene    the description: cameras, objects, materials, textures, lights, sky. Edited freely.
//   world    a scene made ready to render. Immutable: any number of threads may read it.
//   film     a picture being accumulated, with its extra planes (albedo, normal, depth, ids, ...).
//
//   scene --rf_prepare--> world --rf_render--> film --rf_develop--> image
//                                              film --rf_film_save--> file
//
// A program that only casts rays needs: engine_create, scene_create, add_mesh, prepare, intersect (and the destroys).
// One that wants a picture: engine_create, scene_load, prepare, camera, film_create, render, film_save.
//
// Units: metres, seconds, radians (degrees only inside scene files and rf_set), linear Rec.709 radiance.
// Right-handed, y up; an eye looks along -z. A zeroed handle means "none". Every destroy function accepts NULL.
// false or NULL means failure; rf_error() then tells what, where and how to mend it.
// Unless its comment says otherwise, a function may be called from any thread, but not twice at once on one scene
// or film. Worlds may be read from anywhere, at any time.

#ifndef RAYFOLD_H
#define RAYFOLD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define RF_VERSION_MAJOR 0
#define RF_VERSION_MINOR 1
#define RF_VERSION_PATCH 0

#ifndef RF_API
#define RF_API __attribute__((visibility("default")))
#endif

typedef struct rf_engine rf_engine;
typedef struct rf_scene rf_scene;
typedef struct rf_world rf_world;
typedef struct rf_film rf_film;

typedef struct rf_vec3 {
  float x, y, z;
} rf_vec3;

typedef struct rf_frame { // an affine map: where x, y, z and the origin go
  rf_vec3 x, y, z, p;
} rf_frame;

typedef struct rf_object { // an object of a scene; stays the same while others come and go
  uint32_t id;
} rf_object;

// --- engine -----------------------------------------------------------------------------------------
typedef enum rf_status {
  RF_OK,
  RF_BAD_ARGUMENT, // the caller's fault
  RF_BAD_SCENE,    // the content of a file or an edit
  RF_NOT_FOUND,    // an input is missing or cannot be read
  RF_IO,           // an output cannot be written
  RF_NO_MEMORY,
  RF_CANCELLED
} rf_status;

typedef enum rf_log_level { RF_LOG_ERROR, RF_LOG_WARNING, RF_LOG_INFO } rf_log_level;

typedef struct rf_engine_def {
  int threads;     // workers; 0: as many as this process may use
  const char *isa; // "auto", or "ref", "v2", "v3", "v4" to force one build of the kernels
  void (*log)(void *user, rf_log_level level, const char *line); // may be NULL: silent
  void *user;
  uint32_t magic;  // set by rf_default_engine_def()
} rf_engine_def;

RF_API int rf_version(void);              // major * 10000 + minor * 100 + patch
RF_API const char *rf_features(void);     // what this build can read and write, and why the rest is out; lines
RF_API rf_engine_def rf_default_engine_def(void);
RF_API rf_engine *rf_engine_create(const rf_engine_def *def); // def NULL: defaults. On failure rf_error(NULL, ...)
RF_API void rf_engine_destroy(rf_engine *e);                  // after everything made with it
RF_API const char *rf_engine_isa(const rf_engine *e);         // the level in use
RF_API int rf_engine_threads(const rf_engine *e);

// The last failure on this thread and its message (never NULL; "" for none), and clears it. e may be NULL.
RF_API rf_status rf_error(rf_engine *e, const char **text);

// Asks whatever runs on this engine to stop now (within 50 ms); it fails with RF_CANCELLED. Holds until
// rf_uncancel(). Safe in a signal handler.
RF_API void rf_cancel(rf_engine *e);
RF_API void rf_uncancel(rf_engine *e);

// --- scene: the description -------------------------------------------------------------------------
typedef struct rf_load_def {
  bool allow_outside; // let the scene name files outside its folder
  bool cache;         // keep each model as a saved model beside it, "bunny.obj.rfm", and take it from there next time
  const char *element; // the file is one of NoEucRT's elements: "portal", "warped", "shrink", "rotation", "material"
  uint32_t magic;     // set by rf_default_load_def()
} rf_load_def;

RF_API rf_load_def rf_default_load_def(void);
RF_API rf_scene *rf_scene_create(rf_engine *e);
// A scene file (.json), a model (.obj .gltf .glb .ply .stl .vox), smoke (.grid .nvdb) or a saved model (.rfm), which is
// mapped, not read: write no other file over it while a scene or world of it lives. Errors carry file:line:column. def may be NULL.
RF_API rf_scene *rf_scene_load(rf_engine *e, const char *path, const rf_load_def *def);
// .json: the scene, with bulk data in files beside it. .rfm: the scene with its meshes and trees, to be opened at once.
// .ply .obj .stl: all its triangles in one mesh. .vox .grid: its voxels, which must be all there is.
RF_API bool rf_scene_save(rf_scene *s, const char *path);
RF_API void rf_scene_destroy(rf_scene *s);
RF_API bool rf_scene_check(rf_scene *s); // do all files it names exist and hold what they should? Slow.

// What was ignored or repaired, one line each; NULL past the last. Valid until the scene changes.
RF_API const char *rf_scene_note(const rf_scene *s, size_t i);

// Every field is reached by a path, "materials.gold.roughness", and every value is JSON, "0.2". A path to a whole
// thing with a dictionary adds or replaces it, with null removes it. An edit that fails changes nothing.
RF_API bool rf_set(rf_scene *s, const char *path, const char *json);
RF_API const char *rf_get(rf_scene *s, const char *path); // JSON; valid until the next call on this scene
RF_API bool rf_undo(rf_scene *s);                         // false: nothing to undo
RF_API bool rf_redo(rf_scene *s);

// Moves everything that the scene's "animation" and its models' clips move to where it is at this moment, by setting
// fields as rf_set() does, but not for rf_undo(). Prepare the next world with the last one: what did not move is shared.
// On failure (a track's path leads nowhere any more) some of it has moved.
RF_API bool rf_set_time(rf_scene *s, double seconds);
// The clips that a glTF model brings, by number; NULL past the last. "timeline.clip" chooses one, without it the first
// plays. Lives as long as the scene.
RF_API const char *rf_clip_name(const rf_scene *s, size_t i);
// First and last moment in seconds and pictures a second, as the scene's "timeline" says or, where it does not, from
// the first key to the last. False: nothing moves. Results may be NULL.
RF_API bool rf_animation_range(const rf_scene *s, double *start, double *end, double *fps);

// Texts made from the field tables. The caller frees them with rf_free().
RF_API char *rf_schema(rf_engine *e);         // JSON Schema, draft 2020-12
RF_API char *rf_manual(rf_engine *e);         // the scene file's reference, Markdown
RF_API char *rf_scene_info(rf_scene *s);      // a summary for people
RF_API void rf_free(void *text);

// Bulk data goes in as arrays, copied at the call.
typedef struct rf_mesh_def {
  const float *positions;    // 3 floats a vertex, metres
  const float *normals;      // 3 floats a vertex, unit; NULL: flat
  const float *texcoords;    // 2 floats a vertex, v up; may be NULL
  const uint32_t *triangles; // 3 indices a triangle, counter-clockwise seen from outside
  size_t vertex_count, triangle_count;
  const char *material;      // name of a material of the scene; NULL: grey
  uint32_t magic;            // set by rf_default_mesh_def()
} rf_mesh_def;

RF_API rf_mesh_def rf_default_mesh_def(void);
RF_API rf_object rf_add_mesh(rf_scene *s, const char *name, const rf_mesh_def *def); // name may be NULL
RF_API rf_object rf_add(rf_scene *s, const char *shape, const char *name); // "sphere", "quad", "disk", "box"
RF_API rf_object rf_find(const rf_scene *s, const char *name);             // zero: none
RF_API bool rf_move(rf_scene *s, rf_object o, rf_frame frame);             // the cheap edit: no tree is rebuilt below it
// Moves all vertices of an object's mesh: positions and normals as in rf_mesh_def, copied, as many as it was made with.
// Its triangles, texture coordinates and material stay; every object that shows the mesh follows. Prepared with the
// world before, its tree is refitted, which takes a fraction of building it.
RF_API bool rf_move_vertices(rf_scene *s, rf_object o, const float *positions, const float *normals,
                             size_t vertex_count);
RF_API bool rf_remove(rf_scene *s, rf_object o);

// --- world: the prepared scene ----------------------------------------------------------------------
// A scene of one object: voxels of all surfaces of this one, `side` of them along its longest side, with the colours of
// its materials and textures. is_solid fills the inside of what is closed. Where a medium's density is at least `density`
// its colour fills a cell; 0: media are left out. side 0: as fine as the finest grid of a medium. Camera, sky and lights
// are left out.
RF_API rf_scene *rf_voxelise(rf_scene *s, int side, bool is_solid, float density);

// Shares with previous (may be NULL) whatever did not change. The field "render.tree" chooses between trees that are
// built fast and trees that are traced fast: rf_set(s, "render.tree", "\"best\""). Both worlds stay valid on their own; the scene may be
// edited or destroyed afterwards. Fails with RF_CANCELLED after rf_cancel().
RF_API rf_world *rf_prepare(rf_scene *s, const rf_world *previous);
RF_API void rf_world_destroy(rf_world *w);
// Another handle on the same world, given back with rf_world_destroy(). Rendering it works on the threads of e, which
// may be another engine than the one that prepared it and must outlive the handle; NULL: the same one.
RF_API rf_world *rf_world_share(const rf_world *w, rf_engine *e);
RF_API bool rf_world_bounds(const rf_world *w, rf_vec3 *lo, rf_vec3 *hi); // false: the world is empty

typedef struct rf_world_stats {
  uint64_t triangles;        // as seen, instances counted each
  uint64_t unique_triangles; // as stored
  uint64_t geometry_bytes, texture_bytes;
  uint64_t tree_bytes; // the part of geometry_bytes that is not the meshes' own arrays
} rf_world_stats;
RF_API rf_world_stats rf_world_take_stats(const rf_world *w);

typedef struct rf_ray {
  rf_vec3 origin;
  float tmin;
  rf_vec3 direction; // any length but zero; t counts in lengths of it
  float tmax;
} rf_ray;

typedef struct rf_hit { // what the search itself knows; rf_surface_at() tells the rest
  float t;              // tmax of the ray when nothing was hit
  float u, v;        // of a triangle: weights of its second and third vertex; of other shapes: 0..1 across it
  uint32_t part;     // triangle of the object's mesh, as numbered in its arrays
  uint32_t instance; // the placed shape among the world's; of use to rf_surface_at() only
  rf_object object;  // zero: nothing was hit. The visible surface of a light is no object: UINT32_MAX
} rf_hit;

typedef struct rf_surface {
  rf_vec3 position;  // by the shape, not by origin + t * direction: good to the last bits
  float error;       // metres a ray leaving here must start off: at position +- error * ng, with tmin 0
  rf_vec3 ng;        // geometric normal, unit, to the front side
  rf_vec3 n;         // shading normal, unit, on ng's side
  float u, v;        // texture coordinates, v up; 0 where there are none
  bool is_back;      // the ray came from behind
  uint32_t material; // 1 + index, as in RF_MATERIAL_ID
  const char *material_name; // lives as long as the world; NULL: the default one, or a light's
} rf_surface;

// Hot: these check nothing and allocate nothing; they use up to 256 KiB of the caller's stack. Nearest hit with
// tmin < t < tmax; any hit.
RF_API bool rf_intersect(const rf_world *w, const rf_ray *ray, rf_hit *hit);
RF_API bool rf_occluded(const rf_world *w, const rf_ray *ray);
// Many rays at once, in any order: faster than one by one.
RF_API void rf_intersect_n(const rf_world *w, const rf_ray *rays, rf_hit *hits, size_t count);
RF_API void rf_occluded_n(const rf_world *w, const rf_ray *rays, uint8_t *blocked, size_t count);
// The place a ray hit: hit must be an answer of this world to this ray, and not "nothing".
RF_API rf_surface rf_surface_at(const rf_world *w, const rf_ray *ray, const rf_hit *hit);

typedef struct rf_voxel {
  int32_t cell[3];   // the cell whose face was hit, counted from the grid's first corner
  int32_t beside[3]; // the one in front of that face; may lie outside the grid
  int32_t face;      // 0 to 5: -x +x -y +y -z +z of the grid
  int32_t size[3];   // of the grid
  uint32_t entry;    // of its palette, from 1
  float color[3];    // linear
  const char *name;  // of the entry; lives as long as the world; NULL: none
} rf_voxel;

// The voxel that was hit, for edits ("objects.NAME.shape.stroke", docs/voxels.md); false: something else was.
RF_API bool rf_voxel_at(const rf_world *w, const rf_ray *ray, const rf_hit *hit, rf_voxel *out);

// --- through gates: looking and walking ---------------------------------------------------------------
// In worlds of cells and gates the calls above see the unnamed cell alone, and gates as surfaces. These go through gates, by
// the very steps that pictures are made with, so that one walks where one sees. They allocate nothing.

// Which cell a name means, for rf_eye and below; NULL: the unnamed one, 0. -1: there is none of that name.
RF_API int rf_find_cell(const rf_scene *s, const char *name);
RF_API const char *rf_cell_name(const rf_scene *s, int cell); // lives as long as the scene; NULL: it has none
RF_API rf_vec3 rf_gravity(const rf_world *w, int cell); // m/s2

// Per square metre: 0 in flat cells, 1 / radius^2 in spherical, -1 / radius^2 in hyperbolic ones. In curved cells a place has
// the coordinates of the chart (docs/worlds.md); vectors at it (directions, frames, velocities, motions) have metres for
// length and are what they become when they are carried straight to the chart's middle. rf_eye_ray() makes such directions.
RF_API float rf_curvature(const rf_world *w, int cell);

// The nearest hit of a ray that begins in a cell; *arrived, which may be NULL, is the ray as it is in the cell of the hit,
// for rf_surface_at(), where t counts as it did, in lengths of its direction; in curved cells of the chart, from the last
// gate on. Returns false when nothing is met.
typedef struct rf_arrival {
  rf_ray ray;
  int cell;
  float scale;  // lengths there of one where the ray began
  float length; // metres of the way, as lengths are where it began; infinite if nothing was met
  int gates;    // gone through
} rf_arrival;
RF_API bool rf_look(const rf_world *w, int cell, const rf_ray *ray, rf_hit *hit, rf_arrival *arrived);

// Someone on the way: where, turned how, how fast, how large.
typedef struct rf_body {
  rf_frame frame;   // right, up, back, place; orthonormal, left-handed after an odd number of mirrors
  rf_vec3 velocity; // m/s
  float scale;      // of lengths: 1 to begin with, 0.5 behind a gate to a place where all is twice as small
  int cell;
} rf_body;

typedef struct rf_walk_end {
  float done;       // of the motion, 0..1
  rf_vec3 left;     // the rest of it, as it is where the walk ended
  int gates;        // gone through
  bool is_blocked;  // by the surface:
  rf_surface surface;
} rf_walk_end;
// Moves the body by `motion`, all of it but for what is in the way (if stops): through gates, which carry frame, velocity
// and scale along; what is left of the motion at a gate is walked behind it. The same way in one step or in many. In curved
// cells the way is a geodesic, and frame and velocity are carried along it (parallel transport). The ball of a wormhole is
// stepped over in no time; that of a black hole stops everyone, and has no material.
RF_API rf_walk_end rf_walk(const rf_world *w, rf_body *body, rf_vec3 motion, bool stops);

// --- proofs: what a world is, measured by walking and looking in it ------------------------------------
// The straight way from one place of a cell to another in its chart, without looking at what is between: where it leads to,
// as a vector as long as the way.
RF_API rf_vec3 rf_toward(const rf_world *w, int cell, rf_vec3 from, rf_vec3 to);

typedef struct rf_round { // what was found on a way round
  bool is_home;     // it ended where it began: in the same cell, no farther from there than 1/1000 of its length
  double miss;      // metres from where it began to where it ended; NAN: that is another cell
  double length;    // metres, as lengths are where it began
  int sides, gates; // walked; gone through
  double turn;      // radians, 0 to pi: by how much the frame that was carried along is turned; NAN unless it is home
  rf_vec3 axis;     // about which, by the frame it began with (right, up, back); zero: none
  bool is_mirrored; // and it has become left-handed, or right-handed again
  double scale;     // how long a metre is that was carried along
  // Of a way in one plane that was closed by its last side; else NAN:
  double angles;    // radians: all its inner angles together, from the directions it arrived and went on in
  double area;      // square metres, from the places of its corners alone; what is gone round twice counts twice
} rf_round;
// Walks straight legs, each as the frame that is carried along has it (right, up, back; metres), and then, if it returns,
// straight to where it should have begun by the geometry of its cell. Surfaces are no hindrance; no more than 4096 gates a
// leg. Fails with RF_BAD_ARGUMENT for legs that are not finite, or none.
RF_API bool rf_walk_round(const rf_world *w, const rf_body *body, const rf_vec3 *legs, size_t count, bool returns, rf_round *out);
// Walks to the first corner and from there round all of them, three or more, and back to the first. Corners are given as the
// body sees them: which way by its frame, as many metres away.
RF_API bool rf_walk_corners(const rf_world *w, const rf_body *body, const rf_vec3 *corners, size_t count, rf_round *out);
// The volume of a cell within its walls of space, cubic metres, by so many rays from a place in it in random directions, and
// the standard error of that. What stands in it is not taken off. Fails with RF_BAD_SCENE for a cell that has no walls all
// round, and for a place outside.
RF_API bool rf_cell_volume(const rf_world *w, int cell, rf_vec3 place, uint32_t rays, uint32_t seed, double *volume, double *error);

// --- film and rendering -----------------------------------------------------------------------------
typedef enum rf_lens { RF_PERSPECTIVE, RF_ORTHOGRAPHIC, RF_PANORAMIC } rf_lens;

typedef struct rf_eye {
  rf_frame frame;  // right, up, back, place; orthonormal
  rf_lens lens;
  float fov;       // perspective: vertical, radians; panoramic: horizontal span
  float focus;     // distance of the sharp plane, metres
  float aperture;  // radius of the lens, metres; 0: a pinhole
  int blades;      // of the aperture; under 3: round
  float height;    // orthographic: height of the picture in metres
  int cell;        // the cell the frame is in: 0 the unnamed one, else 1 + its place among
                   // the scene's "cells"; one that the world does not have counts as 0
} rf_eye;

// A camera of the scene by name; NULL: the main one. A scene without a camera (a bare model) gets one that shows
// all of w; w may be NULL otherwise. aspect = width / height of the picture. False: no such camera.
RF_API bool rf_camera(rf_scene *s, const rf_world *w, const char *name, float aspect, rf_eye *eye);

// The ray through a place of a picture of width x height pixels, (0, 0) its upper left corner; of the lens's middle.
// Its direction has unit length, so that t is metres.
RF_API rf_ray rf_eye_ray(const rf_eye *eye, float width, float height, float x, float y);

typedef enum rf_plane { // bits
  RF_BEAUTY = 1 << 0,      // rgb radiance and alpha; always there
  RF_ALBEDO = 1 << 1,
  RF_NORMAL = 1 << 2,      // world space
  RF_DEPTH = 1 << 3,       // metres along the view axis
  RF_POSITION = 1 << 4,    // world space, metres; within 65,536 m of the origin
  RF_OBJECT_ID = 1 << 5,   // 1 + index, 0: nothing
  RF_MATERIAL_ID = 1 << 6, // 1 + index, 0: nothing
  RF_VARIANCE = 1 << 7,    // of the pixel's mean luminance
  RF_SAMPLES = 1 << 8,     // how many a pixel got
  RF_ALL_PLANES = (1 << 9) - 1
} rf_plane;

RF_API rf_film *rf_film_create(rf_engine *e, int width, int height, unsigned planes);
RF_API void rf_film_clear(rf_film *f);
RF_API void rf_film_destroy(rf_film *f);
// Adds the samples of src to dst: same size and planes, samples disjoint. Exact: in any order, the same bytes.
RF_API bool rf_film_merge(rf_film *dst, const rf_film *src);
RF_API bool rf_film_size(const rf_film *f, int *width, int *height);

typedef enum rf_go { RF_GO_ON, RF_STOP_AFTER_PASS, RF_STOP_NOW } rf_go;

typedef struct rf_progress {
  double done;           // 0..1
  double seconds, eta;   // since the start; still to go
  double samples;        // a pixel, so far in this call
  double left;           // samples a pixel still to take; with a noise target, an estimate
  double noise;          // relative standard error of the picture, root mean square over tiles; 0 while unknown
  double quiet;          // the part of the tiles that are down to the noise target; 0 without one
  uint64_t rays;
} rf_progress;

typedef struct rf_render_def {
  const char *integrator;       // "path", "classic" or "whitted", or a view: "normal", "depth", "albedo", "uv", "id", "bary", "cost"
  int first_sample, end_sample; // samples of each pixel in this call: [first, end); those the film has are left out
  int part, part_end, parts;    // only parts [part, part_end) of the picture cut into so many; parts 0: all of it
  int max_depth, roulette_depth;
  int scatter;                  // rays at each surface of a chain, of the integrator "classic"
  uint64_t seed;                // same seed, same picture, on any number of threads
  const char *filter;           // "box", "blackman_harris", "gaussian"
  float filter_width;           // pixels; 0: the filter's usual width
  float clamp;                  // 0: off
  bool transparent;             // sky has alpha 0
  double budget_seconds;        // stop after the pass in which this is reached; 0: take all samples
  double noise_target;          // a tile (16 x 16 pixels) stops when its noise and that of the tiles around it are this
                                // low, so tiles differ in their samples; needs RF_VARIANCE; 0: take all samples
  rf_go (*progress)(void *user, const rf_progress *p); // about ten times a second, on the calling thread; may be NULL
  void *user;
  uint32_t magic;
} rf_render_def;

typedef struct rf_render_stats {
  double seconds;
  uint64_t camera_rays, bounce_rays, shadow_rays; // traced
  uint64_t nodes, prims;                          // tested
  uint64_t bad_samples;                           // not finite, counted as black; should be 0
  int samples;                                    // the most that any pixel got
  double mean_samples;                            // a pixel
  double noise, quiet;                            // at the end, as in rf_progress
  bool is_complete;                               // nothing is left to take: all samples are in, or the noise is reached
} rf_render_stats;

RF_API rf_render_def rf_default_render_def(void);
RF_API rf_render_def rf_scene_render_def(const rf_scene *s, int *width, int *height); // as its "render" says
// Adds samples to the film. RF_OK also when stopped by budget or RF_STOP_AFTER_PASS; the film then holds whole
// passes. stats may be NULL.
RF_API rf_status rf_render(const rf_world *w, const rf_eye *eye, const rf_render_def *def, rf_film *f,
                           rf_render_stats *stats);

// --- shots: pictures of what moves ------------------------------------------------------------------
// A scene seen while a camera's shutter is open about a moment: "shutter" of the camera says for how many frames, and
// "render.motion_steps" into how many steps that is cut. Each step has its own world and eye, and each sample sees one
// of them, so whatever can move is blurred: places, shapes, light and the eye.
typedef struct rf_shot rf_shot;
// Moves the scene to the moment (rf_set_time()) and leaves it there. previous (may be NULL) is a world to share with;
// camera and aspect as for rf_camera(). One step if the shutter is closed or nothing moves while it is open.
RF_API rf_shot *rf_shot_prepare(rf_scene *s, const rf_world *previous, const char *camera, float aspect,
                                double seconds);
RF_API int rf_shot_steps(const rf_shot *shot);
RF_API const rf_world *rf_shot_world(const rf_shot *shot); // of the step in the middle; lives as long as the shot
RF_API rf_eye rf_shot_eye(const rf_shot *shot);            // likewise
// As rf_render(). The film of the first n samples has each step in it equally often, to within one sample.
RF_API rf_status rf_shot_render(const rf_shot *shot, const rf_render_def *def, rf_film *f, rf_render_stats *stats);
RF_API void rf_shot_destroy(rf_shot *shot);

// --- films in files: to go on another day, or on many machines ---------------------------------------
// A number that tells pictures apart: of the scene as it is (but for samples and develop), all it shows, and the eye.
// Reads every mesh and texture once. Never 0, except when memory is out.
RF_API uint64_t rf_picture_key(const rf_scene *s, const rf_world *w, const rf_eye *eye);
// The film with its key (0: not said) and a note of the caller's (may be NULL), whole or not at all. What was there
// before stays beside it as PATH~. Fails for a film whose pass was broken off.
RF_API bool rf_film_keep(const rf_film *f, const char *path, uint64_t key, const char *note);
typedef struct rf_film_label {
  uint64_t key;
  char *note;    // freed with rf_free()
  bool is_older; // PATH was damaged, and this is PATH~, the one before
} rf_film_label;

RF_API rf_film *rf_film_open(rf_engine *e, const char *path, rf_film_label *label); // label may be NULL
// Which samples some pixel has, as pairs [first, end) in their order. Returns how many pairs there are; up to `most` of
// them are written. Not all pixels have them if only parts were rendered or there was a noise target.
RF_API size_t rf_film_samples(const rf_film *f, int (*pairs)[2], size_t most);
RF_API unsigned rf_film_planes(const rf_film *f);

// --- denoising --------------------------------------------------------------------------------------
enum { RF_DENOISE_PLANES = RF_ALBEDO | RF_NORMAL | RF_DEPTH | RF_VARIANCE }; // what a film needs for it

typedef struct rf_denoise_def {
  const char *kind;    // "fast": our own filter; "good", "best": Open Image Denoise's network, small or full; "off"
  const char *weights; // folder of the networks' .tza files; NULL: rayfold/ in the user's and the system's data folders
  uint32_t magic;
} rf_denoise_def;

RF_API rf_denoise_def rf_default_denoise_def(void);                    // "best"
RF_API rf_denoise_def rf_scene_denoise_def(const rf_scene *s);         // as its "render" says
// Makes a clean picture beside the film's own, which rf_develop() and rf_film_save() take until the film changes or
// it is made again ("off" drops it). The film, its planes and its hash stay as they are. Takes 64 bytes a pixel and up
// to 450 MB. Fails with RF_NOT_FOUND where the weights are not installed and RF_CANCELLED after rf_cancel(); there is no
// clean picture then. def may be NULL.
RF_API bool rf_film_denoise(rf_film *f, const rf_denoise_def *def);

// --- pictures ---------------------------------------------------------------------------------------
typedef struct rf_image { // rows from the top, channels interleaved
  int width, height, channels;
  float *pixels; // freed by rf_image_free()
} rf_image;

typedef struct rf_develop_def {
  float exposure;         // stops
  const char *tone_curve; // "linear", "filmic", "agx", "neutral"
  float gamma;            // extra power; 1: none
  uint32_t magic;
} rf_develop_def;

RF_API rf_develop_def rf_default_develop_def(void);
RF_API rf_develop_def rf_scene_develop_def(const rf_scene *s); // as its "develop" says
RF_API bool rf_film_plane(const rf_film *f, rf_plane plane, rf_image *out); // as it is: linear
RF_API bool rf_develop(const rf_film *f, const rf_develop_def *def, rf_image *out); // display-linear rgba, 0..1
// Of size and floats of the beauty plane alone: equal pictures, equal hashes, whatever other planes the film has and
// on every machine. 0 if memory is out.
RF_API uint64_t rf_film_hash(const rf_film *f);
RF_API void rf_image_free(rf_image *img);

typedef struct rf_save_def {
  int bits;            // PNG: 8 or 16, EXR: 16 or 32; 0: 8 and 16
  int quality;         // JPEG, WebP: 1..100; 0: 92
  bool developed;      // float formats, too, hold the developed picture instead of radiance
  const char *comment; // stored where the format can; may be NULL
  unsigned planes;     // of the film's planes, which .exr gets beside the picture; 0: all
  uint32_t magic;
} rf_save_def;

RF_API rf_save_def rf_default_save_def(void);
// The extension picks the writer: .png .jpg .webp hold the developed picture; .exr (all planes), .hdr and .pfm hold
// linear radiance. The file appears whole or not at all. develop and save may be NULL.
RF_API bool rf_film_save(const rf_film *f, const rf_develop_def *develop, const rf_save_def *save, const char *path);
RF_API bool rf_can_save(rf_engine *e, const char *path); // would the extension be understood?
// A picture file as linear rgba, alpha 1 where the file has none; freed by rf_image_free().
RF_API bool rf_image_load(rf_engine *e, const char *path, rf_image *out);
// A linear picture of 3 or 4 channels into a file, whole or not at all; display formats encode 0..1. save may be NULL.
RF_API bool rf_image_save(rf_engine *e, const rf_image *img, const rf_save_def *save, const char *path);
// Converts a picture file into another format (a float format to a display one by develop).
RF_API bool rf_image_convert(rf_engine *e, const char *from, const char *to, const rf_develop_def *develop,
                             const rf_save_def *save);

// --- live: a picture that follows the eye and every edit ----------------------------------------------
// Two threads work for it: one applies edits and prepares the next world, one renders frames of the newest world for the
// newest view. Nobody waits for them: what is asked while they work replaces what was asked before. While something
// changes, frames keep to a time by their resolution; then the picture becomes finer until it has all its samples and
// equals, bit by bit, what rf_render() makes of them; then the threads sleep. None of it heeds rf_cancel().
typedef struct rf_live rf_live;

typedef struct rf_live_def {
  const rf_world *previous;  // of the scene in some earlier state, for the first world to share with; may be NULL
  bool stepped;              // no threads: all work is done in rf_live_step(). For tests and recordings
  void (*ready)(void *user); // there is a frame or a message; on a thread of the driver, so only wake yours. May be NULL
  void *user;
  uint32_t magic;
} rf_live_def;

typedef struct rf_live_view { // what to show
  rf_eye eye;
  int width, height;        // pixels of the window
  rf_render_def render;     // its samples are those of the finished picture; progress and limits are not looked at
  rf_develop_def develop;
  bool denoise;             // pictures of light are cleaned by the fast denoiser
  bool reproject;           // frames of a moving eye carry on what the ones before saw
  double frame_seconds;     // what a frame may take while something changes
  int step;                 // 0: resolution by frame_seconds; 1, 2, 4, 8: a pixel is always this wide while it changes, and
                            // no clock is looked at
  int blocks;               // of the integrator whitted while something changes: pixels between alike corners of blocks are
                            // filled; 4, 8 or 16 wide at most, 0: every pixel is traced
  bool show_blocks;         // a view: blocks of one colour red, filled ones blue, what was traced as it is
  uint32_t magic;
} rf_live_view;

typedef struct rf_live_frame { // the arrays live until the next rf_live_take()
  const uint32_t *pixels;  // 0xffrrggbb, rows from the top
  int width, height;       // of the window
  const uint32_t *objects; // as RF_OBJECT_ID, one each rendered pixel
  int render_width, render_height;
  int samples;             // a rendered pixel
  bool is_moving;          // made while something changed
  bool is_finished;        // the picture has all its samples
  double prepare_seconds;  // of the world it shows
  double render_seconds, denoise_seconds, show_seconds;
  double traced;           // part of the rendered pixels that rays were asked for; the others lie between them
  uint64_t rays;           // traced since the frame before
  uint64_t number;         // counts frames
  uint64_t view, edit;     // of the newest rf_live_show() and edit that it shows; those that change nothing bring no frame
  rf_eye eye;              // that it was made with
} rf_live_frame;

RF_API rf_live_def rf_default_live_def(void);
RF_API rf_live_view rf_default_live_view(void); // 16 ms a frame, denoised, reprojected, blocks of 8; eye and size are still to be set
RF_API rf_live *rf_live_create(rf_scene *s, const rf_live_def *def); // the scene is the driver's now, even if this fails
RF_API void rf_live_destroy(rf_live *l);                             // with the scene; within 50 ms

// Each returns its number (0: refused, see rf_error()) and never waits. Failures of edits come as messages; the picture
// then stays as it was.
RF_API uint64_t rf_live_show(rf_live *l, const rf_live_view *view);
// rf_set() as soon as may be. An edit that goes on with the one before, of the same path, takes its place: a drag is one
// step of undo, and values in between that nobody has seen are skipped.
RF_API uint64_t rf_live_set(rf_live *l, const char *path, const char *json, bool goes_on);
RF_API uint64_t rf_live_undo(rf_live *l);
RF_API uint64_t rf_live_redo(rf_live *l);
// Another scene in its place, which is taken over, even if this is refused; what is equal in both is kept. When it cannot
// be prepared, the one there is stays.
RF_API uint64_t rf_live_replace(rf_live *l, rf_scene *s);

// The newest frame; false: none since the last call.
RF_API bool rf_live_take(rf_live *l, rf_live_frame *out);
// The newest message; false: none since the last call.
RF_API bool rf_live_message(rf_live *l, char *out, size_t size);
// The newest world, given back with rf_world_destroy(); NULL: there is none yet.
RF_API rf_world *rf_live_world(rf_live *l);
// The scene with all edits asked so far, to read or to save it; further ones wait until it is given back. NULL: that
// takes longer than `seconds`.
RF_API rf_scene *rf_live_borrow(rf_live *l, double seconds);
RF_API void rf_live_return(rf_live *l);
// Of a stepped one: applies what was asked and works on one frame. False: nothing was left to do.
RF_API bool rf_live_step(rf_live *l);

#ifdef __cplusplus
}
#endif
#endif
