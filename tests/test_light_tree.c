// The light tree: emitters are picked as often as it says, all that can send light can be picked, and what few lights
// bring is what each of them brings.

#include "tests/test.h"

#include "shade/light_sample.h"
#include "tests/chi_square.h"

static const SkyMap no_sky;

static float number(uint32_t *state)
{
  return unit_float(hash_u32((*state)++));
}

static Vec3 place(uint32_t *state, float size)
{
  return size * v3(2 * number(state) - 1, 2 * number(state) - 1, 2 * number(state) - 1);
}

static Emitter some_emitter(uint32_t i, uint32_t *state)
{
  Emitter e = {.kind = (uint8_t)(i % 6),
               .p = place(state, 5),
               .color = v3_all(0.1f + 10 * number(state) * number(state)),
               .map = -1,
               .mean_map = 1,
               .is_two_sided = i % 5 == 0};
  e.x = place(state, 0.3f);
  e.y = v3_normalize(v3_cross(e.x, place(state, 1))) * 0.2f;
  const float area = v3_length(v3_cross(e.x, e.y));
  switch ((EmitterKind)e.kind) {
  case EMITTER_POINT: break;
  case EMITTER_SPOT:
    e.x = v3_normalize(e.x);
    e.cos_outer = 0.7f;
    e.cos_inner = 0.9f;
    break;
  case EMITTER_TRIANGLE: e.area = area / 2; break;
  case EMITTER_QUAD: e.area = area; break;
  case EMITTER_DISK: e.area = PI * area; break;
  case EMITTER_SPHERE:
    e.radius = 0.1f + 0.2f * number(state);
    e.area = 4 * PI * e.radius * e.radius;
    break;
  }
  return e;
}

static LightSet some_set(uint32_t count, uint32_t seed)
{
  Emitter *e = malloc(count * sizeof *e);
  LightSet set;
  for (uint32_t i = 0; i < count; i++) e[i] = some_emitter(i, &seed);
  CHECK(light_set_build(&set, e, count, NULL, 0, &no_sky, NULL, NULL));
  free(e);
  return set;
}

// Evenly spread choices land on each emitter in proportion to what light_tree_pmf() says of it.
static void check_picks(const LightSet *set, Vec3 p, Vec3 n)
{
  enum { PICKS = 40000 };
  uint32_t *seen = calloc(set->emitter_count, sizeof *seen);
  double sum = 0, worst = 0;
  uint32_t none = 0; // where a node's own children cannot keep what its parent's bound hoped for
  for (uint32_t k = 0; k < PICKS; k++) {
    uint32_t i = 0;
    float pmf;
    if (!light_tree_pick(&set->tree, p, n, ((float)k + 0.5f) / PICKS, &i, &pmf)) {
      none++;
      continue;
    }
    seen[i]++;
    CHECK(pmf == light_tree_pmf(&set->tree, p, n, i));
  }
  for (uint32_t i = 0; i < set->emitter_count; i++) {
    const double pmf = (double)light_tree_pmf(&set->tree, p, n, i);
    sum += pmf;
    worst = fmax(worst, fabs(seen[i] - pmf * PICKS));
  }
  CHECK_MSG(fabs(sum + (double)none / PICKS - 1) < 2e-3, "chances sum to %g, and %u picks of none", sum,
            none);
  // Each level may cut one choice on either side of an emitter's interval.
  CHECK_MSG(worst < 24, "%g of %d picks off", worst, PICKS);
  free(seen);
}

TEST(emitters_are_picked_as_often_as_it_says)
{
  const uint32_t counts[] = {1, 2, 7, 8, 9, 64, 1000};
  uint32_t state = 5;
  for (int k = 0; k < 7; k++) {
    LightSet set = some_set(counts[k], 100 + counts[k]);
    for (int i = 0; i < 4; i++)
      check_picks(&set, place(&state, i < 2 ? 4 : 20), i % 2 ? v3_normalize(place(&state, 1)) : v3_all(0));
    light_set_finish(&set);
  }
}

// No emitter that brings light from a point of it may have no chance.
TEST(what_shines_can_be_picked)
{
  LightSet set = some_set(600, 7);
  uint32_t state = 77;
  int lit = 0, lost = 0;
  for (int k = 0; k < 60000; k++) {
    const uint32_t i = hash_u32((uint32_t)k) % 600;
    const Vec3 p = place(&state, 6), n = v3_normalize(place(&state, 1));
    LightSet alone = {.emitters = &set.emitters[i], .emitter_count = 1};
    LightNode node = {.power = {1}, .child = {LIGHT_LEAF}, .radius2 = {1e30f}}; // always picked
    uint32_t parent = LIGHT_ROOT, leaf = 0;
    alone.tree = (LightTree){&node, &parent, &leaf, 1, 1};
    LightSample s;
    if (!light_sample(&alone, NULL, 0, p, v3_all(0), 0, (Vec2){number(&state), number(&state)}, &s)) continue;
    if (!(v3_dot(s.wl, n) > 0)) continue;
    lit++;
    lost += !(light_tree_pmf(&set.tree, p, n, i) > 0);
  }
  CHECK(lit > 5000);
  CHECK_MSG(lost == 0, "%d of %d could not have been picked", lost, lit);
  light_set_finish(&set);
}

// Irradiance by all of many emitters, and by each alone.
TEST(all_together_bring_what_each_brings)
{
  LightSet set = some_set(40, 3);
  const Vec3 p = v3(0.3f, 0.2f, -0.1f), n = v3_normalize(v3(1, 2, 0.5f));
  double sum[2] = {0, 0};
  enum { COUNT = 400000 };
  for (uint32_t k = 1; k <= COUNT; k++) {
    LightSample s;
    const Vec2 u = {unit_float(k * 3518319155u), unit_float(k * 2882110345u)};
    if (light_sample(&set, NULL, 0, p, n, unit_float(k * 2360945575u), u, &s))
      sum[0] += (double)(s.radiance[0] * max_f(v3_dot(s.wl, n), 0) / s.pdf) / COUNT;
  }
  for (uint32_t i = 0; i < 40; i++) {
    LightSet one;
    CHECK(light_set_build(&one, &set.emitters[i], 1, NULL, 0, &no_sky, NULL, NULL));
    for (uint32_t k = 1; k <= COUNT / 40; k++) {
      LightSample s;
      const Vec2 u = {unit_float(k * 3518319155u), unit_float(k * 2882110345u)};
      if (light_sample(&one, NULL, 0, p, v3_all(0), 0.5f, u, &s))
        sum[1] += (double)(s.radiance[0] * max_f(v3_dot(s.wl, n), 0) / s.pdf) / (COUNT / 40);
    }
    light_set_finish(&one);
  }
  CHECK_MSG(fabs(sum[0] - sum[1]) < 5e-3 * sum[1], "together %g, one by one %g", sum[0], sum[1]);
  light_set_finish(&set);
}

TEST(a_cancelled_one_is_none)
{
  Emitter e[100];
  uint32_t state = 1;
  Cancel cancel = {0};
  Err err = {0};
  LightSet set;
  for (uint32_t i = 0; i < 100; i++) e[i] = some_emitter(i, &state);
  atomic_store(&cancel.requested, true);
  CHECK(!light_set_build(&set, e, 100, NULL, 0, &no_sky, &cancel, &err) && err.kind == ERR_CANCELLED);
  CHECK(set.emitter_count == 0);
}

TEST(many_in_one_place_and_odd_ones)
{
  enum { COUNT = 3000 };
  Emitter *e = calloc(COUNT, sizeof *e);
  for (uint32_t i = 0; i < COUNT; i++)
    e[i] = (Emitter){.kind = EMITTER_POINT, .color = v3_all(i % 3 ? 1 : 0), .map = -1, .mean_map = 1};
  e[7].p = v3(NAN, 0, 0);
  e[8].p = v3(INFINITY, 0, 0);
  e[10].color = v3_all(1e38f);
  LightSet set;
  CHECK(light_set_build(&set, e, COUNT, NULL, 0, &no_sky, NULL, NULL));
  uint32_t i = 0;
  float pmf = 0;
  for (int k = 0; k < 1000; k++) {
    CHECK(light_tree_pick(&set.tree, v3(1, 2, 3), v3_all(0), (float)k / 1000, &i, &pmf));
    CHECK(i < COUNT && i % 3 && i != 7 && i != 8 && pmf > 0 && pmf <= 1);
  }
  CHECK(light_tree_pmf(&set.tree, v3(1, 2, 3), v3_all(0), 7) == 0);
  light_set_finish(&set);
  free(e);
}

TEST_MAIN
