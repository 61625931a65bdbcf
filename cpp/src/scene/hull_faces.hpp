#pragma once
// The surface of a convex hull.

#include <array>
#include <vector>

#include "energymargin/types.hpp"

namespace energymargin {

//! Triangles of the convex hull's surface as indices of the points, counter-clockwise from outside.
std::vector<std::array<std::size_t, 3>> hull_faces(const std::vector<Vector3>& points);

}  // namespace energymargin
