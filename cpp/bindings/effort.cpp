// Effort of escape for Python.

#include "energymargin/metrics/effort.hpp"

#include "bindings.hpp"
#include "energymargin/metrics/guards.hpp"
#include "energymargin/metrics/lower_bound.hpp"
#include "interrupt.hpp"
#include "lower_bound.hpp"
#include "metrics/words.hpp"
#include "problem/words.hpp"
#include "repr.hpp"
#include "warnings.hpp"

namespace energymargin::binding {
namespace {

struct EffortCall : EffortOptions, ProgressCall {
  bool warn = true;
  bool lower_bound = false;
  int bound_cells = LowerBoundOptions{}.cells;
  double bound_tolerance = LowerBoundOptions{}.tolerance;

  LowerBoundOptions bound_options() const { return {bound_cells, bound_tolerance, captured, {}}; }
};

struct BoundedEscape : Escape {
  std::optional<LowerBound> bound{};
};

BoundedEscape score_effort(const Problem& problem, const EffortCall& call) {
  const Limit limit = call.call_limit();
  if (call.lower_bound) validate(call.bound_options());
  BoundedEscape result{run_with_progress(&guarded_escape_effort, problem, EffortOptions(call),
                                         &EffortOptions::node_counter, call, limit)};
  if (call.warn) warn(result.warnings, problem.scene);
  if (!call.lower_bound) return result;
  result.bound = run_interruptible(limit, [&](const Limit& until) {
    LowerBoundOptions options = call.bound_options();
    options.limit = until;
    return effort_lower_bound(problem, options);
  });
  return result;
}

std::optional<double> bound_of(const BoundedEscape& escape) {
  return escape.bound ? std::make_optional(escape.bound->effort) : std::nullopt;
}

py::array_t<int> path_of(const BoundedEscape& escape) {
  return py::array_t<int>(static_cast<py::ssize_t>(escape.path.size()), escape.path.data());
}

}  // namespace

void bind_effort(py::module_& module) {
  bind_lower_bound(module);
  py::class_<BoundedEscape> type(module, "EscapeEffort", "Effort of escape, Section IV-A and Algorithm 1.");
  type.def_readonly("effort", &Escape::effort, "Omega_esc, eq. 2 [J]; inf without an escape.")
      .def_readonly("history", &Escape::history, "(nodes so far, best effort) at each improvement.")
      .def_property_readonly("path", &path_of, "Rows of the tree from the root to the escape; empty without an escape.")
      .def_readonly("tree", &Escape::tree, "All rollouts of the search.")
      .def_readonly(
          "complete", &Escape::complete,
          "Whether the search used all nodes, or no escape can be cheaper. False if the timeout or the cancel "
          "came first.")
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
                             "so many nodes gives the same bits.")
      .def_property_readonly("lower_bound", &bound_of, "No escape takes less [J]; None unless it was asked for.")
      .def_property_readonly(
          "proved_cage", [](const BoundedEscape& escape) { return escape.bound && escape.bound->cage(); },
          "Whether the lower bound proves that there is no escape.")
      .def_readonly("bound", &BoundedEscape::bound, "How the lower bound came about; None unless it was asked for.");
  def_quality(
      type, "a cheaper escape was discarded; the effort is above 0 although the state leaves without a disturbance; ");
  def_repr(type, "EscapeEffort", {"effort", "nodes", "steps", "unconverged", "lost_time", "complete"});
  def_metric(
      module, "escape_effort", &score_effort,
      std::tuple_cat(
          std::tuple{keyword("planner", &EffortCall::planner), keyword("nodes", &EffortCall::nodes),
                     keyword("seed", &EffortCall::seed), keyword("captured", &EffortCall::captured),
                     keyword("search", &EffortCall::search), keyword("sampling", &EffortCall::sampling),
                     keyword("shorten", &EffortCall::shorten), keyword("stop_at_escape", &EffortCall::stop_at_escape),
                     keyword("lower_bound", &EffortCall::lower_bound), keyword("bound_cells", &EffortCall::bound_cells),
                     keyword("bound_tolerance", &EffortCall::bound_tolerance)},
          progress_keywords(), std::tuple{keyword("warn", &EffortCall::warn)}));
}

}  // namespace energymargin::binding
