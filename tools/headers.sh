#!/bin/sh
# Checks that each header compiles alone: with gcc as C17, with clang if there is one, and the public one as C++ too.
# Vectors wider than the machine's only pass between static inline functions, so how they would be passed is of no matter.
# Build folders hold generated headers, so the first argument may name one (default: build).
cd "$(dirname "$0")/.." || exit 1
build=${1:-build}
bad=0
alone() { # header
  for compiler in ${CC:-gcc} clang; do
    command -v "$compiler" >/dev/null 2>&1 || continue
    flags="-std=c17 -D_GNU_SOURCE -march=x86-64-v2 -Wall -Wextra -Wno-unused-function -Wno-psabi -Isrc -Iinclude -I$build"
    [ "$(uname -m)" = x86_64 ] || flags=$(echo "$flags" | sed 's/-march=[^ ]*//')
    out=$(echo "#include \"${1#*/}\"" | $compiler $flags -fsyntax-only -x c - 2>&1) && [ -z "$out" ] && continue
    echo "$1 does not compile alone with $compiler:"
    echo "$out" | head -5
    bad=1
  done
}
# Every other header in each of two shells.
half() {
  for header in $(find src include -name '*.h' | sort | awk "NR % 2 == $1"); do alone "$header"; done
  return $bad
}
half 0 &
first=$!
half 1 || bad=1
wait $first || bad=1
if command -v g++ >/dev/null 2>&1; then
  echo '#include <rayfold/rayfold.h>' | g++ -std=c++17 -Wall -Wextra -Iinclude -fsyntax-only -x c++ - || bad=1
fi
exit $bad
