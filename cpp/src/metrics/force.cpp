#include "energymargin/metrics/force.hpp"

#include <cmath>

#include "../check.hpp"

namespace energymargin {

ForceScore force_score(const Problem& problem, const ForceWeights& weights) {
  require_finite("engage weight", weights.engage);
  require_finite("stick weight", weights.stick);
  require_finite("distance weight", weights.distance);
  validate(problem);
  const Scene& scene = problem.scene;
  const auto effector = scene.with_role(Role::effector);
  if (!effector)
    reject("scene", "without an effector", "a body of role \"effector\": the force score is about its contacts");
  const std::string& object_name = scene.bodies()[*scene.with_role(Role::object)].name;
  const std::string& effector_name = scene.bodies()[*effector].name;

  World world(scene);
  ForceScore score;
  for (const Contact& contact : problem.contacts ? *problem.contacts : world.contacts(problem.state)) {
    const bool between = (contact.body_a == object_name && contact.body_b == effector_name) ||
                         (contact.body_a == effector_name && contact.body_b == object_name);
    if (!between) continue;
    const double mu = contact.friction;
    score.engage += contact.normal_force;
    score.stick += (mu * contact.normal_force - contact.tangential_force.norm()) * std::cos(std::atan(mu));
  }
  score.distance = world.distance(problem.state, object_name, effector_name);
  score.force = weights.engage * score.engage + weights.stick * score.stick - weights.distance * score.distance;
  return score;
}

}  // namespace energymargin
