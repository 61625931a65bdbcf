// Several objects: wrenches, trees, escapes and scores.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "energymargin/batch.hpp"
#include "energymargin/membership.hpp"
#include "energymargin/metrics/capture.hpp"
#include "energymargin/metrics/effort.hpp"
#include "energymargin/metrics/force.hpp"
#include "energymargin/random.hpp"
#include "energymargin/search/bounded_problem.hpp"
#include "mechanisms.hpp"
#include "search/cost_space.hpp"
#include "search_checks.hpp"

namespace energymargin {
namespace {

using namespace scenes;

// A block that rails let move up and down only; to escape it must be lifted by `height`.
Body lifted(const std::string& name, double mass, double x) {
  Body block = body(name, Box{{0.2, 0.2, 0.2}}, mass, {x, 0.0, 0.1}, Role::object);
  block.linear_factor = Vector3::UnitZ();
  block.angular_factor = Vector3::Zero();
  return block;
}

Region below(const std::string& name, double height) {
  return regions::HalfSpace{name, Vector3::UnitZ(), 0.1 + height};
}

constexpr double light = 0.5;   // [kg]
constexpr double heavy = 1.0;   // [kg]
constexpr double height = 0.1;  // [m]

// Two blocks that lie far apart: the light one costs half of what the heavy one does.
Problem two_lifts() {
  Scene scene;
  scene.add_body(fixed("floor", Plane{}));
  scene.add_body(lifted("light", light, 0.0));
  scene.add_body(lifted("heavy", heavy, 5.0));
  Problem problem =
      problem_of(scene, {0.0, 0.0, 20.0}, Vector3::Zero(), 0.3, below("light", height) & below("heavy", height));
  problem.captured_any = below("light", height) | below("heavy", height);
  return problem;
}

// Two free bodies that drift in discs, without gravity.
Problem two_drifts() {
  Scene scene(Vector3::Zero());
  scene.add_body(body("one", Box{{0.2, 0.2, 0.1}}, 1.0, Vector3::Zero(), Role::object));
  scene.add_body(body("two", Box{{0.2, 0.2, 0.1}}, 2.0, {3.0, 0.0, 0.0}, Role::object));
  const Region one = regions::Disc{"one", {0.0, 0.0}, 0.2};
  const Region two = regions::Disc{"two", {3.0, 0.0}, 0.2};
  Problem problem = problem_of(scene, {1.0, 1.0, 0.0}, {0.0, 0.0, 0.01}, 0.5, one & two);
  problem.captured_any = one | two;
  const Region moved = regions::HalfSpace{"one", -Vector3::UnitX(), -0.05};
  const Region moved_too = regions::HalfSpace{"two", -Vector3::UnitX(), -3.02};
  problem.succeeded = moved & moved_too;
  problem.succeeded_any = moved | moved_too;
  return problem;
}

// A pusher that moves towards two pucks on a table.
Problem pushed_pair(Effector effector = Effector::drive) {
  Scene scene;
  scene.add_body(fixed("table", Plane{}));
  scene.add_body(body("one", Box{{0.1, 0.1, 0.05}}, 0.3, {-0.07, 0.1, 0.025}, Role::object, 0.3));
  scene.add_body(body("two", Cylinder{0.05, 0.05}, 0.2, {0.07, 0.1, 0.025}, Role::object, 0.3));
  Body pusher = body("effector", Box{{0.4, 0.05, 0.05}}, 4.0, {0.0, 0.0, 0.025}, Role::effector, 0.3);
  pusher.state.velocity = {0.0, 0.3, 0.0};
  scene.add_body(pusher);
  const Region one = regions::Disc{"one", {-0.07, 0.1}, 0.1};
  const Region two = regions::Disc{"two", {0.07, 0.1}, 0.1};
  Problem problem = problem_of(scene, {0.4, 0.4, 0.0}, {0.0, 0.0, 0.01}, 0.4, one & two);
  problem.captured_any = one | two;
  problem.effector = effector;
  return problem;
}

Wrench force(double x, double y = 0.0, double z = 0.0) { return {{x, y, z}, Vector3::Zero()}; }

// ---- rollouts

TEST(SeveralObjects, EachIsMovedByItsOwnWrenchAndTheirEffortsAndWorksAddUp) {
  const Problem problem = two_drifts();
  World world(problem.scene);
  std::map<std::string, BodyState> bodies = unpack(problem.scene, problem.state).bodies;
  bodies["one"].velocity.x() = -1.0;
  const State start = pack(problem.scene, bodies);
  // The first is braked and sped up again, the second starts from rest.
  const Rollout rollout = world.rollout(start, {force(1.0), force(0.0, 3.0)}, 2.0);
  const Unpacked end = unpack(problem.scene, rollout.state);
  EXPECT_NEAR(end.bodies.at("one").velocity.x(), 1.0, 1e-12);
  EXPECT_NEAR(end.bodies.at("two").velocity.y(), 3.0, 1e-12);
  EXPECT_NEAR(rollout.effort, 1.0 + 0.5 * 2.0 * 9.0, 1e-9);
  EXPECT_NEAR(rollout.work, 0.0 + 0.5 * 2.0 * 9.0, 1e-9);
  EXPECT_NEAR(rollout.energy - world.energy(start), rollout.work, 1e-9);
}

TEST(SeveralObjects, EffortOfOneAloneIsWhatItIsInASceneOfItsOwn) {
  const Problem problem = two_drifts();
  Wrench wrench = force(0.7, -0.4);
  wrench.torque.z() = 0.01;
  Scene alone(Vector3::Zero());
  alone.add_body(problem.scene.body("two"));
  const Rollout expected = World(alone).rollout(pack(alone), {wrench}, 1.0);
  const Rollout rollout = World(problem.scene).rollout(problem.state, {Wrench{}, wrench}, 1.0);
  EXPECT_NEAR(rollout.effort, expected.effort, 1e-12);
  EXPECT_LT((rollout.state.tail<13>() - expected.state).norm(), 1e-12);
  EXPECT_TRUE(rollout.state.head<13>().isApprox(problem.state.head<13>()));
}

TEST(SeveralObjects, EveryFreeObjectNeedsItsWrench) {
  const Problem problem = two_drifts();
  World world(problem.scene);
  const auto with = [&](const Disturbance& wrenches) {
    return [&world, &problem, wrenches] { world.rollout(problem.state, wrenches, 0.1); };
  };
  EXPECT_TRUE(rejects([&] { world.rollout(problem.state, {Wrench{}}, 0.1); }, {"wrenches", "1", "2, one an object"}));
  EXPECT_TRUE(rejects(with({}), {"wrenches", "0", "2, one an object"}));
  EXPECT_TRUE(rejects(with(Disturbance(3)), {"wrenches", "3", "2, one an object"}));
  EXPECT_TRUE(rejects(with({force(1.0), force(nan)}), {"wrench force", "nan", "finite"}));
  EXPECT_NO_THROW(with(Disturbance(2))());
}

// ---- controls and samples

TEST(SeveralObjects, TreeHasSixNumbersOfControlForEachAndReplaysToTheSameBits) {
  for (const Problem& problem : {two_drifts(), pushed_pair(), pushed_pair(Effector::coast)}) {
    CaptureOptions options;
    options.nodes = 150;
    const Tree tree = capture_score(problem, options).trees.front();
    EXPECT_EQ(tree.controls.cols(), 12);
    EXPECT_EQ(tree.size(), 151);
    expect_each_edge_is_a_rollout(tree, problem);
    expect_controls_within_bounds(tree, problem);
  }
}

TEST(SeveralObjects, DisturbancesActOnAllOrOnOneAlone) {
  const Problem problem = two_drifts();
  CaptureOptions options;
  options.nodes = 400;
  const Tree tree = capture_score(problem, options).trees.front();
  int all = 0;
  int first = 0;
  int second = 0;
  for (int node = 1; node < tree.size(); ++node) {
    const bool one = !tree.controls.row(node).head<6>().isZero(0.0);
    const bool two = !tree.controls.row(node).tail<6>().isZero(0.0);
    EXPECT_TRUE(one || two) << "node " << node;
    all += one && two ? 1 : 0;
    first += one && !two ? 1 : 0;
    second += two && !one ? 1 : 0;
  }
  // Half of them alone; within four standard deviations.
  EXPECT_NEAR(all, 200, 40);
  EXPECT_NEAR(first, 100, 35);
  EXPECT_NEAR(second, 100, 35);
}

TEST(SeveralObjects, DistanceIsTheMeanOverTheObjectsOfItsSquare) {
  const Problem problem = two_drifts();
  const search::CostSpace space(problem, 0);
  ASSERT_EQ(space.scales().size(), 2u);
  EXPECT_NEAR(space.scales()[0].position, 2.0 * space.scales()[1].position, 1e-12);  // of half the mass
  search::CostSpace::StateType from, to;
  from.objects = to.objects = space.starts();
  to.objects[0].position.x() += 3.0 * space.scales()[0].position;
  EXPECT_NEAR(space.distance(&from, &to), 3.0 / std::sqrt(2.0), 1e-12);
  to.objects[1].position.y() -= 4.0 * space.scales()[1].position;
  EXPECT_NEAR(space.distance(&from, &to), 5.0 / std::sqrt(2.0), 1e-12);
  EXPECT_FALSE(space.equalStates(&from, &to));
}

// Where a node lies in the grid of EST's density if the objects are displaced so from their starts, in longest edges.
Eigen::VectorXi cell(const search::BoundedProblem& bounded, const std::vector<Vector3>& displaced) {
  const auto& space = *bounded.space_information()->getStateSpace()->as<search::CostSpace>();
  search::CostSpace::StateType state;
  state.objects = space.starts();
  for (std::size_t i = 0; i < displaced.size(); ++i) {
    state.objects[i].position += space.scales()[i].position * displaced[i];
  }
  Eigen::VectorXi coordinates(space.getDefaultProjection()->getDimension());
  space.getDefaultProjection()->computeCoordinates(&state, coordinates);
  return coordinates;
}

TEST(SeveralObjects, OppositeMotionsLieInAnotherCellOfEstsGridThanTheStartAndThanEachOther) {
  const Problem problem = two_drifts();
  const search::BoundedProblem bounded(problem, nullptr, 1, 0);
  const Vector3 rest = Vector3::Zero();
  const Vector3 right = Vector3::UnitX();
  const std::vector<std::vector<Vector3>> motions{{rest, rest},  {right, -right}, {-right, right},
                                                  {right, rest}, {rest, right},   {right, right}};
  for (const auto& one : motions) {
    for (const auto& other : motions) {
      EXPECT_EQ(cell(bounded, one) == cell(bounded, other), one == other);
    }
  }
}

TEST(SeveralObjects, NodeThatIsFarAwayLiesInTheLastCellOfEstsGridAndNanInNone) {
  const Problem problem = two_drifts();
  const search::BoundedProblem bounded(problem, nullptr, 1, 0);
  const auto displaced = [&](double x, double y) { return cell(bounded, {Vector3(x, y, 0.0)}); };
  using Cell = std::numeric_limits<int>;
  for (const double far : {1e9, 1e300, infinity}) {
    EXPECT_EQ(displaced(far, -far).head<3>(), Eigen::Vector3i(Cell::max(), Cell::min(), 0)) << far;
  }
  EXPECT_EQ(displaced(1e6 + 0.05, -1e6 + 0.05).head<3>(), Eigen::Vector3i(8'000'000, -8'000'000, 0));
  EXPECT_THROW(displaced(nan, 0.0), std::domain_error);
}

// ---- escapes

TEST(SeveralObjects, FirstOneIsOutForTheWeightOfTheLightestAndTheLastForThatOfAll) {
  const Problem problem = two_lifts();
  for (const char* planner : {"est", "rrt"}) {
    EffortOptions options{planner, 6000, 1};
    const Escape first = escape_effort(problem, options);
    EXPECT_GT(first.effort, light * g * height - 1e-3) << planner;
    EXPECT_LT(first.effort, 2.0 * light * g * height) << planner;
    options.captured = Captured::any;
    const Escape last = escape_effort(problem, options);
    EXPECT_GT(last.effort, (light + heavy) * g * height - 1e-3) << planner;
    EXPECT_LT(last.effort, 2.5 * (light + heavy) * g * height) << planner;
    expect_path_leaves_the_capture_set_only_at_its_end(first, problem);
    expect_path_leaves_the_capture_set_only_at_its_end(last, problem, Captured::any);
    expect_path_replays_from_its_controls(first, problem);
    expect_path_replays_from_its_controls(last, problem);
  }
}

TEST(SeveralObjects, OneThatIsShutInCapturesAnyForEver) {
  Problem problem = two_lifts();
  problem.captured_any = below("light", height) | below("heavy", 100.0);
  EXPECT_LT(escape_effort(problem, {"est", 600, 1}).effort, infinity);
  EffortOptions any{"est", 600, 1};
  any.captured = Captured::any;
  EXPECT_EQ(escape_effort(problem, any).effort, infinity);
}

TEST(SeveralObjects, EscapeOfAnyNeedsItsSet) {
  Problem problem = two_lifts();
  problem.captured_any.reset();
  EffortOptions any{"est", 10, 1};
  any.captured = Captured::any;
  EXPECT_TRUE(rejects([&] { escape_effort(problem, any); }, {"captured", "'any'", "no set"}));
  problem.captured_any = regions::Disc{"cup"};
  EXPECT_TRUE(rejects([&] { validate(problem); }, {"captured_any", "'cup'"}));
  problem.captured_any.reset();
  problem.succeeded_any = regions::Disc{"cup"};
  EXPECT_TRUE(rejects([&] { validate(problem); }, {"succeeded_any", "'cup'"}));
}

// ---- scores

CaptureOptions capture_options(int nodes, int trees = 1, int threads = 1) {
  CaptureOptions options;
  options.nodes = nodes;
  options.trees = trees;
  options.threads = threads;
  return options;
}

TEST(SeveralObjects, CaptureOfAnyIsTheLikelihoodInItsOwnSet) {
  const Problem problem = two_drifts();
  const CaptureScore score = capture_score(problem, capture_options(300));
  const Tree& tree = score.trees.front();
  const auto likelihood = [&](const Region& region) {
    const Mask inside = Membership(region, problem.scene)(tree.states);
    return inside.select(likelihoods(tree.costs, problem.rate).array(), 0.0).sum();
  };
  EXPECT_NEAR(score.capture.mean, likelihood(problem.captured), 1e-12);
  EXPECT_NEAR(score.capture_any->mean, likelihood(*problem.captured_any), 1e-12);
  EXPECT_NEAR(score.success->mean, likelihood(*problem.succeeded), 1e-12);
  EXPECT_NEAR(score.success_any->mean, likelihood(*problem.succeeded_any), 1e-12);
  EXPECT_GT(score.capture_any->mean, score.capture.mean);
  EXPECT_GT(score.success_any->mean, score.success->mean);
  EXPECT_FALSE(score.capture_any->standard_error);
}

TEST(SeveralObjects, CaptureOfAnyOfOneRegionIsThatOfTheRegion) {
  Problem problem = two_drifts();
  problem.captured_any = problem.captured;
  problem.succeeded_any.reset();
  const CaptureScore score = capture_score(problem, capture_options(200, 3));
  EXPECT_TRUE(same_bits(score.capture_any->mean, score.capture.mean));
  EXPECT_TRUE(same_bits(*score.capture_any->standard_error, *score.capture.standard_error));
  EXPECT_FALSE(score.success_any);
  problem.captured_any = regions::Ball{"one", {0.0, 0.0, 0.0}, 1e6};
  EXPECT_EQ(capture_score(problem, capture_options(200)).capture_any->mean, 1.0);
}

TEST(SeveralObjects, CaptureOfAllAndAnyAreTheSameBitsOnAnyNumberOfThreads) {
  const CaptureScore one = capture_score(pushed_pair(), capture_options(60, 3, 1));
  for (const int threads : {2, 4}) {
    const CaptureScore other = capture_score(pushed_pair(), capture_options(60, 3, threads));
    EXPECT_TRUE(same_bits(other.capture.mean, one.capture.mean));
    EXPECT_TRUE(same_bits(other.capture_any->mean, one.capture_any->mean));
    EXPECT_TRUE(same_bits(*other.capture_any->standard_error, *one.capture_any->standard_error));
  }
}

Contact measured(const std::string& a, const std::string& b, double normal_force, const Vector3& tangential_force) {
  Contact contact;
  contact.body_a = a;
  contact.body_b = b;
  contact.normal_force = normal_force;
  contact.tangential_force = tangential_force;
  contact.friction = 0.75;
  return contact;
}

TEST(SeveralObjects, ForceScoreAddsTheContactsOfAllButThoseBetweenThemAndMeansTheirDistances) {
  Problem problem = pushed_pair();
  std::map<std::string, BodyState> bodies = unpack(problem.scene, problem.state).bodies;
  bodies["two"].position.y() = 0.3;
  problem.state = pack(problem.scene, bodies);
  problem.force_weights = {2.0, 3.0, 5.0, 0.25, 0.125};
  problem.contacts = {measured("one", "effector", 10.0, {3.0, 4.0, 0.0}),
                      measured("effector", "two", 2.0, {0.0, 0.5, 0.0}), measured("one", "two", 100.0, {7.0, 0.0, 0.0}),
                      measured("two", "table", 4.0, {1.0, 0.0, 0.0}),
                      measured("effector", "table", 50.0, Vector3::Zero())};
  const ForceScore score = force_score(problem);
  const double stick = ((7.5 - 5.0) + (1.5 - 0.5)) * 0.8;  // cos(atan(3/4)) = 4/5
  EXPECT_NEAR(score.effector.engage, 12.0, 1e-12);
  EXPECT_NEAR(score.effector.stick, stick, 1e-12);
  EXPECT_NEAR(score.ground.engage, 4.0, 1e-12);
  EXPECT_NEAR(score.ground.stick, (3.0 - 1.0) * 0.8, 1e-12);
  const double distance = 0.5 * ((0.1 - 0.05 - 0.025) + (0.3 - 0.05 - 0.025));
  EXPECT_NEAR(score.distance, distance, 1e-5);
  EXPECT_NEAR(score.force, 24.0 + 3.0 * stick + 0.25 * 4.0 + 0.125 * 1.6 - 5.0 * score.distance, 1e-12);
}

TEST(SeveralObjects, SimulatedForceScoreBearsTheWeightOfAll) {
  Scene scene(Vector3(0.0, 0.0, -g), exact());
  Body tray = fixed("tray", Plane{});
  tray.role = Role::effector;
  scene.add_body(tray);
  scene.add_body(body("one", Box{{0.2, 0.2, 0.2}}, 2.0, {0.0, 0.0, 0.1}, Role::object));
  scene.add_body(body("two", Box{{0.1, 0.1, 0.1}}, 1.0, {0.0, 0.0, 0.25}, Role::object));  // on the first
  const Problem problem = problem_of(scene, {1.0, 0.0, 0.0}, Vector3::Zero(), 0.5, regions::Disc{"one"});
  const ForceScore score = force_score(problem);
  EXPECT_NEAR(score.effector.engage, 3.0 * g, 10.0 * giving * g);
  EXPECT_NEAR(score.ground.engage, 0.0, 1e-12);
  EXPECT_NEAR(score.distance, 0.5 * 0.2, 1e-5);
}

TEST(SeveralObjects, UnderDriveAnEdgeStartsWithTheEffectorsVelocityAndTheObjectsOwn) {
  const Problem problem = pushed_pair();
  State node = State::LinSpaced(problem.state.size(), 1.0, 2.0);
  State expected = node;
  const StateLayout layout(problem.scene);
  const int effector = layout.offset(problem.scene.index("effector")) + StateLayout::velocities_of_body;
  expected.segment<6>(effector) = problem.state.segment<6>(effector);
  EXPECT_TRUE(same_bits(EdgeStart(problem)(node), expected));
  EXPECT_TRUE(same_bits(EdgeStart(pushed_pair(Effector::coast))(node), node));
}

// ---- batches

const std::vector<std::string> all_metrics{"capture",        "success",        "capture/any", "success/any",
                                           "effort",         "effort/any",     "effort/est",  "effort/rrt",
                                           "effort/est/any", "effort/rrt/any", "force"};

BatchOptions batch_options(int threads) {
  BatchOptions options;
  options.metrics = all_metrics;
  options.nodes = 40;
  options.seed = 11;
  options.threads = threads;
  return options;
}

Problem scored(double speed) {
  Problem problem = pushed_pair();
  problem.succeeded = regions::HalfSpace{"one", -Vector3::UnitY(), -0.12};
  problem.succeeded_any = regions::HalfSpace{"two", -Vector3::UnitY(), -0.12};
  const int effector = StateLayout(problem.scene).offset(problem.scene.index("effector"));
  problem.state[effector + StateLayout::velocities_of_body + 1] = speed;
  return problem;
}

TEST(SeveralObjects, BatchHoldsWhatTheMetricsGiveForOneAndFourThreads) {
  std::vector<Problem> problems;
  for (const double speed : {0.1, 0.2, 0.3, 0.4}) problems.push_back(scored(speed));
  for (const int threads : {1, 4}) {
    Batch batch(problems, batch_options(threads));
    std::size_t rows = 0;
    while (!batch.finished()) {
      for (const ScoreRow& row : batch.take(60.0)) {
        const Problem& problem = problems[row.index];
        const std::uint64_t seed = stream(11, row.index);
        CaptureOptions options = capture_options(40);
        options.seed = seed;
        const CaptureScore capture = capture_score(problem, options);
        const auto effort = [&](const std::string& planner, Captured captured, Search search = Search::published) {
          return escape_effort(problem, {planner, 40, seed, captured, {}, search}).effort;
        };
        const std::map<std::string, double> expected{{"capture", capture.capture.mean},
                                                     {"success", capture.success->mean},
                                                     {"capture/any", capture.capture_any->mean},
                                                     {"success/any", capture.success_any->mean},
                                                     {"effort", effort("est", Captured::all, Search::improved)},
                                                     {"effort/any", effort("est", Captured::any, Search::improved)},
                                                     {"effort/est", effort("est", Captured::all)},
                                                     {"effort/rrt", effort("rrt", Captured::all)},
                                                     {"effort/est/any", effort("est", Captured::any)},
                                                     {"effort/rrt/any", effort("rrt", Captured::any)},
                                                     {"force", force_score(problem).force}};
        EXPECT_EQ(row.error, "");
        EXPECT_EQ(row.scores, expected) << "row " << row.index << ", threads " << threads;
        ++rows;
      }
    }
    EXPECT_EQ(rows, problems.size());
  }
}

TEST(SeveralObjects, BatchWithoutASetForAnyHasAnErrorForItsEffortAndNoScoreForItsCapture) {
  Problem problem = scored(0.3);
  problem.captured_any.reset();
  problem.succeeded_any.reset();
  BatchOptions options = batch_options(1);
  options.metrics = {"capture", "capture/any", "success/any"};
  const ScoreRow row = score(problem, 0, options);
  EXPECT_EQ(row.scores.count("capture"), 1u);
  EXPECT_EQ(row.scores.count("capture/any") + row.scores.count("success/any"), 0u);
  options.metrics = {"effort/est/any"};
  EXPECT_TRUE(rejects([&] { score(problem, 0, options); }, {"captured", "'any'"}));
}

TEST(SeveralObjects, UnknownMetricIsRejectedWithTheNamesOfThoseOfAny) {
  BatchOptions options = batch_options(1);
  options.metrics = {"force/any"};
  EXPECT_TRUE(rejects([&] { Batch({}, options); }, {"'force/any'", "'capture/any'", "'effort/rrt/any'"}));
}

// ---- what an object can be

TEST(SeveralObjects, ObjectWithoutPartsCanBeSearchedFor) {
  Scene scene(Vector3::Zero());
  Body ghost = body("ghost", Compound{}, 1.0, Vector3::Zero(), Role::object);
  ghost.inertial = Inertial{{0.0, 0.0, 0.1}, {0.1, 0.1, 0.1}};
  scene.add_body(ghost);
  const Problem problem =
      problem_of(scene, {1.0, 1.0, 0.0}, Vector3::Zero(), 0.5, regions::Disc{"ghost", {0.0, 0.0}, 0.2});
  for (const char* planner : {"est", "rrt"}) {
    const Escape found = escape_effort(problem, {planner, 400, 1});
    EXPECT_LT(found.effort, infinity) << planner;
    EXPECT_TRUE(found.tree.costs.allFinite()) << planner;
  }
}

TEST(SeveralObjects, EachHasToBeFreeToMoveAlongTheBounds) {
  Problem problem = two_lifts();
  problem.force = {1.0, 0.0, 20.0};
  EXPECT_TRUE(rejects([&] { validate(problem); }, {"force", "(1, 0, 20)", "locked"}));
}

}  // namespace
}  // namespace energymargin
