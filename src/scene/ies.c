// See ies.h. Lines of words come first, up to TILT=; from there on a stream of numbers whose line breaks mean nothing.

#include "scene/ies.h"

#include "base/mem.h"
#include "scene/lines.h"

#include <float.h>
#include <math.h>

enum { MOST_ANGLES = 10000, MOST_VALUES = 4000000 };

typedef struct Reader {
  Lines lines;
  const char *p, *end; // what is left of the line at hand
  Err *err;
} Reader;

static bool starts_with(const char *p, const char *end, const char *word)
{
  const size_t length = strlen(word);
  return (size_t)(end - p) >= length && word_is(p, p + length, word);
}

static bool is_gap(char c)
{
  return is_blank(c) || c == ',';
}

// The next number, wherever it stands.
static bool read_number(Reader *r, const char *what, double *out)
{
  while (r->p < r->end && is_gap(*r->p)) r->p++;
  while (r->p == r->end) {
    if (!lines_next(&r->lines, &r->p, &r->end))
      return lines_fail(&r->lines, r->err, "the file ends where %s should be; it is cut off", what);
    while (r->p < r->end && is_gap(*r->p)) r->p++;
  }
  const char *after = number_double(r->p, r->end, out);
  if (!after || (after < r->end && !is_gap(*after)) || !(fabs(*out) <= (double)FLT_MAX))
    return lines_fail(&r->lines, r->err, "\"%.*s\" is no number; here should be %s",
                      SHOWN(r->p, skip_word(r->p, r->end)), what);
  r->p = after;
  return true;
}

static bool read_count(Reader *r, const char *what, uint32_t *out)
{
  double x = 0;
  if (!read_number(r, what, &x)) return false;
  if (x < 1 || x > MOST_ANGLES || x != floor(x))
    return lines_fail(&r->lines, r->err, "%s is %g; it must be a whole number from 1 to %d", what, x, MOST_ANGLES);
  *out = (uint32_t)x;
  return true;
}

static bool read_factor(Reader *r, const char *what, double *factor)
{
  double x = 0;
  if (!read_number(r, what, &x)) return false;
  if (!(x > 0)) return lines_fail(&r->lines, r->err, "%s is %g; it must be above 0", what, x);
  *factor *= x;
  return true;
}

static bool skip_numbers(Reader *r, const char *const *what, int count)
{
  double x;
  for (int i = 0; i < count; i++)
    if (!read_number(r, what[i], &x)) return false;
  return true;
}

// The words: the format's name in the first line, keywords, and TILT.
static bool read_words(Reader *r)
{
  if (!lines_next(&r->lines, &r->p, &r->end) ||
      (!starts_with(r->p, r->end, "IESNA:LM-63-1995") && !starts_with(r->p, r->end, "IESNA:LM-63-2002") &&
       !starts_with(r->p, r->end, "IESNA91")))
    return lines_fail(&r->lines, r->err, "the first line must be IESNA:LM-63-1995, IESNA:LM-63-2002 or IESNA91");
  for (;;) {
    if (!lines_next(&r->lines, &r->p, &r->end))
      return lines_fail(&r->lines, r->err, "the file ends before the line TILT=NONE");
    if (!starts_with(r->p, r->end, "TILT=")) continue;
    const char *tilt = r->p + 5, *end = trim_end(tilt, r->end);
    r->p = r->end;
    return word_is(tilt, end, "NONE") ||
           lines_fail(&r->lines, r->err, "TILT=%.*s is not understood; only lamps of TILT=NONE are", SHOWN(tilt, end));
  }
}

static bool read_angles(Reader *r, const char *what, uint32_t count, float **out)
{
  float *angles = mem_alloc(count, sizeof *angles);
  *out = angles;
  if (!angles) return err_memory(r->err, "a lamp's angles", count * sizeof *angles);
  for (uint32_t i = 0; i < count; i++) {
    double x = 0;
    if (!read_number(r, what, &x)) return false;
    if (x < 0 || x > 360) return lines_fail(&r->lines, r->err, "%s of %g is outside 0 to 360 deg", what, x);
    angles[i] = (float)x;
    if (i && !(angles[i] > angles[i - 1]))
      return lines_fail(&r->lines, r->err, "%s of %g follows %g; angles must grow", what, x, (double)angles[i - 1]);
  }
  return true;
}

static bool check_angles(Reader *r, const Ies *s)
{
  const float first = s->vertical[0], last = s->vertical[s->vertical_count - 1];
  if (s->vertical_count < 2 || (first != 0 && first != 90) || (last != 90 && last != 180) || first == last)
    return lines_fail(&r->lines, r->err, "vertical angles go from %g to %g deg; they must go from 0 or 90 to 90 or 180",
                      (double)first, (double)last);
  const float begin = s->horizontal[0], end = s->horizontal[s->horizontal_count - 1];
  const bool is_known = (begin == 0 && (end == 0 || end == 90 || end == 180 || end == 360)) || (begin == 90 && end == 270);
  return is_known || lines_fail(&r->lines, r->err,
                                "horizontal angles go from %g to %g deg; they must go from 0 to 0, 90, 180 or 360, or "
                                "from 90 to 270",
                                (double)begin, (double)end);
}

static bool read_candela(Reader *r, Ies *s, double factor)
{
  const size_t count = (size_t)s->vertical_count * s->horizontal_count;
  s->candela = mem_alloc(count, sizeof *s->candela);
  if (!s->candela) return err_memory(r->err, "a lamp's distribution", count * sizeof *s->candela);
  for (size_t i = 0; i < count; i++) {
    double x = 0;
    if (!read_number(r, "a candela value", &x)) return false;
    if (!(x >= 0)) return lines_fail(&r->lines, r->err, "a candela value of %g is below 0", x);
    s->candela[i] = (float)fmin(x * factor, (double)FLT_MAX);
    s->peak = fmaxf(s->peak, s->candela[i]);
  }
  return s->peak > 0 || lines_fail(&r->lines, r->err, "all candela values are 0; the lamp gives no light");
}

// --- symmetry ---------------------------------------------------------------------------------------
// Appends the mirror image of the planes in hand about the last one's angle, or before the first one's.
typedef struct Unfold {
  float *angles;
  uint32_t *rows; // of the file
  uint32_t count;
} Unfold;

static void mirror_after(Unfold *u)
{
  const uint32_t n = u->count;
  const float about = u->angles[n - 1];
  for (uint32_t i = 1; i < n; i++) {
    u->angles[u->count] = 2 * about - u->angles[n - 1 - i];
    u->rows[u->count++] = u->rows[n - 1 - i];
  }
}

// 90..270 with its mirror image is -90..270, of which 270 to 360 is the part below zero, moved on by a turn.
static void mirror_sides(Unfold *u)
{
  const uint32_t n = u->count;
  Unfold out = {u->angles + 2 * n, u->rows + 2 * n, 0};
  for (uint32_t i = 0; i < 2 * n; i++) { // 90 down to 0 is the image of 90 to 180
    const bool is_image = i < n;
    const uint32_t row = is_image ? n - 1 - i : i - n;
    const float angle = is_image ? 180 - u->angles[row] : u->angles[row];
    if (angle < 0 || (!is_image && row == 0)) continue;
    out.angles[out.count] = angle;
    out.rows[out.count++] = u->rows[row];
  }
  for (uint32_t i = 0; i < n; i++) { // 270 up to 360 is the image of 270 down to 180
    const uint32_t row = n - 1 - i;
    const float angle = 540 - u->angles[row];
    if (row == n - 1 || angle > 360) continue;
    out.angles[out.count] = angle;
    out.rows[out.count++] = u->rows[row];
  }
  memmove(u->angles, out.angles, out.count * sizeof *out.angles);
  memmove(u->rows, out.rows, out.count * sizeof *out.rows);
  u->count = out.count;
}

static bool unfold(Ies *s, Err *err)
{
  const uint32_t n = s->horizontal_count, most = 5 * n;
  const float last = s->horizontal[n - 1];
  if (last == 360 || n == 1) return true;
  Unfold u = {mem_alloc(most, sizeof *u.angles), mem_alloc(most, sizeof *u.rows), n};
  bool ok = u.angles && u.rows;
  float *candela = NULL;
  if (!ok) goto done;
  for (uint32_t i = 0; i < n; i++) {
    u.angles[i] = s->horizontal[i];
    u.rows[i] = i;
  }
  if (last == 270) mirror_sides(&u);
  if (last == 90) mirror_after(&u);
  if (last <= 180) mirror_after(&u);
  candela = mem_alloc((size_t)u.count * s->vertical_count, sizeof *candela);
  ok = candela != NULL;
  if (!ok) goto done;
  for (uint32_t i = 0; i < u.count; i++)
    memcpy(candela + (size_t)i * s->vertical_count, s->candela + (size_t)u.rows[i] * s->vertical_count,
           s->vertical_count * sizeof *candela);
  mem_free(s->candela);
  mem_free(s->horizontal);
  s->candela = candela;
  s->horizontal = u.angles;
  s->horizontal_count = u.count;
  u.angles = NULL;
done:
  mem_free(u.angles);
  mem_free(u.rows);
  return ok || err_memory(err, "a lamp's distribution", most * sizeof(float));
}

static bool read_numbers(Reader *r, Ies *s)
{
  static const char *const lamps[] = {"the number of lamps", "the lumens of a lamp"};
  static const char *const sizes[] = {"the unit of lengths", "the lamp's width", "the lamp's length", "the lamp's height"};
  static const char *const rest[] = {"the factor kept for later use", "the lamp's watts"};
  double factor = 1, type = 0;
  if (!skip_numbers(r, lamps, 2) || !read_factor(r, "the candela multiplier", &factor) ||
      !read_count(r, "the number of vertical angles", &s->vertical_count) ||
      !read_count(r, "the number of horizontal angles", &s->horizontal_count) ||
      !read_number(r, "the photometric type", &type))
    return false;
  if (type != 1)
    return lines_fail(&r->lines, r->err, "photometric type %g is not understood; only 1 (type C) is", type);
  if ((uint64_t)s->vertical_count * s->horizontal_count > MOST_VALUES)
    return lines_fail(&r->lines, r->err, "%u x %u angles are more than %d values", s->vertical_count,
                      s->horizontal_count, MOST_VALUES);
  return skip_numbers(r, sizes, 4) && read_factor(r, "the ballast factor", &factor) && skip_numbers(r, rest, 2) &&
         read_angles(r, "a vertical angle", s->vertical_count, &s->vertical) &&
         read_angles(r, "a horizontal angle", s->horizontal_count, &s->horizontal) && check_angles(r, s) &&
         read_candela(r, s, factor) && unfold(s, r->err);
}

static bool check_end(Reader *r)
{
  do {
    while (r->p < r->end && (is_gap(*r->p) || *r->p == 0x1a)) r->p++; // old files end with a ^Z
    if (r->p < r->end)
      return lines_fail(&r->lines, r->err, "\"%.*s\" follows the last candela value; the counts of angles do not fit",
                        SHOWN(r->p, skip_word(r->p, r->end)));
  } while (lines_next(&r->lines, &r->p, &r->end));
  return true;
}

bool ies_read(Ies *out, const char *name, const void *bytes, size_t size, Err *err)
{
  Reader r = {.err = err};
  *out = (Ies){0};
  lines_init(&r.lines, name, bytes, size);
  const bool ok = read_words(&r) && read_numbers(&r, out) && check_end(&r);
  lines_finish(&r.lines);
  if (!ok) ies_finish(out);
  return ok;
}

void ies_finish(Ies *i)
{
  mem_free(i->vertical);
  mem_free(i->horizontal);
  mem_free(i->candela);
  *i = (Ies){0};
}
