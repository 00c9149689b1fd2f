#!/bin/sh
# Our library and Embree by turns on the same ray files, and the ratios: `bench/embree.sh --help`. README.md beside
# this file describes meshes, rays and lines.
set -eu
top=$(cd "$(dirname "$0")/.." && pwd)

usage() {
  cat <<'END'
usage: bench/embree.sh [OPTION]...
  --rayfold PROGRAM  the program to measure (build/rayfold)
  --cache FOLDER     for meshes, ray files, programs and raw lines: some GB (build/bench)
  --scene NAME       only this one; may be repeated: room, sphere270k, scan1M, hair1M, terrain2M, city, terrain10M
  --big              all of these; without it, all but terrain10M
  --rounds N         how often each program has its turn (3)
  --threads "LIST"   counts of threads ("1 2")
  --time SECONDS     at least, for each line of each round (0.3)
  --wall             wall time instead of processor time
  --table            measure nothing, only print and keep the tables of what was measured before
  --keep FOLDER      where the tables go (bench/results/MACHINE-ISA)
Needs Debian's libembree-dev, and installs it if it is missing.
END
}

rayfold=$top/build/rayfold cache=$top/build/bench scenes="" rounds=3 threads="1 2" seconds=0.3 keep="" measure=1
every="room sphere270k scan1M hair1M terrain2M city"
export RTB_CPU=1
while [ $# -gt 0 ]; do
  case $1 in
  --help) usage && exit 0 ;;
  --big) every="$every terrain10M" ;;
  --wall) unset RTB_CPU ;;
  --table) measure=0 ;;
  --rayfold | --cache | --scene | --rounds | --threads | --time | --keep)
    [ $# -ge 2 ] || { usage >&2 && exit 64; }
    case $1 in
    --rayfold) rayfold=$2 ;;
    --cache) cache=$2 ;;
    --scene) scenes="$scenes $2" ;;
    --rounds) rounds=$2 ;;
    --threads) threads=$2 ;;
    --time) seconds=$2 ;;
    --keep) keep=$2 ;;
    esac
    shift
    ;;
  *) usage >&2 && exit 64 ;;
  esac
  shift
done
[ -n "$scenes" ] || scenes=$every
[ -x "$rayfold" ] || { echo "embree.sh: there is no $rayfold; build it, or say where it is with --rayfold" >&2 && exit 66; }
rayfold=$(cd "$(dirname "$rayfold")" && pwd)/$(basename "$rayfold")
mkdir -p "$cache/raw"
cache=$(cd "$cache" && pwd)
sets="primary shadow bounce ao bounce2 chords"

# --- what it takes ---------------------------------------------------------------------------------
install_embree() {
  [ -e /usr/include/embree3/rtcore.h ] && return
  echo "embree.sh: installing libembree-dev" >&2
  sudo=""
  [ "$(id -u)" = 0 ] || sudo=sudo
  $sudo env DEBIAN_FRONTEND=noninteractive apt-get update -q >&2 || true
  $sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends libembree-dev >&2
}

# Without contraction every machine makes the same rays.
compile() { # program, sources and libraries
  program=$cache/$1
  shift
  # shellcheck disable=SC2086
  (cd "$top/bench" && ${CC:-cc} -O3 -march=native -std=gnu17 -ffp-contract=off -Wall -Wextra -o "$program" "$@")
}

generator() { # what makes the scene
  case $1 in
  room) echo room 19 ;;
  sphere270k) echo sphere 260 ;;
  scan1M) echo subdiv "$cache/sphere270k.rtm" ;;
  hair1M) echo hair 20833 ;;
  terrain2M) echo terrain 1000 ;;
  city) echo city 40 ;;
  terrain10M) echo terrain 2236 ;;
  *) echo "embree.sh: there is no scene $1" >&2 && exit 64 ;;
  esac
}

make_mesh() {
  [ -e "$cache/$1.rtm" ] && return
  how=$(generator "$1")
  # shellcheck disable=SC2086
  "$cache/meshgen" $how "$cache/$1.part" >&2
  mv "$cache/$1.part" "$cache/$1.rtm"
}

make_scene() {
  [ "$1" != scan1M ] || make_mesh sphere270k
  make_mesh "$1"
  [ -e "$cache/$1.chords.rays" ] && return # the last one made
  "$cache/embree_rays" "$cache/$1.rtm" gen "$top/bench/cams/$1.cam" "$cache/$1" >&2
}

# --- measuring -------------------------------------------------------------------------------------
ours() {
  options=""
  for n in $threads; do options="$options --threads $n"; done
  # shellcheck disable=SC2086
  "$rayfold" trace "$@" $options --api single --api batch --time "$seconds" --repeat 3
}

ours_best() {
  "$rayfold" trace "$@" --quality best --threads 1 --api single --api batch --time "$seconds" --repeat 3
}

theirs() {
  "$cache/embree_rays" -t "$(echo "$threads" | tr ' ' ,)" -a 1,8,16,m -s "$seconds" -n 3 "$@"
}

more_of_theirs() {
  "$cache/embree_rays" -r -l robust -t 1 -a 1 -s "$seconds" -n 3 "$@"
  "$cache/embree_rays" -q high -t 1 -a 1,8,16,m -s "$seconds" -n 3 "$@"
}

measure_scene() {
  files=""
  for set in $sets; do files="$files $cache/$1.$set.rays"; done
  : >"$cache/raw/$1.part"
  round=1
  while [ "$round" -le "$rounds" ]; do
    echo "embree.sh: $1, round $round of $rounds" >&2
    # Who goes first changes, so that neither always finds the machine as the other left it.
    # shellcheck disable=SC2086
    if [ $((round % 2)) -eq 1 ]; then
      ours "$cache/$1.rtm" $files --build && theirs "$cache/$1.rtm" rays $files && theirs "$cache/$1.rtm" build &&
        ours_best "$cache/$1.rtm" $files --build && more_of_theirs "$cache/$1.rtm" rays $files
    else
      more_of_theirs "$cache/$1.rtm" rays $files && ours_best "$cache/$1.rtm" $files --build &&
        theirs "$cache/$1.rtm" build && theirs "$cache/$1.rtm" rays $files && ours "$cache/$1.rtm" $files --build
    fi >>"$cache/raw/$1.part"
    round=$((round + 1))
  done
  mv "$cache/raw/$1.part" "$cache/raw/$1.csv"
}

# --- the tables ------------------------------------------------------------------------------------
machine() { # MACHINE-ISA
  "$rayfold" render "$top/scenes/tests/tiny.json" -o hash --size 8x8 --spp 1 --quiet --stats "$cache/stats.json" >"$cache/hash"
  isa=$(sed -n 's/.*"isa": "\([^"]*\)".*/\1/p' "$cache/stats.json")
  name=$(sed -n 's/^model name[^:]*: *//p' /proc/cpuinfo | head -n 1 | tr 'A-Z' 'a-z' |
    sed 's/([a-z]*)//g; s/@.*//; s/cpu\|processor//g; s/[^a-z0-9]\{1,\}/-/g; s/^-//; s/-$//')
  echo "${name:-$(uname -m)}-$isa"
}

tables() {
  for scene in $scenes; do [ ! -e "$cache/raw/$scene.csv" ] || cat "$cache/raw/$scene.csv"; done |
    awk -F, -v sets="$sets" -f "$top/bench/ratios.awk"
}

if [ $measure -eq 1 ]; then
  install_embree
  compile meshgen meshgen.c mesh_out.c room.c rtb.c -lm
  compile embree_rays embree_rays.c ray_sets.c rtb.c -lembree3 -lm -lpthread
  for scene in $scenes; do generator "$scene" >/dev/null; done
  for scene in $scenes; do make_scene "$scene"; done
  for scene in $scenes; do measure_scene "$scene"; done
fi
[ -n "$keep" ] || keep=$top/bench/results/$(machine)
mkdir -p "$keep"
tables >"$cache/embree.txt" && code=0 || code=$?
{
  echo "$(machine), $(nproc) processors, $("$rayfold" --version | head -n 1), times: ${RTB_CPU:+mean processor time of the threads}${RTB_CPU:-wall}" |
    sed 's/threads1$/threads/'
  cat "$cache/embree.txt"
} >"$keep/embree.txt"
for scene in $scenes; do [ ! -e "$cache/raw/$scene.csv" ] || cp "$cache/raw/$scene.csv" "$keep/$scene.csv"; done
cat "$keep/embree.txt"
exit "$code"
