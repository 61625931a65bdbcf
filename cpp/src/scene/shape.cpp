#include "energymargin/shape.hpp"

#include <algorithm>
#include <limits>

#include "scene/inertia.hpp"
#include "scene/solids.hpp"

namespace energymargin {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

}  // namespace

// The geometry of whichever shape it is.
template <typename... Shapes>
struct Geometry<std::variant<Shapes...>> {
  using Any = std::variant<Shapes...>;
  template <typename Shape>
  using Of = Geometry<std::decay_t<Shape>>;

  static void validate(const Any& any) {
    std::visit([](const auto& shape) { Of<decltype(shape)>::validate(shape); }, any);
  }
  static double smallest_half_extent(const Any& any) {
    return std::visit([](const auto& shape) { return Of<decltype(shape)>::smallest_half_extent(shape); }, any);
  }
  static double reach_from(const Any& any, const Vector3& point) {
    return std::visit([&](const auto& shape) { return Of<decltype(shape)>::reach_from(shape, point); }, any);
  }
  static MassProperties mass_properties(const Any& any, double mass) {
    return std::visit([&](const auto& shape) { return Of<decltype(shape)>::mass_properties(shape, mass); }, any);
  }
};

namespace {

// The mass properties of a part in the compound's frame.
MassProperties part_properties(const Part& part, double mass) {
  MassProperties properties = Geometry<Solid>::mass_properties(part.shape, mass);
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

}  // namespace

template <>
struct Geometry<Plane> {
  static void validate(const Plane& plane) {
    require_finite("normal", plane.normal);
    require_unit("normal", plane.normal);
    require_finite("offset", plane.offset);
  }
  static double smallest_half_extent(const Plane&) { return infinity; }
  static double reach_from(const Plane&, const Vector3&) { return infinity; }
  static MassProperties mass_properties(const Plane&, double) { return {}; }
};

template <>
struct Geometry<Compound> {
  static void validate(const Compound& compound) {
    for (std::size_t i = 0; i < compound.parts.size(); ++i) {
      const Part& part = compound.parts[i];
      try {
        Geometry<Solid>::validate(part.shape);
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

  // Of the most solid part: a decomposed mesh has slivers, which say nothing of how deep is deep.
  static double smallest_half_extent(const Compound& compound) {
    double most = compound.parts.empty() ? infinity : 0.0;
    for (const Part& part : compound.parts) most = std::max(most, Geometry<Solid>::smallest_half_extent(part.shape));
    return most;
  }

  static double reach_from(const Compound& compound, const Vector3& point) {
    double most = 0.0;
    for (const auto& [shape, pose] : compound.parts) {
      const Vector3 point_in_part = pose.orientation.conjugate() * (point - pose.position);
      most = std::max(most, Geometry<Solid>::reach_from(shape, point_in_part));
    }
    return most;
  }

  static MassProperties mass_properties(const Compound& compound, double mass) {
    if (!compound.solid && compound.parts.size() == 1) return part_properties(compound.parts.front(), mass);
    if (!compound.solid) return sum_of_parts(compound.parts, mass);
    MassProperties scaled = *compound.solid;
    scaled.moments *= mass;
    return scaled;
  }
};

void validate(const Shape& shape) { Geometry<Shape>::validate(shape); }

double smallest_half_extent(const Shape& shape) { return Geometry<Shape>::smallest_half_extent(shape); }

double reach_from(const Shape& shape, const Vector3& point) { return Geometry<Shape>::reach_from(shape, point); }

MassProperties mass_properties(const Shape& shape, double mass) {
  return Geometry<Shape>::mass_properties(shape, mass);
}

void validate_moments(const std::string& name, const Vector3& moments) {
  const bool positive = moments.allFinite() && (moments.array() > 0.0).all();
  // No two moments are less than the third; rounding in files gets a little room.
  if (!(positive && 2.0 * moments.maxCoeff() <= moments.sum() * (1.0 + 1e-6))) {
    reject(name, text(moments), "three numbers above 0 of which none is greater than the sum of the others");
  }
}

}  // namespace energymargin
