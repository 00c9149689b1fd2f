#!/bin/sh
# Sets up, builds and passes all tests: structure, warnings as errors with gcc and clang, the whole suite in a release
# build, the units again under ASan+UBSan, what has threads under TSan, and the examples against an installed library.
set -eu
top=$(cd "$(dirname "$0")" && pwd)
cd "$top"
tools/setup.sh test
tools/denoiser.sh || echo "the tests of the denoising network will be skipped"
step() { printf '\n=== %s\n' "$*"; }
build() { # folder, target, options...
  dir=$1 target=$2
  shift 2
  cmake -S . -B "$dir" -G Ninja "$@" >"$dir.log" 2>&1 || { cat "$dir.log"; exit 1; }
  cmake --build "$dir" --target "$target" >"$dir.log" 2>&1 || { grep -E 'error|warning|FAILED' -A4 "$dir.log" | head -60; exit 1; }
  rm -f "$dir.log"
}

step "structure"
tools/layers.sh

step "release, gcc, warnings are errors"
build build all -DCMAKE_BUILD_TYPE=Release -DRAYFOLD_TESTS=ON -DRAYFOLD_WERROR=ON
tools/headers.sh build
ctest --test-dir build --output-on-failure -j 2

step "clang, warnings are errors"
build build-clang rayfold_program -DCMAKE_C_COMPILER=clang -DCMAKE_BUILD_TYPE=Debug -DCMAKE_C_FLAGS_DEBUG="-O0" -DRAYFOLD_WERROR=ON

step "units under ASan and UBSan"
build build-asan all -DCMAKE_BUILD_TYPE=Debug -DCMAKE_C_FLAGS_DEBUG="-O1 -g" -DRAYFOLD_SANITIZE=address,undefined
ctest --test-dir build-asan --output-on-failure -j 2 -LE night

step "threads under TSan"
build build-tsan thread_tests -DCMAKE_BUILD_TYPE=Debug -DCMAKE_C_FLAGS_DEBUG="-O1 -g" -DRAYFOLD_SANITIZE=thread
ctest --test-dir build-tsan --output-on-failure -L threads

step "an installed library"
tests/install.sh build
