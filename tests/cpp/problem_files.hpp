#pragma once
// Problems that have everything that a problem file can hold, and files of a test's own.

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "energymargin/problem_io.hpp"
#include "mechanisms.hpp"

namespace energymargin::scenes {

//! A folder of the test's own, removed at its end.
class Folder {
 public:
  Folder() : path_(testing::TempDir() + "energymargin_" + std::to_string(getpid())) {
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  std::string operator/(const std::string& name) const { return path_ + "/" + name; }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(*this / name, std::ios::binary) << text;
    return *this / name;
  }
  std::string read(const std::string& name) const {
    std::ostringstream text;
    text << std::ifstream(*this / name, std::ios::binary).rdbuf();
    return text.str();
  }

 private:
  std::string path_;
};

//! A mug of three convex parts, for which another solid stands.
inline Compound mug() {
  Compound mug;
  for (int i = 0; i < 3; ++i) {
    const Vector3 place(0.1 * i / 3.0, -0.02 / 7.0, 0.01);
    mug.parts.push_back({brick({0.05, 0.06, 0.07}, turn(0.3 * i, Vector3::UnitZ()), place), {}});
  }
  mug.solid =
      MassProperties{1.0 / 3000.0, {0.03, 0.0, 1.0 / 300.0}, {0.1, 0.2, 0.7 / 3.0}, turn(0.1, Vector3::UnitX())};
  return mug;
}

//! Free bodies of every shape, two objects, regions of every type, and numbers that have many digits.
inline Problem everything() {
  Scene scene(Vector3(0.1, 0.2, -9.7), Stepping{1.0 / 300.0, 60, 1e-8, 0.001}, FrictionRule::max);
  scene.add_body(fixed("plane", Plane{Vector3(1.0, 2.0, 3.0).normalized(), -10.0 / 3.0}));
  Compound tool;
  tool.parts.push_back({Capsule{0.1, 0.2}, {{0.1, 0.0, 1.0 / 3.0}, turn(0.7, Vector3::UnitY())}});
  tool.parts.push_back({brick({0.1, 0.2, 0.3}), {{0.0, 0.1, 0.0}, Quaternion::Identity()}});
  const std::vector<Shape> shapes{Box{{0.1, 0.2, 1.0 / 3.0}},
                                  Sphere{0.1},
                                  Cylinder{0.1, 0.2},
                                  Capsule{0.1, 0.2},
                                  brick({0.1, 0.2, 0.3}, turn(0.3, Vector3::UnitX())),
                                  mug(),
                                  tool,
                                  Compound{}};
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    Body made = body("body " + std::to_string(i), shapes[i], 1.0 / (3.0 + static_cast<double>(i)),
                     {2.0 * static_cast<double>(i), 0.0, 3.0}, i == 0 || i == 5 ? Role::object : Role::none, 1.0 / 7.0);
    made.linear_factor = {1.0, 1.0, i == 1 ? 0.0 : 1.0};
    made.angular_factor = {1.0, i == 1 ? 0.0 : 1.0, 1.0};
    made.state.orientation = turn(0.1, Vector3(1.0, 1.0, 1.0).normalized());
    made.state.velocity = {0.1, -0.0, 0.0};
    made.kinematic = i == 3;
    if (i == 2 || i == 7)
      made.inertial = Inertial{{0.1, 0.0, 0.2 / 3.0}, {0.1, 0.2, 0.29}, turn(0.2, Vector3::UnitZ())};
    scene.add_body(made);
  }
  scene.add_body(body("wheel", Sphere{0.1}, 1.0 / 3.0, Vector3::Zero()));
  Joint axle = joint("axle", JointType::revolute, "plane", "wheel", Vector3::UnitZ(), {0.0, -9.0, 30.0});
  axle.armature = 1.0 / 17.0;
  scene.add_joint(axle);
  scene.add_spring({"body 1", "body 2", {0.01, 0.0, 0.0}, {0.0, 0.01, 1.0 / 300.0}, 1.0 / 3.0, 0.1, 0.01});
  scene.disable_collisions("body 4", "body 3");
  scene.disable_collisions("plane", "body 0");
  scene.set_friction({"body 2", "plane", 1.0 / 7.0});
  scene.set_friction({"body 5", "body 1", 0.0});
  const Region ball = regions::Ball{"body 0", {0.1, 0.2, 0.3}, 0.7, "body 1", regions::Point::center_of_mass};
  const Region box = regions::Box{"body 5", {0.1, 0.2, 0.3}, {infinity, 0.1, infinity}};
  const Region disc = regions::Disc{"body 0", {0.1, 0.2}, 0.7, "plane"};
  const Region sector = regions::AnnularSector{"body 0", {0.1, 0.2}, 0.7, 0.1, 9.0, -1.0, "body 2"};
  const Region half = regions::HalfSpace{"body 0", Vector3(1.0, -1.0, 0.5).normalized(), 0.1};
  const Region speed = regions::Speed{"body 0", 0.1, {0.0, 0.1, 0.0}, "body 3"};
  const Region tilt = regions::Tilt{"body 0", Vector3::UnitX(), Vector3(1.0, 1.0, 1.0).normalized(), 0.1, "body 4"};
  const Region ahead = regions::HalfSpace{"body 0", Vector3::UnitX(), 0.1, "body 3", 1.0 / 3.0};
  Problem problem = problem_of(scene, {1.0, 0.0, 0.1}, {0.0, 1.0 / 3.0, 0.0}, 0.7, (ball | box) & ~(disc & sector));
  problem.succeeded = half & ahead & speed;
  problem.captured_any = ball | box;
  problem.succeeded_any = half | speed;
  regions::Swept swept{"body 0", "body 1", 0.1, 0.2, 0.3, 0.4, 0.5};
  const Region own = swept;
  swept.point = regions::Point::center_of_mass;
  swept.at = regions::PlanarMotion{{0.1, 0.2}, {0.3, 1.0 / 3.0}, 0.4};
  problem.within = ~(tilt & own) | swept;
  problem.rate = 1.0 / 3.0;
  problem.force_weights = {0.1, 1.0 / 3.0, 7.0, -0.1, 1.0 / 9.0};
  Contact contact{"body 0", "body 1", {0.1, 0.2, 0.3}, Vector3::UnitX(), -0.001, 1.0 / 3.0, {0.0, 0.1, 0.0}, 0.02};
  problem.contacts = {contact};
  return problem;
}

//! A hand with numbers that have many digits, held, fixed and following joints, oblique frames and a spring.
inline Problem articulated() {
  Scene scene = hand();
  Body tool = body("tool", Box{{0.02, 0.02, 0.02}}, 1.0 / 7.0, Vector3::Zero());
  tool.force = {0.1, -1.0 / 3.0, 0.7};
  scene.add_body(tool);
  scene.add_body(body("tip", Sphere{0.01}, 1.0 / 30.0, Vector3::Zero()));
  scene.add_body(body("twin", mug(), 1.0 / 70.0, Vector3::Zero()));
  Joint rail = joint("rail", JointType::prismatic, "palm", "tool", Vector3(1.0, 2.0, 2.0) / 3.0, {0.0, 0.3, 1.0 / 3.0});
  rail.in_parent.orientation = turn(0.3, Vector3(1.0, 1.0, 0.0).normalized());
  rail.in_child.orientation = turn(-0.7, Vector3::UnitY());
  rail.held = true;
  rail.state.position = 1.0 / 11.0;
  rail.upper = 0.3;
  rail.target = 0.1;
  rail.target_velocity = 1.0 / 13.0;
  rail.stiffness = 100.0 / 3.0;
  rail.damping = 0.1;
  rail.torque_limit = 2.0 / 3.0;
  scene.add_joint(rail);
  scene.add_joint(joint("weld", JointType::fixed, "tool", "tip", Vector3::UnitZ(), {0.0, 0.0, 0.05}));
  Joint twin = joint("twin", JointType::revolute, "palm", "twin", Vector3::UnitX(), {0.0, -0.5, 0.3});
  twin.mimic = Mimic{"left 1", -1.0 / 3.0, 0.1};
  scene.add_joint(twin);
  Tendon tendon;
  tendon.name = "tendon";
  tendon.joints = {{"left 1", 1.0 / 3.0}, {"rail", -1.0 / 7.0}};
  tendon.lower = -1.0 / 3.0;
  tendon.target = 0.1;
  tendon.stiffness = 1.0 / 3.0;
  tendon.friction = 1.0 / 11.0;
  scene.add_tendon(tendon);
  scene.add_loop({"tip", "palm", LoopType::weld, {0.01, 0.0, 1.0 / 3.0}, {0.0, 0.1, 0.0}, turn(0.3, Vector3::UnitY())});
  scene.add_spring({"tip", "object", {0.01, 0.0, 0.0}, {0.0, 0.01, 1.0 / 300.0}, 1.0 / 3.0, 0.1, 0.01});
  Problem problem = problem_of(scene, {1.0, 0.0, 0.0}, Vector3::Zero(), 0.2, regions::Ball{"object"});
  problem.state = pack(scene, {}, {{"left 1", {0.5 + 1.0 / 30.0, 1.0 / 7.0}}});
  problem.force_weights = {0.1, 1.0 / 3.0, 7.0, -0.1, 1.0 / 9.0};
  problem.effector = Effector::drive;
  return problem;
}

//! Rows of numbers that have many digits, a zero with a sign and the smallest number there is among them.
inline Wrenches uneven_rows(int rows, double size, int columns = 6) {
  Wrenches numbers(rows, columns);
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) numbers(i, j) = size * std::sin(1.0 + i * columns + j) / 3.0;
  }
  numbers(0, 0) = -0.0;
  numbers(rows - 1, columns - 1) = 5e-324;
  return numbers;
}

//! The hand and three free bodies with a horizon and a plan of every kind, in no order of names, with and without
//! limits.
inline Problem planned() {
  constexpr int rows = 7;
  Problem problem = articulated();
  const double step = problem.scene.stepping().step;
  for (const auto& [name, x] : {std::pair{"pusher", 3.0}, {"cart", 4.0}, {"guide", 5.0}}) {
    problem.scene.add_body(body(name, Sphere{0.05}, 1.0 / 3.0, {x, 0.0, 1.0}, Role::effector));
  }
  problem.state = pack(problem.scene, {}, {{"left 1", {0.5 + 1.0 / 30.0, 1.0 / 7.0}}});
  problem.effector = Effector::coast;
  problem.horizon = 11 * step;
  problem.check = 3 * step;
  problem.dwell = 3 * step;
  Plan plan{2 * step};
  plan.wrenches = {{"tip", uneven_rows(rows, 0.1)}, {"pusher", uneven_rows(rows, 0.7)}};
  plan.targets = {{"right 2", uneven_rows(rows, 0.3, 1)}, {"left 1", uneven_rows(rows, 0.2, 1)}};
  plan.velocities = {{"pusher", uneven_rows(rows, 0.5), 1.0 / 3.0, 0.0},
                     {"cart", uneven_rows(rows, 0.4), std::nullopt, 2.0 / 3.0},
                     {"guide", uneven_rows(rows, 0.3)}};
  problem.plan = plan;
  return problem;
}

//! The JSON of a problem with a plan whose rows are lists, as they may be written by hand.
inline std::string with_listed_rows(const Problem& problem) {
  auto json = nlohmann::ordered_json::parse(to_json(problem));
  const auto list = [](nlohmann::ordered_json& rows, const auto& numbers) {
    rows = nlohmann::ordered_json::array();
    for (Eigen::Index i = 0; i < numbers.rows(); ++i) {
      const Eigen::VectorXd row = numbers.row(i);
      if (row.size() == 1) rows.push_back(row[0]);
      if (row.size() > 1) rows.push_back(std::vector<double>(row.begin(), row.end()));
    }
  };
  auto& plan = json["plan"];
  for (std::size_t i = 0; i < problem.plan->wrenches.size(); ++i) {
    list(plan["wrenches"][i]["rows"], problem.plan->wrenches[i].wrenches);
  }
  for (std::size_t i = 0; i < problem.plan->targets.size(); ++i) {
    list(plan["targets"][i]["rows"], problem.plan->targets[i].positions);
  }
  for (std::size_t i = 0; i < problem.plan->velocities.size(); ++i) {
    list(plan["velocities"][i]["rows"], problem.plan->velocities[i].velocities);
  }
  return json.dump();
}

}  // namespace energymargin::scenes
