// See cpu.h.

#include "base/cpu.h"

#include <sched.h>
#include <stdio.h>

const char *const isa_names[ISA_COUNT] = {"ref", "v2", "v3", "v4"};

IsaLevel cpu_best_isa(void)
{
#if defined(__x86_64__)
  __builtin_cpu_init();
  const int v2 = __builtin_cpu_supports("sse4.2") && __builtin_cpu_supports("popcnt");
  const int v3 = v2 && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
                 __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
  const int v4 = v3 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                 __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
                 __builtin_cpu_supports("avx512vl");
  return v4 ? ISA_V4 : v3 ? ISA_V3 : v2 ? ISA_V2 : ISA_REF;
#else
  return ISA_REF;
#endif
}

// The quota of cgroup v2, else v1, rounded up; 0 when there is none.
static int cgroup_quota(void)
{
  long long quota = -1, period = 0;
  FILE *f = fopen("/sys/fs/cgroup/cpu.max", "r");
  if (f) {
    if (fscanf(f, "%lld %lld", &quota, &period) != 2) quota = -1; // "max 100000" means no limit
    fclose(f);
  } else {
    FILE *q = fopen("/sys/fs/cgroup/cpu/cpu.cfs_quota_us", "r");
    FILE *p = fopen("/sys/fs/cgroup/cpu/cpu.cfs_period_us", "r");
    if (!q || fscanf(q, "%lld", &quota) != 1) quota = -1;
    if (!p || fscanf(p, "%lld", &period) != 1) period = 0;
    if (q) fclose(q);
    if (p) fclose(p);
  }
  return quota > 0 && period > 0 ? (int)((quota + period - 1) / period) : 0;
}

int cpu_thread_count(void)
{
  cpu_set_t set;
  CPU_ZERO(&set);
  int n = sched_getaffinity(0, sizeof set, &set) ? 1 : CPU_COUNT(&set);
  const int quota = cgroup_quota();
  if (quota && quota < n) n = quota;
  return n > 0 ? n : 1;
}
