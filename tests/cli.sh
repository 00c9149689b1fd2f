#!/bin/sh
# The program from outside: every command and option, the exit code and the message for each kind of bad input, that
# no failure touches a file that was there, and that the picture's hash does not depend on how it was made.
# Usage: cli.sh PATH/TO/rayfold
set -u
rayfold=$(cd "$(dirname "$1")" && pwd)/$(basename "$1")
[ -x "$rayfold" ] || { echo "usage: cli.sh PATH/TO/rayfold"; exit 1; }
top=$(cd "$(dirname "$0")/.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
cp "$top/scenes/cornell.json" "$top/scenes/furnace.json" .
unset NO_COLOR
checks=0
failures=0

failed() {
  failures=$((failures + 1))
  echo "FAIL: $*"
  sed 's/^/      /' err | head -4
}

# expect CODE PATTERN ARGUMENT...: runs rayfold; its exit code must be CODE and its stderr hold PATTERN (a basic
# regular expression, empty for any). What it printed is in the files out and err.
expect() {
  code=$1 pattern=$2
  shift 2
  "$rayfold" "$@" >out 2>err </dev/null
  got=$?
  checks=$((checks + 1))
  [ $got -eq "$code" ] || failed "rayfold $*: exit code $got, wanted $code"
  [ -z "$pattern" ] || grep -q -e "$pattern" err || failed "rayfold $*: stderr lacks \"$pattern\""
  [ "$code" -eq 0 ] || grep -q '^rayfold: ' err || failed "rayfold $*: no message"
}
# has PATTERN FILE
has() {
  checks=$((checks + 1))
  grep -q -e "$1" "$2" || failed "$2 lacks \"$1\""
}
# same A B WHAT
same() {
  checks=$((checks + 1))
  [ "$1" = "$2" ] || failed "$3: \"$1\" is not \"$2\""
}
hash_of() {
  "$rayfold" render "$@" -o hash --quiet 2>err </dev/null || failed "rayfold render $*"
}
small="--size 24x16 --spp 2 --quiet"

# --- help, manual page, completion -----------------------------------------------------------------
render_options="output size spp time noise camera at frames fps clip resume seed integrator max-depth threads isa set aov no-effects denoise samples tiles bits
  quality film allow-outside cache stats quiet help"
convert_options="exposure tone-curve bits quality allow-outside quiet help"
expect 0 '' man
cp out rayfold.1
expect 0 '' completion bash
cp out completion.bash
expect 0 '' completion zsh
cp out completion.zsh
expect 0 '' completion fish
cp out completion.fish
options_of() { # command, options
  expect 0 '' "$1" --help
  cp out page
  expect 0 '' help "$1"
  same "$(cat page)" "$(cat out)" "help $1"
  has "rayfold $1" rayfold.1
  for option in $2; do
    has "--$option" page
    has "\\\\-\\\\-$(echo "$option" | sed 's/-/\\\\-/g')" rayfold.1
    has "--$option" completion.bash
    has "--$option" completion.zsh
    has "seen_subcommand_from $1. -l $option" completion.fish
  done
}
options_of render "$render_options"
options_of view "size camera integrator spp frame-time step no-denoise no-hud font threads isa set script game progress dummy stats
  allow-outside cache help"
options_of convert "$convert_options"
options_of trace "threads api repeat time build compact isa label output help"
options_of bench "time size output quiet help"
options_of compare "output most help"
options_of prove "camera cell from look place leg open volume rays seed json allow-outside cache help"
options_of locks "quiet allow-outside help"
options_of info "allow-outside quiet help"
options_of validate "allow-outside quiet help"
for command in schema manual man completion help; do options_of $command help; done
expect 0 '' --version
has '^rayfold [0-9]*\.[0-9]*\.[0-9]*$' out
has 'PNG' out
expect 0 '' --help
expect 0 '' help
for command in render merge compare convert prove locks info validate schema trace bench manual man completion help; do
  has "^  $command " out
done
for code in 0 64 65 66 70 73 75; do has "^  $code " out; done
command -v bash >/dev/null && { bash -n completion.bash 2>err || failed "completion bash does not parse"; }
command -v zsh >/dev/null && { zsh -n completion.zsh 2>err || failed "completion zsh does not parse"; }
command -v fish >/dev/null && { fish -n completion.fish 2>err || failed "completion fish does not parse"; }
command -v mandoc >/dev/null && same "$(mandoc -T lint -W warning rayfold.1)" "" "mandoc -T lint"

# --- wrong command lines: found before anything is loaded ------------------------------------------
"$rayfold" >out 2>err
same $? 64 "rayfold alone"
expect 64 'did you mean "render"' redner cornell.json
expect 64 'help. lists' xyzzy
expect 64 'rayfold render cornell.json -o' cornell.json
expect 64 'did you mean "--size"' render cornell.json -o a.png --sise 8x8
expect 64 'no option --tile-size' render cornell.json -o a.png --tile-size f
expect 64 'needs -o OUT or --film' merge a.rff
expect 64 'no option -x' render cornell.json -x
expect 64 'needs SCENE' render -o a.png
expect 64 'named by -o' render cornell.json other.png
expect 64 'one word too many' convert cornell.json a.json b.json
expect 64 'one word too many' render cornell.json other.json -o a.png
expect 64 'needs -o' render missing.json
expect 64 'needs a value' render missing.json -o
expect 64 'needs a value' render missing.json -o a.png --spp --quiet
expect 64 'takes no value' render missing.json -o a.png --quiet=yes
expect 64 'given twice' render missing.json -o a.png --spp 3 --spp 4
expect 64 'did you mean ".png"' render missing.json -o a.pgn
expect 64 'needs an extension' render missing.json -o a
expect 64 'WxH' render missing.json -o a.png --size 8
expect 64 'size' render missing.json -o a.png --size 0x8
expect 64 'spp' render missing.json -o a.png --spp 0
expect 64 'whole number' render missing.json -o a.png --spp 1e3
expect 64 'seed' render missing.json -o a.png --seed -1
expect 64 'max-depth' render missing.json -o a.png --max-depth 5000
expect 64 'path' render missing.json -o a.png --integrator pth
expect 64 'time' render missing.json -o a.png --time 0
expect 64 'noise' render missing.json -o a.png --noise nan
expect 64 'one of auto' render missing.json -o a.png --isa v9
expect 64 'threads' render missing.json -o a.png --threads -2
expect 64 'did you mean "albedo"' render missing.json -o hash --aov depth,albdo
expect 64 'only .exr' render missing.json -o a.png --aov depth
expect 64 'A:B' render missing.json -o a.png --samples 8
expect 64 'A:B' render missing.json -o a.png --samples 8:8
expect 64 'overlap' render missing.json -o a.png --samples 0:8 --samples 7:9
expect 64 'time' render missing.json -o a.png --samples 0:8 --time 3
expect 64 'ends after' render missing.json -o a.png --samples 0:8 --spp 4
expect 64 'one of 8' render missing.json -o a.png --bits 12
expect 64 '8 or 16' render missing.json -o a.png --bits 32
expect 64 'quality' render missing.json -o a.jpg --quality 101
expect 64 'PATH=VALUE' render cornell.json -o a.png --set foo
expect 64 'did you mean' render cornell.json -o a.png --set materials.whit.albedo=0.5
expect 64 'materials.white.albedo' render cornell.json -o a.png --set materials.white.albedo=2
expect 64 'camera' render cornell.json -o a.png --camera nobody
expect 64 'one of bash' completion tcsh
expect 64 'needs IN OUT' convert cornell.json
expect 64 'did you mean "schema"' help shema
same "$(ls ./*.png 2>/dev/null)" "" "files made by wrong command lines"

# --- outputs that cannot be written ----------------------------------------------------------------
expect 73 'nowhere' render missing.json -o nowhere/a.png
expect 73 'nowhere' render missing.json -o hash --stats nowhere/s.json
expect 73 'not a folder' render missing.json -o cornell.json/a.png
mkdir folder.png
expect 73 'folder.png' render missing.json -o folder.png
expect 73 'nowhere' convert cornell.json nowhere/a.json
echo before >kept.pfm
echo before >kept.json
(ulimit -f 1 && exec "$rayfold" render cornell.json -o kept.pfm --size 64x64 --spp 1 --quiet) >out 2>err
same $? 73 "exit code on a full disk"
has '^rayfold: .*kept.pfm' err
same "$(cat kept.pfm)" before "a picture that was there, after a full disk"
same "$(ls | grep -c 'kept.pfm')" 1 "files left behind by a full disk"
"$rayfold" render cornell.json -o hash $small 2>err >&-
same $? 73 "exit code with stdout closed"
"$rayfold" schema 2>err >/dev/full
same $? 73 "exit code with stdout full"
{ sleep 0.3; "$rayfold" manual 2>err; echo $? >rc; } | true
same "$(cat rc)" 73 "exit code with the pipe closed"

# --- broken inputs ---------------------------------------------------------------------------------
# broken FILE PATTERN [CODE]: neither rendering nor checking it may succeed, and an existing output stays.
broken() {
  echo before >kept.png
  expect "${3:-65}" "$2" render "$1" -o kept.png $small
  expect "${3:-65}" "$2" validate "$1" --quiet
  same "$(cat kept.png)" before "a picture that was there, after $1"
}
with_shape() { # file to name, name of the scene
  printf '{"rayfold": 1, "objects": [{"shape": {"kind": "mesh", "file": "%s"}}]}\n' "$1" >"$2"
}
broken missing.json missing.json 66
expect 66 missing info missing.json
expect 66 missing convert missing.obj a.ply
expect 66 missing convert missing.png a.jpg
with_shape gone.ply names_gone.json
broken names_gone.json gone.ply 66
echo 'no scene' >words.text
broken words.text words.text
printf '' >empty.json
broken empty.json empty.json
printf '{ "rayfold": 1, "objcts": [] }' >key.json
broken key.json 'key.json:1:.*did you mean "objects"'
printf '{ "rayfold": 1, "render": { "spp": "many" } }' >type.json
broken type.json 'type.json:1:.*spp'
printf '{ "rayfold": 1, "render": { "spp": -4 } }' >range.json
broken range.json 'range.json:1:.*spp'
printf '{ "rayfold": 1, "objects": [ {"shape": {"kind": "cube"}} ] }' >kind.json
broken kind.json 'kind.json:1:.*cube'
printf '{ "rayfold": 1, "objects": [ {"shape": {"kind": "box"}, "material": "galss"} ], "materials": {"glass": {"kind": "glass"}} }' >name.json
broken name.json 'did you mean "glass"'
head -c 300 cornell.json >cut.json
broken cut.json 'cut.json:'
awk 'BEGIN { for (i = 0; i < 100000; i++) printf "["; print "" }' >deep.json
broken deep.json deep.json
awk 'BEGIN { for (i = 0; i < 100000; i++) printf "{\"objects\":"; print "" }' >deeper.json
broken deeper.json deeper.json
with_shape self.json self.json
broken self.json self.json
with_shape b.json a.json
with_shape a.json b.json
broken a.json 'json'
printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n' >index.obj
broken index.obj 'index.obj'
printf 'v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n' >nan.obj
broken nan.obj 'nan.obj'
ply() { printf 'ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face %s\nproperty list uchar int vertex_indices\nend_header\n%b' "$1" "$2"; }
ply 1 '0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n' >good.ply
expect 0 '' validate good.ply
has '^good.ply: ok$' out
ply 1 '0 0 0\n1 0 0\n0 nan 0\n3 0 1 2\n' >nan.ply
broken nan.ply nan.ply
ply 1 '0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n' >index.ply
broken index.ply index.ply
ply 1 '0 0 0\n1 0 0\n' >cut.ply
broken cut.ply cut.ply
ply 4000000000 '0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n' >huge.ply
broken huge.ply huge.ply
printf 'glTF\002\000\000\000\100\000\000\000\060\000\000\000JSON{"asset":{"ver' >cut.glb
broken cut.glb cut.glb
printf 'glTF' >header.glb
broken header.glb header.glb
head -c 90 /dev/zero >zero.stl
broken zero.stl zero.stl
# A mesh of no triangles is no fault of the renderer's: an error or an empty picture, never a crash.
ply 0 '0 0 0\n1 0 0\n0 1 0\n' >none.ply
"$rayfold" render none.ply -o none.png $small >out 2>err
code=$?
checks=$((checks + 1))
[ $code -eq 0 ] || [ $code -eq 65 ] || failed "a mesh of no triangles: exit code $code"
printf 'v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n' >line.obj
expect 0 'nothing to see' render line.obj -o none.png --size 24x16 --spp 1
expect 0 '' render cornell.json -o whole.png $small
head -c 60 whole.png >cut.png
printf '{"rayfold": 1, "textures": {"t": {"kind": "image", "file": "cut.png"}},
 "materials": {"m": {"kind": "lambert", "albedo_texture": "t"}},
 "objects": [{"shape": {"kind": "box"}, "material": "m"}]}' >texture.json
broken texture.json cut.png
expect 65 cut.png convert cut.png a.jpg
mkdir inside
cp whole.png outside.png
sed 's/cut.png/..\/outside.png/' texture.json >inside/scene.json
broken inside/scene.json 'allow-outside'
expect 0 '' render inside/scene.json -o kept.png $small --allow-outside
expect 0 '' validate inside/scene.json --allow-outside

# --- what works ------------------------------------------------------------------------------------
expect 0 '' validate cornell.json furnace.json good.ply
same "$(grep -c ': ok$' out)" 3 "lines of validate"
expect 65 'key.json' validate cornell.json key.json furnace.json
same "$(grep -c ': ok$' out)" 2 "lines of validate"
expect 0 '' info cornell.json
has '[0-9]' out
# A cube of space with six faces: of a metre each side, home after one, and its triangles are flat.
echo '{ "rayfold": 1, "cells": { "c": { "space": "torus", "size": [1, 1, 1] } }, "camera": { "position": [0, 0, 0], "target": [1, 0.1, 0.2], "cell": "c" },
  "objects": [ { "cell": "c", "shape": { "kind": "sphere", "radius": 0.1 }, "translate": [0.3, 0.2, 0.1] } ] }' >space.json
expect 0 '' prove space.json --cell c --leg 0,0,-1 --open --place 0.2,0,0 --place 0,0.3,0 --volume --rays 20000
has 'home: *within' out
has 'angles: *180.0000' out
has 'area: *0.03 m2' out
has 'volume: 1.00[0-9]* +- 0.00\|volume: 0.99[0-9]* +- 0.00' out
expect 0 '' prove cornell.json --look 0.5,0.9 --look 0.2,0.5 --json
has '"expected_angles": 3.14159265' out
command -v python3 >/dev/null && { python3 -m json.tool out >/dev/null 2>err || failed "prove --json is no JSON"; }
expect 64 'has no cell of that name' prove space.json --cell d
expect 64 'three numbers' prove space.json --place 1,2
expect 64 'numbers from 0 to 1' prove space.json --look 2,0
expect 64 'give some --leg' prove space.json --open
expect 64 'no walls of space' prove cornell.json --volume
expect 64 'outside of the cell' prove space.json --cell c --from 3,0,0 --volume
expect 0 '' schema
has '2020-12' out
expect 0 '' manual
has 'roughness' out
for format in pfm png jpg webp exr hdr; do
  "$rayfold" --version | grep -i "^$format.*not in" >/dev/null && continue
  "$rayfold" --version | grep -i '^openexr.*not in' >/dev/null && [ $format = exr ] && continue
  "$rayfold" --version | grep -i '^jpeg.*not in' >/dev/null && [ $format = jpg ] && continue
  expect 0 '' render cornell.json -o out.$format $small
  [ -s out.$format ] || failed "out.$format is not there"
  expect 0 '' convert out.$format back.pfm
  expect 0 '' convert out.pfm back.$format --exposure 1 --tone-curve linear
done
expect 0 '' render cornell.json -o two.png -otwo.pfm $small --bits=16 --no-effects
[ -s two.png ] && [ -s two.pfm ] || failed "two outputs"
expect 0 "" render -o set.png $small --max-depth 1 --integrator normal --set develop.exposure=1 \
  --set sky.color=#203040 --set sky.gain=0.5 -- cornell.json
# Frames: numbered files, a moment of its own for each, gone on with, and films.
cat >moves.json <<'END'
{ "rayfold": 1, "sky": { "kind": "constant", "color": 1 }, "timeline": { "fps": 10 }, "camera": {},
  "animation": [ { "path": "sky.gain", "keys": [ { "time": 0, "value": 0 }, { "time": 0.5, "value": 1 } ] } ] }
END
expect 0 '' render moves.json -o f_##.png -o g.png --frames all $small
same "$(echo f_*.png g_*.png)" "f_00.png f_01.png f_02.png f_03.png f_04.png g_0000.png g_0001.png g_0002.png g_0003.png g_0004.png" frames
expect 0 '' render moves.json -o at.png --at 0.3 $small
same "$(cmp at.png f_03.png 2>&1)" "" "--at and its frame"
expect 0 '' render moves.json -o s_#.pfm --frames 1:6:2 --fps 20 $small
same "$(echo s_*.pfm)" "s_1.pfm s_3.pfm s_5.pfm" "every second frame"
rm f_02.png && : >f_03.png && touch -d 2001-01-01 f_01.png
expect 0 '2 frames' render moves.json -o f_##.png --frames 0:5 --resume --size 24x16 --spp 2
same "$(find f_01.png -newermt 2002-01-01)" "" "a frame that was there"
[ -s f_02.png ] && [ -s f_03.png ] || failed "frames that were missing"
expect 64 'it is A:B' render moves.json -o f.png --frames 5:2
expect 64 'it is A:B' render moves.json -o f.png --frames 5
expect 64 'leave one' render moves.json -o f.png --frames 0:2 --at 1
expect 64 'one picture' render moves.json -o f.png --frames 0:2 --film f.rff
expect 64 'goes on' render moves.json -o f.png --resume
expect 64 'in one go' render moves.json -o f.mp4 --resume
expect 64 'nothing in it moves' render cornell.json -o f.png --frames all
rm -f f.mp4
program=$rayfold rayfold=$work/elsewhere
printf '#!/bin/sh\nPATH=/nowhere exec "%s" "$@"\n' "$program" >elsewhere && chmod +x elsewhere
expect 73 'install it' render moves.json -o f.mp4 $small
[ ! -e f.mp4 ] || failed "a film without ffmpeg"
printf '#!/bin/sh\necho boiled over >&2\nexit 3\n' >ffmpeg && chmod +x ffmpeg
printf '#!/bin/sh\nPATH=".:$PATH" exec "%s" "$@"\n' "$program" >elsewhere
expect 73 'boiled over' render moves.json -o f.mp4 $small
rm ffmpeg
rayfold=$program
if command -v ffmpeg >/dev/null 2>&1; then
  expect 0 '' render moves.json -o f.mp4 -o f.gif -o f.webm $small
  for film in f.mp4 f.gif f.webm; do
    same "$(ffprobe -v error -count_frames -select_streams v -show_entries stream=nb_read_frames -of csv=p=0 $film 2>&1)" 5 $film
  done
fi
same "$(ls | grep -c part)" 0 "leftovers of films"
# A picture is no way off itself; grey 1/4 against grey 1/2: (1/4)^2 / (1/4 + 1/100), and half as bright.
printf 'PF\n2 1\n-1.0\n' >half.pfm
printf 'PF\n2 1\n-1.0\n' >quarter.pfm
for i in 1 2 3 4 5 6; do printf '\000\000\000\077' >>half.pfm; printf '\000\000\200\076' >>quarter.pfm; done
expect 0 '' compare half.pfm half.pfm quarter.pfm -o off.png
has '^half.pfm: relMSE 0, RMSE 0, PSNR inf dB' out
has '^quarter.pfm: relMSE 0.2404, RMSE 0.25, PSNR 12.04 dB, mean 0.25000 0.25000 0.25000 (-50.00 %), worst block 50.00 %' out
[ -s off.png ] || failed "compare -o"
expect 65 'above 0.2' compare half.pfm quarter.pfm --most 0.2
expect 0 '' compare half.pfm quarter.pfm --most 0.25
expect 0 '' render cornell.json -o twice.pfm --size 48x32 --spp 2 --quiet
expect 0 '' compare out.pfm twice.pfm
expect 65 'multiple' compare twice.pfm out.pfm
expect 66 'missing' compare missing.pfm out.pfm
# A view is saved as it is, whatever the scene's develop says; what --set says of develop holds.
sed 's/"camera"/"develop": { "exposure": 2, "tone_curve": "agx", "gamma": 2 }, &/' cornell.json >bright.json
for view in normal depth albedo uv id bary cost; do
  expect 0 '' render bright.json -o view.png -o view.pfm $small --integrator $view
  expect 0 '' convert view.pfm as_is.png --tone-curve linear
  same "$(cmp view.png as_is.png 2>&1)" "" "the view $view and its values"
done
expect 0 '' render bright.json -o view.png $small --integrator normal --set develop.exposure=-1
expect 0 '' render bright.json -o view.pfm $small --set render.integrator=normal
expect 0 '' convert view.pfm darker.png --tone-curve linear --exposure -1
same "$(cmp view.png darker.png 2>&1)" "" "a view with an exposure"
expect 0 '' render bright.json -o view.png $small --integrator normal --set 'develop={"tone_curve": "filmic"}'
expect 0 '' convert view.pfm curved.png --tone-curve filmic
same "$(cmp view.png curved.png 2>&1)" "" "a view with a curve"
cmp -s darker.png curved.png && failed "the settings of a view change nothing"
# Denoising changes the picture and not its hash; without weights there is still a picture, and the way to them.
same "$(hash_of cornell.json --size 24x16 --spp 2)" "$(hash_of cornell.json --size 24x16 --spp 2 --denoise fast)" \
  "the hash of a denoised picture"
expect 0 '' render cornell.json -o noisy.png $small
expect 0 '' render cornell.json -o clean.png $small --denoise fast
cmp -s noisy.png clean.png && failed "--denoise fast changes nothing"
XDG_DATA_HOME=$PWD XDG_DATA_DIRS=$PWD expect 0 'note:.*tools/denoiser.sh' render cornell.json -o best.png --size 24x16 \
  --spp 2 --denoise best
same "$(cmp clean.png best.png 2>&1)" "" "best without weights"
expect 0 '' render cornell.json -o view.png $small --integrator normal
expect 0 '' render cornell.json -o view2.png $small --integrator normal --denoise fast
same "$(cmp view.png view2.png 2>&1)" "" "a view is not denoised"
expect 64 'off|fast|good|best' render cornell.json -o a.png --denoise smooth
expect 0 '' convert good.ply copy.obj
expect 0 '' convert copy.obj copy.stl
expect 0 '' convert copy.stl copy.json
expect 0 '' validate copy.json --quiet
expect 64 'rayfold render' convert good.ply a.png

# Saved models: the same picture, one message for each fault, and the cache.
tiny="--size 32x18 --spp 2"
for model in good.ply copy.stl cornell.json; do
  expect 0 '' convert $model saved.rfm
  expect 0 '' validate saved.rfm --quiet
  same "$(hash_of saved.rfm $tiny)" "$(hash_of $model $tiny)" "the hash of a saved $model"
done
expect 0 '' info saved.rfm
has '^objects' out
head -c 1000 saved.rfm >cut.rfm
expect 65 'cut.rfm: .*cut short: it has 1000 bytes of .*convert it again from the model' render cut.rfm -o a.png
{ cat saved.rfm; echo; } >long.rfm
expect 65 'damaged: there are bytes behind its end' validate long.rfm
{ head -c 500 saved.rfm; printf '\252'; tail -c +502 saved.rfm; } >flipped.rfm
expect 65 'damaged: the checksum' validate flipped.rfm
{ head -c 12 saved.rfm; printf '\007'; tail -c +14 saved.rfm; } >later.rfm
expect 65 'saved by another version of rayfold (its format is number 7' info later.rfm
cp cornell.json foreign.rfm
expect 65 'its content looks like a scene file; rename it to end in .json' render foreign.rfm -o a.png
expect 66 'missing.rfm' info missing.rfm
expect 73 'nowhere' convert good.ply nowhere/a.rfm
[ -e a.png ] && failed "a saved model that is wrong left a picture"
echo before >kept.rfm
(ulimit -f 1 && exec "$rayfold" convert cornell.json kept.rfm) >out 2>err
same $? 73 "exit code of a saved model on a full disk"
same "$(cat kept.rfm)" before "a saved model that was there, after a full disk"
same "$(ls | grep -c 'kept.rfm')" 1 "files left behind by a full disk"
hash=$(hash_of good.ply $tiny)
same "$(hash_of good.ply $tiny --cache)$(hash_of good.ply $tiny --cache)" "$hash$hash" "hashes with a cache"
expect 0 '' validate good.ply.rfm --quiet
rm good.ply.rfm
expect 64 'scene or model' convert whole.png a.obj

# A model without camera and light is put on a stage, each part of which is open to --set.
expect 0 '' render good.ply -o bare.png $small
tiny="--size 32x18 --spp 2"
staged=$(hash_of good.ply $tiny)
for change in objects.stage_floor=null lights.stage_key=null sky.gain=2 camera.fov=20 objects.good.rotate=[0,0,90] \
  render.transparent=true; do
  checks=$((checks + 1))
  [ "$(hash_of good.ply $tiny --set "$change")" != "$staged" ] || failed "--set $change changes nothing"
done
same "$(hash_of good.ply $tiny --set render.compact=true)" "$staged" "the hash with compact trees"
expect 0 '' convert good.ply staged.json
same "$(hash_of staged.json $tiny)" "$staged" "the hash of a model made into a scene"
has '"stage_key"' staged.json
expect 64 'no such thing' render good.ply -o a.png --set objects.stage_flor=null
expect 0 '' convert good.ply good.stl
expect 0 'z up' render good.stl -o bare.png --size 24x16 --spp 2
expect 0 'note\|progress\|spp' render cornell.json -o quiet.png --size 24x16 --spp 2
has '^quiet.png: 24x16, 2 spp, .* Mrays/s$' err
has '^progress [01]\.[0-9][0-9] eta [0-9]*$' err
expect 0 '' render cornell.json -o quiet.png $small
same "$(cat out err)" "" "what --quiet prints"
expect 0 '' render cornell.json -o hash $small
same "$(grep -c '^[0-9a-f]\{16\}$' out)$(wc -l <out | tr -d ' ')" 11 "what -o hash prints"
hash=$(cat out)
expect 0 '' render cornell.json -o quiet.png $small --stats stats.json
for key in version isa threads scene size samples seconds load prepare render write rays camera bounce shadow nodes prims \
  triangles memory geometry textures peak; do has "\"$key\":" stats.json; done
has "\"hash\": \"$hash\"" stats.json
command -v python3 >/dev/null && { python3 -m json.tool stats.json >out 2>err || failed "stats.json is not JSON"; }
same "$(ls | grep -c 'part$')" 0 "temporary files left"
expect 0 '' render cornell.json -o timed.png --size 24x16 --time 0.3
has ' [0-9]* spp, 0\.[3-9]' err
expect 0 'noise [0-9.]*%, 100% of the tiles at 50%' render cornell.json -o noisy.png --size 24x16 --noise 0.5 --stats stats.json
has '"tiles_done": 1.0000' stats.json

# --- trace: meshes and rays of the yardstick's formats, made by hand ---------------------------------
bytes() { for byte; do printf "\\$(printf %o "0x$byte")"; done; }
count() { printf '%02x 00 00 00 00 00 00 00' "$1"; }
mesh() { # count of vertices, of triangles, then vertices and triangles
  v=$1 t=$2
  shift 2
  printf RTBMESH1
  # shellcheck disable=SC2046,SC2086
  bytes $(count $v) $(count $t) $*
}
rays() { # query, count, name, then rays and results; for a mesh of two triangles
  q=$1 n=$2 name=$3
  shift 3
  printf RTBRAYS1
  # shellcheck disable=SC2046,SC2086
  bytes 0$q 00 00 00 00 00 00 00 $(count $n) $(count 2)
  printf %s "$name"
  head -c $((32 - ${#name})) /dev/zero
  # shellcheck disable=SC2046,SC2086
  bytes $*
}
zero="00 00 00 00" one="00 00 80 3f" minus="00 00 80 bf" five="00 00 a0 40" quarter="00 00 80 3e"
inf="00 00 80 7f" nan="00 00 c0 7f" miss="ff ff ff ff"
corners="$zero $zero $zero $one $zero $zero $zero $one $zero $one $one $zero"
two="$zero 01 00 00 00 02 00 00 00 01 00 00 00 03 00 00 00 02 00 00 00"
at="$quarter $quarter $one $zero $zero $zero $minus $inf" beside="$five $five $one $zero $zero $zero $minus $inf"
hit="$one $zero $quarter $quarter" none="$inf $miss $zero $zero"
mesh 4 2 $corners $two >two.rtm
rays 0 2 chords $at $beside $hit $none >two.rays
rays 1 2 shadow $at $beside $zero $zero $zero $zero $zero $miss $zero $zero >any.rays
quick="--repeat 1 --time 0"
expect 0 '' trace two.rtm two.rays any.rays $quick
has '^rays,rayfold,two.rtm,fast,chords,batch,1,2,[0-9.]*,[0-9.]*,50.0,0,0,0$' out
has '^rays,rayfold,two.rtm,fast,shadow,batch,1,2,[0-9.]*,[0-9.]*,50.0,0,0,0$' out
expect 0 '' trace two.rtm two.rays any.rays $quick --api single --api batch --threads 1 --threads 3 --label me
same "$(grep -c '^rays,me,' out)" 8 "lines of two files, two apis, two counts of threads"
same "$(cut -d, -f6,7 out | sort -u | tr '\n' ' ')" "batch,1 batch,3 single,1 single,3 " "apis and threads"
expect 0 '' trace two.rtm --build $quick
has '^build,rayfold,two.rtm,2,fast,1,[0-9.]*,[0-9.]*,[0-9.]*,[0-9.]*,[0-9.]*,[-0-9.]*,[0-9.]*$' out
same "$(wc -l <out | tr -d ' ')" 1 "lines of --build"
(export RTB_CPU=1 && exec "$rayfold" trace two.rtm two.rays $quick) >out 2>err
has '^rays,rayfold,two.rtm,fast,chords,batch,1,2,[0-9.]*,[0-9.]*,50.0,0,0,0$' out
for isa in ref v2 v3 v4; do
  for api in single batch; do
    "$rayfold" trace two.rtm two.rays -o hits.rays $quick --isa $isa --api $api >out 2>err
    [ $? -eq 64 ] && continue # not on this machine
    checks=$((checks + 1))
    cmp -s hits.rays two.rays || failed "--isa $isa --api $api writes other hits"
  done
done
expect 0 '' trace two.rtm two.rays $quick --compact --build
has '^build,rayfold,two.rtm,2,compact,' out
has '^rays,rayfold,two.rtm,compact,chords,.*,50.0,0,0,0$' out
# Each kind of difference from the stored results is counted as what it is.
rays 0 1 flip $at $none >flip.rays
rays 0 1 far $at $five $zero $quarter $quarter >far.rays
rays 0 1 other $at $one 01 00 00 00 $quarter $quarter >other.rays
expect 0 '' trace two.rtm flip.rays far.rays other.rays $quick
same "$(cut -d, -f5,11- out | tr '\n' ' ')" "flip,100.0,1,0,0 far,100.0,0,1,0 other,100.0,0,0,1 " "differences"
rays 0 1 chords $nan $quarter $one $zero $zero $zero $minus $inf $none >odd.rays # a ray that is none hits nothing
expect 0 '' trace two.rtm odd.rays $quick
has ',0.0,0,0,0$' out
mesh 3 1 $zero $zero $zero $one $zero $zero $zero $one $zero $zero 01 00 00 00 02 00 00 00 >one.rtm
expect 0 '^note: two.rays was made for a mesh of 2 triangles, not 1$' trace one.rtm two.rays $quick
expect 64 'needs RAYS, or --build' trace two.rtm
expect 64 'needs MESH' trace
expect 64 'one RAYS' trace two.rtm two.rays any.rays -o hits.rays
expect 64 'one of single' trace two.rtm two.rays --api triple
expect 64 'threads' trace two.rtm two.rays --threads 0
expect 64 'commas' trace two.rtm two.rays --label a,b
expect 66 'gone.rtm' trace gone.rtm two.rays
expect 66 'not a file' trace . two.rays
expect 66 'gone.rays' trace two.rtm gone.rays
expect 73 'nowhere' trace two.rtm two.rays -o nowhere/hits.rays
echo before >kept.rays
(ulimit -f 0 && exec "$rayfold" trace two.rtm two.rays -o kept.rays $quick) >/dev/null 2>&1
same $? 73 "exit code on a full disk"
same "$(cat kept.rays)" before "hits that were there, after a full disk"
bad_mesh() { expect 65 "bad.rtm: .*$1" trace bad.rtm two.rays; }
bad_rays() { expect 65 "bad.rays: .*$1" trace two.rtm bad.rays $quick; }
printf 'RTBMESH2 and more that is none' >bad.rtm
bad_mesh 'does not begin with "RTBMESH1"'
printf '' >bad.rtm
bad_mesh 'does not begin'
printf RTBMESH1 >bad.rtm
bad_mesh 'ends within'
head -c 90 two.rtm >bad.rtm
bad_mesh '4 vertices and 2 triangles do not make a file of 90 bytes'
{ cat two.rtm; echo; } >bad.rtm
bad_mesh 'do not make a file'
mesh 4 2 $corners $zero 01 00 00 00 02 00 00 00 01 00 00 00 03 00 00 00 04 00 00 00 >bad.rtm
bad_mesh 'triangle 1 names vertex 4, but there are only 4'
mesh 4 2 $zero $zero $inf $one $zero $zero $zero $one $zero $one $one $zero $two >bad.rtm
bad_mesh 'vertex 0 is not finite'
mesh 4 0 $corners >bad.rtm
bad_mesh 'no triangles'
for huge in 'ff ff ff ff ff ff ff ff ff ff ff ff ff ff ff 7f' '01 00 00 00 00 00 00 40 fe ff ff ff 00 00 00 00' \
  '56 55 55 55 55 55 55 15 aa aa aa aa aa aa aa 0a'; do
  { printf RTBMESH1 && bytes $huge; } >bad.rtm # counts whose sizes do not fit a machine word
  bad_mesh ''
done
printf RTBMESH1 >bad.rays
bad_rays 'does not begin with "RTBRAYS1"'
head -c 60 two.rays >bad.rays
bad_rays 'ends within'
head -c 150 two.rays >bad.rays
bad_rays '2 rays do not make a file of 150 bytes'
rays 2 2 chords $at $beside $hit $none >bad.rays
bad_rays 'query 2'
rays 0 0 chords >bad.rays
bad_rays 'no rays'
rays 0 2 a,b $at $beside $hit $none >bad.rays
bad_rays 'name'
rays 0 2 '' $at $beside $hit $none >bad.rays
bad_rays 'no name'
rays 0 1 chords $at $one 02 00 00 00 $quarter $quarter >bad.rays
bad_rays 'ray 0 names triangle 2, but there are only 2'
{ printf RTBRAYS1 && bytes 00 00 00 00 00 00 00 00 ff ff ff ff ff ff ff 0f && head -c 40 /dev/zero; } >bad.rays
bad_rays 'do not make a file'

# --- bench tree: all rungs of the ladder must find the same hits ------------------------------------
expect 64 'there is no bench "bush"' bench bush
expect 64 'needs tree' bench
expect 64 'needs RAYS' bench tree two.rtm
expect 64 'size' bench tree --size 4
if "$rayfold" bench tree two.rtm two.rays --time 0 --quiet 2>&1 | grep -q AVX2; then
  echo "bench tree: not on this processor"
else
  expect 0 '' bench tree two.rtm two.rays --time 0
  same "$(grep -c '^ *[0-9][0-9]* .* | ' out)" 11 "rungs"
  has 'All rungs find the same hits: 20 of 20' out # 2 rays, each by 10 rungs after the first
  expect 0 '' bench tree one.rtm two.rays --time 0 --quiet
  expect 0 '' bench tree --size 32 --time 0 -o tree.svg
  has 'furnished hall, 106344 triangles' out
  has '^list of triangles  *#' out
  has '^All rungs find the same hits' out
  same "$(grep -c '<rect' tree.svg)" 25 "bars of 11 rungs on two sets, two keys and the paper"
  command -v python3 >/dev/null &&
    { python3 -c 'import xml.dom.minidom; xml.dom.minidom.parse("tree.svg")' 2>err || failed "tree.svg is not XML"; }
  expect 65 'any.rays: asks for any hit' bench tree two.rtm any.rays
  expect 65 'bad.rays' bench tree two.rtm bad.rays
  expect 66 'gone.rtm' bench tree gone.rtm two.rays
  expect 73 'nowhere' bench tree -o nowhere/tree.svg
fi

# --- the ratios of bench/embree.sh: medians of the rounds, our best interface to the other's best -------
lines() { # our flips
  for round in 1 9 2; do
    echo "rays,rayfold,a.rtm,fast,primary,batch,1,100000,0,${round}0,50.0,$1,0,0"
    echo "rays,rayfold,a.rtm,fast,primary,single,1,100000,0,6,50.0,0,0,0"
    echo "rays,embree,a.rtm,medium,primary,single,1,100000,0,4,50.0,0,0,0"
    echo "rays,embree,a.rtm,medium,primary,stream,1,100000,0,8,50.0,0,0,0"
    echo "build,rayfold,a.rtm,1000,fast,1,0,0,0,$round,64.0,-,0"
  done
}
lines 1 | awk -F, -v sets=primary -f "$top/bench/ratios.awk" >out 2>err || failed "ratios.awk fails"
has '^a  *primary  *20.00 batch  *8.00 stream  *2.50  *6.00  *4.00  *1.50$' out
has '^a  *1000 ours fast  *2.00  *64.0  *-$' out
has '^a  *primary  *100000  *1  *0  *0   *0  *0  *0$' out
checks=$((checks + 1))
lines 11 | awk -F, -v sets=primary -f "$top/bench/ratios.awk" >out 2>err && failed "ratios.awk takes 11 flips in 100,000"
has '^a  *primary  *100000  *11  *0  *0!' out

# --- the picture is a function of the scene and settings only --------------------------------------
base="cornell.json --size 40x30 --seed 7"
hash=$(hash_of $base --spp 16)
for threads in 1 2 3 5 8; do same "$(hash_of $base --spp 16 --threads $threads)" "$hash" "hash with $threads threads"; done
for isa in ref v2 v3 v4; do
  "$rayfold" render $base --spp 1 --isa $isa -o hash --quiet >out 2>err
  [ $? -eq 64 ] && continue # not on this machine
  same "$(hash_of $base --spp 16 --isa $isa)" "$hash" "hash with --isa $isa"
done
same "$(hash_of $base --samples 0:8 --samples 8:16)" "$hash" "hash of merged halves"
same "$(hash_of $base --samples 11:16 --samples 0:3 --samples 3:11)" "$hash" "hash of merged thirds in disorder"
same "$(hash_of $base --spp 16 --aov all)" "$hash" "hash of the picture with all planes beside it"
same "$(hash_of $base --spp 16 --aov none)" "$hash" "hash of the picture alone"
other=$(hash_of cornell.json --size 40x30 --seed 8 --spp 16)
checks=$((checks + 1))
[ "$other" != "$hash" ] || failed "another seed gives the same picture"
checks=$((checks + 1))
[ "$(hash_of $base --samples 0:8)" != "$(hash_of $base --samples 8:16)" ] || failed "both halves are the same"

# --- films that are kept, gone on with, and merged --------------------------------------------------
expect 0 '^first.rff: 40x30, 5 spp' render $base --spp 5 --film first.rff
expect 0 'going on from 5 samples a pixel in first.rff' render $base --spp 16 --film first.rff -o hash
same "$(cat out)" "$hash" "hash of a render that went on"
has '11 spp' err
expect 0 '' render $base --spp 16 --film first.rff -o hash --quiet
same "$(cat out)" "$hash" "hash of a film that has all its samples"
expect 0 '' render $base --spp 16 --samples 9:16 --samples 2:4 --film part.rff --quiet
expect 0 '' render $base --spp 16 --film part.rff -o hash --quiet
same "$(cat out)" "$hash" "hash of a film whose gaps were filled"
expect 0 '' render $base --spp 16 --samples 0:7 --film a.rff --quiet
expect 0 '' render $base --spp 16 --samples 7:16 --film b.rff --quiet
expect 0 ': 16 spp of 2 films' merge b.rff a.rff -o hash --film both.rff -o merged.png
same "$(cat out)" "$hash" "hash of merged films"
expect 0 '' render $base --spp 16 -o whole.png --quiet
cmp merged.png whole.png || failed "a merged film is developed otherwise than a rendered one"
expect 0 '' merge both.rff -o hash --quiet
same "$(cat out)" "$hash" "hash of a film that merge wrote"
expect 0 '' render $base --spp 16 --tiles 1:3/3 --film lower.rff --quiet
expect 0 '' render $base --spp 16 --tiles 0:1/3 --film upper.rff --quiet
expect 0 ': 16 spp of 2 films' merge lower.rff upper.rff -o hash
same "$(cat out)" "$hash" "hash of films of parts of the picture"
expect 65 'lower.rff: samples 0 to 16 are in the film already (at pixel ' merge upper.rff lower.rff lower.rff -o hash
expect 0 '' render $base --spp 16 --film upper.rff -o hash --quiet
same "$(cat out)" "$hash" "hash of a film of a part that was gone on with"
expect 64 '--tiles 2:1/3: it is A:B/N' render $base --tiles 2:1/3 --film x.rff
expect 64 'leave out --tiles' render $base --tiles 0:1/3 --noise 0.1 --film x.rff
expect 65 'b.rff: samples 7 to 16 are in the film already' merge a.rff b.rff b.rff -o hash
expect 0 '' render $base --set materials.red.albedo='[0.1,0.1,0.1]' --spp 2 --film other.rff --quiet
expect 65 'a.rff and other.rff are of different pictures' merge a.rff other.rff -o hash
expect 64 'other.rff: it holds another picture, of cornell.json' render $base --spp 2 --film other.rff
expect 64 'begun without all the AOVs' render $base --spp 20 --film both.rff --aov depth -o layers.exr
expect 65 'is not a film' merge cornell.json -o hash
cp a.rff broken.rff
printf 'x' | dd of=broken.rff bs=1 seek=500 conv=notrunc 2>err
expect 65 'broken.rff is damaged' merge broken.rff -o hash
cp a.rff broken.rff~
expect 0 'broken.rff is damaged; taking broken.rff~' merge broken.rff -o hash
command -v flock >/dev/null && {
  flock locked.rff.lock "$rayfold" render $base --spp 2 --film locked.rff >out 2>err
  same $? 73 "a film that another render has"
  has 'another render is at work on it' err
}
# A scene whose mesh was changed is another picture, though its own text is the same.
printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n' >changing.obj
expect 0 '' render changing.obj --size 16x16 --spp 1 --film mesh.rff --quiet
expect 0 'going on from 1' render changing.obj --size 16x16 --spp 2 --film mesh.rff
printf 'v 0 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n' >changing.obj
expect 64 'mesh.rff: it holds another picture' render changing.obj --size 16x16 --spp 3 --film mesh.rff

# --- Ctrl-C ----------------------------------------------------------------------------------------
stop() { # signal, second signal or "", size; the exit code is in rc, what was said in err
  rm -f stopped.pfm
  "$rayfold" render cornell.json -o stopped.pfm --size "$3" --spp 524288 >out 2>err &
  pid=$!
  i=0
  until grep -q progress err || [ $i -ge 300 ]; do
    sleep 0.1
    i=$((i + 1))
  done
  kill -"$1" $pid
  [ -z "$2" ] || { sleep 0.2; kill -"$2" $pid; }
  wait $pid
  rc=$?
}
for signal in INT TERM; do
  stop $signal "" 32x32
  same $rc 75 "exit code after SIG$signal"
  has 'saved these.*run the same command again' err
  [ -s stopped.pfm ] || failed "SIG$signal saved nothing"
  same "$(head -c 2 stopped.pfm)" PF "the picture saved at SIG$signal"
done
stop INT INT 3000x3000
same $rc 75 "exit code after the second SIGINT"
has 'nothing was saved' err
same "$(ls | grep -c stopped)" 0 "files after the second SIGINT"

# --- on a terminal ---------------------------------------------------------------------------------
# A bare container may have no pseudo-terminals to give.
if command -v script >/dev/null && script -qec true /dev/null </dev/null >/dev/null 2>&1; then
  SHELL=/bin/sh script -qec "stty cols 60; TERM=xterm NO_COLOR=1 LC_ALL=C '$rayfold' render cornell.json -o t.png --size 64x64 --time 1" \
    /dev/null </dev/null >out 2>err
  has 'spp' out
  tr '\r' '\n' <out | sed 's/.\[K//g' | awk 'length($0) > 60 && !/^t.png/ { exit 1 }' || failed "a progress line is too wide"
  checks=$((checks + 1))
  grep -q "$(printf '\033')\\[36m" out && failed "colour in spite of NO_COLOR"
fi

echo "$checks checks, $failures failed"
[ $failures -eq 0 ]
