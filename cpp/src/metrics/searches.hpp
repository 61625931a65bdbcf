#pragma once
// The searches that a batch makes for the metrics that it is asked for, by their names.

#include <string>
#include <vector>

#include "energymargin/batch.hpp"

namespace energymargin {

//! Names of the metrics that one search gives.
using SearchMetrics = std::vector<std::string>;

//! Throws std::invalid_argument on an unknown metric, or none.
void require_metrics(const std::vector<std::string>& metrics);

//! One search a tree, one for all probabilities, one an effort, and the force score.
std::vector<SearchMetrics> searches_for(const std::vector<std::string>& metrics);

//! Adds the scores of one search to the row of its problem, and its time at the first metric.
void run_search(const Problem& problem, const SearchMetrics& metrics, const BatchOptions& options, ScoreRow& row);

}  // namespace energymargin
