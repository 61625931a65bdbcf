#pragma once
// The command line of energymargin_score.

#include <optional>
#include <string>
#include <vector>

#include "energymargin/metrics/capture.hpp"
#include "energymargin/metrics/effort.hpp"
#include "energymargin/metrics/escape_energy.hpp"
#include "energymargin/metrics/probability.hpp"
#include "energymargin/problem_io.hpp"

namespace energymargin::app {

//! The question: the library's own options, for each metric.
struct Arguments {
  std::string file;
  std::string metric = "capture";
  std::optional<EngineKind> engine{};  //!< unset: the problem's
  CaptureOptions capture{};
  EffortOptions effort{};
  ProbabilityOptions probability{};
  EscapeEnergyOptions escape_energy{};
  std::optional<ForceWeights> force_weights{};  //!< unset: the problem's
  std::optional<double> timeout{};
  std::string copy{};  //!< the file to save to; empty: score
  Meshes meshes = Meshes::embedded;
};

//! Throws std::invalid_argument, in one line, on an unknown option, a bad value, or an option of another metric.
Arguments parse(const std::vector<std::string>& words);

//! The text of --help.
std::string help();

}  // namespace energymargin::app
