#!/bin/sh
# Parallax Locks from outside: every chamber can be solved, by the solver's search and in the window by its replay; what is
# solved is kept, and the game goes on behind it; every kind of bad chamber is refused with file and line.
# Usage: locks.sh PATH/TO/rayfold
set -u
rayfold=$(cd "$(dirname "$1")" && pwd)/$(basename "$1")
[ -x "$rayfold" ] || { echo "usage: locks.sh PATH/TO/rayfold"; exit 1; }
top=$(cd "$(dirname "$0")/.." && pwd)
locks=$top/scenes/locks
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
checks=0
failures=0
failed() {
  failures=$((failures + 1))
  echo "FAIL: $*"
  head -4 err
}
# expect CODE PATTERN ARGUMENT...: exit code, and what stderr holds.
expect() {
  code=$1 pattern=$2
  shift 2
  "$rayfold" "$@" >out 2>err </dev/null
  got=$?
  checks=$((checks + 1))
  [ $got -eq "$code" ] || failed "rayfold $*: exit code $got, wanted $code"
  [ -z "$pattern" ] || grep -q -e "$pattern" err || failed "rayfold $*: stderr lacks \"$pattern\""
}
play() { # CODE PATTERN SCENE SCRIPT
  expect "$1" "$2" view "$3" --game --script "$4" --progress kept/here --dummy --size 48x27 --step 8 --integrator albedo --no-denoise --spp 1 --threads 1
}

# --- every chamber can be solved, and none is where it begins -----------------------------------------
expect 0 '' locks "$locks"/*.locks
for c in "$locks"/*.locks; do
  checks=$((checks + 1))
  grep -q "$c: .*: solved in [1-9]" out || failed "$c is not solved"
done
# --- the game: begun at the first, kept, gone on with -------------------------------------------------
for c in "$locks"/*.locks; do # the folder: each time it is the turn of the next
  play 0 '' "$locks" "${c%.locks}.replay"
done
checks=$((checks + 1))
[ "$(cat kept/here)" = "$(basename -a -s .locks "$locks"/*.locks)" ] || failed "what was solved was not kept: $(cat kept/here)"
(cat "$locks/02_the_other_hand.replay" && printf 'frame 160\nexpect open 0\nexpect eye 0 1.65 1.2 0.001\n') >next.replay # the next comes by itself
play 0 '' "$locks/02_the_other_hand.locks" next.replay
# --- bad chambers -------------------------------------------------------------------------------------
cp "$locks/03_a_quarter.json" a.json
begin='start 0 1.65 1.2 0 room
exit 1 1 1 0.4 room'
bad() { # PATTERN LINE: as the third line of a chamber
  printf '%s\n%s\n' "$begin" "$2" >a.locks
  expect 65 "a.locks:[34]: .*$1" locks a.locks
}
bad 'none of title' 'key 1'
bad 'a number from -10000' 'lock light cell x 0 0 0 0 1 1 room'
bad 'no length' 'lock light cell 0 0 0 0 0 0 1 room'
bad 'a lock is one of' 'lock sound'
bad 'the largest' 'lock size 0.5 0.2'
bad 'there is no lamp' 'lock light cell 0 0 0 0 0 1 1 room'
bad 'there is no arrow' 'lock turn 10 20'
bad 'there is no spot "b"' 'way b c 1 0 0'
bad 'a lock at least' 'hint nothing is locked'
printf '%s\nlock size 0.2 0.3\nspot start 0 1 1 room\nspot s 9 9 9 hall\n' "$begin" >a.locks
expect 65 'a.locks:5: .*no cell "hall"' locks a.locks
printf '%s\nlock size 0.2 0.3\n' "$begin" >a.locks
expect 65 'a spot "start"' locks a.locks
printf '%s\nlock size 0.2 0.3\nspot start 0 1.65 1.2 room\n' "$begin" >a.locks
expect 65 'cannot be reached' locks a.locks
printf 'start 0 1.65 1.2 0 room\nexit 0 1.65 1.2 0.4 room\nlock size 1 1\nspot start 0 1.65 1.2 room\n' >a.locks
expect 65 'solved where it begins' locks a.locks
expect 66 'no-such' locks no-such.locks
expect 66 'no chambers in it' view --game "$top/docs" --dummy --script "$locks/03_a_quarter.replay"

echo "$checks checks, $failures failed"
[ $failures -eq 0 ]
