#!/bin/sh
# Our pictures and those of Blender's Cycles side by side: mean colours, and the time to equal noise. README.md beside
# this file says how; docs/fidelity.md holds what came out.
set -eu
top=$(cd "$(dirname "$0")/.." && pwd)
usage() {
  cat <<'END'
usage: bench/fidelity.sh [OPTION]...
  --rayfold PROGRAM  the program to measure (build/rayfold)
  --cache FOLDER     for scenes and pictures: some hundred MB (build/fidelity)
  --scene NAME       only this one; may be repeated: a_cornell b_stilllife c_terrain c_skyonly d_fog d_smoke
  --spp "A B"        samples a pixel of the two renders whose times are subtracted ("32 128")
  --threads N        for both (2)
  --noise X          target of the adaptive renders (0.15)
  --no-cycles        take Cycles' pictures and times from the cache
  --sheet FILE.jpg   also all pictures, ours in the left half of each pair (needs ImageMagick)
Needs Debian's blender and python3-numpy. Denoisers are off; start-up, loading and trees are not counted;
times are processor seconds over the number of threads.
END
}
rayfold=$top/build/rayfold cache=$top/build/fidelity scenes="" spp="32 128" threads=2 cycles=1 target=0.15 sheet=
while [ $# -gt 0 ]; do
  case $1 in
  --help) usage && exit 0 ;;
  --no-cycles) cycles=0 ;;
  --rayfold | --cache | --scene | --spp | --threads | --noise | --sheet)
    [ $# -ge 2 ] || { usage >&2 && exit 64; }
    case $1 in
    --rayfold) rayfold=$2 ;;
    --cache) cache=$2 ;;
    --scene) scenes="$scenes $2" ;;
    --spp) spp=$2 ;;
    --threads) threads=$2 ;;
    --noise) target=$2 ;;
    --sheet) sheet=$2 ;;
    esac
    shift
    ;;
  *) usage >&2 && exit 64 ;;
  esac
  shift
done
[ -n "$scenes" ] || scenes="a_cornell b_stilllife c_terrain c_skyonly d_fog d_smoke"
few=${spp% *} many=${spp#* }
[ -x "$rayfold" ] || { echo "fidelity.sh: there is no $rayfold; build it, or say where it is with --rayfold" >&2 && exit 66; }
command -v blender >/dev/null || { echo "fidelity.sh: install Debian's blender and python3-numpy" >&2 && exit 66; }
mkdir -p "$cache/neutral" "$cache/ours" "$cache/out"
[ -e "$cache/neutral/c_terrain.obj" ] || python3 "$top/bench/fidelity/make_scenes.py" "$cache/neutral" --big
cp "$top"/scenes/fidelity/*.json "$cache/ours/"
cp "$top/scenes/cornell.json" "$cache/ours/a_cornell.json"
for model in c_ground c_rocks; do ln -f "$cache/neutral/$model.ply" "$cache/ours/$model.ply"; done

out=$cache/out
run_cycles() { # scene
  rm -f "$out/times.jsonl"
  for seed in 0 1; do
    blender -b --factory-startup --python "$top/bench/fidelity/cycles.py" -- "$cache/neutral/$1.json" "$out" \
      --spp "$few,$many" --seed $seed --threads "$threads" --tag "cycles$seed" >"$out/blender.log" 2>&1 ||
      { tail -5 "$out/blender.log" >&2 && exit 70; }
  done
  sed -n 's/.*"spp": \([0-9]*\),.* "cpu": \([0-9.]*\).*/\1 \2/p' "$out/times.jsonl" >"$out/$1.cycles"
}
run_ours() { # scene
  rm -f "$out/$1.ours"
  for seed in 1 2; do
    for n in $few $many; do
      "$rayfold" render "$cache/ours/$1.json" -o "$out/$1_ours${seed}_$n.pfm" --spp "$n" --seed $seed --threads "$threads" \
        --stats "$out/stats.json" --quiet
      sed -n 's/.*"cpu_seconds": \([0-9.]*\).*/'"$n"' \1/p' "$out/stats.json" >>"$out/$1.ours"
    done
  done
}
# The same pictures with samples where the noise is, up to a target that takes about as many.
run_adaptive() { # scene
  for seed in 1 2; do
    "$rayfold" render "$cache/ours/$1.json" -o "$out/$1_adaptive$seed.pfm" --spp 4096 --noise "$target" --seed $seed \
      --threads "$threads" --stats "$out/stats.json" --quiet
    sed -n 's/.*"cpu_seconds": \([0-9.]*\).*/\1/p' "$out/stats.json"
  done | sort -n | head -1
}
# Seconds a sample of the whole picture, were all threads' processor time wall time. The least of each, since what
# disturbs only adds.
slope() { # file of "spp seconds"
  awk -v few="$few" -v threads="$threads" '$1 == few { a = !na++ || $2 < a ? $2 : a } $1 != few { b = !nb++ || $2 < b ? $2 : b; n = $1 }
    END { print (b - a) / (n - few) / threads }' "$1"
}
# Half of how two pictures of other seeds differ is the noise of each; nothing but noise is in it.
noise() { # picture, picture
  "$rayfold" compare "$1" "$2" | sed 's/.*relMSE \([^,]*\),.*/\1/' | awk '{ print $1 / 2 }'
}
mean() { # reference, picture: "r g b offset%"
  "$rayfold" compare "$1" "$2" | sed 's/.*mean \([^(]*\)(\([^ ]*\).*worst block \([^ ]*\).*/\1 \2 \3/'
}

# Processor seconds before the first sample.
start() { # file of "spp seconds", seconds a sample
  awk -v few="$few" -v s="$2" -v threads="$threads" '$1 == few { a = !n++ || $2 < a ? $2 : a } END { print a - s * few * threads }' "$1"
}
printf '%-12s | %-7s %-7s | %-23s %-23s %-7s %-7s | %-8s %-8s %-8s | %-6s %s\n' scene "ms/spp" "Cycles" "mean" "Cycles" \
  "off %" "block %" "s to .01" "Cycles" "adaptive" "ratio" "adaptive"
for s in $scenes; do
  [ -e "$cache/ours/$s.json" ] || { echo "$s: no scene of ours yet" && continue; }
  [ $cycles = 0 ] || run_cycles "$s"
  run_ours "$s"
  ours=$(slope "$out/$s.ours") theirs=$(slope "$out/$s.cycles")
  our_noise=$(noise "$out/${s}_ours1_$many.pfm" "$out/${s}_ours2_$many.pfm")
  their_noise=$(noise "$out/${s}_cycles0_$many.pfm" "$out/${s}_cycles1_$many.pfm")
  spent=$(run_adaptive "$s")
  adaptive_noise=$(noise "$out/${s}_adaptive1.pfm" "$out/${s}_adaptive2.pfm")
  adaptive=$(echo "$spent $(start "$out/$s.ours" "$ours") $adaptive_noise $threads" | awk '{ print ($1 - $2) / $4 * $3 / 0.01 }')
  set -- $(mean "$out/${s}_cycles0_$many.pfm" "$out/${s}_ours1_$many.pfm")
  set -- "$@" $(mean "$out/${s}_cycles0_$many.pfm" "$out/${s}_cycles1_$many.pfm")
  awk -v s="$s" -v a="$ours" -v b="$theirs" -v x="$our_noise" -v y="$their_noise" -v n="$many" -v mean="$1 $2 $3" \
    -v other="$6 $7 $8" -v off="$4" -v block="$5" -v w="$adaptive" 'BEGIN {
      t = a * n * x / 0.01; u = b * n * y / 0.01
      printf "%-12s | %-7.1f %-7.1f | %-23s %-23s %-7s %-7s | %-8.2f %-8.2f %-8.2f | %-6.2f %.2f\n", s, 1000 * a, 1000 * b,
        mean, other, off, block, t, u, w, t / u, w / u }'
done
[ -n "$sheet" ] || exit 0
tiles=
for s in $scenes; do
  for who in ours1 cycles0; do
    [ -e "$out/${s}_${who}_$many.pfm" ] || continue
    "$rayfold" convert "$out/${s}_${who}_$many.pfm" "$out/${s}_$who.png" --quiet
    tiles="$tiles $out/${s}_$who.png"
  done
done
# shellcheck disable=SC2086
montage $tiles -tile 4x -geometry 240x240+3+3 -background white -quality 88 "$sheet"
