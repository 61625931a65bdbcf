// Contact points that are found again: they move, and what the solver knows of them stays.

#include "physics/contacts/found_contacts.hpp"

#include <gtest/gtest.h>

namespace energymargin {
namespace {

constexpr double of_upper = 0.5, of_lower = 0.8;

// Of the product of the two bodies' coefficients, as Bullet's.
struct Found : FoundContacts {
  Found(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b)
      : FoundContacts(a, b, of_upper * of_lower) {}
};

// Of a coefficient of their own.
struct FoundOnIce : FoundContacts {
  FoundOnIce(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b) : FoundContacts(a, b, 0.05) {}
};

// Two boxes of 20 cm, one on the other, and the contacts that an algorithm of theirs keeps.
class Touching {
 public:
  explicit Touching(bool swapped)
      : upper_(0.0, nullptr, &box_), lower_(0.0, nullptr, &box_), dispatcher_(&configuration_), swapped_(swapped) {
    upper_.setFriction(of_upper);
    lower_.setFriction(of_lower);
    lower_.setWorldTransform(btTransform(btQuaternion(btVector3(0.0, 0.0, 1.0), 0.3), {0.0, 0.0, -0.1}));
    move_upper(0.0);
    manifold_ = dispatcher_.getNewManifold(&upper_, &lower_);
  }
  ~Touching() { dispatcher_.releaseManifold(manifold_); }

  void move_upper(double x) {
    upper_.setWorldTransform(btTransform(btQuaternion(btVector3(0.0, 0.0, 1.0), 0.7), {x, 0.0, 0.1}));
  }

  template <typename Result>
  void find(double x, double distance) {
    const btCollisionObjectWrapper upper(nullptr, &box_, &upper_, upper_.getWorldTransform(), -1, -1);
    const btCollisionObjectWrapper lower(nullptr, &box_, &lower_, lower_.getWorldTransform(), -1, -1);
    Result result(swapped_ ? &lower : &upper, swapped_ ? &upper : &lower);
    result.setPersistentManifold(manifold_);
    result.addContactPoint({0.0, 0.0, 1.0}, {x, 0.02, 0.0}, distance);
  }

  int count() const { return manifold_->getNumContacts(); }
  btManifoldPoint& point(int i = 0) { return manifold_->getContactPoint(i); }
  double threshold() const { return manifold_->getContactBreakingThreshold(); }

 private:
  btBoxShape box_{btVector3(0.1, 0.1, 0.1)};
  btRigidBody upper_, lower_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btPersistentManifold* manifold_;
  bool swapped_;
};

TEST(FoundContacts, PointThatIsFoundAgainMovesAndKeepsItsImpulsesAndItsFriction) {
  Touching touching(false);
  touching.find<Found>(0.05, -0.001);
  ASSERT_EQ(touching.count(), 1);
  btManifoldPoint& point = touching.point();
  EXPECT_DOUBLE_EQ(point.m_combinedFriction, 0.4);
  point.m_appliedImpulse = 3.0;
  point.m_appliedImpulseLateral1 = 2.0;
  point.m_appliedImpulseLateral2 = -1.0;
  point.m_lateralFrictionDir1 = {1.0, 0.0, 0.0};
  point.m_lateralFrictionDir2 = {0.0, 1.0, 0.0};
  point.m_lifeTime = 7;
  touching.find<Found>(0.0505, -0.002);
  ASSERT_EQ(touching.count(), 1);
  EXPECT_EQ(point.m_appliedImpulse, 3.0);
  EXPECT_EQ(point.m_appliedImpulseLateral1, 2.0);
  EXPECT_EQ(point.m_appliedImpulseLateral2, -1.0);
  EXPECT_EQ(point.m_lateralFrictionDir1, btVector3(1.0, 0.0, 0.0));
  EXPECT_EQ(point.m_lateralFrictionDir2, btVector3(0.0, 1.0, 0.0));
  EXPECT_EQ(point.m_lifeTime, 7);
  EXPECT_DOUBLE_EQ(point.m_combinedFriction, 0.4);
  EXPECT_EQ(point.getDistance(), -0.002);
  EXPECT_EQ(point.getPositionWorldOnB().x(), 0.0505);
}

TEST(FoundContacts, NewPointHasTheFrictionOfThePair) {
  Touching touching(false);
  touching.find<FoundOnIce>(0.05, -0.001);
  touching.find<FoundOnIce>(-0.05, -0.001);
  ASSERT_EQ(touching.count(), 2);
  EXPECT_EQ(touching.point(0).m_combinedFriction, 0.05);
  EXPECT_EQ(touching.point(1).m_combinedFriction, 0.05);
}

// In either order of the bodies.
TEST(FoundContacts, PointsAreWhereBulletHasThem) {
  for (const bool swapped : {false, true}) {
    Touching ours(swapped), bullets(swapped);
    for (const double x : {0.0, 0.0005, 0.001, 0.05, 0.0495, -0.05, 0.002}) {
      ours.move_upper(0.1 * x);
      bullets.move_upper(0.1 * x);
      ours.find<Found>(x, -0.01 * x);
      bullets.find<btManifoldResult>(x, -0.01 * x);
      ASSERT_EQ(ours.count(), bullets.count()) << x;
      for (int i = 0; i < ours.count(); ++i) {
        EXPECT_EQ(ours.point(i).m_localPointA, bullets.point(i).m_localPointA) << x << ", " << swapped;
        EXPECT_EQ(ours.point(i).m_localPointB, bullets.point(i).m_localPointB) << x << ", " << swapped;
        EXPECT_EQ(ours.point(i).m_positionWorldOnA, bullets.point(i).m_positionWorldOnA) << x;
        EXPECT_EQ(ours.point(i).m_positionWorldOnB, bullets.point(i).m_positionWorldOnB) << x;
        EXPECT_EQ(ours.point(i).m_normalWorldOnB, bullets.point(i).m_normalWorldOnB) << x;
        EXPECT_EQ(ours.point(i).getDistance(), bullets.point(i).getDistance()) << x;
        EXPECT_EQ(ours.point(i).m_combinedFriction, bullets.point(i).m_combinedFriction) << x;
      }
    }
    EXPECT_EQ(ours.count(), 3);
  }
}

TEST(FoundContacts, PointElsewhereIsANewOneAndOneTooFarIsNone) {
  Touching touching(false);
  touching.find<Found>(0.05, 0.0);
  touching.point().m_appliedImpulse = 3.0;
  touching.find<Found>(0.05 + 1.1 * touching.threshold(), 0.0);
  ASSERT_EQ(touching.count(), 2);
  EXPECT_EQ(touching.point(0).m_appliedImpulse, 3.0);
  EXPECT_EQ(touching.point(1).m_appliedImpulse, 0.0);
  touching.find<Found>(-0.05, 1.1 * touching.threshold());
  EXPECT_EQ(touching.count(), 2);
}

}  // namespace
}  // namespace energymargin
