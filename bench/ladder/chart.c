// What a run of the ladder found, as a table, as bars for a terminal, and as a picture.

#include "ladder.h"

#include <math.h>

// --- the table -------------------------------------------------------------------------------------
void ladder_table_head(FILE *out, const Ladder *l)
{
  fprintf(out, "%-23s%7s%9s", "", "build", "bytes a");
  for (size_t s = 0; s < l->set_count; s++) fprintf(out, " | %-27.27s", l->sets[s].name);
  fprintf(out, "\n%-23s%7s%9s", "rung", "s", "triangle");
  for (size_t s = 0; s < l->set_count; s++) fprintf(out, " | %10s %8s %7s", "Mrays/s", "boxes", "tri.s");
  fputs("\n", out);
}

static void print_rate(FILE *out, double rate)
{
  const double m = rate * 1e-6;
  fprintf(out, " | %10.*f", m < 0.01 ? 5 : m < 1 ? 3 : 2, m);
}

void ladder_table_row(FILE *out, const Ladder *l, size_t rung)
{
  const RungResult *r = &l->results[rung];
  fprintf(out, "%2zu %-20s%7.3f%9.1f", rung + 1, r->rung->name, r->build_seconds, r->bytes_per_triangle);
  for (size_t s = 0; s < l->set_count; s++) {
    print_rate(out, r->on[s].rate);
    if (r->rung->counts)
      fprintf(out, " %8.1f %7.1f", r->on[s].boxes, r->on[s].triangles);
    else
      fprintf(out, " %8s %7s", "-", "-");
  }
  fputs("\n", out);
  fflush(out);
}

// --- a scale of powers of ten ----------------------------------------------------------------------
typedef struct Scale {
  int low, high; // exponents
} Scale;

static Scale scale_of(const Ladder *l)
{
  Scale s = {99, -99};
  for (size_t i = 0; i < l->rung_count; i++)
    for (size_t k = 0; k < l->set_count; k++) {
      const double e = log10(l->results[i].on[k].rate);
      if (floor(e) < s.low) s.low = (int)floor(e);
      if (ceil(e) > s.high) s.high = (int)ceil(e);
    }
  return s;
}

static double scale_at(const Scale *s, double rate) // 0 to 1
{
  return s->high > s->low ? (log10(rate) - s->low) / (s->high - s->low) : 1;
}

// "230", "4.1 k", "17 M": rays a second.
static const char *rate_text(double rate, char out[24])
{
  const double value = rate >= 1e6 ? rate * 1e-6 : rate >= 1e3 ? rate * 1e-3 : rate;
  snprintf(out, 24, "%.*f%s", value < 10 && value != floor(value) ? 1 : 0, value,
           rate >= 1e6   ? " M"
           : rate >= 1e3 ? " k"
                         : "");
  return out;
}

// --- bars ------------------------------------------------------------------------------------------
void ladder_bars(FILE *out, const Ladder *l)
{
  enum { WIDTH = 40 };
  const Scale scale = scale_of(l);
  char text[24];
  for (size_t s = 0; s < l->set_count; s++) {
    fprintf(out, "\n%s, rays a second; every step of the scale is a factor of ten:\n", l->sets[s].name);
    for (size_t i = 0; i < l->rung_count; i++) {
      const double rate = l->results[i].on[s].rate;
      const int length = (int)(scale_at(&scale, rate) * WIDTH + 0.5);
      fprintf(out, "%-21s", l->results[i].rung->name);
      for (int k = 0; k < length; k++) fputc('#', out);
      fprintf(out, " %s", rate_text(rate, text));
      if (i) fprintf(out, ", x%.3g", rate / l->results[i - 1].on[s].rate);
      fputc('\n', out);
    }
  }
}

// --- the picture -----------------------------------------------------------------------------------
static const char *const colours[LADDER_SETS] = {"#2a6fb0", "#d9822b", "#3d9a5f", "#a3479a"};

enum { LEFT = 190, RIGHT = 150, ROW = 16, GAP = 12, TOP = 78, PLOT = 560 };

// Text of others inside a picture's markup.
static void print_escaped(FILE *out, const char *text)
{
  for (const char *c = text; *c; c++) {
    if (*c == '<')
      fputs("&lt;", out);
    else if (*c == '&')
      fputs("&amp;", out);
    else
      fputc(*c, out);
  }
}

static void print_text(FILE *out, double x, double y, const char *style, const char *text)
{
  fprintf(out, "<text x=\"%.1f\" y=\"%.1f\" %s>", x, y, style);
  print_escaped(out, text);
  fputs("</text>\n", out);
}

static void print_axis(FILE *out, const Scale *scale, double bottom)
{
  char text[24];
  for (int e = scale->low; e <= scale->high; e++) {
    const double x = LEFT + PLOT * scale_at(scale, pow(10, e));
    fprintf(out, "<line x1=\"%.1f\" y1=\"%d\" x2=\"%.1f\" y2=\"%.1f\" stroke=\"#d8d8d8\"/>\n", x, TOP - 6, x,
            bottom);
    print_text(out, x, TOP - 12, "text-anchor=\"middle\" fill=\"#666\"", rate_text(pow(10, e), text));
  }
}

static void print_bar(FILE *out, const Ladder *l, const Scale *scale, size_t i, size_t s, double y)
{
  char rate[24], text[64];
  const double value = l->results[i].on[s].rate, width = PLOT * scale_at(scale, value);
  fprintf(out, "<rect x=\"%d\" y=\"%.1f\" width=\"%.1f\" height=\"%d\" fill=\"%s\"/>\n", LEFT, y, width,
          ROW - 3, colours[s]);
  rate_text(value, rate);
  if (i)
    snprintf(text, sizeof text, "%s  (x %.2g)", rate, value / l->results[i - 1].on[s].rate);
  else
    snprintf(text, sizeof text, "%s", rate);
  print_text(out, LEFT + width + 6, y + ROW - 5.5, "fill=\"#333\"", text);
}

void ladder_svg(FILE *out, const Ladder *l, const char *title)
{
  const Scale scale = scale_of(l);
  const double step = ROW * (double)l->set_count + GAP, bottom = TOP + step * (double)l->rung_count;
  const int width = LEFT + PLOT + RIGHT, height = (int)bottom + 12;
  fprintf(out,
          "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%d\" height=\"%d\" viewBox=\"0 0 %d %d\" "
          "font-family=\"DejaVu Sans, Helvetica, sans-serif\" font-size=\"12\">\n"
          "<rect width=\"100%%\" height=\"100%%\" fill=\"#fff\"/>\n",
          width, height, width, height);
  print_text(out, 14, 24, "font-size=\"15\" font-weight=\"bold\" fill=\"#222\"", title);
  for (size_t s = 0; s < l->set_count; s++) {
    const double x = 14 + 170 * (double)s;
    fprintf(out, "<rect x=\"%.1f\" y=\"35\" width=\"11\" height=\"11\" fill=\"%s\"/>\n", x, colours[s]);
    print_text(out, x + 17, 45, "fill=\"#333\"", l->sets[s].name);
  }
  print_axis(out, &scale, bottom - GAP / 2.0);
  for (size_t i = 0; i < l->rung_count; i++) {
    const double y = TOP + step * (double)i;
    print_text(out, LEFT - 10, y + ROW * (double)l->set_count / 2 + 3, "text-anchor=\"end\" fill=\"#222\"",
               l->results[i].rung->name);
    for (size_t s = 0; s < l->set_count; s++) print_bar(out, l, &scale, i, s, y + ROW * (double)s);
  }
  fputs("</svg>\n", out);
}
