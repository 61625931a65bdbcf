//! Warnings of the core as Python's warnings.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "energymargin/plausibility.hpp"
#include "energymargin/world.hpp"
#include "given.hpp"

namespace energymargin::binding {

//! Issues each warning, once for all states of a scene. Throws if a filter of Python makes the warning an error.
void warn(const std::vector<Warning>& warnings, const Scene& scene);

//! Issues a warning that is of no scene, if there is one.
void warn(const std::optional<Warning>& warning);

using Sentences = py::typing::Tuple<py::str, py::ellipsis>;
Sentences sentences(const std::vector<Warning>& warnings);

template <typename Result>
void def_step_counts(py::class_<Result>& type, const char* steps_doc) {
  type.def_readonly("steps", &Result::steps, steps_doc)
      .def_readonly("unconverged", &Result::unconverged, "Of these, steps whose contact solver did not converge.")
      .def_readonly("lost_time", &Result::lost_time,
                    "Time in which nothing moved, as bodies would have passed through each other [s].");
}

//! What a result made of rollouts says about its steps, and its warnings, of which `example` is one.
template <typename Result>
void def_quality(py::class_<Result>& type, const std::string& example) {
  def_step_counts(type, "Simulation steps of its rollouts.");
  type.def_property_readonly(
      "warnings", [](const Result& result) { return sentences(result.warnings); },
      ("Sentences that speak against the result: " + example +
       "more than 1 % of the steps did not converge, or of the time is lost.")
          .c_str());
}

}  // namespace energymargin::binding
