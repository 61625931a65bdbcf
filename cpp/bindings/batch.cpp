// Batches for Python. A batch runs without the GIL.

#include "energymargin/batch.hpp"

#include "energymargin/metrics/guards.hpp"
#include "energymargin/random.hpp"
#include "given.hpp"
#include "metrics/words.hpp"
#include "problem/records.hpp"

namespace energymargin::binding {
namespace {

// Releases the GIL while the threads end: they may wait for it in a predicate.
struct JoinWithoutGil {
  void operator()(Batch* batch) const {
    const WithoutGil release;
    delete batch;
  }
};
using BatchHolder = std::unique_ptr<Batch, JoinWithoutGil>;

// Times and probabilities by metric.
using Curves = std::map<std::string, std::pair<Eigen::VectorXd, Eigen::VectorXd>>;

Curves curves_of(const ScoreRow& row) {
  Curves curves;
  for (const auto& [metric, curve] : row.curves) curves[metric] = {curve.times, curve.probabilities};
  return curves;
}

using WarningPairs = std::vector<std::pair<std::string, std::string>>;

WarningPairs pairs_of(const std::vector<Warning>& warnings) {
  WarningPairs pairs;
  for (const Warning& warning : warnings) pairs.emplace_back(warning.about, warning.text);
  return pairs;
}

using Pickle = py::typing::Tuple<py::object, py::ellipsis>;

Pickle pickle(const ScoreRow& row) {
  return py::make_tuple(row.index, row.scores, row.times, row.seconds, row.error, curves_of(row), row.steps,
                        row.unconverged, row.lost_time, pairs_of(row.warnings), row.diverged);
}

ScoreRow unpickle(const Pickle& state) {
  ScoreRow row;
  row.index = state[0].cast<std::size_t>();
  row.scores = state[1].cast<std::map<std::string, double>>();
  row.times = state[2].cast<std::map<std::string, double>>();
  row.seconds = state[3].cast<double>();
  row.error = state[4].cast<std::string>();
  for (auto& [metric, curve] : state[5].cast<Curves>()) row.curves[metric] = {curve.first, curve.second};
  row.steps = state[6].cast<long long>();
  row.unconverged = state[7].cast<long long>();
  row.lost_time = state[8].cast<double>();
  for (auto& [about, text] : state[9].cast<WarningPairs>()) row.warnings.push_back({about, text});
  row.diverged = state[10].cast<int>();
  return row;
}

void bind_row(py::module_& module) {
  py::class_<ScoreRow> type(module, "ScoreRow", "The scores of one problem of a batch.");
  type.def_readonly("index", &ScoreRow::index, "The problem's stream index.")
      .def_readonly("scores", &ScoreRow::scores, "By metric.")
      .def_readonly("times", &ScoreRow::times,
                    "Time of a search [s], by its first metric. The metrics of one tree share a search, and so do the "
                    "probabilities.")
      .def_readonly("seconds", &ScoreRow::seconds, "Sum of the times of its searches [s].")
      .def_property_readonly(
          "error", [](const ScoreRow& row) { return row.error.empty() ? std::nullopt : std::optional(row.error); },
          "The error of the first search that failed, or None.")
      .def_property_readonly("curves", &curves_of,
                             "(times [s], probability of being captured throughout until each), shape (T,) both, of "
                             "\"probability\" and \"probability/any\".")
      .def_readonly("diverged", &ScoreRow::diverged, "Rollouts of its searches that diverged.")
      .def(py::pickle(&pickle, &unpickle));
  def_quality(type, "those of each score; ");
}

BatchHolder make_batch(const std::vector<std::string>& metrics, const Given<int>& nodes,
                       const Given<std::uint64_t>& seed, const Given<int>& threads, const KeywordArguments& others) {
  BatchOptions options;
  options.metrics = metrics;
  options.nodes = given("nodes", nodes);
  options.seed = given("seed", seed);
  options.threads = given("threads", threads);
  Keywords{others}("nodes_per_edge", options.nodes_per_edge)("least_likelihood", options.least_likelihood)(
      "stop_at_escape", options.stop_at_escape)("rollouts", options.rollouts)("most_diverged", options.most_diverged)(
      "strength", options.disturbance.strength)("objects", options.disturbance.objects)("common_random_numbers",
                                                                                        options.common_random_numbers)
      .end();
  return BatchHolder(new Batch(options));
}

void add_problems(Batch& batch, const std::vector<Problem>& problems, const std::vector<std::size_t>& indices,
                  const std::optional<std::vector<std::string>>& metrics) {
  batch.add(problems, indices, metrics.value_or(std::vector<std::string>{}));
}

void warn_of_steps(long long steps, long long unconverged, double lost_time, const Scene& scene) {
  StepCounts counts;
  counts.steps = steps;
  counts.unconverged = unconverged;
  counts.lost_time = lost_time;
  warn(implausible(counts, static_cast<double>(steps) * scene.stepping().step), scene);
}

}  // namespace

void bind_batch(py::module_& module) {
  bind_row(module);
  py::class_<Batch, BatchHolder> type(module, "ScoreRun",
                                      "A running batch on a pool of threads. Problems can be added to it.");
  type.def(py::init(&make_batch), py::arg("metrics"), py::arg("nodes"), py::arg("seed"), py::arg("threads"),
           "Starts without problems.")
      .def("add", &add_problems, py::arg("problems"), py::arg("indices"), py::arg("metrics") = py::none(),
           "Puts problems at the end of the queue, with their stream indices. metrics: None takes the run's.")
      .def_property_readonly("pending", &Batch::pending, "Problems that were added and whose rows are not taken yet.")
      .def("take", &Batch::take, py::arg("timeout"), py::call_guard<WithoutGil>(),
           "Rows that are complete since the last call. Waits up to timeout [s] for the first.")
      .def_property_readonly("finished", &Batch::finished, "Whether no row will come unless problems are added.")
      .def("cancel", &Batch::cancel, py::call_guard<WithoutGil>(),
           "Stops within one rollout. Problems that are not complete give no row.");
  module.def("warn_of_steps", &warn_of_steps, py::arg("steps"), py::arg("unconverged"), py::arg("lost_time"),
             py::arg("scene"),
             "Warns if too many steps of a scene did not converge, or too much of their time is lost.");
  using Number = Given<std::uint64_t>;
  const auto stream_of = [](const Number& a, const Number& b) { return stream(given("seed", a), given("number", b)); };
  module.def("stream", stream_of, py::arg("seed"), py::arg("number"), "The seed of one of a seed's own streams.");
}

}  // namespace energymargin::binding
