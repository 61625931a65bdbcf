// Batches: the same rows on any number of threads, resumed or not.

#include "energymargin/batch.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <set>
#include <thread>

#include "base/check.hpp"
#include "base/thread_pool.hpp"
#include "energymargin/membership.hpp"
#include "energymargin/metrics/capture.hpp"
#include "energymargin/metrics/effort.hpp"
#include "energymargin/metrics/force.hpp"
#include "energymargin/metrics/probability.hpp"
#include "energymargin/random.hpp"
#include "expect.hpp"
#include "few_threads.hpp"
#include "scenes.hpp"

namespace energymargin {
namespace {

using namespace scenes;

constexpr double a_minute = 60.0;

BatchOptions options(int threads = 1, std::vector<std::size_t> indices = {}) {
  BatchOptions made;
  made.nodes = 30;
  made.seed = 11;
  made.threads = threads;
  made.indices = std::move(indices);
  return made;
}

// Pushes at different speeds.
std::vector<Problem> pushes(int count) {
  std::vector<Problem> problems(static_cast<std::size_t>(count), push());
  for (int i = 0; i < count; ++i) problems[static_cast<std::size_t>(i)].state[21] = 0.2 + 0.05 * i;
  return problems;
}

// All rows, by index.
std::map<std::size_t, ScoreRow> all(Batch& batch) {
  std::map<std::size_t, ScoreRow> rows;
  while (!batch.finished()) {
    for (ScoreRow& row : batch.take(a_minute)) {
      EXPECT_EQ(rows.count(row.index), 0u) << "row " << row.index << " came twice";
      rows[row.index] = std::move(row);
    }
  }
  return rows;
}

std::map<std::size_t, ScoreRow> all(std::vector<Problem> problems, const BatchOptions& with) {
  Batch batch(std::move(problems), with);
  return all(batch);
}

TEST(Batch, OptionsOfTheRolloutsAreThoseOfTheMetrics) {
  const Problem problem = pushes(6).back();
  BatchOptions one = options();
  one.metrics = {"capture", "effort/est"};
  BatchOptions several = one;
  several.nodes_per_edge = 3;
  several.stop_at_escape = true;
  const ScoreRow row = score(problem, 4, several);
  CaptureOptions capture;
  capture.nodes = 30;
  capture.nodes_per_edge = 3;
  capture.seed = stream(11, 4);
  EXPECT_EQ(row.scores.at("capture"), capture_score(problem, capture).capture.mean);
  EffortOptions effort = {"est", 30, stream(11, 4)};
  effort.stop_at_escape = true;
  effort.search = Search::published;
  EXPECT_EQ(row.scores.at("effort/est"), escape_effort(problem, effort).effort);
  EXPECT_NE(row.scores.at("capture"), score(problem, 4, one).scores.at("capture"));
  EXPECT_NE(row.scores.at("effort/est"), score(problem, 4, one).scores.at("effort/est"));
}

TEST(Batch, RowHoldsWhatTheMetricsGiveForTheProblemsOwnStream) {
  const Problem problem = push();
  const ScoreRow row = score(problem, 4, options());
  const std::uint64_t seed = stream(11, 4);
  CaptureOptions capture;
  capture.nodes = 30;
  capture.seed = seed;
  const CaptureScore captured = capture_score(problem, capture);
  ASSERT_EQ(row.scores.size(), 4u);
  EXPECT_EQ(row.index, 4u);
  EXPECT_EQ(row.error, "");
  EXPECT_TRUE(same_bits(row.scores.at("capture"), captured.capture.mean));
  EXPECT_TRUE(same_bits(row.scores.at("success"), captured.success->mean));
  EXPECT_TRUE(same_bits(row.scores.at("effort"), escape_effort(problem, {"est", 30, seed}).effort));
  EXPECT_TRUE(same_bits(row.scores.at("force"), force_score(problem).force));
}

// One name, one number: with a clock and without.
TEST(Batch, EffortIsTheLeastWorkFoundAndThoseOfPlannersAreAlgorithm1) {
  Problem problem = push();
  BatchOptions asked{{"effort", "effort/est", "effort/rrt"}, 60};
  asked.seed = 11;
  EffortOptions options{"est", 60, stream(11, 4)};
  for (const std::optional<double> horizon : {std::optional<double>(), std::optional(0.5)}) {
    problem.horizon = horizon;
    const ScoreRow row = score(problem, 4, asked);
    options.search = EffortOptions{}.search;
    options.planner = "est";
    EXPECT_TRUE(same_bits(row.scores.at("effort"), escape_effort(problem, options).effort));
    options.search = Search::published;
    EXPECT_TRUE(same_bits(row.scores.at("effort/est"), escape_effort(problem, options).effort));
    options.planner = "rrt";
    EXPECT_TRUE(same_bits(row.scores.at("effort/rrt"), escape_effort(problem, options).effort));
    EXPECT_LE(row.scores.at("effort"), row.scores.at("effort/est"));
  }
}

TEST(Batch, ProbabilitiesShareRolloutsUnderTheDisturbanceOfTheOptionsAndHaveTheirCurves) {
  Problem problem = push();
  problem.horizon = 0.2;
  BatchOptions asked = options();
  asked.metrics = {"probability", "probability/success", "effort"};
  asked.rollouts = 12;
  asked.disturbance = {2.5, 1};
  ProbabilityOptions own;
  own.rollouts = 12;
  own.disturbance = asked.disturbance;
  own.seed = stream(11, 4);
  const ScoreRow row = score(problem, 4, asked);
  const CaptureProbability found = capture_probability(problem, own);
  EXPECT_TRUE(same_bits(row.scores.at("probability"), found.all.captured()));
  EXPECT_EQ(row.curves.size(), 1u);
  EXPECT_EQ(row.curves.at("probability").times, found.times);
  EXPECT_EQ(row.curves.at("probability").probabilities, found.all.curve);
  EXPECT_EQ(row.times.count("probability/success"), 0u);

  own.undisturbed = false;  // as in a batch, whose rows do not have it
  const CaptureProbability random = capture_probability(problem, own);
  EXPECT_EQ(random.all.curve, found.all.curve);
  EXPECT_LT(random.steps, found.steps);

  asked.common_random_numbers = true;
  own.seed = 11;
  own.success = true;
  for (const std::size_t index : {0u, 4u}) {
    const ScoreRow common = score(problem, index, asked);
    EXPECT_TRUE(same_bits(common.scores.at("probability/success"), *capture_probability(problem, own).success));
    const EffortOptions effort = {"est", 30, stream(11, index)};  // of its own stream
    EXPECT_TRUE(same_bits(common.scores.at("effort"), escape_effort(problem, effort).effort));
  }
}

TEST(Batch, OneTwoAndFourThreadsGiveTheSameBits) {
  const auto one = all(pushes(6), options(1));
  ASSERT_EQ(one.size(), 6u);
  for (const int threads : {2, 4}) {
    const auto other = all(pushes(6), options(threads));
    ASSERT_EQ(other.size(), 6u);
    for (const auto& [index, row] : one) EXPECT_EQ(other.at(index).scores, row.scores) << "row " << index;
  }
}

TEST(Batch, OneProblemGivesTheSameBitsOnAnyNumberOfThreads) {
  const ScoreRow one = score(push(), 0, options());
  ASSERT_EQ(one.scores.size(), 4u);
  for (const int threads : {1, 2, 3, 8}) {
    const auto rows = all({push()}, options(threads));
    ASSERT_EQ(rows.size(), 1u) << threads << " threads";
    EXPECT_EQ(rows.at(0).scores, one.scores) << threads << " threads";
  }
}

// Whoever asks the set waits until another thread asks it too, or gives up.
TEST(Batch, SearchesOfOneProblemRunOnSeveralThreads) {
  if (!with_threads) GTEST_SKIP() << "built without threads";
  struct Meeting {
    std::mutex mutex;
    std::condition_variable came;
    std::set<std::thread::id> there;
    bool over = false;
  };
  const auto meeting = std::make_shared<Meeting>();
  Problem problem = push();
  const Region captured = problem.captured;
  problem.captured = regions::Predicate{[meeting, captured, scene = problem.scene](const States& states) -> Mask {
    std::unique_lock<std::mutex> lock(meeting->mutex);
    meeting->there.insert(std::this_thread::get_id());
    meeting->came.notify_all();
    meeting->came.wait_for(lock, std::chrono::seconds(20), [&] { return meeting->over || meeting->there.size() > 1; });
    meeting->over = true;
    return Membership(captured, scene)(states);
  }};
  all({problem}, options(2));
  EXPECT_EQ(meeting->there.size(), 2u);
}

TEST(Batch, ErrorIsThatOfTheFirstMetricThatFails) {
  Scene scene;
  scene.add_body(body("object", brick({0.1, 0.1, 0.1}), 1.0, {0.0, 0.0, 0.05}, Role::object));
  const Problem problem = problem_of(scene, {1.0, 0.0, 0.0}, Vector3::Zero(), 0.1, regions::Disc{"object"});
  const auto error = [&](const std::vector<std::string>& metrics, int threads) {
    BatchOptions with = options(threads);
    with.metrics = metrics;
    return all({problem}, with).at(0).error;
  };
  for (const int threads : {1, 2, 3}) {
    EXPECT_NE(error({"capture", "force", "effort/est/any"}, threads).find("an effector"), std::string::npos);
    EXPECT_NE(error({"capture", "effort/est/any", "force"}, threads).find("any object"), std::string::npos);
  }
}

TEST(Batch, ResumedWithIndicesGivesTheBitsOfTheFullRun) {
  const auto full = all(pushes(6), options());
  const std::vector<Problem> problems = pushes(6);
  const auto rest = all({problems[5], problems[1], problems[2]}, options(2, {5, 1, 2}));
  ASSERT_EQ(rest.size(), 3u);
  for (const auto& [index, row] : rest) EXPECT_EQ(full.at(index).scores, row.scores) << "row " << index;
}

TEST(Batch, ProblemThatFailsGivesARowWithAnErrorWhileTheOthersFinish) {
  std::vector<Problem> problems = pushes(4);
  problems[1].state[0] = nan;
  problems[2].captured = regions::Disc{"cup"};
  const auto rows = all(problems, options(2));
  ASSERT_EQ(rows.size(), 4u);
  EXPECT_NE(rows.at(1).error.find("nan"), std::string::npos) << rows.at(1).error;
  EXPECT_NE(rows.at(2).error.find("'cup'"), std::string::npos) << rows.at(2).error;
  for (const std::size_t good : {0, 3}) {
    EXPECT_EQ(rows.at(good).error, "");
    EXPECT_EQ(rows.at(good).scores.size(), 4u);
  }
}

TEST(Batch, CancelEndsItAndKeepsWhatIsFinished) {
  std::vector<Problem> problems(10000, push());
  Batch batch(std::move(problems), options(2));
  std::vector<ScoreRow> rows = batch.take(a_minute);
  ASSERT_FALSE(rows.empty());
  batch.cancel();
  for (ScoreRow& row : batch.take(0.0)) rows.push_back(std::move(row));
  EXPECT_TRUE(batch.finished());
  EXPECT_LT(rows.size(), 10000u);
  for (const ScoreRow& row : rows) {
    EXPECT_EQ(row.error, "");
    EXPECT_EQ(row.scores, score(push(), row.index, options()).scores) << "row " << row.index;
  }
}

TEST(Batch, ProblemsThatAreAddedLaterHaveTheBitsOfTheFullRun) {
  const auto full = all(pushes(6), options(2));
  Batch batch(options(2));
  EXPECT_TRUE(batch.finished());
  batch.add(pushes(2), {0, 1});
  auto rows = all(batch);
  EXPECT_EQ(batch.pending(), 0u);
  const std::vector<Problem> problems = pushes(6);
  for (std::size_t i = 2; i < 6; ++i) batch.add({problems[i]}, {i});
  EXPECT_EQ(batch.pending(), 4u);
  rows.merge(all(batch));
  ASSERT_EQ(rows.size(), 6u);
  for (const auto& [index, row] : full) EXPECT_EQ(rows.at(index).scores, row.scores) << "row " << index;
}

TEST(Batch, ProblemThatIsAddedWhileAnotherRunsGetsAThreadOfItsOwn) {
  if (!with_threads) GTEST_SKIP() << "built without threads";
  BatchOptions endless = options(2);
  endless.metrics = {"capture"};
  endless.nodes = 100'000'000;
  Batch batch(endless);
  batch.add(pushes(1), {0});
  batch.take(0.05);
  batch.add(pushes(1), {1}, {"force"});
  const auto rows = batch.take(a_minute);
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].index, 1u);
}

TEST(Batch, ProblemsCanBeAddedForSomeOfTheMetrics) {
  const auto full = all(pushes(2), options());
  Batch batch(options());
  batch.add(pushes(1), {0}, {"effort", "success"});
  const ScoreRow row = all(batch).at(0);
  EXPECT_EQ(row.scores.at("effort"), full.at(0).scores.at("effort"));
  EXPECT_EQ(row.scores.at("success"), full.at(0).scores.at("success"));
  EXPECT_EQ(row.scores.count("effort/est") + row.scores.count("force"), 0u);
  EXPECT_TRUE(rejects([&] { batch.add(pushes(1), {0}, {"beauty"}); }, {"metrics", "'beauty'"}));
  EXPECT_TRUE(rejects([&] { batch.add(pushes(2), {0}); }, {"indices", "1 numbers"}));
}

TEST(Batch, RowsAreThereOnHoweverFewThreadsTheSystemGives) {
  if (!with_threads || !can_bound_memory) GTEST_SKIP() << "built without threads, or with a sanitizer";
  const auto expected = all(pushes(3), options(1));
  for (const int threads : {0, 2}) {
    const auto with_few_threads = [&] {
      leave_room_for_threads(threads);
      const auto rows = all(pushes(3), options(8));
      bool same = rows.size() == expected.size();
      for (const auto& [index, row] : rows) same = same && row.error.empty() && row.scores == expected.at(index).scores;
      std::exit(same ? 0 : 1);
    };
    EXPECT_EXIT(with_few_threads(), testing::ExitedWithCode(0), "") << threads << " threads";
  }
}

TEST(Batch, WaitsAsLongAsItTakesForARowWithAnEndlessTimeout) {
  for (const double timeout : {infinity, 1e300, 1e10}) {
    Batch batch(pushes(1), options());
    EXPECT_EQ(batch.take(timeout).size(), 1u) << timeout;
    EXPECT_TRUE(batch.take(timeout).empty()) << timeout;
  }
}

TEST(Batch, TimeoutThatCannotBeIsRejectedByValue) {
  Batch batch(pushes(1), options());
  for (const double timeout : {nan, -1.0, -infinity}) {
    EXPECT_TRUE(rejects([&] { batch.take(timeout); }, {"timeout is " + text(timeout), "at least 0"}));
  }
  EXPECT_EQ(all(batch).size(), 1u);
}

TEST(Batch, TimesOfTheMetricsAddUpToThatOfTheRow) {
  const ScoreRow row = score(push(), 0, options());
  double sum = 0.0;
  for (const auto& [metric, time] : row.times) sum += time;
  EXPECT_DOUBLE_EQ(sum, row.seconds);
  EXPECT_EQ(row.times.count("capture") + row.times.count("success"), 1u);  // they come of one tree
  EXPECT_GT(row.times.at("effort"), 0.0);
}

TEST(Batch, ThereAreNoHalfRows) {
  const std::atomic<bool> cancel{true};
  for (const std::string metric : {"capture", "effort/est", "effort/rrt"}) {
    BatchOptions stopped = options();
    stopped.metrics = {metric};
    stopped.limit = Limit(&cancel);
    EXPECT_THROW(score(push(), 0, stopped), Cancelled) << metric;
  }
}

TEST(Batch, ATimeoutEndsItAndKeepsWhatIsFinished) {
  BatchOptions timed = options(2);
  timed.limit = Limit(nullptr, 0.2);
  const auto rows = all(std::vector<Problem>(100000, push()), timed);
  EXPECT_LT(rows.size(), 100000u);
  for (const auto& [index, row] : rows) EXPECT_EQ(row.scores, score(push(), index, options()).scores) << index;
}

TEST(Batch, NoProblemsAreFinishedAtOnce) {
  Batch batch({}, options(4));
  EXPECT_TRUE(batch.take(a_minute).empty());
  EXPECT_TRUE(batch.finished());
}

TEST(Batch, WithoutASuccessSetTheRowHasNoSuccess) {
  Problem problem = push();
  problem.succeeded.reset();
  const ScoreRow row = score(problem, 0, options());
  EXPECT_EQ(row.scores.count("success"), 0u);
  EXPECT_EQ(row.scores.count("capture"), 1u);
}

TEST(Batch, BadOptionsAreRejectedBeforeAnythingStarts) {
  const auto with = [](const BatchOptions& bad) { return [bad] { Batch(pushes(2), bad); }; };
  BatchOptions bad = options();
  bad.nodes = 0;
  EXPECT_TRUE(rejects(with(bad), {"nodes is 0", "at least 1"}));
  EXPECT_TRUE(rejects(with(options(0)), {"threads is 0", "at least 1"}));
  EXPECT_TRUE(rejects(with(options(1, {1, 2, 3})), {"indices", "3", "one for each problem"}));
  bad = options();
  bad.metrics = {"capture", "luck"};
  EXPECT_TRUE(rejects(with(bad), {"metrics", "'luck'", "'effort/est'"}));
  bad.metrics.clear();
  EXPECT_TRUE(rejects(with(bad), {"metrics", "empty"}));
}

}  // namespace
}  // namespace energymargin
