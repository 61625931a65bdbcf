#pragma once

#include <new>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

namespace energymargin {

//! Whether this build starts threads. One that does not works in the calls that wait for results.
inline constexpr bool with_threads = ENERGYMARGIN_THREADS;

//! Adds a thread that runs `work`. False if the system gives none: then the others have to do.
template <typename Work>
bool start_thread(std::vector<std::thread>& threads, Work&& work) {
  try {
    threads.emplace_back(std::forward<Work>(work));
    return true;
  } catch (const std::system_error&) {
    return false;
  } catch (const std::bad_alloc&) {
    return false;
  }
}

}  // namespace energymargin
