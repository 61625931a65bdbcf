//! Doubts as Python's warnings.
#pragma once

#include <string>
#include <vector>

#include "convert.hpp"
#include "energymargin/plausibility.hpp"

namespace energymargin::binding {

//! Warns of each doubt, once for all states of a scene. Throws if a filter of Python makes the warning an error.
void warn(const std::vector<Doubt>& doubts, const Scene& scene);

//! Warns of an angle of a pose that looks like degrees.
void warn_of_angle(const std::string& name, double angle);

//! Warns of a density that looks like one in g/cm^3.
void warn_of_density(const std::string& name, double density);

}  // namespace energymargin::binding
