// Changes of all edges of an escape at once.

#include "search/polish.hpp"

#include <gtest/gtest.h>

namespace energymargin::search {
namespace {

Edge largest() {
  Eigen::VectorXd bounds = Eigen::VectorXd::Zero(12);
  bounds.head<3>().setConstant(2.0);
  bounds.segment<3>(6).setConstant(2.0);
  return {bounds, 50};
}

// A push of the first of two objects, and a rest.
TimedEdges escape() {
  Eigen::VectorXd push = Eigen::VectorXd::Zero(12);
  push[0] = 1.9;
  return {{{push, 40}, 0}, {{Eigen::VectorXd::Zero(12), 50}, 40}};
}

TEST(Polish, CutsAPushInTwoAndStaysWithinTheBounds) {
  const Edge bounds = largest();
  Draws rng(3);
  Polish polish(bounds, rng);
  polish.start(escape());
  for (int i = 0; i < 100; ++i) {
    const Polish::Trial trial = polish.draw();
    const TimedEdges& edges = trial.edges;
    ASSERT_EQ(edges.size(), 3u);
    for (const TimedEdge& edge : edges) {
      EXPECT_TRUE((edge.wrenches.cwiseAbs().array() <= bounds.wrenches.array()).all());
      EXPECT_GE(edge.steps, 1);
      EXPECT_LE(edge.steps, bounds.steps);
    }
    polish.tell(trial, Outcome::better);
  }
}

TEST(Polish, LeavesRestsAndOtherObjectsAlone) {
  const Edge bounds = largest();
  Draws rng(3);
  Polish polish(bounds, rng);
  polish.start(escape());
  const TimedEdges edges = polish.draw().edges;
  EXPECT_FALSE(edges[0].wrenches.head<3>().isZero(0.0));
  EXPECT_FALSE(edges[1].wrenches.head<3>().isZero(0.0));
  EXPECT_TRUE(edges[0].wrenches.tail<6>().isZero(0.0));
  EXPECT_TRUE(edges[2].wrenches.isZero(0.0));
}

TEST(Polish, EndsOnceNothingHelps) {
  const Edge bounds = largest();
  for (const Outcome outcome : {Outcome::worse, Outcome::infeasible}) {
    Draws rng(3);
    Polish polish(bounds, rng);
    EXPECT_FALSE(polish.goes_on());
    polish.start(escape());
    int trials = 0;
    for (; polish.goes_on() && trials < 1000; ++trials) polish.tell(polish.draw(), outcome);
    EXPECT_GT(trials, 10);
    EXPECT_LT(trials, 200);
  }
}

}  // namespace
}  // namespace energymargin::search
