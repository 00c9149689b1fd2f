#!/bin/sh
# Frame times of the integrator whitted, whole and by blocks, and how far blocks are from whole pictures; and, where
# POV-Ray is installed, its time for the same picture. docs/realtime.md holds what came out.
set -eu
top=$(cd "$(dirname "$0")/.." && pwd)
usage() {
  cat <<'END'
usage: bench/realtime.sh [OPTION]...
  --tool PROGRAM     tests/tool_frames.c, built (build/tool_frames)
  --frames N         of each of three sequences a scene (32)
  --repeats N        of each frame, of which the fastest counts (2)
  --threads "A B"    ("1 2")
  --size "WxH WxH"   ("800x600 1920x1080")
  --isa "A B"        levels of instructions ("auto")
  --mesh SCENE       also this scene at 1280x720, whole, by blocks and at half the resolution
  --pov SCENE.pov    also POV-Ray's time for this file, whole seconds of one thread, start-up taken off
A line a run: frames,SCENE,SIZE,THREADS,ISA,FULL ms,BLOCKS ms,FULL user ms,BLOCKS user ms,TRACED %,MEAN dB,WORST dB,
FLICKERING ppm. User times are of all threads together; on a machine that others use they are the ones to look at.
END
}
tool=$top/build/tool_frames frames=32 repeats=2 threads="1 2" sizes="800x600 1920x1080" levels=auto mesh="" pov=""
while [ $# -gt 0 ]; do
  case $1 in
  --help) usage && exit 0 ;;
  --tool | --frames | --repeats | --threads | --size | --isa | --mesh | --pov)
    [ $# -ge 2 ] || { usage >&2 && exit 64; }
    case $1 in
    --tool) tool=$2 ;;
    --frames) frames=$2 ;;
    --repeats) repeats=$2 ;;
    --threads) threads=$2 ;;
    --size) sizes=$2 ;;
    --isa) levels=$2 ;;
    --mesh) mesh=$2 ;;
    --pov) pov=$2 ;;
    esac
    shift
    ;;
  *) usage >&2 && exit 64 ;;
  esac
  shift
done
[ -x "$tool" ] || { echo "realtime.sh: there is no $tool; cmake --build build --target tool_frames" >&2 && exit 66; }
cd "$top"
for size in $sizes; do
  for level in $levels; do
    for t in $threads; do
      "$tool" -t "$t" -i "$level" -s "$size" -n "$frames" -r "$repeats" scenes/intro1.json scenes/intro2.json \
        scenes/fidelity/e_whitted.json
    done
  done
done
if [ -n "$mesh" ]; then
  "$tool" -t 2 -s 1280x720 -n 4 -r 4 "$mesh"
  "$tool" -t 2 -s 1280x720 -n 4 -r 4 -k 2 "$mesh"
fi
if [ -n "$pov" ]; then
  command -v povray >/dev/null || { echo "realtime.sh: install Debian's povray" >&2 && exit 66; }
  out=$(mktemp -d)
  trap 'rm -rf "$out"' EXIT
  for size in "+W8 +H6" "+W800 +H600"; do
    best=999
    for _ in 1 2 3; do
      # shellcheck disable=SC2086 # two words
      seconds=$( { /usr/bin/time -f %U povray "$pov" $size +WT1 -D -A "+O$out/x.png" >/dev/null 2>"$out/log"; } 2>&1; tail -1 "$out/log")
      best=$(echo "$seconds $best" | awk '{ print $1 < $2 ? $1 : $2 }')
    done
    echo "povray,$pov,$size,1,$best s user"
  done
fi
