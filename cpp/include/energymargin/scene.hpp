#pragma once
// What there is, as validated values: bodies, joints, springs, friction, gravity and how the simulation is stepped.

#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "energymargin/shape.hpp"
#include "energymargin/types.hpp"

namespace energymargin {

//! What a body is in the manipulation.
enum class Role {
  none,      ///< environment
  object,    ///< a body that disturbances act on
  effector,  ///< a part of the robot
};

//! Centre of mass and inertia of a body, in its frame.
struct Inertial {
  Vector3 center = Vector3::Zero();          //!< centre of mass [m]
  Vector3 moments = Vector3::Ones();         //!< principal moments about the centre [kg m^2]
  Quaternion axes = Quaternion::Identity();  //!< turns the principal axes into the body's

  //! From the inertia about the centre, along `axes` [kg m^2], if a rigid body can have it.
  static Inertial from_tensor(const Vector3& center, const Eigen::Matrix3d& inertia,
                              const Quaternion& axes = Quaternion::Identity());
};

//! How a body meets others, beside its friction.
struct Surface {
  //! Torque about a contact's normal, and about its plane, by normal force [m]. They share the cone of its friction:
  //! none acts where that is 0. Of two bodies the larger one counts.
  double torsional_friction = 0.0;
  double rolling_friction = 0.0;
  //! Of the patch over which it spreads what presses at a point [m]. Above 0 friction acts in the middle of a patch,
  //! with the torque of an even pressure. Of two bodies the larger one counts.
  double patch_radius = 0.0;
  //! Share of the speed of meeting that they part with, from restitution_speed on, 0..1; the larger one counts.
  double restitution = 0.0;
  //! Of each contact point, in series with the other body's; 0: as hard as the step allows [N/m], [N s/m].
  double stiffness = 0.0;
  double damping = 0.0;
};

//! Slower than this bodies do not bounce [m/s].
inline constexpr double restitution_speed = 0.1;

//! One rigid body. With a joint to a parent it is a link: then the joints say where it is. Its frame is its shape's;
//! the centre of mass, at which wrenches act, may lie elsewhere.
struct Body {
  std::string name;  //!< unique in its scene
  Shape shape = Box{};
  double mass = 0.0;                           //!< [kg]; 0: fixed
  std::optional<Inertial> inertial{};          //!< unset: that of the shape, of even density
  BodyState state{};                           //!< where it is when nothing else is said
  double friction = 0.5;                       //!< a contact's coefficient follows from those of its two bodies
  std::optional<Surface> surface{};            //!< unset: without what it has
  Vector3 surface_velocity = Vector3::Zero();  //!< beside that of the body, in its frame, as of a belt [m/s]
  Role role = Role::none;
  Vector3 linear_factor = Vector3::Ones();   //!< 1: free along the axis, 0: locked
  Vector3 angular_factor = Vector3::Ones();  //!< 1: free about the axis, 0: locked
  //! Acts at the centre of mass all the time, in the world's axes, as a motor or a counterweight does [N].
  Vector3 force = Vector3::Zero();
  //! Resist its motion at the centre of mass; of a link its joint's do [N s/m], [N m s/rad].
  double linear_damping = 0.0;
  double angular_damping = 0.0;
  //! Goes on as it moves, or as a plan says, whatever it meets; its mass does not count.
  bool kinematic = false;

  bool fixed() const { return mass == 0.0; }

  //! Whether forces move it.
  bool dynamic() const { return !fixed() && !kinematic; }

  //! Along or about an axis, 0..2 or 3..5.
  double damping(int axis) const { return axis < 3 ? linear_damping : angular_damping; }
  bool damped() const { return linear_damping > 0.0 || angular_damping > 0.0; }

  //! In the body's frame; for a body that no force moves the frame itself, with moments of 0.
  Inertial principal_inertial() const;
};

enum class JointType {
  fixed,      ///< the two bodies move as one
  revolute,   ///< turns about its axis
  prismatic,  ///< slides along its axis: a rail
};

//! A joint that follows another one: position = multiplier * (that joint's position) + offset, always.
struct Mimic {
  std::string joint;        //!< one that moves and follows no other
  double multiplier = 1.0;  //!< not 0
  double offset = 0.0;      //!< [rad] or [m]
};

//! Position control with compliance, of a joint or a tendon: the torque stiffness (target - position) + damping
//! (target_velocity - velocity), within its limit.
struct PositionControl {
  double target = 0.0;                                            //!< [rad]
  double target_velocity = 0.0;                                   //!< [rad/s]
  double stiffness = 0.0;                                         //!< [N m/rad]
  double damping = 0.0;                                           //!< [N m s/rad]
  double torque_limit = std::numeric_limits<double>::infinity();  //!< [N m]

  bool drives() const { return stiffness > 0.0 || damping > 0.0; }
};

//! A joint that carries `child` on `parent`, and its position control. For a prismatic one read m for rad, N for N m.
struct Joint : PositionControl {
  std::string name;  //!< unique among the scene's joints
  JointType type = JointType::revolute;
  std::string parent;                                       //!< body
  std::string child;                                        //!< body that can move, on no other joint
  Pose in_parent{};                                         //!< the joint's frame in the parent's
  Pose in_child{};                                          //!< and in the child's: the two are one at position 0
  Vector3 axis = Vector3::UnitZ();                          //!< in the joint's frame, unit vector
  double lower = -std::numeric_limits<double>::infinity();  //!< limit [rad]
  double upper = std::numeric_limits<double>::infinity();   //!< limit [rad]
  JointState state{};                                       //!< where it is when nothing else is said
  bool held = false;             //!< it keeps the position it has, whatever the load; its velocity is 0
  std::optional<Mimic> mimic{};  //!< set: it has no limits and no control of its own
  //! Inertia of the drive's rotor times the square of the gear ratio: it resists accelerations of the joint [kg m^2].
  double armature = 0.0;
  double friction = 0.0;  //!< dry friction: torque that resists motion, up to this [N m]

  //! Whether its position and velocity are numbers of the state.
  bool moves() const { return type != JointType::fixed && !mimic; }
};

//! A joint of a tendon, and how much of its position counts.
struct TendonJoint {
  std::string joint;         //!< not a fixed one
  double coefficient = 1.0;  //!< not 0
};

//! A fixed tendon: a sum of joints' positions, its length, with a control, stops and dry friction of its own.
struct Tendon : PositionControl {
  std::string name;  //!< unique among the scene's tendons and joints
  std::vector<TendonJoint> joints{};
  double lower = -std::numeric_limits<double>::infinity();  //!< limit of the length
  double upper = std::numeric_limits<double>::infinity();
  double friction = 0.0;  //!< dry friction, up to this, along the length
};

enum class LoopType {
  point,  ///< a point of one body stays at a point of the other: a ball joint
  weld,   ///< the two bodies move as one
};

//! Closes a loop of joints, or ties bodies that hang on none: a frame of one body and a frame of another stay together.
struct Loop {
  std::string body_a, body_b;
  LoopType type = LoopType::point;
  Vector3 point_a = Vector3::Zero(), point_b = Vector3::Zero();  //!< the frames' origins in those of the bodies [m]
  Quaternion orientation_a = Quaternion::Identity(), orientation_b = Quaternion::Identity();  //!< of a weld
};

//! A spring between a point of one body and a point of another.
struct Spring {
  std::string body_a, body_b;
  Vector3 point_a = Vector3::Zero();  //!< in the body's frame [m]
  Vector3 point_b = Vector3::Zero();
  double stiffness = 1.0;    //!< [N/m]
  double rest_length = 0.0;  //!< [m]
  double damping = 0.0;      //!< along the spring [N s/m]
};

//! So few that a step of a hundred stacked boxes ends in a second: Ctrl-C is seen between steps.
inline constexpr int most_solver_iterations = 10'000;

//! A residual of one part in a hundred is as coarse as friction is known.
inline constexpr double most_solver_tolerance = 1e-2;

//! How the coefficients of two bodies make that of their contact.
enum class FrictionRule {
  product,  ///< Bullet's
  max,      ///< the larger one, MuJoCo's
};

//! The coefficients of the contacts of two bodies, whatever the rule and their surfaces make of theirs.
struct PairFriction {
  std::string body_a, body_b;
  double friction = 0.0;
  std::optional<double> torsional_friction{}, rolling_friction{};  //!< [m]; unset: that of the surfaces
};

//! What steps a scene.
enum class EngineKind {
  native,  ///< the library's own: friction to Coulomb's limit, continuous collision
  bullet,  ///< Bullet's multi-body world: sequential impulses, one step without substeps
};

struct Simulator;

//! How the physics is stepped.
struct Stepping {
  double step = 1.0 / 240.0;  //!< length of one step [s]
  //! Newton iterations of the contact solver in a step, or sweeps of Bullet's, at most; 1..most_solver_iterations;
  //! unset: 200, or 50 sweeps.
  std::optional<int> iterations{};
  //! A step has converged with a residual below this share of its impulses; of Bullet's sweeps, with the largest
  //! squared change of an impulse below this [N^2 s^2]; above 0, at most most_solver_tolerance; unset: 1e-5, or 1e-7 of
  //! Bullet's.
  std::optional<double> tolerance{};
  std::optional<double> margin{};  //!< collision margin [m]; unset: a twentieth of each shape's smallest half extent
  EngineKind engine = EngineKind::native;
  std::shared_ptr<const Simulator> simulator{};  //!< steps the scene in place of an engine of the library

  int most_iterations() const { return iterations.value_or(engine == EngineKind::native ? 200 : 50); }
  double residual() const { return tolerance.value_or(engine == EngineKind::native ? 1e-5 : 1e-7); }
};

//! What a scene has otherwise in a body; unset: nothing.
struct BodyChange {
  std::optional<double> friction{}, mass{};                        //!< [kg]
  std::optional<double> torsional_friction{}, rolling_friction{};  //!< of its surface [m]
};

class BodyConstants;
struct CollisionShape;

//! Bodies under gravity. Every function that takes bad input throws std::invalid_argument.
class Scene {
 public:
  explicit Scene(const Vector3& gravity = Vector3(0.0, 0.0, -9.81), const Stepping& stepping = {},
                 FrictionRule friction_rule = FrictionRule::product);

  //! Adds a body and returns its index; validates shape, mass, state, friction and factors.
  std::size_t add_body(Body body);

  //! Hangs the child on the parent, moves it and all that hangs on it there, and returns the joint's index. A body has
  //! one parent at most, joints form no loops, and jointed bodies have no locked axes.
  std::size_t add_joint(Joint joint);

  //! Adds a tendon over joints that hang, in the end, on at most two free or fixed bodies' children.
  void add_tendon(Tendon tendon);

  //! Ties two bodies, of which forces move one at least. They may still collide.
  void add_loop(Loop loop);

  //! Adds a spring; it has to be soft enough for the simulation's step.
  void add_spring(Spring spring);

  //! From now on two bodies never collide; those that a joint connects never do.
  void disable_collisions(const std::string& body_a, const std::string& body_b);

  //! From now on contacts of two bodies have these coefficients; one that is unset stays what it was.
  void set_friction(const PairFriction& pair);

  const Vector3& gravity() const { return gravity_; }  //!< [m/s^2]
  const Stepping& stepping() const { return stepping_; }

  //! The same scene in other steps.
  Scene with_stepping(const Stepping& stepping) const;

  //! The same scene, stepped by another engine with that one's iterations and tolerance.
  Scene with_engine(EngineKind engine) const {
    return with_stepping({stepping_.step, {}, {}, stepping_.margin, engine});
  }

  //! The same scene, stepped by a simulator, in its steps.
  Scene with_simulator(std::shared_ptr<const Simulator> simulator) const;

  //! The same scene with other coefficients or another mass and inertia of one body; those of pairs stay.
  Scene with_body(const std::string& name, const BodyChange& change) const;
  const std::vector<Body>& bodies() const { return bodies_; }
  const std::vector<Joint>& joints() const { return joints_; }
  const std::vector<Tendon>& tendons() const { return tendons_; }
  const std::vector<Loop>& loops() const { return loops_; }
  const std::vector<Spring>& springs() const { return springs_; }
  const std::set<std::pair<std::string, std::string>>& disabled_collisions() const { return disabled_; }

  FrictionRule friction_rule() const { return friction_rule_; }

  //! Those that were set, in the order of their bodies, the earlier body first.
  std::vector<PairFriction> pair_frictions() const;

  //! Coefficient of the contacts of two bodies, by their indices: that of the pair, or else by the rule.
  double contact_friction(std::size_t a, std::size_t b) const;

  //! Whether a body has a surface or surface_velocity, or a pair of bodies coefficients that turn.
  bool has_surfaces() const;

  //! What the surfaces of two bodies make of their contacts, by their indices.
  Surface contact_surface(std::size_t a, std::size_t b) const;

  //! Index of a body by name; the error lists the names that there are.
  std::size_t index(const std::string& name) const;
  const Body& body(const std::string& name) const { return bodies_[index(name)]; }

  //! Body::principal_inertial and energymargin::smallest_half_extent of a body, by its index, found once.
  const Inertial& inertial(std::size_t body) const;
  double smallest_half_extent(std::size_t body) const;

  //! What of a body collides in a simulation. It is made once; copies of the scene share it.
  const CollisionShape& collision_shape(std::size_t body) const;

  //! Index of a joint by name; the error lists the names that there are.
  std::size_t joint_index(const std::string& name) const;

  //! The control of a joint or, beyond all joints, a tendon, or beyond these a command of the simulator.
  const PositionControl& control(std::size_t index) const;

  //! Index of a tendon by name; none if the scene does not have it.
  std::optional<std::size_t> find_tendon(const std::string& name) const;

  //! Index of a joint or a tendon among them by name, or with a simulator of its command; the error lists the names
  //! that there are.
  std::size_t control_index(const std::string& name) const;

  //! The joint that carries a body; none for a body that is no link.
  std::optional<std::size_t> joint_to(std::size_t body) const { return joints_to_[body]; }

  //! The free or fixed body that carries a link, in the end; a body that is no link itself.
  std::size_t root(std::size_t body) const;

  //! Whether a joint never moves: it is fixed or held, or follows one that is.
  bool rigid(const Joint& joint) const;

  //! Whether a body is a link or carries one.
  bool jointed(std::size_t body) const { return joints_to_[body] || !joints_below_[body].empty(); }

  //! Indices of the bodies of a role.
  std::vector<std::size_t> with_role(Role role) const;

 private:
  bool carries(std::size_t above, std::size_t body) const;
  std::size_t tree_of(std::size_t joint) const;
  void place_links(std::size_t joint);

  Vector3 gravity_;
  Stepping stepping_;
  std::vector<Body> bodies_;
  std::vector<std::shared_ptr<const BodyConstants>> constants_;  // of each body
  std::vector<Joint> joints_;
  std::vector<Tendon> tendons_;
  std::vector<Loop> loops_;
  std::vector<Spring> springs_;
  std::set<std::pair<std::string, std::string>> disabled_;  // the lesser name first
  FrictionRule friction_rule_;
  std::map<std::pair<std::size_t, std::size_t>, PairFriction> pair_frictions_;  // by indices of bodies, the lower first
  std::unordered_map<std::string, std::size_t> body_indices_, joint_indices_;
  std::vector<std::optional<std::size_t>> joints_to_;   // the joint that carries each body
  std::vector<std::vector<std::size_t>> joints_below_;  // the joints that hang on each body
};

}  // namespace energymargin
