// A Problem from JSON.

#include "problem_io/read.hpp"

#include "energymargin/problem_io.hpp"
#include "problem_io/names.hpp"

namespace energymargin::problem_io {
namespace {

int read_version(const Place& place) {
  if (!place.has("format") || place["format"].word() != format_name) {
    throw std::invalid_argument("it has no \"format\": \"" + std::string(format_name) + "\", so it is no problem file");
  }
  const int version = place["version"].integer();
  if (version > problem_format_version) {
    place["version"].fail("at most " + std::to_string(problem_format_version) +
                          "; a newer energymargin wrote this file");
  }
  if (version < 1) place["version"].fail("a whole number from 1 to " + std::to_string(problem_format_version));
  return version;
}

State read_state(const Place& place) {
  const std::vector<Place> numbers = place.items();
  State state(static_cast<Eigen::Index>(numbers.size()));
  for (std::size_t i = 0; i < numbers.size(); ++i) state[static_cast<Eigen::Index>(i)] = numbers[i].number();
  return state;
}

ForceWeights read_force_weights(const Place& place) {
  place.only({"engage", "stick", "distance", "ground_engage", "ground_stick"});
  return {place["engage"].number(), place["stick"].number(), place["distance"].number(),
          place["ground_engage"].number(), place["ground_stick"].number()};
}

// A horizon, a plan, and how the capture set is looked at.
void read_clock(const Place& place, int version, Problem& problem) {
  for (const char* key : {"horizon", "check", "dwell", "plan"}) {
    if (version >= version_with_clock || !place.has(key)) continue;
    throw std::invalid_argument("problem has \"" + std::string(key) + "\", expected only from \"version\": " +
                                std::to_string(version_with_clock) + " on; this file says " + std::to_string(version));
  }
  if (place.has("horizon")) problem.horizon = place["horizon"].number();
  if (place.has("check")) problem.check = place["check"].number();
  if (place.has("dwell")) problem.dwell = place["dwell"].number();
  if (place.has("plan")) problem.plan = read_plan(place["plan"], &problem.scene);
}

Contact read_contact(const Place& place, const Scene& scene) {
  place.only({"body_a", "body_b", "position", "normal", "distance", "normal_force", "tangential_force", "friction"});
  return {read_body_name(place["body_a"], scene),
          read_body_name(place["body_b"], scene),
          place["position"].vector3(),
          place["normal"].vector3(),
          place["distance"].number(),
          place["normal_force"].number(),
          place["tangential_force"].vector3(),
          place["friction"].number()};
}

}  // namespace

Plan read_plan(const Json& json) { return read_plan(Place(json, "plan"), nullptr); }

Problem read_problem(const Json& json, const std::string& folder) {
  const Place place(json, "problem");
  const int version = read_version(place);
  place.only({"$schema",  "format",       "version",       "scene",   "state",    "force", "torque",
              "duration", "captured",     "succeeded",     "within",  "effector", "rate",  "force_weights",
              "contacts", "captured_any", "succeeded_any", "horizon", "check",    "dwell", "plan"});
  if (place.has("$schema")) place["$schema"].word();
  const Scene scene = read_scene(place["scene"], version, folder);
  State state = read_state(place["state"]);
  const Vector3 force = place["force"].vector3();
  const Vector3 torque = place["torque"].vector3();
  const double duration = place["duration"].number();
  Problem problem(scene, std::move(state), read_region(place["captured"], scene));
  problem.force = force;
  problem.torque = torque;
  problem.duration = duration;
  if (place.has("succeeded")) problem.succeeded = read_region(place["succeeded"], scene);
  if (place.has("within")) problem.within = read_region(place["within"], scene);
  if (place.has("captured_any")) problem.captured_any = read_region(place["captured_any"], scene);
  if (place.has("succeeded_any")) problem.succeeded_any = read_region(place["succeeded_any"], scene);
  problem.effector = place["effector"].one_of(effectors);
  problem.rate = place["rate"].number();
  if (place.has("force_weights")) problem.force_weights = read_force_weights(place["force_weights"]);
  if (place.has("contacts")) {
    problem.contacts.emplace();
    for (const Place& contact : place["contacts"].items()) problem.contacts->push_back(read_contact(contact, scene));
  }
  read_clock(place, version, problem);
  return problem;
}

}  // namespace energymargin::problem_io
