#pragma once
// The scores of a problem as JSON.

#include <nlohmann/json.hpp>

#include "energymargin/plausibility.hpp"
#include "options.hpp"

namespace energymargin::app {

using Json = nlohmann::ordered_json;

//! The score of the metric, and its warnings. A problem with a clock adds its times and its plan.
struct Score {
  Json json;
  std::vector<Warning> warnings{};
};

//! Throws std::invalid_argument on a bad problem or option.
Score score(const Problem& problem, const Arguments& arguments);

}  // namespace energymargin::app
