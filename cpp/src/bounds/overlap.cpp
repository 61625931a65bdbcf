#include "bounds/overlap.hpp"

#include <algorithm>

#include "bounds/infinity.hpp"

namespace energymargin::bounds {
namespace {

constexpr int halvings = 6;  // of the step in which the sum of the depths is climbed

// The sum of the depths less the way by turns, and where it is highest so far.
class DepthSum {
 public:
  DepthSum(const ConvexPiece& piece, const Pose& pose, const ConvexPiece& other, const Turns& turns)
      : piece_(piece), pose_(pose), inverse_(pose.orientation.conjugate()), other_(other), turns_(turns) {}

  // `point` is in the frame of `other`.
  bool look(const Vector3& point) {
    const Vector3 in_piece = inverse_ * (point - pose_.position);
    const double sum = piece_.depth(in_piece) + other_.depth(point);
    const double certain = sum - turns_.chord * (in_piece - turns_.about).norm();
    best_.middle = std::max(best_.middle, sum);
    if (certain <= best_.certain) return false;
    best_.certain = certain;
    at_ = point;
    return true;
  }

  const Overlap& best() const { return best_; }
  const Vector3& at() const { return at_; }

 private:
  const ConvexPiece& piece_;
  const Pose& pose_;
  Quaternion inverse_;
  const ConvexPiece& other_;
  const Turns& turns_;
  Overlap best_{-infinity, -infinity};
  Vector3 at_ = Vector3::Zero();
};

}  // namespace

Overlap find_overlap(const ConvexPiece& piece, const Pose& pose, const ConvexPiece& other, const Turns& turns,
                     double enough) {
  const Quaternion inverse = pose.orientation.conjugate();
  const auto placed = [&](const Vector3& point) { return Vector3(pose.position + pose.orientation * point); };
  const auto in_piece = [&](const Vector3& point) { return Vector3(inverse * (point - pose.position)); };
  DepthSum sum(piece, pose, other, turns);
  const Vector3 center = placed(piece.center());
  sum.look(center);
  sum.look(other.near(center));
  sum.look(other.center());
  sum.look(placed(piece.near(in_piece(other.center()))));
  if (sum.best().certain > enough || sum.best().middle < -piece.radius() - other.radius()) return sum.best();
  for (const Vector3& corner : piece.corners()) sum.look(placed(corner));
  for (const Vector3& corner : other.corners()) sum.look(corner);
  // To and fro between the nearest points, and then along the axes of both.
  for (int i = 0; i < halvings && sum.look(other.near(placed(piece.near(in_piece(sum.at()))))); ++i) {
  }
  double step = 0.5 * std::min(piece.radius(), other.radius());
  const Eigen::Matrix3d turn = pose.orientation.toRotationMatrix();
  for (int i = 0; i < halvings && sum.best().certain <= enough; ++i, step *= 0.5) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const double way : {-step, step}) {
        sum.look(sum.at() + way * turn.col(axis));
        sum.look(sum.at() + way * Vector3::Unit(axis));
      }
    }
  }
  return sum.best();
}

double overlap_with_plane(const ConvexPiece& piece, const Pose& pose, const Plane& plane) {
  const Vector3 down = pose.orientation.conjugate() * -plane.normal;
  return plane.offset - plane.normal.dot(pose.position + pose.orientation * piece.support(down));
}

}  // namespace energymargin::bounds
