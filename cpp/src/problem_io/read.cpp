// A Problem from JSON.

#include "energymargin/problem_io.hpp"
#include "problem/records.hpp"
#include "problem_io/format.hpp"
#include "problem_io/read_record.hpp"

namespace energymargin::problem_io {
namespace {

int read_version(const JsonNode& node) {
  if (!node.has("format") || node["format"].text() != format_name) {
    throw std::invalid_argument("it has no \"format\": \"" + std::string(format_name) + "\", so it is no problem file");
  }
  const int version = node["version"].integer();
  if (version > problem_format_version) {
    node["version"].fail("at most " + std::to_string(problem_format_version) +
                         "; a newer energymargin wrote this file");
  }
  if (version < oldest_problem_format_version) {
    node["version"].fail("a whole number from " + std::to_string(oldest_problem_format_version) + " to " +
                         std::to_string(problem_format_version));
  }
  return version;
}

State read_state(const JsonNode& node) {
  const std::vector<JsonNode> numbers = node.items();
  State state(static_cast<Eigen::Index>(numbers.size()));
  for (std::size_t i = 0; i < numbers.size(); ++i) state[static_cast<Eigen::Index>(i)] = numbers[i].number();
  return state;
}

// A horizon, a plan, and how the capture set is looked at.
void read_clock(const JsonNode& node, int version, Problem& problem) {
  for (const char* key : {"horizon", "check", "dwell", "plan"}) {
    require_version(node, key, version_with_clock, version);
  }
  if (node.has("horizon")) problem.horizon = node["horizon"].number();
  if (node.has("check")) problem.check = node["check"].number();
  if (node.has("dwell")) problem.dwell = node["dwell"].number();
  if (node.has("plan")) problem.plan = read_plan(node["plan"], &problem.scene);
}

}  // namespace

void require_version(const JsonNode& node, const char* key, int since, int version) {
  if (version >= since || !node.has(key)) return;
  throw std::invalid_argument(node.path() + " has \"" + std::string(key) + "\", expected only from \"version\": " +
                              std::to_string(since) + " on; this file says " + std::to_string(version));
}

Plan read_plan(const Json& json) { return read_plan(JsonNode(json, "plan"), nullptr); }

Problem read_problem(const Json& json, const std::string& folder) {
  const JsonNode node(json, "problem");
  const int version = read_version(node);
  node.allow_keys({"$schema",  "format",       "version",       "scene",   "state",    "force", "torque",
                   "duration", "captured",     "succeeded",     "within",  "effector", "rate",  "force_weights",
                   "contacts", "captured_any", "succeeded_any", "horizon", "check",    "dwell", "plan"});
  if (node.has("$schema")) node["$schema"].text();
  const Scene scene = read_scene(node["scene"], version, folder);
  State state = read_state(node["state"]);
  const Vector3 force = node["force"].vector3();
  const Vector3 torque = node["torque"].vector3();
  const double duration = node["duration"].number();
  Problem problem(scene, std::move(state), read_region(node["captured"], scene));
  problem.force = force;
  problem.torque = torque;
  problem.duration = duration;
  if (node.has("succeeded")) problem.succeeded = read_region(node["succeeded"], scene);
  if (node.has("within")) problem.within = read_region(node["within"], scene);
  if (node.has("captured_any")) problem.captured_any = read_region(node["captured_any"], scene);
  if (node.has("succeeded_any")) problem.succeeded_any = read_region(node["succeeded_any"], scene);
  problem.effector = node["effector"].one_of<Effector>();
  problem.rate = node["rate"].number();
  const RecordReader records(&scene);
  if (node.has("force_weights")) problem.force_weights = records.record<ForceWeights>(node["force_weights"]);
  if (node.has("contacts")) {
    problem.contacts.emplace();
    for (const JsonNode& contact : node["contacts"].items()) {
      problem.contacts->push_back(records.record<Contact>(contact));
    }
  }
  read_clock(node, version, problem);
  return problem;
}

}  // namespace energymargin::problem_io
