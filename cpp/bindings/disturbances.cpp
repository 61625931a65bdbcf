// Models of random disturbances for Python.

#include "energymargin/disturbances.hpp"

#include "bindings.hpp"
#include "keywords.hpp"
#include "repr.hpp"

namespace energymargin::binding {
namespace {

using namespace disturbances;

constexpr const char* strength_doc = "Share of the problem's bounds.";
constexpr const char* objects_doc = "How many objects a piece acts on; None: all.";
constexpr const char* hold_doc = "Longest piece [s]; None: the problem's duration.";

void bind_uniform(py::module_& module) {
  py::class_<Uniform> type(
      module, "Uniform",
      "Piecewise constant. Each piece is uniform within strength times the problem's bounds, along "
      "and about each axis, and lasts for a uniform time.");
  def_members_constructor(type,
                          "strength: share of the bounds. objects: how many of several objects each piece acts on, "
                          "drawn for each piece; by "
                          "default all. hold: the longest piece [s]; by default the problem's duration.",
                          std::tuple{keyword("strength", &Uniform::strength), keyword("objects", &Uniform::objects),
                                     keyword("hold", &Uniform::hold)});
  type.def_readonly("strength", &Uniform::strength, strength_doc)
      .def_readonly("objects", &Uniform::objects, objects_doc)
      .def_readonly("hold", &Uniform::hold, hold_doc);
  def_repr(type, "Uniform", {"strength", "objects", "hold"});
}

void bind_gaussian(py::module_& module) {
  py::class_<Gaussian> type(module, "Gaussian",
                            "Normal in each step, on the axes whose bounds are not 0. The correlation decays as "
                            "exp(-t / correlation_time).");
  def_members_constructor(type, "force [N], torque [N m]: standard deviations. correlation_time [s].",
                          std::tuple{required("force", &Gaussian::force), keyword("torque", &Gaussian::torque),
                                     keyword("correlation_time", &Gaussian::correlation_time)});
  type.def_readonly("force", &Gaussian::force, "Standard deviation along each axis [N].")
      .def_readonly("torque", &Gaussian::torque, "Standard deviation about each axis [N m].")
      .def_readonly("correlation_time", &Gaussian::correlation_time, "Time constant of the correlation [s].");
  def_repr(type, "Gaussian", {"force", "torque", "correlation_time"});
}

struct BoltzmannArguments : Uniform {
  double rate = 0.0;
};

void bind_boltzmann(py::module_& module) {
  py::class_<Boltzmann> type(
      module, "Boltzmann",
      "Uniform, with each rollout weighted by exp(-rate * effort): more work is less likely (eq. "
      "4). All rollouts run to the horizon.");
  def_constructor<BoltzmannArguments>(
      type, [](const BoltzmannArguments& arguments) { return Boltzmann{arguments.rate, arguments}; },
      "rate: lambda [1/J]. The others are those of Uniform.",
      std::tuple{required("rate", &BoltzmannArguments::rate), keyword("strength", &Uniform::strength),
                 keyword("objects", &Uniform::objects), keyword("hold", &Uniform::hold)},
      std::tuple{});
  type.def_readonly("rate", &Boltzmann::rate, "lambda [1/J].")
      .def_property_readonly(
          "strength", [](const Boltzmann& model) { return model.proposal.strength; }, strength_doc)
      .def_property_readonly(
          "objects", [](const Boltzmann& model) { return model.proposal.objects; }, objects_doc)
      .def_property_readonly("hold", [](const Boltzmann& model) { return model.proposal.hold; }, hold_doc);
  def_repr(type, "Boltzmann", {"rate", "strength", "objects", "hold"});
}

ActuationNoise of_plan(const ArrayLike& force, const ArrayLike& torque, const Number& targets,
                       const std::optional<Number>& hold) {
  return {vector3("force", force), vector3("torque", torque), real("targets", targets), real("hold", hold)};
}

void bind_of_plan(py::module_& module) {
  py::class_<ActuationNoise> type(module, "ActuationNoise", "Noise of the robot: a uniform draw is added to its plan.");
  type.def_readonly("force", &ActuationNoise::force, "Largest along each axis, shape (3,) [N].")
      .def_readonly("torque", &ActuationNoise::torque, "Largest about each axis, shape (3,) [N m].")
      .def_readonly("targets", &ActuationNoise::targets, "Largest error of each joint's target [rad] or [m].")
      .def_readonly("hold", &ActuationNoise::hold, "How long a draw lasts [s]; None: a step.");
  def_repr(type, "of_plan", {"force", "torque", "targets", "hold"});
  const py::tuple zero = py::make_tuple(0.0, 0.0, 0.0);
  module.def(
      "of_plan", &of_plan, py::arg("force") = zero, py::arg("torque") = zero, py::arg("targets") = 0.0,
      py::arg("hold") = py::none(),
      "Noise of the robot. A uniform draw within force (3,) [N] and torque (3,) [N m] is added to the wrenches on "
      "each body that the plan pushes or drives, and one within targets [rad] or [m] to each joint's target. Each "
      "draw lasts for hold [s], by default a step.");
}

}  // namespace

void bind_disturbances(py::module_& module) {
  py::module_ models = module.def_submodule("disturbances", "What may act on the objects at random.");
  bind_uniform(models);
  bind_gaussian(models);
  bind_boltzmann(models);
  bind_of_plan(models);
}

}  // namespace energymargin::binding
