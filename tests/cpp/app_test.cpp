// The example executable, run as a process of its own.

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "energymargin/metrics/capture.hpp"
#include "energymargin/metrics/effort.hpp"
#include "energymargin/metrics/escape_energy.hpp"
#include "energymargin/metrics/force.hpp"
#include "energymargin/problem_io.hpp"
#include "expect.hpp"
#include "scenes.hpp"

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
  App() : base_(testing::TempDir() + "app_" + std::to_string(getpid())), problem(base_ + ".json") {}
  ~App() override {
    for (const char* ending : {".json", ".out", ".error"}) std::remove((base_ + ending).c_str());
  }

  Outcome run(const std::string& arguments) const {
    const std::string command =
        "\"" ENERGYMARGIN_SCORE "\" " + arguments + " > \"" + base_ + ".out\" 2> \"" + base_ + ".error\"";
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, content(base_ + ".out"), content(base_ + ".error")};
  }

  // A failure is one line on the error stream that holds the parts, and nothing else.
  void expect_error(const std::string& arguments, const std::vector<std::string>& parts) const {
    const Outcome outcome = run(arguments);
    EXPECT_NE(outcome.code, 0) << arguments;
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(outcome.error.find('\n') + 1, outcome.error.size()) << outcome.error;
    EXPECT_EQ(outcome.error.rfind("error: ", 0), 0u) << outcome.error;
    for (const std::string& part : parts) {
      EXPECT_NE(outcome.error.find(part), std::string::npos) << outcome.error << " does not say " << part;
    }
  }

  std::string base_;
  std::string problem;

 private:
  static std::string content(const std::string& path) {
    std::ostringstream text;
    text << std::ifstream(path).rdbuf();
    return text.str();
  }
};

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
  EXPECT_TRUE(same_bits(json["capture"].get<double>(), score.capture));
  EXPECT_TRUE(same_bits(json["success"].get<double>(), *score.success));
  EXPECT_TRUE(same_bits(json["capture_stderr"].get<double>(), *score.capture_stderr));
  EXPECT_TRUE(same_bits(json["success_stderr"].get<double>(), *score.success_stderr));
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

TEST_F(App, HelpNamesEveryOption) {
  const Outcome outcome = run("--help");
  EXPECT_EQ(outcome.code, 0);
  for (const char* option : {"--metric", "--planner", "--nodes", "--samples", "--seed", "--trees", "--threads"}) {
    EXPECT_NE(outcome.out.find(option), std::string::npos) << option;
  }
}

TEST_F(App, WrongArgumentsAreOneClearLine) {
  save(push(), problem);
  expect_error("", {"no problem file"});
  expect_error(problem + " --nodes 0", {"--nodes", "0", "from 1"});
  expect_error(problem + " --nodes 10x", {"--nodes", "10x", "whole number"});
  expect_error(problem + " --seed -1", {"--seed", "-1"});
  expect_error(problem + " --seed 18446744073709551616", {"--seed", "18446744073709551616"});
  expect_error(problem + " --metric luck", {"--metric", "luck", "capture, effort, force or escape_energy"});
  expect_error(problem + " --metric effort --planner sst", {"planner", "sst", "'est' or 'rrt'"});
  expect_error(problem + " --colour red", {"--colour"});
  expect_error(problem + " --nodes", {"--nodes", "no value"});
  expect_error(problem + " other.json", {"two problem files"});
}

TEST_F(App, BrokenFilesAreOneClearLineThatNamesTheFile) {
  expect_error("/no/such/file.json", {"/no/such/file.json", "cannot be opened"});
  const std::string text = to_json(push());
  std::ofstream(problem) << text.substr(0, text.size() / 2);
  expect_error(problem, {problem, "cut off"});
  Json json = Json::parse(text);
  json["scene"]["bodies"][1]["mass"] = -1;
  std::ofstream(problem) << json.dump();
  expect_error(problem, {problem, "scene.bodies[1]", "mass is -1"});
}

}  // namespace
}  // namespace energymargin
