#!/bin/sh
# `rayfold view` from outside: every interaction by script without a display, the same pictures every run, and one run in a
# real window on a virtual display, which must show what the other saw. Usage: view.sh PATH/TO/rayfold
set -u
rayfold=$(cd "$(dirname "$1")" && pwd)/$(basename "$1")
[ -x "$rayfold" ] || { echo "usage: view.sh PATH/TO/rayfold"; exit 1; }
top=$(cd "$(dirname "$0")/.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
cp "$top/scenes/cornell.json" "$top/scenes/furnace.json" .
checks=0
failures=0
failed() {
  failures=$((failures + 1))
  echo "FAIL: $*"
  head -4 err
}
# play NAME [CODE [OPTION...]]: the script on stdin, without a display.
play() {
  name=$1 code=${2:-0}
  shift
  [ $# -gt 0 ] && shift
  cat >"$name.script"
  "$rayfold" view cornell.json --dummy --size "${size:-160x120}" --spp 2 --threads 2 --script "$name.script" "$@" >"$name.out" 2>err </dev/null
  got=$?
  [ -n "${VERBOSE:-}" ] && times
  checks=$((checks + 1))
  [ $got -eq "$code" ] || failed "$name: exit code $got, wanted $code"
}
has() { # PATTERN FILE
  checks=$((checks + 1))
  grep -q -e "$1" "$2" || failed "$2 lacks \"$1\""
}

# --- keys and mouse ---------------------------------------------------------------------------------
cat >moves <<'S'
settle
expect samples 2
expect view path
hash
down w
frame 5
up w
hash
mouse 80 60
press left
mouse 90 64
mouse 100 70
frame
release left
frame
hash
wheel 2
press middle
mouse 80 60
mouse 70 50
frame
release middle
frame
hash
key tab
key f6
settle
expect view normal
key v
expect view depth
resise 128 96 # a slip
S
sed '/^resise/d' moves >moves.good
play moves 0 <moves.good
play again 0 <moves.good
checks=$((checks + 1))
cmp -s moves.out again.out || failed "the same script gave other pictures"
checks=$((checks + 1))
[ "$(sort -u moves.out | wc -l)" -eq 4 ] || failed "moving changed nothing: $(tr '\n' ' ' <moves.out)"
play slip 65 <moves
has 'slip.script:.*no command "resise"' err

play size <<'S'
settle
resize 128 96
settle
expect size 128 96
save size.png
S
# --- picking, dragging, undo ------------------------------------------------------------------------
play pick <<'S'
settle
mouse 80 112
press left
release left
settle
expect picked 'short box'
key escape
expect picked nothing
S
# The panel of a window wide enough: its first row drags the material's red.
size=640x300
play drag 0 --integrator albedo <<'S'
settle
mouse 320 280
press left
release left
expect picked 'short box'
frame
expect value 'materials.white.albedo.0' 0.7295
mouse 500 108
press left
frame
mouse 480 108
frame
mouse 460 108
frame
release left
settle
expect value 'materials.white.albedo.0' 0.38
key ctrl+z
frame
expect value 'materials.white.albedo.0' 0.7295
key ctrl+y
frame
expect value 'materials.white.albedo.0' 0.38
S
size=
# --- proofs: a triangle of the flat room, an arrow that nothing turns, no volume without walls of space ---
play prove 0 --integrator normal <<'S'
settle
mouse 80 100
key m
frame
expect proof '0 gates'
mouse 30 60
key m
mouse 130 50
key m
frame
expect proof 'angles 180.000'
key h
frame
expect note 'come back'
down w
frame 20
up w
down d
frame 10
up d
key h
frame
expect proof 'turned by 0.000'
key j
frame
expect note 'no walls of space'
S
# --- stored views, flights, saving ------------------------------------------------------------------
play views 0 --integrator normal <<'S'
settle
key ctrl+1
frame
down w
frame 10
up w
key ctrl+2
frame
key 1
frame 150
expect eye 0 1 5 0.001
key p
frame 250
expect eye 0 1 4.86 0.01
key ctrl+s
frame
expect note saved
S
has '"view1"' cornell.json
has '"view2"' cornell.json
cp "$top/scenes/cornell.json" .
# --- on foot: gravity holds, walls stop -------------------------------------------------------------
play walk 0 --integrator normal <<'S'
settle
down shift
down w
frame 76
up w
up shift
key g
down w
frame 130
up w
expect eye -0.086 1 0.117 0.01
S
# --- pictures, files --------------------------------------------------------------------------------
play shot <<'S'
settle
key f12
frame
expect note saved
expect file cornell-001.png
drop furnace.json
frame
settle
expect note furnace
drop nowhere.glb
frame
expect note nowhere.glb
key l
frame
S
"$rayfold" render cornell.json --size 160x120 --spp 2 -o offline.png --quiet 2>err || failed "render"
checks=$((checks + 1))
"$rayfold" compare offline.png cornell-001.png >/dev/null 2>err && cmp -s offline.png cornell-001.png ||
  "$rayfold" compare offline.png cornell-001.png --most 1e-9 >/dev/null 2>err || failed "the screenshot is not what rendering gives"
# The scenes of a folder: dropped on the window, one after the other, and chosen from a list; what they say of themselves.
mkdir rooms
sed '1s/{/{ "about": { "title": "The \\"first\\" room", "text": "Two boxes and a lamp." },/' cornell.json >rooms/a.json
cp furnace.json rooms/b.json
echo none >rooms/c.txt
play folder <<'S'
settle
drop rooms
settle
expect note rooms/a.json
expect caption 'The "first" room'
expect caption 'Two boxes'
key f4
settle
expect note b.json
expect caption ''
key f4
settle
expect note a.json
key f3
settle
expect note b.json
key f2
frame
key up
key enter
settle
expect note a.json
key f2
frame
key down
key escape
frame
expect caption 'The "first" room'
S
# A file that changes is opened again, with all that was equal kept; a broken one leaves the picture and says why.
sed 's/"albedo": \[[^]]*\]/"albedo": [0.2, 0.4, 0.8]/' cornell.json >blue.json
echo '{ "rayfold": 1, "camera": { "fovv": 3 } }' >broken.json
cp cornell.json kept.json
play reload 0 --integrator albedo <<'S'
settle
hash
copy blue.json cornell.json
frame 40
expect note opened
settle
hash
copy broken.json cornell.json
frame 40
expect note fovv
settle
key f5
copy kept.json cornell.json
frame 40
key f8
settle
hash
S
checks=$((checks + 1))
[ "$(sed -n 1p reload.out)" != "$(sed -n 2p reload.out)" ] || failed "the changed file looks as before"
# A change on the disk that could not be read is not written over by the way.
cp kept.json cornell.json
play overtaken <<'S'
settle
copy broken.json cornell.json
frame 40
expect note fovv
key ctrl+s
expect note 'once more'
copy cornell.json was.json
key ctrl+s
expect note saved
S
checks=$((checks + 1))
cmp -s was.json broken.json || failed "saving destroyed what was on the disk"
has '"objects"' cornell.json
# A scene without a camera is read again, too.
printf '{ "rayfold": 1, "sky": { "kind": "constant" }, "objects": [ { "shape": { "kind": "sphere" } } ] }' >cornell.json
printf '{ "rayfold": 1, "sky": { "kind": "constant" }, "objects": [ { "shape": { "kind": "box" } } ] }' >second.json
play cameraless <<'S'
settle
copy second.json cornell.json
frame 40
expect note opened
S
# What moves is shown at its first moment; whitted pictures are light, with the scene's own curve.
cat >cornell.json <<'E'
{ "rayfold": 1, "camera": { "position": [0, 0, 4] }, "sky": { "kind": "constant", "gain": 0.2 }, "develop": { "exposure": 1 },
  "objects": [ { "name": "ball", "shape": { "kind": "sphere" } } ],
  "animation": [ { "path": "objects.ball.translate.x", "keys": [ { "time": 0, "value": 1 }, { "time": 1, "value": 0 } ] } ] }
E
rm -f cornell-*.png
play moment 0 --integrator whitted <<'S'
settle
key f12
frame
expect file cornell-001.png
S
"$rayfold" render cornell.json --size 160x120 --spp 2 --integrator whitted -o offline.png --quiet 2>err || failed "render"
checks=$((checks + 1))
cmp -s offline.png cornell-001.png || failed "a scene that moves is shown otherwise than it is rendered"
cp kept.json cornell.json
# --- refusals ---------------------------------------------------------------------------------------
for bad in "expect picked door" "expect samples 7" "expect value render.spp 9" "press nose" "key nose" "expect eye 9 9 9 0.1"; do
  printf 'settle\n%s\n' "$bad" >refused
  play refused 65 <refused
  has 'refused.script:2: ' err
done
"$rayfold" view cornell.json --dummy >out 2>err
[ $? -eq 64 ] || failed "--dummy without a script"
"$rayfold" view nowhere.json --dummy --script moves.good >out 2>err
[ $? -eq 66 ] || failed "a scene that is not there"
"$rayfold" view cornell.json --dummy --script nowhere.script >out 2>err
[ $? -eq 66 ] || failed "a script that is not there"

# Hostile scripts: nothing shown yet, a size not yet drawn, numbers without end, no text at all.
for bad in hash 'settle\nresize 800 700\nhash' 'save nowhere/a.png' 'copy nowhere a' 'copy / a' 'resize 1e9 nan'; do
  printf "$bad\n" >refused
  code=65
  case $bad in copy*) code=66 ;; esac
  play hostile $code <refused
done
play endless <<'S'
settle
mouse 1e300 -1e300
press left
mouse -99999999999999999999 99999999999999999999
frame
release left
wheel nan
wheel -1e300
frame 2
S
printf 'settle\0hash\n' >refused
play binary 65 <refused
"$rayfold" view cornell.json --dummy --script . >out 2>err
[ $? -eq 66 ] || failed "a folder as a script"

# --- a real window ----------------------------------------------------------------------------------
window() {
  command -v Xvfb >/dev/null || { echo "no Xvfb: the window itself is not tested"; return; }
  "$rayfold" --version | grep -q '^windows: SDL' || { echo "no SDL in this build: the window itself is not tested"; return; }
  display=
  for n in 91 92 93 94 95; do
    [ -e /tmp/.X11-unix/X$n ] && continue
    Xvfb :$n -screen 0 800x600x24 -nolisten tcp >xvfb.log 2>&1 &
    xvfb=$!
    display=:$n
    break
  done
  [ -n "$display" ] || { echo "no free display: the window itself is not tested"; return; }
  i=0
  while [ ! -e "/tmp/.X11-unix/X${display#:}" ] && [ $i -lt 100 ]; do sleep 0.1; i=$((i + 1)); done
  printf 'settle\nkey f1\nframe\nhash\nsave window.png\n' >window.script
  # The desktop's libraries keep some memory to the end, which is not ours to free.
  ASAN_OPTIONS=detect_leaks=0 DISPLAY=$display "$rayfold" view cornell.json --size 320x240 --spp 2 --script window.script \
    >window.out 2>err </dev/null || failed "in a window"
  checks=$((checks + 1))
  kill $xvfb
  wait $xvfb 2>/dev/null
  cp window.png window.real.png
  "$rayfold" view cornell.json --dummy --size 320x240 --spp 2 --script window.script >dummy.out 2>err </dev/null
  checks=$((checks + 2))
  cmp -s window.out dummy.out || failed "the window's frames are others: $(cat window.out) and $(cat dummy.out)"
  cmp -s window.png window.real.png || failed "the window shows something else than was drawn"
}
window

echo "$checks checks, $failures failed"
[ $failures -eq 0 ]
