#pragma once
// Words of a region.

#include "base/words.hpp"
#include "energymargin/region.hpp"

namespace energymargin {

template <>
struct Words<regions::Point> {
  static constexpr std::pair<const char*, regions::Point> all[]{{"origin", regions::Point::origin},
                                                                {"center_of_mass", regions::Point::center_of_mass}};
};

}  // namespace energymargin
