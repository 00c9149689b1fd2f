// See formula.h. Operator precedence by two stacks (Dijkstra's shunting yard), so the reader does not call itself;
// a loop's text is read again for each round, which writes it out. Names are bound to registers and bound anew by each
// assignment, so an assignment costs nothing.

#include "base/formula.h"

#include "base/number.h"
#include "base/text.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>

const FormulaFunction formula_functions[] = {
    {"min", FORMULA_MIN, 2},         {"max", FORMULA_MAX, 2},
    {"abs", FORMULA_ABS, 1},         {"sqrt", FORMULA_SQRT, 1},
    {"sin", FORMULA_SIN, 1},         {"cos", FORMULA_COS, 1},
    {"exp", FORMULA_EXP, 1},         {"floor", FORMULA_FLOOR, 1},
    {"mod", FORMULA_MOD, 2},         {"length", FORMULA_LENGTH2, 2},
    {"length", FORMULA_LENGTH3, 3},  {"clamp", FORMULA_CLAMP, 3},
    {"mix", FORMULA_MIX, 3},         {"smoothmin", FORMULA_SMOOTH_MIN, 3},
    {"smoothmax", FORMULA_SMOOTH_MAX, 3}, {"atan2", FORMULA_ATAN2, 2},
    {"noise", FORMULA_NOISE, 3},
};
const size_t formula_function_count = sizeof formula_functions / sizeof *formula_functions;

enum { MOST_NAMES = 28, MOST_NAME = 24, MOST_PENDING = 64, MOST_LOOPS = 8, MOST_TOKENS = 1 << 16, MOST_ROUNDS = 1000 };

typedef struct Name {
  char text[MOST_NAME];
  uint8_t reg;
} Name;

typedef struct Operand {
  uint8_t reg;
  bool is_temporary, is_zero; // zero: the constant 0
} Operand;

typedef enum PendingKind { PENDING_PAREN, PENDING_CALL, PENDING_ADD, PENDING_SUBTRACT, PENDING_MULTIPLY, PENDING_DIVIDE, PENDING_NEGATE } PendingKind;

typedef struct Pending { // an operator that waits for what is on its right
  PendingKind kind;
  size_t at;         // in the text
  const char *name;  // of a call, in the text
  size_t name_length, operand_base;
  int commas;
} Pending;

typedef struct Loop {
  size_t body;
  int rounds_left;
} Loop;

typedef struct Compiler {
  const char *text;
  size_t at;
  Formula *out;
  char *message;
  uint32_t used; // registers, a bit each
  Name names[MOST_NAMES];
  int name_count;
  Operand operands[MOST_PENDING];
  size_t operand_count;
  Pending pending[MOST_PENDING];
  size_t pending_count;
  Loop loops[MOST_LOOPS];
  int loop_count, tokens;
} Compiler;

_Static_assert(FORMULA_REGISTERS == 32, "a bit each");

static bool fail(const Compiler *c, size_t at, const char *what)
{
  snprintf(c->message, 200, "column %zu: %s", at + 1, what);
  return false;
}

static bool fail_named(const Compiler *c, size_t at, const char *format, const char *name, size_t length)
{
  char short_name[MOST_NAME + 1], what[160];
  const size_t n = length < MOST_NAME ? length : MOST_NAME;
  memcpy(short_name, name, n);
  short_name[n] = 0;
  text_disarm(short_name);
  snprintf(what, sizeof what, format, short_name);
  return fail(c, at, what);
}

static void skip_space(Compiler *c)
{
  while (isspace((unsigned char)c->text[c->at])) c->at++;
}

static bool is_name_char(char a, bool is_first)
{
  return isalpha((unsigned char)a) || a == '_' || (!is_first && isdigit((unsigned char)a));
}

static size_t name_length(const Compiler *c)
{
  size_t n = 0;
  while (is_name_char(c->text[c->at + n], n == 0)) n++;
  return n;
}

static bool name_is(const char *name, size_t length, const char *word)
{
  return strlen(word) == length && !strncmp(name, word, length);
}

static bool take(Compiler *c, char wanted)
{
  skip_space(c);
  if (c->text[c->at] != wanted) return false;
  c->at++;
  return true;
}

// --- registers and instructions -----------------------------------------------------------------------
static void let_go(Compiler *c, Operand o)
{
  if (o.is_temporary) c->used &= ~(1u << o.reg);
}

static bool new_register(Compiler *c, uint8_t *reg)
{
  if (c->used == UINT32_MAX) return fail(c, c->at, "too many values at once; there is room for 29 names and parts of sums");
  *reg = (uint8_t)__builtin_ctz(~c->used);
  c->used |= 1u << *reg;
  return true;
}

// Appends an instruction on the last `count` operands, which its result takes the place of.
static bool emit(Compiler *c, FormulaOp op, int count, float value)
{
  if (c->out->count == FORMULA_BUDGET)
    return fail(c, c->at, "the formula is too long: at most 512 operations, those of each round of a loop counted");
  FormulaStep *s = &c->out->steps[c->out->count++];
  *s = (FormulaStep){.op = (uint8_t)op, .value = value};
  c->operand_count -= (size_t)count;
  for (int i = 0; i < count; i++) {
    s->in[i] = c->operands[c->operand_count + (size_t)i].reg;
    let_go(c, c->operands[c->operand_count + (size_t)i]);
  }
  if (!new_register(c, &s->out)) return false;
  c->operands[c->operand_count++] = (Operand){s->out, true, op == FORMULA_CONSTANT && value == 0};
  return true;
}

static bool push_operand(Compiler *c, Operand o)
{
  if (c->operand_count == MOST_PENDING) return fail(c, c->at, "the expression is nested too deep");
  c->operands[c->operand_count++] = o;
  return true;
}

static bool push_pending(Compiler *c, Pending p)
{
  if (c->pending_count == MOST_PENDING) return fail(c, c->at, "the expression is nested too deep");
  c->pending[c->pending_count++] = p;
  return true;
}

static int rank_of(PendingKind k)
{
  switch (k) {
  case PENDING_PAREN:
  case PENDING_CALL: return 0;
  case PENDING_ADD:
  case PENDING_SUBTRACT: return 1;
  case PENDING_MULTIPLY:
  case PENDING_DIVIDE: return 2;
  case PENDING_NEGATE: return 3;
  }
  return 0;
}

static bool apply(Compiler *c, const Pending *p)
{
  switch (p->kind) {
  case PENDING_ADD: return emit(c, FORMULA_ADD, 2, 0);
  case PENDING_SUBTRACT: return emit(c, FORMULA_SUBTRACT, 2, 0);
  case PENDING_MULTIPLY: return emit(c, FORMULA_MULTIPLY, 2, 0);
  case PENDING_DIVIDE:
    if (c->operands[c->operand_count - 1].is_zero) return fail(c, p->at, "division by zero");
    return emit(c, FORMULA_DIVIDE, 2, 0);
  case PENDING_NEGATE: return emit(c, FORMULA_NEGATE, 1, 0);
  case PENDING_PAREN:
  case PENDING_CALL: return true;
  }
  return true;
}

// Applies what waits and binds at least as tightly.
static bool apply_down_to(Compiler *c, int rank)
{
  while (c->pending_count && rank_of(c->pending[c->pending_count - 1].kind) >= rank) {
    const Pending p = c->pending[--c->pending_count];
    if (!apply(c, &p)) return false;
  }
  return true;
}

static bool apply_call(Compiler *c, const Pending *p)
{
  const size_t given = c->operand_count - p->operand_base;
  bool is_known = false;
  for (size_t i = 0; i < formula_function_count; i++) {
    const FormulaFunction *f = &formula_functions[i];
    if (!name_is(p->name, p->name_length, f->name)) continue;
    if (f->operands == given) return emit(c, (FormulaOp)f->op, (int)given, 0);
    is_known = true;
  }
  if (is_known) return fail_named(c, p->at, "\"%s\" is given the wrong number of operands", p->name, p->name_length);
  return fail_named(c, p->at, "there is no function \"%s\"", p->name, p->name_length);
}

// x ^ n by repeated squaring; x^0 is 1.
static bool apply_power(Compiler *c, int n)
{
  const Operand x = c->operands[c->operand_count - 1];
  if (n == 1) return true;
  if (n == 0) {
    let_go(c, x);
    c->operand_count--;
    return emit(c, FORMULA_CONSTANT, 0, 1);
  }
  int bit = 8;
  while (!(n & bit) && bit > 1) bit >>= 1;
  if (n == 16) bit = 16;
  c->operands[c->operand_count - 1].is_temporary = false; // it is needed until the end
  for (bit >>= 1; bit; bit >>= 1) {
    if (!push_operand(c, c->operands[c->operand_count - 1])) return false;
    c->operands[c->operand_count - 1].is_temporary = false;
    if (!emit(c, FORMULA_MULTIPLY, 2, 0)) return false;
    if (!(n & bit)) continue;
    if (!push_operand(c, (Operand){x.reg, false, false}) || !emit(c, FORMULA_MULTIPLY, 2, 0)) return false;
  }
  let_go(c, x);
  return true;
}

// --- reading --------------------------------------------------------------------------------------------
static Name *find_name(Compiler *c, const char *name, size_t length)
{
  for (int i = 0; i < c->name_count; i++)
    if (name_is(name, length, c->names[i].text)) return &c->names[i];
  return NULL;
}

static bool read_number(Compiler *c)
{
  float x;
  const char *from = c->text + c->at, *end = number_float(from, from + strlen(from), &x);
  if (!end) return fail(c, c->at, "a number is not complete");
  if (!(x <= 1e30f)) return fail(c, c->at, "a number must be at most 1e30");
  if (c->operand_count == MOST_PENDING) return fail(c, c->at, "the expression is nested too deep");
  c->at += (size_t)(end - from);
  return emit(c, FORMULA_CONSTANT, 0, x);
}

// A name in an expression: a value, or a function if a parenthesis follows.
static bool read_word(Compiler *c, bool *is_call)
{
  const size_t at = c->at, length = name_length(c);
  const char *word = c->text + at;
  c->at += length;
  *is_call = take(c, '(');
  if (*is_call)
    return push_pending(c, (Pending){PENDING_CALL, at, word, length, c->operand_count, 0});
  const Name *n = find_name(c, word, length);
  if (!n) return fail_named(c, at, "\"%s\" is not known here", word, length);
  return push_operand(c, (Operand){n->reg, false, false});
}

// What may begin an operand: a sign, a parenthesis, a number, a name. *is_done when the operand is complete.
static bool read_operand(Compiler *c, bool *is_done)
{
  skip_space(c);
  const char a = c->text[c->at];
  bool is_call = false;
  *is_done = false;
  if (a == '-') {
    c->at++;
    return push_pending(c, (Pending){.kind = PENDING_NEGATE, .at = c->at - 1});
  }
  if (a == '(') {
    c->at++;
    return push_pending(c, (Pending){.kind = PENDING_PAREN, .at = c->at - 1});
  }
  if (isdigit((unsigned char)a) || a == '.') {
    *is_done = true;
    return read_number(c);
  }
  if (is_name_char(a, true)) {
    if (!read_word(c, &is_call)) return false;
    *is_done = !is_call;
    return true;
  }
  return fail(c, c->at, a ? "a number, a name or a parenthesis is missing here" : "the formula ends where a value is missing");
}

static bool close_paren(Compiler *c)
{
  if (!apply_down_to(c, 1)) return false;
  if (!c->pending_count) return fail(c, c->at, "a parenthesis too many");
  const Pending p = c->pending[--c->pending_count];
  c->at++;
  return p.kind == PENDING_PAREN || apply_call(c, &p);
}

static bool read_power(Compiler *c)
{
  if (!take(c, '^')) return true;
  skip_space(c);
  const size_t at = c->at;
  int n = 0, digits = 0;
  for (; isdigit((unsigned char)c->text[c->at]) && digits < 3; c->at++, digits++) n = 10 * n + (c->text[c->at] - '0');
  if (!digits || n > 16 || c->text[c->at] == '.') return fail(c, at, "an exponent must be a whole number from 0 to 16");
  return apply_power(c, n);
}

// After an operand: an operator (then another operand must follow), a closing parenthesis, or the end.
static bool read_operator(Compiler *c, bool *wants_operand, bool *is_end)
{
  if (!read_power(c)) return false;
  skip_space(c);
  const char a = c->text[c->at];
  *wants_operand = true;
  if (a == ')') {
    *wants_operand = false;
    return close_paren(c);
  }
  if (a == ',') {
    if (!apply_down_to(c, 1)) return false;
    if (!c->pending_count || c->pending[c->pending_count - 1].kind != PENDING_CALL)
      return fail(c, c->at, "a comma stands only between the operands of a function");
    c->at++;
    return true;
  }
  const char *found = a ? strchr("+-*/", a) : NULL;
  if (!found) {
    *is_end = true;
    return true;
  }
  static const PendingKind kinds[] = {PENDING_ADD, PENDING_SUBTRACT, PENDING_MULTIPLY, PENDING_DIVIDE};
  const PendingKind kind = kinds[found - "+-*/"];
  if (!apply_down_to(c, rank_of(kind))) return false;
  return push_pending(c, (Pending){.kind = kind, .at = c->at++});
}

// One expression; its value is then the only operand.
static bool read_expression(Compiler *c)
{
  bool wants_operand = true, is_end = false;
  c->operand_count = c->pending_count = 0;
  while (!is_end) {
    bool is_done = false;
    if (++c->tokens > MOST_TOKENS) return fail(c, c->at, "the formula is too long");
    if (wants_operand ? !read_operand(c, &is_done) : !read_operator(c, &wants_operand, &is_end)) return false;
    if (is_done) wants_operand = false;
  }
  if (!apply_down_to(c, 1)) return false;
  if (c->pending_count) return fail(c, c->pending[c->pending_count - 1].at, "this parenthesis is never closed");
  return true;
}

// --- statements -----------------------------------------------------------------------------------------
static bool assign(Compiler *c, size_t at, size_t length)
{
  const char *word = c->text + at;
  if (length >= MOST_NAME) return fail(c, at, "a name has at most 23 letters");
  if (!read_expression(c)) return false;
  if (!take(c, ';')) return fail(c, c->at, c->text[c->at] ? "an operator or \";\" is missing here" : "\";\" is missing, and after it the value of the formula");
  if (!c->operands[0].is_temporary && !emit(c, FORMULA_COPY, 1, 0)) return false; // two names, two registers
  Name *n = find_name(c, word, length);
  if (n) {
    c->used &= ~(1u << n->reg);
  } else {
    if (c->name_count == MOST_NAMES) return fail(c, at, "too many names: there is room for 25 beside x, y and z");
    n = &c->names[c->name_count++];
    memcpy(n->text, word, length);
    n->text[length] = 0;
  }
  n->reg = c->operands[0].reg;
  return true;
}

static bool begin_loop(Compiler *c)
{
  skip_space(c);
  const size_t at = c->at;
  int rounds = 0;
  for (int digits = 0; isdigit((unsigned char)c->text[c->at]) && digits < 6; digits++) rounds = 10 * rounds + (c->text[c->at++] - '0');
  if (rounds < 1 || rounds > MOST_ROUNDS) return fail(c, at, "repeat needs a whole number from 1 to 1000, as in repeat 8 { ... }");
  if (!take(c, '{')) return fail(c, c->at, "\"{\" is missing: repeat 8 { ... }");
  if (c->loop_count == MOST_LOOPS) return fail(c, at, "loops are nested more than 8 deep");
  c->loops[c->loop_count++] = (Loop){c->at, rounds - 1};
  return true;
}

static bool end_loop(Compiler *c)
{
  if (!c->loop_count) return fail(c, c->at, "\"}\" without a loop to end");
  Loop *l = &c->loops[c->loop_count - 1];
  c->at++;
  if (l->rounds_left-- > 0)
    c->at = l->body;
  else
    c->loop_count--;
  return true;
}

static bool finish(Compiler *c)
{
  if (!read_expression(c)) return false;
  skip_space(c);
  if (c->text[c->at]) return fail(c, c->at, "an operator is missing here");
  if (c->loop_count) return fail(c, c->at, "a loop is never closed with \"}\"");
  c->out->result = c->operands[0].reg;
  return true;
}

bool formula_compile(const char *text, Formula *out, char message[200])
{
  Compiler c = {.text = text ? text : "", .out = out, .message = message, .used = 7, .name_count = 3};
  out->count = 0;
  for (uint8_t k = 0; k < 3; k++) c.names[k] = (Name){.text = {(char)('x' + k)}, .reg = k};
  for (;;) {
    skip_space(&c);
    if (++c.tokens > MOST_TOKENS) return fail(&c, c.at, "the formula takes too many rounds");
    if (c.text[c.at] == '}') {
      if (!end_loop(&c)) return false;
      continue;
    }
    const size_t at = c.at, length = name_length(&c);
    c.at += length;
    if (name_is(text + at, length, "repeat")) {
      if (!begin_loop(&c)) return false;
    } else if (length && take(&c, '=')) {
      if (!assign(&c, at, length)) return false;
    } else {
      c.at = at;
      if (c.loop_count && c.text[at]) return fail(&c, at, "inside a loop stand only statements: name = value;");
      return finish(&c);
    }
  }
}
