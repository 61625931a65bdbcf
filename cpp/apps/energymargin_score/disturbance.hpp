#pragma once
// The random disturbance of --metric probability, from its options.

#include <map>
#include <string>

#include "energymargin/disturbances.hpp"
#include "value.hpp"

namespace energymargin::app {

//! The options of a disturbance by their names, as "--strength".
using DisturbanceOptions = std::map<std::string, Value>;

//! Throws std::invalid_argument on an unknown kind, a bad value, or an option of another kind.
DisturbanceModel disturbance_model(const std::string& kind, DisturbanceOptions options);

}  // namespace energymargin::app
