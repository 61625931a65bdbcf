#include "energymargin/metrics/force.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/check.hpp"
#include "base/portable.hpp"

namespace energymargin {

ForceScore force_score(const Problem& problem) {
  validate(problem);
  require_no_clock(problem, "force_score");
  require_disturbed(problem, "force_score");
  const Scene& scene = problem.scene;
  const std::vector<std::size_t> effectors = scene.with_role(Role::effector);
  if (effectors.empty()) {
    reject("scene", "without an effector", "a body of role \"effector\": the force score is about its contacts");
  }

  World world(scene);
  ForceScore score;
  for (const Contact& contact : problem.contacts ? *problem.contacts : world.contacts(problem.state)) {
    const Body& a = scene.body(contact.body_a);
    const Body& b = scene.body(contact.body_b);
    if ((a.role == Role::object) == (b.role == Role::object)) continue;
    const Body& other = a.role == Role::object ? b : a;
    ContactMargins& margins = other.role == Role::effector ? score.effector : score.ground;
    const double mu = contact.friction;
    margins.engage += contact.normal_force;
    margins.stick += (mu * contact.normal_force - contact.tangential_force.norm()) * portable::cos(portable::atan(mu));
  }
  const std::vector<std::size_t> objects = scene.with_role(Role::object);
  for (const std::size_t object : objects) {
    double least = std::numeric_limits<double>::infinity();
    for (const std::size_t effector : effectors) {
      least =
          std::min(least, world.distance(problem.state, scene.bodies()[object].name, scene.bodies()[effector].name));
    }
    score.distance += least / static_cast<double>(objects.size());
  }
  const ForceWeights& weights = problem.force_weights;
  score.force = weights.engage * score.effector.engage + weights.stick * score.effector.stick +
                weights.ground_engage * score.ground.engage + weights.ground_stick * score.ground.stick -
                weights.distance * score.distance;
  return score;
}

}  // namespace energymargin
