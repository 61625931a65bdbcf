// Effort of escape and its lower bound, and the baselines, escape energy and force score, for Python.

#include "energymargin/metrics/effort.hpp"

#include "energymargin/metrics/escape_energy.hpp"
#include "energymargin/metrics/force.hpp"
#include "energymargin/metrics/guards.hpp"
#include "energymargin/metrics/lower_bound.hpp"
#include "long_call.hpp"
#include "metrics/words.hpp"
#include "problem/records.hpp"

namespace energymargin::binding {
namespace {

LowerBound bound_effort(const Problem& problem, const Keywords& keywords) {
  LongCall call(keywords);
  LowerBoundOptions options;
  keywords("cells", options.cells)("tolerance", options.tolerance)("captured", options.captured).end();
  return call.run(&effort_lower_bound, problem, options);
}

void bind_lower_bound(py::module_& module) {
  py::class_<LowerBound> type(module, "LowerBound", "A lower bound of the effort of escape.");
  type.def_readonly("value", &LowerBound::effort, "As `effort`.");
  type.def_readonly("effort", &LowerBound::effort, "No escape takes less [J]; inf: there is none, a cage.")
      .def_property_readonly("cage", &LowerBound::cage, "Whether it is proved that there is no escape.")
      .def_readonly("barrier", &LowerBound::barrier, "Least rise of the object's energy on any way out, or less [J].")
      .def_readonly("kinetic", &LowerBound::kinetic, "Kinetic energy of all bodies at the start [J].")
      .def_readonly("stored", &LowerBound::stored,
                    "Energy that other bodies, springs and joints can release [J]; inf: there is no end of it.")
      .def_readonly("cells", &LowerBound::cells, "Cells of poses that were looked at.")
      .def_readonly("complete", &LowerBound::complete,
                    "Whether the barrier is known to the tolerance, or it is a cage. False: the cells, the timeout or "
                    "the cancel came first, and more cells may give a higher bound.")
      .def_readonly("reason", &LowerBound::reason,
                    "Why the effort is bounded by 0 alone; empty if it is bounded by more.");
  def_repr(type, "LowerBound", {"effort", "barrier", "kinetic", "stored", "cells", "complete", "reason"});
  def_metric(module, "effort_lower_bound", &bound_effort);
}

struct BoundedEscape : Escape {
  std::optional<LowerBound> bound{};
};

BoundedEscape score_effort(const Problem& problem, const Keywords& keywords) {
  LongCall call(keywords);
  EffortOptions options;
  LowerBoundOptions bound;
  bool warns = true;
  bool bounded = false;
  keywords("planner", options.planner)("nodes", options.nodes)("searches", options.searches)(
      "threads", options.threads)("nodes_per_round", options.nodes_per_round)("seed", options.seed)(
      "captured", options.captured)("search", options.search)("sampling", options.sampling)("shorten", options.shorten)(
      "stop_at_escape", options.stop_at_escape)("lower_bound", bounded)("bound_cells", bound.cells)(
      "bound_tolerance", bound.tolerance)("warn", warns)
      .end();
  bound.captured = options.captured;
  if (bounded) validate(bound);
  options.check_undisturbed = true;
  options.node_counter = call.counter();
  BoundedEscape result{call.run(&escape_effort, problem, options)};
  if (warns) warn(result.warnings, problem.scene);
  if (bounded) result.bound = call.run(&effort_lower_bound, problem, bound);
  return result;
}

EscapeEnergy score_escape_energy(const Problem& problem, const Keywords& keywords) {
  LongCall call(keywords);
  EscapeEnergyOptions options;
  std::optional<std::string> object;
  keywords("planner", options.planner)("samples", options.samples)("seed", options.seed)("reach", options.reach)(
      "object", object)
      .end();
  options.object = object.value_or("");
  return call.run(&escape_energy, problem, options);
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

void bind_effort(py::module_& module) {
  bind_lower_bound(module);
  py::class_<BoundedEscape> type(module, "EscapeEffort", "Effort of escape, Section IV-A and Algorithm 1.");
  type.def_readonly("value", &Escape::effort, "As `effort`.");
  type.def_readonly("effort", &Escape::effort, "Omega_esc, eq. 2 [J]; inf without an escape.")
      .def_readonly("history", &Escape::history, "(nodes so far, best effort) at each improvement.")
      .def_property_readonly(
          "path", [](const BoundedEscape& of) { return py::array_t<int>(py::ssize_t(of.path.size()), of.path.data()); },
          "Rows of the tree from the root to the escape; empty without an escape.")
      .def_readonly("tree", &Escape::tree, "All rollouts of the search.")
      .def_readonly("complete", &Escape::complete,
                    "Whether the search used all nodes, or no escape can be cheaper. False if the timeout or the "
                    "cancel came first.")
      .def_readonly("discarded", &Escape::discarded,
                    "Best escapes that do not count: in a simulation with a quarter of the step, with wrenches up to "
                    "1.2 times as strong, they do not lead out.")
      .def_readonly("discarded_effort", &Escape::discarded_effort, "Least effort of these [J]; inf if there is none.")
      .def_readonly("undisturbed_exit", &Escape::undisturbed_exit,
                    "When the state leaves the capture set without a disturbance [s], as the search sees it; without a "
                    "horizon also as 1 s of simulation does, if the effort is above 0. None if it stays.")
      .def_readonly("diverged", &Escape::diverged, "Rollouts that diverged: nodes of infinite cost.")
      .def_property_readonly("nodes", &Escape::nodes,
                             "Nodes besides the root and, with a horizon, the undisturbed future in row 1. A search of "
                             "so many nodes gives the same bits. Of several searches those of the best one.")
      .def_property_readonly(
          "lower_bound",
          [](const BoundedEscape& of) { return of.bound ? std::optional(of.bound->effort) : std::nullopt; },
          "No escape takes less [J]; None unless it was asked for.")
      .def_property_readonly(
          "proved_cage", [](const BoundedEscape& escape) { return escape.bound && escape.bound->cage(); },
          "Whether the lower bound proves that there is no escape.")
      .def_readonly("bound", &BoundedEscape::bound, "How the lower bound came about; None unless it was asked for.");
  def_quality(
      type, "a cheaper escape was discarded; the effort is above 0 although the state leaves without a disturbance; ");
  def_repr(type, "EscapeEffort", {"effort", "nodes", "steps", "unconverged", "lost_time", "complete"});
  def_metric(module, "escape_effort", &score_effort);
}

void bind_baselines(py::module_& module) {
  py::class_<EscapeEnergy> type(module, "EscapeEnergy", "Escape energy, Definitions 1 and 2.");
  type.def_readonly("value", &EscapeEnergy::energy, "As `energy`.");
  type.def_readonly("energy", &EscapeEnergy::energy, "Lowest barrier [J]; inf without an escape, as from a cage.")
      .def_readonly("history", &EscapeEnergy::history, "(samples so far, best energy) at each improvement.")
      .def_readonly("path", &EscapeEnergy::path,
                    "States of the scene, at rest, from the start to the first one outside, shape (P, n); P is 0 "
                    "without an escape.")
      .def_property_readonly(
          "barrier", [](const EscapeEnergy& of) { return of.barrier < 0 ? std::nullopt : std::optional(of.barrier); },
          "Row of the path's highest energy; None without an escape.")
      .def_readonly("samples", &EscapeEnergy::samples, "Poses drawn.")
      .def_readonly(
          "complete", &EscapeEnergy::complete,
          "Whether all poses are drawn, or no barrier can be lower. False if the timeout or the cancel came first.");
  def_repr(type, "EscapeEnergy", {"energy", "samples", "complete"});
  def_metric(module, "escape_energy", &score_escape_energy);

  py::class_<ContactMargins>(module, "ContactMargins", "What the object's contacts with one kind of body can bear.")
      .def_readonly("engage", &ContactMargins::engage, "Sum of the normal forces [N].")
      .def_readonly("stick", &ContactMargins::stick, "Sum of the distances to the friction cones' edges [N].");
  py::class_<ForceScore> force(module, "ForceScore", "The wrench-based baseline, Section V-B.");
  force.def_readonly("value", &ForceScore::force, "As `force`.");
  force.def_readonly("force", &ForceScore::force, "Omega_force, the weighted sum.")
      .def_readonly("effector", &ForceScore::effector, "Of the contacts with all bodies of the effector.")
      .def_readonly("ground", &ForceScore::ground, "Of the contacts with all other bodies.")
      .def_readonly("distance", &ForceScore::distance, "Least distance between object and effector [m].");
  def_repr(force, "ForceScore", {"force"});
  def_metric(module, "force_score", &score_force);
}

}  // namespace energymargin::binding
