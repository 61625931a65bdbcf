#pragma once
// Links that hang together: where they are and how they move.

#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include <memory>
#include <optional>
#include <vector>

#include "energymargin/scene.hpp"
#include "energymargin/state.hpp"
#include "physics/bodies/joint_control.hpp"
#include "physics/bodies/spatial.hpp"
#include "physics/motion.hpp"
#include "physics/shapes.hpp"

namespace energymargin {

//! A free body has six velocities: three linear ones of its centre of mass, and three angular ones.
inline constexpr int velocities_of_free_body = 6;

//! A tree of links on its base: a free body, or a fixed one that stays what it is outside of the tree. Its velocities
//! are those of a free base, then those of the joints that move.
class Articulation {
 public:
  //! The base or a link; where it is, is its frame at the centre of mass, along its principal axes.
  struct Link {
    std::size_t body;                    // in the scene
    int parent = -1;                     // among the links
    std::optional<std::size_t> joint{};  // in the scene; the base has none
    bool slides = false;
    int velocity = -1;       // of its joint; -1: rigid, as it is fixed, held, or follows a held joint
    int last_velocity = -1;  // of the nearest joint that moves, its own or above it, or of the base
    double mass = 0.0;
    btVector3 moments{};                            // of inertia
    btMatrix3x3 turn = btMatrix3x3::getIdentity();  // from its axes to the parent's, at position 0
    btVector3 axis{}, pivot{}, arm{};               // of its joint; pivot in the parent's frame; to its centre
    double position = 0.0;                          // of its joint
    double armature = 0.0;                          // of its joint [kg m^2] or [kg]
    btTransform pose = btTransform::getIdentity();
    btVector3 hinge{};                                                  // where its joint is, in the world
    btVector3 force = btVector3(0, 0, 0), torque = btVector3(0, 0, 0);  // on it in the next substep
  };

  //! The links on a free body `base`, or those on one fixed body that hang on joint `first`.
  //! The scene outlives this.
  Articulation(const Scene& scene, std::size_t base, std::optional<std::size_t> first);
  Articulation(const Articulation&) = delete;
  Articulation& operator=(const Articulation&) = delete;

  //! With the index of their body in the scene as user index.
  const std::vector<std::unique_ptr<btMultiBodyLinkCollider>>& colliders() const { return colliders_; }

  //! The base first, parents before their children.
  const std::vector<Link>& links() const { return links_; }
  int link_of(const btCollisionObject& collider) const {
    return static_cast<const btMultiBodyLinkCollider&>(collider).m_link + 1;
  }
  bool free() const { return free_; }

  //! The body that it hangs on.
  std::size_t base() const { return links_.front().body; }

  //! Whether no force changes how its base, a free one, moves.
  bool kinematic() const { return free_ && scene_.bodies()[links_.front().body].kinematic; }

  //! Joints with a drive or stops of their own.
  std::vector<JointControl>& controls() { return controls_; }

  //! Index of a joint's link, if it is here.
  std::optional<int> link_on(std::size_t joint) const;

  std::vector<double>& velocities() { return velocities_; }
  const std::vector<double>& velocities() const { return velocities_; }

  //! The common point of the tree's spatial vectors.
  const btVector3& origin() const { return links_[free_ ? 0 : 1].pose.getOrigin(); }

  //! Motion by a velocity of 1, of each of the tree's.
  const std::vector<SpatialVector>& motions() const { return motions_; }

  //! The velocity above another one in the tree; -1 above the first ones.
  int above(int velocity) const { return above_[static_cast<std::size_t>(velocity)]; }

  //! Motion of each link at these velocities of the tree.
  const std::vector<SpatialVector>& link_motions(const std::vector<double>& velocities) const;

  void restore(const State& state);
  void read(State& state) const;

  //! What these velocities of the tree are for the links and a free base, each at the index of its body in the scene.
  void read(const std::vector<double>& from, std::vector<Velocity>& velocities) const;

  //! Velocity of the point of a body of the tree that is at `point` in the world, at these velocities of the tree.
  btVector3 velocity(const btCollisionObject& body, const btVector3& point,
                     const std::vector<double>& velocities) const;

  //! A wrench in the next substep, at the centre of mass of a body of the tree.
  void apply(const btCollisionObject& body, const btVector3& force, const btVector3& torque);
  void clear_loads();

  //! The velocities at which it goes in this substep.
  std::vector<double>& ways() { return ways_; }
  const std::vector<double>& ways() const { return ways_; }

  //! Moves all on their ways, for a share of `duration` [s]; a kinematic base loses no time.
  void move(double duration, double share);

  //! Moves all with its free base, which is here then.
  void put_base(const btTransform& pose);

  //! Puts the links, but for what collides, a way off from where they are [m, rad], until `put_back`: along each
  //! velocity, and for a free base by a turn about an axis that stays.
  void put_off(const std::vector<double>& way);
  void put_back();

 private:
  void add_links(std::size_t parent, int parent_link, std::optional<std::size_t> only);
  Link link(std::size_t joint, int parent_link) const;
  void add_velocity(Link& link);
  void add_collider(int link);
  void place_colliders();
  void place_links();
  void set_motions();

  const Scene& scene_;
  StateLayout layout_;
  bool free_;
  std::vector<Link> links_;
  std::vector<JointControl> controls_;
  std::vector<std::unique_ptr<btMultiBodyLinkCollider>> colliders_;
  std::vector<double> velocities_, ways_;
  btTransform base_pose_;          // while the links are put off
  std::vector<double> positions_;  // of all links, then
  std::vector<int> above_;
  std::vector<SpatialVector> motions_;
  mutable std::vector<SpatialVector> link_motions_;
};

}  // namespace energymargin
