#!/bin/sh
# Fuzzes the readers with clang's libFuzzer under ASan and UBSan. Usage: fuzz.sh [SECONDS [FORMAT]...], 60 seconds each
# of all formats without arguments. Inputs that find something are left in build-fuzz/FORMAT-*; mend the cause and move
# the file to tests/data/fuzz/FORMAT/, from where test_corpus replays it.
set -u
cd "$(dirname "$0")/.." || exit 1
seconds=${1:-60}
[ $# -gt 0 ] && shift
[ $# -gt 0 ] || set -- obj mtl gltf glb ply stl vox json rfm png jpg hdr exr webp pfm ies

cmake -S . -B build-fuzz -G Ninja -DCMAKE_C_COMPILER=clang -DCMAKE_BUILD_TYPE=Debug -DCMAKE_C_FLAGS_DEBUG="-O1 -g" \
  -DRAYFOLD_SANITIZE=fuzzer-no-link,address,undefined -DRAYFOLD_TESTS=OFF -DRAYFOLD_FUZZ=ON >/dev/null &&
  cmake --build build-fuzz --target fuzz >build-fuzz/log 2>&1 || { tail -30 build-fuzz/log; exit 1; }
cd build-fuzz || exit 1
bad=0
for format; do
  mkdir -p "corpus/$format"
  # Seeds: what the tests and scenes have of this format, if small.
  find ../tests/data ../scenes -name "*.$format" -size -64k -exec cp -n {} "corpus/$format/" \;
  # An input of saved models is made whole first (tests/seal.h), or its checksums would end every run at once.
  [ -d "../tests/data/fuzz/$format" ] && cp -n "../tests/data/fuzz/$format"/* "corpus/$format/"
  RAYFOLD_FUZZ=$format ./fuzz -max_total_time="$seconds" -timeout=5 -rss_limit_mb=1500 -max_len=65536 -print_final_stats=1 \
    -artifact_prefix="$format-" "corpus/$format" >"$format.log" 2>&1 || { bad=1; tail -60 "$format.log" | grep -E 'SUMMARY|runtime error|Test unit'; }
  echo "$format: $(grep -c . "$format.log") lines, $(sed -n 's/^stat::number_of_executed_units: */runs /p' "$format.log")," \
    "$(find "corpus/$format" -type f | wc -l) inputs kept"
done
exit $bad
