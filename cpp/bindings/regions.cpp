// Sets of states for Python.

#include "base/check.hpp"
#include "convert.hpp"
#include "energymargin/membership.hpp"
#include "energymargin/region.hpp"
#include "warnings.hpp"

namespace energymargin::binding {
namespace {

using Frame = std::optional<std::string>;

// A predicate may ask a region of predicates, and so on. Each level takes some 20 kB of the stack: Python's own limit
// on recursion would come too late.
class PredicateLevel {
 public:
  PredicateLevel() {
    if (levels_ == most_region_levels) {
      reject("region", "of predicates that ask one another " + std::to_string(levels_ + 1) + " levels deep",
             "at most " + std::to_string(most_region_levels));
    }
    ++levels_;
  }
  PredicateLevel(const PredicateLevel&) = delete;
  PredicateLevel& operator=(const PredicateLevel&) = delete;
  ~PredicateLevel() { --levels_; }

  static bool outermost() { return levels_ == 1; }

 private:
  static thread_local int levels_;
};
thread_local int PredicateLevel::levels_ = 0;

// A Python function that other threads may call and drop.
regions::Predicate python_predicate(py::function function) {
  const std::shared_ptr<py::function> shared(new py::function(std::move(function)), [](py::function* held) {
    const py::gil_scoped_acquire acquire;
    delete held;
  });
  return {[shared](const States& states) {
    const py::gil_scoped_acquire acquire;
    const PredicateLevel level;
    py::array answer;
    try {
      answer = array_of((*shared)(py::cast(states)));
    } catch (const py::error_already_set& error) {
      if (!error.matches(PyExc_Exception) || !PredicateLevel::outermost()) throw;  // such as KeyboardInterrupt
      throw std::runtime_error(std::string("the predicate failed: ") + error.what());
    }
    if (!answer || answer.dtype().kind() != 'b' || answer.ndim() != 1 || answer.shape(0) != states.rows()) {
      throw std::invalid_argument("the predicate's answer is not an array of bool of shape (" +
                                  std::to_string(states.rows()) + ",), one a state");
    }
    const auto mask = py::array_t<bool, py::array::c_style | py::array::forcecast>::ensure(answer);
    return Mask(Eigen::Map<const Mask>(mask.data(), states.rows()));
  }};
}

py::object contains(const Region& region, const Scene& scene, const ArrayLike& states) {
  const Membership member(region, scene);
  const int dimension = StateLayout(scene).dimension();
  if (is_single("states", states)) return py::bool_(member(vector("states", states, dimension)));
  return py::cast(member(matrix("states", states, -1, dimension)));
}

regions::PlanarMotion planar_motion(const std::map<std::string, ArrayLike>& at) {
  for (const char* key : {"position", "velocity", "yaw_rate"}) {
    if (at.count(key) == 0) throw std::invalid_argument(std::string("at has no '") + key + "'");
  }
  return {vector2("at: position", at.at("position")), vector2("at: velocity", at.at("velocity")),
          vector("at: yaw_rate", {py::make_tuple(at.at("yaw_rate").value)}, 1)[0]};
}

void bind_primitives(py::module_& module) {
  module.def(
      "Ball",
      [](std::string body, const ArrayLike& center, const Number& radius, const Frame& frame) -> Region {
        return regions::Ball{std::move(body), vector3("center", center), real("radius", radius), frame.value_or("")};
      },
      py::arg("body"), py::arg("center"), py::arg("radius"), py::arg("frame") = py::none(),
      "|position - center| <= radius [m].");
  module.def(
      "Box",
      [](std::string body, const ArrayLike& center, const ArrayLike& size, const Frame& frame) -> Region {
        return regions::Box{std::move(body), vector3("center", center), vector3("size", size), frame.value_or("")};
      },
      py::arg("body"), py::arg("center"), py::arg("size"), py::arg("frame") = py::none(),
      "Position inside a box along the frame's axes; full edge lengths [m], inf for no limit.");
  module.def(
      "Disc",
      [](std::string body, const ArrayLike& center, const Number& radius, const Frame& frame) -> Region {
        return regions::Disc{std::move(body), vector2("center", center), real("radius", radius), frame.value_or("")};
      },
      py::arg("body"), py::arg("center"), py::arg("radius"), py::arg("frame") = py::none(),
      "Distance from the center (2,) in x and y <= radius [m].");
  module.def(
      "AnnularSector",
      [](std::string body, const ArrayLike& center, const Number& radius, const Number& half_width,
         const Number& start_angle, const Number& sweep, const Frame& frame) -> Region {
        warn_of_angle("start_angle", real("start_angle", start_angle));
        return regions::AnnularSector{std::move(body),
                                      vector2("center", center),
                                      real("radius", radius),
                                      real("half_width", half_width),
                                      real("start_angle", start_angle),
                                      real("sweep", sweep),
                                      frame.value_or("")};
      },
      py::arg("body"), py::arg("center"), py::arg("radius"), py::arg("half_width"), py::arg("start_angle"),
      py::arg("sweep"), py::arg("frame") = py::none(),
      "What an arc about a center (2,) of mean radius and half width [m] sweeps in x and y, from start_angle by sweep "
      "[rad], positive counter-clockwise.");
  module.def(
      "Swept",
      [](std::string body, std::string by, const Number& half_width, const Number& behind, const Number& ahead,
         const Number& least_speed, const Number& disc_radius,
         const std::optional<std::map<std::string, ArrayLike>>& at, const Number& beyond) -> Region {
        return regions::Swept{std::move(body),
                              std::move(by),
                              real("half_width", half_width),
                              real("behind", behind),
                              real("ahead", ahead),
                              real("least_speed", least_speed),
                              real("disc_radius", disc_radius),
                              at ? std::make_optional(planar_motion(*at)) : std::nullopt,
                              real("beyond", beyond)};
      },
      py::arg("body"), py::arg("by"), py::kw_only(), py::arg("half_width"), py::arg("behind"), py::arg("ahead"),
      py::arg("least_speed"), py::arg("disc_radius"), py::arg("at") = py::none(), py::arg("beyond") = 0.0,
      "Inside what the body `by` is about to sweep in x and y: an annular sector about its instantaneous centre of "
      "rotation, half_width [m] on each side of its path, from `behind` [m] behind it to `beyond` [m] "
      "beyond `ahead` [s] of its motion; "
      "below least_speed [m/s] a disc of disc_radius [m] about it. at: dict of position (2,), velocity (2,), yaw_rate, "
      "a motion to fix the sweep in the world; by default the state's own.");
  module.def(
      "HalfSpace",
      [](std::string body, const ArrayLike& normal, const Number& offset, const Frame& frame,
         const Number& ahead) -> Region {
        return regions::HalfSpace{std::move(body), vector3("normal", normal), real("offset", offset),
                                  frame.value_or(""), real("ahead", ahead)};
      },
      py::arg("body"), py::arg("normal"), py::arg("offset"), py::arg("frame") = py::none(), py::kw_only(),
      py::arg("ahead") = 0.0,
      "normal . position <= offset [m]; the normal is a unit vector. Where the frame's body moves along the normal it "
      "reaches further, by what that covers in `ahead` [s].");
  module.def(
      "Speed",
      [](std::string body, const Number& limit, const ArrayLike& point, const Frame& frame, bool along_world,
         const std::optional<ArrayLike>& along) -> Region {
        return regions::Speed{std::move(body),
                              real("limit", limit),
                              vector3("point", point),
                              frame.value_or(""),
                              along_world,
                              along ? std::make_optional(vector3("along", *along)) : std::nullopt};
      },
      py::arg("body"), py::arg("limit"), py::arg("point") = py::make_tuple(0.0, 0.0, 0.0),
      py::arg("frame") = py::none(), py::arg("along_world") = false, py::arg("along") = py::none(),
      "|velocity of a point of the body| <= limit [m/s]; the point is in its frame or, `along_world`, from its origin "
      "along the world's axes. along: a unit vector (3,); the velocity along it counts alone, and may be negative.");
  module.def(
      "Tilt",
      [](std::string body, const ArrayLike& axis, const ArrayLike& reference, const Number& limit,
         const Frame& frame) -> Region {
        return regions::Tilt{std::move(body), vector3("axis", axis), vector3("reference", reference),
                             real("limit", limit), frame.value_or("")};
      },
      py::arg("body"), py::arg("axis"), py::arg("reference"), py::arg("limit"), py::arg("frame") = py::none(),
      "The angle between the body's axis and the reference is at most limit [rad].");
  module.def(
      "Predicate", [](const StatesPredicate& function) -> Region { return python_predicate(function.value); },
      py::arg("function"), "A user's own function of states, (N, n) -> (N,) bool. It cannot be saved to a file.");
}

}  // namespace

void bind_regions(py::module_& module) {
  py::class_<Region>(module, "Region", "A set of states; combine with & | ~. Built by the functions of em.regions.")
      .def("contains", &contains, py::arg("scene"), py::arg("states"),
           "Membership of one state (n,) as bool, or of several (N, n) as an array (N,). Raises ValueError if the "
           "region names a body that the scene does not have.")
      .def(
          "__and__", [](const Region& a, const Region& b) { return a & b; }, py::is_operator())
      .def(
          "__or__", [](const Region& a, const Region& b) { return a | b; }, py::is_operator())
      .def("__invert__", [](const Region& a) { return ~a; })
      .def("__bool__", [](const Region&) -> bool {
        throw py::type_error(
            "a Region is neither true nor false: combine regions with &, | and ~, not with and, or "
            "and not; for None write `region is None`");
      });
  py::module_ primitives = module.def_submodule("regions", "Sets of states, in the world's frame or another body's.");
  bind_primitives(primitives);
}

}  // namespace energymargin::binding
