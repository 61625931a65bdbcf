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

namespace energymargin::score {

//! What was asked for: the library's own options, one set a metric.
struct Arguments {
  std::string file;
  std::string metric = "capture";
  CaptureOptions capture{};
  EffortOptions effort{};
  ProbabilityOptions probability{};
  EscapeEnergyOptions escape_energy{};
  std::optional<double> timeout{};
  std::string copy{};  //!< where to save to; empty: score
  std::optional<Meshes> meshes{};
};

//! Throws std::invalid_argument, in one line, on what cannot be: an option that does not exist, a value of another
//! kind, an option of another metric.
Arguments parse(const std::vector<std::string>& words);

//! The text of --help.
std::string help();

}  // namespace energymargin::score
