// The baselines for Python: escape energy and force score.

#include "energymargin/metrics/escape_energy.hpp"
#include "energymargin/metrics/force.hpp"
#include "long_call.hpp"
#include "metrics/words.hpp"
#include "problem/records.hpp"

namespace energymargin::binding {
namespace {

EscapeEnergy score_escape_energy(const Problem& problem, const Keywords& keywords) {
  LongCall call(keywords);
  EscapeEnergyOptions options;
  std::optional<std::string> object;
  keywords("planner", options.planner)("samples", options.samples)("seed", options.seed)("reach", options.reach)(
      "object", object)
      .end();
  options.object = object.value_or("");
  return call.run([&](const Limit& limit) {
    options.limit = limit;
    return escape_energy(problem, options);
  });
}

std::optional<int> barrier_of(const EscapeEnergy& escape) {
  return escape.barrier < 0 ? std::nullopt : std::make_optional(escape.barrier);
}

ForceScore score_force(const Problem& problem, const Keywords& keywords) {
  std::optional<ForceWeights> weights;
  keywords("weights", weights).end();
  if (!weights) return force_score(problem);
  Problem weighted = problem;
  weighted.force_weights = *weights;
  return force_score(weighted);
}

}  // namespace

void bind_baselines(py::module_& module) {
  py::class_<EscapeEnergy> type(module, "EscapeEnergy", "Escape energy, Definitions 1 and 2.");
  type.def_readonly("energy", &EscapeEnergy::energy, "Lowest barrier [J]; inf without an escape, as from a cage.")
      .def_readonly("history", &EscapeEnergy::history, "(samples so far, best energy) at each improvement.")
      .def_readonly("path", &EscapeEnergy::path,
                    "States of the scene, at rest, from the start to the first one outside, shape (P, n); P is 0 "
                    "without an escape.")
      .def_property_readonly("barrier", &barrier_of, "Row of the path's highest energy; None without an escape.")
      .def_readonly("samples", &EscapeEnergy::samples, "Poses drawn.")
      .def_readonly("complete", &EscapeEnergy::complete,
                    "Whether all poses are drawn, or no barrier can be lower. False if the timeout or the cancel came "
                    "first.");
  def_repr(type, "EscapeEnergy", {"energy", "samples", "complete"});
  def_metric(module, "escape_energy", &score_escape_energy);

  py::class_<ContactMargins>(module, "ContactMargins", "What the object's contacts with one kind of body can bear.")
      .def_readonly("engage", &ContactMargins::engage, "Sum of the normal forces [N].")
      .def_readonly("stick", &ContactMargins::stick, "Sum of the distances to the friction cones' edges [N].");
  py::class_<ForceScore> force(module, "ForceScore", "The wrench-based baseline, Section V-B.");
  force.def_readonly("force", &ForceScore::force, "Omega_force, the weighted sum.")
      .def_readonly("effector", &ForceScore::effector, "Of the contacts with all bodies of the effector.")
      .def_readonly("ground", &ForceScore::ground, "Of the contacts with all other bodies.")
      .def_readonly("distance", &ForceScore::distance, "Least distance between object and effector [m].");
  def_repr(force, "ForceScore", {"force"});
  def_metric(module, "force_score", &score_force);
}

}  // namespace energymargin::binding
