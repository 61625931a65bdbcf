#pragma once
// The closest points of a cylinder that stands along an axis of a box or of another cylinder.

#include <optional>

#include "physics/contacts/inner_shape.hpp"

namespace energymargin {

//! GJK takes many iterations for two round sides that are close to each other. Side by side it is a question of a
//! circle and a rectangle, or of two circles; the points are half way up what the two share of their height. Unset if
//! the axes are not parallel, if one is above the other, or if the inner shapes penetrate each other.
std::optional<ClosestPoints> distance_side_by_side(const InnerShape& a, const btTransform& pose_a, const InnerShape& b,
                                                   const btTransform& pose_b);

}  // namespace energymargin
