#include "scores.hpp"

#include <cmath>

#include "energymargin/metrics/capture.hpp"
#include "energymargin/metrics/effort.hpp"
#include "energymargin/metrics/force.hpp"
#include "energymargin/metrics/interval.hpp"

namespace energymargin::app {
namespace {

template <typename Value>
Json optional(const std::optional<Value>& value) {
  return value ? Json(*value) : Json(nullptr);
}

// JSON has no infinity.
Json finite(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json numbers(const Eigen::VectorXd& values) { return std::vector<double>(values.begin(), values.end()); }

Json pair(const Interval& ends) { return {ends.low, ends.high}; }

// The value of each improvement, by the nodes or samples that it took.
Json history(const std::vector<std::pair<int, double>>& improvements, const char* count, const char* value) {
  Json rows = Json::array();
  for (const auto& [number, best] : improvements) rows.push_back({{count, number}, {value, best}});
  return rows;
}

// What a result that is made of rollouts says about its steps.
void add_counts(const StepCounts& counts, Json& json) {
  json["steps"] = counts.steps;
  json["unconverged"] = counts.unconverged;
  json["lost_time"] = counts.lost_time;
}

// Sentences, which the error stream has too.
Score with_warnings(Json json, const std::vector<Warning>& warnings) {
  json["warnings"] = Json::array();
  for (const Warning& warning : warnings) json["warnings"].push_back(warning.text);
  return {json, warnings};
}

Score capture(const Problem& problem, CaptureOptions options) {
  options.check_undisturbed = true;
  const CaptureScore score = capture_score(problem, options);
  Json json;
  for (const auto& [name, set] : set_scores(score)) json[name] = set ? Json(set->mean) : Json(nullptr);
  for (const auto& [name, set] : set_scores(score)) {
    json[std::string(name) + "_stderr"] = set ? optional(set->standard_error) : Json(nullptr);
  }
  for (const auto& [name, set] : set_scores(score)) {
    const bool has_interval = set && score.trees.size() > 1;
    json[std::string(name) + "_interval"] = has_interval ? pair(interval(score, std::string(name))) : Json(nullptr);
  }
  json["resolution"] = score.resolution;
  json["undisturbed_exit"] = optional(score.undisturbed_exit);
  json["trees"] = score.trees.size();
  json["nodes"] = score.nodes();
  json["complete"] = score.complete;
  add_counts(score, json);
  return with_warnings(json, score.warnings);
}

Score effort(const Problem& problem, EffortOptions options) {
  options.check_undisturbed = true;
  const Escape escape = escape_effort(problem, options);
  Json json{{"effort", finite(escape.effort)},
            {"history", history(escape.history, "nodes", "effort")},
            {"nodes", escape.nodes()},
            {"discarded", escape.discarded},
            {"complete", escape.complete}};
  add_counts(escape, json);
  return with_warnings(json, escape.warnings);
}

Score probability(const Problem& problem, ProbabilityOptions options) {
  options.success = problem.succeeded.has_value();
  options.by_object = problem.captured_any.has_value();
  const CaptureProbability p = capture_probability(problem, options);
  Json json{{"captured", p.all.captured()},
            {"interval", pair(interval(p.all.captured(), p.effective, 1.0 - 0.05 / p.looks))},
            {"mean_time", p.all.mean_time},
            {"success", optional(p.success)},
            {"captured_any", p.any ? Json(p.any->captured()) : Json(nullptr)},
            {"undisturbed", p.undisturbed},
            {"undisturbed_time", p.undisturbed_time},
            {"times", numbers(p.times)},
            {"curve", numbers(p.all.curve)},
            {"rollouts", p.rollouts},
            {"diverged", p.diverged},
            {"complete", p.complete}};
  add_counts(p, json);
  return with_warnings(json, p.warnings);
}

Json escape_energy_json(const Problem& problem, const EscapeEnergyOptions& options) {
  const EscapeEnergy escape = escape_energy(problem, options);
  return {{"energy", finite(escape.energy)},
          {"history", history(escape.history, "samples", "energy")},
          {"samples", escape.samples},
          {"complete", escape.complete}};
}

Json margins(const ContactMargins& contacts) { return {{"engage", contacts.engage}, {"stick", contacts.stick}}; }

Json force_json(Problem problem, const std::optional<ForceWeights>& weights) {
  if (weights) problem.force_weights = *weights;
  const ForceScore score = force_score(problem);
  return {{"force", score.force},
          {"effector", margins(score.effector)},
          {"ground", margins(score.ground)},
          {"distance", score.distance}};
}

Json plan(const Plan& plan) {
  Json wrenches = Json::array();
  Json targets = Json::array();
  Json velocities = Json::array();
  for (const Drive& drive : plan.wrenches) wrenches.push_back(drive.body);
  for (const Targets& joint : plan.targets) targets.push_back(joint.joint);
  for (const Servo& servo : plan.velocities) velocities.push_back(servo.body);
  return {{"step", plan.step},
          {"rows", plan.rows()},
          {"wrenches", wrenches},
          {"targets", targets},
          {"velocities", velocities}};
}

// Times [s].
Json clock(const Problem& problem, const Timing& timing) {
  const double step = problem.scene.stepping().step;
  return {{"horizon", timing.horizon * step},
          {"check", timing.check * step},
          {"dwell", timing.dwell * step},
          {"plan", problem.plan ? plan(*problem.plan) : Json(nullptr)}};
}

template <typename Options>
Options with_limit(Options options, const Arguments& arguments) {
  options.limit = Limit(nullptr, arguments.timeout);
  return options;
}

Score metric_score(const Problem& problem, const Arguments& arguments) {
  const std::string& metric = arguments.metric;
  if (metric == "capture") return capture(problem, with_limit(arguments.capture, arguments));
  if (metric == "effort") return effort(problem, with_limit(arguments.effort, arguments));
  if (metric == "probability") return probability(problem, with_limit(arguments.probability, arguments));
  if (metric == "escape_energy") return {escape_energy_json(problem, with_limit(arguments.escape_energy, arguments))};
  return {force_json(problem, arguments.force_weights)};
}

}  // namespace

Score score(const Problem& problem, const Arguments& arguments) {
  Score score = metric_score(problem, arguments);
  if (const auto timing = timing_of(problem)) score.json.update(clock(problem, *timing));
  return score;
}

}  // namespace energymargin::app
