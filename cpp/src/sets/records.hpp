#pragma once
// The fields of regions in the order of problem files, and the words of their point.

#include <tuple>

#include "base/record.hpp"
#include "base/words.hpp"
#include "energymargin/region.hpp"

namespace energymargin {

template <>
struct Words<regions::Point> {
  static constexpr std::pair<const char*, regions::Point> all[]{{"origin", regions::Point::origin},
                                                                {"center_of_mass", regions::Point::center_of_mass}};
};

namespace regions {

//! The frame of a region, which may be left empty.
struct FrameOf {
  template <typename Primitive>
  constexpr auto& operator()(Primitive& region) const {
    return region.frame;
  }
};

template <typename Primitive>
constexpr auto body_field() {
  return Field{"body", &Primitive::body, "Whose position, or motion, counts.", forms::body};
}

constexpr auto frame_field() { return Field{"frame", FrameOf{}, nullptr, forms::frame, Presence::optional}; }

//! The point of the body whose position counts, for those that are about a position.
template <typename Primitive>
constexpr auto point_field() {
  return Field{"point", &Primitive::point,
               "Of the body: \"origin\" of its frame, as when left out, or \"center_of_mass\".", Presence::optional};
}

//! A region about a position; `own` are the fields between its body and its frame.
template <typename Primitive, typename... Own>
constexpr auto describe_position(const char* name, const char* description, const Own&... own) {
  return Alternative{name, description, body_field<Primitive>(), own..., frame_field(), point_field<Primitive>()};
}

constexpr auto describe(Type<Ball>) {
  return describe_position<Ball>("ball", "|position of the body - center| <= radius.",
                                 Field{"center", &Ball::center, "[m]"},
                                 Field{"radius", &Ball::radius, "[m]", forms::positive});
}

constexpr auto describe(Type<Box>) {
  return describe_position<Box>("box", "The body's position is inside a box along the frame's axes.",
                                Field{"center", &Box::center, "[m]"},
                                Field{"size", &Box::size, "Full edge lengths [m], or \"inf\".", forms::sizes});
}

constexpr auto describe(Type<Disc>) {
  return describe_position<Disc>("disc", "A ball of the plane: the distance counts in x and y alone.",
                                 Field{"center", &Disc::center, "[m]"},
                                 Field{"radius", &Disc::radius, "[m]", forms::positive});
}

constexpr auto describe(Type<AnnularSector>) {
  return describe_position<AnnularSector>(
      "annular_sector", "What an arc of some width sweeps in x and y.",
      Field{"center", &AnnularSector::center, "Of the arc [m]."},
      Field{"radius", &AnnularSector::radius, "Mean radius of the arc [m].", forms::positive},
      Field{"half_width", &AnnularSector::half_width, "On each side of the mean radius [m].", forms::positive},
      Field{"start_angle", &AnnularSector::start_angle, "From the x axis [rad]."},
      Field{"sweep", &AnnularSector::sweep,
            "Counter-clockwise from the start, negative: clockwise; not 0, at most a full turn [rad].", forms::turn});
}

constexpr auto describe(Type<PlanarMotion>) {
  return Description{
      "planar_motion", "How a body moves in x and y at one moment.", Field{"position", &PlanarMotion::position, "[m]"},
      Field{"velocity", &PlanarMotion::velocity, "[m/s]"}, Field{"yaw_rate", &PlanarMotion::yaw_rate, "[rad/s]"}};
}

constexpr auto describe(Type<Swept>) {
  return Alternative{
      "swept",
      "Inside what another body is about to sweep in x and y: the annular sector about its instantaneous centre of "
      "rotation or, while it is too slow to have a direction, a disc about it.",
      body_field<Swept>(),
      Field{"by", &Swept::by, "The body that sweeps.", forms::body},
      Field{"half_width", &Swept::half_width, "On each side of its path [m].", forms::positive},
      Field{"behind", &Swept::behind, "Length of path behind it that still counts [m].", forms::not_negative},
      Field{"ahead", &Swept::ahead, "Time of its motion that counts [s].", forms::positive},
      Field{"least_speed", &Swept::least_speed, "Below it the disc counts [m/s].", forms::not_negative},
      Field{"disc_radius", &Swept::disc_radius, "[m]", forms::positive},
      Field{"beyond", &Swept::beyond, "Length of path beyond what is ahead that still counts [m].", forms::not_negative,
            Presence::optional},
      Field{"at", &Swept::at, "The sweep from this motion, fixed in the world; left out: from the state's own.",
            Presence::optional},
      point_field<Swept>()};
}

constexpr auto describe(Type<HalfSpace>) {
  return Alternative{
      "half_space",
      "normal . position of the body <= offset; with \"ahead\" also as far as the frame's body moves along the normal "
      "in that time.",
      body_field<HalfSpace>(),
      Field{"normal", &HalfSpace::normal, "Unit vector.", forms::direction},
      Field{"offset", &HalfSpace::offset, "[m]"},
      frame_field(),
      Field{"ahead", &HalfSpace::ahead,
            "It reaches further by what the frame's body covers along the normal in this time [s]; with a frame alone.",
            forms::not_negative, Presence::optional},
      point_field<HalfSpace>()};
}

constexpr auto describe(Type<Speed>) {
  return Alternative{
      "speed",
      "|velocity of a point of the body| <= limit; with a frame: as seen from that body.",
      body_field<Speed>(),
      Field{"limit", &Speed::limit, "[m/s]", forms::not_negative},
      Field{"point", &Speed::point,
            "In the body's frame [m]; its centre of mass is at the center of its inertial, or of its mass properties."},
      frame_field(),
      Field{"along_world", &Speed::along_world, "The point is given along the world's axes, from the body's origin.",
            Presence::optional},
      Field{"along", &Speed::along,
            "Unit vector of the frame: the velocity along it counts alone, and may be negative.", forms::direction,
            Presence::optional}};
}

constexpr auto describe(Type<Tilt>) {
  return Alternative{"tilt",
                     "The angle between an axis of the body and a direction of the frame is at most the limit.",
                     body_field<Tilt>(),
                     Field{"axis", &Tilt::axis, "Unit vector in the body's frame.", forms::direction},
                     Field{"reference", &Tilt::reference, "Unit vector in the frame.", forms::direction},
                     Field{"limit", &Tilt::limit, "[rad]", forms::half_turn},
                     frame_field()};
}

constexpr auto describe(Type<Joint>) {
  return Alternative{
      "joint", "The position of a joint that moves is from lower to upper.",
      Field{"joint", &Joint::joint, "By its name."},
      Field{"lower", &Joint::lower, "[rad] or [m]; -inf: without it.", forms::lower_limit, Presence::optional},
      Field{"upper", &Joint::upper, "[rad] or [m]; inf: without it.", forms::upper_limit, Presence::optional}};
}

constexpr auto describe(Type<Touching>) {
  return Alternative{
      "touching",
      "Two bodies touch: they are at most a gap apart and, with \"force\", press on each other at least so much.",
      Field{"body", &Touching::body, "One of the two bodies.", forms::body},
      Field{"other", &Touching::other, "The other one, which can collide with it.", forms::body},
      Field{"force", &Touching::force,
            "Sum of the normal forces of their contacts in one step of the scene from the state, without a "
            "disturbance, at least [N]; 0, or left out: it does not count. Not with a plan, nor for the escape energy.",
            forms::not_negative, Presence::optional},
      Field{"gap", &Touching::gap, "Between their surfaces, at most [m]; left out: 0.0001.", forms::not_negative,
            Presence::optional}};
}

constexpr auto describe(Type<Intersection>) {
  return Alternative{"and", "Inside all of these.", Field{"of", &Intersection::of, "Regions.", forms::regions}};
}

constexpr auto describe(Type<Union>) {
  return Alternative{"or", "Inside at least one of these.", Field{"of", &Union::of, "Regions.", forms::regions}};
}

constexpr auto describe(Type<Complement>) {
  return Alternative{"not", "Outside of this one.", Field{"of", &Complement::of, "One region.", forms::region}};
}

}  // namespace regions

}  // namespace energymargin
