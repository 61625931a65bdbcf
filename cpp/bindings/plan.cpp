// Plans for Python.

#include "energymargin/plan.hpp"

#include "energymargin/problem_io.hpp"
#include "given.hpp"

namespace energymargin::binding {
namespace {

constexpr const char* plan_doc =
    R"(The robot's actions from a problem's state on: K rows in time, each for `step` [s].

Args:
    step: duration of a row [s], at least a step of the scene. Each row begins at the step that is nearest to its time.
    wrenches: by free or jointed body, shape (K, 6): force [N] and torque [N m] at its centre of mass, along the world's
        axes.
    targets: by joint under position control, shape (K,) [rad] or [m].
    velocities: by free body, shape (K, 6): the velocity of its frame [m/s] and its angular velocity [rad/s]. A motor of
        limited force keeps the body at them. A kinematic body has them, whatever it meets.
    limits: of the motors, by body of `velocities`: (force [N], torque [N m]), the largest along and about each axis of the
        world. By default twice what holds the body and its links against gravity, and that at the body's radius. A kinematic
        body has none.

After the last row motors and wrenches are off, joints keep their targets, and kinematic bodies their velocities. Raises ValueError on rows of unequal number,
or that are not finite.)";

using Limits = std::map<std::string, std::pair<Given<double>, Given<double>>>;

Plan plan_of(const Given<double>& step, const Rows& wrenches, const Rows& targets, const Rows& velocities,
             const Limits& limits) {
  Plan plan = plan_of_rows("wrenches", wrenches, targets);
  plan.step = given("step", step);
  for (const auto& [body, rows] : velocities) {
    plan.velocities.push_back({body, matrix("velocities['" + body + "']", rows, -1, 6), std::nullopt, std::nullopt});
    const auto limit = limits.find(body);
    if (limit == limits.end()) continue;
    plan.velocities.back().force = given("limits['" + body + "'] force", limit->second.first);
    plan.velocities.back().torque = given("limits['" + body + "'] torque", limit->second.second);
  }
  for (const auto& [body, limit] : limits) {
    if (velocities.count(body) == 0) {
      throw std::invalid_argument("limits has '" + body + "', expected bodies of `velocities` only");
    }
  }
  validate(plan);
  return plan;
}

using RowsByName = py::typing::Dict<py::str, py::object>;

template <typename Part, typename Numbers>
RowsByName by_name(const std::vector<Part>& parts, std::string Part::* name, Numbers Part::* rows) {
  py::dict values;
  for (const Part& part : parts) values[py::str(part.*name)] = part.*rows;
  return values;
}

RowsByName wrenches_of(const Plan& plan) { return by_name(plan.wrenches, &Drive::body, &Drive::wrenches); }
RowsByName targets_of(const Plan& plan) { return by_name(plan.targets, &Targets::joint, &Targets::positions); }
RowsByName velocities_of(const Plan& plan) { return by_name(plan.velocities, &Servo::body, &Servo::velocities); }

RowsByName limits_of(const Plan& plan) {
  py::dict limits;
  for (const Servo& servo : plan.velocities) {
    if (servo.force && servo.torque) limits[py::str(servo.body)] = py::make_tuple(*servo.force, *servo.torque);
  }
  return limits;
}

}  // namespace

void bind_plan(py::module_& module) {
  py::class_<Plan>(module, "Plan", plan_doc)
      .def(py::init(&plan_of), py::arg("step"), py::arg("wrenches") = Rows{}, py::arg("targets") = Rows{},
           py::arg("velocities") = Rows{}, py::arg("limits") = Limits{})
      .def_static(
          "hold",
          [](const Scene& scene, const Given<State>& state, const Given<double>& duration) {
            return hold(scene, given("state", state), given("duration", duration));
          },
          py::arg("scene"), py::arg("state"), py::arg("duration"),
          "The robot goes on as it moves at a state (n,), for a duration [s]. Free effector bodies, or those that "
          "carry one, keep their twist in their own frames; joints under position control keep the scene's targets.")
      .def_readonly("step", &Plan::step, "Of a row [s].")
      .def_property_readonly("rows", &Plan::rows, "K.")
      .def_property_readonly("duration", &Plan::duration, "Of all rows [s].")
      .def_property_readonly("wrenches", &wrenches_of, "By body, shape (K, 6) [N, N m].")
      .def_property_readonly("targets", &targets_of, "By joint, shape (K,) [rad] or [m].")
      .def_property_readonly("velocities", &velocities_of, "By body, shape (K, 6) [m/s, rad/s].")
      .def_property_readonly("limits", &limits_of,
                             "Of motors, where the plan has them: by body, (force [N], torque [N m]).")
      .def(
          "fine_rows", [](const Plan& plan, const Given<double>& step) { return fine_rows(plan, given("step", step)); },
          py::arg("step"),
          "The same plan with a row for each step [s] of a scene, at most the plan's own. Each row begins at the step "
          "that is nearest to its time.")
      .def("__repr__",
           [](const Plan& plan) {
             py::list names;
             for (const auto& part : {wrenches_of(plan), targets_of(plan), velocities_of(plan)}) {
               for (const auto& [name, rows] : part) names.append(name);
             }
             return repr_of_fields("Plan", {{"duration", py::cast(plan.duration())}, {"of", names}});
           })
      .def(
          "to_json", [](const Plan& plan) { return to_json(plan); },
          "The plan as JSON text, as it stands in a problem file.")
      .def_static("from_json", &plan_from_json, py::arg("text"),
                  "A plan from JSON text. Raises ValueError that names the place and what was expected.")
      .def(py::pickle([](const Plan& plan) { return py::str(to_json(plan)); },
                      [](const py::str& text) { return plan_from_json(text); }));
}

}  // namespace energymargin::binding
