// States as dicts of bodies and joints, for Python.

#include "energymargin/state.hpp"

#include "bindings.hpp"
#include "given.hpp"
#include "warnings.hpp"

namespace energymargin::binding {
namespace {

double yaw_of(const Quaternion& q) {
  return std::atan2(2.0 * (q.w() * q.z() + q.x() * q.y()), 1.0 - 2.0 * (q.y() * q.y() + q.z() * q.z()));
}

using BodyDicts = py::typing::Dict<py::str, py::typing::Dict<py::str, py::object>>;

// A body's state from a dict of position, orientation or yaw, velocity, angular_velocity.
BodyState body_state(const std::string& name, const py::dict& dict, BodyState state) {
  for (const auto& item : dict) {
    const std::string key = word(name + ": key", item.first);
    if (key != "position" && key != "orientation" && key != "yaw" && key != "velocity" && key != "angular_velocity") {
      throw std::invalid_argument(name + " has '" + key +
                                  "', expected position, orientation, yaw, velocity or angular_velocity");
    }
  }
  const auto read = [&](const char* key, auto& value) {
    if (dict.contains(key)) value = convert(Type<std::decay_t<decltype(value)>>{}, name + ": " + key, dict[key]);
  };
  std::optional<double> yaw;
  std::optional<Quaternion> quaternion;
  if (dict.contains("yaw")) yaw = vector(name + ": yaw", py::make_tuple(dict["yaw"]), 1)[0];
  if (dict.contains("orientation"))
    quaternion = convert(Type<Quaternion>{}, name + ": orientation", dict["orientation"]);
  read("position", state.position);
  state.orientation = orientation(name + ": ", quaternion, yaw, state.orientation);
  read("velocity", state.velocity);
  read("angular_velocity", state.angular_velocity);
  return state;
}

// A joint's state from a number, its position, or a dict of position and velocity.
JointState joint_state(const std::string& name, const py::handle& value, JointState state) {
  if (!py::isinstance<py::dict>(value)) {
    state.position = convert(Type<double>{}, name, value);
    return state;
  }
  for (const auto& item : value.cast<py::dict>()) {
    const std::string key = word(name + ": key", item.first);
    if (key != "position" && key != "velocity") {
      throw std::invalid_argument(name + " has '" + key + "', expected position or velocity");
    }
    (key == "position" ? state.position : state.velocity) = convert(Type<double>{}, name + ": " + key, item.second);
  }
  return state;
}

State pack_dicts(const Scene& scene, const std::optional<py::typing::Dict<py::str, py::object>>& joint_dicts,
                 const py::KWArgs<py::typing::Dict<py::str, py::object>>& body_dicts) {
  std::map<std::string, BodyState> bodies;
  for (const auto& item : body_dicts) {
    const std::string name = word("body", item.first);
    if (!py::isinstance<py::dict>(item.second)) {
      throw std::invalid_argument(name + " is not a dict, expected dict(position=..., velocity=..., ...)");
    }
    bodies[name] = body_state(name, item.second.cast<py::dict>(), scene.body(name).state);
  }
  std::map<std::string, JointState> joints;
  for (const auto& item : joint_dicts ? py::dict(*joint_dicts) : py::dict()) {
    const std::string name = word("joint", item.first);
    joints[name] = joint_state("joint '" + name + "'", item.second, scene.joints()[scene.joint_index(name)].state);
  }
  State state = pack(scene, bodies, joints);
  if (!joints.empty()) warn(implausible_joints(scene, state), scene);
  return state;
}

BodyDicts unpack_dicts(const Scene& scene, const Given<State>& state) {
  const Unpacked unpacked = unpack(scene, given("state", state));
  BodyDicts dicts;
  for (const auto& [name, body] : unpacked.bodies) {
    py::dict dict;
    dict["position"] = body.position;
    dict["orientation"] = Eigen::Vector4d(body.orientation.coeffs());
    dict["velocity"] = body.velocity;
    dict["angular_velocity"] = body.angular_velocity;
    dict["yaw"] = yaw_of(body.orientation);
    dicts[py::str(name)] = dict;
  }
  if (!unpacked.joints.empty()) {
    py::dict joints;
    for (const auto& [name, joint] : unpacked.joints) {
      py::dict dict;
      dict["position"] = joint.position;
      dict["velocity"] = joint.velocity;
      joints[py::str(name)] = dict;
    }
    dicts["joints"] = joints;
  }
  return dicts;
}

py::slice slice_of_body(const Scene& scene, const std::string& name) {
  const int offset = StateLayout(scene).offset(scene.index(name));
  if (offset < 0) throw std::invalid_argument("body '" + name + "' is fixed or a link, expected a free one");
  return {offset, offset + StateLayout::numbers_per_body, 1};
}

py::slice slice_of_joint(const Scene& scene, const std::string& name) {
  const int offset = StateLayout(scene).joint_offset(scene.joint_index(name));
  if (offset < 0) {
    throw std::invalid_argument("joint '" + name + "' is fixed or follows another, expected one that moves by itself");
  }
  return {offset, offset + StateLayout::numbers_per_joint, 1};
}

}  // namespace

void bind_state(py::class_<Scene>& scene) {
  scene
      .def("pack", &pack_dicts, py::kw_only(), py::arg("joints") = py::none(),
           "State vector, shape (n,): scene.pack(box=dict(position=..., yaw=..., velocity=...), joints=dict(knee=0.1, "
           "ankle=dict(position=..., velocity=...))). What is left out has the scene's own value. Raises ValueError on "
           "unknown bodies, joints or keys and bad values. Warns of a joint that is beyond its limits.")
      .def("unpack", &unpack_dicts, py::arg("state"),
           "Dict of dicts by body, links included: position (3,), orientation (4,), velocity (3,), angular_velocity "
           "(3,), yaw; and, if there are joints, under 'joints' a dict of dicts by joint: position, velocity.")
      .def("slice", &slice_of_body, py::arg("name"),
           "Where a free body's 13 numbers stand in a state: position 3, quaternion 4, velocity 3, angular velocity 3.")
      .def("joint_slice", &slice_of_joint, py::arg("name"), "Where a joint's position and velocity stand in a state.")
      .def_property_readonly(
          "dimension", [](const Scene& of) { return StateLayout(of).dimension(); }, "n, numbers in a state vector.");
}

}  // namespace energymargin::binding
