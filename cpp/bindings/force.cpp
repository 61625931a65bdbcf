// The force score for Python.

#include "energymargin/metrics/force.hpp"

#include "bindings.hpp"
#include "given.hpp"

namespace energymargin::binding {
namespace {

ForceScore score_force(const Problem& problem, const Keywords& keywords) {
  std::optional<ForceWeights> weights;
  keywords("weights", weights).end();
  if (!weights) return force_score(problem);
  Problem weighted = problem;
  weighted.force_weights = *weights;
  return force_score(weighted);
}

}  // namespace

void bind_force(py::module_& module) {
  py::class_<ContactMargins>(module, "ContactMargins", "What the object's contacts with one kind of body can bear.")
      .def_readonly("engage", &ContactMargins::engage, "Sum of the normal forces [N].")
      .def_readonly("stick", &ContactMargins::stick, "Sum of the distances to the friction cones' edges [N].");
  py::class_<ForceScore> type(module, "ForceScore", "The wrench-based baseline, Section V-B.");
  type.def_readonly("force", &ForceScore::force, "Omega_force, the weighted sum.")
      .def_readonly("effector", &ForceScore::effector, "Of the contacts with all bodies of the effector.")
      .def_readonly("ground", &ForceScore::ground, "Of the contacts with all other bodies.")
      .def_readonly("distance", &ForceScore::distance, "Least distance between object and effector [m].");
  def_repr(type, "ForceScore", {"force"});
  def_metric(module, "force_score", &score_force);
}

}  // namespace energymargin::binding
