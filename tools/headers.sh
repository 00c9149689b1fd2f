#!/bin/sh
# Checks that each header compiles alone: with gcc as C17, with clang if there is one, and the public one as C++ too.
# Vectors wider than the machine's only pass between static inline functions, so how they would be passed is of no matter.
# Build folders hold generated headers, so the first argument may name one (default: build).
cd "$(dirname "$0")/.." || exit 1
build=${1:-build}
bad=0
for header in $(find src include -name '*.h' | sort); do
  for compiler in ${CC:-gcc} clang; do
    command -v "$compiler" >/dev/null 2>&1 || continue
    flags="-std=c17 -D_GNU_SOURCE -march=x86-64-v2 -Wall -Wextra -Wno-unused-function -Wno-psabi -Isrc -Iinclude -I$build"
    [ "$(uname -m)" = x86_64 ] || flags=$(echo "$flags" | sed 's/-march=[^ ]*//')
    out=$(echo "#include \"${header#*/}\"" | $compiler $flags -fsyntax-only -x c - 2>&1) && [ -z "$out" ] && continue
    echo "$header does not compile alone with $compiler:"
    echo "$out" | head -5
    bad=1
  done
done
if command -v g++ >/dev/null 2>&1; then
  echo '#include <rayfold/rayfold.h>' | g++ -std=c++17 -Wall -Wextra -Iinclude -fsyntax-only -x c++ - || bad=1
fi
exit $bad
