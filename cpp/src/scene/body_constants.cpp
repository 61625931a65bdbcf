#include "scene/body_constants.hpp"

#include <algorithm>
#include <limits>

namespace energymargin {

BodyConstants::BodyConstants(const Body& body) : inertial_(body.principal_inertial()) {
  if (const auto* compound = std::get_if<Compound>(&body.shape)) {
    for (const Part& part : compound->parts) {
      half_extents_.push_back(
          std::visit([](const auto& solid) { return energymargin::smallest_half_extent(solid); }, part.shape));
    }
  } else if (!std::holds_alternative<Plane>(body.shape)) {
    half_extents_.push_back(energymargin::smallest_half_extent(body.shape));
  }
}

double BodyConstants::smallest_half_extent() const {
  if (half_extents_.empty()) return std::numeric_limits<double>::infinity();
  return *std::max_element(half_extents_.begin(), half_extents_.end());
}

const CollisionShape& BodyConstants::collision_shape(const Body& body, std::optional<double> margin) const {
  std::call_once(shape_made_, [&] { collision_shape_ = make_collision_shape(body, *this, margin); });
  return *collision_shape_;
}

}  // namespace energymargin
