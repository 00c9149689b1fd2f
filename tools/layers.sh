#!/bin/sh
# Checks the direction of includes: a room may include its own files and rooms with a lower number; the program,
# examples and benchmarks include only rayfold.h of ours; each outside library is included by exactly one file.
# Prints what is wrong, one line each; exit 1 if anything is.
cd "$(dirname "$0")/.." || exit 1

find src app examples bench intro -name '*.[ch]' 2>/dev/null | sort | xargs awk '
  BEGIN {
    split("base 0 image 1 scene 2 geom 2 space 2 shade 2 post 2 accel 3 world 4 render 5 api 6", r, " ")
    for (i = 1; i in r; i += 2) level[r[i]] = r[i + 1]
  }
  FNR == 1 {
    split(FILENAME, part, "/")
    room = part[1] == "src" ? part[2] : part[1]
    if (part[1] == "src" && !(room in level)) wrong("is in a room nobody numbered")
  }
  function wrong(what) { print FILENAME ":" FNR ": " what; bad = 1 }
  /^[ \t]*#[ \t]*include[ \t]*"/ {
    split($0, quoted, "\"")
    name = quoted[2]
    split(name, inc, "/")
    if (part[1] != "src") {
      if (name ~ /^rayfold\// || index(name, "/") == 0) next
      wrong("includes " name "; outside src only rayfold/rayfold.h is allowed")
    } else if (name ~ /^rayfold\//) {
      if (room != "api") wrong("includes " name "; only api may")
    } else if (index(name, "/") == 0) {
      next # a generated table beside its user
    } else if (!(inc[1] in level)) {
      wrong("includes " name ", which is in no room")
    } else if (inc[1] != room && level[inc[1]] >= level[room]) {
      wrong("includes " name ": " room " (" level[room] ") may not see " inc[1] " (" level[inc[1]] ")")
    }
  }
  /^[ \t]*#[ \t]*include[ \t]*<(png|turbojpeg|jpeglib|webp|openexr|OpenEXR|jansson|stb|meshoptimizer|zstd|civetweb|SDL|embree)/ {
    split($0, angled, /[<>]/)
    library = angled[2]
    if (library !~ /^stb/) sub(/[\/.].*/, "", library) # each header of stb is a library of its own
    if (library in owner && owner[library] != FILENAME) wrong("includes <" angled[2] ">, which is " owner[library] "\047s to know")
    owner[library] = FILENAME
    if (FILENAME ~ /\.h$/) wrong("includes <" angled[2] "> in a header; one .c file knows a library")
  }
  END { exit bad }
'
