// Writes src/shade/ggx_table.c, the directional albedo of the GGX lobe:
//
//   cc -O2 -o ggx_table tools/ggx_table.c -lm && ./ggx_table > src/shade/ggx_table.c
//
// What is stored and how it is looked up stands in src/shade/ggx_table.h; tests/test_bsdf.c checks the result
// against integrals of its own. Each entry is a midpoint sum of 256 x 256 over the visible normals, so the reflected
// part of a mirror of bumps is the mean of G2 / G1 (Heitz 2014, "Understanding the masking-shadowing function").

#include <math.h>
#include <stdio.h>

enum { SIZE = 32, STEPS = 256 };
#define TAU 6.28318530717958647692

typedef struct Entry {
  double full, rise;
} Entry;

// Reflected part of white light for a reflectance of 1 (full), and the angle Schlick's edge term seems to see, as
// its cosine minus mu, wo's (rise): the mean of (1 - wo.h)^5 is full * (1 - mu - rise)^5.
static Entry albedo(double roughness, double mu)
{
  const double alpha = roughness * roughness, nu = sqrt(fmax(0, 1 - mu * mu));
  const double scale = 1 / sqrt(alpha * alpha * nu * nu + mu * mu), sx = alpha * nu * scale, sz = mu * scale;
  double full = 0, edge = 0;
  for (int i = 0; i < STEPS; i++)
    for (int j = 0; j < STEPS; j++) {
      const double phi = TAU / 2 * (i + 0.5) / STEPS, z = 1 - (j + 0.5) / STEPS * (1 + sz);
      const double s = sqrt(fmax(0, 1 - z * z));
      const double hx = alpha * (s * cos(phi) + sx), hy = alpha * s * sin(phi), hz = z + sz;
      const double wo_h = (nu * hx + mu * hz) / sqrt(hx * hx + hy * hy + hz * hz);
      const double wl_z = 2 * wo_h * hz / sqrt(hx * hx + hy * hy + hz * hz) - mu;
      if (wl_z <= 0) continue;
      const double so = sqrt(alpha * alpha + (1 - alpha * alpha) * mu * mu);
      const double sl = sqrt(alpha * alpha + (1 - alpha * alpha) * wl_z * wl_z);
      const double g = wl_z * (mu + so) / (wl_z * so + mu * sl);
      full += g;
      edge += g * pow(1 - fmin(wo_h, 1), 5);
    }
  return (Entry){full / STEPS / STEPS, 1 - pow(edge / full, 0.2) - mu};
}

// The cosine at column x (a real number): the lookup's t = sqrt(cos) (1 + r) / (sqrt(cos) + r) solved for cos.
static double column_cos(double x, double roughness)
{
  const double t = x / (SIZE - 1), root = t < 1 ? t * roughness / (1 + roughness - t) : 1;
  return fmax(root * root, 1e-7);
}

static Entry table[SIZE][SIZE]; // [roughness][column]

static Entry middle(int row, int column)
{
  const Entry *a = &table[row][column], *b = &table[row + 1][column];
  return (Entry){(a[0].full + a[1].full + b[0].full + b[1].full) / 4,
                 (a[0].rise + a[1].rise + b[0].rise + b[1].rise) / 4};
}

// Straight lines between exact values all err to one side of a curve. Half of the error in the middle of the cells
// around is given to each entry, which halves the worst one. The row of roughness 0 and its neighbours stay exact.
static void balance(void)
{
  static Entry off[SIZE][SIZE];
  for (int r = 1; r < SIZE - 1; r++)
    for (int c = 0; c < SIZE - 1; c++) {
      const double roughness = (r + 0.5) / (SIZE - 1);
      const Entry truth = albedo(roughness, column_cos(c + 0.5, roughness)), line = middle(r, c);
      off[r][c] = (Entry){truth.full - line.full, truth.rise - line.rise};
    }
  for (int r = 1; r < SIZE; r++)
    for (int c = 0; c < SIZE; c++) {
      Entry sum = {0};
      int count = 0;
      for (int k = 0; k < 4; k++) {
        const int row = r - (k & 1), column = c - (k >> 1);
        if (row < 1 || row > SIZE - 2 || column < 0 || column > SIZE - 2) continue;
        sum.full += off[row][column].full;
        sum.rise += off[row][column].rise;
        count++;
      }
      table[r][c].full += 0.5 * sum.full / count;
      table[r][c].rise += 0.5 * sum.rise / count;
    }
}

static unsigned code(double x)
{
  return (unsigned)(fmin(fmax(x, 0), 1) * 65535 + 0.5);
}

// rise goes from -1 to 1.
static unsigned rise_code(double x)
{
  return code((x + 1) / 2);
}

static Entry decoded(int row, int column)
{
  return (Entry){code(table[row][column].full) / 65535.0,
                 rise_code(table[row][column].rise) * 2 / 65535.0 - 1};
}

// The cosine-weighted means of 1 - full and of the edge term, of what a lookup gives: rounded entries and all, so
// that dividing by a mean normalises. Steps even in t, where lookups are linear.
static void print_mean(int row)
{
  const double roughness = (double)row / (SIZE - 1);
  double missing = 0, edge = 0;
  enum { MEAN_STEPS = 31000 };
  for (int i = 0; i < MEAN_STEPS && row > 0; i++) {
    const double width = (SIZE - 1.0) / MEAN_STEPS, x = (i + 0.5) * width, mu = column_cos(x, roughness);
    const double area =
        pow(column_cos(x + width / 2, roughness), 2) - pow(column_cos(x - width / 2, roughness), 2);
    const Entry a = decoded(row, (int)x), b = decoded(row, (int)x + 1);
    const double w = x - (int)x, full = a.full * (1 - w) + b.full * w, rise = a.rise * (1 - w) + b.rise * w;
    missing += area * (1 - full);
    edge += area * full * pow(fmax(1 - mu - rise, 0), 5);
  }
  if (row == 0) edge = 1.0 / 21;
  printf("%s{%#.8gf, %#.8gf},", row % 3 ? " " : "\n  ", missing, edge);
}

int main(void)
{
  for (int c = 0; c < SIZE; c++) table[0][c] = (Entry){1, 0};
  for (int r = 1; r < SIZE; r++)
    for (int c = 0; c < SIZE; c++) {
      const double roughness = (double)r / (SIZE - 1);
      table[r][c] = albedo(roughness, column_cos(c, roughness));
    }
  balance();
  printf("// The directional albedo of the GGX lobe, as shade/ggx_table.h describes. Written by "
         "tools/ggx_table.c.\n\n"
         "#include \"shade/ggx_table.h\"\n\n// clang-format off\n"
         "const uint16_t ggx_table[GGX_TABLE_SIZE][GGX_TABLE_SIZE][2] = {");
  for (int r = 0; r < SIZE; r++) {
    printf("\n  {");
    for (int c = 0; c < SIZE; c++)
      printf("%s{%u, %u},",
             c && c % 8 == 0 ? "\n   "
             : c             ? " "
                             : "",
             code(table[r][c].full), rise_code(table[r][c].rise));
    printf("},");
  }
  printf("\n};\n\nconst float ggx_table_mean[GGX_TABLE_SIZE][2] = {");
  for (int r = 0; r < SIZE; r++) print_mean(r);
  printf("\n};\n");
  return 0;
}
