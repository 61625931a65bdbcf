// A planner of your own: AO-x over any control planner of OMPL, here KPIECE. What is the least work that it finds to
// push a brick out of a circle on a table?

#include <ompl/control/planners/kpiece/KPIECE1.h>
#include <ompl/util/RandomNumbers.h>

#include <cstdio>
#include <energymargin/energymargin.hpp>
#include <energymargin/search/ao.hpp>

namespace em = energymargin;

int main() {
  ompl::RNG::setSeed(1);  // of OMPL's own planners, before the first of them is made

  em::Scene scene;

  em::Body table;
  table.name = "table";
  table.shape = em::Plane{};
  table.friction = 0.5;
  scene.add_body(table);

  em::Body brick;
  brick.name = "brick";
  brick.shape = em::Box{{0.10, 0.06, 0.04}};
  brick.mass = 0.2;
  brick.state.position = {0.0, 0.0, 0.02};
  brick.friction = 0.4;
  brick.role = em::Role::object;
  scene.add_body(brick);

  const em::regions::Disc near{"brick", {0.0, 0.0}, 0.05};
  em::Problem problem(scene, em::pack(scene), near);
  problem.force = {1.0, 1.0, 0.0};    // the largest disturbance along each axis [N]
  problem.torque = {0.0, 0.0, 0.02};  // and about each axis [N m]
  problem.duration = 0.2;             // for which one lasts at most [s]

  const int nodes = 1000;
  const std::uint64_t seed = 1;  // of the disturbances
  em::search::BoundedProblem bounded(problem, &problem.captured, nodes, seed);
  ompl::control::KPIECE1 planner(bounded.space_information());
  planner.setProblemDefinition(bounded.definition());
  const em::Escape escape = em::search::ao(bounded, planner);
  std::printf("effort of escape: %.6f J after %d nodes\n", escape.effort, escape.nodes());
  for (const auto& [at, effort] : escape.history) std::printf("  %.6f J after %d nodes\n", effort, at);
}
