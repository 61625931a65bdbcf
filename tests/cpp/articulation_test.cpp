// Articulated bodies: laws of motion.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "energymargin/world.hpp"
#include "expect.hpp"
#include "mechanisms.hpp"

namespace energymargin {
namespace {

using namespace scenes;

constexpr double step = 1.0 / 240.0;

// Mean time between passages through 0 in one direction, interpolated.
double period(const Scene& scene, const State& start, const std::string& name, int steps) {
  std::vector<double> passages;
  double last = 0.0;
  const std::vector<State> states = trajectory(scene, start, steps);
  for (std::size_t i = 0; i < states.size(); ++i) {
    const double now = joint_in(scene, states[i], name).position;
    if (last < 0.0 && now >= 0.0) passages.push_back((static_cast<double>(i) - now / (now - last)) * step);
    last = now;
  }
  return (passages.back() - passages.front()) / static_cast<double>(passages.size() - 1);
}

// A rod, or another solid, that hangs down from a hinge about y at the origin.
Scene pendulum(const Shape& shape, double mass, double arm, double duration = step) {
  Stepping stepping = exact();
  stepping.step = duration;
  Scene scene(downwards, stepping);
  scene.add_body(fixed("post", Box{{0.1, 0.1, 0.1}}));
  scene.add_body(body("bob", shape, mass, Vector3::Zero()));
  scene.add_joint(
      joint("hinge", JointType::revolute, "post", "bob", Vector3::UnitY(), Vector3::Zero(), {0.0, 0.0, arm}));
  return scene;
}

Scene double_pendulum(double duration) {
  Scene scene = pendulum(Box{{0.04, 0.04, 0.5}}, 0.3, 0.25, duration);
  scene.add_body(body("second", Box{{0.04, 0.04, 0.4}}, 0.2, Vector3::Zero()));
  scene.add_joint(
      joint("elbow", JointType::revolute, "bob", "second", Vector3::UnitY(), {0.0, 0.0, -0.25}, {0.0, 0.0, 0.2}));
  return scene;
}

TEST(Articulation, NoStepsLeaveJointsAndBaseToTheBit) {
  const Scene scene = two_boxes_on_a_hinge();
  BodyState base = scene.body("base").state;
  base.orientation = turn(1.0 / 3.0, Vector3(1.0, 2.0, 3.0).normalized());
  base.velocity = {0.1, 0.2, 0.3};
  base.angular_velocity = {-0.1, 1.0 / 7.0, 0.7};
  const State start = pack(scene, {{"base", base}}, {{"hinge", {1.0 / 3.0, -2.0 / 3.0}}});
  const State end = World(scene).rollout(start, {Wrench{}}, 0.0).state;
  EXPECT_TRUE(same_bits(State(end.tail<2>()), State(start.tail<2>())));
  EXPECT_TRUE(same_bits(State(end.head<3>()), State(start.head<3>())));
  EXPECT_TRUE(same_bits(State(end.segment<6>(7)), State(start.segment<6>(7))));
  EXPECT_TRUE(end.isApprox(start, 1e-15));
}

TEST(Articulation, SmallSwingsOfAPendulumHaveThePeriodOfItsInertia) {
  const double arm = 0.3;
  for (const Shape& shape : {Shape(Box{{0.05, 0.1, 0.4}}), Shape(Sphere{0.1}),
                             Shape(brick({0.3, 0.1, 0.06}, turn(0.6, Vector3(1.0, 2.0, -1.0).normalized())))}) {
    const Scene scene = pendulum(shape, 0.7, arm);
    const double inertia = inertia_of(scene.body("bob"), Quaternion::Identity())(1, 1) + 0.7 * arm * arm;
    const double expected = 2.0 * pi * std::sqrt(inertia / (0.7 * g * arm));
    const State start = pack(scene, {}, {{"hinge", {0.01, 0.0}}});
    EXPECT_NEAR(period(scene, start, "hinge", 2400) / expected, 1.0, 1e-4) << "shape " << shape.index();
  }
}

TEST(Articulation, ArmatureAddsToTheInertiaAboutTheJointAndToNoWeight) {
  const double arm = 0.3, armature = 0.05;
  const Shape box = Box{{0.05, 0.1, 0.4}};
  Scene scene(downwards, exact());
  scene.add_body(fixed("post", Box{{0.1, 0.1, 0.1}}));
  scene.add_body(body("bob", box, 0.7, Vector3::Zero()));
  Joint hinge = joint("hinge", JointType::revolute, "post", "bob", Vector3::UnitY(), Vector3::Zero(), {0.0, 0.0, arm});
  hinge.armature = armature;
  scene.add_joint(hinge);
  const double inertia = inertia_of(scene.body("bob"), Quaternion::Identity())(1, 1) + 0.7 * arm * arm + armature;
  const double expected = 2.0 * pi * std::sqrt(inertia / (0.7 * g * arm));
  const State start = pack(scene, {}, {{"hinge", {0.01, 0.0}}});
  EXPECT_NEAR(period(scene, start, "hinge", 2400) / expected, 1.0, 1e-4);
}

TEST(Articulation, ArmatureOfAFreeTreeTakesNoPartInItsMomentum) {
  for (const double armature : {0.0, 1.0}) {
    const Scene hinged = two_boxes_on_a_hinge();
    Scene scene(hinged.gravity(), hinged.stepping());
    for (const Body& body : hinged.bodies()) scene.add_body(body);
    Joint hinge = hinged.joints().front();
    hinge.armature = armature;
    scene.add_joint(hinge);
    const State start = pack(scene, {}, {{"hinge", {0.2, 2.0}}});
    const State end = after(scene, start, 240);
    const Vector3 linear = momentum(scene, start), angular = angular_momentum(scene, start);
    EXPECT_LT((momentum(scene, end) - linear).norm(), 1e-9 * linear.norm()) << armature;
    EXPECT_LT((angular_momentum(scene, end) - angular).norm(), 1e-9 * angular.norm()) << armature;
  }
}

// Largest deviation of the energy from that at the start over two seconds, as a share of what the fall brings.
double drift(const Scene& scene, const State& start) {
  const World world(scene);
  const double energy = world.energy(start);
  double most = 0.0;
  for (const State& state : trajectory(scene, start, static_cast<int>(std::lround(2.0 / scene.stepping().step)))) {
    most = std::max(most, std::abs(world.energy(state) - energy));
  }
  return most / (energy - world.energy(pack(scene)));
}

TEST(Articulation, FreeDoublePendulumsEnergyDriftIsSmallAndFallsWithTheStep) {
  const auto swing = [](double angle, double divided) {
    const Scene scene = double_pendulum(step / divided);
    return drift(scene, pack(scene, {}, {{"hinge", {angle, 0.0}}, {"elbow", {angle / 3.0, 0.0}}}));
  };
  EXPECT_LT(swing(0.5, 1.0), 0.05);
  EXPECT_LT(swing(1.5, 1.0), 0.12);  // with 24 rad/s at the elbow
  EXPECT_LT(swing(0.5, 4.0), 0.3 * swing(0.5, 1.0));
  EXPECT_LT(swing(1.5, 4.0), 0.3 * swing(1.5, 1.0));
}

TEST(Articulation, FreeBaseKeepsMomentumAndAngularMomentumToAPercentOverTwoSeconds) {
  const Scene scene = two_boxes_on_a_hinge();
  BodyState base = scene.body("base").state;
  base.velocity = {0.3, -0.2, 0.1};
  base.angular_velocity = {0.5, -1.0, 0.8};
  const State start = pack(scene, {{"base", base}}, {{"hinge", {0.2, 2.0}}});
  const Vector3 linear = momentum(scene, start);
  const Vector3 angular = angular_momentum(scene, start);
  for (const State& state : trajectory(scene, start, 480)) {
    EXPECT_LT((momentum(scene, state) - linear).norm(), 0.003 * linear.norm());
    EXPECT_LT((angular_momentum(scene, state) - angular).norm(), 0.01 * angular.norm());
  }
}

// ---- frames that are not the centres of mass

TEST(Articulation, PendulumSwingsWithThePeriodOfItsGivenInertia) {
  Scene scene(downwards, exact());
  scene.add_body(fixed("post", Box{{0.1, 0.1, 0.1}}));
  Body bob = body("bob", Sphere{0.05}, 0.7, Vector3::Zero());
  Eigen::Matrix3d inertia;
  inertia << 0.004, 0.001, 0.0005, 0.001, 0.006, -0.0007, 0.0005, -0.0007, 0.005;
  bob.inertial = Inertial::from_tensor({0.0, 0.0, -0.25}, inertia);  // the frame is at the hinge
  scene.add_body(bob);
  scene.add_joint(joint("hinge", JointType::revolute, "post", "bob", Vector3::UnitY()));
  const State start = pack(scene, {}, {{"hinge", {0.01, 0.0}}});
  const double expected = 2.0 * pi * std::sqrt((0.006 + 0.7 * 0.25 * 0.25) / (0.7 * g * 0.25));
  EXPECT_NEAR(period(scene, start, "hinge", 2400) / expected, 1.0, 1e-4);
}

// Frames of the bodies of `two_boxes_on_a_hinge` and of a cart that rides on its arm, wherever they please.
const std::map<std::string, Pose> elsewhere{
    {"base", {{0.2, -0.1, 0.3}, turn(0.9, Vector3(1.0, 1.0, 0.5).normalized())}},
    {"arm", {{-0.1, 0.2, 0.15}, turn(-1.7, Vector3(0.3, 1.0, -0.5).normalized())}},
    {"cart", {{0.3, 0.1, -0.2}, turn(2.1, Vector3(1.0, -1.0, 1.0).normalized())}}};

Scene boxes_and_cart(const Vector3& gravity) {
  Scene scene = two_boxes_on_a_hinge(gravity);
  scene.add_body(
      body("cart", brick({0.1, 0.06, 0.04}, turn(0.4, Vector3::UnitZ()), {0.02, 0.0, 0.0}), 0.4, Vector3::Zero()));
  scene.add_joint(joint("rail", JointType::prismatic, "arm", "cart", Vector3(2.0, -1.0, 2.0) / 3.0, {0.0, 0.0, 0.25},
                        {-0.03, 0.0, -0.02}));
  return scene;
}

// The same scene in other words.
Scene described_elsewhere(const Scene& scene) {
  Scene same(scene.gravity(), scene.stepping());
  const auto frame = [](const std::string& name) { return elsewhere.count(name) > 0 ? elsewhere.at(name) : Pose{}; };
  for (const Body& made : scene.bodies()) same.add_body(described_from(frame(made.name), made));
  for (Joint made : scene.joints()) {
    made.in_parent = seen_from(frame(made.parent), made.in_parent);
    made.in_child = seen_from(frame(made.child), made.in_child);
    same.add_joint(made);
  }
  return same;
}

TEST(Articulation, SameMechanismInOtherFramesMovesTheSame) {
  const Scene one = boxes_and_cart(downwards);
  const Scene other = described_elsewhere(one);
  BodyState base = one.body("base").state;
  base.velocity = {0.3, -0.2, 0.1};
  base.angular_velocity = {0.5, -1.0, 0.8};
  BodyState same_base = state_at_point(elsewhere.at("base").position, base);
  same_base.orientation = base.orientation * elsewhere.at("base").orientation;
  const std::map<std::string, JointState> joints{{"hinge", {0.2, 2.0}}, {"rail", {0.1, -0.5}}};
  const Drive push = steady("cart", {0.3, 0.2, -0.1}, {0.01, 0.0, 0.02}, 240);
  const State end = after(one, pack(one, {{"base", base}}, joints), 240, {0.0, {push}});
  const State found = after(other, pack(other, {{"base", same_base}}, joints), 240, {0.0, {push}});
  EXPECT_LT((found.tail<4>() - end.tail<4>()).cwiseAbs().maxCoeff(), 1e-7);
  for (const auto& [name, frame] : elsewhere) {
    const BodyState expected = state_at_point(frame.position, body_in(one, end, name));
    const BodyState at = body_in(other, found, name);
    EXPECT_LT((at.position - expected.position).norm(), 1e-7) << name;
    EXPECT_LT((at.velocity - expected.velocity).norm(), 1e-7) << name;
    EXPECT_LT(at.orientation.angularDistance(expected.orientation * frame.orientation), 1e-6) << name;
  }
  EXPECT_NEAR(World(other).energy(found), World(one).energy(end), 1e-7);
}

TEST(Articulation, SameMechanismInOtherFramesIsHeldAndCollidesTheSame) {
  Scene plain = boxes_and_cart(downwards);
  Scene held(downwards, exact());
  for (const Body& made : plain.bodies()) held.add_body(made);
  for (Joint made : plain.joints()) {
    made.held = made.name == "hinge";
    made.state.position = made.name == "hinge" ? 0.6 : 0.05;
    held.add_joint(made);
  }
  const Scene other = described_elsewhere(held);
  World one(held);
  World two(other);
  for (const char* name : {"base", "arm", "cart"}) {
    const double expected = one.distance(pack(held), name, "object");
    EXPECT_NEAR(two.distance(pack(other), name, "object"), expected, 1e-4) << name;  // Bullet rounds hulls to 1e-4
  }
  const State end = after(held, pack(held), 120);
  const State found = after(other, pack(other), 120);
  EXPECT_NEAR(found.tail<2>()[0], end.tail<2>()[0], 1e-7);
  EXPECT_EQ(found.tail<4>()[0], 0.6);
}

TEST(Articulation, FreeBaseWithItsCentreElsewhereKeepsMomentumAndAngularMomentum) {
  const Scene scene = described_elsewhere(two_boxes_on_a_hinge());
  BodyState base = scene.body("base").state;
  base.velocity = {0.3, -0.2, 0.1};
  base.angular_velocity = {0.5, -1.0, 0.8};
  const State start = pack(scene, {{"base", base}}, {{"hinge", {0.2, 2.0}}});
  const Vector3 linear = momentum(scene, start);
  const Vector3 angular = angular_momentum(scene, start);
  for (const State& state : trajectory(scene, start, 480)) {
    EXPECT_LT((momentum(scene, state) - linear).norm(), 0.005 * linear.norm());
    EXPECT_LT((angular_momentum(scene, state) - angular).norm(), 0.01 * angular.norm());
  }
}

TEST(Articulation, NoStepsLeaveABaseWithItsCentreElsewhereAgainAndAgain) {
  const Scene scene = described_elsewhere(boxes_and_cart(downwards));
  World world(scene);
  BodyState base = scene.body("base").state;
  base.angular_velocity = {0.5, -1.0, 0.8};
  const State start = pack(scene, {{"base", base}}, {{"hinge", {1.0 / 3.0, -2.0 / 3.0}}});
  State state = start;
  for (int i = 0; i < 200; ++i) state = world.rollout(state, {Wrench{}}, 0.0).state;
  EXPECT_LT((state - start).cwiseAbs().maxCoeff(), 1e-13);
  EXPECT_TRUE(same_bits(State(state.tail<4>()), State(start.tail<4>())));
}

TEST(Articulation, RailCarriesACartOfWhichTheCentreIsElsewhere) {
  Scene scene(downwards, exact());
  scene.add_body(fixed("post", Box{}));
  Body cart = body("cart", Box{{0.2, 0.1, 0.1}}, 0.4, Vector3::Zero());
  cart.inertial = Inertial{{0.3, 0.2, -0.5}, {0.01, 0.02, 0.025}, turn(0.5, Vector3::UnitX())};
  scene.add_body(cart);
  scene.add_joint(joint("rail", JointType::prismatic, "post", "cart", {0.6, 0.0, -0.8}, {0.1, 0.0, 0.0}));
  const JointState end = joint_in(scene, after(scene, pack(scene), 240), "rail");
  EXPECT_NEAR(end.velocity, 0.8 * g, 1e-9);
  EXPECT_NEAR(end.position, 0.5 * 0.8 * g, 1e-9);
}

TEST(Articulation, FreeBaseFallsWithGravityAndTurnsNot) {
  const Scene scene = two_boxes_on_a_hinge(downwards);
  const State end = after(scene, pack(scene), 240);
  const Unpacked at = unpack(scene, end);
  EXPECT_NEAR(at.bodies.at("base").velocity.z(), -g, 1e-9);
  EXPECT_NEAR(at.bodies.at("arm").velocity.z(), -g, 1e-9);
  EXPECT_NEAR(at.bodies.at("base").position.z(), 0.3 - 0.5 * g, 1e-9);
  EXPECT_NEAR(at.joints.at("hinge").velocity, 0.0, 1e-9);
}

TEST(Articulation, RailFallsWithGravityAlongItsAxis) {
  for (const Vector3& axis :
       {Vector3(0.0, 0.0, -1.0), Vector3(0.6, 0.0, -0.8), Vector3(2.0 / 3.0, 2.0 / 3.0, -1.0 / 3.0)}) {
    Scene scene(downwards, exact());
    scene.add_body(fixed("post", Box{}));
    scene.add_body(body("cart", Box{{0.2, 0.1, 0.1}}, 0.4, Vector3::Zero()));
    scene.add_joint(joint("rail", JointType::prismatic, "post", "cart", axis));
    const JointState end = joint_in(scene, after(scene, pack(scene), 240), "rail");
    EXPECT_NEAR(end.velocity, g * -axis.z(), 1e-9);
    EXPECT_NEAR(end.position, 0.5 * g * -axis.z(), 1e-9);
  }
}

TEST(Articulation, ForceOnALinkBringsItsMomentumToTheWholeTree) {
  const Scene scene = two_boxes_on_a_hinge();
  const Vector3 force(0.3, -0.2, 0.5);
  const State start = pack(scene);
  for (const char* pushed : {"base", "arm"}) {
    const State end = after(scene, start, 24, {0.0, {steady(pushed, force, Vector3::Zero(), 24)}});
    EXPECT_LT((momentum(scene, end) - 0.1 * force).norm(), 0.002 * 0.1 * force.norm()) << pushed;
    EXPECT_GT(std::abs(joint_in(scene, end, "hinge").velocity), 0.01) << pushed;
  }
}

TEST(Articulation, TorqueOnALinkBringsItsAngularMomentumToTheWholeTree) {
  const Scene scene = two_boxes_on_a_hinge();
  const Vector3 torque(0.02, -0.03, 0.01);
  const State start = pack(scene);
  for (const char* turned : {"base", "arm"}) {
    const State end = after(scene, start, 24, {0.0, {steady(turned, Vector3::Zero(), torque, 24)}});
    EXPECT_LT((angular_momentum(scene, end) - 0.1 * torque).norm(), 0.02 * 0.1 * torque.norm()) << turned;
    EXPECT_LT(momentum(scene, end).norm(), 1e-3 * 0.1 * torque.norm() / 0.1) << turned;
  }
}

TEST(Articulation, TorqueAndForceOnAHingedLinkTurnItByItsInertia) {
  const Scene scene = rod_on_post(Vector3::UnitZ());
  const State pushed = after(scene, pack(scene), 1, {0.0, {steady("rod", {0.0, 2.0, 0.0}, Vector3::Zero(), 1)}});
  EXPECT_NEAR(joint_in(scene, pushed, "hinge").velocity, 2.0 * 0.25 * step / rod_inertia, 1e-12);
  const State turned = after(scene, pack(scene), 120, {0.0, {steady("rod", Vector3::Zero(), {5.0, 3.0, 0.2}, 120)}});
  EXPECT_NEAR(joint_in(scene, turned, "hinge").velocity, 0.2 * 0.5 / rod_inertia, 1e-9);
}

// ---- contact

// What two boxes that a fixed joint makes one body do on a slope that falls towards `azimuth`: how far it slides down,
// and how far across, in one second.
Vector2 slid(double angle, double friction, double azimuth) {
  Scene scene(downwards, exact());
  const Quaternion tilt = turn(angle, turn(azimuth, Vector3::UnitZ()) * Vector3::UnitY());
  scene.add_body(fixed("slope", Plane{tilt * Vector3::UnitZ(), 0.0}, Vector3::Zero(), 1.0));
  Body base = body("base", Box{{0.4, 0.3, 0.1}}, 1.0, tilt * Vector3(0.0, 0.0, 0.05), Role::none, friction);
  base.state.orientation = tilt;
  scene.add_body(base);
  scene.add_body(body("side", Box{{0.2, 0.3, 0.1}}, 0.5, Vector3::Zero(), Role::none, friction));
  scene.add_joint(joint("weld", JointType::fixed, "base", "side", Vector3::UnitZ(), {0.2, 0.0, 0.0}, {-0.1, 0.0, 0.0}));
  const Vector3 moved = body_in(scene, after(scene, pack(scene), 240), "base").position - base.state.position;
  const Vector3 falling = tilt * (turn(azimuth, Vector3::UnitZ()) * Vector3::UnitX());
  return {moved.dot(falling), moved.dot((tilt * Vector3::UnitZ()).cross(falling))};
}

constexpr double slope = 20.0 * pi / 180.0;

TEST(Articulation, LinksStayOnASlopeBelowTheFrictionAngleInEveryDirection) {
  for (const double azimuth : {0.0, 0.5, 0.25 * pi, 1.2, 0.5 * pi, 2.5}) {
    EXPECT_LT(slid(slope, 0.5, azimuth).norm(), 1e-5) << azimuth;
  }
}

TEST(Articulation, LinksSlideDownASlopeAboveTheFrictionAngleWithWhatFrictionLeaves) {
  const double way = 0.5 * g * (std::sin(slope) - 0.2 * std::cos(slope)) * (1.0 + step);
  for (const double azimuth : {0.0, 0.5 * pi}) EXPECT_LT((slid(slope, 0.2, azimuth) - Vector2(way, 0.0)).norm(), 1e-4);
  // Between the axes Bullet aims the friction of articulated bodies up to five degrees off.
  for (const double azimuth : {0.5, 0.25 * pi, 1.2, 2.5}) {
    EXPECT_LT((slid(slope, 0.2, azimuth) - Vector2(way, 0.0)).norm(), 0.1 * way) << azimuth;
  }
}

// A block on two rails, free in height, on a table that gravity leans on from the side.
double gantry_slid(double friction, bool along_y) {
  const Vector3 pull = along_y ? Vector3(0.0, g * std::sin(slope), -g * std::cos(slope))
                               : Vector3(g * std::sin(slope), 0.0, -g * std::cos(slope));
  Scene scene(pull, exact());
  scene.add_body(fixed("table", Plane{}, Vector3::Zero(), 1.0));
  scene.add_body(fixed("post", Box{{0.1, 0.1, 0.1}}, {0.0, 0.0, 1.0}));
  scene.add_body(body("bridge", Box{{0.1, 0.1, 0.1}}, 0.3, Vector3::Zero()));
  scene.add_body(body("cart", Box{{0.1, 0.1, 0.1}}, 0.2, Vector3::Zero()));
  scene.add_body(body("block", Box{{0.2, 0.2, 0.1}}, 1.0, Vector3::Zero(), Role::none, friction));
  scene.add_joint(joint("x", JointType::prismatic, "post", "bridge", Vector3::UnitX(), {0.0, 0.0, 0.3}));
  scene.add_joint(joint("y", JointType::prismatic, "bridge", "cart", Vector3::UnitY(), {0.0, 0.0, 0.3}));
  scene.add_joint(joint("z", JointType::prismatic, "cart", "block", Vector3::UnitZ(), {0.0, 0.0, -1.55}));
  return joint_in(scene, after(scene, pack(scene), 240), along_y ? "y" : "x").position;
}

TEST(Articulation, BlockOnRailsIsHeldBackByTheFrictionOfItsOwnWeight) {
  for (const bool along_y : {false, true}) {
    const double moving = along_y ? 1.2 : 1.5;
    const double acceleration = g * (std::sin(slope) - 0.2 * std::cos(slope) / moving);
    EXPECT_NEAR(gantry_slid(0.2, along_y), 0.5 * acceleration * (1.0 + step), 1e-3) << along_y;
    EXPECT_LT(std::abs(gantry_slid(0.6, along_y)), 1e-5) << along_y;
  }
}

TEST(Articulation, LinkThatIsSetDownBearsItsWeightOnTheTable) {
  Scene scene(downwards, exact());
  scene.add_body(fixed("table", Plane{}));
  scene.add_body(fixed("post", Box{{0.1, 0.1, 0.1}}, {0.0, 0.0, 1.0}));
  scene.add_body(body("block", Box{{0.2, 0.2, 0.1}}, 1.5, Vector3::Zero()));
  scene.add_joint(joint("z", JointType::prismatic, "post", "block", Vector3::UnitZ(), {0.0, 0.0, -0.95}));
  double normal = 0.0;
  for (const Contact& contact : World(scene).contacts(pack(scene))) normal += contact.normal_force;
  EXPECT_NEAR(normal, 1.5 * g / (1.0 + 0.25 * giving), 1e-9);  // on four corners, in the first step
}

// Two carts of 1 kg and 3 kg on rails along x, the light one under way to the heavy one.
Scene two_carts(bool on_a_free_base) {
  Scene scene(Vector3::Zero(), exact());
  const Vector3 above(0.0, 0.0, 0.5);
  scene.add_body(on_a_free_base ? body("base", Box{{0.1, 0.1, 0.1}}, 2.0, above)
                                : fixed("base", Box{{0.1, 0.1, 0.1}}, above));
  scene.add_body(body("light", Sphere{0.1}, 1.0, Vector3::Zero()));
  scene.add_body(body("heavy", Sphere{0.1}, 3.0, Vector3::Zero()));
  Joint light = joint("light", JointType::prismatic, "base", "light", Vector3::UnitX(), -above);
  light.state = {-0.5, 1.0};
  scene.add_joint(light);
  scene.add_joint(joint("heavy", JointType::prismatic, "base", "heavy", Vector3::UnitX(), -above));
  return scene;
}

TEST(Articulation, LinksOfOneFixedBaseCollideAndShareTheirMomentum) {
  const Scene scene = two_carts(false);
  const Unpacked at = unpack(scene, after(scene, pack(scene), 240));
  const double light = at.joints.at("light").velocity;
  const double heavy = at.joints.at("heavy").velocity;
  EXPECT_NEAR(light + 3.0 * heavy, 1.0, 1e-9);
  EXPECT_GE(heavy - light, -1e-9);
  EXPECT_LE(heavy - light, 0.25);  // Bullet pushes links out of each other: a fifth of the depth in a step
}

TEST(Articulation, LinksOfOneFreeTreeCollideAndKeepItsMomentum) {
  const Scene scene = two_carts(true);
  const State end = after(scene, pack(scene), 240);
  const Unpacked at = unpack(scene, end);
  EXPECT_GE(at.bodies.at("heavy").position.x() - at.bodies.at("light").position.x(), 0.2 - 1e-3);
  EXPECT_GT(at.joints.at("heavy").velocity, 0.1);
  EXPECT_LT((momentum(scene, end) - momentum(scene, pack(scene))).norm(), 0.01);
}

TEST(Articulation, JointedBodiesDoNotCollideAndOthersDo) {
  Scene scene = two_boxes_on_a_hinge();
  EXPECT_LT(World(scene).distance(pack(scene), "base", "arm"), 0.0);
  EXPECT_EQ(deepest_contact(scene, pack(scene)).distance, 0.0);
  EXPECT_TRUE(World(scene).contacts(pack(scene)).empty());
  scene.add_body(body("loose", Box{{0.3, 0.2, 0.1}}, 1.0, {0.1, 0.2, 0.39}));
  EXPECT_LT(deepest_contact(scene, pack(scene)).distance, 0.0);
  EXPECT_FALSE(World(scene).contacts(pack(scene)).empty());
}

// ---- a hand

struct Rest {
  double gained = 0.0;  // most energy above that at the start [J]
  double moved = 0.0;   // farthest that the object was from its start [m]
};

// Two seconds without a drive, from a state in which the hand has had a second to settle.
Rest rest(const Scene& scene) {
  const State start = after(scene, pack(scene), 240);
  const World world(scene);
  const Vector3 from = body_in(scene, start, "object").position;
  Rest measured;
  for (const State& state : trajectory(scene, start, 480)) {
    measured.gained = std::max(measured.gained, world.energy(state) - world.energy(start));
    measured.moved = std::max(measured.moved, (body_in(scene, state, "object").position - from).norm());
  }
  return measured;
}

TEST(Articulation, BoxBetweenFingersStaysAtRestAndGainsNoEnergyOnATableAndLifted) {
  Stepping thorough = exact();
  thorough.iterations = 200;
  for (const bool lifted : {false, true}) {
    const Rest usual = rest(hand(1.0, lifted));
    EXPECT_LT(usual.gained, 1e-5) << lifted;
    EXPECT_LT(usual.moved, 1e-4) << lifted;
    const Rest converged = rest(hand(1.0, lifted, thorough));
    EXPECT_LT(converged.gained, 1e-7) << lifted;  // as if it rose by 0.1 um
    EXPECT_LT(converged.moved, 6e-5) << lifted;   // by creeping
  }
}

TEST(Articulation, LiftedBoxSagsLittleInFingersWithEnoughFrictionAndFallsOutOfOthers) {
  // The fingers press with 2 N from each side; the box weighs 0.981 N.
  const auto height = [](double friction) {
    const Scene scene = hand(friction, true);
    return body_in(scene, after(scene, pack(scene), 240), "object").position.z();
  };
  EXPECT_NEAR(height(1.0), 0.03, 0.003);
  EXPECT_NEAR(height(0.4), 0.03, 0.006);
  EXPECT_LT(height(0.1), -0.5);
}

TEST(Articulation, WeightOfALiftedBoxIsWhatTheFingersHoldByFriction) {
  const Scene scene = hand(1.0, true);
  World world(scene);
  const State start = after(scene, pack(scene), 240);
  Vector3 held = Vector3::Zero();
  for (const Contact& contact : world.contacts(start)) {
    const double side = contact.body_a == "object" ? 1.0 : -1.0;
    EXPECT_LE(contact.tangential_force.norm(), 1.001 * contact.friction * contact.normal_force);
    held += side * (contact.normal_force * contact.normal + contact.tangential_force);
  }
  EXPECT_LT((held - Vector3(0.0, 0.0, 0.1 * g)).norm(), 1e-3 * 0.1 * g) << held.transpose();
}

}  // namespace
}  // namespace energymargin
