#pragma once
// How near a rollout is to its loss, as a linear forecast of its way says.

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <vector>

#include "energymargin/signed_distance.hpp"

namespace energymargin {

//! A rollout as the coordinates of a SignedDistance, one check time after another. It stays where it is once lost.
struct Track {
  std::vector<double> coordinates{};  // of each check time, one after another
  bool lost = false;                  // with the last check time
};

//! The coordinates of each primitive in so many check times, from their values, gains and gains of gains of now, by
//! least squares; and the error of that. The level of a state is its distance to the edge in standard deviations of
//! that error, at the check time until the horizon at which it is nearest: for linear dynamics and normal noise, the
//! most likely time and way of a loss (Dean and Dupuis, Splitting for rare event simulation, 2009).
class Forecast {
 public:
  //! `track` ends with the state, and `left` check times are to come.
  double operator()(const Track& track, int left) const {
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

 private:
  friend class ForecastFit;

  static constexpr int lags = 3;                  // a value, a rate, and what the rate gains
  static constexpr double time_ratio = 1.3;       // of one time ahead to the one before
  static constexpr int samples_a_feature = 20;    // fewer tell too little
  static constexpr double ridge = 1e-9;           // of the mean square of each feature
  static constexpr double least_variance = 1e-9;  // of the mean square of what is forecast

  static int features_of(int coordinates) { return 1 + lags * coordinates; }

  // Of a primitive's coordinates at a check time, which has at least `lags` - 1 before it, or counts as at rest. `now`
  // points to them in the track, whose check times are `stride` numbers long.
  static void write_features(const double* now, const double* origin, int check, int size, std::ptrdiff_t stride,
                             double* to) {
    *to++ = 1.0;
    for (int i = 0; i < size; ++i) {
      const double gain = check >= 1 ? now[i] - now[i - stride] : 0.0;
      const double gain_before = check >= 2 ? now[i - stride] - now[i - 2 * stride] : gain;
      *to++ = now[i] - origin[i];
      *to++ = gain;
      *to++ = gain - gain_before;
    }
  }

  static double largest_deviation(const Eigen::MatrixXd& features, const Eigen::MatrixXd& products,
                                  const Eigen::MatrixXd& squares, const Eigen::MatrixXd& coefficients, int samples) {
    const Eigen::MatrixXd fitted = products.transpose().lazyProduct(coefficients);
    const Eigen::MatrixXd of_features = features.lazyProduct(coefficients);
    const Eigen::MatrixXd explained = coefficients.transpose().lazyProduct(of_features);
    const Eigen::MatrixXd error = (squares - fitted - fitted.transpose() + explained) / samples;
    const double largest = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(error).eigenvalues().maxCoeff();
    const double least = std::max(least_variance * squares.trace() / samples, std::numeric_limits<double>::min());
    return std::sqrt(std::max(largest, least));
  }

  struct Ahead {
    int checks;
    std::vector<Eigen::MatrixXd> coefficients;  // of each primitive: a row a feature, a column a coordinate
    std::vector<double> deviations;             // of each primitive: the largest along any direction
  };

  explicit Forecast(const SignedDistance& distance) : distance_(distance) {}

  SignedDistance distance_;
  std::vector<double> origin_;
  std::vector<Ahead> aheads_;
};

//! Sums of least squares over tracks.
class ForecastFit {
 public:
  //! The tracks have at most so many check times.
  ForecastFit(const SignedDistance& distance, int checks) : distance_(distance), checks_(checks) {
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

  //! The states from check time `first` on count: what follows them is a fair draw.
  void add(const Track& track, int first) {
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

  //! None of too few states.
  std::optional<Forecast> fit() const {
    const std::vector<int>& sizes = distance_.sizes();
    const int needed =
        Forecast::samples_a_feature * Forecast::features_of(*std::max_element(sizes.begin(), sizes.end()));
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

 private:
  struct Sums {  // of a primitive
    Eigen::MatrixXd features, products, squares;
  };
  struct Ahead {
    int checks;
    int samples = 0;
    std::vector<Sums> sums{};
  };

  SignedDistance distance_;
  int checks_;
  std::vector<double> origin_;  // the start, from which coordinates count
  std::vector<Ahead> aheads_;
};

}  // namespace energymargin
