// Models of random disturbances for Python.

#include "energymargin/disturbances.hpp"

#include "bindings.hpp"
#include "problem/records.hpp"
#include "records.hpp"

namespace energymargin::binding {
namespace {

using namespace disturbances;

template <typename Struct>
std::vector<const char*> names_of() {
  std::vector<const char*> names;
  visit_fields<Struct>([&](const auto& field) { names.push_back(field.name); });
  return names;
}

template <typename Model>
void bind_model(py::module_& module, const char* name, const Signature& signature) {
  py::class_<Model> type = bind_record<Model>(module, name, Record<Model>::description, signature);
  def_repr(type, name, names_of<Model>());
}

}  // namespace

void bind_disturbances(py::module_& module) {
  py::module_ models = module.def_submodule("disturbances", "What may act on the objects at random.");
  bind_model<Uniform>(models, "Uniform", {99, {"strength", "objects", "hold"}});
  bind_model<Gaussian>(models, "Gaussian", {99, {"torque", "correlation_time"}});
  bind_model<Boltzmann>(models, "Boltzmann", {99, {"strength", "objects", "hold"}});
  py::class_<ActuationNoise> noise(models, "ActuationNoise", Record<ActuationNoise>::description);
  def_fields(noise, Record<ActuationNoise>::fields());
  def_repr(noise, "of_plan", names_of<ActuationNoise>());
  const std::string doc =
      "Noise of the robot: a uniform draw is added to the wrenches on each body that the plan pushes "
      "or drives, and one to each joint's target.\n\n" +
      fields_doc(Record<ActuationNoise>::fields());
  with_fields(
      Record<ActuationNoise>::fields(), {99, {"force", "torque", "targets", "hold"}}, &unchanged<ActuationNoise>,
      [&](const auto& of_plan, const auto&... keywords) { models.def("of_plan", of_plan, keywords..., doc.c_str()); });
}

}  // namespace energymargin::binding
