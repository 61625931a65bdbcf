#include "warnings.hpp"

namespace energymargin::binding {
namespace {

void warn_once(const std::vector<Doubt>& doubts, const std::string& fingerprint) {
  py::list pairs;
  for (const Doubt& doubt : doubts) pairs.append(py::make_tuple(doubt.about, doubt.text));
  py::module_::import("energymargin.plausibility").attr("warn")(pairs, fingerprint);
}

}  // namespace

void warn(const std::vector<Doubt>& doubts, const Scene& scene) {
  if (!doubts.empty()) warn_once(doubts, fingerprint(scene));
}

void warn_of_angle(const std::string& name, double angle) {
  if (const auto doubt = implausible_angle(name, angle)) warn_once({*doubt}, doubt->text);
}

void warn_of_density(const std::string& name, double density) {
  if (const auto doubt = implausible_density(name, density)) warn_once({*doubt}, doubt->text);
}

}  // namespace energymargin::binding
