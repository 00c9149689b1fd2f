// See import_mtl.h. Each statement of a material is gathered first (Mtl below) and made a `pbr` material at its end,
// because what one means depends on others. How:
//
//   base_color   Kd * map_Kd; a factor of zero along with a map counts as one, here and below, since a map that
//                shows nothing is never meant
//   specular     specular_color = 2 Ks: Ks 0.5 is the plain dielectric, as Blender has it (its "specular" 0.5 is
//                4 % at normal incidence); Ks 0, and illum 0 and 1, which have no highlight, give specular 0
//   roughness    Pr; else (2 / (Ns + 2))^(1/4), from alpha = roughness^2 and the Blinn-Phong exponent of equal
//                width, alpha^2 = 2 / (Ns + 2) (Walter et al. 2007, section 5.4)
//   metallic     Pm; else a mirror of old (illum 3 or 5, Ks bright beside Kd) is polished metal of colour Ks
//   opacity      d, else 1 - Tr, with map_d: alpha_mode blend, of which a mask is a special case
//   transmission with illum 4, 6 and 7 (glass): Tf, else 1 - d, else 1 for 6 and 7; then d is used up. With illum 9
//                (glass without refraction): Tf, in a thin wall; a d is opacity, as Blender writes it
//   ior          Ni; values up to 1 are what programs write that do not know, so only glass believes them
//   emission     Ke * map_Ke
//   clearcoat    Pc, Pcr
//   sheen        Ps, white, with a sheen_roughness of 0.5
//   anisotropy   aniso, whose negative values stretch across; anisor, 1 for once around
//   normals      norm, and a bump map whose name says that it is a normal map; -bm is its strength
//   bump         every other bump map: heights of -bm centimetres

#include "scene/import_mtl.h"

#include "base/hash.h"
#include "scene/import.h"
#include "scene/lines.h"

#include <ctype.h>
#include <strings.h>

typedef enum MapUse { MAP_KD, MAP_KS, MAP_KE, MAP_D, MAP_PR, MAP_PM, MAP_NORMAL, MAP_BUMP, MAP_COUNT } MapUse;

typedef struct Map {
  const char *file; // relative to the OBJ's folder, in the arena; NULL is none
  float offset[3], scale[3];
  float gain, bias, strength;
  bool clamp;
  char channel; // of -imfchan; 0: not given
} Map;

typedef struct Mtl {
  int32_t name_i; // in the wanted names
  float kd[3], ks[3], ke[3], tf[3];
  float ns, d, tr, ni, pr, pm, pc, pcr, ps, aniso, anisor;
  bool has_kd, has_ks, has_ke, has_tf, has_ns, has_d, has_tr, has_ni, has_pr, has_pm;
  int illum; // -1: not given
  Map maps[MAP_COUNT];
} Mtl;

typedef struct Library {
  Scene *scene;
  const char *obj_path, *path;
  const LoadOptions *options;
  Lines lines;
  bool is_open; // mtl is one that is wanted
  Mtl mtl;
  MtlWants *wants;
  Names ignored;
} Library;

// --- maps -------------------------------------------------------------------------------------------
// Options of a map statement, and how many words follow: fixed, or up to three numbers.
typedef struct MapOption {
  const char *name;
  int words; // -1: one to three numbers
} MapOption;

static const MapOption map_options[] = {
    {"-blendu", 1}, {"-blendv", 1}, {"-bm", 1}, {"-boost", 1}, {"-cc", 1},   {"-clamp", 1}, {"-imfchan", 1},
    {"-mm", 2},     {"-o", -1},     {"-s", -1}, {"-t", -1},    {"-type", 1}, {"-texres", 1}};

static const MapOption *find_option(const char *p, const char *end)
{
  for (size_t i = 0; i < sizeof map_options / sizeof *map_options; i++)
    if (word_is(p, end, map_options[i].name)) return &map_options[i];
  return NULL;
}

// A word that is a number to its end; "1.png" is not.
static bool read_number_word(const char **p, const char *end, float *out)
{
  const char *q = skip_blanks(*p, end), *stop = skip_word(q, end);
  float x;
  if (number_float(q, stop, &x) != stop || !isfinite(x)) return false;
  *out = x;
  *p = stop;
  return true;
}

static bool is_last_word(const char *p, const char *end)
{
  p = skip_word(skip_blanks(p, end), end);
  return skip_blanks(p, end) == end;
}

// The values of -o, -s or -t: v and w may be missing, and the last word of the line is the file even if its name
// is a number.
static void read_up_to_three(const char **p, const char *end, float out[3])
{
  for (int i = 0; i < 3; i++)
    if (is_last_word(*p, end) || !read_number_word(p, end, out + i)) return;
}

static void read_option_value(Map *m, const char *name, const char *p, const char *end)
{
  float x[2];
  const char *q = p;
  if (!strcmp(name, "-bm") && read_number_word(&q, end, x)) m->strength = x[0];
  if (!strcmp(name, "-clamp")) m->clamp = word_is(p, end, "on");
  if (!strcmp(name, "-imfchan")) m->channel = p < end ? (char)(*p | 0x20) : 0;
  if (!strcmp(name, "-mm") && read_number_word(&q, end, x) && read_number_word(&q, end, x + 1)) {
    m->bias = x[0];
    m->gain = max_f(x[1], 0);
  }
}

// Reads the options at *p, which is left at the file's name.
static Map read_options(Library *l, const char **p, const char *end)
{
  Map m = {.scale = {1, 1, 1}, .gain = 1, .strength = 1};
  for (;;) {
    const char *word = skip_blanks(*p, end), *after = skip_word(word, end);
    const MapOption *option = find_option(word, after);
    *p = word;
    if (!option) return m;
    const char *value = skip_blanks(after, end);
    *p = after;
    if (option->words < 0) {
      float numbers[3] = {0, 0, 0};
      float *to = option->name[1] == 'o' ? m.offset : option->name[1] == 's' ? m.scale : numbers;
      read_up_to_three(p, end, to);
      if (to == numbers && (numbers[0] != 0 || numbers[1] != 0))
        note_once(&l->scene->notes, "%s: turbulence of maps (-t) is ignored", l->path);
      continue;
    }
    for (int i = 0; i < option->words; i++) *p = skip_word(skip_blanks(*p, end), end);
    read_option_value(&m, option->name, value, *p);
  }
}

// File names may hold blanks, may be quoted, and may come with options after them never.
static Map read_map(Library *l, const char *p, const char *end)
{
  Map m = read_options(l, &p, end);
  if (end - p >= 2 && *p == '"' && end[-1] == '"') {
    p++;
    end--;
  }
  Text name = {0};
  text_add_n(&name, p, (size_t)(end - p));
  if (name.length)
    m.file = import_find_file(l->scene, l->obj_path, l->path, text_get(&name), l->options);
  else
    note_once(&l->scene->notes, "%s: a map without a file name is left out", l->path);
  text_finish(&name);
  return m;
}

// The name's part before the extension, in lower case.
static void lower_stem(char out[200], const char *file)
{
  const char *base = path_base(file);
  size_t n = (size_t)(path_extension(file) - base);
  if (!*path_extension(file) || n >= 200) n = strnlen(base, 199);
  for (size_t i = 0; i < n; i++) out[i] = (char)tolower((unsigned char)base[i]);
  out[n] = 0;
}

static bool is_normal_map_name(const char *file)
{
  char stem[200];
  lower_stem(stem, file);
  return strstr(stem, "normal") || strstr(stem, "nrm") || strstr(stem, "_nor_") || strstr(stem, "_ddn") ||
         text_ends(stem, "_n") || text_ends(stem, "-n") || text_ends(stem, "_nor") ||
         text_ends(stem, "_norm") || text_ends(stem, "_nml");
}

static int32_t wrap_of(const Map *m)
{
  return m->clamp ? WRAP_CLAMP : WRAP_REPEAT;
}

static uint64_t use_key(const Map *m)
{
  const float numbers[] = {m->offset[0], m->offset[1], m->scale[0], m->scale[1], m->gain, m->bias, m->clamp};
  return hash_bytes(hash_bytes(0, m->file, strlen(m->file)), numbers, sizeof numbers);
}

static bool is_same_use(const Texture *t, const Map *m)
{
  return text_equal(t->image.file, m->file) && t->common.offset[0] == m->offset[0] &&
         t->common.offset[1] == m->offset[1] && t->common.scale[0] == m->scale[0] &&
         t->common.scale[1] == m->scale[1] && t->image.wrap_u == wrap_of(m) && t->image.gain[0] == m->gain &&
         t->image.bias[0] == m->bias;
}

// The same picture used in the same way is one texture.
static int32_t map_texture(Library *l, const Map *m)
{
  if (!m->file) return -1;
  const uint64_t key = use_key(m);
  size_t step = 0;
  for (const int32_t *i; (i = table_next(&l->wants->textures, key, &step));)
    if (is_same_use(&l->scene->textures.items[*i], m)) return *i;
  const int32_t texture_i = import_add_image(l->scene, m->file);
  if (texture_i < 0) return -1;
  (void)table_add(&l->wants->textures, key,
                  texture_i); // forgotten: the next use makes another, which is as good
  Texture *t = &l->scene->textures.items[texture_i];
  for (int k = 0; k < 2; k++) {
    t->common.offset[k] = m->offset[k];
    t->common.scale[k] = m->scale[k];
  }
  t->image.wrap_u = t->image.wrap_v = wrap_of(m);
  for (int k = 0; k < 3; k++) {
    t->image.gain[k] = m->gain;
    t->image.bias[k] = m->bias;
  }
  return texture_i;
}

// The index in a "r|g|b|a" field; grey pictures have their value in the first.
static int32_t map_channel(const Map *m)
{
  switch (m->channel) {
  case 'g': return 1;
  case 'b': return 2;
  case 'm': return 3;
  }
  return 0;
}

// --- a material's end -------------------------------------------------------------------------------
static void copy_color(float to[3], const float from[3], float high)
{
  for (int k = 0; k < 3; k++) to[k] = clamp_f(from[k], 0, high);
}

static float brightest(const float c[3])
{
  return max_f(c[0], max_f(c[1], c[2]));
}

// A factor beside a map: one when there is none, or a useless one.
static float factor_with_map(bool is_given, float factor)
{
  return is_given && factor > 0 ? factor : 1;
}

static void set_base(Library *l, const Mtl *m, Pbr *pbr)
{
  static const float white[3] = {1, 1, 1};
  pbr->base_color_texture = map_texture(l, &m->maps[MAP_KD]);
  if (m->has_kd) copy_color(pbr->base_color, m->kd, 1);
  if (pbr->base_color_texture >= 0 && !(m->has_kd && brightest(m->kd) > 0))
    copy_color(pbr->base_color, white, 1);
}

static void set_specular(Library *l, const Mtl *m, Pbr *pbr)
{
  const bool is_pbr = m->has_pr || m->has_pm;
  pbr->specular_color_texture = map_texture(l, &m->maps[MAP_KS]);
  if (m->has_ks && (brightest(m->ks) > 0 || pbr->specular_color_texture < 0))
    for (int k = 0; k < 3; k++)
      pbr->specular_color[k] = clamp_f(2 * m->ks[k], 0, 25); // 25 * 4 % is all light
  const bool is_black = m->has_ks && brightest(pbr->specular_color) <= 0;
  if (is_black || (!is_pbr && (m->illum == 0 || m->illum == 1))) pbr->specular = 0;
}

static void set_roughness(Library *l, const Mtl *m, Pbr *pbr)
{
  const Map *map = &m->maps[MAP_PR];
  pbr->roughness_texture = map_texture(l, map);
  pbr->roughness_channel = map_channel(map);
  if (pbr->roughness_texture >= 0)
    pbr->roughness = factor_with_map(m->has_pr, m->pr);
  else if (m->has_pr)
    pbr->roughness = m->pr;
  else if (m->has_ns)
    pbr->roughness = powf(2 / (max_f(m->ns, 0) + 2), 0.25f);
  pbr->roughness = clamp_f(pbr->roughness, 0, 1);
}

// Mirrors of the ray tracers of old reflect sharply whatever their Ns, which was for the lights' highlights only.
static void set_metallic(Library *l, const Mtl *m, Pbr *pbr)
{
  const Map *map = &m->maps[MAP_PM];
  pbr->metallic_texture = map_texture(l, map);
  pbr->metallic_channel = map_channel(map);
  if (pbr->metallic_texture >= 0)
    pbr->metallic = factor_with_map(m->has_pm, m->pm);
  else if (m->has_pm)
    pbr->metallic = m->pm;
  pbr->metallic = clamp_f(pbr->metallic, 0, 1);
  const bool reflects = m->illum == 3 || m->illum == 5;
  if (m->has_pm || m->has_pr || !reflects || !m->has_ks || pbr->base_color_texture >= 0) return;
  if (brightest(m->ks) < 0.5f || brightest(pbr->base_color) > brightest(m->ks) / 4) return;
  pbr->metallic = 1;
  pbr->roughness = 0;
  copy_color(pbr->base_color, m->ks, 1);
}

static float mtl_opacity(Library *l, const Mtl *m)
{
  if (m->has_d) return clamp_f(m->d, 0, 1);
  if (!m->has_tr) return 1;
  if (m->tr >= 1) { // nobody models what cannot be seen; some programs write Tr as others write d
    note_once(&l->scene->notes, "%s: Tr 1 without d is taken as opaque", l->path);
    return 1;
  }
  return clamp_f(1 - m->tr, 0, 1);
}

static void set_opacity(Library *l, const Mtl *m, Pbr *pbr, float opacity)
{
  const Map *map = &m->maps[MAP_D];
  const bool has_map = map->file;
  const bool is_alpha_of_base = has_map && text_equal(map->file, m->maps[MAP_KD].file);
  if (opacity >= 1 && !has_map) return;
  pbr->alpha_mode = ALPHA_BLEND;
  pbr->opacity = has_map && opacity <= 0 ? 1 : opacity;
  // The picture of map_Kd named again means its alpha, which the base colour's texture brings along.
  if (!is_alpha_of_base) pbr->opacity_texture = map_texture(l, map);
  if (has_map && !is_alpha_of_base && map->channel && map->channel != 'r' && map->channel != 'l')
    note_once(&l->scene->notes, "%s: map_d takes the red channel, whatever -imfchan says", l->path);
}

// What passes the glass, and whether `opacity` was spent on it.
static float glass_part(const Mtl *m, float *opacity)
{
  const bool refracts = m->illum == 4 || m->illum == 6 || m->illum == 7;
  if (!refracts && m->illum != 9) return 0;
  const float tf = m->has_tf ? clamp_f(brightest(m->tf), 0, 1) : 0;
  if (!refracts) return tf;
  const float part = tf > 0 ? tf : *opacity < 1 ? 1 - *opacity : m->illum == 4 || m->has_tf ? 0 : 1;
  *opacity = 1;
  return part;
}

static void set_transmission(const Mtl *m, Pbr *pbr, float part)
{
  static const float white[3] = {1, 1, 1};
  pbr->transmission = part;
  if (!(part > 0)) return;
  pbr->thin_walled = m->illum == 9;
  if (!m->has_pr) pbr->roughness = 0; // sharp, as for mirrors
  if (pbr->base_color_texture >= 0) return;
  const float tf = m->has_tf ? brightest(m->tf) : 0;
  if (tf > 0)
    for (int k = 0; k < 3; k++) pbr->base_color[k] = clamp_f(m->tf[k] / tf, 0, 1);
  else if (brightest(pbr->base_color) < 0.01f)
    copy_color(pbr->base_color, white, 1);
}

static void set_emission(Library *l, const Mtl *m, Pbr *pbr)
{
  static const float white[3] = {1, 1, 1};
  pbr->emissive_texture = map_texture(l, &m->maps[MAP_KE]);
  if (m->has_ke) copy_color(pbr->emissive, m->ke, NO_LIMIT);
  if (pbr->emissive_texture >= 0 && !(m->has_ke && brightest(m->ke) > 0)) copy_color(pbr->emissive, white, 1);
}

// A bump map is heights unless its name says that it is a normal map. MTL gives -bm no unit; 1 is what most programs
// write and none mean as a metre, so it stands for a centimetre here.
static void set_normals(Library *l, const Mtl *m, Pbr *pbr)
{
  const float metres_of_bm = 0.01f;
  const Map *normal = &m->maps[MAP_NORMAL], *bump = &m->maps[MAP_BUMP];
  if (!normal->file && bump->file && is_normal_map_name(bump->file)) {
    normal = bump;
  } else if (bump->file) {
    pbr->bump_texture = map_texture(l, bump);
    pbr->bump_scale = clamp_f(bump->strength * metres_of_bm, -NO_LIMIT, NO_LIMIT);
  }
  pbr->normal_texture = map_texture(l, normal);
  pbr->normal_scale = clamp_f(normal->strength, -16, 16);
}

static void set_fibres_and_brushing(const Mtl *m, Pbr *pbr)
{
  if (m->ps > 0) {
    for (int k = 0; k < 3; k++) pbr->sheen_color[k] = clamp_f(m->ps, 0, 1);
    pbr->sheen_roughness = 0.5f;
  }
  pbr->anisotropy = clamp_f(fabsf(m->aniso), 0, 1);
  pbr->anisotropy_rotation = fmodf(360 * m->anisor + (m->aniso < 0 ? 90 : 0), 360);
}

static bool close_material(Library *l, Err *err)
{
  if (!l->is_open) return true;
  const Mtl *m = &l->mtl;
  const int32_t i = scene_add_material(l->scene, MATERIAL_PBR, names_get(l->wants->names, m->name_i));
  if (i < 0) return err_memory(err, l->path, sizeof(Material));
  l->wants->found[m->name_i] = i;
  l->is_open = false;
  Pbr *pbr = &l->scene->materials.items[i].pbr;
  set_base(l, m, pbr);
  set_specular(l, m, pbr);
  set_roughness(l, m, pbr);
  set_metallic(l, m, pbr);
  float opacity = mtl_opacity(l, m);
  set_transmission(m, pbr, glass_part(m, &opacity));
  set_opacity(l, m, pbr, opacity);
  set_emission(l, m, pbr);
  set_normals(l, m, pbr);
  set_fibres_and_brushing(m, pbr);
  if (m->has_ni && (m->ni > 1 || (m->ni > 0 && pbr->transmission > 0))) pbr->ior = clamp_f(m->ni, 1, 5);
  pbr->clearcoat = clamp_f(m->pc, 0, 1);
  pbr->clearcoat_roughness = clamp_f(m->pcr, 0, 1);
  return true;
}

// --- statements -------------------------------------------------------------------------------------
typedef enum RowKind { ROW_NUMBER, ROW_COLOR, ROW_ILLUM, ROW_MAP, ROW_SILENT } RowKind;

typedef struct Row {
  const char *keyword;
  RowKind kind;
  size_t offset, has_offset; // in Mtl; has_offset 0: none
  MapUse use;
} Row;

#define NUMBER_(word, x)                     \
  {                                          \
    word, ROW_NUMBER, offsetof(Mtl, x), 0, 0 \
  }
#define NUMBER(word, x)                                           \
  {                                                               \
    word, ROW_NUMBER, offsetof(Mtl, x), offsetof(Mtl, has_##x), 0 \
  }
#define COLOR(word, x)                                           \
  {                                                              \
    word, ROW_COLOR, offsetof(Mtl, x), offsetof(Mtl, has_##x), 0 \
  }
#define MAP(word, use)       \
  {                          \
    word, ROW_MAP, 0, 0, use \
  }
#define SILENT(word)          \
  {                           \
    word, ROW_SILENT, 0, 0, 0 \
  }

// Ambient light is what a ray tracer finds out by itself, so Ka and its map go without a word.
static const Row rows[] = {COLOR("Kd", kd),
                           COLOR("Ks", ks),
                           COLOR("Ke", ke),
                           COLOR("Tf", tf),
                           NUMBER("Ns", ns),
                           NUMBER("d", d),
                           NUMBER("Tr", tr),
                           NUMBER("Ni", ni),
                           NUMBER("Pr", pr),
                           NUMBER("Pm", pm),
                           NUMBER_("Pc", pc),
                           NUMBER_("Pcr", pcr),
                           NUMBER_("Ps", ps),
                           NUMBER_("aniso", aniso),
                           NUMBER_("anisor", anisor),
                           {"illum", ROW_ILLUM, 0, 0, 0},
                           SILENT("Ka"),
                           SILENT("map_Ka"),
                           SILENT("map_aat"),
                           SILENT("sharpness"),
                           MAP("map_Kd", MAP_KD),
                           MAP("map_Ks", MAP_KS),
                           MAP("map_Ke", MAP_KE),
                           MAP("map_d", MAP_D),
                           MAP("map_Pr", MAP_PR),
                           MAP("map_Pm", MAP_PM),
                           MAP("norm", MAP_NORMAL),
                           MAP("map_norm", MAP_NORMAL),
                           MAP("map_Kn", MAP_NORMAL),
                           MAP("bump", MAP_BUMP),
                           MAP("map_bump", MAP_BUMP)};

static const Row *find_row(const char *p, const char *end)
{
  for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
    if (word_is(p, end, rows[i].keyword)) return &rows[i];
  return NULL;
}

// One number is grey; "spectral" and "xyz" are other notations that nobody writes.
static bool read_color(const char *p, const char *end, float out[3])
{
  float x[3];
  const int n = line_floats(&p, end, x, 3);
  if (n < 1) return false;
  for (int k = 0; k < 3; k++) {
    const float c = n == 3 ? x[k] : x[0];
    if (!isfinite(c)) return false;
    out[k] = c;
  }
  return true;
}

static bool read_scalar(const char *p, const char *end, float *out)
{
  if (!strncasecmp(p, "-halo", (size_t)(end - p) < 5 ? (size_t)(end - p) : 5) && end - p > 5) p += 5;
  float x;
  if (line_floats(&p, end, &x, 1) < 1 || !isfinite(x)) return false;
  *out = x;
  return true;
}

static void read_row(Library *l, const Row *row, const char *p, const char *end)
{
  char *mtl = (char *)&l->mtl;
  float x;
  bool ok = true;
  switch (row->kind) {
  case ROW_NUMBER: ok = read_scalar(p, end, (float *)(void *)(mtl + row->offset)); break;
  case ROW_COLOR: ok = read_color(p, end, (float *)(void *)(mtl + row->offset)); break;
  case ROW_ILLUM:
    ok = read_scalar(p, end, &x);
    if (ok) l->mtl.illum = (int)clamp_f(x, -1, 100);
    break;
  case ROW_MAP: l->mtl.maps[row->use] = read_map(l, p, end); break;
  case ROW_SILENT: break;
  }
  if (ok && row->has_offset) *(bool *)(mtl + row->has_offset) = true;
  if (!ok)
    note_once(&l->scene->notes, "%s:%zu: %s needs numbers; the line is ignored", l->path, l->lines.number,
              row->keyword);
}

// One note for each keyword, remembered here because the notes compare with all they have.
static void ignore_row(Library *l, const char *p, const char *end)
{
  enum { MOST_IGNORED = 40 };
  if (end - p > 30 || names_count(&l->ignored) >= MOST_IGNORED) return;
  for (const char *q = p; q < end; q++)
    if (!isalnum((unsigned char)*q) && *q != '_') return;
  if (names_find(&l->ignored, p, (size_t)(end - p)) >= 0) return;
  note_once(&l->scene->notes, "%s: \"%.*s\" is ignored", l->path, SHOWN(p, end));
  (void)names_add(&l->ignored, &l->scene->arena, p, (size_t)(end - p));
}

// The first definition of a name counts, as in the libraries' search order.
static void open_material(Library *l, const char *p, const char *end)
{
  const int32_t name_i = names_find(l->wants->names, p, (size_t)(end - p));
  l->is_open = name_i >= 0 && l->wants->found[name_i] < 0;
  if (l->is_open) l->mtl = (Mtl){.name_i = name_i, .illum = -1};
}

bool import_mtl(MtlWants *wants, const char *mtl_path, const FileBytes *file, Err *err)
{
  Library l = {.scene = wants->scene,
               .obj_path = wants->obj_path,
               .path = mtl_path,
               .options = wants->options,
               .wants = wants};
  lines_init(&l.lines, mtl_path, file->data, file->size);
  const char *p, *end;
  bool ok = true;
  while (ok && lines_next(&l.lines, &p, &end)) {
    p = skip_blanks(p, end);
    if (p == end || *p == '#') continue;
    const char *after = skip_word(p, end), *rest = skip_blanks(after, end);
    end = trim_end(rest, end);
    if (word_is(p, after, "newmtl")) {
      ok = close_material(&l, err);
      if (ok) open_material(&l, rest, end);
    } else if (l.is_open) {
      const Row *row = find_row(p, after);
      if (row)
        read_row(&l, row, rest, end);
      else
        ignore_row(&l, p, after);
    }
  }
  ok = ok && close_material(&l, err);
  names_finish(&l.ignored);
  lines_finish(&l.lines);
  return ok;
}
