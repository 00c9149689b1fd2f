// See signals.h. Handlers run on any thread at any time: they touch atomics, rf_cancel() and write() only. They are
// installed even where the signal is ignored on entry, as it is for background jobs of a shell script: whoever sends
// it there means it.

#include "signals.h"

#include "say.h"

#include <signal.h>
#include <stdatomic.h>
#include <unistd.h>

static _Atomic(rf_engine *) watched;
static atomic_int is_deferred, count;

_Static_assert(ATOMIC_INT_LOCK_FREE == 2 && ATOMIC_POINTER_LOCK_FREE == 2,
               "handlers must not wait for a lock");

static void leave_now(void)
{
  static const char text[] = "\nrayfold: stopped; run the same command again\n";
  const ssize_t ignored = write(STDERR_FILENO, text, sizeof text - 1);
  (void)ignored;
  _exit(EXIT_STOPPED);
}

static void on_stop(int signal_number)
{
  (void)signal_number;
  if (!atomic_load(&is_deferred)) leave_now();
  const int before = atomic_fetch_add(&count, 1);
  rf_engine *engine = atomic_load(&watched);
  if (before == 1 && engine) rf_cancel(engine);
  if (before >= 2) leave_now();
}

static void handle(int signal_number, void (*handler)(int))
{
  struct sigaction action = {.sa_handler = handler, .sa_flags = SA_RESTART};
  sigemptyset(&action.sa_mask);
  sigaction(signal_number, &action, NULL);
}

void signals_ignore_broken_outputs(void)
{
  handle(SIGPIPE, SIG_IGN);
  handle(SIGXFSZ, SIG_IGN);
}

void signals_watch(rf_engine *engine)
{
  atomic_store(&watched, engine);
  handle(SIGINT, on_stop);
  handle(SIGTERM, on_stop);
  handle(SIGUSR1, on_stop); // what a batch system sends before its time is over
}

void signals_release(void)
{
  atomic_store(&watched, NULL);
}

void signals_defer(void)
{
  atomic_store(&is_deferred, 1);
}

int signals_count(void)
{
  return atomic_load(&count);
}
