#include "physics/contacts/collision_pairs.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "physics/contacts/patches.hpp"
#include "physics/contacts/plane_contacts.hpp"

namespace energymargin {
namespace {

constexpr double most_friction = 10.0;      // Bullet's own bound: a slope of 84 deg
constexpr double rounding_of_ends = 1e-12;  // of an interval's ends, a share of them
constexpr double blocked = 1e-3;            // share of a motion
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

void add_bounds(const CollisionShape& body, const btTransform& pose, std::vector<Bounds>& bounds) {
  if (!body.shape->isCompound()) return bounds.push_back(bounds_of(*body.shape, pose));
  for (const ConvexPiece& piece : body.pieces) bounds.push_back(bounds_of(*piece.shape, piece.pose(pose)));
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

double inverse_mass_of(const Body& body) { return body.dynamic() ? 1.0 / body.mass : 0.0; }

int rank(const CollisionShape& body) { return body.shape->isCompound() ? 0 : body.pieces.empty() ? 2 : 1; }

bool precedes(const CollisionPair& pair, const CollisionPair& other) {
  return std::tie(pair.a, pair.b) < std::tie(other.a, other.b);
}

WorldPlane plane_at(const CollisionShape& body, const btTransform& pose) {
  return {static_cast<const btStaticPlaneShape&>(*body.shape), pose};
}

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

NearPieces::NearPieces(const CollisionShape& a, const btTransform& pose_a, const std::vector<Bounds>& in_world_a,
                       const CollisionShape& b, const btTransform& pose_b, const std::vector<Bounds>& in_world_b)
    : in_world_a_(in_world_a), in_world_b_(in_world_b), in_a_(a.pieces) {
  const btTransform from_b = pose_a.inverse() * pose_b;
  if (!b.shape->isCompound()) {
    b_in_a_ = {bounds_of(*b.shape, from_b)};
    return;
  }
  for (const ConvexPiece& piece : b.pieces) {
    b_in_a_.emplace_back();
    btTransformAabb(piece.bounds.low, piece.bounds.high, 0.0, from_b, b_in_a_.back().low, b_in_a_.back().high);
  }
}

CollisionPairs::CollisionPairs(const Scene& scene, const std::vector<btTransform>& poses)
    : scene_(scene),
      filter_(scene),
      poses_(poses),
      piece_bounds_(poses.size()),
      travels_(poses.size()),
      all_kept_(poses.size() <= few_bodies) {
  for (std::size_t i = 0; i < poses.size(); ++i) {
    shapes_.push_back(&scene.collision_shape(i));
    bounds_.push_back(bounds_of(*shapes_[i]->shape, poses_[i]));
    // A thin plate's contacts would reach through the next one.
    reaches_.push_back(std::min(shapes_[i]->shape->getContactBreakingThreshold(gContactBreakingThreshold),
                                scene.smallest_half_extent(i)));
    early_reaches_.push_back(std::max(reaches_[i], filter_.early_reach(i)));
  }
  if (!all_kept_) {
    found_.resize(poses.size() * poses.size());
    return;
  }
  for (std::size_t a = 0; a < poses.size(); ++a) {
    for (std::size_t b = a + 1; b < poses.size(); ++b) {
      if (filter_(a, b)) add(a, b);
    }
  }
}

void CollisionPairs::forget() {
  for (CollisionPair& pair : pairs_) {
    drop(pair);
    for (PiecePair& pieces : pair.pieces) pieces.forget();
  }
  points_.clear();
  if (all_kept_) return;
  pairs_.clear();
  std::fill(found_.begin(), found_.end(), false);
}

void CollisionPairs::update(const std::vector<Velocity>& velocities, double duration) {
  set_bounds();
  velocities_ = &velocities;
  duration_ = until_touch_ = duration;
  points_.clear();
  groups_.clear();
  for (CollisionPair& pair : pairs_) {
    if (pair.gap <= pair.near.reach()) {
      detect(pair);
    } else {
      drop(pair);
    }
  }
  drop_seams();
}

const std::vector<Bounds>& CollisionPairs::pieces_at(std::size_t body) {
  std::vector<Bounds>& bounds = piece_bounds_[body];
  if (bounds.empty()) add_bounds(*shapes_[body], poses_[body], bounds);
  return bounds;
}

// `find` sets the gaps of pairs that it adds.
void CollisionPairs::set_bounds() {
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    if (scene_.bodies()[i].fixed()) continue;
    bounds_[i] = bounds_of(*shapes_[i]->shape, poses_[i]);
    piece_bounds_[i].clear();
  }
  for (CollisionPair& pair : pairs_) pair.gap = gap_of(bounds_[pair.a], bounds_[pair.b]);
  find(early_reaches_);
}

void CollisionPairs::find(const std::vector<double>& reaches) {
  if (all_kept_) return;
  const auto known = static_cast<std::ptrdiff_t>(pairs_.size());
  for (const auto& [a, b] : near_pairs(bounds_, reaches)) {
    const std::size_t number = a * poses_.size() + b;
    if (found_[number]) continue;
    found_[number] = true;
    if (filter_(a, b)) add(a, b);
  }
  std::sort(pairs_.begin() + known, pairs_.end(), precedes);
  std::inplace_merge(pairs_.begin(), pairs_.begin() + known, pairs_.end(), precedes);
}

void CollisionPairs::add(std::size_t a, std::size_t b) {
  const bool swaps = comes_first(*shapes_[b], *shapes_[a]);
  const ContactReach near{contact_reach(a, b), std::max(filter_.early_reach(a), filter_.early_reach(b)),
                          filter_.compliant(a, b), scene_.contact_surface(a, b).patch_radius};
  const std::size_t first = swaps ? b : a, second = swaps ? a : b;
  const double of_first = inverse_mass_of(scene_.bodies()[first]);
  const double of_second = inverse_mass_of(scene_.bodies()[second]);
  const double share = of_first > 0.0 ? of_first / (of_first + of_second) : 0.0;
  pairs_.push_back({a, b, first, second, near, std::min(scene_.contact_friction(a, b), most_friction),
                    scene_.contact_surface(a, b).restitution > 0.0, share, gap_of(bounds_[a], bounds_[b])});
}

std::vector<std::pair<std::size_t, std::size_t>> CollisionPairs::near() {
  set_bounds();
  std::vector<std::pair<std::size_t, std::size_t>> bodies;
  for (const CollisionPair& pair : pairs_) {
    if (pair.gap <= pair.near.depth) bodies.emplace_back(pair.a, pair.b);
  }
  return bodies;
}

void CollisionPairs::detect(CollisionPair& pair) {
  const std::size_t a = pair.first, b = pair.second;
  const CollisionShape &of_a = *shapes_[a], &of_b = *shapes_[b];
  const bool on_plane = of_b.pieces.empty();
  if (pair.order.empty()) {
    pair.order = all_pieces(of_a, of_b);
    for (const PieceIndices& at : pair.order) {
      if (!on_plane) pair.solids.emplace_back(*of_a.pieces[at.a].shape, *of_b.pieces[at.b].shape);
    }
  }
  pair.remembers = true;
  std::optional<NearPieces> near;
  if (of_a.shape->isCompound()) near.emplace(of_a, poses_[a], pieces_at(a), of_b, poses_[b], pieces_at(b));
  const Ways ways{sweep(a, (*velocities_)[a], duration_), sweep(b, (*velocities_)[b], duration_)};
  for (std::size_t k = 0; k < pair.order.size(); ++k) {
    const PieceIndices& at = pair.order[k];
    if (near && near->apart(at, pair.near.early)) {
      if (!on_plane) pair.solids[k].forget();
      continue;
    }
    if (near && !near->meet(at, pair.near.early)) continue;
    add_points(pair, k, ways);
  }
}

const std::vector<FacePoint>& CollisionPairs::points_of(CollisionPair& pair, std::size_t k, const btTransform& pose_a,
                                                        const btTransform& pose_b, btVector3& normal) {
  const ConvexPiece& piece = shapes_[pair.first]->pieces[pair.order[k].a];
  const CollisionShape& of_b = *shapes_[pair.second];
  if (!of_b.pieces.empty()) {
    const btTransform at_b = of_b.pieces[pair.order[k].b].pose(pose_b);
    return faces_.contacts(pair.solids[k], piece.pose(pose_a), at_b, pair.near, normal);
  }
  const WorldPlane plane = plane_at(of_b, pose_b);
  normal = plane.normal;
  find_plane_contacts(InnerShape(*piece.shape), piece.pose(pose_a), plane, pair.near.reach(), on_plane_);
  if (pair.near.patch > 0.0) spread(on_plane_, normal, pair.near.patch);
  return on_plane_;
}

void CollisionPairs::add_points(CollisionPair& pair, std::size_t k, const Ways& ways) {
  btVector3 normal;
  const double share = look_ahead(pair, k, ways, normal);
  const bool on_plane = pair.solids.empty();
  const std::vector<FacePoint>& points = on_plane ? on_plane_ : faces_.points();
  const std::size_t begin = points_.size();
  const auto back = [share](const Sweep& way) {
    return share > 0.0 ? way.start * way.at(share).inverse() : btTransform::getIdentity();
  };
  const btTransform back_a = back(ways.a), back_b = back(ways.b);
  for (const FacePoint& point : points) {
    if (point.distance > pair.near.reach()) continue;
    btVector3 on_a = point.on_b + normal * point.distance, on_b = point.on_b;
    // Friction of a blow acts on the body that comes: across a gap, or after one too long a step, the levers differ.
    btVector3 grip = point.grip + normal * (point.distance * pair.gap_share);
    double distance = point.distance;
    if (share > 0.0) {
      on_a = back_a(on_a);
      on_b = back_b(on_b);
      grip = back_b(point.grip) + (on_a - on_b) * pair.gap_share;
      distance = normal.dot(on_a - on_b);
    }
    points_.push_back({pair.first, pair.second, on_a, on_b, grip, normal, distance, pair.friction, point.lever});
    if (!on_plane && faces_.edge()) edges_.push_back({points_.size() - 1, *faces_.edge()});
  }
  if (points_.size() > begin) groups_.push_back({begin, points_.size(), &pair, k});
}

void CollisionPairs::drop(CollisionPair& pair) {
  if (!pair.remembers) return;
  for (SolidPair& solids : pair.solids) solids.forget();
  pair.remembers = false;
}

std::optional<ClosestPoints> CollisionPairs::closest(std::size_t a, std::size_t b, double reach) const {
  if (comes_first(*shapes_[b], *shapes_[a])) {
    std::optional<ClosestPoints> least = closest(b, a, reach);
    if (least) *least = {-least->normal, least->on_b + least->normal * least->distance, least->distance};
    return least;
  }
  const CollisionShape &of_a = *shapes_[a], &of_b = *shapes_[b];
  std::optional<ClosestPoints> least;
  if (of_a.pieces.empty()) return least;  // two planes, or nothing
  const double within = contact_reach(a, b) + reach;
  const auto take = [&](const std::optional<ClosestPoints>& points) {
    if (points && points->distance <= within && (!least || points->distance < least->distance)) least = points;
  };
  std::optional<NearPieces> near;
  std::vector<Bounds> bounds_a, bounds_b;
  if (of_a.shape->isCompound() && reach == 0.0) {
    add_bounds(of_a, poses_[a], bounds_a);
    add_bounds(of_b, poses_[b], bounds_b);
    near.emplace(of_a, poses_[a], bounds_a, of_b, poses_[b], bounds_b);
  }
  for (const PieceIndices& at : all_pieces(of_a, of_b)) {
    if (near && (near->apart(at, 0.0) || !near->meet(at, 0.0))) continue;
    const btConvexShape& solid = *of_a.pieces[at.a].shape;
    const btTransform pose_a = of_a.pieces[at.a].pose(poses_[a]);
    if (of_b.pieces.empty()) {
      take(closest_to_plane(InnerShape(solid, Edges::sharp), pose_a, plane_at(of_b, poses_[b])));
    } else {
      const ConvexPiece& other = of_b.pieces[at.b];
      take(sharp_closest(solid, pose_a, *other.shape, other.pose(poses_[b]), within));
    }
  }
  return least;
}

// The base of a tree moves as a free body does; a link's velocity turns with it.
Sweep CollisionPairs::sweep(std::size_t body, const Velocity& velocity, double duration) const {
  const bool on_joint = scene_.joint_to(body).has_value();
  return {poses_[body], velocity.linear * duration, velocity.angular * duration, on_joint};
}

void CollisionPairs::add_meeting(const CollisionPair& pair, PiecePair& pieces, const Sweep& a, const Sweep& b) {
  const std::optional<PiecePair::Meeting> met = pieces.meeting(a, b);
  if (!met) return;
  const double distance = met->normal.dot(met->on_a - met->on_b);
  const btVector3 middle = 0.5 * (met->on_a + met->on_b), half = met->normal * (0.5 * distance);
  const btVector3 on_a = middle + half, on_b = middle - half;
  const double share = pair.a == pair.first ? pair.gap_share : 1.0 - pair.gap_share;
  blocking_.push_back({pair.a, pair.b, on_a, on_b, on_b + (on_a - on_b) * share, met->normal, distance, pair.friction});
}

bool CollisionPairs::add_blocking() {
  points_.insert(points_.end(), blocking_.begin(), blocking_.end());
  const bool adds = !blocking_.empty();
  blocking_.clear();
  return adds;
}

double CollisionPairs::safe_share(const std::vector<Velocity>& velocities, double duration) {
  for (std::size_t i = 0; i < shapes_.size(); ++i) {
    const Velocity& velocity = velocities[i];
    travels_[i] = duration * (velocity.linear.length() + velocity.angular.length() * shapes_[i]->reach);
  }
  find(travels_);
  blocking_.clear();
  double share = 1.0;
  for (CollisionPair& pair : pairs_) {
    const double motion = travels_[pair.a] + travels_[pair.b];
    if (!(pair.gap <= motion && std::isfinite(motion))) continue;  // a state will tell what is not finite
    const std::vector<ConvexPiece>&pieces_a = shapes_[pair.a]->pieces, &pieces_b = shapes_[pair.b]->pieces;
    if (pair.pieces.empty()) {
      for (const ConvexPiece& of_a : pieces_a) {
        for (const ConvexPiece& of_b : pieces_b) pair.pieces.emplace_back(of_a, of_b, pair.near.compliant);
      }
    }
    if (pair.pieces.empty()) continue;
    const Sweep sweep_a = sweep(pair.a, velocities[pair.a], duration);
    const Sweep sweep_b = sweep(pair.b, velocities[pair.b], duration);
    const std::vector<Bounds>&bounds_a = pieces_at(pair.a), &bounds_b = pieces_at(pair.b);
    for (std::size_t i = 0; i < pair.pieces.size(); ++i) {
      if (gap_of(bounds_a[i / bounds_b.size()], bounds_b[i % bounds_b.size()]) > motion) continue;
      const Sweep first_a = sweep_a.first(share), first_b = sweep_b.first(share);
      const double safe = pair.pieces[i].safe_share(first_a, first_b);
      if (safe < blocked) add_meeting(pair, pair.pieces[i], first_a, first_b);
      share *= safe;
    }
  }
  return share;
}

}  // namespace energymargin
