#!/bin/sh
# Installs the build given as first argument into a temporary folder and compiles the examples against what is there:
# with pkg-config against the shared library, statically, and through the CMake package.
set -eu
top=$(cd "$(dirname "$0")/.." && pwd)
build=$(cd "$1" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
fail() { echo "install: $*" >&2; exit 1; }

DESTDIR="" cmake --install "$build" --prefix "$work/usr" >"$work/log" 2>&1 || { cat "$work/log"; exit 1; }
[ -f "$work/usr/include/rayfold/rayfold.h" ] || fail "no header"
PKG_CONFIG_PATH=$(dirname "$(find "$work/usr" -name rayfold.pc)")
export PKG_CONFIG_PATH
lib=$(dirname "$PKG_CONFIG_PATH")
cd "$work"

for example in minimal rays; do
  # shellcheck disable=SC2046
  ${CC:-cc} -std=c17 -Wall -Wextra -Werror "$top/examples/$example.c" -o "$example" $(pkg-config --cflags --libs rayfold)
  # shellcheck disable=SC2046
  ${CC:-cc} -std=c17 "$top/examples/$example.c" -o "$example.static" $(pkg-config --cflags rayfold) "$lib/librayfold.a" \
    $(pkg-config --libs --static rayfold | tr ' ' '\n' | grep -v '^-lrayfold$' | tr '\n' ' ')
done
LD_LIBRARY_PATH=$lib ./rays && ./rays.static || fail "examples/rays.c does not run"
LD_LIBRARY_PATH=$lib ./minimal "$top/scenes/tests/tiny.json" tiny.png || fail "examples/minimal.c does not run"
[ "$(head -c 4 tiny.png | tail -c 3)" = PNG ] || fail "examples/minimal.c made no picture"
./minimal.static "$top/scenes/tests/tiny.json" tiny2.png && cmp tiny.png tiny2.png || fail "the static build differs"

# Nothing but the public names leaves the shared library.
leaked=$(nm -D --defined-only "$lib/librayfold.so" | awk '{print $3}' | grep -v '^rf_' || true)
[ -z "$leaked" ] || fail "the shared library shows $leaked"
# Nor the static one, so that a program may have names like ours.
leaked=$(nm -g --defined-only "$lib/librayfold.a" | awk 'NF == 3 { print $3 }' | grep -v '^rf_' | head -5 || true)
[ -z "$leaked" ] || fail "the static library shows $leaked"
[ "$(nm -g --defined-only "$lib/librayfold.a" | grep -c ' T rf_')" -gt 40 ] || fail "the static library shows too little"
cat >clash.c <<END
#include <rayfold/rayfold.h>
int film_create = 1, arena_alloc = 2, jobs_run = 3; // names of the library's inside
int main(void) { rf_engine *e = rf_engine_create(0); rf_engine_destroy(e); return !e || film_create + arena_alloc + jobs_run != 6; }
END
# shellcheck disable=SC2046
${CC:-cc} -std=c17 clash.c -o clash $(pkg-config --cflags rayfold) "$lib/librayfold.a" \
  $(pkg-config --libs --static rayfold | tr ' ' '\n' | grep -v '^-lrayfold$' | tr '\n' ' ') && ./clash ||
  fail "a program cannot have names like the library's"
LD_LIBRARY_PATH=$lib "$work/usr/bin/rayfold" --version >/dev/null || fail "the installed program does not run"

mkdir package
cat >package/CMakeLists.txt <<END
cmake_minimum_required(VERSION 3.22)
project(user C)
find_package(rayfold REQUIRED)
add_executable(rays $top/examples/rays.c)
target_link_libraries(rays rayfold::rayfold)
END
cmake -S package -B package/build -G Ninja -DCMAKE_PREFIX_PATH="$work/usr" >log 2>&1 && cmake --build package/build >>log 2>&1 ||
  { cat log; fail "find_package(rayfold) does not work"; }
LD_LIBRARY_PATH=$lib package/build/rays || fail "the program of the CMake package does not run"
echo "install: the examples build and run against the installed library"
