// Joints: position control with compliance, stops, held joints.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "energymargin/world.hpp"
#include "expect.hpp"
#include "mechanisms.hpp"

namespace energymargin {
namespace {

using namespace scenes;

constexpr double step = 1.0 / 240.0;

Joint drive(double stiffness, double damping, double target = 0.0) {
  Joint made;
  made.stiffness = stiffness;
  made.damping = damping;
  made.target = target;
  return made;
}

Joint limited(Joint made, double lower, double upper) {
  made.lower = lower;
  made.upper = upper;
  return made;
}

State at(const Scene& scene, double position, double velocity = 0.0) {
  return pack(scene, {}, {{"hinge", {position, velocity}}});
}

// Positions of the hinge at the start and after each step.
std::vector<double> positions(const Scene& scene, const State& start, int steps, const Plan& script = {}) {
  std::vector<double> found;
  for (const State& state : trajectory(scene, start, steps, script)) found.push_back(state[0]);
  return found;
}

double highest(const std::vector<double>& values) { return *std::max_element(values.begin(), values.end()); }
double lowest(const std::vector<double>& values) { return *std::min_element(values.begin(), values.end()); }

// A cart of 2 kg on a rail along x.
Scene rail(Joint made, const Vector3& gravity = Vector3::Zero()) {
  Scene scene(gravity, exact());
  scene.add_body(fixed("post", Box{{0.1, 0.1, 0.1}}));
  scene.add_body(body("cart", Box{{0.2, 0.1, 0.1}}, 2.0, Vector3::Zero()));
  made.name = "hinge";
  made.type = JointType::prismatic;
  made.parent = "post";
  made.child = "cart";
  made.axis = Vector3::UnitX();
  scene.add_joint(made);
  return scene;
}

// ---- compliance

TEST(Joint, CompliantJointSettlesAtLoadOverStiffness) {
  const Scene scene = rod_on_post(Vector3::UnitZ(), Vector3::Zero(), drive(2.0, 0.3, 0.25));
  const Drive load = steady("rod", Vector3::Zero(), {0.0, 0.0, 0.5}, 960);
  EXPECT_NEAR(after(scene, at(scene, 0.25), 960, {0.0, {load}})[0], 0.25 + 0.5 / 2.0, 1e-8);
  const Scene slide = rail(drive(50.0, 20.0, 0.1));
  const Drive push = steady("cart", {-3.0, 7.0, 9.0}, Vector3::Zero(), 960);
  EXPECT_NEAR(after(slide, at(slide, 0.1), 960, {0.0, {push}})[0], 0.1 - 3.0 / 50.0, 1e-8);
}

TEST(Joint, CompliantJointSagsUnderItsLinksWeight) {
  const Scene scene = rod_on_post(Vector3::UnitY(), downwards, drive(5.0, 0.5));
  const double sag = after(scene, at(scene, 0.0), 1200)[0];  // a turn about y lowers the rod's end
  EXPECT_NEAR(5.0 * sag, 0.3 * g * 0.25 * std::cos(sag), 1e-9);
  EXPECT_GT(sag, 0.1);
}

TEST(Joint, CompliantJointSwingsWithThePeriodOfItsStiffness) {
  // The implicit spring also damps: a share of omega step / 2 of each swing's phase.
  const Scene scene = rod_on_post(Vector3::UnitZ(), Vector3::Zero(), drive(1.0, 0.0));
  const std::vector<double> swing = positions(scene, at(scene, 0.1), 1440);
  std::vector<double> passages;
  for (std::size_t i = 1; i < swing.size(); ++i) {
    if (swing[i - 1] > 0.0 && swing[i] <= 0.0) {
      passages.push_back((static_cast<double>(i) + swing[i] / (swing[i - 1] - swing[i])) * step);
    }
  }
  ASSERT_GT(passages.size(), 2u);
  const double period = (passages.back() - passages.front()) / static_cast<double>(passages.size() - 1);
  EXPECT_NEAR(period / (2.0 * pi * std::sqrt(rod_inertia)), 1.0, 1e-3);
  EXPECT_LE(highest(swing), 0.1);
}

TEST(Joint, CriticallyDampedJointReturnsWithoutOvershootAlongItsClosedForm) {
  const double rate = 8.0;
  const Scene scene =
      rod_on_post(Vector3::UnitZ(), Vector3::Zero(), drive(rod_inertia * rate * rate, 2.0 * rod_inertia * rate, 0.2));
  const std::vector<double> way = positions(scene, at(scene, 0.7), 480);
  EXPECT_GE(lowest(way), 0.2);
  for (std::size_t i = 0; i < way.size(); ++i) {
    const double phase = rate * static_cast<double>(i) * step;
    EXPECT_NEAR(way[i], 0.2 + 0.5 * (1.0 + phase) * std::exp(-phase), 0.005) << i;
  }
}

TEST(Joint, VeryStiffJointIsStableAndBearsItsLoad) {
  for (const double damping : {0.0, 1.0, 1e4}) {
    const Scene scene = rod_on_post(Vector3::UnitY(), downwards, drive(1e6, damping, 0.3));
    const std::vector<double> way = positions(scene, at(scene, 0.2), 480);
    EXPECT_LE(highest(way), 0.3 + 1e-3) << damping;
    EXPECT_GE(lowest(way), 0.2 - 1e-3) << damping;
    EXPECT_NEAR(way.back() - 0.3, 0.3 * g * 0.25 * std::cos(0.3) / 1e6, 1e-8) << damping;
  }
}

TEST(Joint, StiffFingersSqueezeALightBoxWithTheForceOfTheirTargets) {
  Scene scene(downwards, exact());
  scene.add_body(fixed("post", Box{{0.1, 0.1, 0.1}}, {0.0, 0.0, 1.0}));
  scene.add_body(body("object", Box{{0.1, 0.1, 0.1}}, 0.05, Vector3::Zero(), Role::object, 1.0));
  for (const double side : {-1.0, 1.0}) {
    const std::string name = side < 0.0 ? "left" : "right";
    scene.add_body(body(name, Sphere{0.02}, 0.2, Vector3::Zero(), Role::effector, 1.0));
    Joint slide = joint(name, JointType::prismatic, "post", name, {-side, 0.0, 0.0}, {0.07 * side, 0.0, -1.0});
    slide.stiffness = 1000.0;
    slide.damping = 30.0;
    slide.target = 0.001;
    scene.add_joint(slide);
  }
  const Frame end = World(scene).simulate(pack(scene), {}, 480, {480}).front();
  // Each finger bears half of the weight at 5 cm from the centre, and lets the box creep.
  EXPECT_LT(body_in(scene, end.state, "object").position.norm(), 1.01 * 1.25 * creeping * g * step * 480.0 * step);
  ASSERT_EQ(end.contacts.size(), 2u);
  for (const Contact& contact : end.contacts) {
    EXPECT_NEAR(contact.normal_force, 1.0, 0.01);
    EXPECT_NEAR(contact.tangential_force.norm(), 0.5 * 0.05 * g, 0.01);
  }
}

TEST(Joint, DampedJointLosesItsSpeedAtTheRateOfItsDamping) {
  const Scene scene = rail(drive(0.0, 4.0));
  const State end = after(scene, at(scene, 0.0, 1.0), 120);
  EXPECT_NEAR(end[1], std::exp(-4.0 / 2.0 * 0.5), 0.005);
  EXPECT_NEAR(end[0], 2.0 / 4.0 * (1.0 - end[1]), 0.005);
}

TEST(Joint, TargetVelocityIsWhatADampedJointRunsAt) {
  Joint run = drive(0.0, 40.0);
  run.target_velocity = 0.3;
  const Scene scene = rail(run);
  EXPECT_NEAR(after(scene, at(scene, 0.0), 480)[1], 0.3, 1e-9);
}

// ---- torque limit

TEST(Joint, JointYieldsWhereItsLoadExceedsTheTorqueLimitAndHoldsBelow) {
  Joint weak = drive(100.0, 1.0);
  weak.torque_limit = 0.5;
  const Scene scene = rod_on_post(Vector3::UnitZ(), Vector3::Zero(), weak);
  const auto under = [&](double torque) {
    return after(scene, at(scene, 0.0), 120, {0.0, {steady("rod", Vector3::Zero(), {0.0, 0.0, torque}, 120)}});
  };
  EXPECT_NEAR(under(0.4)[0], 0.4 / 100.0, 1e-6);
  EXPECT_NEAR(under(-0.4)[0], -0.4 / 100.0, 1e-6);
  for (const double side : {1.0, -1.0}) {
    const Drive load = steady("rod", Vector3::Zero(), {0.0, 0.0, side * 0.7}, 120);
    const std::vector<State> yielding = trajectory(scene, at(scene, 0.0), 120, {0.0, {load}});
    EXPECT_NEAR(yielding[120][1] - yielding[60][1], side * 0.2 / rod_inertia * 0.25, 1e-9);
  }
}

TEST(Joint, WithoutTorqueNothingHoldsAJoint) {
  Joint limp = drive(100.0, 1.0);
  limp.torque_limit = 0.0;
  const Scene scene = rail(limp, {-1.0, 0.0, 0.0});
  EXPECT_NEAR(after(scene, at(scene, 0.0), 240)[1], -1.0, 1e-9);
}

// ---- stops

TEST(Joint, JointThrownAgainstItsStopStaysWithinIt) {
  for (const double speed : {0.5, 5.0, 50.0}) {
    const double given = 1.01 * stop_giving * speed * step;  // of its way in a step
    const Scene scene = rod_on_post(Vector3::UnitZ(), Vector3::Zero(), limited({}, -0.4, 0.5));
    EXPECT_LE(highest(positions(scene, at(scene, 0.1, speed), 480)), 0.5 + given) << speed;
    EXPECT_GE(lowest(positions(scene, at(scene, 0.1, -speed), 480)), -0.4 - given) << speed;
    const Scene slide = rail(limited({}, -0.4, 0.5));
    EXPECT_LE(highest(positions(slide, at(slide, 0.1, speed), 480)), 0.5 + given) << speed;
  }
}

// It gives a little, and takes a fifth of that back in a step: two millionths of the speed.
TEST(Joint, StopTakesUpTheSpeedAndGivesNextToNoneBack) {
  const Scene scene = rail(limited({}, -1.0, 0.5));
  const State end = after(scene, at(scene, 0.0, 3.0), 240);
  EXPECT_NEAR(end[1], -0.2 * stop_giving * 3.0, 1e-3 * stop_giving);
  EXPECT_NEAR(end[0], 0.5, 0.2 * stop_giving * 3.0);
}

TEST(Joint, StopBearsWeightAndADriveThatPullsBeyondIt) {
  const Scene hanging = rod_on_post(Vector3::UnitY(), downwards, limited({}, -1.0, 0.5));
  EXPECT_NEAR(after(hanging, at(hanging, 0.0), 480)[0], 0.5, 1e-6);
  const Scene driven = rail(limited(drive(1000.0, 50.0, 2.0), -0.5, 0.5));
  EXPECT_NEAR(after(driven, at(driven, 0.0), 480)[0], 0.5, 1e-6);
}

TEST(Joint, ChainThrownAgainstAllItsStopsStaysWithinThem) {
  Scene scene = rod_on_post(Vector3::UnitY(), downwards, limited({}, -0.3, 0.3));
  scene.add_body(body("second", Box{{0.4, 0.04, 0.04}}, 0.3, Vector3::Zero()));
  scene.add_body(body("third", Box{{0.3, 0.04, 0.04}}, 0.3, Vector3::Zero()));
  Joint elbow =
      joint("elbow", JointType::revolute, "rod", "second", Vector3::UnitY(), {0.25, 0.0, 0.0}, {-0.2, 0.0, 0.0});
  Joint wrist =
      joint("wrist", JointType::revolute, "second", "third", Vector3::UnitY(), {0.2, 0.0, 0.0}, {-0.15, 0.0, 0.0});
  scene.add_joint(limited(elbow, -0.3, 0.3));
  scene.add_joint(limited(wrist, -0.3, 0.3));
  const auto beyond = [&](double speed) {
    double most = 0.0;
    for (const double elbow_side : {-1.0, 1.0}) {
      for (const double wrist_side : {-1.0, 1.0}) {
        const State start =
            pack(scene, {},
                 {{"hinge", {0.0, speed}}, {"elbow", {0.0, elbow_side * speed}}, {"wrist", {0.0, wrist_side * speed}}});
        for (const State& state : trajectory(scene, start, 480)) {
          for (const int number : {0, 2, 4}) most = std::max(most, std::abs(state[number]) - 0.3);
        }
      }
    }
    return most;
  };
  EXPECT_LT(beyond(1.0), 0.005);
  EXPECT_LT(beyond(5.0), 0.005);
  EXPECT_LT(beyond(10.0), 0.05);
  EXPECT_LT(beyond(20.0), 0.05);
}

TEST(Joint, JointAShadeBeyondItsStopIsNotShotBack) {
  const Scene scene = rail(limited({}, -1.0, 0.5));
  for (const State& state : trajectory(scene, at(scene, 0.5015), 240)) {
    EXPECT_LE(state[0], 0.5015 + 1e-9);
    ASSERT_GE(state[0], 0.5 - 1e-3);  // it goes on at the 1 mm/s at most at which it is put right
  }
  EXPECT_LT(World(scene).energy(after(scene, at(scene, 0.5015), 240)), 1e-6);
}

// ---- held joints

// A chain of a held hinge, a compliant one, a held rail and a free hinge.
Scene partly_held() {
  Scene scene = rod_on_post(Vector3::UnitY(), downwards, drive(3.0, 0.1));
  scene.add_body(body("slide", Box{{0.1, 0.1, 0.1}}, 0.3, Vector3::Zero()));
  scene.add_body(
      body("wing", brick({0.3, 0.1, 0.06}, turn(0.6, Vector3(1.0, 2.0, -1.0).normalized())), 0.4, Vector3::Zero()));
  scene.add_body(body("tail", Box{{0.2, 0.1, 0.05}}, 0.2, Vector3::Zero()));
  Joint sled = joint("sled", JointType::prismatic, "rod", "slide", Vector3(1.0, 2.0, 2.0) / 3.0, {0.3, 0.0, 0.0});
  sled.held = true;
  sled.in_parent.orientation = turn(0.4, Vector3::UnitX());
  scene.add_joint(sled);
  Joint wing = joint("flap", JointType::revolute, "slide", "wing", Vector3(2.0, -1.0, 2.0) / 3.0, {0.0, 0.1, 0.0},
                     {0.0, -0.1, 0.1});
  wing.held = true;
  wing.in_child.orientation = turn(-0.9, Vector3::UnitZ());
  scene.add_joint(wing);
  scene.add_joint(
      joint("rudder", JointType::revolute, "wing", "tail", Vector3::UnitZ(), {-0.2, 0.0, 0.0}, {0.1, 0.0, 0.0}));
  return scene;
}

State partly_held_state(const Scene& scene) {
  return pack(scene, {},
              {{"hinge", {0.2, 0.5}}, {"sled", {1.0 / 3.0, 0.0}}, {"flap", {-2.0 / 3.0, 0.0}}, {"rudder", {0.1, 2.0}}});
}

TEST(Joint, HeldJointsStayToTheBitWhereTheStatePutThemWhateverTheLoad) {
  const Scene scene = partly_held();
  const State start = partly_held_state(scene);
  const Drive load = steady("wing", {30.0, -20.0, 10.0}, {5.0, 3.0, -7.0}, 120);
  for (const State& state : trajectory(scene, start, 120, {0.0, {load}})) {
    EXPECT_TRUE(same_bits(State(state.segment<4>(2)), State(start.segment<4>(2))));
  }
  EXPECT_GT(std::abs(after(scene, start, 120, {0.0, {load}})[0] - start[0]), 0.1);
}

TEST(Joint, RolloutInTwoHalvesWithHeldJointsIsTheOneInOneGo) {
  const Scene scene = partly_held();
  const State start = partly_held_state(scene);
  for (const int half : {1, 7, 60}) {
    const State two = after(scene, after(scene, start, half), 120 - half);
    EXPECT_TRUE(two.isApprox(after(scene, start, 120), 1e-12)) << half;
    EXPECT_TRUE(same_bits(State(two.segment<4>(2)), State(start.segment<4>(2)))) << half;
  }
}

TEST(Joint, HeldJointIsRigidWhereTheStatePutsIt) {
  // The hinge swings with the period of all that hangs on it, wherever the held joints are.
  for (const double slid : {0.0, 0.2}) {
    Scene scene(downwards, exact());
    scene.add_body(fixed("post", Box{{0.1, 0.1, 0.1}}));
    scene.add_body(body("rod", Box{{0.04, 0.04, 0.5}}, 0.3, Vector3::Zero()));
    scene.add_body(body("bob", Sphere{0.05}, 0.5, Vector3::Zero()));
    scene.add_joint(
        joint("hinge", JointType::revolute, "post", "rod", Vector3::UnitY(), Vector3::Zero(), {0.0, 0.0, 0.25}));
    Joint lift = joint("lift", JointType::prismatic, "rod", "bob", -Vector3::UnitZ(), {0.0, 0.0, -0.1});
    lift.held = true;
    scene.add_joint(lift);
    const State start = pack(scene, {}, {{"hinge", {0.01, 0.0}}, {"lift", {slid, 0.0}}});
    const double bob = 0.35 + slid;
    const double inertia = rod_inertia + 0.5 * (0.4 * 0.05 * 0.05 + bob * bob);
    const double rate = std::sqrt((0.3 * 0.25 + 0.5 * bob) * g / inertia);
    EXPECT_NEAR(after(scene, start, 120)[0], 0.01 * std::cos(rate * 0.5), 0.01 * 0.01) << slid;
  }
}

TEST(Joint, HeldAndFixedJointsCarryTheMomentumOfWhatTheyHold) {
  Scene scene(Vector3::Zero(), exact());
  scene.add_body(body("base", Box{{0.3, 0.2, 0.1}}, 1.2, {0.1, 0.2, 0.3}));
  scene.add_body(body("arm", Box{{0.1, 0.1, 0.4}}, 0.7, Vector3::Zero()));
  Joint lock = joint("lock", JointType::revolute, "base", "arm", Vector3::UnitX(), {0.15, 0.05, 0.0}, {0.0, 0.0, -0.2});
  lock.held = true;
  lock.state.position = 0.8;
  scene.add_joint(lock);
  const State end = after(scene, pack(scene), 48, {0.0, {steady("arm", {0.5, 0.0, 0.2}, {0.0, 0.01, 0.0}, 48)}});
  EXPECT_LT((momentum(scene, end) - 0.2 * Vector3(0.5, 0.0, 0.2)).norm(), 1e-3);
  const BodyState base = body_in(scene, end, "base");
  EXPECT_GT(base.angular_velocity.norm(), 0.1);
  EXPECT_TRUE(body_in(scene, end, "arm").angular_velocity.isApprox(base.angular_velocity, 1e-12));
}

// ---- targets

TEST(Joint, TargetsMoveAJointThatFollowsThem) {
  const Scene scene = rod_on_post(Vector3::UnitZ(), Vector3::Zero(), drive(20.0, 1.5));
  Targets targets{"hinge", Eigen::VectorXd::LinSpaced(480, 0.0, 0.8)};
  targets.positions.tail(240).setConstant(0.4);
  EXPECT_NEAR(after(scene, at(scene, 0.0), 480, {0.0, {}, {targets}})[0], 0.4, 1e-4);
  EXPECT_NEAR(after(scene, at(scene, 0.0), 480)[0], 0.0, 1e-12);
}

TEST(Joint, TargetsOfOneSimulationAreForgottenInTheNext) {
  const Scene scene = rod_on_post(Vector3::UnitZ(), Vector3::Zero(), drive(20.0, 1.5));
  World world(scene);
  const Targets away{"hinge", Eigen::VectorXd::Constant(24, 1.0)};
  const State before = world.simulate(at(scene, 0.1), {}, 24, {24}).front().state;
  world.simulate(at(scene, 0.1), {0.0, {}, {away}}, 24, {24});
  EXPECT_TRUE(same_bits(world.simulate(at(scene, 0.1), {}, 24, {24}).front().state, before));
}

TEST(Joint, TargetsThatNobodyCanFollowAreRejectedByName) {
  const Scene scene = partly_held();
  World world(scene);
  const auto following = [&](const std::string& name, const Eigen::VectorXd& positions) {
    return [&world, &scene, name, positions] {
      world.simulate(pack(scene), {0.0, {}, {Targets{name, positions}}}, 5, {5});
    };
  };
  const Eigen::VectorXd five = Eigen::VectorXd::Zero(5);
  EXPECT_TRUE(rejects(following("knee", five), {"joint", "'knee'", "'hinge', 'sled', 'flap', 'rudder'"}));
  EXPECT_TRUE(rejects(following("sled", five), {"targets['sled']", "position control", "not held"}));
  EXPECT_TRUE(rejects(following("rudder", five), {"targets['rudder']", "position control", "stiffness"}));
  EXPECT_TRUE(rejects(following("hinge", Eigen::VectorXd::Zero(4)), {"targets['hinge']", "4 rows", "5 rows"}));
  EXPECT_TRUE(rejects(following("hinge", five * nan), {"targets['hinge']", "not finite"}));
  EXPECT_NO_THROW(following("hinge", five)());
}

}  // namespace
}  // namespace energymargin
