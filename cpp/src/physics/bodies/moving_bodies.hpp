#pragma once
// All bodies of a scene: those on their own, and trees of links.

#include <algorithm>
#include <memory>
#include <optional>
#include <vector>

#include "energymargin/kinematics.hpp"
#include "physics/bodies/articulation.hpp"

namespace energymargin {

//! A body that moves and hangs on no joint.
struct FreeBody {
  std::size_t body;  // in the scene
  int offset;        // in a state
  bool kinematic;
  double inverse_mass;      // 0: kinematic [1/kg]
  btVector3 moments;        // principal [kg m^2]
  btVector3 linear_factor;  // 1: free along the axis, 0: locked
  btVector3 angular_factor;
  btVector3 acceleration;    // of gravity and the body's constant force [m/s^2]
  btVector3 held;            // what these would be along locked axes, which bear it [m/s^2]
  std::vector<int> axes{};   // of the equations: 0..2 linear, 3..5 angular; none of a kinematic body
  std::size_t unlocked = 0;  // so many are not locked, and come first; others are released for a substep
  Velocity velocity{};
  btVector3 force = btVector3(0, 0, 0), torque = btVector3(0, 0, 0);  // on it in the next substep
  Velocity way{};                                                     // at which it goes in this substep

  // In the equations of the substep:
  int mover = -1;                          // of the solver; -1: kinematic
  btVector3 turning = btVector3(0, 0, 0);  // angular acceleration as it coasts [rad/s^2]
  Velocity pushed{};                       // after loads and impulses, before it coasts
  btVector3 spin = btVector3(0, 0, 0);     // angular velocity at the end of the substep [rad/s]
};

//! A link, or the free base of a tree.
struct TreeLink {
  std::size_t tree;
  int link;
};

//! A sum of joints' positions, each times a coefficient: joints of one tree, or of two.
struct JointSum {
  struct Term {
    TreeLink link;
    double coefficient;
  };
  std::vector<Term> terms{};

  //! Whether it has a joint of a tree.
  bool has(std::size_t tree) const {
    return std::any_of(terms.begin(), terms.end(), [tree](const Term& term) { return term.link.tree == tree; });
  }
};

//! A joint that follows another one: the sum is constant.
struct MimicConstraint : JointSum {
  double constant;
};

//! A tendon, whose length is the sum.
struct TendonControl : JointSum, Control {
  const Tendon* tendon;  // the scene's
};

//! A frame of one body that stays at one of another: the scene's loop, by the bodies' centres and principal axes.
struct LoopConstraint {
  bool weld;
  std::size_t a, b;
  btTransform in_a, in_b;
};

//! Where the bodies are, how they move and what acts on them.
class MovingBodies {
 public:
  //! The scene outlives this.
  explicit MovingBodies(const Scene& scene)
      : scene_(scene),
        poses_(scene.bodies().size(), btTransform::getIdentity()),
        free_of_(scene.bodies().size(), nullptr),
        links_(scene.bodies().size()) {
    const StateLayout layout(scene);
    free_.reserve(scene.bodies().size());
    for (std::size_t i = 0; i < scene.bodies().size(); ++i) {
      if (!scene.bodies()[i].fixed() && scene.jointed(i)) continue;
      poses_[i] = bullet_pose(scene.inertial(i), scene.bodies()[i].state);
      if (!scene.bodies()[i].fixed()) add_free(i, layout.offset(i));
    }
    add_trees();
    add_sums();
    add_loops();
    for (std::size_t i = 0; i < scene.bodies().size(); ++i) {
      const Vector3& force = scene.bodies()[i].force;
      if (links_[i] && !force.isZero(0.0)) link_loads_.push_back({i, to_bullet(force), btVector3(0, 0, 0)});
    }
  }
  MovingBodies(const MovingBodies&) = delete;  // the trees refer to the poses
  MovingBodies& operator=(const MovingBodies&) = delete;

  //! Bullet's frames of all bodies, in the scene's order.
  const std::vector<btTransform>& poses() const { return poses_; }

  std::vector<FreeBody>& free() { return free_; }

  //! Whether a body that is free, and that forces move, has a locked axis.
  bool locks() const {
    return std::any_of(free_.begin(), free_.end(),
                       [](const FreeBody& body) { return !body.kinematic && body.unlocked < velocities_of_free_body; });
  }

  //! Null for one that is fixed or on a tree.
  FreeBody* free(std::size_t body) const { return free_of_[body]; }

  const std::vector<std::unique_ptr<Articulation>>& trees() const { return trees_; }

  //! In groups that share no tree.
  const std::vector<std::vector<MimicConstraint>>& mimics() const { return mimics_; }
  const std::vector<TendonControl>& tendons() const { return tendons_; }
  const std::vector<LoopConstraint>& loops() const { return loops_; }

  //! Where a body is in a tree, if it is in one.
  const std::optional<TreeLink>& link(std::size_t body) const { return links_[body]; }

  //! Puts all bodies where a state says; nothing of the past is left.
  void restore(const State& state) {
    put(state);
    for (const auto& tree : trees_) tree->forget();
    for (TendonControl& tendon : tendons_) tendon.target = tendon.tendon->target;
  }

  //! Puts all bodies where a state says, with those velocities.
  void put(const State& state) {
    for (FreeBody& each : free_) {
      const Inertial& inertial = scene_.inertial(each.body);
      const BodyState frame = StateLayout::read(state.data() + each.offset);
      const BodyState center = state_at_point(inertial.center, frame);
      poses_[each.body] = bullet_pose(inertial, frame);
      each.velocity = {to_bullet(center.velocity), to_bullet(center.angular_velocity)};
    }
    for (const auto& tree : trees_) tree->put(state);
  }

  //! Writes the bodies' numbers into a state of the scene's dimension.
  void read(State& state) const {
    for (const FreeBody& each : free_) {
      const BodyState frame = frame_state(scene_.inertial(each.body), poses_[each.body],
                                          from_bullet(each.velocity.linear), from_bullet(each.velocity.angular));
      StateLayout::write(frame, state.data() + each.offset);
    }
    for (const auto& tree : trees_) tree->read(state);
  }

  //! Reads the velocities of all bodies that move, by their indices, or those at which they go on their ways.
  void read(std::vector<Velocity>& velocities) const {
    for (const FreeBody& each : free_) velocities[each.body] = each.velocity;
    for (const auto& tree : trees_) tree->read(tree->velocities(), velocities);
  }
  void read_ways(std::vector<Velocity>& velocities) const {
    for (const FreeBody& each : free_) velocities[each.body] = each.way;
    for (const auto& tree : trees_) tree->read(tree->ways(), velocities);
  }

  //! Reads velocities and loads, without those of springs.
  void read(Motion& motion) const {
    const btVector3 none(0, 0, 0);
    for (const FreeBody& each : free_) {
      motion.bodies[each.body] = {each.velocity, each.kinematic ? none : each.acceleration / each.inverse_mass, none};
    }
    motion.trees.clear();
    for (const auto& tree : trees_) motion.trees.push_back(tree->velocities());
  }

  //! Velocity of the point of a body that is at `point` in the world [m/s].
  btVector3 velocity(std::size_t body, const btVector3& point) const {
    if (const auto& link = links_[body]) {
      return trees_[link->tree]->velocity(link->link, point, trees_[link->tree]->velocities());
    }
    const FreeBody* each = free(body);
    if (!each) return {0, 0, 0};
    return each->velocity.linear + each->velocity.angular.cross(point - poses_[body].getOrigin());
  }

  //! Moment of inertia of a body in the world [kg m^2].
  btMatrix3x3 inertia(const FreeBody& free) const {
    const btMatrix3x3& axes = poses_[free.body].getBasis();
    return axes.scaled(free.moments).timesTranspose(axes);
  }

  //! Only constant forces act on the bodies, beside gravity; then another wrench does.
  void clear_loads() {
    for (FreeBody& each : free_) each.force = each.torque = btVector3(0, 0, 0);
    for (const auto& tree : trees_) tree->clear_loads();
    for (const Load& load : link_loads_) apply(load);
  }
  void apply(const Load& load) {
    if (const auto& link = links_[load.body]) return trees_[link->tree]->apply(link->link, load.force, load.torque);
    FreeBody& each = *free(load.body);
    each.force += load.force;
    each.torque += load.torque;
  }

  //! Target of a joint or, beyond all joints, a tendon, until the next `restore`.
  void set_target(std::size_t index, double target) {
    if (Control* control = control_of(index)) control->target = target;
  }
  double target(std::size_t index) {
    const Control* control = control_of(index);
    return control ? control->target : scene_.control(index).target;
  }

  //! Kinematic bodies have the velocities of their motors from now on, but not along and about locked axes.
  void drive(const std::vector<Motor>& motors) {
    for (const auto& tree : trees_) tree->keep_base();
    for (const Motor& motor : motors) {
      if (const auto& link = links_[motor.body]) {
        if (trees_[link->tree]->kinematic()) trees_[link->tree]->drive_base(motor.velocity);
      } else if (FreeBody& body = *free_of_[motor.body]; body.kinematic) {
        body.velocity = {motor.velocity.linear * body.linear_factor, motor.velocity.angular * body.angular_factor};
      }
    }
  }

  //! Moves all on their ways, for a share of `duration` [s]; a kinematic body loses no time.
  void move(double duration, double share) {
    for (const FreeBody& each : free_) {
      const double moved = each.kinematic ? duration : share * duration;
      poses_[each.body] = moved_pose(poses_[each.body], each.way.linear * moved, each.way.angular * moved);
    }
    for (const auto& tree : trees_) tree->move(duration, share);
  }

  //! The body itself, or the one that its tree hangs on.
  std::size_t base_of(std::size_t body) const { return links_[body] ? trees_[links_[body]->tree]->link(0).body : body; }

  //! Moves a body, with the tree whose free base it is, with what turns about `origin` and moves like `carrier`.
  void carry(std::size_t base, const Velocity& carrier, const btVector3& origin, double duration) {
    const btVector3 linear = carrier.linear + carrier.angular.cross(poses_[base].getOrigin() - origin);
    const btTransform pose = moved_pose(poses_[base], linear * duration, carrier.angular * duration);
    if (links_[base]) return trees_[links_[base]->tree]->put_base(pose);
    poses_[base] = pose;
  }

 private:
  void add_free(std::size_t index, int offset) {
    const Body& body = scene_.bodies()[index];
    Vector3 acceleration = (scene_.gravity() + body.force / body.mass).cwiseProduct(body.linear_factor);
    const Vector3 held = scene_.gravity() + body.force / body.mass - acceleration;
    if (body.kinematic) acceleration.setZero();
    free_.push_back({index, offset, body.kinematic, body.kinematic ? 0.0 : 1.0 / body.mass,
                     to_bullet(scene_.inertial(index).moments), to_bullet(body.linear_factor),
                     to_bullet(body.angular_factor), to_bullet(acceleration), to_bullet(held)});
    free_of_[index] = &free_.back();
    for (int axis = 0; axis < 6 && !body.kinematic; ++axis) {
      const double factor = axis < 3 ? body.linear_factor[axis] : body.angular_factor[axis - 3];
      if (factor != 0.0) free_.back().axes.push_back(axis);
    }
    free_.back().unlocked = free_.back().axes.size();
  }
  // What hangs on a free body is one tree; on a fixed body each child starts a tree of its own.
  void add_trees() {
    const auto add = [&](std::size_t base, std::optional<std::size_t> first) {
      trees_.push_back(std::make_unique<Articulation>(scene_, base, first, poses_));
      const std::vector<Articulation::Link>& links = trees_.back()->links();
      for (std::size_t i = trees_.back()->free() ? 0 : 1; i < links.size(); ++i) {
        links_[links[i].body] = {trees_.size() - 1, static_cast<int>(i)};
      }
    };
    for (std::size_t i = 0; i < scene_.joints().size(); ++i) {
      const std::size_t parent = scene_.index(scene_.joints()[i].parent);
      if (scene_.bodies()[parent].fixed()) {
        add(parent, i);
      } else if (!scene_.joint_to(parent) && !links_[parent]) {
        add(parent, std::nullopt);
      }
    }
  }
  // A joint and the one that it follows may be on two trees.
  void add_sums() {
    const auto link = [this](std::size_t joint) { return *links_[scene_.index(scene_.joints()[joint].child)]; };
    for (const Tendon& tendon : scene_.tendons()) {
      TendonControl& made = tendons_.emplace_back(TendonControl{{}, {&tendon, tendon.target}, &tendon});
      for (const TendonJoint& of : tendon.joints) {
        made.terms.push_back({link(scene_.joint_index(of.joint)), of.coefficient});
      }
    }
    for (std::size_t i = 0; i < scene_.joints().size(); ++i) {
      const auto& mimic = scene_.joints()[i].mimic;
      if (!mimic) continue;
      const std::size_t followed = scene_.joint_index(mimic->joint);
      if (scene_.joints()[followed].held) continue;  // then both are rigid
      add_mimic({{{{link(i), 1.0}, {link(followed), -mimic->multiplier}}}, mimic->offset});
    }
  }
  // Joins the groups that it shares a tree with.
  void add_mimic(const MimicConstraint& mimic) {
    const auto shares_a_tree = [&](const MimicConstraint& other) {
      return std::any_of(mimic.terms.begin(), mimic.terms.end(), [&](const JointSum::Term& term) {
        return term.link.tree == other.terms[0].link.tree || term.link.tree == other.terms[1].link.tree;
      });
    };
    std::vector<MimicConstraint> joined;
    for (std::size_t i = mimics_.size(); i-- > 0;) {
      if (std::none_of(mimics_[i].begin(), mimics_[i].end(), shares_a_tree)) continue;
      joined.insert(joined.begin(), mimics_[i].begin(), mimics_[i].end());
      mimics_.erase(mimics_.begin() + static_cast<std::ptrdiff_t>(i));
    }
    joined.push_back(mimic);
    mimics_.push_back(std::move(joined));
  }
  void add_loops() {
    const auto frame = [this](std::size_t body, const Vector3& point, const Quaternion& orientation) {
      const Inertial& inertial = scene_.inertial(body);
      return bullet_pose(inertial, BodyState{}).inverse() * btTransform(to_bullet(orientation), to_bullet(point));
    };
    for (const Loop& loop : scene_.loops()) {
      const std::size_t a = scene_.index(loop.body_a), b = scene_.index(loop.body_b);
      loops_.push_back({loop.type == LoopType::weld, a, b, frame(a, loop.point_a, loop.orientation_a),
                        frame(b, loop.point_b, loop.orientation_b)});
      for (const std::size_t body : {a, b}) {
        if (links_[body]) trees_[links_[body]->tree]->close();
      }
    }
  }
  // Null for a joint without.
  Control* control_of(std::size_t index) {
    const std::size_t joints = scene_.joints().size();
    if (index >= joints) return &tendons_[index - joints];
    for (const auto& tree : trees_) {
      for (JointControl& control : tree->controls()) {
        if (control.joint == &scene_.joints()[index]) return &control;
      }
    }
    return nullptr;
  }

  const Scene& scene_;
  std::vector<btTransform> poses_;
  std::vector<FreeBody> free_;
  std::vector<FreeBody*> free_of_;  // of all bodies; null: fixed, or on a tree
  std::vector<std::unique_ptr<Articulation>> trees_;
  std::vector<std::optional<TreeLink>> links_;  // of all bodies
  std::vector<Load> link_loads_;                // constant forces on bodies of trees
  std::vector<std::vector<MimicConstraint>> mimics_;
  std::vector<TendonControl> tendons_;
  std::vector<LoopConstraint> loops_;
};

}  // namespace energymargin
