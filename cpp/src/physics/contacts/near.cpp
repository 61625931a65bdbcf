#include "physics/contacts/near.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace energymargin {
namespace {

constexpr double rounding_of_ends = 1e-12;  // of an interval's ends, a share of them
constexpr double infinity = std::numeric_limits<double>::infinity();

int widest_axis(const std::vector<Bounds>& boxes) {
  btVector3 sum(0, 0, 0);
  btVector3 squares(0, 0, 0);
  for (const Bounds& box : boxes) {
    const btVector3 center = 0.5 * (box.low + box.high);
    sum += center;
    squares += center * center;
  }
  return (squares - sum * sum / static_cast<double>(boxes.size())).maxAxis();
}

struct Interval {  // with the box's reach on both sides
  double low, high;
  std::size_t box;
};

std::vector<Interval> sorted_intervals(const std::vector<Bounds>& boxes, const std::vector<double>& reaches) {
  const int axis = widest_axis(boxes);
  std::vector<Interval> intervals;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const double low = boxes[i].low[axis];
    const double high = boxes[i].high[axis];
    const double reach = reaches[i] + rounding_of_ends * (std::abs(low) + std::abs(high));
    // What diverges is not a number, which has no place in an order.
    const bool known = !std::isnan(low - reach) && !std::isnan(high + reach);
    intervals.push_back({known ? low - reach : -infinity, known ? high + reach : infinity, i});
  }
  std::sort(intervals.begin(), intervals.end(), [](const Interval& a, const Interval& b) { return a.low < b.low; });
  return intervals;
}

std::vector<Bounds> piece_bounds(const CollisionShape& body, const btTransform& pose) {
  if (!body.shape->isCompound()) return {bounds_of(*body.shape, pose)};
  std::vector<Bounds> bounds;
  for (const ConvexPiece& piece : body.pieces) bounds.push_back(bounds_of(*piece.shape, piece.pose(pose)));
  return bounds;
}

// The root of a compound's tree; null where there is nothing to choose from.
const btDbvtNode* tree_of(const CollisionShape& body) {
  if (!body.shape->isCompound()) return nullptr;
  return static_cast<const btCompoundShape&>(*body.shape).getDynamicAabbTree()->m_root;
}

// The order of contacts is that of sums in the solver, and so of bits.
void add_leaves(const btDbvtNode* a, const btDbvtNode* b, std::vector<PieceIndices>& pieces) {
  const bool splits_a = a && a->isinternal(), splits_b = b && b->isinternal();
  if (!splits_a && !splits_b) {
    const auto index = [](const btDbvtNode* leaf) { return static_cast<std::size_t>(leaf ? leaf->dataAsInt : 0); };
    pieces.push_back({index(a), index(b)});
    return;
  }
  for (int j = splits_b ? 1 : 0; j >= 0; --j) {
    for (int i = splits_a ? 1 : 0; i >= 0; --i) {
      add_leaves(splits_a ? a->childs[i] : a, splits_b ? b->childs[j] : b, pieces);
    }
  }
}

int rank(const CollisionShape& body) { return body.shape->isCompound() ? 0 : body.pieces.empty() ? 2 : 1; }

}  // namespace

std::vector<std::pair<std::size_t, std::size_t>> near_pairs(const std::vector<Bounds>& boxes,
                                                            const std::vector<double>& reaches) {
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  const std::vector<Interval> intervals = sorted_intervals(boxes, reaches);
  for (auto one = intervals.begin(); one != intervals.end(); ++one) {
    for (auto other = one + 1; other != intervals.end() && other->low <= one->high; ++other) {
      const auto [a, b] = std::minmax(one->box, other->box);
      if (gap_of(boxes[a], boxes[b]) <= reaches[a] + reaches[b]) pairs.emplace_back(a, b);
    }
  }
  return pairs;
}

bool comes_first(const CollisionShape& b, const CollisionShape& a) { return rank(b) < rank(a); }

std::vector<PieceIndices> all_pieces(const CollisionShape& a, const CollisionShape& b) {
  std::vector<PieceIndices> pieces;
  const auto is_empty = [](const CollisionShape& body) { return body.shape->isCompound() && body.pieces.empty(); };
  if (!is_empty(a) && !is_empty(b)) add_leaves(tree_of(a), tree_of(b), pieces);
  return pieces;
}

NearPieces::NearPieces(const CollisionShape& a, const btTransform& pose_a, const CollisionShape& b,
                       const btTransform& pose_b)
    : in_world_a_(piece_bounds(a, pose_a)), in_world_b_(piece_bounds(b, pose_b)) {
  const btTransform from_b = pose_a.inverse() * pose_b;
  for (const ConvexPiece& piece : a.pieces) in_a_.push_back(bounds_of(*piece.shape, piece.in_body));
  if (!b.shape->isCompound()) {
    b_in_a_ = {bounds_of(*b.shape, from_b)};
    return;
  }
  for (const ConvexPiece& piece : b.pieces) {
    Bounds bounds = bounds_of(*piece.shape, piece.in_body);
    btTransformAabb(bounds.low, bounds.high, 0.0, from_b, bounds.low, bounds.high);
    b_in_a_.push_back(bounds);
  }
}

}  // namespace energymargin
