#include "physics/contacts/rims.hpp"

#include <algorithm>
#include <cmath>

namespace energymargin::outlines {
namespace {

constexpr double same_angle = 1e-6;  // rad, on a rim: points so near are one

}  // namespace

std::optional<Rim> rim_of(const InnerShape& solid, const btTransform& pose, const ContactPlane& plane, double outward) {
  if (!solid.is_cylinder()) return std::nullopt;
  const btVector3 direction = plane.normal * outward * pose.getBasis();
  if (std::hypot(direction.x(), direction.y()) > lying) return std::nullopt;
  const double radius = solid.half().x() + solid.margin(), z = solid.half().z() + solid.margin();
  const auto along = [&](const btVector3& arm) {
    return Corner{plane.x.dot(arm), plane.y.dot(arm), plane.normal.dot(arm)};
  };
  return Rim{plane(pose(btVector3(0.0, 0.0, direction.z() < 0.0 ? -z : z))),
             along(pose.getBasis().getColumn(0) * radius), along(pose.getBasis().getColumn(1) * radius)};
}

void add_crossings(const Rim& rim, const Face& other, std::vector<double>& angles) {
  for (std::size_t i = other.size() == 2 ? 1 : 0; i < other.size(); ++i) {
    const auto [from_x, from_y] = rim.scaled(other[i]);
    const auto [to_x, to_y] = rim.scaled(other[(i + 1) % other.size()]);
    const double along_x = to_x - from_x, along_y = to_y - from_y, square = along_x * along_x + along_y * along_y;
    const double half = from_x * along_x + from_y * along_y;
    const double root = half * half - square * (from_x * from_x + from_y * from_y - 1.0);
    if (!(root > 0.0 && square > 0.0)) continue;
    for (const double sign : {-1.0, 1.0}) {
      const double share = (sign * std::sqrt(root) - half) / square;
      if (share < 0.0 || share > 1.0) continue;
      angles.push_back(portable::atan2(from_y + share * along_y, from_x + share * along_x));
    }
  }
}

void add_crossings(const Rim& rim, const Rim& other, std::vector<double>& angles) {
  const auto [x, y] = rim.scaled(other.center);
  const double away = std::hypot(x, y), ratio = other.radius() / rim.radius();
  if (!(away > std::abs(1.0 - ratio) && away < 1.0 + ratio)) return;
  const double half = portable::acos((1.0 + away * away - ratio * ratio) / (2.0 * away));
  angles.push_back(portable::atan2(y, x) + half);
  angles.push_back(portable::atan2(y, x) - half);
}

bool find_rim(const Rim& rim, double outward, double depth, const Slope& other, std::vector<double>& angles,
              Face& face) {
  const double x = rim.x.height - other.x * rim.x.x - other.y * rim.x.y;
  const double y = rim.y.height - other.x * rim.y.x - other.y * rim.y.y;
  const double nearest = std::hypot(x, y) > least_tilt * rim.radius() ? portable::atan2(outward * y, outward * x) : 0.0;
  for (int eighth = 0; eighth < 8; ++eighth) angles.push_back(nearest + SIMD_2_PI / 8.0 * eighth);
  for (double& angle : angles) angle -= SIMD_2_PI * std::floor((angle - nearest) / SIMD_2_PI);
  std::sort(angles.begin(), angles.end());
  const auto is_same = [](double angle, double next) { return next - angle < same_angle; };
  angles.erase(std::unique(angles.begin(), angles.end(), is_same), angles.end());
  if (angles.front() + SIMD_2_PI - angles.back() < same_angle) angles.pop_back();
  if (rim.is_clockwise()) std::reverse(angles.begin(), angles.end());
  const double most = outward * rim.center.height + std::hypot(rim.x.height, rim.y.height);
  face.clear();
  for (const double angle : angles) {
    const Corner corner = rim.at(angle);
    if (outward * corner.height >= most - depth) face.push_back(corner);
  }
  return face.size() == angles.size();
}

}  // namespace energymargin::outlines
