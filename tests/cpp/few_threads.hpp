#pragma once
// A process to which the system gives few threads, or none.

#include <gtest/gtest.h>
#include <malloc.h>
#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstddef>
#include <fstream>
#include <stdexcept>

namespace energymargin {

#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define ENERGYMARGIN_MEMORY_IS_THE_SANITIZERS
#endif
#endif

#ifdef ENERGYMARGIN_MEMORY_IS_THE_SANITIZERS
inline constexpr bool can_bound_memory = false;
#else
inline constexpr bool can_bound_memory = true;
#endif

//! From now on this process can start so many threads more, and has half a thread's memory beside. For death tests:
//! there is no way back.
inline void leave_room_for_threads(int count) {
  constexpr std::size_t stack = 256 << 20;
  mallopt(M_ARENA_MAX, 1);  // a thread takes its stack alone
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstacksize(&attributes, stack);
  if (pthread_setattr_default_np(&attributes) != 0) throw std::runtime_error("no stacks of this size");
  std::size_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  const rlim_t room = stack * static_cast<std::size_t>(count) + stack / 2;
  const rlim_t most = pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE)) + room;
  const rlimit limit{most, most};
  if (setrlimit(RLIMIT_AS, &limit) != 0) throw std::runtime_error("the memory cannot be bounded");
}

}  // namespace energymargin
