#pragma once
// Words of a search.

#include "base/words.hpp"
#include "energymargin/search/sampling.hpp"

namespace energymargin {

template <>
struct Words<Sampling> {
  static constexpr std::pair<const char*, Sampling> all[]{{"mixed", Sampling::mixed}, {"uniform", Sampling::uniform}};
};

}  // namespace energymargin
