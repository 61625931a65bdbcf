// energymargin_score: reads a problem file, prints its score as JSON.

#include <cmath>
#include <cstdint>
#include <iostream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "energymargin/metrics/capture.hpp"
#include "energymargin/metrics/effort.hpp"
#include "energymargin/metrics/escape_energy.hpp"
#include "energymargin/metrics/force.hpp"
#include "energymargin/problem_io.hpp"

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* usage =
    R"(usage: energymargin_score PROBLEM.json [--metric capture|effort|force|escape_energy] [--planner NAME]
                          [--nodes M] [--samples N] [--seed S] [--trees R] [--threads T]

Scores a problem file and prints JSON.

  --metric   capture: capture and success score (the default); effort: effort of escape [J], null if no escape
             was found; force: the wrench-based baseline; escape_energy: least potential energy of a quasi-static escape
             [J], null if none was found
  --planner  for --metric effort: the x of AO-x, est or rrt (default est); for --metric escape_energy: bit* or rrt*
             (default bit*)
  --nodes    nodes of the search tree (default 1000)
  --samples  for --metric escape_energy: poses of the object to draw (default 2000)
  --seed     64-bit seed (default 0); the same seed gives the same bits, also from Python
  --trees    for --metric capture: independent trees, two or more give standard errors (default 1)
  --threads  for several trees (default 1)

example: energymargin_score problem.json --metric effort --nodes 5000
)";

struct Arguments {
  std::string file;
  std::string metric = "capture";
  std::string planner;  // empty: the metric's own default
  int nodes = 1000;
  int samples = 2000;
  std::uint64_t seed = 0;
  int trees = 1;
  int threads = 1;
};

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

Arguments parse(const std::vector<std::string>& words) {
  Arguments arguments;
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
    if (word == "--metric") {
      arguments.metric = value;
    } else if (word == "--planner") {
      arguments.planner = value;
    } else if (word == "--nodes") {
      arguments.nodes = count(word, value);
    } else if (word == "--samples") {
      arguments.samples = count(word, value);
    } else if (word == "--seed") {
      arguments.seed = whole_number(word, value);
    } else if (word == "--trees") {
      arguments.trees = count(word, value);
    } else if (word == "--threads") {
      arguments.threads = count(word, value);
    } else {
      throw std::invalid_argument("unknown option " + word + "; see --help");
    }
  }
  if (arguments.file.empty()) throw std::invalid_argument("no problem file given; see --help");
  return arguments;
}

Json optional_number(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

Json capture(const energymargin::Problem& problem, const Arguments& arguments) {
  energymargin::CaptureOptions options;
  options.nodes = arguments.nodes;
  options.seed = arguments.seed;
  options.trees = arguments.trees;
  options.threads = arguments.threads;
  const energymargin::CaptureScore score = energymargin::capture_score(problem, options);
  return {{"capture", score.capture},
          {"success", optional_number(score.success)},
          {"capture_stderr", optional_number(score.capture_stderr)},
          {"success_stderr", optional_number(score.success_stderr)}};
}

Json effort(const energymargin::Problem& problem, const Arguments& arguments) {
  const energymargin::Escape escape = energymargin::escape_effort(
      problem, {arguments.planner.empty() ? "est" : arguments.planner, arguments.nodes, arguments.seed, nullptr});
  Json history = Json::array();
  for (const auto& [nodes, best] : escape.history) history.push_back({{"nodes", nodes}, {"effort", best}});
  const bool found = std::isfinite(escape.effort);
  return {{"effort", found ? Json(escape.effort) : Json(nullptr)}, {"history", history}};
}

Json escape_energy(const energymargin::Problem& problem, const Arguments& arguments) {
  energymargin::EscapeEnergyOptions options;
  if (!arguments.planner.empty()) options.planner = arguments.planner;
  options.samples = arguments.samples;
  options.seed = arguments.seed;
  const energymargin::EscapeEnergy escape = energymargin::escape_energy(problem, options);
  Json history = Json::array();
  for (const auto& [samples, best] : escape.history) history.push_back({{"samples", samples}, {"energy", best}});
  const bool found = std::isfinite(escape.energy);
  return {{"energy", found ? Json(escape.energy) : Json(nullptr)}, {"history", history}};
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

Json score(const Arguments& arguments) {
  if (arguments.metric != "capture" && arguments.metric != "effort" && arguments.metric != "force" &&
      arguments.metric != "escape_energy") {
    throw std::invalid_argument("--metric is '" + arguments.metric +
                                "', expected capture, effort, force or escape_energy");
  }
  const energymargin::Problem problem = energymargin::load(arguments.file);
  if (arguments.metric == "capture") return capture(problem, arguments);
  if (arguments.metric == "effort") return effort(problem, arguments);
  if (arguments.metric == "escape_energy") return escape_energy(problem, arguments);
  return force(problem);
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  for (const std::string& word : words) {
    if (word == "--help" || word == "-h") {
      std::cout << usage;
      return 0;
    }
  }
  try {
    std::cout << score(parse(words)).dump(1) << "\n";
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "error: " << error.what() << "\n";
    return 2;
  }
}
