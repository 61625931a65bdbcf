#include "metrics/forecast.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace energymargin {

double Forecast::operator()(const Track& track, int left) const {
  const std::vector<int>& sizes = distance_.sizes();
  const auto stride = static_cast<std::ptrdiff_t>(origin_.size());
  const auto check = static_cast<int>(track.coordinates.size() / origin_.size()) - 1;
  const double* now = track.coordinates.data() + check * stride;
  std::vector<double> features(static_cast<std::size_t>(features_of(*std::max_element(sizes.begin(), sizes.end()))));
  std::vector<double> then(origin_.size());
  double highest = -std::numeric_limits<double>::infinity();
  for (const Ahead& ahead : aheads_) {
    if (ahead.checks > left) break;
    std::ptrdiff_t first = 0;
    for (std::size_t i = 0; i < sizes.size(); first += sizes[i++]) {
      write_features(now + first, origin_.data() + first, check, sizes[i], stride, features.data());
      const Eigen::MatrixXd& coefficients = ahead.coefficients[i];
      for (int k = 0; k < sizes[i]; ++k) {
        double gain = 0.0;
        for (Eigen::Index j = 0; j < coefficients.rows(); ++j) {
          gain += features[static_cast<std::size_t>(j)] * coefficients(j, k);
        }
        then[static_cast<std::size_t>(first + k)] = origin_[static_cast<std::size_t>(first + k)] + gain;
      }
    }
    highest = std::max(highest, distance_.at(then.data(), ahead.deviations.data()));
  }
  return std::min(highest, std::numeric_limits<double>::max());  // not yet lost
}

double Forecast::largest_deviation(const Eigen::MatrixXd& features, const Eigen::MatrixXd& products,
                                   const Eigen::MatrixXd& squares, const Eigen::MatrixXd& coefficients, int samples) {
  const Eigen::MatrixXd fitted = products.transpose().lazyProduct(coefficients);
  const Eigen::MatrixXd of_features = features.lazyProduct(coefficients);
  const Eigen::MatrixXd explained = coefficients.transpose().lazyProduct(of_features);
  const Eigen::MatrixXd error = (squares - fitted - fitted.transpose() + explained) / samples;
  const double largest = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(error).eigenvalues().maxCoeff();
  const double least = std::max(least_variance * squares.trace() / samples, std::numeric_limits<double>::min());
  return std::sqrt(std::max(largest, least));
}

ForecastFit::ForecastFit(const SignedDistance& distance, int checks) : distance_(distance), checks_(checks) {
  for (double next = 1.0; std::lround(next) < checks; next *= Forecast::time_ratio) {
    const auto ahead = static_cast<int>(std::lround(next));
    if (!aheads_.empty() && aheads_.back().checks == ahead) continue;
    aheads_.push_back({ahead});
    for (const int size : distance.sizes()) {
      const int features = Forecast::features_of(size);
      aheads_.back().sums.push_back({Eigen::MatrixXd::Zero(features, features), Eigen::MatrixXd::Zero(features, size),
                                     Eigen::MatrixXd::Zero(size, size)});
    }
  }
}

void ForecastFit::add(const Track& track, int first) {
  const std::vector<int>& sizes = distance_.sizes();
  const auto stride = static_cast<std::ptrdiff_t>(std::accumulate(sizes.begin(), sizes.end(), 0));
  if (origin_.empty()) origin_.assign(track.coordinates.begin(), track.coordinates.begin() + stride);
  const int last = static_cast<int>(static_cast<std::ptrdiff_t>(track.coordinates.size()) / stride) - 1;
  Eigen::VectorXd features;
  Eigen::VectorXd then;
  for (int check = std::max(first, Forecast::lags - 1); check <= last; ++check) {
    const int farthest = track.lost ? checks_ - 1 - check : last - check;
    std::ptrdiff_t offset = 0;
    for (std::size_t i = 0; i < sizes.size(); offset += sizes[i++]) {
      const double* origin = origin_.data() + offset;
      features.resize(Forecast::features_of(sizes[i]));
      Forecast::write_features(track.coordinates.data() + check * stride + offset, origin, check, sizes[i], stride,
                               features.data());
      for (Ahead& ahead : aheads_) {
        if (ahead.checks > farthest) break;
        const double* at = track.coordinates.data() + std::min(check + ahead.checks, last) * stride + offset;
        then = Eigen::Map<const Eigen::VectorXd>(at, sizes[i]) - Eigen::Map<const Eigen::VectorXd>(origin, sizes[i]);
        Sums& sums = ahead.sums[i];
        sums.features += features.lazyProduct(features.transpose());
        sums.products += features.lazyProduct(then.transpose());
        sums.squares += then.lazyProduct(then.transpose());
        if (i == 0) ++ahead.samples;
      }
    }
  }
}

std::optional<Forecast> ForecastFit::fit() const {
  const std::vector<int>& sizes = distance_.sizes();
  const int needed = Forecast::samples_a_feature * Forecast::features_of(*std::max_element(sizes.begin(), sizes.end()));
  Forecast forecast(distance_);
  forecast.origin_ = origin_;
  for (const Ahead& ahead : aheads_) {
    if (ahead.samples < needed) break;
    forecast.aheads_.push_back({ahead.checks, {}, {}});
    for (const Sums& sums : ahead.sums) {
      Eigen::MatrixXd squares = sums.features;
      squares.diagonal() *= 1.0 + Forecast::ridge;
      squares.diagonal().array() += std::numeric_limits<double>::min();
      const Eigen::MatrixXd coefficients = squares.ldlt().solve(sums.products);
      if (!coefficients.allFinite()) return std::nullopt;
      forecast.aheads_.back().coefficients.push_back(coefficients);
      forecast.aheads_.back().deviations.push_back(
          Forecast::largest_deviation(sums.features, sums.products, sums.squares, coefficients, ahead.samples));
    }
  }
  if (forecast.aheads_.empty()) return std::nullopt;
  return forecast;
}

}  // namespace energymargin
