#!/bin/sh
# Sets up if needed, builds, and runs rayfold with the given arguments. Without any it renders the showcase scene to
# showcase.png. Say RAYFOLD_BUILD=DIR to build somewhere else.
set -eu
top=$(cd "$(dirname "$0")" && pwd)
build=${RAYFOLD_BUILD:-$top/build}
"$top/tools/setup.sh" build

[ -e "$build/build.ninja" ] || cmake -S "$top" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DRAYFOLD_TESTS=OFF \
  >"$top/.setup.log" 2>&1 || { cat "$top/.setup.log" >&2; exit 1; }
rm -f "$top/.setup.log"
cmake --build "$build" --target rayfold_program >"$build/build.log" 2>&1 || { tail -40 "$build/build.log" >&2; exit 1; }

[ $# -gt 0 ] && exec "$build/rayfold" "$@"
"$build/rayfold" render "$top/scenes/showcase.json" -o showcase.png
