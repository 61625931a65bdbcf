// energymargin_score: reads a problem file, prints its score as JSON or writes it again.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iostream>
#include <map>
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

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* usage =
    R"(usage: energymargin_score PROBLEM.json [--metric capture|effort|probability|force|escape_energy]
                          [--planner NAME] [--search improved|published] [--captured all|any] [--nodes M]
                          [--samples N] [--rollouts N] [--strength X] [--seed S] [--trees R] [--threads T] [--tolerance E] [--timeout S]
       energymargin_score PROBLEM.json --save COPY.json [--meshes embedded|files]
       energymargin_score --schema

Scores a problem file and prints JSON. Of a problem with a horizon or a plan it prints these too: "horizon", "check" and
"dwell" [s], and of the plan "step" [s], "rows", and what its "wrenches", "targets" and "velocities" move.

  --metric    capture: capture and success score (the default), null for the sets that the problem does not have;
              effort: effort of escape [J], null if no escape was found; probability: that the objects stay captured
              until the horizon, under a disturbance that is even within the bounds; force: the wrench-based baseline;
              escape_energy: least potential energy of a quasi-static escape [J], null if none was found
  --planner   for --metric effort: the x of AO-x, est or rrt (default est); for --metric escape_energy: bit* or rrt*
              (default bit*)
  --search    for --metric effort: improved (the default), or published, which is the paper's
  --captured  for --metric effort, of several objects: all, an escape is when one has left (the default), or any, when
              the last one has
  --nodes     nodes of the search tree (default 1000)
  --samples   for --metric escape_energy: poses of the object to draw (default 2000)
  --rollouts  for --metric probability (default 30; with a tolerance the most, 10000)
  --strength  for --metric probability: of the disturbance, as a share of the problem's bounds (default 1)
  --seed      64-bit seed (default 0); the same seed gives the same bits, also from Python
  --trees     for --metric capture: independent trees, two or more give standard errors (default 1)
  --threads   for several trees, or rollouts (default 1)
  --tolerance for --metric capture: adds trees until every standard error is at most that, at least 8 and at most
              --trees (default 1000 then); for --metric probability: adds rollouts until half of the 95 % interval is
  --timeout   seconds after which the search ends with what it has; "complete" is false then

Or writes it again, and prints nothing.

  --save      where to, the same bytes as from Python
  --meshes    embedded: the points of meshes are in the file (the default); files: in OBJ files beside it

  --schema    prints the JSON Schema of problem files

examples: energymargin_score problem.json --metric effort --nodes 5000
          energymargin_score problem.json --save folder/copy.json --meshes files
)";

struct Arguments {
  std::string file;
  std::string metric = "capture";
  std::string planner;  // empty: the metric's own default
  int nodes = 1000;
  int samples = 2000;
  std::optional<int> rollouts;
  double strength = 1.0;
  std::uint64_t seed = 0;
  std::optional<int> trees;
  int threads = 1;
  std::optional<double> tolerance;
  std::optional<double> timeout;
  energymargin::Search search = energymargin::Search::improved;
  energymargin::Captured captured = energymargin::Captured::all;
  std::string copy;  // where to save to; empty: score
  std::optional<energymargin::Meshes> meshes;
};

bool has(const std::vector<std::string>& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

// The value that a word stands for.
template <typename Value>
Value choice(const std::string& option, const std::string& text, const std::map<std::string, Value>& values) {
  const auto found = values.find(text);
  if (found != values.end()) return found->second;
  std::string known;
  for (const auto& [name, value] : values) known += (known.empty() ? "" : " or ") + name;
  throw std::invalid_argument(option + " is '" + text + "', expected " + known);
}

std::uint64_t whole_number(const std::string& option, const std::string& text) {
  std::size_t read = 0;
  std::uint64_t value = 0;
  try {
    value = std::stoull(text, &read);
  } catch (const std::exception&) {
    read = 0;
  }
  if (read == 0 || read != text.size() || text.front() == '-') {
    throw std::invalid_argument(option + " is '" + text + "', expected a whole number of at least 0");
  }
  return value;
}

int count(const std::string& option, const std::string& text) {
  const std::uint64_t value = whole_number(option, text);
  if (value < 1 || value > 1000000000) {
    throw std::invalid_argument(option + " is " + text + ", expected a whole number from 1 to 1000000000");
  }
  return static_cast<int>(value);
}

double number(const std::string& option, const std::string& text) {
  std::size_t read = 0;
  double value = 0.0;
  try {
    value = std::stod(text, &read);
  } catch (const std::exception&) {
    read = 0;
  }
  if (read == 0 || read != text.size()) throw std::invalid_argument(option + " is '" + text + "', expected a number");
  return value;
}

void require_one_job(const Arguments& arguments, const std::string& scoring) {
  if (arguments.copy.empty() && arguments.meshes) throw std::invalid_argument("--meshes is of use with --save alone");
  if (arguments.copy.empty() || scoring.empty()) return;
  throw std::invalid_argument(scoring + " is of no use with --save, which computes no score");
}

Arguments parse(const std::vector<std::string>& words) {
  Arguments arguments;
  std::string scoring;  // an option that says how to score
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    if (word.rfind("--", 0) != 0) {
      if (!arguments.file.empty())
        throw std::invalid_argument("two problem files given: '" + arguments.file + "' and '" + word + "'");
      arguments.file = word;
      continue;
    }
    if (i + 1 == words.size()) throw std::invalid_argument(word + " has no value; see --help");
    const std::string& value = words[++i];
    if (word != "--save" && word != "--meshes") scoring = word;
    if (word == "--save") {
      arguments.copy = value;
    } else if (word == "--meshes") {
      arguments.meshes = choice<energymargin::Meshes>(
          word, value, {{"embedded", energymargin::Meshes::embedded}, {"files", energymargin::Meshes::files}});
    } else if (word == "--captured") {
      arguments.captured = choice<energymargin::Captured>(
          word, value, {{"all", energymargin::Captured::all}, {"any", energymargin::Captured::any}});
    } else if (word == "--search") {
      arguments.search = choice<energymargin::Search>(
          word, value, {{"improved", energymargin::Search::improved}, {"published", energymargin::Search::published}});
    } else if (word == "--metric") {
      arguments.metric = value;
    } else if (word == "--planner") {
      arguments.planner = value;
    } else if (word == "--nodes") {
      arguments.nodes = count(word, value);
    } else if (word == "--samples") {
      arguments.samples = count(word, value);
    } else if (word == "--rollouts") {
      arguments.rollouts = count(word, value);
    } else if (word == "--strength") {
      arguments.strength = number(word, value);
    } else if (word == "--seed") {
      arguments.seed = whole_number(word, value);
    } else if (word == "--trees") {
      arguments.trees = count(word, value);
    } else if (word == "--tolerance") {
      arguments.tolerance = number(word, value);
    } else if (word == "--timeout") {
      arguments.timeout = number(word, value);
    } else if (word == "--threads") {
      arguments.threads = count(word, value);
    } else {
      throw std::invalid_argument("unknown option " + word + "; see --help");
    }
  }
  if (arguments.file.empty()) throw std::invalid_argument("no problem file given; see --help");
  require_one_job(arguments, scoring);
  return arguments;
}

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
  energymargin::CaptureOptions options;
  options.nodes = arguments.nodes;
  options.seed = arguments.seed;
  options.trees = arguments.trees;
  options.threads = arguments.threads;
  options.tolerance = arguments.tolerance;
  options.limit = energymargin::Limit(nullptr, arguments.timeout);
  const energymargin::CaptureScore score = energymargin::guarded_capture_score(problem, options);
  tell(energymargin::implausible(score));
  return {{"capture", score.capture},
          {"success", optional_number(score.success)},
          {"capture_any", optional_number(score.capture_any)},
          {"success_any", optional_number(score.success_any)},
          {"capture_stderr", optional_number(score.capture_stderr)},
          {"success_stderr", optional_number(score.success_stderr)},
          {"capture_any_stderr", optional_number(score.capture_any_stderr)},
          {"success_any_stderr", optional_number(score.success_any_stderr)},
          {"capture_interval", interval_of(score, "capture", true)},
          {"success_interval", interval_of(score, "success", score.success.has_value())},
          {"resolution", score.resolution},
          {"undisturbed_exit", optional_number(score.undisturbed_exit)},
          {"trees", score.trees.size()},
          {"nodes", score.nodes()},
          {"complete", score.complete}};
}

Json effort(const energymargin::Problem& problem, const Arguments& arguments) {
  energymargin::EffortOptions options;
  if (!arguments.planner.empty()) options.planner = arguments.planner;
  options.nodes = arguments.nodes;
  options.seed = arguments.seed;
  options.search = arguments.search;
  options.captured = arguments.captured;
  options.limit = energymargin::Limit(nullptr, arguments.timeout);
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
  energymargin::ProbabilityOptions options;
  options.disturbance = energymargin::disturbances::Uniform{arguments.strength};
  options.rollouts = arguments.rollouts;
  options.seed = arguments.seed;
  options.threads = arguments.threads;
  options.tolerance = arguments.tolerance;
  options.success = problem.succeeded.has_value();
  options.limit = energymargin::Limit(nullptr, arguments.timeout);
  const energymargin::CaptureProbability p = energymargin::capture_probability(problem, options);
  const energymargin::Interval found = energymargin::interval(p.all.captured(), p.effective, 1.0 - 0.05 / p.looks);
  return {{"captured", p.all.captured()},
          {"interval", {found.low, found.high}},
          {"mean_time", p.all.mean_time},
          {"success", optional_number(p.success)},
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
  energymargin::EscapeEnergyOptions options;
  if (!arguments.planner.empty()) options.planner = arguments.planner;
  options.samples = arguments.samples;
  options.seed = arguments.seed;
  options.limit = energymargin::Limit(nullptr, arguments.timeout);
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
  const std::vector<std::string> metrics{"capture", "effort", "probability", "force", "escape_energy"};
  if (!has(metrics, arguments.metric)) {
    throw std::invalid_argument("--metric is '" + arguments.metric +
                                "', expected capture, effort, probability, force or escape_energy");
  }
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
      print(usage);
    } else if (has(words, "--schema")) {
      print(energymargin::problem_schema());
    } else {
      print(run(parse(words)));
    }
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "error: " << one_line(error.what()) << "\n";
    return 2;
  }
}
