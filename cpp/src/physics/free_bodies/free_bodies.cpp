#include "physics/free_bodies/free_bodies.hpp"

namespace energymargin {

FreeBodies::FreeBodies(const Scene& scene, const std::vector<CollisionShape>& shapes)
    : bodies_(scene, shapes), solver_(impulses_) {
  for (const auto& body : bodies_.all()) colliders_.push_back(body.get());
}

btVector3 FreeBodies::velocity(std::size_t body, const btVector3& point) const {
  return velocity_at(*bodies_.all()[body], point);
}

void FreeBodies::apply(const Load& load, double duration) { apply_load(*bodies_.all()[load.body], load, duration); }

bool FreeBodies::solve(const StepPart& part) {
  return solver_.solve(bodies_.moving(), part.touching, part.motors, part.solver);
}

}  // namespace energymargin
