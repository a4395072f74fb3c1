#include "firmware/app/threads/real_time.hpp"

#include <cstddef>
#include <malloc.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>

#include "firmware/app/log/log.hpp"

namespace probebox::app {
namespace {

// Locked stacks are resident from end to end. The deepest is the links' while it makes a block of profile fast, whose
// encoder alone is 66 kB; the worker's has been seen to use 36 kB while it solves.
constexpr std::size_t kStackBytes = 256 * 1024;

// A limit that is there may let the lock succeed and a later allocation fail: then better no lock.
bool lockMemory() {
  rlimit limit{};
  if (getrlimit(RLIMIT_MEMLOCK, &limit) != 0 || limit.rlim_cur != RLIM_INFINITY) return false;
  return mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
}

}  // namespace

void keepMemoryResident() {
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstacksize(&attributes, kStackBytes);
  pthread_setattr_default_np(&attributes);
  pthread_attr_destroy(&attributes);
  // Each further heap would take 64 MB of addresses, which count as locked.
  mallopt(M_ARENA_MAX, 1);
  if (!lockMemory()) {
    logInfo(
        "Memory is not locked, so page faults may delay the box (allow locking with LimitMEMLOCK=infinity); the late "
        "ticks in `probebox status` show whether that matters.");
  }
}

void askForRealTime() {
  const sched_param priority{.sched_priority = 50};
  if (pthread_setschedparam(pthread_self(), SCHED_FIFO, &priority) != 0) {
    logInfo(
        "The capture thread runs without real-time priority (allow it with LimitRTPRIO=50); the late ticks in "
        "`probebox status` show whether that matters.");
  }
}

}  // namespace probebox::app
