// What this machine offers: instruction-set levels and the number of threads worth starting.

#ifndef RAYFOLD_BASE_CPU_H
#define RAYFOLD_BASE_CPU_H

typedef enum IsaLevel {
  ISA_REF, // plain scalar code, the truth for tests
  ISA_V2,  // x86-64-v2: SSE4.2
  ISA_V3,  // x86-64-v3: AVX2
  ISA_V4,  // x86-64-v4: AVX-512 F, BW, CD, DQ, VL
  ISA_COUNT,
} IsaLevel;

extern const char *const isa_names[ISA_COUNT]; // "ref", "v2", "v3", "v4"

IsaLevel cpu_best_isa(void);

// Threads this process may use at once: its CPU affinity, cut by the cgroup's CPU quota; at least 1.
int cpu_thread_count(void);

#endif
