// The JSON Schema of problem files: it takes what the writer writes, and refuses what the reader refuses.

#include <gtest/gtest.h>

#include <set>

#include "expect.hpp"
#include "problem_files.hpp"
#include "problem_io/json.hpp"
#include "schema_check.hpp"
#include "schema_definitions.hpp"

namespace energymargin {
namespace {

using namespace scenes;
using Json = problem_io::Json;
using Pointer = Json::json_pointer;

bool fits_schema(const Json& json) {
  try {
    problem_io::check_schema(json);
  } catch (const std::invalid_argument&) {
    return false;
  }
  return true;
}

bool reads(const Json& json) {
  try {
    problem_io::read_problem(json, "");
  } catch (const std::invalid_argument&) {
    return false;
  }
  return true;
}

// Places of a file but the root, one of each kind.
class Places {
 public:
  explicit Places(const Json& file) { collect(file, Pointer(), ""); }
  std::vector<Pointer> all;

 private:
  void collect(const Json& json, const Pointer& at, const std::string& kind) {
    if (json.is_object()) {
      const std::string of_type = kind + (json.contains("type") ? json["type"].dump() : "");
      for (const auto& [key, value] : json.items()) add(value, at / key, of_type + "/" + key);
    } else if (json.is_array()) {
      for (std::size_t i = 0; i < json.size(); ++i) add(json[i], at / i, kind + "[]");
    }
  }
  void add(const Json& json, const Pointer& at, const std::string& kind) {
    if (kinds_.insert(kind).second) all.push_back(at);
    collect(json, at, kind);
  }
  std::set<std::string> kinds_;
};

// Everything that a file can hold, in three files.
std::vector<Json> full_files() {
  return {Json::parse(to_json(everything())), Json::parse(to_json(articulated())), Json::parse(to_json(planned()))};
}

TEST(ProblemSchema, EveryFileThatIsWrittenFits) {
  for (const Problem& problem : {everything(), articulated(), planned(), push(), closed_cage(), lift(0.1), drift()}) {
    EXPECT_NO_THROW(problem_io::check_schema(Json::parse(to_json(problem))));
  }
  const Folder folder;
  save(everything(), folder / "p.json", Meshes::files);
  EXPECT_NO_THROW(problem_io::check_schema(Json::parse(folder.read("p.json"))));
}

TEST(ProblemSchema, FieldsOfEachStructAreThoseOfTheCode) {
  const auto schema = problem_io::OrderedJson::parse(problem_schema());
  const auto definitions = problem_io::schema_definitions();
  for (const auto& [name, definition] : definitions.items()) {
    ASSERT_TRUE(schema["definitions"].contains(name)) << name << "; run: make schema";
    EXPECT_EQ(schema["definitions"][name].dump(2), definition.dump(2)) << "run: make schema";
  }
}

TEST(ProblemSchema, KeyThatTheReaderMissesTheSchemaMissesToo) {
  const std::set<std::string> optional{"succeeded",
                                       "within",
                                       "captured_any",
                                       "succeeded_any",
                                       "margin",
                                       "joints",
                                       "tendons",
                                       "loops",
                                       "springs",
                                       "contacts",
                                       "disabled_collisions",
                                       "force_weights",
                                       "inertial",
                                       "mimic",
                                       "frame",
                                       "at",
                                       "solid",
                                       "horizon",
                                       "check",
                                       "dwell",
                                       "plan",
                                       "wrenches",
                                       "targets",
                                       "velocities",
                                       "friction_rule",
                                       "pair_frictions",
                                       "kinematic",
                                       "armature"};
  std::set<std::string> left_out;
  for (const Json& file : full_files()) {
    for (const Pointer& place : Places(file).all) {
      if (!file[place.parent_pointer()].is_object()) continue;
      Json changed = file;
      changed[place.parent_pointer()].erase(place.back());
      const bool of_part = (place.back() == "force" || place.back() == "torque") && place.parent_pointer() != Pointer();
      const bool of_half_space = place.back() == "ahead" && file[place.parent_pointer()]["type"] == "half_space";
      const bool of_position = place.back() == "point" && file[place.parent_pointer()]["type"] != "speed";
      const bool of_tendon = place.back() == "joints" && file[place.parent_pointer()].contains("torque_limit");
      if (of_tendon) continue;
      if (of_part || of_half_space || of_position || optional.count(place.back()) != 0) {
        EXPECT_TRUE(fits_schema(changed)) << place;
        left_out.insert(place.back());
      } else {
        EXPECT_FALSE(fits_schema(changed)) << place;
        EXPECT_FALSE(reads(changed)) << place;
      }
    }
  }
  EXPECT_EQ(left_out.size(), optional.size() + 4);  // all of them, "force", "torque", "ahead" and "point"
}

TEST(ProblemSchema, ValueOfAnotherTypeIsRefusedByBoth) {
  const std::vector<Json> others{nullptr, true, 1.5, "text", Json::array(), Json::object()};
  for (const Json& file : full_files()) {
    for (const Pointer& place : Places(file).all) {
      for (const Json& other : others) {
        const Json& own = file[place];
        if (other.type() == own.type() || (other.is_number() && own.is_number())) continue;
        if (other.is_number() && own == "inf") continue;  // a size without end may have one
        if (other.is_number() && own == "-inf") continue;
        Json changed = file;
        changed[place] = other;
        EXPECT_FALSE(fits_schema(changed)) << place << " " << other;
        EXPECT_FALSE(reads(changed)) << place << " " << other;
      }
    }
  }
}

TEST(ProblemSchema, KeyThatNobodyReadsIsRefusedByBoth) {
  for (const Json& file : full_files()) {
    std::vector<Pointer> places = Places(file).all;
    places.emplace_back();
    for (const Pointer& place : places) {
      if (!file[place].is_object()) continue;
      Json changed = file;
      changed[place]["colour"] = "red";
      EXPECT_FALSE(fits_schema(changed)) << place;
      EXPECT_FALSE(reads(changed)) << place;
    }
  }
}

TEST(ProblemSchema, ListOfAnotherLengthIsRefusedByBoth) {
  for (const Json& file : full_files()) {
    for (const Pointer& place : Places(file).all) {
      if (!file[place].is_array() || file[place].empty() || !file[place][0].is_number()) continue;
      if (place.back() == "state") continue;
      for (const bool longer : {false, true}) {
        Json changed = file;
        longer ? changed[place].push_back(0.0) : changed[place].erase(0);
        EXPECT_FALSE(fits_schema(changed)) << place;
        EXPECT_FALSE(reads(changed)) << place;
      }
    }
  }
}

TEST(ProblemSchema, WordThatStandsForNothingIsRefusedByBoth) {
  for (const Json& file : full_files()) {
    for (const Pointer& place : Places(file).all) {
      const std::set<std::string> chosen{"type", "role", "effector", "format"};
      if (chosen.count(place.back()) == 0 || !file[place].is_string()) continue;
      Json changed = file;
      changed[place] = "cone";
      EXPECT_FALSE(fits_schema(changed)) << place;
      EXPECT_FALSE(reads(changed)) << place;
    }
  }
}

TEST(ProblemSchema, ErrorNamesTheInnermostPlace) {
  Json json = full_files()[0];
  json["captured"]["of"][0]["of"][0]["radius"] = -1;
  EXPECT_TRUE(rejects([&] { problem_io::check_schema(json); },
                      {"captured.of[0].of[0].radius does not fit the schema", "greater than 0"}));
  EXPECT_TRUE(rejects([&] { problem_io::check_schema(7); }, {"problem does not fit the schema"}));
}

TEST(ProblemSchema, NestedRegionsTakeNoMoreTimeThanTheirNumber) {
  Problem problem = push();
  for (int i = 0; i < 60; ++i) problem.captured = ~problem.captured;
  EXPECT_NO_THROW(from_json(to_json(problem)));  // tried one by one, three combinations a level would take for ever
}

}  // namespace
}  // namespace energymargin
