#include "warnings.hpp"

namespace energymargin::binding {
namespace {

void warn_once(const std::vector<Warning>& warnings, const std::string& fingerprint) {
  py::list pairs;
  for (const Warning& warning : warnings) pairs.append(py::make_tuple(warning.about, warning.text));
  py::module_::import("energymargin.plausibility").attr("warn")(pairs, fingerprint);
}

}  // namespace

void warn(const std::vector<Warning>& warnings, const Scene& scene) {
  if (!warnings.empty()) warn_once(warnings, fingerprint(scene));
}

void warn(const std::optional<Warning>& warning) {
  if (warning) warn_once({*warning}, warning->text);
}

Sentences sentences(const std::vector<Warning>& warnings) {
  py::list texts;
  for (const Warning& warning : warnings) texts.append(warning.text);
  return py::tuple(texts);
}

}  // namespace energymargin::binding
