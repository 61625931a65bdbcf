// Scenes: what may be added, and how bodies are found again.

#include "energymargin/scene.hpp"

#include <gtest/gtest.h>

#include "expect.hpp"
#include "mechanisms.hpp"

namespace energymargin {
namespace {

using namespace scenes;

// What adding a default block, changed by `change`, to an empty scene leads to.
template <typename Change>
auto adding(const Change& change) {
  return [change] {
    Body block = body("block", Box{}, 1.0, Vector3::Zero(), Role::object);
    change(block);
    Scene().add_body(block);
  };
}

TEST(Scene, BodiesAreFoundByNameAndByRole) {
  const Scene scene = push_scene();
  EXPECT_EQ(scene.index("effector"), 2u);
  EXPECT_EQ(scene.body("object").mass, 1.0);
  EXPECT_EQ(scene.with_role(Role::object), std::vector<std::size_t>{1});
  EXPECT_TRUE(Scene().with_role(Role::effector).empty());
}

TEST(Scene, CopiesShareWhatFollowsFromABodyAloneUntilItChanges) {
  const Scene scene = push_scene();
  const Scene copy = scene;
  EXPECT_EQ(&copy.inertial(1), &scene.inertial(1));
  EXPECT_EQ(&copy.collision_shape(1), &scene.collision_shape(1));
  EXPECT_EQ(&scene.with_body("object", {0.3, std::nullopt}).collision_shape(1), &scene.collision_shape(1));
  Stepping stepping = scene.stepping();
  stepping.step *= 0.25;
  EXPECT_EQ(&scene.with_stepping(stepping).collision_shape(1), &scene.collision_shape(1));
  stepping.margin = 1e-3;
  EXPECT_NE(&scene.with_stepping(stepping).collision_shape(1), &scene.collision_shape(1));
  const Scene heavier = scene.with_body("object", {std::nullopt, 2.0});
  EXPECT_EQ(heavier.inertial(1).moments, heavier.body("object").principal_inertial().moments);
  EXPECT_NE(heavier.inertial(1).moments, scene.inertial(1).moments);
}

TEST(Scene, UnknownBodyIsAnErrorThatListsTheNames) {
  EXPECT_TRUE(rejects([] { push_scene().index("cup"); }, {"'cup'", "'table', 'object', 'effector'"}));
  EXPECT_TRUE(rejects([] { Scene().index("cup"); }, {"'cup'", "none"}));
}

TEST(Scene, BodyThatCannotBeIsRejectedByNameArgumentAndValue) {
  EXPECT_TRUE(rejects(adding([](Body& b) { b.mass = -1.0; }), {"'block'", "mass is -1", "at least 0"}));
  EXPECT_TRUE(rejects(adding([](Body& b) { b.mass = nan; }), {"'block'", "mass is nan", "finite"}));
  EXPECT_TRUE(rejects(adding([](Body& b) { b.friction = -0.1; }), {"'block'", "friction is -0.1"}));
  EXPECT_TRUE(rejects(adding([](Body& b) { b.shape = Sphere{0.0}; }), {"'block'", "radius is 0"}));
  EXPECT_TRUE(rejects(adding([](Body& b) { b.state.position.y() = infinity; }), {"'block'", "position", "inf"}));
  EXPECT_TRUE(rejects(adding([](Body& b) { b.state.orientation.w() = 1.1; }), {"'block'", "orientation", "unit"}));
  EXPECT_TRUE(rejects(adding([](Body& b) { b.linear_factor.z() = 0.5; }), {"'block'", "linear_factor", "0.5"}));
  EXPECT_TRUE(rejects(adding([](Body& b) { b.angular_factor.x() = -1.0; }), {"'block'", "angular_factor", "-1"}));
  EXPECT_TRUE(rejects(adding([](Body& b) { b.shape = Plane{}; }), {"'block'", "mass is 1", "plane is fixed"}));
  EXPECT_TRUE(rejects(adding([](Body& b) { b.mass = 0.0; }), {"'block'", "mass is 0", "object must be able to move"}));
  EXPECT_TRUE(rejects(adding([](Body& b) { b.name = ""; }), {"name", "empty"}));
}

TEST(Scene, BodyWithAnotherFrictionAndMassIsInACopy) {
  const Scene scene = push_scene();
  const Scene other = scene.with_body("object", {0.7, 3.0});
  EXPECT_EQ(other.body("object").friction, 0.7);
  EXPECT_EQ(other.body("object").mass, 3.0);
  EXPECT_EQ(other.body("effector").mass, scene.body("effector").mass);
  EXPECT_EQ(scene.body("object").mass, 1.0);
  const double ratio =
      other.body("object").principal_inertial().moments.x() / scene.body("object").principal_inertial().moments.x();
  EXPECT_NEAR(ratio, 3.0, 1e-12);
}

TEST(Scene, InertiaThatWasGivenGrowsWithTheMass) {
  Body block = body("block", Box{}, 2.0, Vector3::Zero(), Role::object);
  block.inertial = Inertial{Vector3(0.0, 0.0, 0.1), Vector3(1.0, 2.0, 2.5)};
  Scene scene;
  scene.add_body(block);
  const Body heavier = scene.with_body("block", {std::nullopt, 3.0}).body("block");
  EXPECT_TRUE(heavier.inertial->moments.isApprox(Vector3(1.5, 3.0, 3.75)));
  EXPECT_EQ(heavier.inertial->center, Vector3(0.0, 0.0, 0.1));
}

TEST(Scene, BodyThatCannotBeChangedSoIsRejected) {
  const Scene scene = push_scene();
  EXPECT_TRUE(rejects([&] { scene.with_body("object", {{}, {}, -1.0}); }, {"'object'", "torsional_friction is -1"}));
  EXPECT_EQ(scene.with_body("object", {{}, {}, 0.1, 0.2}).body("object").surface->rolling_friction, 0.2);
  EXPECT_TRUE(rejects([&] { scene.with_body("cup", {0.1, std::nullopt}); }, {"'cup'"}));
  EXPECT_TRUE(rejects([&] { scene.with_body("object", {-0.1, std::nullopt}); }, {"'object'", "friction is -0.1"}));
  EXPECT_TRUE(rejects([&] { scene.with_body("object", {std::nullopt, 0.0}); }, {"mass is 0"}));
  EXPECT_TRUE(rejects([&] { scene.with_body("table", {std::nullopt, 1.0}); }, {"mass of 'table' is 1", "fixed"}));
}

TEST(Scene, NameIsTakenOnlyOnce) {
  Scene scene = push_scene();
  EXPECT_TRUE(rejects([&] { scene.add_body(fixed("table", Plane{})); }, {"name", "'table'", "no other body"}));
}

TEST(Scene, HullNeedNotBeAboutItsCentreOfMass) {
  const Vector3 away(0.0, 0.0, 0.1);
  const Body cup = body("cup", brick({0.2, 0.2, 0.2}, Quaternion::Identity(), away), 1.0, Vector3::Zero());
  EXPECT_NO_THROW(Scene().add_body(cup));
  EXPECT_TRUE(cup.principal_inertial().center.isApprox(away, 1e-12));
}

TEST(Scene, SteppingThatCannotBeIsRejected) {
  const auto stepping = [](double step, int iterations, double tolerance, double margin) {
    return [=] { Scene(Vector3::Zero(), Stepping{step, iterations, tolerance, margin}); };
  };
  EXPECT_TRUE(rejects(stepping(0.0, 50, 1e-6, 0.001), {"step is 0", "above 0"}));
  EXPECT_TRUE(rejects(stepping(0.01, 0, 1e-6, 0.001), {"solver_iterations is 0", "from 1 to 10000"}));
  EXPECT_TRUE(rejects(stepping(0.01, 1'000'000'000, 1e-6, 0.001), {"solver_iterations is 1000000000", "to 10000"}));
  EXPECT_NO_THROW(stepping(0.01, most_solver_iterations, most_solver_tolerance, 0.001)());
  for (const double tolerance : {-1.0, 0.0, 0.011, nan}) {
    EXPECT_TRUE(rejects(stepping(0.01, 50, tolerance, 0.001), {"solver_tolerance is", "above 0, at most 0.01"}));
  }
  EXPECT_TRUE(rejects(stepping(0.01, 50, 1e-6, -0.001), {"margin is -0.001", "above 0"}));
  EXPECT_TRUE(rejects([] { Scene(Vector3(0.0, nan, 0.0)); }, {"gravity", "nan"}));
}

// ---- joints

// What adding a default hinge, changed by `change`, between the bodies of a scene leads to.
template <typename Change>
auto hanging(const Change& change) {
  return [change] {
    Scene scene = two_boxes_on_a_hinge();
    scene.add_body(body("tool", Box{{0.1, 0.1, 0.1}}, 0.5, Vector3::Zero()));
    scene.add_body(fixed("wall", Box{}, {0.0, 5.0, 0.0}));
    Body planar = body("planar", Box{}, 1.0, {0.0, -5.0, 0.0});
    planar.angular_factor = Vector3::UnitZ();
    scene.add_body(planar);
    Joint made = joint("wrist", JointType::revolute, "arm", "tool", Vector3::UnitZ());
    change(made);
    scene.add_joint(made);
  };
}

TEST(Scene, JointsAreFoundByNameAndByTheBodyTheyCarry) {
  const Scene scene = two_boxes_on_a_hinge();
  EXPECT_EQ(scene.joint_index("hinge"), 0u);
  EXPECT_EQ(scene.joint_to(scene.index("arm")), 0u);
  EXPECT_EQ(scene.joint_to(scene.index("base")), std::nullopt);
  EXPECT_TRUE(scene.jointed(scene.index("base")));
  EXPECT_FALSE(scene.jointed(scene.index("object")));
  EXPECT_TRUE(rejects([&] { scene.joint_index("knee"); }, {"joint", "'knee'", "'hinge'"}));
  EXPECT_TRUE(rejects([] { Scene().joint_index("knee"); }, {"'knee'", "none"}));
}

TEST(Scene, SeveralBodiesMayHaveARole) {
  Scene scene = push_scene();
  scene.add_body(body("second", Sphere{0.1}, 1.0, {5.0, 0.0, 1.0}, Role::effector));
  EXPECT_EQ(scene.with_role(Role::effector), (std::vector<std::size_t>{2, 3}));
}

TEST(Scene, JointsMakeTreesAndNothingElse) {
  EXPECT_NO_THROW(hanging([](Joint&) {})());
  EXPECT_TRUE(
      rejects(hanging([](Joint& j) { j.child = "arm"; }), {"joint 'wrist'", "child is 'arm'", "no other joint"}));
  EXPECT_TRUE(rejects(hanging([](Joint& j) { j.child = "base"; }),
                      {"joint 'wrist'", "parent is 'arm'", "a body that the child does not carry"}));
  EXPECT_TRUE(rejects(hanging([](Joint& j) { j.parent = "tool"; }), {"joint 'wrist'", "parent is 'tool'"}));
  EXPECT_TRUE(
      rejects(hanging([](Joint& j) { j.child = "wall"; }), {"joint 'wrist'", "child is 'wall'", "mass above 0"}));
  EXPECT_TRUE(rejects(hanging([](Joint& j) { j.child = "cup"; }), {"joint 'wrist'", "'cup'", "'tool'"}));
  EXPECT_TRUE(rejects(hanging([](Joint& j) { j.parent = "cup"; }), {"joint 'wrist'", "'cup'", "'tool'"}));
  EXPECT_TRUE(rejects(hanging([](Joint& j) { j.child = "planar"; }), {"child is 'planar'", "without locked axes"}));
  EXPECT_TRUE(rejects(hanging([](Joint& j) { j.parent = "planar"; }), {"parent is 'planar'", "without locked axes"}));
  EXPECT_TRUE(rejects(hanging([](Joint& j) { j.name = "hinge"; }), {"name is 'hinge'", "no other joint"}));
  EXPECT_TRUE(rejects(hanging([](Joint& j) { j.name = ""; }), {"name is empty"}));
}

TEST(Scene, JointThatCannotBeIsRejectedByNameArgumentAndValue) {
  EXPECT_TRUE(
      rejects(hanging([](Joint& j) { j.axis = {0.0, 0.0, 2.0}; }), {"'wrist'", "axis is (0, 0, 2)", "length 1"}));
  EXPECT_TRUE(rejects(hanging([](Joint& j) { j.axis.x() = nan; }), {"'wrist'", "axis", "nan", "length 1"}));
  EXPECT_TRUE(rejects(hanging([](Joint& j) { j.in_parent.position.z() = nan; }), {"in_parent: position", "nan"}));
  EXPECT_TRUE(rejects(hanging([](Joint& j) { j.in_child.orientation.w() = 1.1; }), {"in_child: orientation", "1.1"}));
  EXPECT_TRUE(rejects(hanging([](Joint& j) { j.lower = j.upper = 0.5; }), {"lower limit is 0.5", "below", "0.5"}));
  EXPECT_TRUE(rejects(hanging([](Joint& j) { j.lower = nan; }), {"lower limit is nan"}));
  EXPECT_TRUE(rejects(hanging([](Joint& j) { j.upper = nan; }), {"limit", "nan"}));
  EXPECT_TRUE(rejects(hanging([](Joint& j) { j.upper = -0.2; }), {"position is 0", "from -inf to -0.2"}));
  EXPECT_TRUE(rejects(hanging([](Joint& j) { j.state.position = nan; }), {"position is nan", "finite"}));
  EXPECT_TRUE(rejects(hanging([](Joint& j) { j.state.velocity = nan; }), {"velocity is nan", "finite"}));
  EXPECT_TRUE(rejects(hanging([](Joint& j) {
                        j.held = true;
                        j.state.velocity = 0.5;
                      }),
                      {"velocity is 0.5", "held"}));
  EXPECT_TRUE(rejects(hanging([](Joint& j) {
                        j.type = JointType::fixed;
                        j.state.position = 0.5;
                      }),
                      {"position", "0", "fixed"}));
  EXPECT_TRUE(rejects(hanging([](Joint& j) { j.target = infinity; }), {"target is inf", "finite"}));
  EXPECT_TRUE(rejects(hanging([](Joint& j) { j.target_velocity = nan; }), {"target_velocity is nan", "finite"}));
  EXPECT_TRUE(rejects(hanging([](Joint& j) { j.stiffness = -1.0; }), {"stiffness is -1", "at least 0"}));
  EXPECT_TRUE(rejects(hanging([](Joint& j) { j.damping = infinity; }), {"damping is inf", "finite"}));
  EXPECT_TRUE(rejects(hanging([](Joint& j) { j.torque_limit = -2.0; }), {"torque_limit is -2", "at least 0"}));
  EXPECT_TRUE(rejects(hanging([](Joint& j) { j.torque_limit = nan; }), {"torque_limit is nan", "at least 0"}));
}

TEST(Scene, RejectedJointLeavesTheSceneAsItWas) {
  Scene scene = two_boxes_on_a_hinge();
  EXPECT_TRUE(rejects([&] { scene.add_joint(joint("back", JointType::revolute, "arm", "base", Vector3::UnitZ())); },
                      {"'back'"}));
  EXPECT_EQ(scene.joints().size(), 1u);
}

TEST(Scene, ConstantForceThatIsNoneIsRejected) {
  EXPECT_TRUE(rejects(adding([](Body& b) { b.force.y() = nan; }), {"'block'", "force", "nan", "finite"}));
}

TEST(Scene, BodyThatIsCalledJointsIsRejectedWithTheReason) {
  EXPECT_TRUE(rejects(adding([](Body& b) { b.name = "joints"; }), {"name is 'joints'", "another name"}));
}

// ---- pairs that never collide

// A ball that falls on a box on a table.
Scene falling() {
  Scene scene;
  scene.add_body(fixed("table", Plane{}));
  scene.add_body(body("box", Box{{0.2, 0.2, 0.2}}, 1.0, {0.0, 0.0, 0.1}));
  scene.add_body(body("object", Sphere{0.05}, 0.5, {0.0, 0.0, 0.35}, Role::object));
  return scene;
}

double height_after_a_second(const Scene& scene, const std::string& name) {
  return unpack(scene, World(scene).rollout(pack(scene), {Wrench{}}, 1.0).state).bodies.at(name).position.z();
}

TEST(Scene, PairThatNeverCollidesPassesThroughEachOtherAndNothingElse) {
  Scene scene = falling();
  EXPECT_NEAR(height_after_a_second(scene, "object"), 0.25, 1e-3);
  scene.disable_collisions("object", "box");
  EXPECT_NEAR(height_after_a_second(scene, "object"), 0.05, 1e-3);
  EXPECT_NEAR(height_after_a_second(scene, "box"), 0.1, 1e-6);
}

TEST(Scene, PairThatNeverCollidesHasNoContactsNoDepthAndStillADistance) {
  Scene scene = falling();
  BodyState inside;
  inside.position = {0.0, 0.0, 0.2};
  const State start = pack(scene, {{"object", inside}});
  EXPECT_EQ(deepest_contact(scene, start).body_b, "object");
  scene.disable_collisions("box", "object");
  World world(scene);
  EXPECT_EQ(deepest_contact(world.scene(), start).distance, 0.0);
  for (const Contact& contact : world.contacts(start)) EXPECT_NE(contact.body_a + contact.body_b, "boxobject");
  EXPECT_NEAR(world.distance(start, "object", "box"), -0.05, 1e-5);
}

TEST(Scene, LinksOfOneTreeCanBeKeptFromColliding) {
  const auto closed = [](bool apart) {
    Scene scene(Vector3::Zero(), exact());
    scene.add_body(fixed("post", Box{{0.1, 0.1, 0.1}}, {0.0, 0.0, 1.0}));
    for (const char* name : {"left", "right"}) {
      const double side = name[0] == 'l' ? -1.0 : 1.0;
      scene.add_body(body(name, Sphere{0.05}, 0.2, Vector3::Zero()));
      Joint slide = joint(name, JointType::prismatic, "post", name, {-side, 0.0, 0.0}, {0.1 * side, 0.0, -1.0});
      slide.stiffness = 100.0;
      slide.damping = 10.0;
      slide.target = 0.1;
      scene.add_joint(slide);
    }
    if (apart) scene.disable_collisions("left", "right");
    return after(scene, pack(scene), 480)[0];
  };
  EXPECT_NEAR(closed(false), 0.05, 1e-3);
  EXPECT_NEAR(closed(true), 0.1, 1e-6);
}

TEST(Scene, PairsThatNeverCollideAreKeptOnceByName) {
  Scene scene = falling();
  EXPECT_TRUE(scene.disabled_collisions().empty());
  scene.disable_collisions("object", "box");
  scene.disable_collisions("box", "object");
  ASSERT_EQ(scene.disabled_collisions().size(), 1u);
  EXPECT_EQ(scene.disabled_collisions().begin()->first, "box");
  EXPECT_EQ(scene.disabled_collisions().begin()->second, "object");
  EXPECT_TRUE(rejects([&] { scene.disable_collisions("box", "box"); }, {"body_b", "'box'", "another body"}));
  EXPECT_TRUE(rejects([&] { scene.disable_collisions("box", "cup"); }, {"'cup'", "'table', 'box', 'object'"}));
  EXPECT_TRUE(rejects([&] { scene.disable_collisions("cup", "box"); }, {"'cup'"}));
}

// ---- friction of two bodies

enum class Slider { free, beside_a_joint, link };

constexpr double of_table = 0.8, of_block = 0.25;

// A block of 1 kg that slides on a table at 1 m/s; as a link it hangs on rails of no other mass to speak of.
Scene sliding(Slider slider, FrictionRule rule) {
  Scene scene(Vector3(0.0, 0.0, -g), exact(), rule);
  scene.add_body(fixed("table", Plane{}, Vector3::Zero(), of_table));
  Body block = body("block", Box{{0.4, 0.4, 0.1}}, 1.0, {0.0, 0.0, 0.05}, Role::none, of_block);
  if (slider != Slider::link) block.state.velocity.x() = 1.0;
  scene.add_body(block);
  if (slider == Slider::free) return scene;
  scene.add_body(fixed("post", Sphere{0.01}, {0.0, 5.0, 1.0}));
  scene.add_body(body("cart", Sphere{0.01}, 1e-6, Vector3::Zero()));
  Joint rail = joint("rail", JointType::prismatic, "post", "cart", Vector3::UnitX());
  if (slider == Slider::link) rail.state.velocity = 1.0;
  scene.add_joint(rail);
  if (slider == Slider::link) {
    scene.add_joint(joint("lift", JointType::prismatic, "cart", "block", Vector3::UnitZ(), {0.0, -5.0, -0.95}));
  }
  return scene;
}

// By how much the block loses speed, over g.
double deceleration(const Scene& scene) {
  constexpr int steps = 24;
  const double speed = body_in(scene, after(scene, pack(scene), steps), "block").velocity.x();
  return (1.0 - speed) / (steps * scene.stepping().step * g);
}

TEST(Scene, FrictionOfAContactIsTheProductOrTheLargerOfTwoOrThatOfThePair) {
  for (const Slider slider : {Slider::free, Slider::beside_a_joint, Slider::link}) {
    Scene product = sliding(slider, FrictionRule::product);
    Scene larger = sliding(slider, FrictionRule::max);
    EXPECT_NEAR(deceleration(product), of_table * of_block, 1e-4) << int(slider);
    EXPECT_NEAR(deceleration(larger), of_table, 1e-4) << int(slider);
    for (Scene* scene : {&product, &larger}) {
      scene->set_friction({"block", "table", 0.1});
      EXPECT_NEAR(deceleration(*scene), 0.1, 1e-4) << int(slider);
    }
  }
}

TEST(Scene, ContactsTellTheFrictionThatTheyHave) {
  for (const auto& [rule, expected] : {std::pair{FrictionRule::product, 0.2}, {FrictionRule::max, 0.8}}) {
    Scene scene = sliding(Slider::free, rule);
    EXPECT_EQ(World(scene).contacts(pack(scene)).front().friction, expected);
    scene.set_friction({"table", "block", 0.3});
    const std::vector<Contact> contacts = World(scene).contacts(pack(scene));
    EXPECT_EQ(contacts.size(), 4u);
    for (const Contact& contact : contacts) EXPECT_EQ(contact.friction, 0.3);
    BodyState sunk;
    sunk.position.z() = 0.04;
    EXPECT_EQ(deepest_contact(scene, pack(scene, {{"block", sunk}})).friction, 0.3);
  }
}

TEST(Scene, FrictionOfAPairIsKeptOnceInAnyOrderAndInCopies) {
  Scene scene = falling();
  EXPECT_TRUE(scene.pair_frictions().empty());
  EXPECT_EQ(scene.contact_friction(1, 2), 0.25);
  scene.set_friction({"object", "box", 0.7});
  scene.set_friction({"box", "object", 0.0});
  scene.set_friction({"object", "table", 2.0});
  for (const Scene& copy : {scene, scene.with_body("box", {0.9, 2.0}), scene.with_stepping(exact())}) {
    ASSERT_EQ(copy.pair_frictions().size(), 2u);
    EXPECT_EQ(copy.pair_frictions()[0].body_a + copy.pair_frictions()[0].body_b, "tableobject");
    EXPECT_EQ(copy.pair_frictions()[1].body_a + copy.pair_frictions()[1].body_b, "boxobject");
    EXPECT_EQ(copy.contact_friction(2, 1), 0.0);
    EXPECT_EQ(copy.contact_friction(0, 2), 2.0);
    EXPECT_EQ(copy.contact_friction(0, 1), 0.5 * copy.body("box").friction);
  }
}

TEST(Scene, FrictionOfAPairThatCannotBeIsRejected) {
  Scene scene = falling();
  EXPECT_TRUE(rejects([&] { scene.set_friction({"box", "box", 0.3}); }, {"body_b", "'box'", "another body"}));
  EXPECT_TRUE(rejects([&] { scene.set_friction({"box", "cup", 0.3}); }, {"'cup'", "'table', 'box', 'object'"}));
  EXPECT_TRUE(rejects([&] { scene.set_friction({"box", "table", -0.1}); }, {"friction is -0.1", "at least 0"}));
  EXPECT_TRUE(rejects([&] { scene.set_friction({"box", "table", nan}); }, {"friction is nan", "finite"}));
  EXPECT_TRUE(scene.pair_frictions().empty());
}

}  // namespace
}  // namespace energymargin
