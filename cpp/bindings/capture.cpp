// Trees, and the capture and success score, for Python.

#include "energymargin/metrics/capture.hpp"

#include "energymargin/metrics/guards.hpp"
#include "long_call.hpp"
#include "metrics/words.hpp"
#include "problem/records.hpp"

namespace energymargin::binding {
namespace {

constexpr const char* interval_doc =
    R"((low, high), a confidence interval for the score of infinitely many trees of this size.

which: 'capture', 'success', 'capture_any' or 'success_any'. The interval holds Student's interval of the trees' scores
and Wilson's, which counts what a few trees cannot see. Raises ValueError on a single tree, or a set that the problem does
not have.)";

CaptureScore score_capture(const Problem& problem, const Keywords& keywords) {
  LongCall call(keywords);
  CaptureOptions options;
  bool warns = true;
  keywords("nodes", options.nodes)("seed", options.seed)("rate", options.rate)("trees", options.trees)(
      "threads", options.threads)("nodes_per_edge", options.nodes_per_edge)("nodes_per_round", options.nodes_per_round)(
      "least_likelihood", options.least_likelihood)("tolerance", options.tolerance)("warn", warns)
      .end();
  options.check_undisturbed = true;
  options.node_counter = call.counter();
  CaptureScore score = call.run(&capture_score, problem, options);
  if (warns) warn(score.warnings, problem.scene);
  return score;
}

Ends interval_of(const CaptureScore& score, const Given<double>& confidence, const std::string& which) {
  return ends(interval(score, which, given("confidence", confidence)));
}

Ends interval_of_scores(const Given<Eigen::VectorXd>& scores, const Given<double>& resolution,
                        const Given<double>& confidence) {
  return ends(interval(given("scores", scores), given("resolution", resolution), given("confidence", confidence)));
}

using CaptureScoreClass = py::class_<CaptureScore>;

const SetScore* address_of(const SetScore& set) { return &set; }
const SetScore* address_of(const std::optional<SetScore>& set) { return set ? &*set : nullptr; }

// The score, its standard error and the scores of the trees of a set, if the problem has it.
template <typename Set>
void def_set_score(CaptureScoreClass& type, const std::string& name, Set CaptureScore::* member, const char* doc) {
  using Mean = std::conditional_t<std::is_same_v<Set, SetScore>, double, std::optional<double>>;
  const auto property = [&](const std::string& of_name, auto get, const std::string& text) {
    type.def_property_readonly(
        of_name.c_str(), [get, member](const CaptureScore& score) { return get(address_of(score.*member)); },
        text.c_str());
  };
  property(name, [](const SetScore* set) { return set ? Mean(set->mean) : Mean(); }, doc);
  property(
      name + "_stderr", [](const SetScore* set) { return set ? set->standard_error : std::nullopt; },
      "Standard error of `" + name + "`; None for a single tree.");
  property(
      name + "_by_tree", [](const SetScore* set) { return set ? set->by_tree : Eigen::VectorXd(); },
      "`" + name + "` of each tree alone, shape (trees,); empty without such a set.");
}

void def_set_scores(CaptureScoreClass& type) {
  def_set_score(type, "capture", &CaptureScore::capture, "Omega_cap, eq. 5, 0..1; mean over the trees.");
  type.def_property_readonly("value", [](const CaptureScore& score) { return score.capture.mean; }, "As `capture`.");
  def_set_score(type, "success", &CaptureScore::success,
                "Omega_suc, eq. 6, 0..1; mean over the trees. None without a success set.");
  def_set_score(type, "capture_any", &CaptureScore::capture_any,
                "The same that at least one of several objects stays; None without such a set.");
  def_set_score(type, "success_any", &CaptureScore::success_any,
                "The same that at least one of several objects succeeds; None without such a set.");
}

void def_trees(CaptureScoreClass& type) {
  type.def_property_readonly(
          "tree", [](const CaptureScore& score) -> const Tree& { return score.trees.front(); },
          py::return_value_policy::reference_internal, "The first tree.")
      .def_readonly("trees", &CaptureScore::trees, "All trees that count.")
      .def_readonly("likelihoods", &CaptureScore::likelihoods, "Of the first tree's nodes, eq. 4, shape (M + 1,).")
      .def_property_readonly("nodes", &CaptureScore::nodes, "Of each tree, besides its root.")
      .def_readonly("diverged", &CaptureScore::diverged,
                    "Rollouts of all trees that diverged: nodes of infinite cost and no likelihood.")
      .def_readonly("complete", &CaptureScore::complete,
                    "Whether no tree is missing and a tolerance is met. False if the timeout, the cancel or the "
                    "largest number of trees came first.");
}

void def_checks(CaptureScoreClass& type) {
  type.def_readonly("resolution", &CaptureScore::resolution,
                    "Likelihood of a tree's heaviest node, mean over the trees: no score is finer.")
      .def_readonly("undisturbed_exit", &CaptureScore::undisturbed_exit,
                    "When the state leaves the capture set without a disturbance [s]. None if it stays for 1 s, or if "
                    "the score is at most 0.5, which needs no such check.")
      .def("interval", &interval_of, py::arg("confidence") = 0.95, py::arg("which") = "capture", interval_doc);
  def_quality(type,
              "its resolution is above 0.2; the score is above 0.5 although the state leaves without a disturbance; ");
}

void bind_tree(py::module_& module) {
  py::class_<Tree>(module, "Tree", "All rollouts of a search as flat arrays; row 0 is the root.")
      .def_readonly("states", &Tree::states, "Shape (M + 1, n).")
      .def_readonly("costs", &Tree::costs, "Effort from the root, eq. 8, shape (M + 1,) [J].")
      .def_readonly("parents", &Tree::parents, "Row of the parent, -1 for the root, shape (M + 1,).")
      .def_readonly("controls", &Tree::controls,
                    "Wrenches that led to the node, shape (M + 1, 6 k) for k objects [N, N m].")
      .def_readonly("durations", &Tree::durations, "How long the wrenches acted, shape (M + 1,) [s].")
      .def_property_readonly("times", &Tree::times, "Since the root, shape (M + 1,) [s].")
      .def(
          "path_to", [](const Tree& tree, const Given<int>& node) { return tree.path_to(count("node", node, 0)); },
          py::arg("node"), "Rows from the root to a node, both included.")
      .def("__len__", &Tree::size)
      .def("__repr__", [](const Tree& tree) {
        return repr_of_fields("Tree",
                              {{"nodes", py::cast(tree.size() - 1)}, {"dimension", py::cast(tree.states.cols())}});
      });
}

}  // namespace

void bind_capture(py::module_& module) {
  bind_tree(module);
  CaptureScoreClass type(module, "CaptureScore", "Capture and success score, Section IV-B and Algorithm 2.");
  def_set_scores(type);
  def_trees(type);
  def_checks(type);
  def_repr(type, "CaptureScore",
           {"capture", "success", "resolution", "undisturbed_exit", "nodes", "steps", "unconverged", "lost_time",
            "complete"});
  def_metric(module, "capture_score", &score_capture);
  module.def("interval", &interval_of_scores, py::arg("scores"), py::arg("resolution"), py::arg("confidence") = 0.95,
             "(low, high), a confidence interval for the score of infinitely many trees, from those of two or more, "
             "shape (trees,). CaptureScore.interval gives the same.");
  module.attr("FEWEST_TREES") = fewest_trees;
}

}  // namespace energymargin::binding
