// Bodies for Python.

#include "energymargin/plausible.hpp"
#include "energymargin/scene.hpp"
#include "problem/records.hpp"
#include "records.hpp"
#include "scene/records.hpp"

namespace energymargin::binding {
namespace {

constexpr const char* inertial_doc = R"(Mass properties of a body, in its frame.

center: the centre of mass [m]; inertia: about it, principal moments (3,) or a matrix (3, 3) [kg m^2], along axes, by
default the frame's, or those of a frame turned by this unit quaternion (x, y, z, w). Raises ValueError unless it is
symmetric, positive, and such that a rigid body can have it.)";

// Principal moments (3,), or the whole matrix (3, 3).
Inertial inertial_of(const Given<Vector3>& center, const GivenArray& inertia,
                     const Given<std::optional<Quaternion>>& axes) {
  const py::array array = array_of(inertia.value);
  const bool single = array && array.ndim() == 1;
  const Eigen::Matrix3d tensor = single ? Eigen::Matrix3d(vector("inertia", inertia.value, 3).asDiagonal())
                                        : Eigen::Matrix3d(matrix("inertia", inertia, 3, 3));
  return Inertial::from_tensor(given("center", center), tensor, given("axes", axes).value_or(Quaternion::Identity()));
}

constexpr const char* add_body_doc = R"(Add a body.

position and orientation (unit quaternion x, y, z, w, or a yaw angle about z [rad]) are those of its frame, which is its
shape's; velocities are in the world's axes. Either mass [kg] or density [kg/m^3] says how heavy it is; a mass of 0 fixes
it. role is 'object' (a body that disturbances act on), 'effector' or 'none'. The factors lock axes of the centre of mass:
linear_factor=(1, 1, 0), angular_factor=(0, 0, 1) makes a planar body. Raises ValueError on bad values.)";

// Exactly one of mass and density says how heavy a body is.
double mass_of(const Shape& shape, const std::optional<double>& mass, const std::optional<double>& density) {
  if (mass.has_value() == density.has_value()) {
    throw std::invalid_argument(mass ? "mass and density are both given, expected one of them"
                                     : "mass is not given, expected a mass [kg] or a density [kg/m^3]");
  }
  if (mass) return *mass;
  const double volume = mass_properties(shape, 1.0).volume;
  if (!(std::isfinite(*density) && *density > 0.0 && volume > 0.0)) {
    throw std::invalid_argument("density is " + std::to_string(*density) +
                                ", expected a finite number above 0, and a shape with a volume");
  }
  warn(implausible_density("density", *density));
  return *density * volume;
}

void add_plane(Scene& scene, const std::string& name, const Given<Vector3>& normal, const Given<double>& offset,
               const Given<double>& friction, const std::optional<Surface>& surface,
               const Given<Vector3>& surface_velocity) {
  Body body;
  body.name = name;
  body.shape = Plane{given("normal", normal), given("offset", offset)};
  body.friction = given("friction", friction);
  body.surface = surface;
  body.surface_velocity = given("surface_velocity", surface_velocity);
  scene.add_body(body);
}

void add_body(Body body, Scene& scene, const std::string& name, const Given<Shape>& shape,
              const Given<std::optional<double>>& mass, const Given<std::optional<double>>& density,
              const Given<Vector3>& position, const Given<std::optional<Quaternion>>& quaternion,
              const Given<std::optional<double>>& yaw) {
  body.name = name;
  body.shape = given("shape", shape);
  body.mass = mass_of(body.shape, given("mass", mass), given("density", density));
  body.state.position = given("position", position);
  body.state.orientation = orientation("", given("orientation", quaternion), given("yaw", yaw), Quaternion::Identity());
  scene.add_body(std::move(body));
}

Scene with_body(const Scene& scene, const std::string& name, const Given<std::optional<double>>& friction,
                const Given<std::optional<double>>& mass) {
  return scene.with_body(name, given("friction", friction), given("mass", mass));
}

constexpr const char* with_body_doc = R"(A copy with another friction coefficient or mass [kg] of one body.

Its inertia grows with its mass; coefficients of pairs stay. Raises ValueError on an unknown body, bad values, the mass of a
fixed body, and a spring that is too stiff for a lighter one.)";

}  // namespace

void bind_body(py::module_& module) {
  py::class_<Inertial> inertial(module, "Inertial", inertial_doc);
  inertial.def(py::init(&inertial_of), py::arg("center") = py::make_tuple(0.0, 0.0, 0.0), py::kw_only(),
               py::arg("inertia"), py::arg("axes") = py::none());
  def_fields(inertial, record_of<Inertial>.fields);
  module.attr("LEAST_GYRATION") = plausible::least_gyration;
  module.attr("MOST_GYRATION") = plausible::most_gyration;
  bind_record<Surface>(module, "Surface",
                       "How a body meets others, beside its friction; by default as a rigid body does.", {0});
  py::class_<Body> body(module, "Body", "One body of a scene.");
  def_fields(body, record_of<Body>.fields);
  body.def_property_readonly("fixed", &Body::fixed, "Whether it has no mass, and never moves.");
}

void bind_add_body(py::class_<Scene>& scene) {
  const Signature signature{
      99, {"velocity", "angular_velocity", "friction", "role", "linear_factor", "angular_factor", "force"}};
  def_function(scene, "add_body", add_body_doc + ("\n\n" + fields_doc(body_settings())), body_settings(), signature,
               &add_body, py::arg("name"), py::arg("shape"), py::kw_only(), py::arg("mass") = py::none(),
               py::arg("density") = py::none(), py::arg("position") = py::make_tuple(0.0, 0.0, 0.0),
               py::arg("orientation") = py::none(), py::arg("yaw") = py::none());
  scene
      .def("add_plane", &add_plane, py::arg("name"), py::kw_only(), py::arg("normal") = py::make_tuple(0.0, 0.0, 1.0),
           py::arg("offset") = 0.0, py::arg("friction") = 0.5, py::arg("surface") = py::none(),
           py::arg("surface_velocity") = py::make_tuple(0.0, 0.0, 0.0),
           "Add the fixed half space below a plane; by default z <= 0.")
      .def("with_body", &with_body, py::arg("name"), py::kw_only(), py::arg("friction") = py::none(),
           py::arg("mass") = py::none(), with_body_doc);
}

}  // namespace energymargin::binding
