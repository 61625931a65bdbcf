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
#include "search/words.hpp"
#include "warnings.hpp"

namespace energymargin::binding {
namespace {

constexpr const char* effort_doc =
    R"(The least effort of an escape from the capture set, Algorithm 1: an upper bound that falls with the nodes.

Args:
    problem: the question.
    planner: 'est' or 'rrt', the x of AO-x.
    nodes: of the search tree, besides its root.
    seed: the same seed gives the same bits.
    captured: of several objects, 'all' asks for the effort until one has left, 'any' until the last one has.
    search: 'improved', or 'published', which is the paper's. It chooses `sampling` and `shorten` unless they are given.
        By default a problem with a horizon or a plan has the improved one, and one without has the published one: since
        a wait of any length is free there, the cheapest escapes of two states hardly differ.
    sampling: of wrenches. 'uniform' (published; paper, Section V), or 'mixed' (improved): nearly half of them uniform,
        the others at their bounds, along one axis, zero, or that of the edge before.
    shorten: spend nine of ten nodes, once there is an escape, on making it cheaper: edges are dropped, shortened,
        weakened, cut in two and merged, and each change is simulated (improved).
    stop_at_escape: end a rollout where a look every 4 steps sees it outside of the capture set, and not only at its end.
    lower_bound: after the search, bound the effort from below too, as `effort_lower_bound` does. It has the time that the
        search leaves.
    bound_cells: of poses of each object that the lower bound looks at.
    bound_tolerance: the lower bound is done once its barrier is known to this share.
    timeout: the search ends after so many seconds.
    cancel: the search ends once it is set.
    progress: progress(nodes) is called now and then with the nodes so far. An exception of it ends the search.
    warn: whether the effort's warnings are issued.

With a horizon or a plan an escape has to be outside in time, at one of the looks (every `check`), and to stay outside for
`dwell`, or up to the horizon, without a wrench. Its effort is that up to its first look outside. The first rollout is the
undisturbed future: an object that leaves without a disturbance has effort 0, for any number of nodes and through `within`
or not. So has a state that is outside at the start. A wrench lasts up to `duration`, a wait as long as it takes.

After a timeout or a cancel the tree has the bits of a search of as many nodes, and `complete` is False.

Warns, as PlausibilityWarning and once for each scene, if a cheaper escape was discarded; if the effort is above 0 although
the state leaves the capture set without a disturbance, which is looked for within 1 s if there is no horizon; and if more
than 1 % of the steps did not converge, or of the time is lost. `warnings` of the result has the same texts. Raises
ValueError on a bad problem or argument.)";

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
      module, "escape_effort", &score_effort, effort_doc,
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
