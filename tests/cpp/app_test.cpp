// The example executable, run as a process of its own.

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>

#include "energymargin/metrics/capture.hpp"
#include "energymargin/metrics/effort.hpp"
#include "energymargin/metrics/escape_energy.hpp"
#include "energymargin/metrics/force.hpp"
#include "energymargin/metrics/interval.hpp"
#include "energymargin/metrics/probability.hpp"
#include "expect.hpp"
#include "problem_files.hpp"

namespace energymargin {
namespace {

using namespace scenes;
using Json = nlohmann::json;

struct Outcome {
  int code = -1;
  std::string out;
  std::string error;
};

class App : public testing::Test {
 protected:
  App() : problem(folder / "problem.json") {}

  Outcome run(const std::string& arguments) const {
    const std::string command =
        "\"" ENERGYMARGIN_SCORE "\" " + arguments + " > \"" + folder / "out" + "\" 2> \"" + folder / "error" + "\"";
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, folder.read("out"), folder.read("error")};
  }

  // A failure is one line on the error stream that holds the parts, and nothing else.
  void expect_error(const std::string& arguments, const std::vector<std::string>& parts) const {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.code, 2) << arguments;
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(outcome.error.find('\n') + 1, outcome.error.size()) << outcome.error;
    EXPECT_EQ(outcome.error.rfind("error: ", 0), 0u) << outcome.error;
    for (const std::string& part : parts) {
      EXPECT_NE(outcome.error.find(part), std::string::npos) << outcome.error << " does not say " << part;
    }
  }

  const Folder folder;
  const std::string problem;
};

// Two objects that drift in free space, and sets for all and for any of them.
Problem two_drifters() {
  Scene scene(Vector3::Zero());
  for (const std::string name : {"a", "b"}) {
    scene.add_body(body(name, Box{{0.1, 0.1, 0.1}}, 1.0, {name == "a" ? 0.0 : 1.0, 0.0, 0.0}, Role::object));
  }
  const Region a = regions::Disc{"a", {0.0, 0.0}, 0.1};
  const Region b = regions::Disc{"b", {1.0, 0.0}, 0.1};
  Problem problem = problem_of(scene, {1.0, 1.0, 0.0}, Vector3::Zero(), 0.5, a & b);
  problem.captured_any = a | b;
  const Region left_a = regions::HalfSpace{"a", Vector3::UnitX(), 0.0};
  const Region left_b = regions::HalfSpace{"b", Vector3::UnitX(), 1.0};
  problem.succeeded = left_a & left_b;
  problem.succeeded_any = left_a | left_b;
  return problem;
}

TEST_F(App, CaptureIsTheLibrarysToTheLastBit) {
  save(push(), problem);
  const Outcome outcome = run(problem + " --metric capture --nodes 60 --seed 5 --trees 3 --threads 2");
  ASSERT_EQ(outcome.code, 0) << outcome.error;
  CaptureOptions options;
  options.nodes = 60;
  options.seed = 5;
  options.trees = 3;
  const CaptureScore score = capture_score(push(), options);
  const Json json = Json::parse(outcome.out);
  EXPECT_TRUE(same_bits(json["capture"].get<double>(), score.capture.mean));
  EXPECT_TRUE(same_bits(json["success"].get<double>(), score.success->mean));
  EXPECT_TRUE(same_bits(json["capture_stderr"].get<double>(), *score.capture.standard_error));
  EXPECT_TRUE(same_bits(json["success_stderr"].get<double>(), *score.success->standard_error));
  for (const char* of_several : {"capture_any", "success_any", "capture_any_stderr", "success_any_stderr"}) {
    EXPECT_TRUE(json.at(of_several).is_null()) << of_several;
  }
}

TEST_F(App, CaptureWithAToleranceSaysHowManyTreesItTookAndItsIntervals) {
  save(push(), problem);
  const Outcome outcome = run(problem + " --nodes 30 --tolerance 0.03 --threads 2");
  ASSERT_EQ(outcome.code, 0) << outcome.error;
  CaptureOptions options;
  options.nodes = 30;
  options.tolerance = 0.03;
  const CaptureScore score = capture_score(push(), options);
  const Json json = Json::parse(outcome.out);
  EXPECT_EQ(json["trees"], score.trees.size());
  EXPECT_EQ(json["complete"], true);
  EXPECT_EQ(json["nodes"], 30);
  EXPECT_TRUE(same_bits(json["capture_interval"][0].get<double>(), interval(score).low));
  EXPECT_TRUE(same_bits(json["success_interval"][1].get<double>(), interval(score, "success").high));
}

TEST_F(App, TimeoutGivesWhatThereIsAndSaysSo) {
  const auto complete = [&](const std::string& options) {
    const Outcome outcome = run(problem + " --timeout 0.2 " + options);
    EXPECT_EQ(outcome.code, 0) << outcome.error;
    return Json::parse(outcome.out)["complete"].get<bool>();
  };
  save(lift(0.2), problem);
  EXPECT_FALSE(complete("--nodes 1000000000 --metric effort"));
  save(push(), problem);
  EXPECT_FALSE(complete("--nodes 1000000000 --metric capture"));
  EXPECT_FALSE(complete("--samples 1000000000 --metric escape_energy"));
}

TEST_F(App, CaptureOfAnyObjectIsTheLibrarysToTheLastBit) {
  save(two_drifters(), problem);
  const Outcome outcome = run(problem + " --nodes 60 --trees 2");
  ASSERT_EQ(outcome.code, 0) << outcome.error;
  CaptureOptions options;
  options.nodes = 60;
  options.trees = 2;
  const CaptureScore score = capture_score(two_drifters(), options);
  const Json json = Json::parse(outcome.out);
  EXPECT_TRUE(same_bits(json["capture_any"].get<double>(), score.capture_any->mean));
  EXPECT_TRUE(same_bits(json["success_any"].get<double>(), score.success_any->mean));
  EXPECT_TRUE(same_bits(json["capture_any_stderr"].get<double>(), *score.capture_any->standard_error));
  EXPECT_TRUE(same_bits(json["success_any_stderr"].get<double>(), *score.success_any->standard_error));
}

TEST_F(App, EffortUntilAnyOrTheLastObjectHasLeftIsTheLibrarysToTheLastBit) {
  save(two_drifters(), problem);
  EffortOptions options;
  options.nodes = 300;
  for (const auto& [word, captured] : {std::pair{"all", Captured::all}, {"any", Captured::any}}) {
    const Outcome outcome = run(problem + " --metric effort --nodes 300 --captured " + word);
    ASSERT_EQ(outcome.code, 0) << outcome.error;
    options.captured = captured;
    const double effort = escape_effort(two_drifters(), options).effort;
    ASSERT_TRUE(std::isfinite(effort)) << word;
    EXPECT_TRUE(same_bits(Json::parse(outcome.out)["effort"].get<double>(), effort)) << word;
  }
}

TEST_F(App, EffortOfEachPlannerIsTheLibrarysToTheLastBit) {
  save(drift(), problem);
  for (const std::string planner : {"est", "rrt"}) {
    const Outcome outcome =
        run(problem + " --metric effort --nodes 300 --seed 18446744073709551615 --planner " + planner);
    ASSERT_EQ(outcome.code, 0) << outcome.error;
    const Escape escape = escape_effort(drift(), {planner, 300, 18446744073709551615ULL});
    const Json json = Json::parse(outcome.out);
    EXPECT_TRUE(same_bits(json["effort"].get<double>(), escape.effort));
    ASSERT_EQ(json["history"].size(), escape.history.size());
    EXPECT_EQ(json["history"].back()["nodes"], escape.history.back().first);
  }
}

TEST_F(App, EffortOfEachSearchIsTheLibrarysToTheLastBit) {
  save(drift(), problem);
  std::map<std::string, double> efforts;
  for (const auto& [word, search] : {std::pair{"improved", Search::improved}, {"published", Search::published}}) {
    const Outcome outcome = run(problem + " --metric effort --nodes 300 --search " + word);
    ASSERT_EQ(outcome.code, 0) << outcome.error;
    efforts[word] = Json::parse(outcome.out)["effort"].get<double>();
    EXPECT_TRUE(same_bits(efforts[word], escape_effort(drift(), {"est", 300, 0, Captured::all, {}, search}).effort));
  }
  EXPECT_LT(efforts["improved"], efforts["published"]);
  EXPECT_NE(run(problem + " --metric effort --search ours").error.find("--search is 'ours'"), std::string::npos);
}

TEST_F(App, SamplingAndShorteningReplaceThoseOfTheSearch) {
  save(drift(), problem);
  const auto effort = [&](const std::string& options) {
    const Outcome outcome = run(problem + " --metric effort --nodes 300 " + options);
    EXPECT_EQ(outcome.code, 0) << outcome.error;
    return Json::parse(outcome.out)["effort"].get<double>();
  };
  EXPECT_EQ(effort("--sampling uniform --shorten no"), effort("--search published"));
  EXPECT_EQ(effort("--search published --sampling mixed --shorten yes"), effort("--search improved"));
}

// A pusher that goes on, for half of its plan, and disturbances that are strong enough to get the bar out in that time.
Problem pushed_on() {
  Problem problem = push(Effector::coast);
  problem.force = {20.0, 20.0, 0.0};
  problem.horizon = 0.25;
  problem.dwell = 0.05;
  problem.plan = hold(problem.scene, problem.state, 0.5);
  return problem;
}

TEST_F(App, EffortWithAHorizonAndAPlanIsTheLibrarysToTheLastBit) {
  save(pushed_on(), problem);
  for (const std::string planner : {"est", "rrt"}) {
    const Outcome outcome = run(problem + " --metric effort --nodes 100 --seed 3 --planner " + planner);
    ASSERT_EQ(outcome.code, 0) << outcome.error;
    const Escape escape = escape_effort(pushed_on(), {planner, 100, 3});
    ASSERT_TRUE(std::isfinite(escape.effort));
    const Json json = Json::parse(outcome.out);
    EXPECT_TRUE(same_bits(json["effort"].get<double>(), escape.effort));
    EXPECT_EQ(json["nodes"], escape.nodes());
    ASSERT_EQ(json["history"].size(), escape.history.size());
    for (std::size_t i = 0; i < escape.history.size(); ++i) {
      EXPECT_EQ(json["history"][i]["nodes"], escape.history[i].first);
      EXPECT_TRUE(same_bits(json["history"][i]["effort"].get<double>(), escape.history[i].second));
    }
  }
}

TEST_F(App, ProbabilityIsTheLibrarysToTheLastBit) {
  save(pushed_on(), problem);
  const Outcome outcome = run(problem + " --metric probability --rollouts 20 --strength 0.5 --seed 3 --threads 2");
  ASSERT_EQ(outcome.code, 0) << outcome.error;
  ProbabilityOptions options;
  options.disturbance = disturbances::Uniform{0.5};
  options.rollouts = 20;
  options.seed = 3;
  options.success = true;
  const CaptureProbability p = capture_probability(pushed_on(), options);
  const Json json = Json::parse(outcome.out);
  EXPECT_TRUE(same_bits(json["captured"].get<double>(), p.all.captured()));
  EXPECT_TRUE(same_bits(json["mean_time"].get<double>(), p.all.mean_time));
  EXPECT_TRUE(same_bits(json["success"].get<double>(), *p.success));
  EXPECT_TRUE(same_bits(json["interval"][0].get<double>(), interval(p.all.captured(), p.effective).low));
  EXPECT_EQ(json["curve"].get<std::vector<double>>(), std::vector<double>(p.all.curve.begin(), p.all.curve.end()));
  EXPECT_EQ(json["undisturbed"], p.undisturbed);
  EXPECT_EQ(json["rollouts"], 20);
  EXPECT_EQ(json["plan"]["rows"], 120);
  save(push(), problem);
  expect_error(problem + " --metric probability", {"horizon"});
}

TEST_F(App, HorizonAndPlanAreToldIfThereAreAny) {
  const auto told = [&](const Problem& given) {
    save(given, problem);
    const Outcome outcome = run(problem + " --metric effort --nodes 5");
    EXPECT_EQ(outcome.code, 0) << outcome.error;
    return Json::parse(outcome.out);
  };
  const Json json = told(pushed_on());
  const double step = push_scene().stepping().step;
  EXPECT_EQ(json["horizon"], 60 * step);
  EXPECT_EQ(json["check"], 4 * step);
  EXPECT_EQ(json["dwell"], 12 * step);
  EXPECT_EQ(json["plan"], Json({{"step", step},
                                {"rows", 120},
                                {"wrenches", Json::array()},
                                {"targets", Json::array()},
                                {"velocities", {"effector"}}}));
  Problem coasting = pushed_on();
  coasting.plan.reset();
  EXPECT_TRUE(told(coasting).at("plan").is_null());
  EXPECT_FALSE(told(push()).contains("horizon"));
  EXPECT_FALSE(told(push()).contains("plan"));
}

TEST_F(App, MetricOfAQuestionWithoutAClockRefusesAPlanInOneLine) {
  save(pushed_on(), problem);
  expect_error(problem, {"with a plan", "capture_score"});
  expect_error(problem + " --metric force", {"with a plan", "force_score"});
}

TEST_F(App, EffortWithoutAnEscapeIsNull) {
  save(closed_cage(), problem);
  const Outcome outcome = run(problem + " --metric effort --nodes 20");
  ASSERT_EQ(outcome.code, 0) << outcome.error;
  EXPECT_TRUE(Json::parse(outcome.out)["effort"].is_null());
}

TEST_F(App, EscapeEnergyOfEachPlannerIsTheLibrarysToTheLastBit) {
  save(lift(0.2), problem);
  for (const std::string planner : {"bit*", "rrt*"}) {
    const Outcome outcome =
        run(problem + " --metric escape_energy --samples 300 --seed 18446744073709551615 --planner '" + planner + "'");
    ASSERT_EQ(outcome.code, 0) << outcome.error;
    EscapeEnergyOptions options;
    options.planner = planner;
    options.samples = 300;
    options.seed = 18446744073709551615ULL;
    const EscapeEnergy escape = escape_energy(lift(0.2), options);
    const Json json = Json::parse(outcome.out);
    EXPECT_TRUE(same_bits(json["energy"].get<double>(), escape.energy));
    ASSERT_EQ(json["history"].size(), escape.history.size());
    EXPECT_EQ(json["history"].back()["samples"], escape.history.back().first);
  }
}

TEST_F(App, ForceIsTheLibrarysToTheLastBit) {
  save(push(), problem);
  const Outcome outcome = run(problem + " --metric force");
  ASSERT_EQ(outcome.code, 0) << outcome.error;
  EXPECT_TRUE(same_bits(Json::parse(outcome.out)["force"].get<double>(), force_score(push()).force));
}

TEST_F(App, ForceOfOtherWeightsIsTheLibrarysToTheLastBit) {
  Problem weighted = push();
  save(weighted, problem);
  const Outcome outcome = run(problem + " --metric force --weights 2,0.5,3,0.25,0.125");
  ASSERT_EQ(outcome.code, 0) << outcome.error;
  weighted.force_weights = {2.0, 0.5, 3.0, 0.25, 0.125};
  EXPECT_TRUE(same_bits(Json::parse(outcome.out)["force"].get<double>(), force_score(weighted).force));
}

TEST_F(App, SavedCopyHasTheSameBytes) {
  for (const Problem& given : {everything(), articulated(), planned(), two_drifters()}) {
    save(given, problem);
    const Outcome outcome = run(problem + " --save " + (folder / "copy.json"));
    ASSERT_EQ(outcome.code, 0) << outcome.error;
    EXPECT_EQ(outcome.out + outcome.error, "");
    EXPECT_EQ(folder.read("copy.json"), folder.read("problem.json"));
  }
}

TEST_F(App, SavedCopyHasItsMeshesWhereTheyAreAskedFor) {
  save(everything(), problem);
  ASSERT_EQ(run(problem + " --save " + (folder / "files.json") + " --meshes files").code, 0);
  save(everything(), folder / "own.json", Meshes::files);
  EXPECT_NE(folder.read("files-body_5.obj"), "");
  EXPECT_EQ(folder.read("files-body_5.obj"), folder.read("own-body_5.obj"));
  ASSERT_EQ(run((folder / "files.json") + " --save " + (folder / "back.json") + " --meshes embedded").code, 0);
  EXPECT_EQ(folder.read("back.json"), folder.read("problem.json"));
}

TEST_F(App, SchemaIsTheLibrarys) {
  const Outcome outcome = run("--schema");
  EXPECT_EQ(outcome.code, 0);
  EXPECT_EQ(outcome.out, problem_schema());
}

TEST_F(App, HelpNamesEveryOption) {
  const Outcome outcome = run("--help");
  EXPECT_EQ(outcome.code, 0);
  for (const char* option :
       {"--metric", "--planner", "--nodes", "--samples", "--seed", "--trees", "--threads", "--captured", "--rollouts",
        "--searches", "--strength", "--tolerance", "--timeout", "--save", "--meshes", "--schema"}) {
    EXPECT_NE(outcome.out.find(option), std::string::npos) << option;
  }
}

TEST_F(App, HelpFitsAPage) {
  std::istringstream lines(run("--help").out);
  int count = 0;
  for (std::string line; std::getline(lines, line); ++count) EXPECT_LE(line.size(), 100u) << line;
  EXPECT_LE(count, 50);
}

TEST_F(App, EveryDisturbanceIsTheLibrarysToTheLastBit) {
  Problem pushed = push();
  pushed.horizon = 0.3;
  pushed.effector = Effector::coast;
  pushed.plan = hold(pushed.scene, pushed.state, 0.3);
  save(pushed, problem);
  const std::map<std::string, DisturbanceModel> models{
      {"uniform --strength 2 --hold 0.1", disturbances::Uniform{2.0, std::nullopt, 0.1}},
      {"gaussian --force 3 --torque 0.5 --correlation-time 0.05", disturbances::Gaussian{3.0, 0.5, 0.05}},
      {"boltzmann --rate 2 --strength 3", disturbances::Boltzmann{2.0, {3.0}}},
      {"plan --force 5 --hold 0.1", disturbances::ActuationNoise{Vector3::Constant(5.0), Vector3::Zero(), 0.0, 0.1}},
      {"plan --force 5,1,0 --hold 0.1", disturbances::ActuationNoise{{5.0, 1.0, 0.0}, Vector3::Zero(), 0.0, 0.1}}};
  for (const auto& [words, model] : models) {
    const Outcome outcome = run(problem + " --metric probability --rollouts 20 --disturbance " + words);
    ASSERT_EQ(outcome.code, 0) << outcome.error;
    ProbabilityOptions options;
    options.rollouts = 20;
    options.disturbance = model;
    const double expected = capture_probability(pushed, options).all.captured();
    EXPECT_TRUE(same_bits(Json::parse(outcome.out)["captured"].get<double>(), expected)) << words;
  }
}

TEST_F(App, AnOptionOfAnotherMetricIsRefused) {
  save(push(), problem);
  expect_error(problem + " --rollouts 9", {"--rollouts", "--metric capture", "it is of probability"});
  expect_error(problem + " --metric effort --trees 2", {"--trees", "effort", "capture"});
  expect_error(problem + " --metric force --nodes 2", {"--nodes", "force", "capture, effort"});
  expect_error(problem + " --metric probability --disturbance gaussian --strength 2", {"--strength", "gaussian"});
  expect_error(problem + " --metric probability --objects 1 --disturbance plan", {"--objects", "plan"});
  expect_error(problem + " --metric probability --disturbance wind", {"--disturbance", "wind", "gaussian"});
}

TEST_F(App, WrongArgumentsAreOneClearLine) {
  save(push(), problem);
  expect_error("", {"no problem file"});
  expect_error(problem + " --nodes 0", {"--nodes", "0", "from 1"});
  expect_error(problem + " --nodes 10x", {"--nodes", "10x", "whole number"});
  expect_error(problem + " --seed -1", {"--seed", "-1"});
  expect_error(problem + " --seed 18446744073709551616", {"--seed", "18446744073709551616"});
  expect_error(problem + " --timeout 0", {"timeout is 0", "above 0"});
  expect_error(problem + " --timeout soon", {"--timeout", "soon", "a number"});
  expect_error(problem + " --tolerance -1", {"tolerance is -1", "above 0"});
  expect_error(problem + " --tolerance 0.1 --trees 2", {"trees with a tolerance is 2", "at least 8"});
  expect_error(problem + " --metric luck",
               {"--metric", "luck", "capture, effort, probability, force or escape_energy"});
  expect_error(problem + " --metric effort --planner sst", {"planner", "sst", "'est' or 'rrt'"});
  expect_error(problem + " --colour red", {"--colour"});
  expect_error(problem + " --nodes", {"--nodes", "no value"});
  expect_error(problem + " other.json", {"two problem files"});
  expect_error(problem + " --metric effort --captured some", {"--captured", "some", "all or any"});
  expect_error(problem + " --metric effort --captured any", {"captured", "any", "all"});
  expect_error(problem + " --metric effort --shorten maybe", {"--shorten", "maybe", "yes or no"});
  expect_error(problem + " --metric force --weights 1,2", {"--weights", "1,2", "five numbers"});
  expect_error(problem + " --metric probability --disturbance plan --force 1,2", {"--force", "1,2", "three"});
  expect_error(problem + " --save x.json --meshes apart", {"--meshes", "apart", "embedded or files"});
  expect_error(problem + " --meshes files", {"--meshes", "--save"});
  expect_error(problem + " --save x.json --nodes 9", {"--nodes", "--save"});
  expect_error(problem + " --save /no/such/folder/x.json", {"/no/such/folder/x.json", "No such file"});
}

TEST_F(App, BrokenFilesAreOneClearLineThatNamesTheFile) {
  expect_error("/no/such/file.json", {"/no/such/file.json", "cannot be opened"});
  const std::string text = to_json(push());
  folder.write("problem.json", text.substr(0, text.size() / 2));
  expect_error(problem, {problem, "cut off"});
  Json json = Json::parse(text);
  json["scene"]["bodies"][1]["mass"] = -1;
  folder.write("problem.json", json.dump());
  expect_error(problem, {problem, "scene.bodies[1]", "mass is -1"});
  json["scene"]["bodies"][1]["name"] = "a name\nof two lines";
  folder.write("problem.json", json.dump());
  expect_error(problem, {problem, "'a name of two lines'", "mass is -1"});
}

}  // namespace
}  // namespace energymargin
