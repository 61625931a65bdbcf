#pragma once
// A Scene as a Bullet world.

#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>

#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "energymargin/world.hpp"
#include "physics/articulated/articulated_bodies.hpp"
#include "physics/articulated/articulation.hpp"
#include "physics/articulated/mimic_row.hpp"
#include "physics/articulated/watched_solver.hpp"
#include "physics/contacts/continuous_collision.hpp"
#include "physics/contacts/hull_contacts.hpp"
#include "physics/free_bodies/free_bodies.hpp"
#include "physics/shapes.hpp"
#include "physics/stepper.hpp"

namespace energymargin {

//! Collects the points of one pair of bodies.
struct PairPoints : btCollisionWorld::ContactResultCallback {
  const btCollisionObject* first;
  double least = std::numeric_limits<double>::infinity();
  Vector3 position = Vector3::Zero();  // on the second body
  Vector3 normal = Vector3::UnitZ();   // to the first body

  PairPoints(const btCollisionObject& a, double reach) : first(&a) { m_closestDistanceThreshold = reach; }

  btScalar addSingleResult(btManifoldPoint& point, const btCollisionObjectWrapper* a, int, int,
                           const btCollisionObjectWrapper*, int, int) override;
};

//! Bodies that a joint connects overlap where the joint is, and never collide; nor do those for which the scene says
//! so.
struct SeparatePairs : btOverlapFilterCallback {
  std::set<std::pair<std::size_t, std::size_t>> pairs{};  // the lower index first

  void add(std::size_t a, std::size_t b) { pairs.insert(std::minmax(a, b)); }
  bool contains(std::size_t a, std::size_t b) const { return pairs.count(std::minmax(a, b)) > 0; }
  bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override;
};

//! A spring as it is now.
struct Span {
  btVector3 end_a, end_b;
  btVector3 along;           // unit vector from a to b; 0 where they meet
  double length;             // [m]
  double length_rate = 0.0;  // [m/s]
};

//! A wrench on a body, at its centre of mass [N, N m].
struct Load {
  std::size_t body;
  btVector3 force, torque;
};

//! Who does the steps.
enum class Steps {
  own,       ///< FreeBodies or ArticulatedBodies, with ContinuousCollision; the contacts of RoundContacts
  discrete,  ///< the same without ContinuousCollision, for comparison
  bullet,    ///< Bullet alone, for comparison: the bits of `discrete` where there are no joints and no compounds
};

//! A part of a step.
struct Advance {
  double duration;  // that it took [s]
  double lost;      // of it, in which nothing moved [s]
};

//! Bullet's side of a World. What makes rollouts pure functions is `restore`.
class Simulation {
 public:
  explicit Simulation(const Scene& scene, Steps steps = Steps::own);
  ~Simulation();
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  const Scene& scene() const { return scene_; }
  const StateLayout& layout() const { return layout_; }
  int whole_steps(double duration) const;

  //! The objects' bodies, in the scene's order; throws std::invalid_argument if the scene has none, or one on joints.
  const std::vector<btRigidBody*>& objects() const;

  void restore(const State& state);
  void read(State& state) const;
  void read(Motion& motion) const;
  void read(std::vector<Velocity>& velocities) const;

  //! A wrench on a body at its centre of mass, until `unload`; the robot's are told apart.
  void load(std::size_t body, const btVector3& force, const btVector3& torque);
  void actuate(std::size_t body, const btVector3& force, const btVector3& torque);
  void unload();

  //! A motor of limited force keeps a free body at the velocities of a state's numbers, until `unload`.
  void drive(std::size_t body, const Vector3& linear, const Vector3& angular, double force, double torque);
  void set_target(std::size_t joint, double target);

  //! What the robot does now.
  const std::vector<Load>& actuations() const { return actuations_; }
  double target(std::size_t joint) const;

  //! Goes on by `duration` [s], or by less where bodies come into contact on the way. `parts` of the step are over; if
  //! they are too many, the rest is lost: velocities change, and nothing moves further than into contact.
  Advance advance(double duration, int parts);

  //! One step.
  void step();

  //! A spring by its index in the scene.
  Span span(std::size_t spring) const;

  //! Sums up the work of the impulses in the next steps; `before` is what each begins with, for the caller to keep up
  //! to date. Null ends it.
  void watch(const Motion* before);

  //! Since the watch began.
  const ImpulseWork& impulse_work() const;

  std::vector<Contact> contacts() const;
  PairPoints pair(std::size_t a, std::size_t b, double reach);

  //! A body as Bullet sees it, where the last `restore` or `step` left it.
  const btCollisionObject& collider(std::size_t body) const { return *colliders_[body]; }

  //! Whether two bodies can collide at all.
  bool can_collide(std::size_t a, std::size_t b) const;

 private:
  struct Free {
    int offset;              // in a state
    Inertial inertial;       // where Bullet's frame is in the body's
    btVector3 acceleration;  // of gravity and the body's constant force
    btRigidBody* rigid;
    std::optional<int> turning_axis;  // the only axis of the world about which it can turn, if it is one
  };

  void configure(Steps steps);
  void add_stepper(Steps steps);
  void forget_contacts();
  void add_rigid(std::size_t index);
  void add_articulations();
  void add_mimics();
  void set_moment(const Free& body);
  Advance advance_safely(double duration, int parts);
  void set_impulse_work(const ImpulseWork& work);
  void solve(double duration);
  double safe_share(double duration);
  void accelerate(double duration);
  void apply(const Load& load, double duration);
  void turn_normals();
  void find_pulls();
  template <typename Visit>
  void for_each_pull(std::size_t spring, const Span& now, double tension, const Visit& visit) const;
  btVector3 end_of(std::size_t body, const Vector3& point) const;
  btVector3 velocity(std::size_t body, const btVector3& point) const;
  Articulation& articulation(std::size_t body) const { return *articulations_[*tree_of_[body]]; }

  Scene scene_;
  StateLayout layout_;
  double step_;
  std::vector<Inertial> inertials_;  // of all bodies
  btDefaultCollisionConfiguration configuration_;
  HullContacts hull_contacts_;
  btCollisionDispatcher dispatcher_;
  SeparatePairs separate_;
  btDbvtBroadphase broadphase_;
  WatchedSolver solver_;
  btMultiBodyDynamicsWorld world_;
  std::vector<CollisionShape> shapes_;       // of all bodies
  std::unique_ptr<Stepper> stepper_;         // in the world's place; null: the world
  ContactSolver* contact_solver_ = nullptr;  // of the stepper, in a scene without joints
  std::optional<ContinuousCollision> continuous_;
  std::vector<Velocity> velocities_;                  // of all bodies
  double last_duration_ = 0.0;                        // of the part before; 0: none since `restore` [s]
  std::vector<std::unique_ptr<btRigidBody>> rigids_;  // fixed and free bodies without joints, and fixed bases
  std::vector<std::unique_ptr<Articulation>> articulations_;
  std::vector<std::unique_ptr<MimicRow>> mimics_;
  std::vector<btCollisionObject*> colliders_;        // of all bodies
  std::vector<btMatrix3x3> before_;                  // how they stood before the step
  std::vector<std::optional<std::size_t>> tree_of_;  // index of the articulation that a body is in
  std::vector<Free> free_;
  std::vector<std::size_t> loaded_links_;                         // bodies of trees with a constant force
  std::vector<std::pair<std::size_t, std::size_t>> spring_ends_;  // bodies of each spring
  std::vector<Load> loads_;
  std::vector<Load> actuations_;
  std::vector<Load> pulls_;  // of springs, in the next step
  std::vector<btRigidBody*> objects_;
};

}  // namespace energymargin
