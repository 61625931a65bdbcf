#include "energymargin/scene.hpp"

#include <algorithm>

#include "check.hpp"
#include "energymargin/state.hpp"

namespace energymargin {
namespace {

void validate_factor(const std::string& name, const Vector3& factor) {
  for (const double value : factor) {
    if (value != 0.0 && value != 1.0) reject(name, text(factor), "0 (locked) or 1 (free) for each axis");
  }
}

void validate_body(const Body& body) {
  const std::string name = "body '" + body.name + "': ";
  try {
    validate(body.shape);
    require_not_negative("mass", body.mass);
    require_not_negative("friction", body.friction);
    validate_factor("linear_factor", body.linear_factor);
    validate_factor("angular_factor", body.angular_factor);
    validate(body, body.state, "");
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(name + error.what());
  }
  if (std::holds_alternative<Plane>(body.shape) && !body.fixed()) {
    throw std::invalid_argument(name + "mass is " + text(body.mass) + ", expected 0: a plane is fixed");
  }
  if (body.role == Role::object && body.fixed()) {
    throw std::invalid_argument(name + "mass is 0, expected a mass above 0: the object must be able to move");
  }
  const Vector3 centre = mass_properties(body.shape, 1.0).centre;
  if (!body.fixed() && centre.norm() > 1e-6 * smallest_half_extent(body.shape)) {
    throw std::invalid_argument(name + "the hull's centre of mass is " + text(centre) +
                                ", expected the origin: use ConvexHull(points).centered() and move the body instead");
  }
}

}  // namespace

Scene::Scene(const Vector3& gravity, const Stepping& stepping) : gravity_(gravity), stepping_(stepping) {
  require_finite("gravity", gravity);
  require_positive("step", stepping.step);
  require_at_least("solver_iterations", stepping.iterations, 1);
  require_not_negative("solver_tolerance", stepping.tolerance);
  if (stepping.margin) require_positive("margin", *stepping.margin);
}

std::size_t Scene::add_body(Body body) {
  if (body.name.empty()) reject("name", "empty", "a name that no other body of the scene has");
  for (const Body& other : bodies_) {
    if (other.name == body.name) reject("name", "'" + body.name + "'", "a name that no other body of the scene has");
  }
  validate_body(body);
  bodies_.push_back(std::move(body));
  return bodies_.size() - 1;
}

std::size_t Scene::index(const std::string& name) const {
  std::string names;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    if (bodies_[i].name == name) return i;
    names += (i == 0 ? "'" : ", '") + bodies_[i].name + "'";
  }
  reject("body", "'" + name + "'", bodies_.empty() ? "a body, but the scene has none" : "one of " + names);
}

std::optional<std::size_t> Scene::with_role(Role role) const {
  const auto found = std::find_if(bodies_.begin(), bodies_.end(), [&](const Body& body) { return body.role == role; });
  if (found == bodies_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - bodies_.begin());
}

}  // namespace energymargin
