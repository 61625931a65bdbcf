#pragma once
// What is legal, and yet looks like a slip: another unit, another order, a set elsewhere. docs/limits.md has the table.

#include <optional>
#include <string>
#include <vector>

#include "energymargin/problem.hpp"
#include "energymargin/scene.hpp"
#include "energymargin/state.hpp"

namespace energymargin {

//! Beyond the first of two bounds a value is doubted, beyond the second it is refused.
namespace plausible {

// Angles: degrees begin to look like themselves where a full turn ends, with room for a rounded 2 pi.
constexpr double angle = 6.2832;         //!< of a pose [rad]
constexpr double joint_angle = 12.5664;  //!< of a joint: wrists of industrial robots turn twice [rad]
constexpr double refused_angle = 1e4;    //!< 1600 turns: no pose and no joint is told so [rad]
// In a step of 0.05 s a body falls 2.5 cm from rest; in one of 1 s it falls 10 m.
constexpr double step = 0.05;         //!< [s]
constexpr double refused_step = 1.0;  //!< [s]
// An edge is one push of a disturbance. Manipulations take seconds; 200 looks like milliseconds.
constexpr double duration = 30.0;  //!< [s]
// A body of which even the least extent is 10 m is a building; in millimetres it is one centimetre.
constexpr double extent = 10.0;         //!< [m]
constexpr double extent_ratio = 300.0;  //!< of a fixed body to the least that moves: a hall beside a cup
constexpr double refused_extent = 1e5;  //!< where contacts of doubles are worse than micrometres [m]
// Osmium has 22 600 kg/m^3, the lightest foam 5. A robot's bodies stand for the inertia of its drives and gears too.
constexpr double density = 25e3;       //!< [kg/m^3]
constexpr double robot_density = 1e6;  //!< of effectors and links [kg/m^3]
constexpr double least_density = 5.0;  //!< that is given [kg/m^3]
// A mass may be that of a hollow body; air has 1.2.
constexpr double least_implied_density = 0.1;  //!< [kg/m^3]
// Contacts and springs between such bodies need many more iterations than the solver makes.
constexpr double mass_ratio = 1e4;
// An object falls 1 cm in 45 ms, and lands at 0.44 m/s. One that moves is in flight.
constexpr double gap = 0.01;     //!< [m]
constexpr double at_rest = 0.1;  //!< [m/s]
// A share of the smaller body's smallest half extent: its middle is in the other one, and no contact knows the way out.
constexpr double overlap = 1.0;

}  // namespace plausible

//! A value that is legal and looks wrong.
struct Doubt {
  std::string about;  //!< what it is of, as "body 'box': mass": the same in all states of a scene
  std::string text;   //!< one line: the value, why it looks wrong, and what may have been meant
};

//! Of a scene alone: sizes, densities, ratios of masses, joint limits, orientations, the step.
std::vector<Doubt> implausible(const Scene& scene);

//! Of a problem, its scene included. `start_outside`: a start outside of the capture set is meant.
std::vector<Doubt> implausible(const Problem& problem, bool start_outside = false);

//! Of a simulation that starts at a state: bodies deep in each other, which are thrown apart.
std::vector<Doubt> implausible_start(World& world, const State& state);

//! Of an angle of a pose. Throws std::invalid_argument on one beyond plausible::refused_angle.
std::optional<Doubt> implausible_angle(const std::string& name, double angle);

//! Of a density [kg/m^3].
std::optional<Doubt> implausible_density(const std::string& name, double density);

//! The same text for all states and problems of a scene.
std::string fingerprint(const Scene& scene);

}  // namespace energymargin
