#!/bin/sh
# Sets up if needed, builds, and runs rayfold with the given arguments. Without any it renders the showcase scene to
# showcase.png. Say RAYFOLD_BUILD=DIR to build somewhere else.
set -eu
top=$(cd "$(dirname "$0")" && pwd)
build=${RAYFOLD_BUILD:-$top/build}
"$top/tools/setup.sh" build

quietly() { # what for, command...: what it prints is shown only if it fails
  what=$1
  shift
  "$@" >"$build/run.log" 2>&1 && return
  tail -40 "$build/run.log" >&2
  echo "run: $what failed; all of it is in $build/run.log" >&2
  exit 1
}
mkdir -p "$build" || { echo "run: RAYFOLD_BUILD=DIR ./run.sh builds in another folder" >&2; exit 1; }
if [ ! -e "$build/build.ninja" ]; then
  echo "run: building in $build, about half a minute the first time" >&2
  quietly configuring cmake -S "$top" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DRAYFOLD_TESTS=OFF
elif [ /var/lib/dpkg/status -nt "$build/build.ninja" ]; then
  # Packages that came since then may hold an optional library.
  quietly configuring cmake "$build"
fi
# The library and the pages, too, so that `cmake --install` finds what it needs.
quietly building cmake --build "$build" --target rayfold_program rayfold_shared rayfold_static rayfold_pages

[ $# -gt 0 ] && exec "$build/rayfold" "$@"
"$build/rayfold" render "$top/scenes/showcase.json" -o showcase.png
