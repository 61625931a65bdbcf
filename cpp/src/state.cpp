#include "energymargin/state.hpp"

#include "check.hpp"

namespace energymargin {

StateLayout::StateLayout(const Scene& scene) {
  for (const Body& body : scene.bodies()) {
    offsets_.push_back(body.fixed() ? -1 : dimension_);
    if (!body.fixed()) dimension_ += numbers_per_body;
  }
}

BodyState StateLayout::read(const double* numbers) {
  using Block = Eigen::Map<const Vector3>;
  return {Block(numbers), Quaternion(numbers[6], numbers[3], numbers[4], numbers[5]), Block(numbers + 7),
          Block(numbers + 10)};
}

void StateLayout::write(const BodyState& body, double* numbers) {
  Eigen::Map<Eigen::Matrix<double, numbers_per_body, 1>> all(numbers);
  all << body.position, body.orientation.coeffs(), body.velocity, body.angular_velocity;
}

State pack(const Scene& scene, const std::map<std::string, BodyState>& bodies) {
  const StateLayout layout(scene);
  State state(layout.dimension());
  for (std::size_t i = 0; i < scene.bodies().size(); ++i) {
    if (layout.offset(i) >= 0) StateLayout::write(scene.bodies()[i].state, state.data() + layout.offset(i));
  }
  for (const auto& [name, body] : bodies) {
    const int offset = layout.offset(scene.index(name));
    if (offset < 0) reject("body", "'" + name + "'", "a body that can move; this one is fixed");
    validate(scene.body(name), body, name + ": ");
    StateLayout::write(body, state.data() + offset);
  }
  return state;
}

std::map<std::string, BodyState> unpack(const Scene& scene, const State& state) {
  validate(scene, state);
  const StateLayout layout(scene);
  std::map<std::string, BodyState> bodies;
  for (std::size_t i = 0; i < scene.bodies().size(); ++i) {
    if (layout.offset(i) >= 0) bodies[scene.bodies()[i].name] = StateLayout::read(state.data() + layout.offset(i));
  }
  return bodies;
}

void validate(const Body& body, const BodyState& state, const std::string& name) {
  require_finite(name + "position", state.position);
  require_finite(name + "velocity", state.velocity);
  require_finite(name + "angular_velocity", state.angular_velocity);
  if (!(std::abs(state.orientation.norm() - 1.0) < 1e-6)) {
    const Eigen::Vector4d& q = state.orientation.coeffs();
    reject(name + "orientation", "(" + text(q[0]) + ", " + text(q[1]) + ", " + text(q[2]) + ", " + text(q[3]) + ")",
           "a unit quaternion (x, y, z, w)");
  }
  const auto locked = [](const Vector3& factor, const Vector3& v) {
    return ((factor.array() == 0.0) && (v.array() != 0.0)).any();
  };
  if (locked(body.linear_factor, state.velocity)) {
    reject(name + "velocity", text(state.velocity), "0 along locked axes");
  }
  if (locked(body.angular_factor, state.angular_velocity)) {
    reject(name + "angular_velocity", text(state.angular_velocity), "0 about locked axes");
  }
  if (body.fixed() && (!state.velocity.isZero(0.0) || !state.angular_velocity.isZero(0.0))) {
    reject(name + "velocity", text(state.velocity), "0: the body is fixed");
  }
}

void validate(const Scene& scene, const State& state, const std::string& name) {
  const StateLayout layout(scene);
  if (state.size() != layout.dimension()) {
    reject(name, "a vector of " + std::to_string(state.size()) + " numbers",
           std::to_string(layout.dimension()) + " numbers, 13 for each moving body");
  }
  for (std::size_t i = 0; i < scene.bodies().size(); ++i) {
    if (layout.offset(i) < 0) continue;
    const Body& body = scene.bodies()[i];
    validate(body, StateLayout::read(state.data() + layout.offset(i)), name + ": body '" + body.name + "': ");
  }
}

}  // namespace energymargin
