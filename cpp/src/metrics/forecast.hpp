#pragma once
// How near a rollout is to its loss, as a linear forecast of its way says.

#include <Eigen/Core>
#include <cstddef>
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
  double operator()(const Track& track, int left) const;

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
                                  const Eigen::MatrixXd& squares, const Eigen::MatrixXd& coefficients, int samples);

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
  ForecastFit(const SignedDistance& distance, int checks);

  //! The states from check time `first` on count: what follows them is a fair draw.
  void add(const Track& track, int first);

  //! None of too few states.
  std::optional<Forecast> fit() const;

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
