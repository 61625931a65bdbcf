#include <algorithm>
#include <cmath>

#include "bounds/barrier_bound.hpp"
#include "bounds/convex_piece.hpp"
#include "scene/energy.hpp"
#include "scene/scene_checks.hpp"

namespace energymargin::bounds {
namespace {

constexpr double closed = 1e-6;    // m and rad: ends of a loop so near are together
constexpr double parallel = 1e-9;  // of a load and the normal of the plane under it

bool at_rest(const Problem& problem, std::size_t body) {
  const BodyState at = StateLayout::read(problem.state.data() + StateLayout(problem.scene).offset(body));
  return at.velocity.isZero(0.0) && at.angular_velocity.isZero(0.0);
}

bool stays(const Problem& problem, std::size_t body) {
  const Scene& scene = problem.scene;
  if (const auto above = scene.joint_to(body)) {
    const Joint& joint = scene.joints()[*above];
    const bool rigid = joint.type == JointType::fixed || (joint.held && !joint.mimic && !problem.plan);
    return rigid && stays(problem, scene.index(joint.parent));
  }
  const Body& of = scene.bodies()[body];
  if (of.kinematic) return !problem.plan && at_rest(problem, body);
  return of.fixed() || (of.linear_factor.isZero(0.0) && of.angular_factor.isZero(0.0));
}

// What the bodies other than the object can give, each on its own.
class Stores {
 public:
  explicit Stores(const Subject& subject)
      : subject_(subject), problem_(subject.problem), scene_(problem_.scene), immovable_(subject.immovable) {}

  AvailableEnergy sum() {
    energy_.kinetic = std::max(Energy(scene_).kinetic(problem_.state, State::Zero(problem_.state.size())), 0.0);
    add_driven();
    for (const Spring& spring : scene_.springs()) add(spring);
    for (std::size_t joint = 0; joint < scene_.joints().size(); ++joint) {
      if (scene_.joints()[joint].moves() && !scene_.joints()[joint].held)
        add_control(joint, scene_.joints()[joint].name);
    }
    for (std::size_t i = 0; i < scene_.tendons().size(); ++i) {
      add_control(scene_.joints().size() + i, scene_.tendons()[i].name);
    }
    for (std::size_t body = 0; body < scene_.bodies().size(); ++body) {
      if (body != subject_.object && !immovable_[body] && scene_.bodies()[body].dynamic()) add_weight(body);
    }
    add_beyond();
    add_overlaps();
    return energy_;
  }

 private:
  void without_end(const std::string& reason) {
    if (energy_.reason.empty()) energy_.reason = reason;
    energy_.stored = infinity;
  }

  Vector3 load(std::size_t body) const {
    const Body& of = scene_.bodies()[body];
    return of.linear_factor.cwiseProduct(of.mass * scene_.gravity() + of.force);
  }

  // An effector in "drive" that is at rest is stopped again and again, which takes energy out.
  void add_driven() {
    if (problem_.plan) without_end("the robot follows a plan, which may do work");
    for (std::size_t body = 0; body < scene_.bodies().size(); ++body) {
      if (!scene_.bodies()[body].kinematic || immovable_[body]) continue;
      without_end("'" + scene_.bodies()[body].name + "' is kinematic and moves, which does work");
    }
    for (const Body& body : scene_.bodies()) {
      if (!body.surface_velocity.isZero(0.0)) without_end("the surface of '" + body.name + "' moves, which does work");
      if (body.surface && body.surface->stiffness > 0.0)
        without_end("the surface of '" + body.name + "' gives way, and stores energy");
    }
    if (problem_.effector == Effector::coast) return;
    for (const std::size_t body : scene_.with_role(Role::effector)) {
      if (immovable_[body]) continue;
      const BodyState moving = subject_.at(body);
      if (moving.velocity.isZero(0.0) && moving.angular_velocity.isZero(0.0)) continue;
      without_end("'" + scene_.bodies()[body].name + "' is in \"drive\", which does work");
    }
  }

  // Springs between the object and what stays are part of the object's own potential energy.
  void add(const Spring& spring) {
    const std::size_t a = scene_.index(spring.body_a);
    const std::size_t b = scene_.index(spring.body_b);
    if ((a == subject_.object && immovable_[b]) || (b == subject_.object && immovable_[a])) return;
    const BodyState at_a = subject_.at(a), at_b = subject_.at(b);
    const Vector3 span =
        at_b.position + at_b.orientation * spring.point_b - at_a.position - at_a.orientation * spring.point_a;
    energy_.stored += 0.5 * spring.stiffness * std::pow(span.norm() - spring.rest_length, 2);
  }

  void add_control(std::size_t index, const std::string& name) {
    const PositionControl& control = scene_.control(index);
    const double position = StateLayout(scene_).controlled(problem_.state.data(), index).position;
    energy_.stored += compliance_energy(control, position);
    if (control.target_velocity != 0.0 && control.damping != 0.0) {
      without_end("the drive of '" + name + "' has a target velocity, and does work");
    }
  }

  // How far a body can fall along what pulls at it, times that.
  void add_weight(std::size_t body) {
    const Vector3 pull = load(body);
    if (pull.isZero(0.0)) return;
    const double way = scene_.joint_to(body) ? fall_of_link(body, pull.normalized()) : fall(body, pull.normalized());
    if (std::isinf(way)) {
      without_end("'" + scene_.bodies()[body].name + "' may fall without end, and its weight lift the object");
    } else {
      energy_.stored += pull.norm() * way;
    }
  }

  // Down to a plane that it can not pass, which its centre of mass comes no nearer to than its thickness there.
  double fall(std::size_t body, const Vector3& down) const {
    const Body& of = scene_.bodies()[body];
    const BodyState here = subject_.at(body);
    const Vector3 center = scene_.inertial(body).center;
    double least = infinity;
    for (std::size_t other = 0; other < scene_.bodies().size(); ++other) {
      const auto* plane = std::get_if<Plane>(&scene_.bodies()[other].shape);
      const std::pair<std::string, std::string> names = std::minmax(of.name, scene_.bodies()[other].name);
      if (!plane || !immovable_[other] || scene_.disabled_collisions().count(names) > 0) continue;
      const BodyState ground = subject_.at(other);
      const Vector3 normal = ground.orientation * plane->normal;
      if ((normal + down).norm() > parallel) continue;
      double thickness = -infinity;
      for (const ConvexPiece& piece : convex_pieces(of.shape, Pose{}, scene_.stepping().margin)) {
        const Vector3 lowest = piece.support(here.orientation.conjugate() * down);
        const double below = down.dot(here.orientation * (lowest - center));
        thickness = std::max(thickness, of.angular_factor.isZero(0.0) ? below : piece.depth(center));
      }
      const double height = normal.dot(here.position + here.orientation * center - ground.position) - plane->offset;
      least = std::min(least, std::max(height - thickness, 0.0));
    }
    return least;
  }

  // A link stays within the lengths of the links from the first joint that moves, which hangs on what stays.
  double fall_of_link(std::size_t body, const Vector3& down) const {
    const BodyState link = subject_.at(body);
    const Vector3 center = link.position + link.orientation * scene_.inertial(body).center;
    Vector3 point = center;
    double length = 0.0;
    for (std::size_t below = body;;) {
      const auto above = scene_.joint_to(below);
      if (!above) return infinity;  // the tree moves freely
      const Joint& joint = scene_.joints()[*above];
      const BodyState child = subject_.at(below);
      const Vector3 origin = child.position + child.orientation * joint.in_child.position;
      length += (point - origin).norm();
      if (joint.type == JointType::prismatic) length += joint.mimic ? infinity : joint.upper - joint.lower;
      point = origin;
      below = scene_.index(joint.parent);
      if (immovable_[below]) break;
    }
    return std::max(length - down.dot(center - point), 0.0);
  }

  // What begins beyond a stop, or apart from what it is tied to, is pulled home, and lifts what rests on it.
  void add_beyond() {
    const StateLayout layout(scene_);
    for (std::size_t i = 0; i < scene_.joints().size(); ++i) {
      const Joint& joint = scene_.joints()[i];
      if (!joint.moves() || beyond_limits(joint, layout.joint(problem_.state.data(), i).position) == 0.0) continue;
      without_end("joint '" + joint.name + "' begins beyond its limit, which pushes it back");
    }
    for (const Loop& loop : scene_.loops()) {
      const BodyState a = state_at_point(loop.point_a, subject_.at(scene_.index(loop.body_a)));
      const BodyState b = state_at_point(loop.point_b, subject_.at(scene_.index(loop.body_b)));
      const double turn = (a.orientation * loop.orientation_a).angularDistance(b.orientation * loop.orientation_b);
      if ((a.position - b.position).norm() <= closed && !(loop.type == LoopType::weld && turn > closed)) continue;
      without_end("the ends of loop '" + loop.body_a + "' - '" + loop.body_b +
                  "' begin apart, and are pulled together");
    }
  }

  // Bodies that overlap at the start are pushed apart, each by no more than the overlaps below it, against their loads.
  void add_overlaps() {
    const double deepest = std::max(-deepest_contact(scene_, problem_.state).distance, 0.0);
    if (deepest == 0.0) return;
    double pull = 0.0, bodies = 0.0;
    for (std::size_t body = 0; body < scene_.bodies().size(); ++body) {
      if (immovable_[body]) continue;
      pull += load(body).norm();
      bodies += 1.0;
    }
    energy_.stored += bodies * deepest * pull;
  }

  const Subject& subject_;
  const Problem& problem_;
  const Scene& scene_;
  const std::vector<bool>& immovable_;
  AvailableEnergy energy_;
};

}  // namespace

Subject::Subject(const Problem& of, std::size_t index) : problem(of), object(index), kinematics(of.scene) {
  for (std::size_t other = 0; other < of.scene.bodies().size(); ++other) immovable.push_back(stays(of, other));
}

AvailableEnergy available_energy(const Subject& subject) { return Stores(subject).sum(); }

}  // namespace energymargin::bounds
