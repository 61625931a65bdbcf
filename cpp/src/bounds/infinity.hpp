#pragma once

#include <limits>

namespace energymargin::bounds {

inline constexpr double infinity = std::numeric_limits<double>::infinity();

}  // namespace energymargin::bounds
