#pragma once
// How a robot corrects its plan by what it observes.

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace energymargin {

//! Corrections of a plan, linear in what is off: u = u_plan(t) + K (x_ref - x), from one control time to the next.
//! `observed` numbers x are a joint's position "j" or velocity "j.velocity", of a body "b.x", "b.y", "b.z" [m], "b.rx",
//! "b.ry", "b.rz" (rotation vector [rad]), "b.vx" to "b.vz" [m/s], "b.wx" to "b.wz" [rad/s], or the normal force
//! between two bodies in the last step, "force(a, b)" [N]. `corrected` ones u are a joint's target "j", a wrench "b.fx"
//! to "b.fz" [N], "b.tx" to "b.tz" [N m], or a velocity "b.vx" to "b.wz" of a free body.
struct Feedback {
  double period = 0.0;                   //!< between two control times [s]; each is at the nearest step
  std::vector<std::string> observed{};   //!< n names
  std::vector<std::string> corrected{};  //!< m names, of what the plan has rows of
  std::vector<Eigen::MatrixXd> gains{};  //!< K, (m, n): one, or one a control time, the last of which stays
  Eigen::MatrixXd references{};          //!< x_ref, (1, n), or a row a control time, the last of which stays
  int delay = 0;                         //!< control periods from an observation to its correction
  Eigen::VectorXd low{}, high{};         //!< limits of u, (m,); empty: none
  Eigen::VectorXd noise{};               //!< standard deviations of what is added to x, (n,); empty: none
  double start = 0.0;                    //!< of the law's time that is over as the plan begins [s]
  Eigen::VectorXd memory{};  //!< what the robot remembers as the plan begins; empty: nothing, it begins anew
};

//! Seeds of the noise of what a robot observes, each from a step of its plan on: ascending from 0.
using NoiseSeeds = std::vector<std::pair<int, std::uint64_t>>;

}  // namespace energymargin
