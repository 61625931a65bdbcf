// Compounds and hulls in contact: rest, load, fall, and which part touches.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "expect.hpp"
#include "mechanisms.hpp"

namespace energymargin {
namespace {

using namespace scenes;

const Quaternion oblique = turn(0.7, Vector3(1.0, 0.3, 0.0).normalized());

// A foot of 0.3 x 0.1 x 0.1 m with a post of 0.2 m on its end, as boxes or as hulls; its frame is below the post.
Compound angle(bool hulls = false) {
  if (hulls) {
    return {{{brick({0.3, 0.1, 0.1}, Quaternion::Identity(), {0.1, 0.0, 0.05})},
             {brick({0.1, 0.1, 0.2}, Quaternion::Identity(), {0.0, 0.0, 0.2})}}};
  }
  return {{{Box{{0.3, 0.1, 0.1}}, {{0.1, 0.0, 0.05}}}, {Box{{0.1, 0.1, 0.2}}, {{0.0, 0.0, 0.2}}}}};
}

// A table of 0.3 m with four legs, 0.12 m high; its frame is on the floor.
Compound small_table() {
  Compound made{{{Box{{0.3, 0.3, 0.02}}, {{0.0, 0.0, 0.11}}}}};
  for (const double x : {-0.13, 0.13}) {
    for (const double y : {-0.13, 0.13}) made.parts.push_back({Box{{0.02, 0.02, 0.1}}, {{x, y, 0.05}}});
  }
  return made;
}

// A box of 0.2 x 0.2 x 0.11 m that is open above, of five plates 1 cm thick; its frame is under its floor.
Compound open_box() {
  return {{{Box{{0.2, 0.2, 0.01}}, {{0.0, 0.0, 0.005}}},
           {Box{{0.01, 0.2, 0.1}}, {{0.095, 0.0, 0.06}}},
           {Box{{0.01, 0.2, 0.1}}, {{-0.095, 0.0, 0.06}}},
           {Box{{0.18, 0.01, 0.1}}, {{0.0, 0.095, 0.06}}},
           {Box{{0.18, 0.01, 0.1}}, {{0.0, -0.095, 0.06}}}}};
}

enum class Ground { plane, box, hull, two_boxes };

std::ostream& operator<<(std::ostream& out, Ground ground) {
  return out << (std::vector<const char*>{"plane", "box", "hull", "two boxes"})[static_cast<std::size_t>(ground)];
}

// A table at height 0.
Body table(Ground kind) {
  const Vector3 low(0.0, 0.0, -0.1);
  switch (kind) {
    case Ground::plane:
      return fixed("table", Plane{});
    case Ground::box:
      return fixed("table", Box{{2.0, 2.0, 0.2}}, low);
    case Ground::hull:
      return fixed("table", brick({2.0, 2.0, 0.2}), low);
    default:
      break;
  }
  return fixed("table",
               Compound{{{Box{{1.0, 2.0, 0.2}}, {{0.5, 0.0, 0.0}}}, {Box{{1.0, 2.0, 0.2}}, {{-0.5, 0.0, 0.0}}}}}, low);
}

const std::vector<Ground> grounds{Ground::plane, Ground::box, Ground::hull, Ground::two_boxes};

Scene on(Ground ground, const Shape& shape, const Vector3& position, const Stepping& stepping = {}) {
  Scene scene(downwards, stepping);
  scene.add_body(table(ground));
  scene.add_body(body("object", shape, 1.0, position, Role::object));
  return scene;
}

State posed(const Scene& scene, const BodyState& object) { return pack(scene, {{"object", object}}); }

struct Rest {
  double gained = 0.0;  // most energy above that at the start [J]
  double moved = 0.0;   // farthest from where it was at the start [m]
  double speed = 0.0;   // fastest in the second half [m/s], [rad/s]
};

Rest rest(const Scene& scene, const State& start, const std::string& name = "object", int steps = 480) {
  const World world(scene);
  const double energy = world.energy(start);
  const Vector3 from = body_in(scene, start, name).position;
  Rest measured;
  int number = 0;
  for (const State& state : trajectory(scene, start, steps)) {
    const BodyState at = body_in(scene, state, name);
    measured.gained = std::max(measured.gained, world.energy(state) - energy);
    measured.moved = std::max(measured.moved, (at.position - from).norm());
    if (++number > steps / 2) {
      measured.speed = std::max({measured.speed, at.velocity.norm(), at.angular_velocity.norm()});
    }
  }
  return measured;
}

// ---- rest

TEST(CompoundContact, AngleRestsOnEveryKindOfTableForTwoSecondsAndGainsNoEnergy) {
  for (const Ground ground : grounds) {
    for (const bool hulls : {false, true}) {
      const Scene scene = on(ground, angle(hulls), {0.05, 0.02, 0.0});
      const Rest found = rest(scene, pack(scene));
      EXPECT_LT(found.gained, 5e-4) << ground << ", hulls " << hulls;  // Bullet rounds a hull to 1e-4 of its size
      EXPECT_LT(found.moved, 3e-4) << ground << ", hulls " << hulls;
      EXPECT_LT(found.speed, 0.02) << ground << ", hulls " << hulls;
    }
  }
}

// The default tolerance leaves that share of the 4 cm/s of a step's fall.
TEST(CompoundContact, AngleOfBoxesRestsOnAPlaneAndOnABoxToAMicrometre) {
  Stepping precise;
  precise.tolerance = 1e-9;
  for (const Ground ground : {Ground::plane, Ground::box}) {
    const Scene scene = on(ground, angle(), {0.05, 0.02, 0.0}, precise);
    const Rest found = rest(scene, pack(scene));
    EXPECT_LT(found.gained, 1e-5) << ground;
    EXPECT_LT(found.moved, 1e-6) << ground;
    EXPECT_LT(found.speed, 1e-8) << ground;
  }
}

TEST(CompoundContact, AngleThatIsThrownComesToRestAndStaysThere) {
  for (const Ground ground : grounds) {
    for (const bool hulls : {false, true}) {
      const Scene scene = on(ground, angle(hulls), Vector3::Zero());
      BodyState thrown;
      thrown.position.z() = 0.5;
      thrown.orientation = oblique;
      thrown.angular_velocity = {1.0, 2.0, 3.0};
      const State settled = after(scene, posed(scene, thrown), 720);
      EXPECT_NEAR(body_in(scene, settled, "object").position.z(), 0.05, 2e-4) << ground << ", hulls " << hulls;
      const Rest found = rest(scene, settled, "object", 240);
      EXPECT_LT(found.speed, 5e-3) << ground << ", hulls " << hulls;
      EXPECT_LT(found.gained, 1e-4) << ground << ", hulls " << hulls;
    }
  }
}

TEST(CompoundContact, TablesAndAnAngleStackAndStay) {
  for (const Ground ground : grounds) {
    Scene scene;
    scene.add_body(table(ground));
    scene.add_body(body("lower", small_table(), 2.0, Vector3::Zero()));
    Body upper = body("upper", small_table(), 2.0, {0.005, 0.0, 0.12});
    upper.state.orientation = turn(0.05, Vector3::UnitZ());
    scene.add_body(upper);
    scene.add_body(body("object", angle(), 0.5, {-0.05, 0.0, 0.24}, Role::object));
    for (const char* name : {"object", "upper", "lower"}) {
      const Rest found = rest(scene, pack(scene), name);
      EXPECT_LT(found.gained, 5e-4) << ground << ", " << name;
      EXPECT_LT(found.moved, 5e-4) << ground << ", " << name;
      EXPECT_LT(found.speed, 0.02) << ground << ", " << name;
    }
  }
}

TEST(CompoundContact, CompoundThatMakesABoxMovesOverATableAsTheBox) {
  const Compound halves{{{Box{{0.6, 0.4, 0.1}}, {{0.3, 0.0, 0.0}}}, {Box{{0.6, 0.4, 0.1}}, {{-0.3, 0.0, 0.0}}}}};
  Wrench push;
  push.force = {6.0, 0.0, 0.0};
  const auto slid = [&](const Shape& shape) {
    const Scene scene = rough_table(exact(), shape);
    return body_in(scene, World(scene).rollout(pack(scene), {push}, 1.0).state, "object");
  };
  const BodyState box = slid(Box{{1.2, 0.4, 0.1}});
  const BodyState compound = slid(halves);
  EXPECT_NEAR(box.velocity.x(), 6.0 - 0.5 * g, 1e-9);
  EXPECT_NEAR(compound.velocity.x(), 6.0 - 0.5 * g, 1e-6);
  EXPECT_NEAR(compound.position.x(), box.position.x(), 1e-6);
  EXPECT_LT((compound.position - box.position).norm(), 3e-6);  // on more corners it sinks less
  EXPECT_LT(compound.angular_velocity.norm(), 1e-6);
}

TEST(CompoundContact, HullThatSlidesOverABoxDoesNotSinkIntoIt) {
  const std::vector<Shape> shapes{brick({0.08, 0.08, 0.04}),
                                  Compound{{{brick({0.04, 0.08, 0.04}, Quaternion::Identity(), {0.02, 0.0, 0.0})},
                                            {brick({0.04, 0.08, 0.04}, Quaternion::Identity(), {-0.02, 0.0, 0.0})}}}};
  for (const Shape& shape : shapes) {
    for (const double speed : {0.3, 1.0, 2.0}) {
      const Scene scene = on(Ground::box, shape, {-0.8, 0.013, 0.02});
      BodyState start = scene.body("object").state;
      start.velocity.x() = speed;
      double lowest = 0.0;
      for (const State& state : trajectory(scene, posed(scene, start), 240)) {
        lowest = std::min(lowest, body_in(scene, state, "object").position.z() - 0.02);
      }
      EXPECT_GT(lowest, -1e-3) << speed << " m/s, shape " << shape.index();
    }
  }
}

// ---- load

// Once it has settled.
std::vector<Contact> contacts_at_rest(const Scene& scene) {
  return World(scene).simulate(pack(scene), {}, 120, {120}).front().contacts;
}

TEST(CompoundContact, PartsTogetherBearTheWeight) {
  for (const Ground ground : {Ground::plane, Ground::box}) {
    const Scene scene = on(ground, small_table(), Vector3::Zero(), exact());
    double weight = 0.0;
    Vector3 moment = Vector3::Zero();
    for (const Contact& contact : contacts_at_rest(scene)) {
      EXPECT_NEAR(std::abs(contact.normal.z()), 1.0, 1e-9);
      weight += contact.normal_force;
      moment += contact.position.cross(Vector3(0.0, 0.0, contact.normal_force));
    }
    EXPECT_NEAR(weight, g, 1e-6) << ground;
    EXPECT_LT(moment.norm(), 1e-6) << ground;
  }
}

TEST(CompoundContact, LoadLiesUnderTheCentreOfMass) {
  const Scene scene = on(Ground::plane, angle(), Vector3::Zero(), exact());
  const State still = after(scene, pack(scene), 48);
  double weight = 0.0;
  Vector3 moment = Vector3::Zero();
  for (const Contact& contact : World(scene).contacts(still)) {
    weight += contact.normal_force;
    moment += contact.position * contact.normal_force;
  }
  EXPECT_NEAR(weight, g, 1e-5);
  EXPECT_NEAR(moment.x() / weight, (3.0 * 0.1 + 2.0 * 0.0) / 5.0, 1e-4);
  EXPECT_NEAR(moment.y() / weight, 0.0, 1e-4);
}

TEST(CompoundContact, LegBearsWhatALeverSays) {
  // Feet at x = -0.2 and 0.3 under a beam whose centre of mass is given at 0.1.
  Compound bench{{{Box{{0.6, 0.2, 0.02}}, {{0.05, 0.0, 0.11}}},
                  {Box{{0.02, 0.2, 0.1}}, {{-0.2, 0.0, 0.05}}},
                  {Box{{0.02, 0.2, 0.1}}, {{0.3, 0.0, 0.05}}}}};
  Scene scene(downwards, exact());
  scene.add_body(table(Ground::plane));
  Body made = body("object", bench, 1.0, Vector3::Zero(), Role::object);
  made.inertial = Inertial{{0.1, 0.0, 0.1}, {0.01, 0.03, 0.03}};
  scene.add_body(made);
  double near = 0.0;
  double far = 0.0;
  double moment = 0.0;
  for (const Contact& contact : World(scene).contacts(after(scene, pack(scene), 48))) {
    (contact.position.x() < 0.0 ? near : far) += contact.normal_force;
    moment += contact.position.x() * contact.normal_force;
  }
  EXPECT_NEAR(near + far, g, 1e-4);
  EXPECT_NEAR(moment, 0.1 * g, 1e-4);
  EXPECT_NEAR(near, 0.4 * g, 0.02 * g);  // the centre is 0.2 of 0.5 m from the far foot
  EXPECT_NEAR(far, 0.6 * g, 0.02 * g);
}

// ---- hulls on a plane

TEST(CompoundContact, HullFarFromItsCentreOfMassStandsOnAPlane) {
  Scene scene;
  scene.add_body(table(Ground::plane));
  Body hung = body("object", brick({0.2, 0.2, 0.1}, Quaternion::Identity(), {0.0, 0.0, 0.3}), 1.0, {0.0, 0.0, -0.25},
                   Role::object);
  hung.inertial = Inertial{Vector3::Zero(), {0.01, 0.01, 0.01}};  // the centre is 0.25 m below the plane
  scene.add_body(hung);
  const Rest found = rest(scene, pack(scene));
  EXPECT_LT(found.moved, 2e-5);
  EXPECT_NEAR(World(scene).distance(pack(scene), "object", "table"), 0.0, 1e-5);
}

TEST(CompoundContact, CornerOfACubeStandsOnItsSlantedFaceInAnyFrame) {
  const ConvexHull corner{{{0.0, 0.0, 0.0}, {0.1, 0.0, 0.0}, {0.0, 0.1, 0.0}, {0.0, 0.0, 0.1}}};
  Body cut = body("object", corner, 1.0, {0.0, 0.0, 0.1 / std::sqrt(3.0)}, Role::object);
  cut.state.orientation = Eigen::AngleAxisd(std::acos(-1.0 / std::sqrt(3.0)), Vector3(-1.0, 1.0, 0.0).normalized());
  Body same = cut;  // with the body's axes as its principal ones
  same.inertial = Inertial{cut.principal_inertial().center, Vector3::Constant(2e-4)};
  for (const Body& block : {cut, same}) {
    for (const Shape& shape : {Shape(corner), Shape(Compound{{{corner}}})}) {
      Scene scene;
      scene.add_body(table(Ground::plane));
      Body made = block;
      made.shape = shape;
      scene.add_body(made);
      EXPECT_LT(rest(scene, pack(scene)).moved, 2e-5) << made.inertial.has_value() << ", shape " << shape.index();
    }
  }
}

// ---- bowls

// A ball of 2 cm over an open box, after two seconds.
struct Bowl {
  explicit Bowl(bool loose, const Vector3& velocity = Vector3::Zero(), const Vector3& above = {0.02, 0.01, 0.2}) {
    scene.add_body(fixed("ground", Plane{}));
    scene.add_body(body("bowl", open_box(), loose ? 0.3 : 0.0, Vector3::Zero()));
    Body ball = body("object", Sphere{0.02}, 0.1, above, Role::object);
    ball.state.velocity = velocity;
    scene.add_body(ball);
    states = trajectory(scene, pack(scene), 480);
  }

  BodyState ball() const { return body_in(scene, states.back(), "object"); }

  Scene scene;
  std::vector<State> states;
};

TEST(CompoundContact, BallThatFallsIntoAnOpenBoxComesToRestOnItsFloor) {
  for (const bool loose : {false, true}) {
    const Bowl bowl(loose);
    EXPECT_NEAR(bowl.ball().position.z(), 0.03, 1e-5) << loose;
    EXPECT_LT(bowl.ball().velocity.norm(), 1e-3) << loose;
    EXPECT_NEAR(bowl.ball().position.x(), 0.02, 1e-3) << loose;
    const World world(bowl.scene);
    for (std::size_t i = 100; i < bowl.states.size(); ++i) {
      EXPECT_LT(world.energy(bowl.states[i]), world.energy(bowl.states[0])) << loose << ", " << i;
    }
  }
}

TEST(CompoundContact, BallThatIsThrownIntoAnOpenBoxStaysInIt) {
  for (const bool loose : {false, true}) {
    for (const Vector3& velocity : {Vector3(0.3, 0.2, 0.0), Vector3(-0.3, 0.1, 0.0), Vector3(0.0, -0.4, 0.0)}) {
      const Bowl bowl(loose, velocity);
      const BodyState box = loose ? body_in(bowl.scene, bowl.states.back(), "bowl") : BodyState{};
      const Vector3 inside = box.orientation.conjugate() * (bowl.ball().position - box.position);
      EXPECT_NEAR(inside.z(), 0.03, 1e-3) << loose << ", " << velocity.transpose();
      EXPECT_LT(inside.head<2>().cwiseAbs().maxCoeff(), 0.0701) << loose << ", " << velocity.transpose();
    }
  }
}

TEST(CompoundContact, BallPushesALooseBoxFromWithinAndKeepsTheMomentum) {
  Scene scene(Vector3::Zero(), exact());
  scene.add_body(body("bowl", open_box(), 0.3, Vector3::Zero()));
  Body ball = body("object", Sphere{0.02}, 0.1, {0.0, 0.0, 0.06}, Role::object);
  ball.state.velocity = {0.5, 0.0, 0.0};
  scene.add_body(ball);
  const State end = after(scene, pack(scene), 120);
  EXPECT_GT(body_in(scene, end, "bowl").velocity.x(), 0.1);
  EXPECT_LT((momentum(scene, end) - Vector3(0.05, 0.0, 0.0)).norm(), 1e-12);
  EXPECT_LT((angular_momentum(scene, end) - angular_momentum(scene, pack(scene))).norm(), 1e-5);
}

// ---- links

TEST(CompoundContact, LinkOfPartsPressesOnATableWithItsWeight) {
  Scene scene(downwards, exact());
  scene.add_body(table(Ground::plane));
  scene.add_body(fixed("post", Box{{0.1, 0.1, 0.1}}, {0.0, 0.0, 1.0}));
  scene.add_body(body("foot", small_table(), 1.5, Vector3::Zero()));
  scene.add_joint(joint("lift", JointType::prismatic, "post", "foot", Vector3::UnitZ(), {0.0, 0.0, -1.0}));
  double weight = 0.0;
  for (const Contact& contact : World(scene).contacts(pack(scene))) weight += contact.normal_force;
  EXPECT_NEAR(weight, 1.5 * g / (1.0 + giving / 16.0), 1e-9);  // on sixteen corners, in the first step
}

TEST(CompoundContact, HingedPairOfPartsStandsOnEveryKindOfTable) {
  for (const Ground ground : grounds) {
    Scene scene;
    scene.add_body(table(ground));
    scene.add_body(body("base", small_table(), 1.0, Vector3::Zero()));
    scene.add_body(body("lid", angle(), 0.5, Vector3::Zero()));
    Joint hinge = joint("hinge", JointType::revolute, "base", "lid", Vector3::UnitY(), {0.0, 0.0, 0.13});
    hinge.stiffness = 5.0;
    hinge.damping = 0.5;
    scene.add_joint(hinge);
    const State settled = after(scene, pack(scene), 480);
    EXPECT_NEAR(body_in(scene, settled, "base").position.z(), 0.0, 2e-4) << ground;
    const Rest found = rest(scene, settled, "base");
    EXPECT_LT(found.moved, 5e-4) << ground;
    EXPECT_LT(found.speed, 0.02) << ground;
    const Frame end = World(scene).simulate(pack(scene), {}, 720, {720}).front();
    double weight = 0.0;
    for (const Contact& contact : end.contacts) {
      if (contact.body_a == "table" || contact.body_b == "table") weight += contact.normal_force;
    }
    EXPECT_NEAR(weight, 1.5 * g, 0.02 * 1.5 * g) << ground;
  }
}

TEST(CompoundContact, FingersOfPartsSqueezeABoxWithTheForceOfTheirTargets) {
  Scene scene(Vector3::Zero(), exact());
  scene.add_body(fixed("palm", Box{{0.3, 0.1, 0.02}}, {0.0, 0.0, 0.3}));
  for (const double side : {-1.0, 1.0}) {
    const std::string name = side < 0.0 ? "left" : "right";
    // A pad at the end of a bar, in a frame at the far end of the bar.
    const Compound finger{
        {{Box{{0.01, 0.02, 0.2}}, {{0.02 * side, 0.0, -0.1}}}, {Box{{0.02, 0.06, 0.06}}, {{0.0, 0.0, -0.2}}}}};
    scene.add_body(body(name, finger, 0.2, Vector3::Zero(), Role::effector, 1.0));
    Joint slide = joint(name, JointType::prismatic, "palm", name, {-side, 0.0, 0.0}, {0.1 * side, 0.0, -0.1});
    slide.stiffness = 1000.0;
    slide.damping = 60.0;
    slide.target = 0.045;  // 5 mm into the box: 5 N
    scene.add_joint(slide);
  }
  scene.add_body(body("object", Box{{0.1, 0.08, 0.08}}, 0.2, Vector3::Zero(), Role::object, 1.0));
  const Frame end = World(scene).simulate(pack(scene), {}, 480, {480}).front();
  double left = 0.0;
  double right = 0.0;
  for (const Contact& contact : end.contacts) {
    (contact.body_a == "left" || contact.body_b == "left" ? left : right) += contact.normal_force;
  }
  EXPECT_NEAR(left, 5.0, 0.05);
  EXPECT_NEAR(right, 5.0, 0.05);
  EXPECT_LT(body_in(scene, end.state, "object").position.norm(), 1e-4);
}

// ---- which part

TEST(CompoundContact, DistanceIsThatOfTheNearestPartAskedInEitherOrder) {
  Scene scene;
  scene.add_body(table(Ground::plane));
  scene.add_body(body("object", angle(), 1.0, {0.0, 0.0, 1.0}, Role::object));
  scene.add_body(body("over the post", Sphere{0.1}, 1.0, {0.0, 0.0, 1.6}));
  scene.add_body(body("over the foot", Sphere{0.05}, 1.0, {0.22, 0.0, 1.23}));
  Body other = body("other", angle(true), 1.0, {0.4, 0.0, 1.35});
  other.state.orientation = turn(pi, Vector3::UnitY());  // its post hangs down to 1.05, at x = 0.35
  scene.add_body(other);
  World world(scene);
  const auto expect = [&](const std::string& b, double distance, double slack) {
    EXPECT_NEAR(world.distance(pack(scene), "object", b), distance, slack) << b;
    EXPECT_NEAR(world.distance(pack(scene), b, "object"), distance, slack) << b;
  };
  expect("table", 1.0, 1e-9);
  expect("over the post", 0.2, 1e-6);
  expect("over the foot", 0.08, 1e-6);
  expect("other", 0.1, 4e-5);  // of its post from the foot, which ends at x = 0.25
}

TEST(CompoundContact, DistanceDoesNotDependOnAHullElsewhere) {
  const auto distance = [](bool with_hull) {
    Scene scene;
    scene.add_body(body("object", angle(), 1.0, {0.0, 0.0, 1.0}, Role::object));
    scene.add_body(body("ball", Sphere{0.1}, 1.0, {0.25, 0.0, 1.3}));  // over the edge of the foot
    scene.add_body(body("rod", Cylinder{0.05, 0.4}, 1.0, {0.3, 0.5, 1.1}));
    if (with_hull) scene.add_body(fixed("far", brick({1.0, 1.0, 1.0}), {50.0, 0.0, 0.0}));
    World world(scene);
    return Vector2(world.distance(pack(scene), "object", "ball"), world.distance(pack(scene), "object", "rod"));
  };
  EXPECT_EQ(distance(true), distance(false));
}

TEST(CompoundContact, DeepestContactIsThatOfTheDeepestPartWithItsPlaceAndNormal) {
  Scene scene;
  scene.add_body(fixed("shelf", angle()));
  scene.add_body(body("object", Sphere{0.05}, 1.0, {0.2, 0.0, 0.14}, Role::object));
  const Contact on_foot = deepest_contact(scene, pack(scene));
  EXPECT_EQ(on_foot.body_a + " " + on_foot.body_b, "shelf object");
  EXPECT_NEAR(on_foot.distance, -0.01, 1e-6);
  EXPECT_LT((on_foot.position - Vector3(0.2, 0.0, 0.09)).norm(), 1e-6) << on_foot.position.transpose();
  EXPECT_LT((on_foot.normal - Vector3(0.0, 0.0, -1.0)).norm(), 1e-6) << on_foot.normal.transpose();
  BodyState beside;
  beside.position = {0.08, 0.0, 0.25};  // 2 cm in the post
  const Contact on_post = deepest_contact(scene, posed(scene, beside));
  EXPECT_NEAR(on_post.distance, -0.02, 1e-6);
  EXPECT_LT((on_post.position - Vector3(0.03, 0.0, 0.25)).norm(), 1e-6) << on_post.position.transpose();
  EXPECT_LT((on_post.normal + Vector3::UnitX()).norm(), 1e-6) << on_post.normal.transpose();
}

TEST(CompoundContact, StartDeepInOnePartOfABodyIsRejected) {
  const Scene scene = on(Ground::plane, small_table(), {0.0, 0.0, -0.006});
  Problem problem = problem_of(scene, {1.0, 0.0, 0.0}, Vector3::Zero(), 0.5, regions::Ball{"object"});
  // Half of the smallest half extent of the most solid part: 1 cm.
  EXPECT_TRUE(rejects([&] { validate(problem); }, {"'object'", "'table'", "0.006 m", "at most 0.005 m"}));
  problem.state[2] = -0.004;
  EXPECT_NO_THROW(validate(problem));
}

TEST(CompoundContact, ContactsOfACompoundNameTheBodyAndOpposeItsWeight) {
  Scene scene(downwards, exact());
  scene.add_body(fixed("shelf", open_box()));
  scene.add_body(body("object", Box{{0.1, 0.1, 0.04}}, 2.0, {0.0, 0.0, 0.03}, Role::object));
  double load = 0.0;
  for (const Contact& contact : contacts_at_rest(scene)) {
    const double side = contact.body_a == "object" ? 1.0 : -1.0;
    EXPECT_EQ(contact.body_a == "object" ? contact.body_b : contact.body_a, "shelf");
    EXPECT_NEAR(side * contact.normal.z(), 1.0, 1e-9);
    load += contact.normal_force;
  }
  EXPECT_NEAR(load, 2.0 * g, 1e-6);
}

}  // namespace
}  // namespace energymargin
