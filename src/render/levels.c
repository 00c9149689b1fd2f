// The tables of all levels this build has code for.

#include "render/hot.h"

extern const HotTable hot_ref, hot_v2, hot_v3, hot_v4;

const HotTable *hot_table(IsaLevel level)
{
#ifdef RAYFOLD_X86_LEVELS
  switch (level) {
  case ISA_REF: return &hot_ref;
  case ISA_V2: return &hot_v2;
  case ISA_V3: return &hot_v3;
  case ISA_V4: return &hot_v4;
  case ISA_COUNT: unreachable();
  }
  unreachable();
#else
  (void)level;
  return &hot_ref;
#endif
}
