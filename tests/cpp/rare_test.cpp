// Adaptive multilevel splitting, and what it stands on: distances to the edge of a set, and draws that branch.

#include "energymargin/metrics/rare.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "energymargin/membership.hpp"
#include "energymargin/signed_distance.hpp"
#include "metrics/splitting.hpp"
#include "scenes.hpp"

namespace energymargin {
namespace {

// ---- what a few estimates are worth

// Ten that alternate between e and 1/e: their logarithms have a variance of 10/9, which ten of them know badly.
TEST(Rare, EstimatesCountTheLongTailThatAFewOfThemSeldomShow) {
  Eigen::VectorXd estimates(10);
  for (Eigen::Index i = 0; i < 10; ++i) estimates[i] = 1e-9 * std::exp(i % 2 == 0 ? 1.0 : -1.0);
  const double spread = 10.0 / 9.0;
  EXPECT_NEAR(splitting::relative_variance(estimates), std::exp(spread + spread * spread * 5.0 / 9.0) - 1.0, 1e-9);
  EXPECT_NEAR(splitting::relative_variance(Eigen::VectorXd::Constant(10, 1e-9)), 0.0, 1e-12);
}

// ---- the algorithm, on a path whose probability is known

constexpr int walk_steps = 12;
constexpr int walk_edge = 7;

// A walk on the whole numbers, of steps -1 and 1.
struct Walk {
  std::vector<int> steps{};
  std::vector<double> levels{};

  double highest() const { return *std::max_element(levels.begin(), levels.end()); }
};

// `level` of a place; the walk has happened where it has come to the edge.
Walk walk(std::vector<int> past, Random& random, const std::function<double(int)>& level) {
  Walk walk{std::move(past)};
  int place = 0;
  walk.levels.push_back(level(place));
  for (std::size_t i = 0; i < walk_steps; ++i) {
    if (i == walk.steps.size()) walk.steps.push_back(random.uniform() < 0.5 ? -1 : 1);
    place += walk.steps[i];
    const bool has_happened = place >= walk_edge || walk.levels.back() == splitting::happened;
    walk.levels.push_back(has_happened ? splitting::happened : level(place));
  }
  return walk;
}

// The reflection principle: P(max >= a) = P(end >= a) + P(end > a).
double probability_of_walk() {
  double sum = 0.0;
  for (int ups = 0; ups <= walk_steps; ++ups) {
    const int end = 2 * ups - walk_steps;
    const double share =
        std::exp(std::lgamma(walk_steps + 1) - std::lgamma(ups + 1) - std::lgamma(walk_steps - ups + 1)) /
        std::pow(2.0, walk_steps);
    sum += (end >= walk_edge ? share : 0.0) + (end > walk_edge ? share : 0.0);
  }
  return sum;
}

void expect_unbiased(const std::function<double(int)>& level, int replicas, int runs) {
  double sum = 0.0, squares = 0.0;
  for (int run = 0; run < runs; ++run) {
    Random random(1, static_cast<std::size_t>(run));
    const auto draw = [&](std::size_t) { return walk({}, random, level); };
    const auto branch = [&](const Walk& parent, double above, std::size_t) {
      std::size_t time = 0;
      while (parent.levels[time] <= above) ++time;
      const auto last = parent.steps.begin() + static_cast<std::ptrdiff_t>(time);
      return walk({parent.steps.begin(), last}, random, level);
    };
    const auto last = splitting::split<Walk>(replicas, random, draw, branch);
    const auto happened = std::count_if(last.replicas.begin(), last.replicas.end(),
                                        [](const Walk& w) { return w.highest() == splitting::happened; });
    const double estimate = last.weight * static_cast<double>(happened) / replicas;
    sum += estimate;
    squares += estimate * estimate;
  }
  const double mean = sum / runs;
  const double error = std::sqrt((squares / runs - mean * mean) / runs);
  EXPECT_NEAR(mean, probability_of_walk(), 4.0 * error) << replicas;
  EXPECT_LT(error, 0.1 * mean) << replicas;
}

TEST(Splitting, IsUnbiasedWithTiesForAnyNumberOfReplicas) {
  for (const int replicas : {2, 5, 40}) expect_unbiased([](int place) { return place; }, replicas, 80000 / replicas);
}

TEST(Splitting, IsUnbiasedForALevelThatIsOfLittleUse) {
  expect_unbiased([](int place) { return place * place % 5; }, 10, 20000);
}

// ---- distances

Scene two_bodies() {
  Scene scene(Vector3::Zero());
  Body object = scenes::body("object", Sphere{0.1}, 1.0, Vector3::Zero(), Role::object);
  object.inertial = Inertial{{0.0, 0.4, 0.3}, Vector3::Ones()};
  scene.add_body(object);
  scene.add_body(scenes::body("hand", Sphere{0.1}, 1.0, Vector3(0.0, 0.0, 3.0), Role::effector));
  return scene;
}

State random_state(const Scene& scene, Random& random) {
  std::map<std::string, BodyState> bodies;
  for (const char* name : {"object", "hand"}) {
    BodyState& body = bodies[name];
    body.position = random.within(Vector3::Constant(1.5));
    body.orientation = scenes::turn(random.uniform(-3.0, 3.0), random.within(Vector3::Ones()).normalized());
    body.velocity = random.within(Vector3::Ones());
    body.angular_velocity = random.within(Vector3::Ones());
  }
  return pack(scene, bodies);
}

TEST(SignedDistance, IsNegativeInsideAndPositiveOutside) {
  const Scene scene = two_bodies();
  regions::Swept swept{"object", "hand"};
  swept.least_speed = 0.5;
  regions::HalfSpace ahead{"object", Vector3::UnitX(), 0.2, "hand"};
  ahead.ahead = 0.5;
  regions::Speed along{"object", 0.3};
  along.along = Vector3::UnitY();
  const Region ball = regions::Ball{"object", Vector3(0.2, 0.0, 0.0), 1.0, "hand"};
  constexpr regions::Point center = regions::Point::center_of_mass;
  regions::Swept swept_center = swept;
  swept_center.point = center;
  const Region box =
      regions::Box{"object", Vector3::Zero(), Vector3(1.0, 2.0, std::numeric_limits<double>::infinity())};
  const std::vector<Region> all{ball,
                                box,
                                regions::Disc{"object", Vector2::Zero(), 1.0},
                                regions::AnnularSector{"object", Vector2::Zero(), 1.0, 0.4, 0.5, -2.0},
                                regions::AnnularSector{"object", Vector2::Zero(), 1.0, 0.4, 0.5, 6.28},
                                swept,
                                ahead,
                                regions::Speed{"object", 0.9},
                                along,
                                regions::Tilt{"object", Vector3::UnitZ(), Vector3::UnitX(), 1.0},
                                regions::Ball{"object", Vector3::Zero(), 1.0, "hand", center},
                                regions::HalfSpace{"object", Vector3::UnitX(), 0.2, "", 0.0, center},
                                swept_center,
                                ball & box,
                                ball | box,
                                ~(ball & ~box)};
  Random random(5, 0);
  const State start = pack(scene);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Membership inside(all[i], scene);
    const SignedDistance distance(all[i], scene, start);
    int count = 0;
    for (int k = 0; k < 400; ++k) {
      const State state = random_state(scene, random);
      EXPECT_EQ(distance(state) <= 0.0, inside(state)) << i;
      count += inside(state) ? 1 : 0;
    }
    EXPECT_GT(count, 10) << i;
    EXPECT_LT(count, 390) << i;
  }
}

TEST(SignedDistance, IsAShareOfTheStarts) {
  const Scene scene = two_bodies();
  const State start = pack(scene);
  const Region near = regions::Disc{"object", Vector2(0.3, 0.0), 0.5};
  const Region slow = regions::Speed{"object", 4.0};
  EXPECT_DOUBLE_EQ(SignedDistance(near & slow, scene, start)(start), -1.0);
  BodyState body;
  body.position.x() = -0.1;
  body.velocity.x() = 3.0;
  const State moved = pack(scene, {{"object", body}});
  EXPECT_DOUBLE_EQ(SignedDistance(near, scene, start)(moved), -0.5);
  EXPECT_DOUBLE_EQ(SignedDistance(near & slow, scene, start)(moved), -0.25);
  EXPECT_DOUBLE_EQ(SignedDistance(near | slow, scene, start)(moved), -0.5);
}

TEST(SignedDistance, RefusesAPredicateByName) {
  const Scene scene = two_bodies();
  const Region predicate = regions::Predicate{[](const States& states) { return Mask::Constant(states.rows(), true); }};
  try {
    SignedDistance(predicate, scene, pack(scene));
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("Predicate"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("level="), std::string::npos);
  }
}

// ---- draws that branch

constexpr int horizon = 60;

Problem pushed() {
  const Scene scene = two_bodies();
  Problem problem(scene, pack(scene), regions::Ball{"object", Vector3::Zero(), 1.0});
  problem.force = Vector3(1.0, 0.0, 0.0);
  problem.duration = 10 * scene.stepping().step;
  problem.horizon = horizon * scene.stepping().step;
  return problem;
}

double force_at(const std::vector<Push>& pushes, int step) {
  for (const Push& push : pushes) {
    if (step < push.steps) return push.wrenches[0];
    step -= push.steps;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

using Pairs = std::vector<std::pair<int, int>>;

// Means of the product of the forces in two steps, over draws or over their branches at step 14.
std::vector<double> correlations(const DisturbanceModel& model, const Pairs& pairs, bool branches) {
  const Problem problem = pushed();
  constexpr int draws = 20000;
  std::vector<double> means(pairs.size(), 0.0);
  for (std::size_t i = 0; i < draws; ++i) {
    Draw drawn = draw(model, problem, horizon, 1, i);
    if (branches) drawn = draw(model, problem, horizon, 2, i, drawn, 14);
    const std::vector<Push>& pushes = drawn.pushes;
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      means[k] += force_at(pushes, pairs[k].first) * force_at(pushes, pairs[k].second) / draws;
    }
  }
  return means;
}

TEST(BranchPushes, HaveTheLawOfADraw) {
  const Pairs pairs{{13, 14}, {10, 15}, {12, 19}, {14, 16}, {30, 30}};
  for (const DisturbanceModel& model :
       {DisturbanceModel(disturbances::Uniform{}), DisturbanceModel(disturbances::Gaussian{1.0, 0.0, 0.02})}) {
    const std::vector<double> of_draws = correlations(model, pairs, false);
    const std::vector<double> of_branches = correlations(model, pairs, true);
    for (std::size_t k = 0; k < pairs.size(); ++k) EXPECT_NEAR(of_branches[k], of_draws[k], 0.04) << k;
  }
}

TEST(BranchPushes, KeepThePast) {
  const Problem problem = pushed();
  const disturbances::Uniform model;
  int changed = 0;
  for (std::size_t i = 0; i < 50; ++i) {
    const Draw parent_draw = draw(model, problem, horizon, 1, i);
    const std::vector<Push>& parent = parent_draw.pushes;
    for (const int step : {0, 1, 25, horizon}) {
      const std::vector<Push> child = draw(model, problem, horizon, 2, i, parent_draw, step).pushes;
      for (int k = 0; k < step; ++k) EXPECT_EQ(force_at(child, k), force_at(parent, k));
      EXPECT_FALSE(std::isnan(force_at(child, horizon - 1)));
      EXPECT_TRUE(std::isnan(force_at(child, horizon)));
      changed += force_at(child, horizon - 1) != force_at(parent, horizon - 1) ? 1 : 0;
    }
  }
  EXPECT_EQ(changed, 150);
}

// ---- the probability

TEST(RareCaptureProbability, DoesNotDependOnThreads) {
  Problem problem = pushed();
  problem.captured = regions::Ball{"object", Vector3::Zero(), 0.012};
  RareOptions options;
  options.rollouts = 100;
  const CaptureProbability one = rare_capture_probability(problem, options);
  options.threads = 3;
  const CaptureProbability three = rare_capture_probability(problem, options);
  EXPECT_EQ(one.lost, three.lost);
  EXPECT_EQ(one.splitting->effective, three.splitting->effective);
  EXPECT_EQ(one.steps, three.steps);
  EXPECT_GT(one.lost[one.lost.size() - 1], 0.0);
  EXPECT_LT(one.lost[one.lost.size() - 1], 0.5);
}

}  // namespace
}  // namespace energymargin
