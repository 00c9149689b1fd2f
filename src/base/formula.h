// Formula: a little language for one number at a place, compiled to a flat list of instructions. No pointers, no calls, no
// jumps: a loop is written out, so what a formula costs is known before it runs, and it always ends.
//
//   a = length(x, z) - 1;  repeat 3 { a = abs(a) - 0.2; }  length(a, y) - 0.1
//
// statements   name = expression;   repeat 8 { statements }     then one last expression: the value
// expressions  numbers, x y z and own names, + - * / and ^ with a whole exponent 0..16, parentheses, and the functions
//              of formula_functions[]
// limits       FORMULA_BUDGET instructions after writing out loops, FORMULA_REGISTERS values at once
//
// Every instruction has a result for all numbers: dividing by 0 divides by the least number allowed, roots of negative
// numbers are 0. Here are only the compiler and the list; geom/sdf_eval.h runs it in lanes.

#ifndef RAYFOLD_BASE_FORMULA_H
#define RAYFOLD_BASE_FORMULA_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { FORMULA_BUDGET = 512, FORMULA_REGISTERS = 32 };

typedef enum FormulaOp {
  FORMULA_CONSTANT,
  FORMULA_COPY,
  FORMULA_ADD,
  FORMULA_SUBTRACT,
  FORMULA_MULTIPLY,
  FORMULA_DIVIDE,
  FORMULA_NEGATE,
  FORMULA_MIN,
  FORMULA_MAX,
  FORMULA_ABS,
  FORMULA_SQRT,
  FORMULA_SIN,
  FORMULA_COS,
  FORMULA_EXP,
  FORMULA_FLOOR,
  FORMULA_MOD,
  FORMULA_LENGTH2,
  FORMULA_LENGTH3,
  FORMULA_CLAMP,
  FORMULA_MIX,
  FORMULA_SMOOTH_MIN,
  FORMULA_SMOOTH_MAX,
  FORMULA_ATAN2,
  FORMULA_NOISE,
} FormulaOp;

#define FORMULA_LEAST_DIVISOR 1e-12
#define FORMULA_MOST_EXPONENT 20.0 // of exp(): e^20 is 4.9e8

// out = op(in...); registers 0, 1, 2 hold x, y, z when it starts.
typedef struct FormulaStep {
  uint8_t op; // FormulaOp
  uint8_t out, in[3];
  float value; // of a constant
} FormulaStep;

typedef struct Formula {
  uint32_t count;
  uint8_t result; // register
  FormulaStep steps[FORMULA_BUDGET];
} Formula;

typedef struct FormulaFunction {
  const char *name;
  uint8_t op, operands;
} FormulaFunction;
extern const FormulaFunction formula_functions[];
extern const size_t formula_function_count;

// False: `message` says what is wrong and at which column of the text, counted from 1.
bool formula_compile(const char *text, Formula *out, char message[200]);

#endif
