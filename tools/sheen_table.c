// Writes src/shade/sheen_table.c, the directional albedo of the sheen lobe:
//
//   cc -O2 -o sheen_table tools/sheen_table.c -lm && ./sheen_table > src/shade/sheen_table.c
//
// What is stored and how it is looked up stands in src/shade/sheen.h; tests/test_bsdf.c checks the result against a sum
// over the lobe itself. Each entry is a midpoint sum over the directions of the light, denser towards the horizon.

#include <math.h>
#include <stdio.h>

enum { ROWS = 24, COLUMNS = 32, STEPS = 1200 };
#define LEAST_ROUGHNESS 0.15 // SHEEN_LEAST of sheen.h
#define MOST            4.0  // SHEEN_MOST
#define PI              3.14159265358979323846

// Masking of Charlie sheen (Estevez and Kulla 2017, equation 3 and table 1).
static double fit(double x, double alpha)
{
  static const double rough[5] = {21.5473, 3.82987, 0.19823, -1.97760, -4.32054};
  static const double smooth[5] = {25.3245, 3.32435, 0.16801, -1.27393, -4.85967};
  const double t = (1 - alpha) * (1 - alpha);
  double p[5];
  for (int k = 0; k < 5; k++) p[k] = t * smooth[k] + (1 - t) * rough[k];
  return p[0] / (1 + p[1] * pow(x, p[2])) + p[3] * x + p[4];
}

static double lambda(double cosine, double alpha)
{
  return cosine < 0.5 ? exp(fit(cosine, alpha)) : exp(2 * fit(0.5, alpha) - fit(1 - cosine, alpha));
}

static double albedo(double roughness, double mu)
{
  const double alpha = roughness * roughness, nu = sqrt(1 - mu * mu), masked = 1 + lambda(mu, alpha);
  double sum = 0;
  for (int i = 0; i < STEPS; i++) {
    const double t = (i + 0.5) / STEPS, z = t * t * t, s = sqrt(1 - z * z);
    const double shadowed = z / (4 * mu * z * (masked + lambda(z, alpha)));
    double ring = 0;
    for (int j = 0; j < STEPS / 4; j++) {
      const double phi = PI * (j + 0.5) / (STEPS / 4);
      const double hx = nu + s * cos(phi), hy = s * sin(phi), hz = mu + z;
      const double sine2 = (hx * hx + hy * hy) / (hx * hx + hy * hy + hz * hz);
      ring += pow(sine2, 0.5 / alpha);
    }
    sum += ring / (STEPS / 4) * shadowed * 3 * t * t / STEPS;
  }
  return sum * (2 + 1 / alpha); // times 2 pi over the 2 pi of the distribution
}

int main(void)
{
  printf("// The directional albedo of the sheen lobe, as shade/sheen.h describes. Written by "
         "tools/sheen_table.c.\n\n"
         "#include \"shade/sheen.h\"\n\n// clang-format off\n"
         "const uint16_t sheen_table[SHEEN_ROWS][SHEEN_COLUMNS] = {");
  for (int r = 0; r < ROWS; r++) {
    printf("\n  {");
    for (int c = 0; c < COLUMNS; c++) {
      const double root = fmax((double)c / (COLUMNS - 1), 0.02), mu = fmin(root * root, 1 - 1e-9);
      const double e = albedo(LEAST_ROUGHNESS + (1 - LEAST_ROUGHNESS) * r / (ROWS - 1), mu);
      printf("%s%d,", c && c % 16 == 0 ? "\n   " : c ? " " : "", (int)(fmin(e / MOST, 1) * 65535 + 0.5));
    }
    printf("},");
  }
  printf("\n};\n");
  return 0;
}
