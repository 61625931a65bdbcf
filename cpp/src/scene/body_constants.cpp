#include "scene/body_constants.hpp"

#include <algorithm>
#include <limits>
#include <type_traits>

namespace energymargin {

std::vector<Part> solids_of(const Shape& shape) {
  return std::visit(
      [](const auto& of) -> std::vector<Part> {
        using Kind = std::decay_t<decltype(of)>;
        if constexpr (std::is_same_v<Kind, Compound>) {
          return of.parts;
        } else if constexpr (std::is_same_v<Kind, Plane>) {
          return {};
        } else {
          return {{of}};
        }
      },
      shape);
}

BodyConstants::BodyConstants(const Body& body) : inertial_(body.principal_inertial()) {
  const auto half_extent = [](const auto& solid) { return energymargin::smallest_half_extent(solid); };
  for (const Part& part : solids_of(body.shape)) half_extents_.push_back(std::visit(half_extent, part.shape));
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
