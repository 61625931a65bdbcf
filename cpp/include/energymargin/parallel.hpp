#pragma once
// Independent jobs on a few threads, taken from one queue.

#include <cstddef>
#include <functional>

#include "energymargin/limit.hpp"

namespace energymargin {

//! Calls `job(0)` ... `job(count - 1)`, each once, on at most `threads` threads, the caller's among them. The first
//! exception ends the rest and is thrown again here. No job begins once the limit is reached.
void parallel_for(std::size_t count, int threads, const std::function<void(std::size_t)>& job, const Limit& limit = {});

}  // namespace energymargin
