// See gates.h. With A and B the places of two gates, one goes from A to B by B T A^-1: T scales by the ratio of their
// sizes, mirrors x if asked to, and turns by half about y where one comes out of the front, as two doors do that each
// face their own room. T is its own inverse but for the scale, so the way back is the same rule with A and B exchanged.

#include "scene/gates.h"

#include "base/mem.h"

#include <math.h>
#include <string.h>

static Frame pose(const float translate[3], const float rotate[3])
{
  ObjectCommon o = {.scale = {1, 1, 1}};
  memcpy(o.translate, translate, sizeof o.translate);
  memcpy(o.rotate, rotate, sizeof o.rotate);
  return object_frame(&o);
}

Frame gate_frame(const Gate *g)
{
  return pose(g->common.translate, g->common.rotate);
}

// --- one gate ---------------------------------------------------------------------------------------
static double outline_area(const Points *p)
{
  double sum = 0;
  for (int32_t i = 0; i < p->count; i++) {
    const float *a = p->xy + 2 * i, *b = p->xy + 2 * ((i + 1) % p->count);
    sum += (double)a[0] * (double)b[1] - (double)a[1] * (double)b[0];
  }
  return sum / 2;
}

static double turn(const float *a, const float *b, const float *c)
{
  return ((double)b[0] - (double)a[0]) * ((double)c[1] - (double)a[1]) -
         ((double)b[1] - (double)a[1]) * ((double)c[0] - (double)a[0]);
}

static bool outline_crosses(const Points *p)
{
  for (int32_t i = 0; i < p->count; i++)
    for (int32_t k = i + 2; k < p->count; k++) {
      if (i == 0 && k == p->count - 1) continue;
      const float *a = p->xy + 2 * i, *b = p->xy + 2 * ((i + 1) % p->count);
      const float *c = p->xy + 2 * k, *d = p->xy + 2 * ((k + 1) % p->count);
      if (turn(a, b, c) * turn(a, b, d) <= 0 && turn(c, d, a) * turn(c, d, b) <= 0) return true;
    }
  return false;
}

static bool fail_size(const char **field, const char *name, Err *err)
{
  *field = name;
  return err_set(err, ERR_BAD_SCENE, "%s must be larger than 0 in every direction: nothing goes through a gate of no size", name);
}

// Worm-/black holes lead nowhere but to their other end. Which field says more; NULL: none.
static const char *ball_leads_field(const Gate *g)
{
  const GateCommon *c = &g->common;
  if (g->kind == GATE_BLACK_HOLE && c->to >= 0) return "to";
  if (g->kind == GATE_BLACK_HOLE && c->mirror) return "mirror";
  if (c->back_to >= 0) return "back_to";
  if (c->to_cell >= 0) return "to_cell";
  for (int k = 0; k < 3; k++) {
    if (c->to_translate[k] != 0) return "to_translate";
    if (c->to_rotate[k] != 0) return "to_rotate";
  }
  return c->to_scale != 1 ? "to_scale" : NULL;
}

static bool ball_check(const Gate *g, const char **field, Err *err)
{
  *field = ball_leads_field(g);
  if (*field)
    return err_set(err, ERR_BAD_SCENE, g->kind == GATE_WORMHOLE ? "a wormhole leads to another wormhole, named in \"to\", and nowhere else"
                                                                : "a black hole leads nowhere");
  if (g->kind == GATE_WORMHOLE) {
    const GateWormhole *w = &g->wormhole;
    *field = "throat";
    if (w->throat >= w->radius)
      return err_set(err, ERR_BAD_SCENE, "the throat, %g m, must be smaller than the ball of %g m that it is in", (double)w->throat, (double)w->radius);
    *field = "length";
    return w->length == 0 || w->lensing > 0 ||
           err_set(err, ERR_BAD_SCENE, "a wormhole with a tube needs \"lensing\" of more than 0 m, how softly the tube widens");
  }
  const GateBlackHole *h = &g->black_hole;
  *field = "horizon";
  if (2 * h->horizon > h->radius)
    return err_set(err, ERR_BAD_SCENE, "a horizon of %g m needs a ball of at least %g m, with room for light to circle", (double)h->horizon, 2 * (double)h->horizon);
  if (h->disk_outer == 0) return true;
  *field = "disk_inner";
  if (h->disk_inner <= 1.5f * h->horizon)
    return err_set(err, ERR_BAD_SCENE, "nothing circles a horizon of %g m nearer than %g m", (double)h->horizon, 1.5 * (double)h->horizon);
  *field = "disk_outer";
  return (h->disk_inner < h->disk_outer && h->disk_outer <= h->radius) ||
         err_set(err, ERR_BAD_SCENE, "the disk must end between its beginning, %g m, and the ball's surface, %g m", (double)h->disk_inner, (double)h->radius);
}

static const char *gate_kind_name(const Gate *g)
{
  switch ((GateKind)g->kind) {
  case GATE_RECT: return "rect";
  case GATE_POLYGON: return "polygon";
  case GATE_BOX: return "box";
  case GATE_SPHERE: return "sphere";
  case GATE_WORMHOLE: return "wormhole";
  case GATE_BLACK_HOLE: return "black hole";
  }
  unreachable();
}

bool gate_check(const Gate *g, const char **field, Err *err)
{
  *field = "wall";
  if (g->common.wall && !gate_is_flat(g))
    return err_set(err, ERR_BAD_SCENE, "only a flat gate, rect or polygon, can be a wall; a %s has a cell on both sides", gate_kind_name(g));
  switch ((GateKind)g->kind) {
  case GATE_RECT:
    return (g->rect.size[0] > 0 && g->rect.size[1] > 0) || fail_size(field, "size", err);
  case GATE_BOX:
    return (g->box.size[0] > 0 && g->box.size[1] > 0 && g->box.size[2] > 0) || fail_size(field, "size", err);
  case GATE_SPHERE: return g->sphere.radius > 0 || fail_size(field, "radius", err);
  case GATE_WORMHOLE:
  case GATE_BLACK_HOLE: return true; // their measures go together, so edits one by one may not fit for a while: ball_check()
  case GATE_POLYGON:
    *field = "points";
    if (!g->polygon.points) return err_set(err, ERR_BAD_SCENE, "a gate of kind \"polygon\" needs \"points\", its corners");
    if (outline_crosses(g->polygon.points))
      return err_set(err, ERR_BAD_SCENE, "the outline of this gate crosses itself; give its corners in their order");
    return outline_area(g->polygon.points) > 0 ||
           err_set(err, ERR_BAD_SCENE, "the corners must run counter-clockwise seen from the front, around some area");
  }
  return true;
}

// --- pairs --------------------------------------------------------------------------------------------
typedef struct Linker {
  const Scene *scene;
  GateLink (*links)[2];
  int32_t gate_i; // being linked
  const char *field;
  Err *err;
} Linker;

// Lengths that make two gates of one kind comparable: all must have one ratio.
static int lengths_of(const Gate *g, bool is_mirrored, float out[2 * MOST_POINTS])
{
  switch ((GateKind)g->kind) {
  case GATE_RECT: memcpy(out, g->rect.size, sizeof g->rect.size); return 2;
  case GATE_BOX: memcpy(out, g->box.size, sizeof g->box.size); return 3;
  case GATE_SPHERE: out[0] = g->sphere.radius; return 1;
  case GATE_WORMHOLE: memcpy(out, &g->wormhole, sizeof g->wormhole); return 4;
  case GATE_BLACK_HOLE: out[0] = g->black_hole.radius; return 1;
  case GATE_POLYGON: {
    // Through a mirror (or out of the front) x is turned round, so corners come in the other order: from the first, back.
    const Points *p = g->polygon.points;
    for (int32_t i = 0; i < p->count; i++) {
      const float *at = p->xy + 2 * (is_mirrored ? (p->count - i) % p->count : i);
      out[2 * i] = is_mirrored ? -at[0] : at[0];
      out[2 * i + 1] = at[1];
    }
    return 2 * p->count;
  }
  }
  return 0;
}

static float largest(const float *x, int count)
{
  float most = 0;
  for (int i = 0; i < count; i++) most = fmaxf(most, fabsf(x[i]));
  return most;
}

// The one scale that makes a's aperture b's; 0: there is none. Corners of polygons may begin anywhere.
static float ratio_of(const Gate *a, const Gate *b, bool turns_x)
{
  float from[2 * MOST_POINTS], to[2 * MOST_POINTS];
  if (a->kind != b->kind) return 0;
  const int count = lengths_of(a, false, from);
  if (lengths_of(b, turns_x, to) != count) return 0;
  const float ratio = largest(to, count) / largest(from, count), slack = 1e-4f * largest(to, count);
  for (int shift = 0; shift < (a->kind == GATE_POLYGON ? count : 1); shift += 2) {
    float off = 0;
    for (int i = 0; i < count; i++) off = fmaxf(off, fabsf(from[i] * ratio - to[(i + shift) % count]));
    if (off <= slack) return ratio;
  }
  return 0;
}

static Frame map_between(const Frame *a, const Frame *b, float scale, bool mirrors, bool turns)
{
  Frame t = frame_identity();
  t.x *= (mirrors != turns ? -scale : scale);
  t.y *= scale;
  t.z *= turns ? -scale : scale;
  const Frame back = frame_inverse(a), over = frame_product(&t, &back);
  return frame_product(b, &over);
}

// The frame of a turned gate has sines that are not exact, and a pair at one place must have exactly the identity.
static Frame map_of_pair(const Frame *a, const Frame *b, float scale, bool mirrors, bool turns)
{
  if (!memcmp(a, b, sizeof *a) && scale == 1 && !mirrors && !turns) return frame_identity();
  return map_between(a, b, scale, mirrors, turns);
}

static const char *cell_name(const Scene *s, int32_t cell)
{
  return cell < 0 ? "the unnamed cell" : s->cells.items[cell].name;
}

static bool put_link(Linker *l, int32_t gate, int32_t side, const GateLink *link)
{
  GateLink *at = &l->links[gate][side];
  if (at->exists) {
    float off = 0;
    const Vec3 d[4] = {at->map.x - link->map.x, at->map.y - link->map.y, at->map.z - link->map.z, at->map.p - link->map.p};
    for (int k = 0; k < 4; k++) off = fmaxf(off, v3_length(d[k]));
    if (at->cell == link->cell && at->gate == link->gate && off < 1e-4f * (1 + v3_length(link->map.p))) return true;
    return err_set(l->err, ERR_BAD_SCENE,
                   "the %s of gate \"%s\" would lead to two places; make one of the gates that lead there \"one_way\": true, or give "
                   "both the same \"out\" and \"mirror\"",
                   side == FRONT ? "front" : "back", l->scene->gates.items[gate].name);
  }
  *at = *link;
  return true;
}

// One side of a gate to one of another, and back unless that is one way.
static bool link_side(Linker *l, int32_t from, int32_t from_side, int32_t to, int32_t to_side)
{
  const Gate *a = &l->scene->gates.items[from], *b = &l->scene->gates.items[to];
  const Frame fa = gate_frame(a), fb = gate_frame(b);
  const bool turns = from_side == to_side;
  const float ratio = ratio_of(a, b, a->common.mirror != turns);
  if (!(ratio > 0))
    return err_set(l->err, ERR_BAD_SCENE,
                   "gate \"%s\" leads to \"%s\", whose %s; a gate turns, moves, mirrors and scales alike in all directions, no more",
                   a->name, b->name,
                   a->kind != b->kind ? "kind is another" : "outline is not the same one larger or smaller");
  const GateLink there = {true, b->common.cell, to, to_side, map_of_pair(&fa, &fb, ratio, a->common.mirror, turns)};
  const GateLink back = {true, a->common.cell, from, from_side, map_of_pair(&fb, &fa, 1 / ratio, a->common.mirror, turns)};
  return put_link(l, from, from_side, &there) &&
         (a->common.one_way || (from == to && from_side == to_side) || put_link(l, to, to_side, &back));
}

// --- doors of curved cells --------------------------------------------------------------------------
// Two balls with boundaries alike: what goes in at the one comes out of the other. As spheres of space they must have one
// radius S(r), which is what is seen from outside (worlds.md, section 2.7).
static double outer_radius(const Scene *s, const Gate *g)
{
  const float kappa = g->common.cell < 0 ? 0 : cell_curvature(&s->cells.items[g->common.cell]);
  const double r = (double)g->sphere.radius, root = sqrt(fabs((double)kappa));
  return kappa > 0 ? sin(root * r) / root : kappa < 0 ? sinh(root * r) / root : r;
}

static bool is_curved(const Scene *s, int32_t cell) { return cell >= 0 && cell_curvature(&s->cells.items[cell]) != 0; }

static bool link_door(Linker *l, int32_t to)
{
  const Scene *s = l->scene;
  const Gate *a = &s->gates.items[l->gate_i], *b = &s->gates.items[to];
  if (a->kind != GATE_SPHERE || b->kind != GATE_SPHERE)
    return err_set(l->err, ERR_BAD_SCENE, "gate \"%s\" leads into or out of a curved cell, which only spheres do: no plane of curved space "
                   "is one of flat space", a->kind != GATE_SPHERE ? a->name : b->name);
  const double ra = outer_radius(s, a), rb = outer_radius(s, b);
  if (fabs(ra - rb) > 1e-3 * ra)
    return err_set(l->err, ERR_BAD_SCENE, "gates \"%s\" and \"%s\" are %g m and %g m wide where they meet; a sphere of radius r has 2 r in flat "
                   "space, 2 R sin(r / R) in spherical and 2 R sinh(r / R) in hyperbolic space", a->name, b->name, 2 * ra, 2 * rb);
  const GateLink there = {true, b->common.cell, to, FRONT, frame_identity()};
  const GateLink back = {true, a->common.cell, l->gate_i, FRONT, frame_identity()};
  return put_link(l, l->gate_i, FRONT, &there) && (a->common.one_way || put_link(l, to, FRONT, &back));
}

// --- balls that bend light ---------------------------------------------------------------------------
static bool check_flat(Linker *l, const Gate *g)
{
  if (!is_curved(l->scene, g->common.cell)) return true;
  l->field = "cell";
  return err_set(l->err, ERR_BAD_SCENE, "gate \"%s\" is a %s, which only flat cells have", g->name, gate_kind_name(g));
}

static bool link_wormhole(Linker *l, int32_t to)
{
  const Gate *a = &l->scene->gates.items[l->gate_i], *b = &l->scene->gates.items[to];
  if (!check_flat(l, a) || !check_flat(l, b)) return false;
  if (a->kind != b->kind || fabsf(ratio_of(a, b, false) - 1) > 1e-3f)
    return err_set(l->err, ERR_BAD_SCENE, "gate \"%s\" leads to \"%s\", whose %s; both ends of a wormhole are alike in radius, throat, length "
                   "and lensing", a->name, b->name, a->kind != b->kind ? "kind is another" : "measures are others");
  Frame map = frame_identity(); // says whether it mirrors, no more
  if (a->common.mirror) map.x = -map.x;
  const GateLink there = {true, b->common.cell, to, FRONT, map}, back = {true, a->common.cell, l->gate_i, FRONT, map};
  return put_link(l, l->gate_i, FRONT, &there) && (a->common.one_way || put_link(l, to, FRONT, &back));
}

// What comes out of it comes out where it went in.
static bool link_black_hole(Linker *l)
{
  const Gate *g = &l->scene->gates.items[l->gate_i];
  const GateLink link = {true, g->common.cell, l->gate_i, FRONT, frame_identity()};
  return check_flat(l, g) && put_link(l, l->gate_i, FRONT, &link);
}

static bool link_pair(Linker *l, int32_t to, bool has_front, bool has_back)
{
  const Gate *g = &l->scene->gates.items[l->gate_i];
  if (g->kind == GATE_WORMHOLE) return link_wormhole(l, to);
  const bool turns = gate_is_flat(g) && g->common.out == GATE_OUT_FRONT;
  if (is_curved(l->scene, g->common.cell) || is_curved(l->scene, l->scene->gates.items[to].common.cell)) return link_door(l, to);
  return (!has_front || link_side(l, l->gate_i, FRONT, to, turns ? FRONT : BACK)) &&
         (!has_back || link_side(l, l->gate_i, BACK, to, turns ? BACK : FRONT));
}

static bool is_placed(const GateCommon *c)
{
  bool is = c->to_cell >= 0 || c->to_scale != 1;
  for (int k = 0; k < 3; k++) is |= c->to_translate[k] != 0 || c->to_rotate[k] != 0;
  return is;
}

// A gate whose other side is a mere place. If another gate lies exactly there, one comes out of that one: it must not
// be met again at once.
static bool link_place(Linker *l)
{
  const Scene *s = l->scene;
  const Gate *g = &s->gates.items[l->gate_i];
  const GateCommon *c = &g->common;
  if (is_curved(s, c->cell) || is_curved(s, c->to_cell))
    return err_set(l->err, ERR_BAD_SCENE, "gate \"%s\" leads into or out of a curved cell and needs a partner there, a sphere named in \"to\"", g->name);
  const Frame from = gate_frame(g), to = pose(c->to_translate, c->to_rotate);
  GateLink link = {true, c->to_cell >= 0 ? c->to_cell : c->cell, -1, BACK,
                   map_of_pair(&from, &to, c->to_scale, c->mirror, false)};
  for (size_t i = 0; i < s->gates.count; i++) {
    const Gate *other = &s->gates.items[i];
    const Frame at = gate_frame(other);
    const float ratio = ratio_of(g, other, c->mirror);
    if (other->common.cell == link.cell && fabsf(ratio - c->to_scale) <= 1e-4f * ratio && v3_length(at.p - to.p) <= 1e-5f * (1 + v3_length(to.p)) &&
        v3_length(at.x - to.x) < 1e-4f && v3_length(at.y - to.y) < 1e-4f)
      link.gate = (int32_t)i;
  }
  if (!put_link(l, l->gate_i, FRONT, &link)) return false;
  link.side = FRONT;
  return c->sides != GATE_SIDES_BOTH || c->back_to >= 0 || put_link(l, l->gate_i, BACK, &link);
}

static bool link_gate(Linker *l)
{
  const GateCommon *c = &l->scene->gates.items[l->gate_i].common;
  const Gate *g = &l->scene->gates.items[l->gate_i];
  if ((g->kind == GATE_WORMHOLE || g->kind == GATE_BLACK_HOLE) && !ball_check(g, &l->field, l->err)) return false;
  if (g->kind == GATE_BLACK_HOLE) return link_black_hole(l);
  l->field = "to";
  if (c->to >= 0) {
    if (is_placed(c)) {
      l->field = "to_translate";
      return err_set(l->err, ERR_BAD_SCENE, "a gate leads to another gate or to a place, not to both; leave out \"to\" or all of "
                     "\"to_cell\", \"to_translate\", \"to_rotate\" and \"to_scale\"");
    }
    if (!link_pair(l, c->to, true, c->sides == GATE_SIDES_BOTH && c->back_to < 0)) return false;
  } else if (is_placed(c)) {
    if (!link_place(l)) return false;
  }
  l->field = "back_to";
  return c->back_to < 0 || link_pair(l, c->back_to, false, true);
}

static bool check_led(Linker *l)
{
  const Scene *s = l->scene;
  l->field = NULL;
  for (l->gate_i = 0; (size_t)l->gate_i < s->gates.count; l->gate_i++) {
    const Gate *g = &s->gates.items[l->gate_i];
    bool is_target = l->links[l->gate_i][FRONT].exists || l->links[l->gate_i][BACK].exists;
    for (size_t i = 0; !is_target && i < s->gates.count; i++)
      is_target = s->gates.items[i].common.to == l->gate_i || s->gates.items[i].common.back_to == l->gate_i;
    if (!is_target)
      return err_set(l->err, ERR_BAD_SCENE,
                     "gate \"%s\" leads nowhere and no gate leads to it; name its partner in \"to\", or a place by \"to_cell\" and "
                     "\"to_translate\"", g->name);
    l->field = "wall";
    if (g->common.wall && !l->links[l->gate_i][FRONT].exists)
      return err_set(l->err, ERR_BAD_SCENE, "gate \"%s\" is a wall, but its front, which must face into the cell \"%s\", leads nowhere",
                     g->name, cell_name(s, g->common.cell));
    l->field = NULL;
  }
  return true;
}

bool gates_link(const Scene *s, GateLink (*links)[2], int32_t *gate_i, const char **field, Err *err)
{
  Linker l = {.scene = s, .links = links, .err = err};
  bool ok = true;
  if (s->gates.count) memset(links, 0, s->gates.count * sizeof *links);
  for (; ok && (size_t)l.gate_i < s->gates.count; l.gate_i += ok) {
    ok = gate_check(&s->gates.items[l.gate_i], &l.field, err);
  }
  for (l.gate_i = ok ? 0 : l.gate_i; ok && (size_t)l.gate_i < s->gates.count; l.gate_i += ok) ok = link_gate(&l);
  if (ok) ok = check_led(&l);
  if (!ok && gate_i) *gate_i = l.gate_i;
  if (!ok && field) *field = l.field;
  return ok;
}

// --- cells ----------------------------------------------------------------------------------------------
static int common_factor(int a, int b) { return b ? common_factor(b, a % b) : a; }

bool cell_check(const Cell *c, const char **field, Err *err)
{
  const CellSpherical *s = &c->spherical;
  *field = "q";
  return c->kind != CELL_SPHERICAL || s->space != SPHERICAL_LENS || (s->q < s->p && common_factor(s->p, s->q) == 1) ||
         err_set(err, ERR_BAD_SCENE, "there is no lens space L(%d, %d): q must be smaller than p and share no factor with it", s->p, s->q);
}

bool cells_check(const Scene *s, int32_t *cell_i, Err *err)
{
  for (size_t c = 0; c < s->cells.count; c++) {
    bool has_content = s->cells.items[c].common.sky >= 0 || s->cells.items[c].common.atmosphere >= 0 ||
                       s->cells.items[c].common.beams > 0;
    for (size_t i = 0; !has_content && i < s->objects.count; i++) has_content = s->objects.items[i].common.cell == (int32_t)c;
    for (size_t i = 0; !has_content && i < s->lights.count; i++) has_content = s->lights.items[i].common.cell == (int32_t)c;
    if (has_content) continue;
    if (cell_i) *cell_i = (int32_t)c;
    return err_set(err, ERR_BAD_SCENE,
                   "cell \"%s\" is empty: no object and no light has \"cell\": \"%s\", and it has no sky of its own; put something "
                   "into it, or take it out", s->cells.items[c].name, s->cells.items[c].name);
  }
  return true;
}
