#pragma once
// Links that hang together: where they are, how they move, and their equations of motion.

#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "energymargin/scene.hpp"
#include "energymargin/state.hpp"
#include "physics/bodies/spatial.hpp"
#include "physics/motion.hpp"
#include "physics/shapes.hpp"

namespace energymargin {

//! A free body has six velocities: three linear ones of its centre of mass, and three angular ones.
inline constexpr int velocities_of_free_body = 6;

//! Position control with compliance. The torque is that at the end of the substep, stable for any stiffness: over h [s]
//! its impulse is h (k (target - q - h v) + d (v_target - v)) = pull - resistance v, within the limit.
struct Control {
  const PositionControl* law;  // of the scene's joint or tendon
  double target;               // [rad] or [m]

  bool limited() const { return law->torque_limit < std::numeric_limits<double>::infinity(); }
  double resistance(double duration) const { return duration * (duration * law->stiffness + law->damping); }
  double pull(double duration, double position) const {
    return duration * (law->stiffness * (target - position) + law->damping * law->target_velocity);
  }
};

struct JointControl : Control {
  const Joint* joint;  // the scene's
  int link, velocity;  // indices among the tree's
};

//! A stop takes part from this gap on [rad or m], or if a joint of that speed could get there in four steps.
inline double stop_reach(double duration, double speed) { return std::max(0.05, 4.0 * duration * speed); }

//! A tree of links on its base: a free body, or a fixed one that stays what it is outside of the tree. Its velocities
//! are those of a free base, then those of the joints that move: inertia * rate of the velocities + bias = forces along
//! the velocities, by composite bodies for the inertia and by Newton and Euler's recursion for the bias (Featherstone
//! 2008, tables 6.2 and 5.1). Drives without a torque limit are implicit: what they resist counts as inertia.
//! A substep kicks the velocities where the tree stands, by forces and impulses, and lets it coast: by Runge-Kutta
//! steps of the fourth order where energy counts, which is without drives, or on a free base.
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

  //! The links on a free body `base`, or those on one fixed body that hang on joint `first`. The scene outlives this;
  //! so do the poses of all its bodies, which the tree keeps up to date for its own.
  Articulation(const Scene& scene, std::size_t base, std::optional<std::size_t> first, std::vector<btTransform>& poses);
  Articulation(const Articulation&) = delete;
  Articulation& operator=(const Articulation&) = delete;

  //! The base first, parents before their children.
  const std::vector<Link>& links() const { return links_; }
  const Link& link(int index) const { return links_[static_cast<std::size_t>(index)]; }
  bool free() const { return free_; }

  //! Whether no force changes how its base, a free one, moves.
  bool kinematic() const { return free_ && scene_.bodies()[links_.front().body].kinematic; }

  //! Velocities that are prescribed by a kinematic base; they are the first ones.
  std::size_t prescribed() const { return kinematic() ? velocities_of_free_body : 0; }

  //! Joints with a drive or stops of their own.
  std::vector<JointControl>& controls() { return controls_; }

  std::size_t count() const { return velocities_.size(); }
  std::vector<double>& velocities() { return velocities_; }
  const std::vector<double>& velocities() const { return velocities_; }

  //! The velocities at which it goes in this substep.
  const std::vector<double>& ways() const { return ways_; }

  //! Adds to all ways but prescribed ones; a free base then changes the velocities at the end so that these have the
  //! momenta as before.
  void add_to_ways(const double* more, double duration, std::vector<double>& velocities);

  //! The common point of the tree's spatial vectors.
  const btVector3& origin() const { return links_[free_ ? 0 : 1].pose.getOrigin(); }

  //! Puts it where a state says, with those velocities.
  void put(const State& state);
  void read(State& state) const;

  //! No loads, and the joints' own targets.
  void forget();

  //! What these velocities of the tree are for the links and a free base, each at the index of its body in the scene.
  void read(const std::vector<double>& from, std::vector<Velocity>& velocities) const;

  //! Velocity of the point of a link that is at `point` in the world, at these velocities of the tree.
  btVector3 velocity(int link, const btVector3& point, const std::vector<double>& velocities) const;

  //! How fast its fastest link turns at these velocities of the tree [rad/s].
  double fastest_turn(const std::vector<double>& velocities) const;

  //! A wrench in the next substep, at the centre of mass of a link.
  void apply(int link, const btVector3& force, const btVector3& torque);
  void clear_loads();

  //! Moves all on their ways, for a share of `duration` [s]; a kinematic base loses no time.
  void move(double duration, double share);

  //! Puts the links, but not the bodies, where they get on their ways in `duration` [s], and back.
  void look_ahead(double duration);
  void put_back();

  //! Moves a free base, with all that hangs on it.
  void put_base(const btTransform& pose);

  //! Velocities of a kinematic base in this substep, whatever acts on the tree; otherwise it keeps what it has.
  void keep_base() { std::copy_n(velocities_.begin(), prescribed(), base_.begin()); }
  void drive_base(const Velocity& velocity) {
    for (std::size_t axis = 0; axis < base_.size(); ++axis) base_[axis] = velocity[static_cast<int>(axis)];
  }
  Velocity base_velocity() const { return {{base_[0], base_[1], base_[2]}, {base_[3], base_[4], base_[5]}}; }

  //! What the loads do in `duration` [s]. A tree that is `alone`, neither constrained nor driven, coasts under gravity.
  void prepare(double duration, const btVector3& gravity, bool alone);
  bool drives() const { return drives_; }

  //! To be called for a tree in a loop: it does not coast, what its velocities do to it is a force.
  void close() { looped_ = true; }
  bool looped() const { return looped_; }

  //! Whether the solver has a row for a drive: one that may not be strong enough, or of a tree that coasts by itself.
  bool drives_by_row(const JointControl& control) const {
    return control.limited() || (free_ && !kinematic() && !looped_);
  }

  //! Inertia with what the other drives resist, row by row, count() each.
  const double* inertia_row(std::size_t i) const { return driven_.data() + i * count(); }

  //! What its own swinging and turning does to the velocities, at the start of the substep [m/s^2 or rad/s^2].
  const std::vector<double>& coasting() const { return coasting_; }

  //! Velocities after the forces.
  const std::vector<double>& kicked() const { return kicked_; }

  //! Acceleration of a link's point as the tree coasts [m/s^2].
  btVector3 bend(int link, const btVector3& point) const;

  //! How fast a link turns [rad/s].
  double spin(int link) const { return coasting_motions_[static_cast<std::size_t>(link)].angular.length(); }

  //! Lets the tree coast from these velocities: they become those at the end, and its ways those to there.
  void coast(double duration, std::vector<double>& velocities);

  //! Work of what drives a kinematic base, but for impulses on the tree, from velocities before to those now [J].
  double work_on_base(double duration, const std::vector<double>& before) const;

  //! Of a tree that feels gravity as it coasts: half a substep's length times by how much its power grows, from
  //! velocities before to after, which is where its way ends [J]. Zero for other trees.
  double gravity_beside(double duration, const std::vector<double>& before, const std::vector<double>& after);

  //! Prepares `respond` for where the tree stands.
  void find_response();

  //! Replaces impulses along the velocities by the changes of velocity that they make, without drives.
  void respond(std::vector<double>& impulses) const { accelerate(factors_, impulses); }

  //! Adds what an impulse on a link is along the velocities.
  void add(int link, const SpatialVector& at_origin, double* impulses) const;
  void add(int link, const btVector3& point, const btVector3& impulse, double* impulses) const {
    add(link, {(point - origin()).cross(impulse), impulse}, impulses);
  }

  //! What gravity and the loads on the links are along the velocities.
  std::vector<double> loads(const btVector3& gravity) const;

 private:
  using Matrix = std::vector<double>;

  struct Momenta {
    btVector3 linear, angular;  // the latter about the centre of mass
  };

  void add_links(std::size_t parent, int parent_link, std::optional<std::size_t> only);
  Link make_link(std::size_t joint, int parent_link) const;
  void add_velocity(Link& link);
  int above(int velocity) const { return above_[static_cast<std::size_t>(velocity)]; }
  void place_links();
  void place_bodies();
  void set_motions();
  const std::vector<SpatialVector>& link_motions(const std::vector<double>& velocities) const;
  void put_off(const std::vector<double>& way);

  void find_inertia();
  void find_forces(const btVector3& gravity, bool loads);
  void find_bias(const std::vector<double>& velocities);
  void find_accelerations();
  void kick(double duration);
  void coast_in_loop(double duration, std::vector<double>& velocities);
  Momenta momenta(const std::vector<double>& velocities) const;
  void set_momenta(const Momenta& wanted, std::vector<double>& velocities) const;
  btVector3 center_of_mass() const;
  void coast_by_runge_kutta(double duration, std::vector<double>& velocities);
  std::vector<double> runge_kutta_step(double duration, const std::vector<double>& way,
                                       std::vector<double>& velocities);
  void rate(const std::vector<double>& way, const std::vector<double>& velocities, std::vector<double>& way_rate,
            std::vector<double>& acceleration);
  void accelerate(const Matrix& factors, std::vector<double>& rates) const;
  void factor(Matrix& matrix) const;

  const Scene& scene_;
  StateLayout layout_;
  std::vector<btTransform>& poses_;
  bool free_;
  std::vector<Link> links_;
  std::vector<JointControl> controls_;
  std::vector<double> velocities_, ways_;
  btTransform base_pose_;               // while the links are put off
  std::vector<double> positions_;       // of all links, then
  std::vector<int> above_;              // the velocity above another one in the tree; -1 above the first ones
  std::vector<std::size_t> movers_;     // the link that each velocity moves
  std::vector<SpatialVector> motions_;  // by a velocity of 1, of each of the tree's
  mutable std::vector<SpatialVector> link_motions_;
  Matrix inertia_, driven_, factors_;
  std::vector<double> forces_, bias_, rates_, coasting_, kicked_;
  std::array<double, velocities_of_free_body> base_{};      // velocities of a kinematic base in this substep
  std::vector<SpatialInertia> bodies_, composites_;         // each link alone, and with all that hangs on it
  std::vector<SpatialVector> accelerations_, link_forces_;  // of the links, with constant velocities
  std::vector<SpatialVector> coasting_motions_;             // of the links
  btVector3 coasting_gravity_ = btVector3(0, 0, 0);
  bool drives_ = false, looped_ = false;
};

}  // namespace energymargin
