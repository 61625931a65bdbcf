#pragma once

namespace energymargin {

//! Whether this build starts threads. One that does not works in the calls that wait for results.
inline constexpr bool with_threads = ENERGYMARGIN_THREADS;

}  // namespace energymargin
