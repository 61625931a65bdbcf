#include "disturbance.hpp"

#include <optional>
#include <stdexcept>
#include <utility>

namespace energymargin::app {
namespace {

// Removes an option, so that those of another kind remain.
std::optional<Value> take(DisturbanceOptions& options, const std::string& name) {
  auto option = options.extract(name);
  return option ? std::optional(std::move(option.mapped())) : std::nullopt;
}

std::optional<double> take_number(DisturbanceOptions& options, const std::string& name) {
  const std::optional<Value> value = take(options, name);
  return value ? std::optional(value->number()) : std::nullopt;
}

Vector3 take_axes(DisturbanceOptions& options, const std::string& name) {
  const std::optional<Value> value = take(options, name);
  return value ? value->axes() : Vector3(Vector3::Zero());
}

disturbances::Uniform uniform(DisturbanceOptions& options) {
  disturbances::Uniform model;
  model.strength = take_number(options, "--strength").value_or(model.strength);
  if (const std::optional<Value> objects = take(options, "--objects")) model.objects = objects->count();
  model.hold = take_number(options, "--hold");
  return model;
}

disturbances::Gaussian gaussian(DisturbanceOptions& options) {
  disturbances::Gaussian model;
  model.force = take_number(options, "--force").value_or(model.force);
  model.torque = take_number(options, "--torque").value_or(model.torque);
  model.correlation_time = take_number(options, "--correlation-time").value_or(model.correlation_time);
  return model;
}

disturbances::ActuationNoise of_plan(DisturbanceOptions& options) {
  disturbances::ActuationNoise model;
  model.force = take_axes(options, "--force");
  model.torque = take_axes(options, "--torque");
  model.targets = take_number(options, "--targets").value_or(model.targets);
  model.hold = take_number(options, "--hold");
  return model;
}

DisturbanceModel model_of(const std::string& kind, DisturbanceOptions& options) {
  require_word("--disturbance", kind, {"uniform", "gaussian", "boltzmann", "plan"}, "");
  if (kind == "uniform") return uniform(options);
  if (kind == "gaussian") return gaussian(options);
  if (kind == "plan") return of_plan(options);
  const double rate = take_number(options, "--rate").value_or(0.0);
  return disturbances::Boltzmann{rate, uniform(options)};
}

}  // namespace

DisturbanceModel disturbance_model(const std::string& kind, DisturbanceOptions options) {
  const DisturbanceModel model = model_of(kind, options);
  if (options.empty()) return model;
  throw std::invalid_argument(options.begin()->first + " is of no use with --disturbance " + kind + "; see --help");
}

}  // namespace energymargin::app
