#pragma once
// Bounds of what a value of a scene or a problem plausibly is. docs/limits.md has the table.

namespace energymargin {

//! Beyond the first of two bounds a value is warned of, beyond the second it is refused.
namespace plausible {

// Angles: degrees begin to look like themselves where a full turn ends, with room for a rounded 2 pi.
constexpr double angle = 6.2832;         //!< of a pose [rad]
constexpr double joint_angle = 12.5664;  //!< of a joint: wrists of industrial robots turn twice [rad]
constexpr double refused_angle = 1e4;    //!< 1600 turns: no pose and no joint is told so [rad]
// A simulated joint yields a little at its stop.
constexpr double stop_angle = 0.05;    //!< of a state beyond the limit of a revolute joint [rad]
constexpr double stop_length = 0.002;  //!< of a prismatic one [m]
constexpr double loop_gap = 0.001;     //!< of a loop's ends in a state [m]
constexpr double loop_turn = 0.02;     //!< of a weld's [rad]
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
// All of a body's mass in its farthest point makes 1; wrong units make it a thousandth. Shapes may be those of a
// fingertip alone, so that a link reaches farther than they do.
constexpr double most_gyration = 2.0;    //!< of its reach, a body's radius of gyration
constexpr double least_gyration = 0.01;  //!< the same
// Contacts and springs between such bodies need many more iterations than the solver makes.
constexpr double mass_ratio = 1e4;
// An object falls 1 cm in 45 ms, and lands at 0.44 m/s. One that moves is in flight.
constexpr double gap = 0.01;     //!< [m]
constexpr double at_rest = 0.1;  //!< [m/s]
// A share of the smaller body's smallest half extent: its middle is in the other one, and no contact knows the way out.
constexpr double overlap = 1.0;

}  // namespace plausible

}  // namespace energymargin
