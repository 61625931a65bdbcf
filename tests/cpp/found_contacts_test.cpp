// What the algorithms of a pair find: all of it counts, as the bodies stand.

#include "physics/contacts/found_contacts.hpp"

#include <gtest/gtest.h>

namespace energymargin {
namespace {

// Two boxes of 20 cm, the first on the second, and an algorithm of theirs, which may have swapped them.
class Touching {
 public:
  explicit Touching(bool swapped) : upper_(0.0, nullptr, &box_), lower_(0.0, nullptr, &box_) {
    upper_.setUserIndex(3);
    lower_.setUserIndex(7);
    manifold_ = swapped ? dispatcher_.getNewManifold(&lower_, &upper_) : dispatcher_.getNewManifold(&upper_, &lower_);
  }
  ~Touching() { dispatcher_.releaseManifold(manifold_); }

  void find(double distance) {
    const btCollisionObjectWrapper upper(nullptr, &box_, &upper_, upper_.getWorldTransform(), -1, -1);
    const btCollisionObjectWrapper lower(nullptr, &box_, &lower_, lower_.getWorldTransform(), -1, -1);
    FoundContacts result(&upper, &lower, 0.05, points);
    result.setPersistentManifold(manifold_);
    result.addContactPoint({0.0, 0.0, 1.0}, {0.05, 0.02, 0.0}, distance);
  }

  double threshold() const { return manifold_->getContactBreakingThreshold(); }

  std::vector<ContactPoint> points;

 private:
  btBoxShape box_{btVector3(0.1, 0.1, 0.1)};
  btRigidBody upper_, lower_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btPersistentManifold* manifold_;
};

TEST(FoundContacts, PointsHaveTheirPlaceOnBothBodiesAndTheFrictionOfThePair) {
  Touching touching(false);
  touching.find(-0.001);
  touching.find(0.0005);
  ASSERT_EQ(touching.points.size(), 2U);
  const ContactPoint& point = touching.points.front();
  EXPECT_EQ(point.a, 3U);
  EXPECT_EQ(point.b, 7U);
  EXPECT_EQ(point.on_b, btVector3(0.05, 0.02, 0.0));
  EXPECT_EQ(point.on_a, btVector3(0.05, 0.02, -0.001));
  EXPECT_EQ(point.distance, -0.001);
  EXPECT_EQ(point.friction, 0.05);
}

TEST(FoundContacts, BodiesAreThoseThatTheAlgorithmMeans) {
  Touching touching(true);
  touching.find(-0.001);
  ASSERT_EQ(touching.points.size(), 1U);
  EXPECT_EQ(touching.points.front().a, 7U);
  EXPECT_EQ(touching.points.front().b, 3U);
}

TEST(FoundContacts, PointThatIsTooFarIsNone) {
  Touching touching(false);
  touching.find(1.1 * touching.threshold());
  EXPECT_TRUE(touching.points.empty());
}

}  // namespace
}  // namespace energymargin
