// Regions and users' predicates for Python.

#include "energymargin/region.hpp"

#include "base/check.hpp"
#include "callbacks.hpp"
#include "energymargin/membership.hpp"
#include "records.hpp"
#include "sets/records.hpp"

namespace energymargin::binding {

template <>
inline constexpr bool may_be_none<std::string, regions::FrameOf> = true;

namespace {

// A predicate may ask a region of predicates, and so on: Python's own limit on recursion would come too late.
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

py::object contains(const Region& region, const Given<Scene>& scene_given, const GivenArray& states) {
  const Scene& scene = given_object("scene", scene_given);
  const Membership member(region, scene);
  const int dimension = StateLayout(scene).dimension();
  if (is_single("states", states)) return py::bool_(member(vector("states", states.value, dimension)));
  return py::cast(member(matrix("states", states, -1, dimension)));
}

using StatesPredicate = py::typing::Callable<GivenArray(py::array_t<double>)>;

// As one writes it, with the bodies alone: numbers would hide what it is made of.
struct Text {
  std::string of(const Region& region) const { return std::visit(*this, region.expression()); }
  std::string all(const std::vector<Region>& parts, const char* sign) const {
    std::string text;
    for (const Region& part : parts) text += (text.empty() ? "" : sign) + of(part);
    return "(" + text + ")";
  }
  template <typename Primitive>
  std::string operator()(const Primitive& set) const {
    return class_name(record_of<Primitive>.name) + "('" + set.body + "')";
  }
  std::string operator()(const regions::Joint& set) const { return "Joint('" + set.joint + "')"; }
  std::string operator()(const regions::Touching& set) const {
    return "Touching('" + set.body + "', '" + set.other + "')";
  }
  std::string operator()(const regions::Predicate&) const { return "Predicate"; }
  std::string operator()(const regions::Intersection& set) const { return all(set.of, " & "); }
  std::string operator()(const regions::Union& set) const { return all(set.of, " | "); }
  std::string operator()(const regions::Complement& set) const { return "~" + of(set.of.front()); }
};

void bind_region(py::module_& module) {
  py::class_<Region, Owner<Region>>(module, "Region", collected<Region>(),
                                    "A set of states; combine with & | ~. Built by the functions of em.regions.")
      .def("contains", &contains, py::arg("scene"), py::arg("states"),
           "Membership of one state (n,) as bool, or of several (N, n) as an array (N,). Raises ValueError if the "
           "region names a body that the scene does not have.")
      .def(
          "__and__", [](const Region& a, const Region& b) { return a & b; }, py::is_operator())
      .def(
          "__or__", [](const Region& a, const Region& b) { return a | b; }, py::is_operator())
      .def("__repr__", [](const Region& region) { return "Region(" + Text{}.of(region) + ")"; })
      .def("__invert__", [](const Region& a) { return ~a; })
      .def("__bool__", [](const Region&) -> bool {
        throw py::type_error(
            "a Region is neither true nor false: combine regions with &, | and ~, not with and, or and not; for None "
            "write `region is None`");
      });
}

template <typename Primitive>
void def_region(py::module_& module, const Signature& signature) {
  const auto make = +[](Primitive primitive) -> Region {
    if constexpr (std::is_same_v<Primitive, regions::AnnularSector>) {
      warn(implausible_angle("start_angle", primitive.start_angle));
    }
    return primitive;
  };
  const std::string doc =
      std::string(record_of<Primitive>.description) + "\n\n" + fields_doc(record_of<Primitive>.fields);
  def_function(module, class_name(record_of<Primitive>.name).c_str(), doc, record_of<Primitive>.fields, signature,
               make);
}

}  // namespace

Mask AskedPredicate::operator()(const States& states) const {
  const WithGil acquire;
  const PredicateLevel level;
  py::array answer;
  try {
    answer = array_of(function.function()(py::cast(states)));
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
}

void bind_regions(py::module_& module) {
  bind_region(module);
  py::module_ primitives =
      module.def_submodule("regions",
                           "Sets of states, in the world's frame or another body's. `point` of those about a position: "
                           "the body's \"origin\", that of its shape's frame, or its \"center_of_mass\".");
  def_region<regions::Ball>(primitives, {4});
  def_region<regions::Box>(primitives, {4});
  def_region<regions::Disc>(primitives, {4});
  def_region<regions::AnnularSector>(primitives, {7});
  def_region<regions::Swept>(primitives, {2});
  def_region<regions::HalfSpace>(primitives, {4});
  def_region<regions::Speed>(primitives, {6, {"point"}});
  def_region<regions::Tilt>(primitives, {5});
  def_region<regions::Joint>(primitives, {1});
  def_region<regions::Touching>(primitives, {2});
  primitives.def(
      "Predicate",
      [](const Given<StatesPredicate>& function) -> Region {
        return regions::Predicate{AskedPredicate{Callback(given("function", function))}};
      },
      py::arg("function"), "A user's own function of states, (N, n) -> (N,) bool. It cannot be saved to a file.");
}

}  // namespace energymargin::binding
