#!/bin/sh
# A scene of N balls, boxes and tori melted together on a floor, to measure distance fields with: tools/melted.sh 200 > m.json
# They fill a room that grows with their number, so that each has as many neighbours whatever N is.
awk -v n="${1:-200}" 'BEGIN {
  srand(1); side = exp(log(n / 200) / 3);
  printf "{ \"rayfold\": 1,\n  \"render\": { \"integrator\": \"whitted\", \"size\": [1280, 720], \"spp\": 1, \"max_depth\": 1 },\n"
  printf "  \"camera\": { \"position\": [%g, %g, %g], \"target\": [0, 0, 0], \"fov\": 40 },\n", 3 * side, 2.6 * side, 5.5 * side
  printf "  \"sky\": { \"kind\": \"constant\", \"color\": [0.5, 0.6, 0.8] }, \"whitted\": { \"ambient\": 0.2 },\n"
  printf "  \"materials\": { \"a\": { \"kind\": \"lambert\", \"albedo\": [0.8, 0.35, 0.2] }, \"floor\": { \"kind\": \"lambert\" } },\n"
  printf "  \"lights\": [ { \"kind\": \"sun\", \"direction\": [0.6, 1, 0.4], \"angle\": 0 } ],\n  \"objects\": [\n"
  printf "    { \"name\": \"floor\", \"material\": \"floor\", \"translate\": [0, %g, 0], \"rotate\": [-90, 0, 0], \"shape\": { \"kind\": \"plane\" } },\n", -1.6 * side
  printf "    { \"name\": \"all\", \"material\": \"a\", \"shape\": { \"kind\": \"field\", \"smooth\": 0.12 } }"
  for (i = 0; i < n; i++) {
    printf ",\n    { \"part_of\": \"all\", \"translate\": [%.3f, %.3f, %.3f], ", side * (4 * rand() - 2), side * (3 * rand() - 1.5), side * (4 * rand() - 2)
    if (i % 3 == 0) printf "\"shape\": { \"kind\": \"sphere\", \"radius\": %.3f } }", 0.08 + 0.14 * rand()
    if (i % 3 == 1) printf "\"shape\": { \"kind\": \"box\", \"size\": [%.3f, %.3f, %.3f] } }", 0.1 + 0.3 * rand(), 0.1 + 0.3 * rand(), 0.1 + 0.3 * rand()
    if (i % 3 == 2) printf "\"rotate\": [%d, %d, 0], \"shape\": { \"kind\": \"torus\", \"radius\": %.3f, \"tube_radius\": 0.05 } }", 180 * rand(), 180 * rand(), 0.1 + 0.1 * rand()
  }
  printf "\n  ] }\n" }'
