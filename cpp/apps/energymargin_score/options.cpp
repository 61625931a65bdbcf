#include "options.hpp"

#include <algorithm>
#include <functional>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "disturbance.hpp"
#include "value.hpp"

namespace energymargin::app {
namespace {

constexpr const char* every_metric = "capture effort probability force escape_energy";

std::vector<std::string> split(const std::string& words) {
  std::istringstream stream(words);
  return {std::istream_iterator<std::string>(stream), {}};
}

// The arguments so far. The kind of a disturbance may come after its options.
struct CommandLine {
  Arguments arguments{};
  std::string disturbance = "uniform";
  DisturbanceOptions disturbance_options{};
};

struct Option {
  std::string name;
  std::string value;    // its name in the help; empty: the option has none
  std::string metrics;  // that have the option, with blanks between; empty: it is of saving
  std::string help;
  std::function<void(CommandLine&, const Value&)> set;
};

Option disturbance_option(const std::string& name, const std::string& value, const std::string& help) {
  return {name, value, "probability", help,
          [](CommandLine& line, const Value& v) { line.disturbance_options[v.option] = v; }};
}

std::vector<Option> common_options() {
  return {
      {"--metric", "NAME", every_metric, alternatives(split(every_metric), "") + " (capture)",
       [](CommandLine& line, const Value& v) { line.arguments.metric = v.text; }},
      {"--engine", "NAME", every_metric, "what steps the simulation: native or bullet (the problem's)",
       [](CommandLine& line, const Value& v) { line.arguments.engine = v.choice<EngineKind>(); }},
      {"--timeout", "S", every_metric, "seconds after which the search ends: \"complete\" is false",
       [](CommandLine& line, const Value& v) { line.arguments.timeout = v.number(); }},
      {"--seed", "S", "capture effort probability escape_energy", "same seed, same bits (0)",
       [](CommandLine& line, const Value& v) {
         Arguments& a = line.arguments;
         a.capture.seed = a.effort.seed = a.probability.seed = a.escape_energy.seed = v.whole_number();
       }},
      {"--nodes", "M", "capture effort", "nodes of a search tree (1000)",
       [](CommandLine& line, const Value& v) {
         line.arguments.capture.nodes = line.arguments.effort.nodes = v.count();
       }},
      {"--planner", "NAME", "effort escape_energy",
       alternatives(effort_planners, "") + " (est); " + alternatives(escape_energy_planners, "") + " (bit*)",
       [](CommandLine& line, const Value& v) {
         line.arguments.effort.planner = line.arguments.escape_energy.planner = v.text;
       }},
      {"--tolerance", "E", "capture probability", "adds trees, or rollouts, up to this error",
       [](CommandLine& line, const Value& v) {
         line.arguments.capture.tolerance = line.arguments.probability.tolerance = v.number();
       }},
      {"--threads", "T", "capture effort probability", "for trees, rounds, searches or rollouts (1)",
       [](CommandLine& line, const Value& v) {
         line.arguments.capture.threads = line.arguments.effort.threads = line.arguments.probability.threads =
             v.count();
       }},
      {"--rate", "X", "capture probability", "lambda [1/J] (the problem's); of boltzmann (0)",
       [](CommandLine& line, const Value& v) {
         line.arguments.capture.rate = v.number();
         line.disturbance_options[v.option] = v;
       }},
  };
}

std::vector<Option> capture_options() {
  return {
      {"--trees", "R", "capture", "independent trees (1); with a tolerance the most (1000)",
       [](CommandLine& line, const Value& v) { line.arguments.capture.trees = v.count(); }},
      {"--nodes-per-edge", "N", "capture", "the most states of a rollout that are nodes (1)",
       [](CommandLine& line, const Value& v) { line.arguments.capture.nodes_per_edge = v.count(); }},
      {"--nodes-per-round", "N", "capture", "nodes that are extended at once (1); 16 for a tree on two threads",
       [](CommandLine& line, const Value& v) { line.arguments.capture.nodes_per_round = v.count(); }},
      {"--least-likelihood", "X", "capture", "share of the root's likelihood at which a rollout ends (0)",
       [](CommandLine& line, const Value& v) { line.arguments.capture.least_likelihood = v.number(); }},
  };
}

std::vector<Option> effort_options() {
  return {
      {"--searches", "K", "effort", "independent ones, which share the nodes (1)",
       [](CommandLine& line, const Value& v) { line.arguments.effort.searches = v.count(); }},
      {"--search", "NAME", "effort", "improved (the default), or published, which is the paper's",
       [](CommandLine& line, const Value& v) { line.arguments.effort.search = v.choice<Search>(); }},
      {"--sampling", "NAME", "effort",
       "of wrenches: " + alternatives(all_words<Sampling>(), "") + " (as the search does)",
       [](CommandLine& line, const Value& v) { line.arguments.effort.sampling = v.choice<Sampling>(); }},
      {"--shorten", "yes|no", "effort", "makes the best escape cheaper (as the search does)",
       [](CommandLine& line, const Value& v) { line.arguments.effort.shorten = v.yes_or_no(); }},
      {"--captured", "WHICH", "effort", "until one object has left: all (the default); the last: any",
       [](CommandLine& line, const Value& v) { line.arguments.effort.captured = v.choice<Captured>(); }},
      {"--stop-at-escape", "", "effort", "a rollout ends where a look sees it outside",
       [](CommandLine& line, const Value&) { line.arguments.effort.stop_at_escape = true; }},
  };
}

std::vector<Option> probability_options() {
  return {
      {"--rollouts", "N", "probability", "random futures (30); with a tolerance the most (10000)",
       [](CommandLine& line, const Value& v) { line.arguments.probability.rollouts = v.count(); }},
      {"--disturbance", "NAME", "probability", "uniform (the default), gaussian, boltzmann or plan",
       [](CommandLine& line, const Value& v) { line.disturbance = v.text; }},
      disturbance_option("--strength", "X", "uniform, boltzmann: share of the bounds (1)"),
      disturbance_option("--objects", "N", "uniform, boltzmann: objects of a piece (all)"),
      disturbance_option("--hold", "T", "uniform, boltzmann, plan: longest piece [s]"),
      disturbance_option("--force", "F", "gaussian: deviation [N]; plan: largest, F or X,Y,Z [N]"),
      disturbance_option("--torque", "F", "the same of the torque [N m]"),
      disturbance_option("--targets", "X", "plan: largest error of joints' targets [rad, m]"),
      disturbance_option("--correlation-time", "T", "gaussian [s] (0.1)"),
  };
}

std::vector<Option> escape_energy_options() {
  return {
      {"--samples", "N", "escape_energy", "poses of the object to draw (2000)",
       [](CommandLine& line, const Value& v) { line.arguments.escape_energy.samples = v.count(); }},
      {"--reach", "X", "escape_energy", "half the edge of the box to search in [m] (adapts)",
       [](CommandLine& line, const Value& v) { line.arguments.escape_energy.reach = v.number(); }},
      {"--object", "NAME", "escape_energy", "the object that leaves, of several",
       [](CommandLine& line, const Value& v) { line.arguments.escape_energy.object = v.text; }},
  };
}

std::vector<Option> force_options() {
  return {
      {"--weights", "W,W,W,W,W", "force", "engage, stick, distance, ground_engage, ground_stick (the problem's)",
       [](CommandLine& line, const Value& v) { line.arguments.force_weights = v.force_weights(); }},
  };
}

std::vector<Option> saving_options() {
  return {
      {"--save", "COPY.json", "", "writes the problem again, and scores nothing",
       [](CommandLine& line, const Value& v) { line.arguments.copy = v.text; }},
      {"--meshes", "WHERE", "", "with --save: embedded (the default), or files beside the copy",
       [](CommandLine& line, const Value& v) { line.arguments.meshes = v.choice<Meshes>(); }},
  };
}

struct Group {
  std::string title;
  std::vector<Option> options;
};

const std::vector<Group>& groups() {
  static const std::vector<Group> all{{"several metrics", common_options()},
                                      {"capture", capture_options()},
                                      {"effort", effort_options()},
                                      {"probability", probability_options()},
                                      {"escape_energy", escape_energy_options()},
                                      {"force", force_options()},
                                      {"saving", saving_options()}};
  return all;
}

const Option& option_named(const std::string& name) {
  for (const Group& group : groups()) {
    for (const Option& option : group.options) {
      if (option.name == name) return option;
    }
  }
  throw std::invalid_argument("unknown option " + name + "; see --help");
}

std::string list(const std::string& words) {
  std::string text;
  for (const std::string& word : split(words)) text += (text.empty() ? "" : ", ") + word;
  return text;
}

// An option is of use in one job: to save, or to score with the metric.
void require_use(const Option& option, const Arguments& arguments) {
  const bool saves = !arguments.copy.empty();
  if (option.metrics.empty()) {
    if (!saves) throw std::invalid_argument(option.name + " is of use with --save alone");
    return;
  }
  if (saves) throw std::invalid_argument(option.name + " is of no use with --save, which computes no score");
  const std::vector<std::string> metrics = split(option.metrics);
  if (std::find(metrics.begin(), metrics.end(), arguments.metric) != metrics.end()) return;
  throw std::invalid_argument(option.name + " is of no use with --metric " + arguments.metric + ": it is of " +
                              list(option.metrics));
}

// One line. Options of some metrics begin with these.
std::string help_of(const Option& option) {
  constexpr std::size_t column = 24;
  std::string line = "  " + option.name + " " + option.value;
  line.resize(std::max(line.size() + 1, column), ' ');
  const std::vector<std::string> metrics = split(option.metrics);
  const bool has_note = metrics.size() > 1 && option.metrics != every_metric;
  return line + (has_note ? list(option.metrics) + ": " : "") + option.help + "\n";
}

// Reads the words into the line, and returns the options among them.
std::vector<const Option*> read(const std::vector<std::string>& words, CommandLine& line) {
  std::string& file = line.arguments.file;
  std::vector<const Option*> present;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i].rfind("--", 0) != 0) {
      if (!file.empty()) throw std::invalid_argument("two problem files given: '" + file + "' and '" + words[i] + "'");
      file = words[i];
      continue;
    }
    const Option& option = option_named(words[i]);
    Value value{option.name, ""};
    if (!option.value.empty()) {
      if (i + 1 == words.size()) throw std::invalid_argument(option.name + " has no value; see --help");
      value.text = words[++i];
    }
    option.set(line, value);
    present.push_back(&option);
  }
  return present;
}

}  // namespace

Arguments parse(const std::vector<std::string>& words) {
  CommandLine line;
  const std::vector<const Option*> present = read(words, line);
  Arguments& arguments = line.arguments;
  if (arguments.file.empty()) throw std::invalid_argument("no problem file given; see --help");
  require_word("--metric", arguments.metric, split(every_metric), "");
  for (const Option* option : present) require_use(*option, arguments);
  if (arguments.metric == "probability") {
    arguments.probability.disturbance = disturbance_model(line.disturbance, line.disturbance_options);
  }
  return arguments;
}

std::string help() {
  std::ostringstream text;
  text << R"(usage: energymargin_score PROBLEM.json [--metric NAME] [OPTIONS]
       energymargin_score PROBLEM.json --save COPY.json [--meshes embedded|files]
       energymargin_score --schema

Scores a problem file and prints JSON, to the last bit as Python does. null: no escape or such set.

)";
  for (const Group& group : groups()) {
    text << "Options of " << group.title << ":\n";
    for (const Option& option : group.options) text << help_of(option);
  }
  text << R"(examples: energymargin_score problem.json --metric effort --nodes 5000
          energymargin_score problem.json --metric probability --disturbance gaussian --force 0.5
          energymargin_score problem.json --save folder/copy.json --meshes files
)";
  return text.str();
}

}  // namespace energymargin::app
