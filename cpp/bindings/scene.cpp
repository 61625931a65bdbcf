// Scenes for Python.

#include "energymargin/scene.hpp"

#include "bindings.hpp"
#include "energymargin/state.hpp"
#include "given.hpp"
#include "records.hpp"
#include "scene/records.hpp"

namespace energymargin::binding {
namespace {

constexpr const char* scene_doc = R"(An empty scene.

gravity [m/s^2]. step [s]: of the simulation. solver_iterations: Newton iterations of the contact solver in a step, at most,
1 to 10000. solver_tolerance: a step has converged when the residual of the equations of motion is below this share of the
impulses that act in it (relative, without a unit), above 0 and at most 0.01. margin [m]: of collision shapes, by default a
twentieth of each one's smallest half extent. friction_rule: what two bodies' coefficients make of their contact's,
'product' (as in Bullet) or 'max' (as in MuJoCo); set_friction says it for a pair.)";

Scene make_scene(const Given<Vector3>& gravity, const Given<double>& step, const Given<int>& solver_iterations,
                 const Given<double>& solver_tolerance, const Given<std::optional<double>>& margin,
                 const Given<FrictionRule>& friction_rule) {
  return Scene(given("gravity", gravity),
               Stepping{given("step", step), given("solver_iterations", solver_iterations),
                        given("solver_tolerance", solver_tolerance), given("margin", margin)},
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
  with_fields(
      Record<PairFriction>::fields(), {3}, +[](PairFriction pair, Scene& its_scene) { its_scene.set_friction(pair); },
      [&](const auto& set, const auto&... keywords) { scene.def("set_friction", set, keywords..., set_friction_doc); });
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
  return repr_of_fields("Scene", fields);
}

void bind_parts(py::class_<Scene>& scene) {
  scene
      .def_property_readonly(
          "bodies", [](const Scene& of) { return of.bodies(); }, "In the order in which they were added.")
      .def_property_readonly(
          "joints", [](const Scene& of) { return of.joints(); }, "In the order in which they were added.")
      .def_property_readonly(
          "springs", [](const Scene& of) { return of.springs(); }, "In the order in which they were added.")
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
          "solver_iterations", [](const Scene& of) { return of.stepping().iterations; },
          "Newton iterations of the contact solver in a step, at most.")
      .def_property_readonly(
          "solver_tolerance", [](const Scene& of) { return of.stepping().tolerance; },
          "A step has converged when the residual of the equations of motion is below this share of its impulses.")
      .def_property_readonly("margin", [](const Scene& of) { return of.stepping().margin; }, "[m]");
}

}  // namespace

void bind_scene(py::module_& module) {
  py::class_<Scene> scene(module, "Scene",
                          "Bodies, joints and springs under gravity [m/s^2], and how the physics is stepped.");
  scene.def(py::init(&make_scene), py::arg("gravity") = py::make_tuple(0.0, 0.0, -9.81),
            py::arg("step") = Stepping{}.step, py::arg("solver_iterations") = Stepping{}.iterations,
            py::arg("solver_tolerance") = Stepping{}.tolerance, py::arg("margin") = py::none(),
            py::arg("friction_rule") = word_of(FrictionRule::product), scene_doc);
  scene.def("__repr__", &shown_scene);
  bind_parts(scene);
  bind_stepping(scene);
  bind_friction(scene);
  bind_add_body(scene);
  bind_add_joint(scene);
  bind_state(scene);
}

}  // namespace energymargin::binding
