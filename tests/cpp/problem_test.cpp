// Problems: what is a question that can be asked.

#include "energymargin/problem.hpp"

#include <gtest/gtest.h>

#include "expect.hpp"
#include "scenes.hpp"

namespace energymargin {
namespace {

using namespace scenes;

// Validating the push, changed by `change`.
template <typename Change>
auto validating(const Change& change) {
  return [change] {
    Problem problem = push();
    change(problem);
    validate(problem);
  };
}

TEST(Problem, SharedProblemsAreValid) {
  for (const Problem& problem : {push(), push(Effector::coast), closed_cage(), lift(0.1), drift()}) {
    EXPECT_NO_THROW(validate(problem));
  }
}

TEST(Problem, BadStateIsRejectedByBodyQuantityAndValue) {
  EXPECT_TRUE(rejects(validating([](Problem& p) { p.state[0] = nan; }), {"state", "'object'", "position", "nan"}));
  EXPECT_TRUE(rejects(validating([](Problem& p) { p.state = State::Zero(4); }), {"state", "4", "26"}));
}

TEST(Problem, BoundsDurationAndRateThatCannotBeAreRejected) {
  EXPECT_TRUE(rejects(validating([](Problem& p) { p.force.x() = -1.0; }), {"force", "-1", "at least 0"}));
  EXPECT_TRUE(rejects(validating([](Problem& p) { p.torque.z() = infinity; }), {"torque", "inf", "finite"}));
  EXPECT_TRUE(rejects(validating([](Problem& p) { p.force = p.torque = Vector3::Zero(); }), {"force and torque", "0"}));
  EXPECT_TRUE(rejects(validating([](Problem& p) { p.duration = 0.001; }), {"duration", "0.001", "one step"}));
  EXPECT_TRUE(rejects(validating([](Problem& p) { p.duration = nan; }), {"duration", "nan"}));
  EXPECT_TRUE(rejects(validating([](Problem& p) { p.rate = -5.0; }), {"rate", "-5", "at least 0"}));
}

TEST(Problem, RegionOnAnUnknownBodyIsRejectedByTheRegionsRole) {
  const Region cup = regions::Disc{"cup"};
  EXPECT_TRUE(rejects(validating([&](Problem& p) { p.captured = cup; }), {"captured", "'cup'", "'object'"}));
  EXPECT_TRUE(rejects(validating([&](Problem& p) { p.succeeded = cup; }), {"succeeded", "'cup'"}));
  EXPECT_TRUE(rejects(validating([&](Problem& p) { p.within = cup; }), {"within", "'cup'"}));
}

TEST(Problem, ThereIsExactlyOneObjectAndAtMostOneEffector) {
  const auto with_scene = [](const Scene& scene) {
    return [scene] { validate({scene, pack(scene), {1.0, 0.0, 0.0}, Vector3::Zero(), 0.5, regions::Disc{"one"}}); };
  };
  Scene none;
  none.add_body(body("one", Box{}, 1.0, Vector3::Zero()));
  EXPECT_TRUE(rejects(with_scene(none), {"0", "\"object\"", "exactly one"}));
  Scene two;
  two.add_body(body("one", Box{}, 1.0, Vector3::Zero(), Role::object));
  two.add_body(body("two", Box{}, 1.0, {5.0, 0.0, 0.0}, Role::object));
  EXPECT_TRUE(rejects(with_scene(two), {"2", "\"object\"", "exactly one"}));
}

TEST(Problem, DriveNeedsAnEffectorThatCanMove) {
  Problem problem = drift();
  problem.effector = Effector::drive;
  EXPECT_TRUE(rejects([&] { validate(problem); }, {"effector", "\"drive\"", "role \"effector\""}));
}

TEST(Problem, UnderDriveAnEdgeStartsWithTheEffectorsVelocityAtTheStartAndUnderCoastWithItsOwn) {
  const Problem problem = push(Effector::drive);
  std::map<std::string, BodyState> bodies = unpack(problem.scene, problem.state);
  bodies["effector"].position = {1.1, 0.15, 0.05};
  bodies["effector"].velocity = {0.3, 0.1, 0.0};
  bodies["effector"].angular_velocity = {0.0, 0.0, 2.0};
  bodies["object"].velocity = {0.2, 0.0, 0.0};
  const State node = pack(problem.scene, bodies);
  EXPECT_TRUE(same_bits(edge_start(push(Effector::coast), node), node));
  bodies["effector"].velocity = {0.0, 0.4, 0.0};
  bodies["effector"].angular_velocity.setZero();
  EXPECT_TRUE(same_bits(edge_start(problem, node), pack(problem.scene, bodies)));
}

TEST(Problem, StartInDeepPenetrationIsRejectedWithTheBodiesAndTheDepthAndAGrazeIsNot) {
  const auto sunk = [](double depth) { return validating([depth](Problem& p) { p.state[2] = 0.05 - depth; }); };
  EXPECT_TRUE(rejects(sunk(0.03), {"state", "'object'", "'table'", "0.03 m", "at most 0.0125 m"}));
  EXPECT_NO_THROW(sunk(0.012)());
}

TEST(Problem, MeasuredContactsAreChecked) {
  const auto with = [](const Contact& contact) {
    return validating([contact](Problem& p) { p.contacts = {contact}; });
  };
  Contact contact;
  contact.body_a = "object";
  contact.body_b = "effector";
  EXPECT_NO_THROW(with(contact)());
  Contact unknown = contact;
  unknown.body_b = "cup";
  EXPECT_TRUE(rejects(with(unknown), {"'cup'"}));
  Contact forceless = contact;
  forceless.normal_force = nan;
  EXPECT_TRUE(rejects(with(forceless), {"normal_force", "nan"}));
  Contact nowhere = contact;
  nowhere.position.x() = nan;
  EXPECT_TRUE(rejects(with(nowhere), {"position", "nan"}));
}

TEST(Problem, DisturbanceAlongALockedAxisIsRejected) {
  Body planar = body("planar", Box{}, 1.0, {9.0, 0.0, 0.0});
  Scene locked(Vector3::Zero());
  planar.role = Role::object;
  planar.linear_factor = {1.0, 1.0, 0.0};
  planar.angular_factor = {0.0, 0.0, 1.0};
  locked.add_body(planar);
  Problem flat{locked, pack(locked), {1.0, 1.0, 0.0}, {0.0, 0.0, 1.0}, 0.5, regions::Ball{"planar", {9.0, 0.0, 0.0}}};
  EXPECT_NO_THROW(validate(flat));
  flat.force.z() = 1.0;
  EXPECT_TRUE(rejects([&] { validate(flat); }, {"force", "locked"}));
  flat.force.z() = 0.0;
  flat.torque.x() = 1.0;
  EXPECT_TRUE(rejects([&] { validate(flat); }, {"torque", "locked"}));
}

}  // namespace
}  // namespace energymargin
