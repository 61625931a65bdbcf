#pragma once
// Sets of states: capture set, success set, bounds. Small predicates that combine with & | ~.

#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "energymargin/scene.hpp"
#include "energymargin/state.hpp"

namespace energymargin {

class Region;

//! Levels of & | ~ in each other, at most: as many as a problem file has, and far less than a stack holds.
inline constexpr int most_region_levels = 64;

//! Primitives in a region, at most: a longer chain of & would take minutes to build.
inline constexpr std::size_t most_region_primitives = 10'000;

//! N truth values.
using Mask = Eigen::Array<bool, Eigen::Dynamic, 1>;

namespace regions {

// The position of `point` of `body` counts. Centre, axes and velocities are in the body `frame`; empty: the world.

//! The point of a body whose position counts.
enum class Point {
  origin,          ///< of the body's frame, which is its shape's
  center_of_mass,  ///< of a body that has a mass
};

//! |position - centre| <= radius.
struct Ball {
  std::string body;
  Vector3 center = Vector3::Zero();  //!< [m]
  double radius = 1.0;               //!< [m]
  std::string frame{};
  Point point = Point::origin;
};

//! Position inside a box along the frame's axes.
struct Box {
  std::string body;
  Vector3 center = Vector3::Zero();  //!< [m]
  Vector3 size = Vector3::Ones();    //!< full edge lengths, inf allowed [m]
  std::string frame{};
  Point point = Point::origin;
};

//! A ball of the plane: the distance counts in x and y alone.
struct Disc {
  std::string body;
  Vector2 center = Vector2::Zero();  //!< [m]
  double radius = 1.0;               //!< [m]
  std::string frame{};
  Point point = Point::origin;
};

//! What an arc of some width sweeps in x and y.
struct AnnularSector {
  std::string body;
  Vector2 center = Vector2::Zero();  //!< of the arc [m]
  double radius = 1.0;               //!< mean radius of the arc [m]
  double half_width = 0.5;           //!< on each side of the mean radius [m]
  double start_angle = 0.0;          //!< from the x axis [rad]
  double sweep = 1.0;  //!< counter-clockwise from the start, negative: clockwise; at most a full turn [rad]
  std::string frame{};
  Point point = Point::origin;
};

//! How a body moves in x and y at one moment.
struct PlanarMotion {
  Vector2 position = Vector2::Zero();  //!< [m]
  Vector2 velocity = Vector2::Zero();  //!< [m/s]
  double yaw_rate = 0.0;               //!< [rad/s]
};

//! Inside what another body is about to sweep in x and y: the annular sector about its instantaneous centre of rotation
//! or, while it is too slow to have a direction, a disc about it (paper, Section VI-A, planar pushing).
struct Swept {
  std::string body;
  std::string by;                    //!< the body that sweeps
  double half_width = 0.5;           //!< on each side of its path [m]
  double behind = 0.0;               //!< length of path behind it that still counts [m]
  double ahead = 1.0;                //!< time of its motion that counts [s]
  double least_speed = 0.0;          //!< below it the disc counts [m/s]
  double disc_radius = 1.0;          //!< [m]
  std::optional<PlanarMotion> at{};  //!< the sweep from this motion, fixed in the world; unset: from the state's own
  double beyond = 0.0;               //!< length of path beyond what is ahead that still counts [m]
  Point point = Point::origin;       //!< of `body`
};

//! normal . position <= offset, and further by what the frame's body moves along the normal in a while.
struct HalfSpace {
  std::string body;
  Vector3 normal = Vector3::UnitZ();  //!< unit vector
  double offset = 0.0;                //!< [m]
  std::string frame{};
  double ahead = 0.0;  //!< time of the frame's motion that counts, above 0 with a frame alone [s]
  Point point = Point::origin;
};

//! |velocity of a body's point| <= limit; with a frame, the velocity as seen from that body.
struct Speed {
  std::string body;
  double limit = 1.0;               //!< [m/s]
  Vector3 point = Vector3::Zero();  //!< in the body's frame [m]
  std::string frame{};
  bool along_world = false;  //!< the point is given along the world's axes, from the body's origin
  //! Unit vector of the frame: the velocity along it counts alone, which may be negative.
  std::optional<Vector3> along{};
};

//! The angle between an axis of the body and a reference direction of the frame is at most the limit.
struct Tilt {
  std::string body;
  Vector3 axis = Vector3::UnitZ();       //!< in the body's frame, unit vector
  Vector3 reference = Vector3::UnitZ();  //!< in the frame, unit vector
  double limit = 0.1;                    //!< 0..pi [rad]
  std::string frame{};
};

//! The position of a joint that moves is from `lower` to `upper`.
struct Joint {
  std::string joint;
  double lower = -std::numeric_limits<double>::infinity();  //!< [rad] or [m]
  double upper = std::numeric_limits<double>::infinity();   //!< [rad] or [m]
};

//! Two bodies are at most `gap` apart and, with a force, press on each other by at least that in an undisturbed step.
struct Touching {
  std::string body;
  std::string other;
  double force = 0.0;  //!< 0: whether they press on each other does not count [N]
  double gap = 1e-4;   //!< what presses on something is in it by micrometres [m]
};

//! A user's own function of N states, one a row. It has no file format.
struct Predicate {
  std::function<Mask(const States&)> contains;
};

//! a & b.
struct Intersection {
  std::vector<Region> of;
};

//! a | b.
struct Union {
  std::vector<Region> of;
};

//! ~a.
struct Complement {
  std::vector<Region> of;  //!< exactly one
};

}  // namespace regions

//! Whether an Expression is made of other regions.
template <typename Expression>
inline constexpr bool is_of_regions =
    std::is_same_v<Expression, regions::Intersection> || std::is_same_v<Expression, regions::Union> ||
    std::is_same_v<Expression, regions::Complement>;

//! A set of states, as a value. ~~a is a, and a & b & c is one level.
class Region {
 public:
  using Expression = std::variant<regions::Ball, regions::Box, regions::Disc, regions::AnnularSector, regions::Swept,
                                  regions::HalfSpace, regions::Speed, regions::Tilt, regions::Joint, regions::Touching,
                                  regions::Predicate, regions::Intersection, regions::Union, regions::Complement>;

  //! Throws std::invalid_argument on bad numbers, or more levels or primitives than a region may have.
  template <typename Primitive>
  Region(Primitive primitive);  // NOLINT: a primitive is a region

  const Expression& expression() const { return node_->expression; }

  //! Whether a copy has the same expression in memory.
  bool is_shared() const { return node_.use_count() > 1; }

  friend Region operator&(const Region& a, const Region& b);
  friend Region operator|(const Region& a, const Region& b);
  friend Region operator~(const Region& a);

 private:
  struct Node {
    explicit Node(Expression definition);  // validates it

    Expression expression;
    int levels = 0;              // of & | ~
    std::size_t primitives = 1;  // in it
  };

  std::shared_ptr<const Node> node_;
};

template <typename Primitive>
Region::Region(Primitive primitive) : node_(std::make_shared<const Node>(Expression(std::move(primitive)))) {}

}  // namespace energymargin
