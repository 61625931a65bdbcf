// Bodies whose frame is not at their centre of mass, or not along their principal axes: laws of free motion.

#include <gtest/gtest.h>

#include <cmath>

#include "expect.hpp"
#include "mechanisms.hpp"

namespace energymargin {
namespace {

using namespace scenes;

constexpr double step = 1.0 / 240.0;
const Quaternion oblique = turn(0.8, Vector3(1.0, 2.0, -0.5).normalized());

// A box of 2 kg that is described from a frame outside of it.
Body lopsided(const BodyState& at = {}) {
  Body block = described_from({{0.3, -0.2, 0.15}, oblique}, body("object", Box{{0.5, 0.3, 0.1}}, 2.0, Vector3::Zero()));
  block.role = Role::object;
  block.state = at;
  return block;
}

Scene alone(const Body& block, const Vector3& gravity = Vector3::Zero(), double duration = step) {
  Stepping stepping = exact();
  stepping.step = duration;
  Scene scene(gravity, stepping);
  scene.add_body(block);
  return scene;
}

BodyState thrown() {
  return {{0.1, 0.2, 0.3}, turn(1.1, Vector3(2.0, -1.0, 1.0).normalized()), {0.5, -0.4, 3.0}, {1.0, 2.0, -1.5}};
}

TEST(Inertial, CentreOfMassFliesAlongItsParabolaHoweverTheBodyTumbles) {
  const Body block = lopsided(thrown());
  const Scene scene = alone(block, downwards);
  const BodyState start = center_of(block, block.state);
  const std::vector<State> flight = trajectory(scene, pack(scene), 240);
  for (std::size_t i = 0; i < flight.size(); ++i) {
    const double time = static_cast<double>(i) * step;
    const BodyState now = center_of(block, body_in(scene, flight[i], "object"));
    EXPECT_LT((now.position - start.position - time * start.velocity - 0.5 * time * (time + step) * downwards).norm(),
              1e-12);
    EXPECT_LT((now.velocity - start.velocity - time * downwards).norm(), 1e-12);
  }
  const Vector3 frame = body_in(scene, flight.back(), "object").position - block.state.position;
  EXPECT_GT((frame - block.state.velocity - 0.5 * (1.0 + step) * downwards).norm(), 0.1) << "the frame does not";
}

TEST(Inertial, VelocityIsThatOfTheFramesOrigin) {
  const double moment = 1e-5;
  const Body block = lopsided(thrown());
  const Scene scene = alone(block, Vector3::Zero(), moment);
  const State later = after(scene, pack(scene), 1);
  const Vector3 moved = body_in(scene, later, "object").position - block.state.position;
  EXPECT_LT((moved / moment - block.state.velocity).norm(), 1e-4);
}

TEST(Inertial, TumblingKeepsAngularMomentumToRoundingAndEnergyToTheSquareOfTheStep) {
  const auto lost = [](double duration) {
    const Scene scene = alone(lopsided(thrown()), Vector3::Zero(), duration);
    const World world(scene);
    const State start = pack(scene);
    const State end = after(scene, start, static_cast<int>(std::lround(2.0 / duration)));
    const Vector3 turned = angular_momentum(scene, end) - angular_momentum(scene, start);
    EXPECT_LT((momentum(scene, end) - momentum(scene, start)).norm(), 1e-12);
    EXPECT_LT(turned.norm(), 1e-11 * angular_momentum(scene, start).norm()) << duration;
    return std::abs(world.energy(end) / world.energy(start) - 1.0);
  };
  const double usual = lost(step);
  EXPECT_LT(usual, 1e-7);
  EXPECT_LT(lost(step / 4.0), 0.1 * usual);
}

// Euler's equations for a body without load, by small steps of Runge and Kutta: the turn after `time`.
Quaternion tumbled(const Body& block, double time) {
  const Inertial inertial = block.principal_inertial();
  const Vector3& moments = inertial.moments;
  const auto rate = [&](const Vector3& spin) -> Vector3 {
    return moments.cwiseInverse().cwiseProduct(-spin.cross(moments.cwiseProduct(spin)));
  };
  const int steps = 20000;
  const double h = time / steps;
  Quaternion at = block.state.orientation * inertial.axes;
  Vector3 spin = at.conjugate() * block.state.angular_velocity;
  for (int i = 0; i < steps; ++i) {
    const Vector3 a = rate(spin);
    const Vector3 b = rate(spin + 0.5 * h * a);
    const Vector3 c = rate(spin + 0.5 * h * b);
    const Vector3 middle = spin + 0.5 * h * b;
    spin += h / 6.0 * (a + 2.0 * b + 2.0 * c + rate(spin + h * c));
    at = (at * turn(h * middle.norm(), middle.normalized())).normalized();
  }
  return at * inertial.axes.conjugate();
}

TEST(Inertial, BodyTumblesAsEulersEquationsSay) {
  const Body block = lopsided(thrown());
  const auto away = [&](double duration) {
    const Scene scene = alone(block, Vector3::Zero(), duration);
    const State end = after(scene, pack(scene), static_cast<int>(std::lround(1.0 / duration)));
    return body_in(scene, end, "object").orientation.angularDistance(tumbled(block, 1.0));
  };
  EXPECT_LT(away(step), 0.02);
  EXPECT_LT(away(step / 8.0), 0.2 * away(step));
  EXPECT_GT(block.state.orientation.angularDistance(tumbled(block, 1.0)), 1.0);
}

TEST(Inertial, SameBodyInAnotherFrameMovesTheSame) {
  Body block = body("object", Box{{0.5, 0.3, 0.1}}, 2.0, Vector3::Zero(), Role::object);
  block.state = thrown();
  const Pose frame{{0.3, -0.2, 0.15}, oblique};
  const Scene one = alone(block, downwards);
  const Scene other = alone(described_from(frame, block), downwards);
  Wrench wrench;
  wrench.force = {1.0, -2.0, 0.5};
  wrench.torque = {0.05, 0.02, -0.03};
  const Rollout expected = World(one).rollout(pack(one), {wrench}, 1.0);
  const Rollout rollout = World(other).rollout(pack(other), {wrench}, 1.0);
  const BodyState end = body_in(one, expected.state, "object");
  const BodyState found = body_in(other, rollout.state, "object");
  EXPECT_LT((found.position - state_at_point(frame.position, end).position).norm(), 1e-10);
  EXPECT_LT((found.velocity - state_at_point(frame.position, end).velocity).norm(), 1e-10);
  EXPECT_LT(found.orientation.angularDistance(end.orientation * frame.orientation), 1e-7);
  EXPECT_LT((found.angular_velocity - end.angular_velocity).norm(), 1e-10);
  EXPECT_NEAR(rollout.effort, expected.effort, 1e-10);
  EXPECT_NEAR(rollout.energy, expected.energy, 1e-9);
}

TEST(Inertial, HullInAnyFrameIsTheBoxThatItDescribes) {
  Body box = body("object", Box{{0.5, 0.3, 0.1}}, 2.0, Vector3::Zero(), Role::object);
  box.state = thrown();
  Body hull = box;
  const Vector3 away(0.3, -0.2, 0.15);
  hull.shape = brick({0.5, 0.3, 0.1}, oblique, away);
  hull.state.orientation = box.state.orientation * oblique.conjugate();
  hull.state = state_at_point(oblique.conjugate() * -away, {box.state.position, hull.state.orientation,
                                                            box.state.velocity, box.state.angular_velocity});
  hull.state.position = box.state.position - hull.state.orientation * away;
  hull.state.velocity = box.state.velocity - box.state.angular_velocity.cross(hull.state.orientation * away);
  const Scene one = alone(box, downwards);
  const Scene other = alone(hull, downwards);
  const BodyState end = body_in(one, after(one, pack(one), 240), "object");
  const BodyState found = body_in(other, after(other, pack(other), 240), "object");
  EXPECT_LT((state_at_point(away, found).position - end.position).norm(), 1e-10);
  EXPECT_LT((state_at_point(away, found).velocity - end.velocity).norm(), 1e-10);
  EXPECT_LT(found.orientation.angularDistance(end.orientation * oblique.conjugate()), 1e-6);
}

TEST(Inertial, WorkOnAFreeBodyIsItsGainOfEnergyWhereverItsFrameIs) {
  const Scene scene = alone(lopsided());
  World world(scene);
  Wrench wrench;
  wrench.force = {0.3, -0.2, 0.5};
  const Rollout rollout = world.rollout(pack(scene), {wrench}, 1.5);
  EXPECT_NEAR(rollout.work, 0.5 * wrench.force.squaredNorm() / 2.0 * 1.5 * 1.5, 1e-12);
  EXPECT_NEAR(rollout.energy, rollout.work, 1e-12);
  EXPECT_LT(body_in(scene, rollout.state, "object").angular_velocity.norm(), 1e-12) << "the force is at the centre";
}

TEST(Inertial, TorqueTurnsABodyByItsGivenInertiaWithProducts) {
  Eigen::Matrix3d inertia;
  inertia << 0.03, 0.004, -0.002, 0.004, 0.05, 0.003, -0.002, 0.003, 0.06;
  Body block = body("object", Sphere{0.1}, 2.0, Vector3::Zero(), Role::object);
  block.inertial = Inertial::from_tensor({0.02, 0.03, -0.01}, inertia);
  block.state.orientation = oblique;
  const Scene scene = alone(block);
  Wrench wrench;
  wrench.torque = {1e-4, -2e-4, 3e-4};
  const BodyState end = body_in(scene, World(scene).rollout(pack(scene), {wrench}, step).state, "object");
  const Eigen::Matrix3d turned = oblique.toRotationMatrix() * inertia * oblique.toRotationMatrix().transpose();
  EXPECT_TRUE(end.angular_velocity.isApprox(step * turned.inverse() * wrench.torque, 1e-6));
  EXPECT_LT(center_of(block, end).velocity.norm(), 1e-15) << "the centre stays, the frame moves";
  EXPECT_GT(end.velocity.norm(), 1e-7);
}

TEST(Inertial, InertiaMatrixComesBackFromItsMomentsAndAxes) {
  Eigen::Matrix3d inertia;
  inertia << 0.03, 0.004, -0.002, 0.004, 0.05, 0.003, -0.002, 0.003, 0.06;
  const Inertial result = Inertial::from_tensor({0.1, 0.2, 0.3}, inertia);
  const Eigen::Matrix3d axes = result.axes.toRotationMatrix();
  EXPECT_EQ(result.center, Vector3(0.1, 0.2, 0.3));
  EXPECT_TRUE((axes * result.moments.asDiagonal() * axes.transpose()).isApprox(inertia, 1e-12));
  const Inertial plain = Inertial::from_tensor(Vector3::Zero(), Vector3(3.0, 1.0, 2.5).asDiagonal().toDenseMatrix());
  EXPECT_EQ(plain.moments, Vector3(3.0, 1.0, 2.5));
  EXPECT_EQ(plain.axes.coeffs(), Quaternion::Identity().coeffs());
}

TEST(Inertial, InertiaThatNoRigidBodyCanHaveIsRejectedByNameAndValue) {
  const auto with = [](const Eigen::Matrix3d& inertia) {
    return [inertia] { Inertial::from_tensor(Vector3::Zero(), inertia); };
  };
  Eigen::Matrix3d skew = Eigen::Matrix3d::Identity();
  skew(0, 1) = 0.1;
  EXPECT_TRUE(rejects(with(skew), {"inertia", "not symmetric"}));
  EXPECT_TRUE(rejects(with(nan * Eigen::Matrix3d::Identity()), {"inertia", "not finite"}));
  EXPECT_TRUE(rejects(with(Vector3(1.0, 1.0, 2.1).asDiagonal().toDenseMatrix()), {"inertia", "(1, 1, 2.1)", "sum"}));
  EXPECT_TRUE(rejects(with(Vector3(1.0, -1.0, 1.0).asDiagonal().toDenseMatrix()), {"inertia", "-1", "above 0"}));
  EXPECT_TRUE(rejects([] { Inertial::from_tensor({0.0, nan, 0.0}, Eigen::Matrix3d::Identity()); },
                      {"center", "nan", "finite"}));
}

TEST(Inertial, BodyWithAMassAndWithoutAVolumeNeedsOne) {
  Body ghost = body("ghost", Compound{}, 1.0, Vector3::Zero());
  EXPECT_TRUE(rejects([&] { Scene().add_body(ghost); }, {"'ghost'", "inertial", "not given", "without a volume"}));
  ghost.inertial = Inertial{{0.0, 0.0, 0.1}, {0.1, 0.1, 0.1}};
  EXPECT_NO_THROW(Scene().add_body(ghost));
  ghost.inertial->moments.z() = 0.3;
  EXPECT_TRUE(rejects([&] { Scene().add_body(ghost); }, {"'ghost'", "inertial: moments", "(0.1, 0.1, 0.3)"}));
  ghost.inertial = Inertial{{0.0, 0.0, nan}};
  EXPECT_TRUE(rejects([&] { Scene().add_body(ghost); }, {"'ghost'", "inertial: center", "nan"}));
  ghost.inertial = Inertial{Vector3::Zero(), Vector3::Ones(), Quaternion(2.0, 0.0, 0.0, 0.0)};
  EXPECT_TRUE(rejects([&] { Scene().add_body(ghost); }, {"'ghost'", "inertial: axes", "unit quaternion"}));
}

TEST(Inertial, BodyWithoutPartsFallsThroughEverything) {
  Scene scene(downwards, exact());
  scene.add_body(fixed("table", Plane{}));
  Body ghost = body("object", Compound{}, 1.0, {0.0, 0.0, 0.1}, Role::object);
  ghost.inertial = Inertial{{0.02, 0.0, 0.0}, {0.1, 0.1, 0.1}};
  scene.add_body(ghost);
  World world(scene);
  EXPECT_NEAR(body_in(scene, world.rollout(pack(scene), {Wrench{}}, 1.0).state, "object").position.z(),
              0.1 - 0.5 * g * (1.0 + step), 1e-12);
  EXPECT_EQ(world.distance(pack(scene), "object", "table"), infinity);
  EXPECT_EQ(deepest_contact(world.scene(), pack(scene)).distance, 0.0);
}

TEST(Inertial, NoStepsLeaveTheStateAgainAndAgain) {
  const Scene scene = alone(lopsided(thrown()), downwards);
  World world(scene);
  State state = pack(scene);
  for (int i = 0; i < 200; ++i) state = world.rollout(state, {Wrench{}}, 0.0).state;
  EXPECT_LT((state - pack(scene)).cwiseAbs().maxCoeff(), 1e-13);
}

TEST(Inertial, EnergyIsThatOfTheCentreOfMass) {
  Body block = body("object", Sphere{0.1}, 2.0, {0.0, 0.0, 1.0}, Role::object);
  block.inertial = Inertial{{0.0, 0.3, 0.5}, {0.1, 0.2, 0.25}};
  block.state.orientation = turn(0.5 * pi, Vector3::UnitX());  // its z axis is the world's -y axis, its y axis z
  block.state.angular_velocity = {3.0, 0.0, 0.0};
  const Scene scene = alone(block, downwards);
  const double speed = 3.0 * std::hypot(0.3, 0.5);
  EXPECT_NEAR(World(scene).energy(pack(scene)), speed * speed + 0.5 * 0.1 * 9.0 + 2.0 * g * 1.3, 1e-12);
}

// ---- locked axes

// Planar, with its centre off its frame, and an axis of turning that is none of its principal ones.
Body planar(const BodyState& at = {}) {
  Body block = lopsided(at);
  block.linear_factor = {1.0, 1.0, 0.0};
  block.angular_factor = Vector3::UnitZ();
  return block;
}

double planar_moment(const Body& block) { return inertia_of(block, block.state.orientation)(2, 2); }

TEST(Inertial, PlanarBodyTurnsByItsMomentAboutItsFreeAxisAboutItsCentreOfMass) {
  for (const Quaternion& orientation : {Quaternion::Identity(), turn(0.7, Vector3::UnitX()), oblique.conjugate()}) {
    Body block = planar();
    block.state.orientation = orientation;
    const Scene scene = alone(block, downwards);
    World world(scene);
    Wrench wrench;
    wrench.torque.z() = 0.02;
    const Rollout rollout = world.rollout(pack(scene), {wrench}, 1.0);
    const BodyState end = body_in(scene, rollout.state, "object");
    const BodyState from = center_of(block, block.state);
    const BodyState to = center_of(block, end);
    EXPECT_NEAR(end.angular_velocity.z(), 0.02 / planar_moment(block), 1e-9);
    EXPECT_LT((to.position - from.position).norm(), 1e-12);
    EXPECT_NEAR(rollout.work, 0.5 * 0.02 * 0.02 / planar_moment(block), 1e-9);
    EXPECT_NEAR(rollout.energy - world.energy(pack(scene)), rollout.work, 1e-12);
    EXPECT_GT((end.position - block.state.position).norm(), 0.01) << "the frame goes round the centre";
  }
}

TEST(Inertial, PlanarBodyIsTurnedByNothingButTorqueAboutItsFreeAxis) {
  const Scene scene = alone(planar(), downwards);
  Wrench wrench;
  wrench.torque = {0.5, -0.3, 0.0};
  wrench.force = {0.4, 0.1, 3.0};
  const BodyState end = body_in(scene, World(scene).rollout(pack(scene), {wrench}, 0.5).state, "object");
  EXPECT_LT(end.angular_velocity.norm(), 1e-15);
  EXPECT_TRUE(end.velocity.isApprox(0.5 * Vector3(0.2, 0.05, 0.0), 1e-12));
}

TEST(Inertial, PlanarBodyThatSpinsKeepsItsSpinItsPlaneAndItsState) {
  BodyState spinning;
  spinning.orientation = oblique.conjugate();
  spinning.angular_velocity.z() = 5.0;
  Body block = planar(spinning);
  const Vector3 arm = spinning.orientation * block.principal_inertial().center;
  block.state.velocity = -spinning.angular_velocity.cross(arm);  // the centre is at rest
  const Scene scene = alone(block);
  World world(scene);
  State state = pack(scene);
  for (int i = 0; i < 10; ++i) {
    state = world.rollout(state, {Wrench{}}, 0.1).state;  // each is a valid start of the next
    const BodyState now = body_in(scene, state, "object");
    EXPECT_NEAR(now.angular_velocity.z(), 5.0, 1e-12);
    EXPECT_NEAR(now.position.z(), 0.0, 1e-12);
    EXPECT_LT((center_of(block, now).position - arm).norm(), 1e-9);
  }
}

TEST(Inertial, LockedAxesAreThoseOfTheCentreOfMass) {
  Body block = planar();
  block.state.angular_velocity.z() = 2.0;
  block.state.velocity.z() = 0.1;
  EXPECT_TRUE(rejects([&] { Scene().add_body(block); }, {"'object'", "velocity", "0.1", "locked"}));
  Body pinned = lopsided();
  pinned.linear_factor.setZero();
  pinned.state.angular_velocity = {0.0, 0.0, 2.0};
  EXPECT_TRUE(rejects([&] { Scene().add_body(pinned); }, {"'object'", "velocity", "(0, 0, 0)", "locked"}));
  pinned.state.velocity = -pinned.state.angular_velocity.cross(pinned.principal_inertial().center);
  EXPECT_NO_THROW(Scene().add_body(pinned));
}

// ---- fixed bodies

// Distances from a fixed body to small spheres around it.
std::vector<double> around(const Body& still) {
  std::vector<double> distances;
  for (const Vector3& at : {Vector3(2.0, 0.3, 0.1), Vector3(-2.0, 1.0, 0.5), Vector3(0.2, 2.0, -0.5),
                            Vector3(0.1, -2.0, 0.3), Vector3(0.4, 0.3, 2.0), Vector3(-0.5, 0.2, -2.0)}) {
    Scene scene;
    scene.add_body(still);
    scene.add_body(body("probe", Sphere{0.05}, 1.0, at));
    distances.push_back(World(scene).distance(pack(scene), still.name, "probe"));
  }
  return distances;
}

TEST(Inertial, FixedHullStandsAsItIsGiven) {
  const Vector3 size(1.2, 0.5, 0.3);
  const Vector3 away(0.2, -0.1, 0.3);
  Body hull = fixed("still", brick(size, oblique, away), {0.1, 0.2, 0.0});
  hull.state.orientation = turn(0.5, Vector3::UnitY());
  Body box = fixed("still", Box{size}, hull.state.position + hull.state.orientation * away);
  box.state.orientation = hull.state.orientation * oblique;
  Body compound = fixed("still", Compound{{{Box{size}, {away, oblique}}}}, hull.state.position);
  compound.state.orientation = hull.state.orientation;
  Body moving = hull;
  moving.mass = 1.0;
  const std::vector<double> expected = around(box);
  for (const Body& still : {hull, compound, moving}) {
    const std::vector<double> found = around(still);
    // Bullet rounds the corners of a hull to a ten-thousandth of its size.
    for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(found[i], expected[i], 1e-4) << i;
  }
}

TEST(Inertial, FixedBodysInertialIsOfNoConsequence) {
  Body still = fixed("still", Box{{1.2, 0.5, 0.3}}, {0.1, 0.2, 0.0});
  const std::vector<double> expected = around(still);
  still.inertial = Inertial{{0.3, 0.2, 0.1}, {0.1, 0.1, 0.1}, oblique};
  EXPECT_EQ(around(still), expected);
}

}  // namespace
}  // namespace energymargin
