// energymargin_score: reads a problem file, prints its score as JSON or writes it again.

#include <algorithm>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "energymargin/metrics/capture.hpp"
#include "energymargin/metrics/effort.hpp"
#include "energymargin/metrics/escape_energy.hpp"
#include "energymargin/metrics/force.hpp"
#include "energymargin/metrics/guards.hpp"
#include "energymargin/metrics/interval.hpp"
#include "energymargin/metrics/probability.hpp"
#include "energymargin/plausibility.hpp"
#include "energymargin/problem_io.hpp"
#include "options.hpp"

namespace {

using Json = nlohmann::ordered_json;

using energymargin::score::Arguments;

bool has(const std::vector<std::string>& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

energymargin::Limit limit(const Arguments& arguments) { return energymargin::Limit(nullptr, arguments.timeout); }

Json optional_number(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

Json interval_of(const energymargin::CaptureScore& score, const std::string& which, bool has_set) {
  if (!has_set || score.trees.size() < 2) return nullptr;
  const energymargin::Interval found = energymargin::interval(score, which);
  return {found.low, found.high};
}

// A file's own words may be in an error, and a failure or a warning is one line.
std::string one_line(std::string text) {
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20) c = ' ';
  }
  return text;
}

void tell(const std::vector<energymargin::Doubt>& doubts) {
  for (const energymargin::Doubt& doubt : doubts) std::cerr << "warning: " << one_line(doubt.text) << "\n";
}

Json capture(const energymargin::Problem& problem, const Arguments& arguments) {
  energymargin::CaptureOptions options = arguments.capture;
  options.limit = limit(arguments);
  const energymargin::CaptureScore score = energymargin::guarded_capture_score(problem, options);
  tell(energymargin::implausible(score));
  Json json;
  for (const auto& [name, set] : energymargin::set_scores(score)) json[name] = set ? Json(set->mean) : Json(nullptr);
  for (const auto& [name, set] : energymargin::set_scores(score)) {
    json[std::string(name) + "_stderr"] = set ? optional_number(set->standard_error) : Json(nullptr);
  }
  json["capture_interval"] = interval_of(score, "capture", true);
  json["success_interval"] = interval_of(score, "success", score.success.has_value());
  json["resolution"] = score.resolution;
  json["undisturbed_exit"] = optional_number(score.undisturbed_exit);
  json["trees"] = score.trees.size();
  json["nodes"] = score.nodes();
  json["complete"] = score.complete;
  return json;
}

Json effort(const energymargin::Problem& problem, const Arguments& arguments) {
  energymargin::EffortOptions options = arguments.effort;
  options.limit = limit(arguments);
  const energymargin::Escape escape = energymargin::escape_effort(problem, options);
  Json history = Json::array();
  for (const auto& [nodes, best] : escape.history) history.push_back({{"nodes", nodes}, {"effort", best}});
  const bool found = std::isfinite(escape.effort);
  return {{"effort", found ? Json(escape.effort) : Json(nullptr)},
          {"history", history},
          {"nodes", escape.nodes()},
          {"discarded", escape.discarded},
          {"complete", escape.complete}};
}

Json probability(const energymargin::Problem& problem, const Arguments& arguments) {
  energymargin::ProbabilityOptions options = arguments.probability;
  options.success = problem.succeeded.has_value();
  options.by_object = problem.captured_any.has_value();
  options.limit = limit(arguments);
  const energymargin::CaptureProbability p = energymargin::capture_probability(problem, options);
  const energymargin::Interval found = energymargin::interval(p.all.captured(), p.effective, 1.0 - 0.05 / p.looks);
  return {{"captured", p.all.captured()},
          {"interval", {found.low, found.high}},
          {"mean_time", p.all.mean_time},
          {"success", optional_number(p.success)},
          {"captured_any", p.any ? Json(p.any->captured()) : Json(nullptr)},
          {"undisturbed", p.undisturbed},
          {"undisturbed_time", p.undisturbed_time},
          {"times", std::vector<double>(p.times.begin(), p.times.end())},
          {"curve", std::vector<double>(p.all.curve.begin(), p.all.curve.end())},
          {"rollouts", p.rollouts},
          {"diverged", p.diverged},
          {"steps", p.steps},
          {"complete", p.complete}};
}

Json escape_energy(const energymargin::Problem& problem, const Arguments& arguments) {
  energymargin::EscapeEnergyOptions options = arguments.escape_energy;
  options.limit = limit(arguments);
  const energymargin::EscapeEnergy escape = energymargin::escape_energy(problem, options);
  Json history = Json::array();
  for (const auto& [samples, best] : escape.history) history.push_back({{"samples", samples}, {"energy", best}});
  const bool found = std::isfinite(escape.energy);
  return {{"energy", found ? Json(escape.energy) : Json(nullptr)},
          {"history", history},
          {"samples", escape.samples},
          {"complete", escape.complete}};
}

Json force(const energymargin::Problem& problem) {
  const energymargin::ForceScore score = energymargin::force_score(problem);
  const auto margins = [](const energymargin::ContactMargins& of) {
    return Json{{"engage", of.engage}, {"stick", of.stick}};
  };
  return {{"force", score.force},
          {"effector", margins(score.effector)},
          {"ground", margins(score.ground)},
          {"distance", score.distance}};
}

// What the question was about, if it has a clock: its times [s], and the plan's rows and what they move.
Json clock(const energymargin::Problem& problem, const energymargin::Timing& timing) {
  const double step = problem.scene.stepping().step;
  Json json = {{"horizon", timing.horizon * step},
               {"check", timing.check * step},
               {"dwell", timing.dwell * step},
               {"plan", nullptr}};
  if (!problem.plan) return json;
  Json wrenches = Json::array();
  Json targets = Json::array();
  Json velocities = Json::array();
  for (const energymargin::Drive& drive : problem.plan->wrenches) wrenches.push_back(drive.body);
  for (const energymargin::Targets& of : problem.plan->targets) targets.push_back(of.joint);
  for (const energymargin::Servo& servo : problem.plan->velocities) velocities.push_back(servo.body);
  json["plan"] = {{"step", problem.plan->step},
                  {"rows", problem.plan->rows()},
                  {"wrenches", wrenches},
                  {"targets", targets},
                  {"velocities", velocities}};
  return json;
}

Json of_metric(const energymargin::Problem& problem, const Arguments& arguments) {
  if (arguments.metric == "capture") return capture(problem, arguments);
  if (arguments.metric == "effort") return effort(problem, arguments);
  if (arguments.metric == "probability") return probability(problem, arguments);
  if (arguments.metric == "escape_energy") return escape_energy(problem, arguments);
  return force(problem);
}

Json score(const Arguments& arguments) {
  const energymargin::Problem problem = energymargin::load(arguments.file);
  tell(energymargin::implausible(problem));
  Json json = of_metric(problem, arguments);
  if (const auto timing = energymargin::timing_of(problem)) json.update(clock(problem, *timing));
  return json;
}

// What it does, and the text that it prints.
std::string run(const Arguments& arguments) {
  if (arguments.copy.empty()) return score(arguments).dump(1) + "\n";
  energymargin::save(energymargin::load(arguments.file), arguments.copy,
                     arguments.meshes.value_or(energymargin::Meshes::embedded));
  return "";
}

void print(const std::string& text) {
  std::cout << text << std::flush;
  if (!std::cout) throw std::runtime_error("the output cannot be written");
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  try {
    if (has(words, "--help") || has(words, "-h")) {
      print(energymargin::score::help());
    } else if (has(words, "--schema")) {
      print(energymargin::problem_schema());
    } else {
      print(run(energymargin::score::parse(words)));
    }
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "error: " << one_line(error.what()) << "\n";
    return 2;
  }
}
