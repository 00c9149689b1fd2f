// Space forms: their domains are whole spaces, and walks in them are lost nowhere.

#include "base/hash.h"
#include "space/form.h"
#include "tests/test.h"

static const FormShape shapes[] = {{.size = {2, 2, 2}, .p = 5, .q = 2}, {.size = {3, 2, 4.5}, .p = 7, .q = 2}};

static bool make(FormKind kind, SpaceForm *f) { return form_make(kind, &shapes[0], f); }

TEST(faces_are_glued_in_pairs)
{
  static const int faces[FORM_KINDS] = {[FORM_TORUS] = 6,          [FORM_HALF_TURN] = 6, [FORM_KLEIN] = 6,
                                        [FORM_HANTZSCHE_WENDT] = 12, [FORM_POINCARE] = 12, [FORM_QUATERNIONIC] = 6,
                                        [FORM_SEIFERT_WEBER] = 12,  [FORM_RIGHT_ANGLED] = 12, [FORM_CUBES] = 6};
  for (int kind = 0; kind < FORM_KINDS; kind++)
    for (int s = 0; s < 2; s++) {
      SpaceForm f;
      CHECK(form_make((FormKind)kind, &shapes[s], &f));
      if (faces[kind] && s == 0) CHECK_MSG(f.face_count == faces[kind], "%s has %d", form_name((FormKind)kind), f.face_count);
      CHECK(f.is_bounded);
      CHECK(f.inner > 0 && f.outer > f.inner);
      for (int i = 0; i < f.face_count; i++) {
        const FormFace *a = &f.faces[i], *b = &f.faces[a->partner];
        CHECK(b->partner == i);
        const Mat4_d one = isometry_identity(), both = isometry_product(&b->map, &a->map);
        CHECK_MSG(isometry_distance(&both, &one) < 1e-12, "%s face %d", form_name((FormKind)kind), i);
        CHECK(a->corner_count == b->corner_count);
      }
      FormKind found;
      CHECK(form_find(form_name((FormKind)kind), &found) && found == (FormKind)kind);
    }
  SpaceForm f;
  CHECK(!form_make(FORM_LENS, &(FormShape){.p = 6, .q = 3}, &f)); // not one space
  CHECK(!form_make(FORM_LENS, &(FormShape){.p = 2, .q = 1}, &f)); // a domain that fills the whole chart
  CHECK(form_make(FORM_LENS, &(FormShape){.p = 5, .q = 1}, &f) && f.face_count == 2 && !f.is_bounded);
}

// The maps around each edge are the identity, and the angles there make a whole turn.
TEST(edge_cycles)
{
  for (int kind = 0; kind < FORM_KINDS; kind++)
    for (int s = 0; s < 2; s++) {
      SpaceForm f;
      CHECK(form_make((FormKind)kind, &shapes[s], &f));
      const Mat4_d one = isometry_identity();
      for (int i = 0; i < f.face_count; i++)
        for (int c = 0; c < f.faces[i].corner_count; c++) {
          const FormCycle cycle = form_cycle(&f, i, c);
          if (kind == FORM_CUBES) { // a whole turn brings back a cube, turned about itself
            CHECK(cycle.length % 5 == 0);
            continue;
          }
          CHECK_MSG(isometry_distance(&cycle.product, &one) < 1e-12, "%s face %d edge %d: %g after %d",
                    form_name((FormKind)kind), i, c, isometry_distance(&cycle.product, &one), cycle.length);
          CHECK_NEAR(cycle.angle, 2 * M_PI, 1e-6);
        }
    }
}

TEST(volumes)
{
  static const struct {
    FormKind kind;
    double volume;
  } known[] = {
      {FORM_TORUS, 8},
      {FORM_HALF_TURN, 8},
      {FORM_KLEIN, 8},
      {FORM_HANTZSCHE_WENDT, 2},                    // a quarter of its lattice's cell
      {FORM_POINCARE, 2 * M_PI * M_PI / 120},       // the sphere over the order of its group
      {FORM_QUATERNIONIC, 2 * M_PI * M_PI / 8},
      {FORM_LENS, 2 * M_PI * M_PI / 5},
      {FORM_SEIFERT_WEBER, 11.1990647},             // Mednykh and Rasskazov 2006
      {FORM_RIGHT_ANGLED, 4.3062076},               // of {5,3,4}
  };
  for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
    SpaceForm f;
    CHECK(make(known[i].kind, &f));
    const double volume = form_volume(&f, (uint32_t)(300000 * test_intensity() / (TEST_IS_SLOW ? 4 : 1)));
    CHECK_MSG(fabs(volume / known[i].volume - 1) < 0.012, "%s: %g against %g", form_name(known[i].kind), volume,
              known[i].volume);
  }
}

// The same walk in float and in double: one text.
#define WALK(suffix, real)                                                                                        \
  static long walk##suffix(const SpaceForm *f, uint32_t seed, long crossings, real *outside)                      \
  {                                                                                                               \
    Face##suffix faces[FORM_MOST_FACES];                                                                          \
    form_faces##suffix(f, faces);                                                                                 \
    long lost = 0;                                                                                                \
    Geodesic##suffix g = {{{0, 0, 0, 1}}, {{0}}};                                                                 \
    for (int k = 0; k < 3; k++) g.v.v[k] = 2 * (real)unit_float(hash_combine(seed, (uint32_t)k)) - 1;              \
    geodesic_mend##suffix(f->kappa, &g);                                                                          \
    for (long i = 0; i < crossings; i++) {                                                                        \
      real c, s;                                                                                                  \
      const int exit = domain_exit##suffix(f->kappa, faces, f->face_count, &g, &c, &s);                           \
      if (exit < 0) {                                                                                             \
        lost++;                                                                                                   \
        break;                                                                                                    \
      }                                                                                                           \
      geodesic_move##suffix(f->kappa, c, s, &g);                                                                  \
      geodesic_cross##suffix(f->kappa, &faces[exit], &g);                                                         \
      for (int k = 0; k < f->face_count; k++) {                                                                   \
        const real height = pair4##suffix(&faces[k].plane, &g.p);                                                 \
        if (height > *outside) *outside = height;                                                                 \
      }                                                                                                           \
    }                                                                                                             \
    return lost;                                                                                                  \
  }
WALK(_f, float)
WALK(_d, double)

// Without any epsilon: ways of a thousand crossings each in every form.
TEST(no_ray_is_lost)
{
  const int walks = (int)(100 * test_intensity() / (TEST_IS_SLOW ? 10 : 1));
  for (int kind = 0; kind < FORM_KINDS; kind++) {
    SpaceForm f;
    CHECK(make((FormKind)kind, &f));
    float outside = 0;
    double outside_d = 0;
    long lost = 0;
    for (int i = 0; i < walks; i++) lost += walk_f(&f, (uint32_t)(i + 1000 * kind), 10000, &outside);
    lost += walk_d(&f, (uint32_t)kind, 20000, &outside_d);
    CHECK_MSG(lost == 0, "%s: %ld of %d", form_name((FormKind)kind), lost, walks);
    CHECK_MSG(outside < 1e-3f && outside_d < 1e-10, "%s: outside by %g, %g", form_name((FormKind)kind), (double)outside,
              outside_d);
  }
}

// The whole way around the sphere, through a dozen or so cells, is home: place, direction and all that is between
// (worlds.md, section 2.3).
#define AROUND(suffix, real)                                                                      \
  static real around##suffix(const SpaceForm *f, uint32_t seed, int *crossed)                            \
  {                                                                                                      \
    Face##suffix faces[FORM_MOST_FACES];                                                                 \
    form_faces##suffix(f, faces);                                                                        \
    Geodesic##suffix g = {{{0, 0, 0, 1}}, {{0}}};                                                        \
    for (int k = 0; k < 3; k++) {                                                                        \
      g.p.v[k] = (real)0.2 * ((real)unit_float(hash_combine(seed, 7 + (uint32_t)k)) - (real)0.5);         \
      g.v.v[k] = 2 * (real)unit_float(hash_combine(seed, (uint32_t)k)) - 1;                              \
    }                                                                                                    \
    geodesic_mend##suffix(1, &g);                                                                        \
    const Geodesic##suffix start = g;                                                                    \
    double left = 2 * M_PI;                                                                              \
    for (int i = 0; i < 1000; i++) {                                                                     \
      real c, s;                                                                                         \
      const int exit = domain_exit##suffix(1, faces, f->face_count, &g, &c, &s);                         \
      const double t = atan2((double)s, (double)c);                                                      \
      if (exit < 0 || t >= left) break;                                                                  \
      left -= t;                                                                                         \
      ++*crossed;                                                                                        \
      geodesic_move##suffix(1, c, s, &g);                                                                \
      geodesic_cross##suffix(1, &faces[exit], &g);                                                       \
    }                                                                                                    \
    geodesic_move##suffix(1, (real)cos(left), (real)sin(left), &g);                                      \
    real off = 0;                                                                                        \
    for (int k = 0; k < 4; k++) {                                                                        \
      const real p = g.p.v[k] - start.p.v[k], v = g.v.v[k] - start.v.v[k];                               \
      if (p > off || -p > off) off = p > 0 ? p : -p;                                                     \
      if (v > off || -v > off) off = v > 0 ? v : -v;                                                     \
    }                                                                                                    \
    return off;                                                                                          \
  }
AROUND(_f, float)
AROUND(_d, double)

TEST(around_the_sphere_is_home)
{
  SpaceForm f;
  CHECK(make(FORM_POINCARE, &f));
  int crossed = 0, walks = 2000 / (TEST_IS_SLOW ? 10 : 1);
  float worst = 0;
  double worst_d = 0;
  for (int i = 0; i < walks; i++) {
    const float off = around_f(&f, (uint32_t)i, &(int){0});
    const double off_d = around_d(&f, (uint32_t)i, &crossed);
    if (off > worst) worst = off;
    if (off_d > worst_d) worst_d = off_d;
  }
  CHECK_MSG(worst < 1e-5f, "%g", (double)worst);
  CHECK_MSG(worst_d < 1e-12, "%g", worst_d);
  CHECK_NEAR((double)crossed / walks, 13.6, 0.5); // worlds.md, section 2.3
}

// A way turned round is walked back to where it began.
TEST(there_and_back)
{
  for (int kind = 0; kind < FORM_KINDS; kind++) {
    SpaceForm f;
    CHECK(make((FormKind)kind, &f));
    if (f.kappa < 0) continue; // ways part exponentially: a hundred crossings are beyond any number of bits
    Face_f faces[FORM_MOST_FACES];
    form_faces_f(&f, faces);
    Geodesic_f g = {{{0, 0, 0, 1}}, {{0.48f, 0.6f, 0.64f, 0}}};
    const Geodesic_f start = g;
    double way = 0, back = 0;
    float c = 1, s = 0;
    for (int i = 0; i < 100; i++) {
      const int exit = domain_exit_f(f.kappa, faces, f.face_count, &g, &c, &s);
      way += f.kappa ? atan2((double)s, (double)c) : (double)s;
      geodesic_move_f(f.kappa, c, s, &g);
      geodesic_cross_f(f.kappa, &faces[exit], &g);
    }
    for (int k = 0; k < 4; k++) g.v.v[k] = -g.v.v[k];
    for (;;) {
      const int exit = domain_exit_f(f.kappa, faces, f.face_count, &g, &c, &s);
      const double t = f.kappa ? atan2((double)s, (double)c) : (double)s;
      if (back + t >= way) break;
      back += t;
      geodesic_move_f(f.kappa, c, s, &g);
      geodesic_cross_f(f.kappa, &faces[exit], &g);
    }
    const double rest = way - back;
    if (f.kappa)
      geodesic_move_f(f.kappa, (float)cos(rest), (float)sin(rest), &g);
    else
      geodesic_move_f(f.kappa, 1, (float)rest, &g);
    for (int k = 0; k < 3; k++) {
      CHECK_NEAR(g.p.v[k], start.p.v[k], 1e-4);
      CHECK_NEAR(g.v.v[k], -start.v.v[k], 1e-4);
    }
  }
}

TEST_MAIN
