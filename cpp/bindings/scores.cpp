// The metrics and the batch for Python. The GIL is released around every search, and Ctrl-C ends it.

#include "convert.hpp"
#include "described.hpp"
#include "energymargin/batch.hpp"
#include "energymargin/metrics/capture.hpp"
#include "energymargin/metrics/effort.hpp"
#include "energymargin/metrics/escape_energy.hpp"
#include "energymargin/metrics/force.hpp"
#include "energymargin/metrics/guards.hpp"
#include "energymargin/metrics/interval.hpp"
#include "energymargin/random.hpp"
#include "interrupt.hpp"
#include "warnings.hpp"

namespace energymargin::binding {
namespace {

CaptureScore capture(const Problem& problem, const WholeNumber& nodes, const WholeNumber& seed_given,
                     const std::optional<Number>& rate, const std::optional<WholeNumber>& trees,
                     const WholeNumber& threads, const WholeNumber& nodes_per_edge, const Number& least_likelihood,
                     const std::optional<Number>& tolerance, const TimeoutArgument& timeout,
                     const CancelArgument& cancel, const ProgressArgument& progress_call, bool warns) {
  const Limit given = limit_of(timeout, cancel);
  Progress progress(progress_call);
  CaptureOptions options;
  options.made = progress.made();
  options.nodes = count("nodes", nodes);
  options.seed = seed("seed", seed_given);
  options.rate = real("rate", rate);
  if (trees) options.trees = count("trees", *trees);
  options.threads = count("threads", threads);
  options.nodes_per_edge = count("nodes_per_edge", nodes_per_edge);
  options.least_likelihood = real("least_likelihood", least_likelihood);
  options.tolerance = real("tolerance", tolerance);
  const CaptureScore score = interruptible(
      given,
      [&](const Limit& limit) {
        options.limit = limit;
        return guarded_capture_score(problem, options);
      },
      &progress);
  if (warns) warn(implausible(score), problem.scene);
  return score;
}

py::typing::Tuple<py::str, py::ellipsis> doubts_of(const CaptureScore& score) {
  py::list texts;
  for (const Doubt& doubt : implausible(score)) texts.append(doubt.text);
  return py::tuple(texts);
}

Captured captured_objects(const std::string& name) {
  if (name == "all") return Captured::all;
  if (name == "any") return Captured::any;
  throw std::invalid_argument("captured is '" + name + "', expected 'all' or 'any'");
}

Sampling sampling_of(const std::string& name) {
  if (name == "uniform") return Sampling::uniform;
  if (name == "mixed") return Sampling::mixed;
  throw std::invalid_argument("sampling is '" + name + "', expected 'mixed' or 'uniform'");
}

Search search_of(const std::string& name) {
  if (name == "published") return Search::published;
  if (name == "improved") return Search::improved;
  throw std::invalid_argument("search is '" + name + "', expected 'improved' or 'published'");
}

Escape effort(const Problem& problem, const std::string& planner, const WholeNumber& nodes,
              const WholeNumber& seed_given, const std::string& captured, const std::string& search,
              const std::optional<std::string>& sampling, std::optional<bool> shorten, bool stop_at_escape,
              const TimeoutArgument& timeout, const CancelArgument& cancel, const ProgressArgument& progress_call) {
  const Limit given = limit_of(timeout, cancel);
  Progress progress(progress_call);
  EffortOptions options;
  options.made = progress.made();
  options.search = search_of(search);
  if (sampling) options.sampling = sampling_of(*sampling);
  options.shorten = shorten;
  options.stop_at_escape = stop_at_escape;
  options.planner = planner;
  options.captured = captured_objects(captured);
  options.nodes = count("nodes", nodes);
  options.seed = seed("seed", seed_given);
  return interruptible(
      given,
      [&](const Limit& limit) {
        options.limit = limit;
        return escape_effort(problem, options);
      },
      &progress);
}

EscapeEnergy energy(const Problem& problem, const std::string& planner, const WholeNumber& samples,
                    const WholeNumber& seed_given, const std::optional<Number>& reach,
                    const std::optional<std::string>& object, const TimeoutArgument& timeout,
                    const CancelArgument& cancel) {
  const Limit given = limit_of(timeout, cancel);
  EscapeEnergyOptions options;
  options.planner = planner;
  options.samples = count("samples", samples);
  options.seed = seed("seed", seed_given);
  options.reach = real("reach", reach);
  options.object = object.value_or("");
  return interruptible(given, [&](const Limit& limit) {
    options.limit = limit;
    return escape_energy(problem, options);
  });
}

void bind_tree(py::module_& module) {
  py::class_<Tree>(module, "Tree", "All rollouts of a search as flat arrays; row 0 is the root.")
      .def_readonly("states", &Tree::states, "Shape (M + 1, n).")
      .def_readonly("costs", &Tree::costs, "Effort from the root, eq. 8, shape (M + 1,) [J].")
      .def_readonly("parents", &Tree::parents, "Row of the parent, -1 for the root, shape (M + 1,).")
      .def_readonly("controls", &Tree::controls,
                    "Wrenches that led to the node, shape (M + 1, 6 k) for k objects [N, N m].")
      .def_readonly("durations", &Tree::durations, "How long it acted, shape (M + 1,) [s].")
      .def_property_readonly("times", &Tree::times, "Since the root, shape (M + 1,) [s].")
      .def(
          "path_to", [](const Tree& tree, const WholeNumber& node) { return tree.path_to(count("node", node, 0)); },
          py::arg("node"), "Rows from the root to a node, both included.")
      .def("__len__", &Tree::size)
      .def("__repr__", [](const Tree& tree) {
        return described("Tree", {{"nodes", py::cast(tree.size() - 1)}, {"dimension", py::cast(tree.states.cols())}});
      });
}

void bind_results(py::module_& module) {
  py::class_<CaptureScore>(module, "CaptureScore", "Capture and success score, Section IV-B and Algorithm 2.")
      .def_readonly("capture", &CaptureScore::capture, "Omega_cap, eq. 5, 0..1; mean over the trees.")
      .def_readonly("success", &CaptureScore::success, "Omega_suc, eq. 6, 0..1; None without a success set.")
      .def_readonly("capture_any", &CaptureScore::capture_any,
                    "Of several objects at least one; None if the problem has no such set.")
      .def_readonly("success_any", &CaptureScore::success_any,
                    "Of several objects at least one; None if the problem has no such set.")
      .def_readonly("capture_any_stderr", &CaptureScore::capture_any_stderr, "Standard error; None for a single tree.")
      .def_readonly("success_any_stderr", &CaptureScore::success_any_stderr, "Standard error; None for a single tree.")
      .def_readonly("capture_stderr", &CaptureScore::capture_stderr, "Standard error; None for a single tree.")
      .def_readonly("success_stderr", &CaptureScore::success_stderr, "Standard error; None for a single tree.")
      .def_readonly("likelihoods", &CaptureScore::likelihoods, "Of the first tree's nodes, eq. 4, shape (M + 1,).")
      .def_property_readonly(
          "tree", [](const CaptureScore& score) -> const Tree& { return score.trees.front(); },
          py::return_value_policy::reference_internal, "The first tree.")
      .def_readonly("trees", &CaptureScore::trees, "All trees that count.")
      .def_readonly("capture_by_tree", &CaptureScore::capture_by_tree, "Of each tree alone, shape (trees,).")
      .def_readonly("success_by_tree", &CaptureScore::success_by_tree,
                    "Of each tree alone, shape (trees,); empty without such a set.")
      .def_readonly("capture_any_by_tree", &CaptureScore::capture_any_by_tree,
                    "Of each tree alone, shape (trees,); empty without such a set.")
      .def_readonly("success_any_by_tree", &CaptureScore::success_any_by_tree,
                    "Of each tree alone, shape (trees,); empty without such a set.")
      .def_readonly("resolution", &CaptureScore::resolution,
                    "Likelihood of a tree's heaviest node, mean over the trees: no score is finer.")
      .def_readonly("undisturbed_exit", &CaptureScore::undisturbed_exit,
                    "When the state leaves the capture set without any disturbance [s], looked at for 1 s where the "
                    "score is above 0.5; None if it stays, or was not looked at.")
      .def_property_readonly("doubts", &doubts_of,
                             "Why the score says less than it seems to, a tuple of sentences: its resolution is above "
                             "0.2, or it is above 0.5 and the state leaves by itself.")
      .def(
          "interval",
          [](const CaptureScore& score, const std::string& which, const Number& confidence) {
            const Interval found = interval(score, which, real("confidence", confidence));
            return std::pair(found.low, found.high);
          },
          py::arg("which") = "capture", py::arg("confidence") = 0.95,
          R"((low, high), where the mean score of ever more such trees lies, with a probability of `confidence`.

which: 'capture', 'success', 'capture_any' or 'success_any'. Student's interval of the trees' scores together with
Wilson's, which holds what a few trees cannot see. Raises ValueError on a single tree.)")
      .def_readonly("complete", &CaptureScore::complete,
                    "Whether all trees are grown or, with a tolerance, as many as it takes: False if the timeout, the "
                    "cancel or the largest number of trees came first.")
      .def_readonly("diverged", &CaptureScore::diverged,
                    "Rollouts that diverged, of all trees: nodes of infinite cost and no likelihood.")
      .def_property_readonly("nodes", &CaptureScore::nodes, "Of each tree, besides its root.")
      .def("__repr__", [](const CaptureScore& score) {
        return described("CaptureScore", {{"capture", py::cast(score.capture)},
                                          {"success", py::cast(score.success)},
                                          {"resolution", py::cast(score.resolution)},
                                          {"undisturbed_exit", py::cast(score.undisturbed_exit)},
                                          {"nodes", py::cast(score.nodes())},
                                          {"complete", py::cast(score.complete)}});
      });
  py::class_<Escape>(module, "EscapeEffort", "Effort of escape, Section IV-A and Algorithm 1.")
      .def_readonly("effort", &Escape::effort, "Omega_esc, eq. 2 [J]; inf if no escape was found.")
      .def_readonly("history", &Escape::history, "(nodes so far, best effort) at each improvement.")
      .def_property_readonly(
          "path",
          [](const Escape& escape) {
            return py::array_t<int>(static_cast<py::ssize_t>(escape.path.size()), escape.path.data());
          },
          "Rows of the tree from the root to the escape; empty if none was found.")
      .def_readonly("tree", &Escape::tree, "All rollouts of the search.")
      .def_readonly("complete", &Escape::complete,
                    "Whether all nodes are grown, or nothing is left to gain: False if the timeout or the cancel came "
                    "first.")
      .def_readonly(
          "discarded", &Escape::discarded,
          "Best escapes that do not count: in a simulation with a quarter of the step, with wrenches up to 1.2 "
          "times as strong, they do not lead out.")
      .def_readonly("diverged", &Escape::diverged, "Rollouts that diverged: nodes of infinite cost.")
      .def_property_readonly(
          "nodes", &Escape::nodes,
          "How many there are besides the root and, with a horizon, the undisturbed future in row 1; so many "
          "nodes give the same bits again.")
      .def("__repr__", [](const Escape& escape) {
        return described("EscapeEffort", {{"effort", py::cast(escape.effort)},
                                          {"nodes", py::cast(escape.nodes())},
                                          {"complete", py::cast(escape.complete)}});
      });
  py::class_<EscapeEnergy>(module, "EscapeEnergy", "Escape energy, Definitions 1 and 2.")
      .def_readonly("energy", &EscapeEnergy::energy, "Lowest barrier found [J]; inf if no way out was, as of a cage.")
      .def_readonly("history", &EscapeEnergy::history, "(samples so far, best energy) at each improvement.")
      .def_readonly("path", &EscapeEnergy::path,
                    "States of the scene, at rest, from the start to the first one outside, shape (P, n); P is 0 if no "
                    "way out was found.")
      .def_property_readonly(
          "barrier",
          [](const EscapeEnergy& escape) {
            return escape.barrier < 0 ? std::nullopt : std::make_optional(escape.barrier);
          },
          "Row of the path's highest energy; None if no way out was found.")
      .def_readonly("samples", &EscapeEnergy::samples, "Poses drawn.")
      .def_readonly("complete", &EscapeEnergy::complete,
                    "Whether all poses are drawn, or nothing is left to gain: False if the timeout or the cancel came "
                    "first.")
      .def("__repr__", [](const EscapeEnergy& escape) {
        return described("EscapeEnergy", {{"energy", py::cast(escape.energy)},
                                          {"samples", py::cast(escape.samples)},
                                          {"complete", py::cast(escape.complete)}});
      });
  py::class_<ContactMargins>(module, "ContactMargins", "What the object's contacts with one kind of body can bear.")
      .def_readonly("engage", &ContactMargins::engage, "Sum of the normal forces [N].")
      .def_readonly("stick", &ContactMargins::stick, "Sum of the distances to the friction cones' edges [N].");
  py::class_<ForceScore>(module, "ForceScore", "The wrench-based baseline, Section V-B.")
      .def_readonly("force", &ForceScore::force, "Omega_force, the weighted sum.")
      .def_readonly("effector", &ForceScore::effector, "Over the contacts with all bodies of the effector.")
      .def_readonly("ground", &ForceScore::ground, "Over the contacts with all other bodies.")
      .def_readonly("distance", &ForceScore::distance, "Least distance between object and effector [m].")
      .def("__repr__",
           [](const ForceScore& score) { return described("ForceScore", {{"force", py::cast(score.force)}}); });
}

// Lets go of the GIL while the threads end: they may wait for it in a predicate.
struct JoinWithoutGil {
  void operator()(Batch* batch) const {
    const py::gil_scoped_release release;
    delete batch;
  }
};
using HeldBatch = std::unique_ptr<Batch, JoinWithoutGil>;

using Pickled = py::typing::Tuple<py::object, py::ellipsis>;

// By metric, times and probabilities.
using Curves = std::map<std::string, std::pair<Eigen::VectorXd, Eigen::VectorXd>>;

Curves curves_of(const ScoreRow& row) {
  Curves curves;
  for (const auto& [metric, curve] : row.curves) curves[metric] = {curve.times, curve.probabilities};
  return curves;
}

Pickled pickled(const ScoreRow& row) {
  return py::make_tuple(row.index, row.scores, row.times, row.seconds, row.error, curves_of(row));
}

ScoreRow unpickled(const Pickled& state) {
  ScoreRow row{state[0].cast<std::size_t>(), state[1].cast<std::map<std::string, double>>(),
               state[2].cast<std::map<std::string, double>>(), state[3].cast<double>(), state[4].cast<std::string>()};
  for (auto& [metric, curve] : state[5].cast<Curves>()) row.curves[metric] = {curve.first, curve.second};
  return row;
}

void bind_batch(py::module_& module) {
  py::class_<ScoreRow>(module, "ScoreRow", "The scores of one problem of a batch.")
      .def_readonly("index", &ScoreRow::index, "The problem's stream index.")
      .def_readonly("scores", &ScoreRow::scores, "By metric.")
      .def_readonly(
          "times", &ScoreRow::times,
          "By metric: time of its search [s]. The metrics of one tree share it, and so do the probabilities: the first "
          "has it, the others none.")
      .def_readonly("seconds", &ScoreRow::seconds, "Time of its searches on their threads, added up [s].")
      .def_property_readonly(
          "error", [](const ScoreRow& row) { return row.error.empty() ? std::nullopt : std::make_optional(row.error); },
          "What went wrong, or None.")
      .def_property_readonly("curves", &curves_of,
                             "By metric, of \"probability\" and \"probability/any\": (times [s], probability of having "
                             "been captured throughout until each), shape (T,) both.")
      .def(py::pickle(&pickled, &unpickled));
  py::class_<Batch, HeldBatch>(module, "ScoreRun",
                               "A running batch on a pool of threads, to which problems can be added.")
      .def(py::init([](const std::vector<std::string>& metrics, int nodes, std::uint64_t seed, int threads,
                       int nodes_per_edge, double least_likelihood, const std::string& search, bool stop_at_escape,
                       int rollouts, double strength, std::optional<int> objects, bool common_random_numbers) {
             BatchOptions options{metrics,        nodes,    nodes_per_edge, least_likelihood, search_of(search),
                                  stop_at_escape, rollouts, seed,           threads};
             options.disturbance = {strength, objects};
             options.common_random_numbers = common_random_numbers;
             return HeldBatch(new Batch(options));
           }),
           py::arg("metrics"), py::arg("nodes"), py::arg("seed"), py::arg("threads"), py::kw_only(),
           py::arg("nodes_per_edge") = 1, py::arg("least_likelihood") = 0.0, py::arg("search") = "improved",
           py::arg("stop_at_escape") = false, py::arg("rollouts") = 30, py::arg("strength") = 1.0,
           py::arg("objects") = py::none(), py::arg("common_random_numbers") = false)
      .def(
          "add",
          [](Batch& batch, const std::vector<Problem>& problems, const std::vector<std::size_t>& indices,
             const std::optional<std::vector<std::string>>& metrics) {
            batch.add(problems, indices, metrics.value_or(std::vector<std::string>{}));
          },
          py::arg("problems"), py::arg("indices"), py::arg("metrics") = py::none(),
          "Puts problems at the end of the queue, with their stream indices; metrics: None takes the run's.")
      .def_property_readonly("pending", &Batch::pending, "Problems that were added and whose rows are not taken yet.")
      .def("take", &Batch::take, py::arg("timeout"), py::call_guard<py::gil_scoped_release>(),
           "Rows finished since the last call; waits up to timeout [s] for the first.")
      .def_property_readonly("finished", &Batch::finished, "No row will come any more, unless problems are added.")
      .def("cancel", &Batch::cancel, py::call_guard<py::gil_scoped_release>(),
           "Stop within one rollout; unfinished problems give no row.");
}

}  // namespace

void bind_scores(py::module_& module) {
  bind_tree(module);
  bind_results(module);
  bind_batch(module);
  module.def(
      "stream",
      [](const WholeNumber& seed_given, const WholeNumber& number) {
        return stream(seed("seed", seed_given), seed("number", number));
      },
      py::arg("seed"), py::arg("number"), "The seed of one of a seed's own streams.");
  module.attr("FEWEST_TREES") = fewest_trees;
  module.def(
      "interval",
      [](const ArrayLike& scores, const Number& resolution, const Number& confidence) {
        const Interval found =
            interval(vector("scores", scores, -1), real("resolution", resolution), real("confidence", confidence));
        return std::pair(found.low, found.high);
      },
      py::arg("scores"), py::arg("resolution"), py::arg("confidence") = 0.95,
      "(low, high) of the mean score, from those of two or more trees, shape (trees,): what CaptureScore.interval "
      "does.");
  module.def(
      "capture_score", &capture, py::arg("problem"), py::arg("nodes") = 1000, py::arg("seed") = 0,
      py::arg("rate") = py::none(), py::arg("trees") = py::none(), py::arg("threads") = 1, py::kw_only(),
      py::arg("nodes_per_edge") = 1, py::arg("least_likelihood") = 0.0, py::arg("tolerance") = py::none(),
      py::arg("timeout") = py::none(), py::arg("cancel") = py::none(), py::arg("progress") = py::none(),
      py::arg("warn") = true,
      R"(Likelihood to stay in the capture set and to be in the success set, Algorithm 2, from trees of `nodes` nodes.

nodes_per_edge: up to so many states of a rollout are nodes, its end and evenly spaced ones on its way: so many fewer
rollouts. The tree goes on from the ends alone. least_likelihood: where a rollout's likelihood falls to that share of the
root's, it ends, and nothing goes on from there. rate: lambda [1/J], by default the problem's. trees: by default one; two or more give standard errors. With a tolerance
trees are added until each standard error is at most that, from 8 trees on and up to `trees`, by default 1000. The score
does not depend on the threads.

Ends early after timeout [s], or once cancel is set: the trees that are complete count, up to the first that is not; if
there is none, the first tree as far as it is. `complete` says so. progress(nodes) is called now and then with the nodes
made so far, of all trees, for a bar; what it raises ends the search.

Warns, as PlausibilityWarning and once for a scene, where the score's resolution is above 0.2, and where it is above 0.5
though the state leaves the capture set by itself within 1 s. `doubts` says the same of each score; with
warn=False it alone does.)");
  module.def("escape_effort", &effort, py::arg("problem"), py::arg("planner") = "est", py::arg("nodes") = 1000,
             py::arg("seed") = 0, py::arg("captured") = "all", py::kw_only(), py::arg("search") = "improved",
             py::arg("sampling") = py::none(), py::arg("shorten") = py::none(), py::arg("stop_at_escape") = false,
             py::arg("timeout") = py::none(), py::arg("cancel") = py::none(), py::arg("progress") = py::none(),
             R"(Least effort found that takes the state out of the capture set, Algorithm 1; planner 'est' or 'rrt'.

With several objects, captured='all' asks for the effort until one has left, 'any' until the last one has.

With a horizon or a plan it has to be outside in time, at one of the looks (every `check`), and to stay outside for
`dwell`, or up to the horizon, without a wrench; the effort is that up to its first look outside. The first rollout is the
undisturbed future: what leaves by itself has effort 0, whatever the nodes, and be it through `within` or not. A state
that is outside at the start has effort 0 too. A wrench lasts up to `duration`, a wait as long as it takes.

search: 'improved', or 'published', which is the paper's: em.score takes the same two. They differ in `sampling` and
`shorten`, which are theirs unless given. sampling: how wrenches are drawn, 'uniform' (published; paper, Section V) or
'mixed' (improved): nearly half of them so, the others at their bounds, along one axis, none, or that of the edge before.
shorten: half of the nodes, once there is an escape, go into making it cheaper: edges are dropped, shortened, weakened,
cut in two and merged, each change replayed in the World (improved). stop_at_escape: a rollout ends where it is seen
outside of the capture set, every 4 steps, and not only if it is outside at its end.

Ends early after timeout [s], or once cancel is set, with the tree as far as it is: the bits of a search of so many
nodes. `complete` says so. progress(nodes) is called now and then with the nodes made so far; what it raises ends the
search.)");
  module.def("escape_energy", &energy, py::arg("problem"), py::arg("planner") = "bit*", py::arg("samples") = 2000,
             py::arg("seed") = 0, py::arg("reach") = py::none(), py::arg("object") = py::none(), py::kw_only(),
             py::arg("timeout") = py::none(), py::arg("cancel") = py::none(),
             R"(Least potential energy above that of the start over which the object gets out of the capture set.

It is moved slowly, without friction, and all else stays where it is; planner 'bit*' or 'rrt*'. reach: half the edge of
the box around the start to search in [m], by default found. object: which one, of several.

Ends early after timeout [s], or once cancel is set, with the lowest barrier so far. `complete` says so.)");
  module.def(
      "force_score",
      [](const Problem& problem, const std::optional<ForceWeights>& weights) {
        if (!weights) return force_score(problem);
        Problem weighted = problem;
        weighted.force_weights = *weights;
        return force_score(weighted);
      },
      py::arg("problem"), py::arg("weights") = py::none(),
      "The wrench-based baseline: the weighted sum of engaging score, sticking score and, taken off, distance. "
      "weights: by default the problem's.");
}

}  // namespace energymargin::binding
