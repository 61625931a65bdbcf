// Scenes, and states as dicts of bodies and joints, for Python.

#include "energymargin/scene.hpp"

#include "base/portable.hpp"
#include "energymargin/state.hpp"
#include "records.hpp"
#include "scene/records.hpp"
#include "simulator.hpp"

namespace energymargin::binding {
namespace {

constexpr const char* scene_doc = R"(An empty scene.

gravity [m/s^2]. step [s]: of the simulation. solver_iterations: Newton iterations of the contact solver in a step, at most,
1 to 10000, 200 by default. solver_tolerance: a step has converged when the residual of the equations of motion is below this share of the
impulses that act in it (relative, without a unit), above 0 and at most 0.01, 1e-5 by default. margin [m]: of collision shapes, by default a
twentieth of each one's smallest half extent. friction_rule: what two bodies' coefficients make of their contact's,
'product' (as in Bullet) or 'max' (as in MuJoCo); set_friction says it for a pair. engine: what steps the scene, 'native' (the
library's own dynamics), 'bullet' (Bullet's multi-body world) or an em.engines.Engine, whose step has to be the scene's. In Bullet solver_iterations are sweeps, 50 by default, and solver_tolerance is
the largest squared change of an impulse in the last sweep [N^2 s^2], 1e-7 by default.)";

Scene make_scene(const Given<Vector3>& gravity, const Given<double>& step,
                 const Given<std::optional<int>>& solver_iterations,
                 const Given<std::optional<double>>& solver_tolerance, const Given<std::optional<double>>& margin,
                 const Given<FrictionRule>& friction_rule, const Given<EngineChoice>& engine) {
  EngineChoice choice = given("engine", engine);
  return Scene(given("gravity", gravity),
               Stepping{given("step", step), given("solver_iterations", solver_iterations),
                        given("solver_tolerance", solver_tolerance), given("margin", margin), choice.kind,
                        std::move(choice.simulator)},
               given("friction_rule", friction_rule));
}

constexpr const char* set_friction_doc = R"(From now on contacts of the two bodies have this coefficient of friction.

It counts instead of what friction_rule makes of the bodies' own; torsional_friction and rolling_friction [m] instead of those
of their surfaces. With None these stay what they were. Raises ValueError on unknown bodies, one body given twice, and a coefficient that is negative or not finite.)";

std::map<std::pair<std::string, std::string>, double> pair_frictions(const Scene& scene) {
  std::map<std::pair<std::string, std::string>, double> frictions;
  for (const PairFriction& pair : scene.pair_frictions()) frictions[{pair.body_a, pair.body_b}] = pair.friction;
  return frictions;
}

void bind_friction(py::class_<Scene>& scene) {
  def_function(
      scene, "set_friction", set_friction_doc, record_of<PairFriction>.fields, {3},
      +[](PairFriction pair, Scene& its_scene) { its_scene.set_friction(pair); });
  scene
      .def_property_readonly(
          "friction_rule", [](const Scene& of) { return std::string(word_of(of.friction_rule())); },
          "What two bodies' coefficients make of their contact's: 'product' or 'max'.")
      .def_property_readonly("pair_frictions", &pair_frictions,
                             "Coefficients that were set, by pair of bodies, the one that was added first in front.")
      .def(
          "contact_friction",
          [](const Scene& of, const std::string& a, const std::string& b) {
            return of.contact_friction(of.index(a), of.index(b));
          },
          py::arg("body_a"), py::arg("body_b"),
          "Coefficient of the contacts of two bodies: that of the pair, or else by friction_rule.")
      .def(
          "contact_surface",
          [](const Scene& of, const std::string& a, const std::string& b) {
            return of.contact_surface(of.index(a), of.index(b));
          },
          py::arg("body_a"), py::arg("body_b"), "What the surfaces of two bodies make of their contacts.");
}

std::string shown_scene(const Scene& scene) {
  std::vector<std::string> names;
  for (const Body& body : scene.bodies()) names.push_back(body.name);
  std::vector<std::pair<const char*, py::object>> fields{{"bodies", py::cast(names)},
                                                         {"joints", py::cast(scene.joints().size())},
                                                         {"dimension", py::cast(StateLayout(scene).dimension())}};
  const FrictionRule rule = scene.friction_rule();
  if (rule != FrictionRule::product) fields.emplace_back("friction_rule", py::cast(word_of(rule)));
  if (scene.stepping().engine != EngineKind::native || scene.stepping().simulator) {
    fields.emplace_back("engine", engine_of(scene));
  }
  return repr_of_fields("Scene", fields);
}

void bind_lists(py::class_<Scene>& scene) {
  constexpr auto copy = py::return_value_policy::copy;
  constexpr const char* order = "In the order in which they were added.";
  scene.def_property_readonly("bodies", &Scene::bodies, copy, order)
      .def_property_readonly("joints", &Scene::joints, copy, order)
      .def_property_readonly("tendons", &Scene::tendons, copy, order)
      .def_property_readonly("loops", &Scene::loops, copy, order)
      .def_property_readonly("springs", &Scene::springs, copy, order)
      .def("disable_collisions", &Scene::disable_collisions, py::arg("body_a"), py::arg("body_b"),
           "From now on the two bodies never collide. Those that a joint connects never do.")
      .def_property_readonly(
          "disabled_collisions",
          [](const Scene& of) {
            const auto& pairs = of.disabled_collisions();
            return std::vector<std::pair<std::string, std::string>>(pairs.begin(), pairs.end());
          },
          "Pairs of bodies.");
}

void bind_stepping(py::class_<Scene>& scene) {
  scene.def_property_readonly(
           "gravity", [](const Scene& of) { return of.gravity(); }, "Shape (3,) [m/s^2].")
      .def_property_readonly(
          "step", [](const Scene& of) { return of.stepping().step; }, "[s]")
      .def_property_readonly(
          "solver_iterations", [](const Scene& of) { return of.stepping().most_iterations(); },
          "Newton iterations of the contact solver in a step, at most.")
      .def_property_readonly(
          "solver_tolerance", [](const Scene& of) { return of.stepping().residual(); },
          "A step has converged when the residual of the equations of motion is below this share of its impulses.")
      .def_property_readonly(
          "margin", [](const Scene& of) { return of.stepping().margin; }, "[m]")
      .def_property_readonly("engine", &engine_of, "What steps the scene: 'native', 'bullet' or an em.engines.Engine.")
      .def(
          "with_engine",
          [](const Scene& of, const Given<EngineChoice>& engine) {
            const EngineChoice choice = given("engine", engine);
            return choice.simulator ? of.with_simulator(choice.simulator) : of.with_engine(choice.kind);
          },
          py::arg("engine"),
          "The same scene, stepped by 'native' or 'bullet', with that one's own solver_iterations and "
          "solver_tolerance, or by an em.engines.Engine in its own step. Raises ValueError on another word.");
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
    const Quaternion& q = body.orientation;
    dict["yaw"] = portable::atan2(2.0 * (q.w() * q.z() + q.x() * q.y()), 1.0 - 2.0 * (q.y() * q.y() + q.z() * q.z()));
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

}  // namespace

void bind_scene(py::module_& module) {
  py::class_<Scene> scene(module, "Scene",
                          "Bodies, joints and springs under gravity [m/s^2], and how the physics is stepped.");
  scene.def(py::init(&make_scene), py::arg("gravity") = py::make_tuple(0.0, 0.0, -9.81),
            py::arg("step") = Stepping{}.step, py::arg("solver_iterations") = py::none(),
            py::arg("solver_tolerance") = py::none(), py::arg("margin") = py::none(),
            py::arg("friction_rule") = word_of(FrictionRule::product), py::arg("engine") = word_of(EngineKind::native),
            scene_doc);
  scene.def("__repr__", &shown_scene);
  bind_lists(scene);
  bind_stepping(scene);
  bind_friction(scene);
  bind_additions(scene);
  bind_state(scene);
}

}  // namespace energymargin::binding
