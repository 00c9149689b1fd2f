# The tables of bench/embree.sh from the lines of both programs: medians over the rounds, the ratio of our best
# interface to Embree's best and of single rays to single rays, and how hits differ from the robust reference.
# Exit 1 when they differ in more than one ray in 10,000: then something is wrong, not merely rounded.

function median(list,    v, n, i, k, t) {
  n = split(list, v, " ")
  for (i = 2; i <= n; i++) {
    t = v[i] + 0
    for (k = i - 1; k >= 1 && v[k] + 0 > t; k--) v[k + 1] = v[k]
    v[k + 1] = t
  }
  return n ? (v[int((n + 1) / 2)] + v[int(n / 2) + 1]) / 2 : 0
}

function scene_of(file) { sub(/\.rtm$/, "", file); return file }

function note_scene(name) {
  if (name in known) return
  known[name] = 1
  scene[++scenes] = name
}

function note_threads(n) {
  if (n in counted) return
  counted[n] = 1
  thread[++threads] = n
}

$1 == "rays" {
  s = scene_of($3)
  note_scene(s)
  note_threads($7)
  who = $2 == "rayfold" ? "ours" : $2 == "robust" ? "robust" : "theirs"
  if ($4 == "best" || $4 == "high") who = who " " $4
  rate[who, s, $5, $6, $7] = rate[who, s, $5, $6, $7] " " $10
  if (!($6 in seen)) {
    seen[$6] = 1
    api[++apis] = $6
  }
  if (who == "ours best") who = "ours"
  if ($12 > flips[who, s, $5]) flips[who, s, $5] = $12
  if ($13 > far[who, s, $5]) far[who, s, $5] = $13
  if ($14 > other[who, s, $5]) other[who, s, $5] = $14
  count[s, $5] = $8
}

$1 == "build" {
  s = scene_of($3)
  note_scene(s)
  note_threads($6)
  triangles[s] = $4
  key = $2 SUBSEP s SUBSEP $5 SUBSEP $6
  speed[key] = speed[key] " " $10
  kept[$2, s, $5] = $11
  peak[$2, s, $5] = $12
}

function rate_of(who, s, set, name, n) { return median(rate[who, s, set, name, n]) }

# The fastest interface: its rate is returned, its name left in best_name.
function best_of(who, s, set, n,    i, r, most) {
  most = 0
  best_name = "-"
  for (i = 1; i <= apis; i++) {
    r = rate_of(who, s, set, api[i], n)
    if (r <= most) continue
    most = r
    best_name = api[i]
  }
  return most
}

function ratio(a, b) { return b > 0 && a > 0 ? sprintf("%.2f", a / b) : "-" }

function rays_table(n,    i, k, s, o, t, on, tn, product, terms) {
  printf "\nRays, threads: %d. Mrays/s, median of the rounds.\n\n", n
  printf "%-11s %-8s %14s %16s %6s %14s %6s\n", "scene", "rays", "ours, best", "Embree, best", "ratio", "single", "ratio"
  for (i = 1; i <= scenes; i++)
    for (k = 1; k <= set_count; k++) {
      s = scene[i]
      o = best_of("ours", s, set[k], n)
      on = best_name
      t = best_of("theirs", s, set[k], n)
      tn = best_name
      if (!o || !t) continue
      os = rate_of("ours", s, set[k], "single", n)
      ts = rate_of("theirs", s, set[k], "single", n)
      printf "%-11s %-8s %7.2f %-6s %7.2f %-8s %6s %6.2f %7.2f %6s\n", s, set[k], o, on, t, tn, ratio(o, t), os, ts, ratio(os, ts)
      sum[set[k]] += log(o / t)
      single_sum[set[k]] += log(os / ts)
      terms[set[k]]++
    }
  printf "\n"
  for (k = 1; k <= set_count; k++)
    if (terms[set[k]])
      printf "%-11s %-8s %37s %6.2f %14s %6.2f\n", k == 1 ? "mean ratio" : "", set[k], "", exp(sum[set[k]] / terms[set[k]]), "", exp(single_sum[set[k]] / terms[set[k]])
  for (k = 1; k <= set_count; k++) sum[set[k]] = single_sum[set[k]] = 0
}

# Single rays against Embree's robust mode, which keeps our promise of no holes; and the trees built with more care.
function more_table(    i, k, s, r, o, t, on, tn) {
  printf "\nMore, 1 thread. Robust: single rays of Embree's robust mode, and ours to it. Best, high: the trees built with\n"
  printf "most care, by the best interfaces; and what ours gains over its fast tree.\n\n"
  printf "%-11s %-8s %8s %6s %14s %16s %6s %8s\n", "scene", "rays", "robust", "ratio", "ours, best", "Embree, high", "ratio", "over fast"
  for (i = 1; i <= scenes; i++)
    for (k = 1; k <= set_count; k++) {
      s = scene[i]
      r = rate_of("robust", s, set[k], "single", 1)
      o = best_of("ours best", s, set[k], 1)
      on = best_name
      t = best_of("theirs high", s, set[k], 1)
      tn = best_name
      if (!r && !o) continue
      printf "%-11s %-8s %8.2f %6s %7.2f %-6s %7.2f %-8s %6s %8s\n", s, set[k], r, ratio(rate_of("ours", s, set[k], "single", 1), r), o, on, t, tn, ratio(o, t), ratio(o, best_of("ours", s, set[k], 1))
    }
}

function build_row(s, who, label, quality,    j, line) {
  line = sprintf("%-11s %10d %-15s", s, triangles[s], label)
  any = 0
  for (j = 1; j <= threads; j++) {
    r = median(speed[who, s, quality, thread[j]])
    any += r > 0
    line = line sprintf(" %9s", r > 0 ? sprintf("%.2f", r) : "-")
  }
  if (any) printf "%s %10.1f %10s\n", line, kept[who, s, quality], peak[who, s, quality]
}

function build_table(    i, j, q) {
  printf "\nBuilding: Mtri/s for each count of threads (median), bytes a triangle kept and at the peak.\n\n"
  printf "%-11s %10s %-15s", "scene", "triangles", "tree"
  for (j = 1; j <= threads; j++) printf " %9s", thread[j] " thr."
  printf " %10s %10s\n", "kept", "peak"
  for (i = 1; i <= scenes; i++) {
    build_row(scene[i], "embree", "Embree low", "low")
    build_row(scene[i], "embree", "Embree medium", "medium")
    build_row(scene[i], "embree", "Embree high", "high")
    build_row(scene[i], "rayfold", "ours fast", "fast")
    build_row(scene[i], "rayfold", "ours best", "best")
    build_row(scene[i], "rayfold", "ours compact", "compact")
  }
}

function check_table(    i, k, s, w, bad, limit, mark) {
  printf "\nHits against Embree's robust mode: flips, far, other; the worst of all runs. More than one flip or far in\n"
  printf "100,000 rays is marked.\n\n%-11s %-8s %9s %24s %24s\n", "scene", "rays", "count", "ours", "Embree, fast mode"
  for (i = 1; i <= scenes; i++)
    for (k = 1; k <= set_count; k++) {
      s = scene[i]
      if (!count[s, set[k]]) continue
      limit = count[s, set[k]] / 100000
      if (limit < 1) limit = 1
      mark = flips["ours", s, set[k]] > limit || far["ours", s, set[k]] > limit
      bad += flips["ours", s, set[k]] > 10 * limit || far["ours", s, set[k]] > 10 * limit
      printf "%-11s %-8s %9d %7d %7d %7d%s %7d %7d %7d\n", s, set[k], count[s, set[k]], flips["ours", s, set[k]], far["ours", s, set[k]], other["ours", s, set[k]], mark ? "!" : " ", flips["theirs", s, set[k]], far["theirs", s, set[k]], other["theirs", s, set[k]]
    }
  return bad
}

END {
  set_count = split(sets, set, " ")
  if (!scenes) {
    print "nothing was measured yet"
    exit 1
  }
  for (j = 1; j <= threads; j++) rays_table(thread[j])
  more_table()
  build_table()
  exit check_table() > 0
}
