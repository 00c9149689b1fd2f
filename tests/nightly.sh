#!/bin/sh
# The long tier: promises that take too long to be shown at every change. usage: tests/nightly.sh [BUILD [SHORTEN]]
# BUILD: a release build with tests (build); SHORTEN: divides all counts (1: a night, 100: minutes). Prints a table of
# what was reached; exits with 1 if a promise is not met.
build=$(cd "${1:-build}" && pwd) || exit 64
short=${2:-1}
source=$(cd "$(dirname "$0")/.." && pwd)
rayfold=$build/rayfold
work=$(mktemp -d) || exit 73
trap 'chmod -R u+w "$work"; rm -rf "$work"' EXIT
cd "$work" || exit 73
cp -r "$source/scenes" .
table=$work/table
missed=0

# ID WHAT REACHED TRUE?
tell() {
  if [ "$4" = yes ]; then verdict=MET; else verdict="NOT MET" missed=1; fi
  printf '%-9s %-58s %-34s %s\n' "$1" "$2" "$3" "$verdict" | tee -a "$table"
}
shortened() { # COUNT at night, at least 1
  n=$(($1 / short))
  [ $n -ge 1 ] || n=1
  echo $n
}
hash_of() { "$rayfold" render "$@" -o hash --quiet 2>err </dev/null; }

# --- tests whose counts grow with the night --------------------------------------------------------
intensity=$((100 / short))
[ $intensity -ge 1 ] || intensity=1
long() { # ID WHAT TEST
  (cd "$source" && RAYFOLD_INTENSITY=$intensity timeout 7200 "$build/$3") >"$3.out" 2>&1
  rc=$?
  tell "$1" "$2" "$(tail -1 "$3.out"), x$intensity" "$([ $rc -eq 0 ] && echo yes)"
  [ $rc -eq 0 ] || sed -n '/is false/p' "$3.out" | head -5
}
long P1,P8 'furnaces, form factors, closed forms of whole pictures' test_render
long P3-P7 'BSDFs: chi-square, energy, reciprocity' test_bsdf
long P4 'samplers are uniform and stratified' test_sampler
long P4 'lights: chi-square, irradiance' test_light
long G1 'no ray slips through edges and corners' test_holes
long P12-P15 'estimators agree, errors fall and are told' test_estimators
long noise 'stopping early bends no mean (0.3 %)' test_noise
long R1 'killed while writing: old or new film whole' test_film_file
long D,R7 'one hash; cancel within its time; in the library' test_threads

# --- D1, D2: nothing but world, eye, settings and seed ----------------------------------------------
same=yes
count=0
for scene in scenes/*.json; do
  truth=$(hash_of "$scene" --size 64x48 --spp 8)
  [ -n "$truth" ] || same=no
  for way in '--threads 1' '--threads 2' '--threads 3' '--threads 5' '--threads 8' '--isa ref' '--isa v2' \
    '--samples 5:8 --samples 0:5' '--samples 1:2 --samples 2:8 --samples 0:1'; do
    # shellcheck disable=SC2086
    [ "$(hash_of "$scene" --size 64x48 --spp 8 $way)" = "$truth" ] || same=no
    count=$((count + 1))
  done
  for part in 0:1 1:2 2:3; do "$rayfold" render "$scene" --size 64x48 --spp 8 --tiles $part/3 --film $part.rff --quiet; done
  [ "$("$rayfold" merge 2:3.rff 0:1.rff 1:2.rff -o hash --quiet)" = "$truth" ] || same=no
  rm -f ./*.rff*
  count=$((count + 1))
done
tell D1,D2 'threads, levels, sample splits, parts: one hash a scene' "$count pictures" $same

# --- D5: another compiler, another level of optimisation ----------------------------------------------
if command -v clang >/dev/null; then
  same=yes
  count=0
  for how in 'clang -O2' 'clang -O3' 'gcc -O2'; do
    other=$work/other
    rm -rf "$other"
    cmake -S "$source" -B "$other" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_C_COMPILER="${how% *}" \
      -DCMAKE_C_FLAGS_RELEASE="${how#* } -DNDEBUG" >other.log 2>&1 &&
      cmake --build "$other" --target rayfold_program >other.log 2>&1 || { tail -5 other.log && same=no; }
    for scene in scenes/*.json; do
      [ "$("$other/rayfold" render "$scene" --size 64x48 --spp 4 -o hash --quiet)" = "$(hash_of "$scene" --size 64x48 --spp 4)" ] ||
        { echo "$scene: another picture with $how" && same=no; }
      count=$((count + 1))
    done
  done
  tell D5 'gcc and clang, -O2 and -O3: one hash a scene' "$count pictures" $same
fi

# --- R4, S: the program from outside, under sanitizers --------------------------------------------------
watched=$work/watched
cmake -S "$source" -B "$watched" -G Ninja -DCMAKE_BUILD_TYPE=Debug -DCMAKE_C_FLAGS_DEBUG="-O1 -g" \
  -DRAYFOLD_SANITIZE=address,undefined >watched.log 2>&1 && cmake --build "$watched" --target rayfold_program >watched.log 2>&1
"$source/tests/cli.sh" "$watched/rayfold" >watched.log 2>&1
rc=$?
tell S 'every command and option under ASan and UBSan' "$(tail -1 watched.log)" "$([ $rc -eq 0 ] && echo yes)"

# --- a long time in the window: random moves, picks, drags, undos, views and sizes ------------------------
soak() { # LINES
  awk -v lines="$1" 'BEGIN {
    srand(7)
    split("v n t b f5 f6 f8 f10 tab k x ctrl+z ctrl+y g [ ] f1 f1 l m h f3 f4", keys, " ")
    print "settle"
    for (i = 0; i < lines; i++) {
      r = int(rand() * 8)
      if (r == 0) printf "resize %d %d\n", 64 + rand() * 400, 48 + rand() * 300
      else if (r == 1) printf "key %s\n", keys[1 + int(rand() * 23)]
      else if (r == 2) { d = substr("wasdqe", 1 + int(rand() * 6), 1); printf "down %s\nframe %d\nup %s\n", d, 1 + rand() * 6, d }
      else if (r == 3) printf "mouse %d %d\npress left\nrelease left\nframe\n", rand() * 400, rand() * 300
      else if (r == 4) printf "mouse %d %d\npress left\nmouse %d %d\nframe\nrelease left\n", rand() * 400, rand() * 300, rand() * 400, rand() * 300
      else if (r == 5) printf "wheel %d\n", rand() * 4 - 2
      else printf "frame %d\n", 1 + rand() * 4
    }
  }' >soak.script
  mkdir -p rooms && cp scenes/cornell.json scenes/furnace.json scenes/intro1.json scenes/intro2.json rooms/
  rm -f soak.sizes
  "$rayfold" view rooms --dummy --size 320x200 --spp 2 --threads 2 --script soak.script >soak.out 2>&1 &
  pid=$!
  while kill -0 $pid 2>/dev/null; do
    sed -n 's/^VmRSS:[^0-9]*\([0-9]*\).*/\1/p' /proc/$pid/status >>soak.sizes 2>/dev/null
    sleep 0.2
  done
  wait $pid
}
# Films and scratch grow with the largest window and scene seen so far, so memory settles late: not below 6000 lines.
lines=$(shortened 60000)
[ "$lines" -ge 6000 ] || lines=6000
soak "$lines"
rc=$?
# The largest of the last quarter against that of the third, in kB.
grown=$(awk '{ a[NR] = $1 } END { for (i = int(NR / 2); i <= NR; i++) if (i < 0.75 * NR) { if (a[i] > was) was = a[i] } else if (a[i] > is) is = a[i]; print is - was, was }' soak.sizes)
tell soak 'the window for a long time: no crash, memory stays' "code $rc, grew by ${grown% *} of ${grown#* } kB" \
  "$([ $rc -eq 0 ] && [ "${grown% *}" -lt $((${grown#* } / 10)) ] && echo yes)"
[ $rc -eq 0 ] || head -3 soak.out

# --- R2: killed in mid-render ------------------------------------------------------------------------
wanted=$(shortened 200)
good=0
trial=0
truth=$(hash_of scenes/cornell.json --size 96x64 --spp 64)
while [ $trial -lt "$wanted" ]; do
  trial=$((trial + 1))
  rm -f kept.rff*
  "$rayfold" render scenes/cornell.json --size 96x64 --spp 16 --film kept.rff --quiet
  "$rayfold" render scenes/cornell.json --size 96x64 --spp 64 --film kept.rff --quiet 2>/dev/null &
  pid=$!
  sleep "0.$((trial * 37 % 100 + 100))"
  kill -9 $pid 2>/dev/null
  wait $pid 2>/dev/null
  # Every other time the newest is damaged as well: the one before it is gone on with.
  if [ $((trial % 2)) -eq 0 ] && [ -e kept.rff~ ]; then truncate -s 100 kept.rff; fi
  [ "$("$rayfold" render scenes/cornell.json --size 96x64 --spp 64 --film kept.rff -o hash --quiet 2>/dev/null)" = "$truth" ] &&
    [ "$(find . -name '*.rfpart' | wc -l)" -eq 0 ] && good=$((good + 1))
done
tell R2 'killed in mid-render, gone on with: the whole picture' "$good of $wanted" "$([ $good -eq "$wanted" ] && echo yes)"

# --- R3: no room, no right ----------------------------------------------------------------------------
small="scenes/cornell.json --size 64x48 --spp 1 --quiet"
# shellcheck disable=SC2086
"$rayfold" render $small -o old.exr -o old.png
before=$(cat old.exr old.png | cksum)
bad=0
tried=0
limit=1 # not 0: what is said must have room, too
while [ $limit -lt 40 ]; do # blocks of 512 bytes
  for file in old.exr old.png; do
    size=$(($(stat -c %s $file) / 512))
    [ $limit -lt $size ] || continue
    # shellcheck disable=SC2086
    (trap '' XFSZ; ulimit -f $limit; "$rayfold" render $small -o $file --seed 9 2>err)
    rc=$?
    tried=$((tried + 1))
    [ $rc -eq 73 ] && grep -q 'cannot write' err || bad=$((bad + 1))
  done
  limit=$((limit + 1 + short / 20))
done
[ "$(cat old.exr old.png | cksum)" = "$before" ] || bad=$((bad + 1))
[ "$(find . -name '*.rfpart' | wc -l)" -eq 0 ] || bad=$((bad + 1))
tell R3 'no room: code 73, a message, the old file whole' "$tried limits, $bad wrong" "$([ $bad -eq 0 ] && echo yes)"
# shellcheck disable=SC2086
"$rayfold" render $small -o hash >/dev/full 2>err
rc=$?
tell R3 'standard output is full: said, not swallowed' "code $rc" "$([ $rc -eq 73 ] && echo yes)"

echo
echo "Shown by ./test.sh alone: P6, P9-P11, P16, G2-G5, G8, D4, D6, R4, R10, L. Not shown anywhere yet: P2 whole, P15's upper side, G6,"
echo "G7, G9, R5, R6, R8, R9, M2, M3, M5, S."
[ $missed -eq 0 ]
