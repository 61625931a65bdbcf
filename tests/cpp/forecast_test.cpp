// Forecasts of a rollout's way, which the levels of rare losses are made of.

#include "metrics/forecast.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "base/random_draws.hpp"
#include "scenes.hpp"

namespace energymargin {
namespace {

constexpr int looks = 40;
constexpr double decay = 0.9;   // of a place, from look to look
constexpr double noise = 0.05;  // added in each
constexpr double edge = 1.0;

Scene free_body() {
  Scene scene(Vector3::Zero());
  scene.add_body(scenes::body("object", Sphere{0.1}, 1.0, Vector3::Zero(), Role::object));
  return scene;
}

SignedDistance distance_to_edge() {
  const Scene scene = free_body();
  return {regions::HalfSpace{"object", Vector3::UnitX(), edge}, scene, pack(scene)};
}

// x' = decay x + noise n, as heights over the half space, until it is outside.
Track walk(Random& random) {
  Track track{{-edge}};
  while (static_cast<int>(track.coordinates.size()) < looks && !track.lost) {
    const double place = track.coordinates.back() + edge;
    track.coordinates.push_back(decay * place + noise * random.normal() - edge);
    track.lost = track.coordinates.back() > 0.0;
  }
  return track;
}

Track at_rest(double place) { return {{place - edge, place - edge, place - edge}}; }

// What the law of the walk says, at the best of all times: (decay^k x - edge) / deviation after k looks.
double known_level(double place, int left) {
  double best = -1e9;
  for (int k = 1; k <= left; ++k) {
    const double variance = noise * noise * (1.0 - std::pow(decay, 2 * k)) / (1.0 - decay * decay);
    best = std::max(best, (std::pow(decay, k) * place - edge) / std::sqrt(variance));
  }
  return best;
}

TEST(Forecast, IsTheDistanceInDeviationsAtTheMostLikelyTime) {
  ForecastFit fit(distance_to_edge(), looks);
  Random random(1, 0);
  for (int i = 0; i < 2000; ++i) fit.add(walk(random), 0);
  const auto forecast = fit.fit();
  ASSERT_TRUE(forecast.has_value());
  for (const double place : {0.0, 0.3, 0.6}) {
    for (const int left : {1, 2, 5, 30}) {
      const double known = known_level(place, left);
      EXPECT_NEAR((*forecast)(at_rest(place), left), known, 0.04 * std::abs(known)) << place << " " << left;
    }
  }
}

TEST(Forecast, SeesABodyThatSwingsThroughTheMiddleOfABallAsNearerThanOneThatTurns) {
  const Scene scene = free_body();
  const SignedDistance distance(regions::Ball{"object", Vector3::Zero(), edge}, scene, pack(scene));
  ForecastFit fit(distance, looks);
  Random random(2, 0);
  constexpr double turn = 2.0 * pi / 16.0;  // from look to look
  const auto oscillate = [&](double amplitude, double phase, double error, int count) {
    Track track;
    for (int i = 0; i < count; ++i) {
      const double place = amplitude * std::sin(phase + turn * i) + error * random.normal();
      track.coordinates.insert(track.coordinates.end(), {place, 0.0, 0.0});
    }
    return track;
  };
  for (int i = 0; i < 300; ++i) fit.add(oscillate(0.5, random.uniform(0.0, 2.0 * pi), 0.001, looks), 0);
  const auto forecast = fit.fit();
  ASSERT_TRUE(forecast.has_value());
  const double swings = (*forecast)(oscillate(0.5, -2.0 * turn, 0.0, 3), looks - 3);
  const double turns = (*forecast)(oscillate(0.3, 0.5 * pi - 2.0 * turn, 0.0, 3), looks - 3);
  const double rests = (*forecast)(oscillate(0.0, 0.0, 0.0, 3), looks - 3);
  EXPECT_GT(swings, 0.9 * turns);
  EXPECT_GT(turns, 0.9 * rests);
}

TEST(Forecast, HoldsALostTrackWhereItWasLost) {
  ForecastFit fit(distance_to_edge(), looks);
  Random random(3, 0);
  for (int i = 0; i < 500; ++i) {
    Track track{std::vector<double>(15, random.uniform(0.0, 0.8) - edge), true};
    track.coordinates.push_back(0.01 * random.uniform());
    fit.add(track, 0);
  }
  const auto forecast = fit.fit();
  ASSERT_TRUE(forecast.has_value());
  EXPECT_LT((*forecast)(at_rest(0.2), 1), 0.0);
  EXPECT_GT((*forecast)(at_rest(0.2), looks - 3), 0.0);
}

TEST(Forecast, NeedsEnoughStates) {
  ForecastFit fit(distance_to_edge(), looks);
  EXPECT_FALSE(fit.fit().has_value());
  Random random(4, 0);
  fit.add(walk(random), 0);
  EXPECT_FALSE(fit.fit().has_value());
  for (int i = 0; i < 10; ++i) fit.add(walk(random), 0);
  EXPECT_TRUE(fit.fit().has_value());
}

}  // namespace
}  // namespace energymargin
