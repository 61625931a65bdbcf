// The regions about one body, for Python.

#include "regions.hpp"

#include "energymargin/region.hpp"
#include "sets/words.hpp"
#include "warnings.hpp"

namespace energymargin::binding {
namespace {

using Frame = std::optional<std::string>;

regions::Point point_of(const std::string& word) { return value_of<regions::Point>("point", word); }

Region ball(const std::string& body, const ArrayLike& center, const Number& radius, const Frame& frame,
            const std::string& point) {
  return regions::Ball{body, vector3("center", center), real("radius", radius), frame.value_or(""), point_of(point)};
}

Region box(const std::string& body, const ArrayLike& center, const ArrayLike& size, const Frame& frame,
           const std::string& point) {
  return regions::Box{body, vector3("center", center), vector3("size", size), frame.value_or(""), point_of(point)};
}

Region disc(const std::string& body, const ArrayLike& center, const Number& radius, const Frame& frame,
            const std::string& point) {
  return regions::Disc{body, vector2("center", center), real("radius", radius), frame.value_or(""), point_of(point)};
}

Region annular_sector(const std::string& body, const ArrayLike& center, const Number& radius, const Number& half_width,
                      const Number& start_angle, const Number& sweep, const Frame& frame, const std::string& point) {
  warn_of_angle("start_angle", real("start_angle", start_angle));
  return regions::AnnularSector{body,
                                vector2("center", center),
                                real("radius", radius),
                                real("half_width", half_width),
                                real("start_angle", start_angle),
                                real("sweep", sweep),
                                frame.value_or(""),
                                point_of(point)};
}

regions::PlanarMotion planar_motion(const std::map<std::string, ArrayLike>& at) {
  for (const char* key : {"position", "velocity", "yaw_rate"}) {
    if (at.count(key) == 0) throw std::invalid_argument(std::string("at has no '") + key + "'");
  }
  return {vector2("at: position", at.at("position")), vector2("at: velocity", at.at("velocity")),
          vector("at: yaw_rate", {py::make_tuple(at.at("yaw_rate").value)}, 1)[0]};
}

Region swept(const std::string& body, const std::string& by, const Number& half_width, const Number& behind,
             const Number& ahead, const Number& least_speed, const Number& disc_radius,
             const std::optional<std::map<std::string, ArrayLike>>& at, const Number& beyond,
             const std::string& point) {
  return regions::Swept{body,
                        by,
                        real("half_width", half_width),
                        real("behind", behind),
                        real("ahead", ahead),
                        real("least_speed", least_speed),
                        real("disc_radius", disc_radius),
                        at ? std::make_optional(planar_motion(*at)) : std::nullopt,
                        real("beyond", beyond),
                        point_of(point)};
}

Region half_space(const std::string& body, const ArrayLike& normal, const Number& offset, const Frame& frame,
                  const Number& ahead, const std::string& point) {
  return regions::HalfSpace{
      body,           vector3("normal", normal), real("offset", offset), frame.value_or(""), real("ahead", ahead),
      point_of(point)};
}

Region speed(const std::string& body, const Number& limit, const ArrayLike& point, const Frame& frame, bool along_world,
             const std::optional<ArrayLike>& along) {
  return regions::Speed{body,
                        real("limit", limit),
                        vector3("point", point),
                        frame.value_or(""),
                        along_world,
                        along ? std::make_optional(vector3("along", *along)) : std::nullopt};
}

Region tilt(const std::string& body, const ArrayLike& axis, const ArrayLike& reference, const Number& limit,
            const Frame& frame) {
  return regions::Tilt{body, vector3("axis", axis), vector3("reference", reference), real("limit", limit),
                       frame.value_or("")};
}

constexpr const char* swept_doc =
    "Inside what the body `by` is about to sweep in x and y: an annular sector about its instantaneous centre of "
    "rotation, half_width [m] on each side of its path, from `behind` [m] behind it to `beyond` [m] "
    "beyond `ahead` [s] of its motion; "
    "below least_speed [m/s] a disc of disc_radius [m] about it. at: dict of position (2,), velocity (2,), yaw_rate, "
    "a motion to fix the sweep in the world; by default the state's own.";

constexpr const char* speed_doc =
    "|velocity of a point of the body| <= limit [m/s]; the point is in its frame or, `along_world`, from its origin "
    "along the world's axes. That of the centre of mass is at the `center` of em.mass_properties, or of the body's "
    "inertial. along: a unit vector (3,); the velocity along it counts alone, and may be negative.";

}  // namespace

void bind_primitives(py::module_& module) {
  const py::arg_v frame = py::arg("frame") = py::none();
  const py::arg_v point = py::arg("point") = "origin";
  module.def("Ball", &ball, py::arg("body"), py::arg("center"), py::arg("radius"), frame, py::kw_only(), point,
             "|position - center| <= radius [m].");
  module.def("Box", &box, py::arg("body"), py::arg("center"), py::arg("size"), frame, py::kw_only(), point,
             "Position inside a box along the frame's axes; full edge lengths [m], inf for no limit.");
  module.def("Disc", &disc, py::arg("body"), py::arg("center"), py::arg("radius"), frame, py::kw_only(), point,
             "Distance from the center (2,) in x and y <= radius [m].");
  module.def("AnnularSector", &annular_sector, py::arg("body"), py::arg("center"), py::arg("radius"),
             py::arg("half_width"), py::arg("start_angle"), py::arg("sweep"), frame, py::kw_only(), point,
             "What an arc about a center (2,) of mean radius and half width [m] sweeps in x and y, from start_angle by "
             "sweep [rad], positive counter-clockwise.");
  module.def("Swept", &swept, py::arg("body"), py::arg("by"), py::kw_only(), py::arg("half_width"), py::arg("behind"),
             py::arg("ahead"), py::arg("least_speed"), py::arg("disc_radius"), py::arg("at") = py::none(),
             py::arg("beyond") = 0.0, point, swept_doc);
  module.def("HalfSpace", &half_space, py::arg("body"), py::arg("normal"), py::arg("offset"), frame, py::kw_only(),
             py::arg("ahead") = 0.0, point,
             "normal . position <= offset [m]; the normal is a unit vector. Where the frame's body moves along the "
             "normal it reaches further, by what that covers in `ahead` [s].");
  module.def("Speed", &speed, py::arg("body"), py::arg("limit"), py::arg("point") = py::make_tuple(0.0, 0.0, 0.0),
             frame, py::arg("along_world") = false, py::arg("along") = py::none(), speed_doc);
  module.def("Tilt", &tilt, py::arg("body"), py::arg("axis"), py::arg("reference"), py::arg("limit"), frame,
             "The angle between the body's axis and the reference is at most limit [rad].");
}

}  // namespace energymargin::binding
