#pragma once
// How near a rollout is to its loss, as a linear forecast of its way says.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "energymargin/signed_distance.hpp"

namespace energymargin {

//! A rollout as the coordinates of a SignedDistance, look after look. It stays where it is once it is lost.
struct Track {
  std::vector<double> coordinates{};  // of each look, one after another
  bool lost = false;                  // with the last look
};

//! The coordinates of each primitive in so many looks, from their values, gains and gains of gains of now, by least
//! squares; and the error of that. The level of a state is its distance to the edge in standard deviations of that
//! error, at the look until the horizon at which it is nearest: for linear dynamics and normal noise, the most likely
//! time and way of a loss (Dean and Dupuis, Splitting for rare event simulation: a large deviation approach to design
//! and analysis, 2009).
class Forecast {
 public:
  //! `track` ends with the state, and `left` looks are to come.
  double operator()(const Track& track, int left) const;

 private:
  friend class ForecastFit;
  struct Ahead {
    int looks;
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
  //! The tracks have at most so many looks.
  ForecastFit(const SignedDistance& distance, int looks);

  //! The states from look `first` on count: what follows them is a fair draw.
  void add(const Track& track, int first);

  //! None of too few states.
  std::optional<Forecast> fit() const;

 private:
  struct Sums {  // of a primitive
    Eigen::MatrixXd features, products, squares;
  };
  struct Ahead {
    int looks;
    int samples = 0;
    std::vector<Sums> sums{};
  };

  SignedDistance distance_;
  int looks_;
  std::vector<double> origin_;  // the start, from which coordinates count
  std::vector<Ahead> aheads_;
};

}  // namespace energymargin
