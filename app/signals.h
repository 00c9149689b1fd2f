// Signals: Ctrl-C (SIGINT), SIGTERM and SIGUSR1 while rendering. The first asks the render to finish its pass and save, the
// second stops it at once, the third leaves without waiting. While loading there is nothing to save and the first
// one leaves. Also keeps a closed pipe or a full disk from killing the program, so that it can say what happened.

#ifndef RAYFOLD_APP_SIGNALS_H
#define RAYFOLD_APP_SIGNALS_H

#include <rayfold/rayfold.h>

// SIGPIPE and SIGXFSZ become the failed write that they stand for.
void signals_ignore_broken_outputs(void);

// From here to the end of the program. The engine must live until signals_release().
void signals_watch(rf_engine *engine);
void signals_release(void);

// From here on there is something to save: the first signal no longer leaves at once.
void signals_defer(void);

// How many came since signals_defer().
int signals_count(void);

#endif
