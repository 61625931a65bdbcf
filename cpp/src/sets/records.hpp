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

//! The frame of a region, which may be left empty.
struct FrameOf {
  template <typename Primitive>
  auto& operator()(Primitive& region) const {
    return region.frame;
  }
};

template <typename Primitive>
auto body_field() {
  return Field{"body", &Primitive::body, "Whose position, or motion, counts.", forms::body};
}

inline auto frame_field() { return Field{"frame", FrameOf{}, nullptr, forms::frame, Presence::optional}; }

//! The point of the body whose position counts, for those that are about a position.
template <typename Primitive>
auto point_field() {
  return Field{"point", &Primitive::point,
               "Of the body: \"origin\" of its frame, as when left out, or \"center_of_mass\".", Presence::optional};
}

//! The fields of a region about a position; `own` are those between its body and its frame.
template <typename Primitive, typename... Own>
auto position_fields(const Own&... own) {
  return std::tuple{body_field<Primitive>(), own..., frame_field(), point_field<Primitive>()};
}

template <>
struct Record<regions::Ball> {
  static constexpr const char* name = "ball";
  static constexpr const char* type = "ball";
  static constexpr const char* description = "|position of the body - center| <= radius.";
  static auto fields() {
    return position_fields<regions::Ball>(Field{"center", &regions::Ball::center, "[m]"},
                                          Field{"radius", &regions::Ball::radius, "[m]", forms::positive});
  }
};

template <>
struct Record<regions::Box> {
  static constexpr const char* name = "box_region";
  static constexpr const char* type = "box";
  static constexpr const char* description = "The body's position is inside a box along the frame's axes.";
  static auto fields() {
    return position_fields<regions::Box>(
        Field{"center", &regions::Box::center, "[m]"},
        Field{"size", &regions::Box::size, "Full edge lengths [m], or \"inf\".", forms::sizes});
  }
};

template <>
struct Record<regions::Disc> {
  static constexpr const char* name = "disc";
  static constexpr const char* type = "disc";
  static constexpr const char* description = "A ball of the plane: the distance counts in x and y alone.";
  static auto fields() {
    return position_fields<regions::Disc>(Field{"center", &regions::Disc::center, "[m]"},
                                          Field{"radius", &regions::Disc::radius, "[m]", forms::positive});
  }
};

template <>
struct Record<regions::AnnularSector> {
  using Sector = regions::AnnularSector;
  static constexpr const char* name = "annular_sector";
  static constexpr const char* type = "annular_sector";
  static constexpr const char* description = "What an arc of some width sweeps in x and y.";
  static auto fields() {
    return position_fields<Sector>(
        Field{"center", &Sector::center, "Of the arc [m]."},
        Field{"radius", &Sector::radius, "Mean radius of the arc [m].", forms::positive},
        Field{"half_width", &Sector::half_width, "On each side of the mean radius [m].", forms::positive},
        Field{"start_angle", &Sector::start_angle, "From the x axis [rad]."},
        Field{"sweep", &Sector::sweep,
              "Counter-clockwise from the start, negative: clockwise; not 0, at most a full turn [rad].", forms::turn});
  }
};

template <>
struct Record<regions::PlanarMotion> {
  using Motion = regions::PlanarMotion;
  static constexpr const char* name = "planar_motion";
  static constexpr const char* description = "How a body moves in x and y at one moment.";
  static auto fields() {
    return std::tuple{
        Field{"position", &Motion::position, "[m]"},
        Field{"velocity", &Motion::velocity, "[m/s]"},
        Field{"yaw_rate", &Motion::yaw_rate, "[rad/s]"},
    };
  }
};

template <>
struct Record<regions::Swept> {
  using Swept = regions::Swept;
  static constexpr const char* name = "swept";
  static constexpr const char* type = "swept";
  static constexpr const char* description =
      "Inside what another body is about to sweep in x and y: the annular sector about its instantaneous centre of "
      "rotation or, while it is too slow to have a direction, a disc about it.";
  static auto fields() {
    return std::tuple{
        body_field<Swept>(),
        Field{"by", &Swept::by, "The body that sweeps.", forms::body},
        Field{"half_width", &Swept::half_width, "On each side of its path [m].", forms::positive},
        Field{"behind", &Swept::behind, "Length of path behind it that still counts [m].", forms::not_negative},
        Field{"ahead", &Swept::ahead, "Time of its motion that counts [s].", forms::positive},
        Field{"least_speed", &Swept::least_speed, "Below it the disc counts [m/s].", forms::not_negative},
        Field{"disc_radius", &Swept::disc_radius, "[m]", forms::positive},
        Field{"beyond", &Swept::beyond, "Length of path beyond what is ahead that still counts [m].",
              forms::not_negative, Presence::optional},
        Field{"at", &Swept::at, "The sweep from this motion, fixed in the world; left out: from the state's own.",
              Presence::optional},
        point_field<Swept>(),
    };
  }
};

template <>
struct Record<regions::HalfSpace> {
  using HalfSpace = regions::HalfSpace;
  static constexpr const char* name = "half_space";
  static constexpr const char* type = "half_space";
  static constexpr const char* description =
      "normal . position of the body <= offset; with \"ahead\" also as far as the frame's body moves along the normal "
      "in that time.";
  static auto fields() {
    return std::tuple{
        body_field<HalfSpace>(),
        Field{"normal", &HalfSpace::normal, "Unit vector.", forms::direction},
        Field{"offset", &HalfSpace::offset, "[m]"},
        frame_field(),
        Field{"ahead", &HalfSpace::ahead,
              "It reaches further by what the frame's body covers along the normal in this time [s]; with a frame "
              "alone.",
              forms::not_negative, Presence::optional},
        point_field<HalfSpace>(),
    };
  }
};

template <>
struct Record<regions::Speed> {
  using Speed = regions::Speed;
  static constexpr const char* name = "speed";
  static constexpr const char* type = "speed";
  static constexpr const char* description =
      "|velocity of a point of the body| <= limit; with a frame: as seen from that body.";
  static auto fields() {
    return std::tuple{
        body_field<Speed>(),
        Field{"limit", &Speed::limit, "[m/s]", forms::not_negative},
        Field{
            "point", &Speed::point,
            "In the body's frame [m]; its centre of mass is at the center of its inertial, or of its mass properties."},
        frame_field(),
        Field{"along_world", &Speed::along_world, "The point is given along the world's axes, from the body's origin.",
              Presence::optional},
        Field{"along", &Speed::along,
              "Unit vector of the frame: the velocity along it counts alone, and may be negative.", forms::direction,
              Presence::optional},
    };
  }
};

template <>
struct Record<regions::Tilt> {
  using Tilt = regions::Tilt;
  static constexpr const char* name = "tilt";
  static constexpr const char* type = "tilt";
  static constexpr const char* description =
      "The angle between an axis of the body and a direction of the frame is at most the limit.";
  static auto fields() {
    return std::tuple{
        body_field<Tilt>(),
        Field{"axis", &Tilt::axis, "Unit vector in the body's frame.", forms::direction},
        Field{"reference", &Tilt::reference, "Unit vector in the frame.", forms::direction},
        Field{"limit", &Tilt::limit, "[rad]", forms::half_turn},
        frame_field(),
    };
  }
};

template <>
struct Record<regions::Joint> {
  static constexpr const char* name = "joint_region";
  static constexpr const char* type = "joint";
  static constexpr const char* description = "The position of a joint that moves is from lower to upper.";
  static auto fields() {
    return std::tuple{
        Field{"joint", &regions::Joint::joint, "By its name."},
        Field{"lower", &regions::Joint::lower, "[rad] or [m]; -inf: without it.", forms::lower_limit,
              Presence::optional},
        Field{"upper", &regions::Joint::upper, "[rad] or [m]; inf: without it.", forms::upper_limit,
              Presence::optional},
    };
  }
};

template <>
struct Record<regions::Intersection> {
  static constexpr const char* name = "and";
  static constexpr const char* type = "and";
  static constexpr const char* description = "Inside all of these.";
  static auto fields() { return std::tuple{Field{"of", &regions::Intersection::of, "Regions.", forms::regions}}; }
};

template <>
struct Record<regions::Union> {
  static constexpr const char* name = "or";
  static constexpr const char* type = "or";
  static constexpr const char* description = "Inside at least one of these.";
  static auto fields() { return std::tuple{Field{"of", &regions::Union::of, "Regions.", forms::regions}}; }
};

template <>
struct Record<regions::Complement> {
  static constexpr const char* name = "not";
  static constexpr const char* type = "not";
  static constexpr const char* description = "Outside of this one.";
  static auto fields() { return std::tuple{Field{"of", &regions::Complement::of, "One region.", forms::region}}; }
};

}  // namespace energymargin
