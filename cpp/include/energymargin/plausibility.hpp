#pragma once
// What is legal, and yet looks like a slip: another unit, another order, a set elsewhere. docs/limits.md has the table.

#include <optional>
#include <string>
#include <vector>

#include "energymargin/plausible.hpp"
#include "energymargin/problem.hpp"
#include "energymargin/scene.hpp"
#include "energymargin/state.hpp"

namespace energymargin {

//! A value that is legal and looks wrong, or a result that says less than it seems to.
struct Warning {
  std::string about;  //!< what it is of, as "body 'box': mass": the same in all states of a scene
  std::string text;   //!< one line: the value, why it looks wrong, and what may have been meant
};

//! Of a scene alone: sizes, densities, ratios of masses, joint limits, orientations, frictions that turn, the step.
std::vector<Warning> implausible(const Scene& scene);

//! Of a problem, its scene included. `start_outside`: a start outside of the capture set is meant.
std::vector<Warning> implausible(const Problem& problem, bool start_outside = false);

//! Of a state: joints that are further beyond their limits than a simulated one yields at its stop.
std::vector<Warning> implausible_joints(const Scene& scene, const State& state);

//! Of a simulation that starts at a state: those joints, loops that gape, and bodies deep in each other.
std::vector<Warning> implausible_start(World& world, const State& state);

//! Of an angle of a pose. Throws std::invalid_argument on one beyond plausible::refused_angle.
std::optional<Warning> implausible_angle(const std::string& name, double angle);

//! Of a density [kg/m^3].
std::optional<Warning> implausible_density(const std::string& name, double density);

//! The smaller one of the smallest half extents of the two bodies of a contact, which a penetration is measured by [m].
double smaller_half_extent(const Scene& scene, const Contact& contact);

//! The same text for all states and problems of a scene.
std::string fingerprint(const Scene& scene);

}  // namespace energymargin
