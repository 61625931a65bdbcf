#include "energymargin/shape.hpp"

#include <algorithm>
#include <limits>

#include "scene/solids.hpp"

namespace energymargin {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// The mass properties of a part in the compound's frame.
MassProperties part_properties(const Part& part, double mass) {
  MassProperties properties = std::visit([&](const auto& of) { return mass_properties(of, mass); }, part.shape);
  properties.center = part.pose.position + part.pose.orientation * properties.center;
  properties.axes = part.pose.orientation * properties.axes;
  return properties;
}

MassProperties sum_of_parts(const std::vector<Part>& compound, double mass) {
  std::vector<MassProperties> parts;  // of unit mass
  double volume = 0.0;
  Vector3 first = Vector3::Zero();
  for (const Part& solid : compound) {
    const MassProperties part = part_properties(solid, 1.0);
    volume += part.volume;
    first += part.volume * part.center;
    parts.push_back(part);
  }
  if (parts.empty()) return {};
  const Vector3 center = first / volume;
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
  for (const MassProperties& part : parts) {
    const Eigen::Matrix3d axes = part.axes.toRotationMatrix();
    const Vector3 arm = part.center - center;
    const double share = mass * part.volume / volume;
    inertia += share * (axes * part.moments.asDiagonal() * axes.transpose() +
                        arm.squaredNorm() * Eigen::Matrix3d::Identity() - arm * arm.transpose());
  }
  return principal(volume, center, inertia);
}

void validate(const Plane& plane) {
  require_finite("normal", plane.normal);
  require_unit("normal", plane.normal);
  require_finite("offset", plane.offset);
}
double smallest_half_extent(const Plane&) { return infinity; }
double reach_from(const Plane&, const Vector3&) { return infinity; }
MassProperties mass_properties(const Plane&, double) { return {}; }

void validate(const Compound& compound) {
  for (std::size_t i = 0; i < compound.parts.size(); ++i) {
    const Part& part = compound.parts[i];
    try {
      std::visit([](const auto& of) { validate(of); }, part.shape);
      require_finite("position", part.pose.position);
      require_unit("orientation", part.pose.orientation);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument("parts[" + std::to_string(i) + "]: " + error.what());
    }
  }
  if (!compound.solid) return;
  require_positive("solid: volume", compound.solid->volume);
  require_finite("solid: center", compound.solid->center);
  require_unit("solid: axes", compound.solid->axes);
  validate_moments("solid: moments", compound.solid->moments);
}

// The thickest part counts: a decomposed mesh has slivers, which say nothing of how deep is deep.
double smallest_half_extent(const Compound& compound) {
  double most = compound.parts.empty() ? infinity : 0.0;
  for (const Part& part : compound.parts) {
    most = std::max(most, std::visit([](const auto& of) { return smallest_half_extent(of); }, part.shape));
  }
  return most;
}

double reach_from(const Compound& compound, const Vector3& point) {
  double most = 0.0;
  for (const auto& [shape, pose] : compound.parts) {
    const Vector3 in_part = pose.orientation.conjugate() * (point - pose.position);
    most = std::max(most, std::visit([&](const auto& of) { return reach_from(of, in_part); }, shape));
  }
  return most;
}

MassProperties mass_properties(const Compound& compound, double mass) {
  if (!compound.solid && compound.parts.size() == 1) return part_properties(compound.parts.front(), mass);
  if (!compound.solid) return sum_of_parts(compound.parts, mass);
  MassProperties scaled = *compound.solid;
  scaled.moments *= mass;
  return scaled;
}

}  // namespace

void validate(const Shape& shape) {
  std::visit([](const auto& of) { validate(of); }, shape);
}

double smallest_half_extent(const Shape& shape) {
  return std::visit([](const auto& of) { return smallest_half_extent(of); }, shape);
}

double reach_from(const Shape& shape, const Vector3& point) {
  return std::visit([&](const auto& of) { return reach_from(of, point); }, shape);
}

MassProperties mass_properties(const Shape& shape, double mass) {
  return std::visit([&](const auto& of) { return mass_properties(of, mass); }, shape);
}

void validate_moments(const std::string& name, const Vector3& moments) {
  const bool positive = moments.allFinite() && (moments.array() > 0.0).all();
  // No two moments are less than the third; rounding in files gets a little room.
  if (!(positive && 2.0 * moments.maxCoeff() <= moments.sum() * (1.0 + 1e-6))) {
    reject(name, text(moments), "three numbers above 0 of which none is greater than the sum of the others");
  }
}

}  // namespace energymargin
