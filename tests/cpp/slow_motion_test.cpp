// An escape at a lower speed.

#include <gtest/gtest.h>

#include "scenes.hpp"
#include "search/edge_changes.hpp"

namespace energymargin::search {
namespace {

using namespace scenes;

State at(const Scene& scene, const Vector3& position, const Vector3& velocity) {
  BodyState body;
  body.position = position;
  body.velocity = velocity;
  return pack(scene, {{"object", body}});
}

Edge push_x(double force, int steps) {
  Edge made{Eigen::VectorXd::Zero(wrench_axes), steps};
  made.wrenches[0] = force;
  return made;
}

// A body without friction is pushed over 0.1 m, up to the speed that this gives it, and coasts over 0.1 m.
class SlowMotionOf : public ::testing::Test {
 protected:
  SlowMotionOf() : problem(drift()), largest(largest_edge(problem)), slow_motion(problem, largest) {
    const double speed = std::sqrt(2.0 * 0.1 / problem.scene.bodies()[0].mass);
    const State start = problem.state;
    const State pushed = at(problem.scene, {0.1, 0.0, 0.0}, {speed, 0.0, 0.0});
    const State out = at(problem.scene, {0.2, 0.0, 0.0}, {speed, 0.0, 0.0});
    escape = {{push_x(1.0, 40), start, pushed}, {push_x(0.0, 30), pushed, out}};
  }

  TimedEdges slowed(double slowdown, double surplus = 0.0) const {
    return slow_motion(escape, State::Zero(problem.state.size()), slowdown, surplus);
  }

  Problem problem;
  Edge largest;
  SlowMotion slow_motion;
  std::vector<Passage> escape;
};

TEST_F(SlowMotionOf, APushDoesTheWorkThatTheLowerSpeedNeeds) {
  const TimedEdges edges = slowed(2.0);
  ASSERT_EQ(edges.size(), 2u);
  EXPECT_NEAR(edges[0].wrenches[0], 0.25, 1e-12);
  EXPECT_EQ(edges[0].steps, 80);
  EXPECT_NEAR(edges[1].wrenches[0], 0.0, 1e-12) << "at any speed it coasts";
  EXPECT_EQ(edges[1].steps, 60);
}

TEST_F(SlowMotionOf, TheFirstPushHasTheSurplus) { EXPECT_NEAR(slowed(2.0, 0.2)[0].wrenches[0], 0.3, 1e-12); }

TEST_F(SlowMotionOf, WhereItCoastedUphillItIsPushedOn) {
  escape[1].to = at(problem.scene, {0.2, 0.0, 0.0}, Vector3::Zero());
  const TimedEdges edges = slowed(2.0);
  EXPECT_NEAR(edges[1].wrenches[0], 0.75, 1e-12) << "the speed that is left brings it up a quarter of the way";
}

TEST_F(SlowMotionOf, EdgesStayWithinTheBounds) {
  escape[0].edge = push_x(1.0, largest.steps);
  escape[0].to = escape[0].from;
  escape[0].to[0] = 1e-3;  // against something that yields later
  const TimedEdges edges = slowed(2.5, 0.3);
  int steps = 0;
  for (const TimedEdge& edge : edges) {
    EXPECT_LE(edge.wrenches[0], largest.wrenches[0]);
    EXPECT_LE(edge.steps, largest.steps);
    steps += edge.steps;
  }
  EXPECT_EQ(steps, 300 + 75);
}

TEST_F(SlowMotionOf, WhoMovesAlongSeesTheSpeedFallTowardsItsOwn) {
  const State frame = at(problem.scene, Vector3::Zero(), escape[0].to.segment<3>(7));
  const TimedEdges edges = slow_motion(escape, frame, 2.0, 0.0);
  EXPECT_NE(edges[0].wrenches[0], slowed(2.0)[0].wrenches[0]);
}

}  // namespace
}  // namespace energymargin::search
