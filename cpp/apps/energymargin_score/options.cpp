#include "options.hpp"

#include <algorithm>
#include <functional>
#include <map>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace energymargin::score {
namespace {

const std::vector<std::string> metrics{"capture", "effort", "probability", "force", "escape_energy"};

// What stands behind an option, to be read as what it has to be.
struct Value {
  std::string option;
  std::string text;

  [[noreturn]] void refuse(const std::string& expected) const {
    throw std::invalid_argument(option + " is '" + text + "', expected " + expected);
  }

  std::uint64_t whole_number() const {
    std::size_t read = 0;
    std::uint64_t value = 0;
    try {
      value = std::stoull(text, &read);
    } catch (const std::exception&) {
      read = 0;
    }
    if (read == 0 || read != text.size() || text.front() == '-') refuse("a whole number of at least 0");
    return value;
  }

  int count() const {
    const std::uint64_t value = whole_number();
    if (value < 1 || value > 1000000000) refuse("a whole number from 1 to 1000000000");
    return static_cast<int>(value);
  }

  double number() const {
    std::size_t read = 0;
    double value = 0.0;
    try {
      value = std::stod(text, &read);
    } catch (const std::exception&) {
      read = 0;
    }
    if (read == 0 || read != text.size()) refuse("a number");
    return value;
  }

  template <typename Choice>
  Choice choice(const std::map<std::string, Choice>& choices) const {
    const auto found = choices.find(text);
    if (found != choices.end()) return found->second;
    std::string known;
    for (const auto& [name, chosen] : choices) known += (known.empty() ? "" : " or ") + name;
    refuse(known);
  }
};

// Numbers of a disturbance, before its kind is known.
struct Noise {
  std::string kind = "uniform";
  std::map<std::string, double> numbers{};
  std::optional<int> objects{};
};

struct Reading {
  Arguments arguments{};
  Noise noise{};
};

struct Option {
  const char* name;
  const char* value;  // how the help calls it; empty: there is none
  const char* of;     // metrics that it is of, with blanks between; empty: of saving, "all" of every metric
  const char* help;
  std::function<void(Reading&, const Value&)> set;
};

Option number_of_noise(const char* name, const char* value, const char* help) {
  return {name, value, "probability", help, [key = std::string(name)](Reading& reading, const Value& given) {
            reading.noise.numbers[key] = given.number();
          }};
}

const std::vector<Option>& options() {
  static const std::vector<Option> all{
      {"--metric", "NAME", "all", "capture (the default), effort, probability, force or escape_energy",
       [](Reading& r, const Value& v) { r.arguments.metric = v.text; }},
      {"--nodes", "M", "capture effort", "nodes of a search tree (1000)",
       [](Reading& r, const Value& v) { r.arguments.capture.nodes = r.arguments.effort.nodes = v.count(); }},
      {"--seed", "S", "capture effort probability escape_energy", "64 bits (0); the same seed gives the same bits",
       [](Reading& r, const Value& v) {
         Arguments& a = r.arguments;
         a.capture.seed = a.effort.seed = a.probability.seed = a.escape_energy.seed = v.whole_number();
       }},
      {"--trees", "R", "capture", "independent trees (1); two or more give standard errors",
       [](Reading& r, const Value& v) { r.arguments.capture.trees = v.count(); }},
      {"--rate", "X", "capture probability", "lambda [1/J] (the problem's); of the disturbance boltzmann",
       [](Reading& r, const Value& v) { r.arguments.capture.rate = r.noise.numbers["--rate"] = v.number(); }},
      {"--nodes-per-edge", "N", "capture", "states of a rollout that are nodes (1)",
       [](Reading& r, const Value& v) { r.arguments.capture.nodes_per_edge = v.count(); }},
      {"--least-likelihood", "X", "capture", "rollouts end where it falls to that share of the start's (0)",
       [](Reading& r, const Value& v) { r.arguments.capture.least_likelihood = v.number(); }},
      {"--planner", "NAME", "effort escape_energy", "est or rrt (est); bit* or rrt* (bit*)",
       [](Reading& r, const Value& v) { r.arguments.effort.planner = r.arguments.escape_energy.planner = v.text; }},
      {"--search", "NAME", "effort", "improved (the default), or published, which is the paper's",
       [](Reading& r, const Value& v) {
         r.arguments.effort.search =
             v.choice<Search>({{"improved", Search::improved}, {"published", Search::published}});
       }},
      {"--captured", "WHICH", "effort", "until one object has left: all (the default); until the last: any",
       [](Reading& r, const Value& v) {
         r.arguments.effort.captured = v.choice<Captured>({{"all", Captured::all}, {"any", Captured::any}});
       }},
      {"--stop-at-escape", "", "effort", "a rollout ends where it is seen outside of the capture set",
       [](Reading& r, const Value&) { r.arguments.effort.stop_at_escape = true; }},
      {"--rollouts", "N", "probability", "futures (30); with a tolerance the most (10000)",
       [](Reading& r, const Value& v) { r.arguments.probability.rollouts = v.count(); }},
      {"--disturbance", "NAME", "probability", "uniform (the default), gaussian, boltzmann or plan",
       [](Reading& r, const Value& v) { r.noise.kind = v.text; }},
      number_of_noise("--strength", "X", "uniform, boltzmann: share of the problem's bounds (1)"),
      {"--objects", "N", "probability", "uniform, boltzmann: objects that it meets at a time (all)",
       [](Reading& r, const Value& v) { r.noise.objects = v.count(); }},
      number_of_noise("--hold", "T", "uniform, boltzmann, plan: longest piece [s]"),
      number_of_noise("--force", "N", "gaussian: standard deviation; plan: largest [N]"),
      number_of_noise("--torque", "N", "the same of the torque [N m]"),
      number_of_noise("--targets", "X", "plan: largest error of joints' targets [rad, m]"),
      number_of_noise("--correlation-time", "T", "gaussian [s] (0.1)"),
      {"--samples", "N", "escape_energy", "poses of the object to draw (2000)",
       [](Reading& r, const Value& v) { r.arguments.escape_energy.samples = v.count(); }},
      {"--reach", "X", "escape_energy", "half the edge of the box to search in [m] (found)",
       [](Reading& r, const Value& v) { r.arguments.escape_energy.reach = v.number(); }},
      {"--object", "NAME", "escape_energy", "the one that gets out, of several",
       [](Reading& r, const Value& v) { r.arguments.escape_energy.object = v.text; }},
      {"--tolerance", "E", "capture probability", "adds trees, or rollouts, until the error is at most that",
       [](Reading& r, const Value& v) {
         r.arguments.capture.tolerance = r.arguments.probability.tolerance = v.number();
       }},
      {"--threads", "T", "capture probability", "for several trees, or rollouts (1)",
       [](Reading& r, const Value& v) { r.arguments.capture.threads = r.arguments.probability.threads = v.count(); }},
      {"--timeout", "S", "all", "seconds after which it ends with what it has: \"complete\" is false",
       [](Reading& r, const Value& v) { r.arguments.timeout = v.number(); }},
      {"--save", "COPY.json", "", "writes the problem again, and scores nothing",
       [](Reading& r, const Value& v) { r.arguments.copy = v.text; }},
      {"--meshes", "WHERE", "", "with --save: embedded (the default), or files beside it",
       [](Reading& r, const Value& v) {
         r.arguments.meshes = v.choice<Meshes>({{"embedded", Meshes::embedded}, {"files", Meshes::files}});
       }},
  };
  return all;
}

const Option& option_named(const std::string& name) {
  for (const Option& option : options()) {
    if (option.name == name) return option;
  }
  throw std::invalid_argument("unknown option " + name + "; see --help");
}

bool is_of(const Option& option, const std::string& metric) {
  std::istringstream words(option.of);
  for (std::string word; words >> word;) {
    if (word == metric || word == "all") return true;
  }
  return false;
}

std::string listed(const char* of) {
  std::istringstream words(of);
  std::string text;
  for (std::string word; words >> word;) text += (text.empty() ? "" : ", ") + word;
  return text;
}

void require_metric(const std::string& metric) {
  if (std::find(metrics.begin(), metrics.end(), metric) != metrics.end()) return;
  throw std::invalid_argument("--metric is '" + metric +
                              "', expected capture, effort, probability, force or escape_energy");
}

void require_one_job(const Arguments& arguments, const std::vector<const Option*>& given) {
  for (const Option* option : given) {
    const std::string name = option->name;
    const bool saves = *option->of == '\0';
    if (saves && arguments.copy.empty()) throw std::invalid_argument(name + " is of use with --save alone");
    if (saves) continue;
    if (!arguments.copy.empty()) {
      throw std::invalid_argument(name + " is of no use with --save, which computes no score");
    }
    if (!is_of(*option, arguments.metric)) {
      throw std::invalid_argument(name + " is of no use with --metric " + arguments.metric + ": it is of " +
                                  listed(option->of));
    }
  }
}

// The numbers that a kind of disturbance has, taken out one by one; what is left is of another kind.
class Numbers {
 public:
  explicit Numbers(Noise noise) : noise_(std::move(noise)) {}

  std::optional<double> take(const std::string& name) {
    const auto found = noise_.numbers.find(name);
    if (found == noise_.numbers.end()) return std::nullopt;
    const double value = found->second;
    noise_.numbers.erase(found);
    return value;
  }

  std::optional<int> take_objects() { return std::exchange(noise_.objects, std::nullopt); }

  void require_empty() const {
    const std::string left = noise_.objects ? "--objects" : noise_.numbers.empty() ? "" : noise_.numbers.begin()->first;
    if (left.empty()) return;
    throw std::invalid_argument(left + " is of no use with --disturbance " + noise_.kind + "; see --help");
  }

 private:
  Noise noise_;
};

disturbances::Uniform uniform(Numbers& numbers) {
  return {numbers.take("--strength").value_or(1.0), numbers.take_objects(), numbers.take("--hold")};
}

Vector3 all_axes(const std::optional<double>& most) { return Vector3::Constant(most.value_or(0.0)); }

DisturbanceModel model_of(const std::string& kind, Numbers& numbers) {
  if (kind == "uniform") return uniform(numbers);
  if (kind == "gaussian") {
    return disturbances::Gaussian{numbers.take("--force").value_or(0.0), numbers.take("--torque").value_or(0.0),
                                  numbers.take("--correlation-time").value_or(0.1)};
  }
  if (kind == "boltzmann") return disturbances::Boltzmann{numbers.take("--rate").value_or(0.0), uniform(numbers)};
  if (kind == "plan") {
    return disturbances::OfPlan{all_axes(numbers.take("--force")), all_axes(numbers.take("--torque")),
                                numbers.take("--targets").value_or(0.0), numbers.take("--hold")};
  }
  throw std::invalid_argument("--disturbance is '" + kind + "', expected uniform, gaussian, boltzmann or plan");
}

}  // namespace

Arguments parse(const std::vector<std::string>& words) {
  Reading reading;
  Arguments& arguments = reading.arguments;
  std::vector<const Option*> given;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i].rfind("--", 0) != 0) {
      if (!arguments.file.empty()) {
        throw std::invalid_argument("two problem files given: '" + arguments.file + "' and '" + words[i] + "'");
      }
      arguments.file = words[i];
      continue;
    }
    const Option& option = option_named(words[i]);
    Value value{words[i], ""};
    if (*option.value != '\0') {
      if (i + 1 == words.size()) throw std::invalid_argument(words[i] + " has no value; see --help");
      value.text = words[++i];
    }
    option.set(reading, value);
    given.push_back(&option);
  }
  if (arguments.file.empty()) throw std::invalid_argument("no problem file given; see --help");
  require_metric(arguments.metric);
  require_one_job(arguments, given);
  if (arguments.metric == "probability") {
    Numbers numbers(reading.noise);
    arguments.probability.disturbance = model_of(reading.noise.kind, numbers);
    numbers.require_empty();
  }
  return arguments;
}

std::string help() {
  std::ostringstream text;
  text << R"(usage: energymargin_score PROBLEM.json [--metric NAME] [OPTIONS]
       energymargin_score PROBLEM.json --save COPY.json [--meshes embedded|files]
       energymargin_score --schema

Scores a problem file and prints JSON: the bits that Python gives. null: no escape was found, or there is no such set.

)";
  for (const Option& option : options()) {
    std::string head = std::string("  ") + option.name + " " + option.value;
    head.resize(std::max<std::size_t>(head.size() + 1, 24), ' ');
    const std::string of = std::string(option.of) == "all" || *option.of == '\0' ? "" : listed(option.of) + ": ";
    text << head << of << option.help << "\n";
  }
  text << R"(
examples: energymargin_score problem.json --metric effort --nodes 5000
          energymargin_score problem.json --metric probability --disturbance gaussian --force 0.5
          energymargin_score problem.json --save folder/copy.json --meshes files
)";
  return text.str();
}

}  // namespace energymargin::score
