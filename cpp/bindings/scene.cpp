// Shapes and scenes for Python.

#include "energymargin/scene.hpp"

#include "door.hpp"
#include "energymargin/state.hpp"

namespace energymargin::door {
namespace {

double yaw_of(const Quaternion& q) {
  return std::atan2(2.0 * (q.w() * q.z() + q.x() * q.y()), 1.0 - 2.0 * (q.y() * q.y() + q.z() * q.z()));
}

std::optional<ArrayLike> entry(const py::dict& dict, const char* key) {
  if (!dict.contains(key)) return std::nullopt;
  return ArrayLike{dict[key]};
}

// A body's state from a dict of position, orientation or yaw, velocity, angular_velocity.
BodyState body_state(const std::string& name, const py::dict& dict, BodyState state) {
  for (const auto& item : dict) {
    const auto key = py::str(item.first).cast<std::string>();
    if (key != "position" && key != "orientation" && key != "yaw" && key != "velocity" && key != "angular_velocity") {
      throw std::invalid_argument(name + " has '" + key +
                                  "', expected position, orientation, yaw, velocity or angular_velocity");
    }
  }
  std::optional<double> yaw;
  if (dict.contains("yaw")) yaw = vector(name + ": yaw", {py::make_tuple(dict["yaw"])}, 1)[0];
  if (const auto v = entry(dict, "position")) state.position = vector3(name + ": position", *v);
  state.orientation = orientation(name + ": ", entry(dict, "orientation"), yaw, state.orientation);
  if (const auto v = entry(dict, "velocity")) state.velocity = vector3(name + ": velocity", *v);
  if (const auto v = entry(dict, "angular_velocity")) {
    state.angular_velocity = vector3(name + ": angular_velocity", *v);
  }
  return state;
}

State pack_dicts(const Scene& scene, const py::KWArgs<py::typing::Dict<py::str, py::object>>& bodies) {
  std::map<std::string, BodyState> states;
  for (const auto& item : bodies) {
    const auto name = item.first.cast<std::string>();
    if (!py::isinstance<py::dict>(item.second)) {
      throw std::invalid_argument(name + " is not a dict, expected dict(position=..., velocity=..., ...)");
    }
    const Body& body = scene.body(name);
    states[name] = body_state(name, item.second.cast<py::dict>(), body.state);
  }
  return pack(scene, states);
}

BodyDicts unpack_dicts(const Scene& scene, const ArrayLike& state) {
  py::dict bodies;
  for (const auto& [name, body] : unpack(scene, vector("state", state, -1))) {
    py::dict dict;
    dict["position"] = body.position;
    dict["orientation"] = Eigen::Vector4d(body.orientation.coeffs());
    dict["velocity"] = body.velocity;
    dict["angular_velocity"] = body.angular_velocity;
    dict["yaw"] = yaw_of(body.orientation);
    bodies[py::str(name)] = dict;
  }
  return {bodies};
}

template <typename S>
S validated(S shape) {
  validate(Shape(shape));
  return shape;
}

py::array_t<double> point_array(const std::vector<Vector3>& points) {
  py::array_t<double> array({static_cast<py::ssize_t>(points.size()), py::ssize_t{3}});
  auto view = array.mutable_unchecked<2>();
  for (py::ssize_t i = 0; i < view.shape(0); ++i) {
    for (py::ssize_t j = 0; j < 3; ++j) view(i, j) = points[static_cast<std::size_t>(i)][j];
  }
  return array;
}

void bind_shapes(py::module_& module) {
  py::class_<Plane>(module, "Plane", "The half space below a plane: {x : normal . x <= offset}.")
      .def_readonly("normal", &Plane::normal, "Unit vector out of the solid, shape (3,).")
      .def_readonly("offset", &Plane::offset, "Of the surface along the normal [m].");
  py::class_<Box>(module, "Box", "A box with full edge lengths `size`, shape (3,) [m].")
      .def(py::init([](const ArrayLike& size) { return validated(Box{vector3("size", size)}); }), py::arg("size"))
      .def_readonly("size", &Box::size);
  py::class_<Sphere>(module, "Sphere", "A sphere of `radius` [m].")
      .def(py::init([](const Number& radius) { return validated(Sphere{real("radius", radius)}); }), py::arg("radius"))
      .def_readonly("radius", &Sphere::radius);
  py::class_<Cylinder>(module, "Cylinder", "A cylinder about its own z axis, `radius` and full `length` [m].")
      .def(py::init([](const Number& radius, const Number& length) {
             return validated(Cylinder{real("radius", radius), real("length", length)});
           }),
           py::arg("radius"), py::arg("length"))
      .def_readonly("radius", &Cylinder::radius)
      .def_readonly("length", &Cylinder::length);
  py::class_<Capsule>(module, "Capsule", "A capsule about its own z axis; `length` is that of its tube [m].")
      .def(py::init([](const Number& radius, const Number& length) {
             return validated(Capsule{real("radius", radius), real("length", length)});
           }),
           py::arg("radius"), py::arg("length"))
      .def_readonly("radius", &Capsule::radius)
      .def_readonly("length", &Capsule::length);
  py::class_<ConvexHull>(module, "ConvexHull",
                         "The convex hull of points, shape (n, 3) [m]. Its centre of mass has to be the origin.")
      .def(py::init([](const ArrayLike& rows) { return validated(ConvexHull{points("points", rows)}); }),
           py::arg("points"))
      .def_property_readonly("points", [](const ConvexHull& hull) { return point_array(hull.points); })
      .def("centered", &centered, "The hull with its centre of mass moved to the origin.");
}

void bind_body(py::module_& module) {
  py::class_<Body>(module, "Body", "One body of a scene.")
      .def_readonly("name", &Body::name)
      .def_readonly("shape", &Body::shape)
      .def_readonly("mass", &Body::mass, "[kg]; 0: fixed.")
      .def_readonly("friction", &Body::friction, "A contact's coefficient is the product of its two bodies'.")
      .def_property_readonly(
          "role", [](const Body& body) { return role_name(body.role); }, "'object', 'effector' or 'none'.")
      .def_property_readonly(
          "position", [](const Body& body) { return body.state.position; }, "Shape (3,) [m].")
      .def_property_readonly(
          "orientation", [](const Body& body) { return Eigen::Vector4d(body.state.orientation.coeffs()); },
          "Unit quaternion x, y, z, w.")
      .def_property_readonly(
          "velocity", [](const Body& body) { return body.state.velocity; }, "Shape (3,) [m/s].")
      .def_property_readonly(
          "angular_velocity", [](const Body& body) { return body.state.angular_velocity; }, "Shape (3,) [rad/s].")
      .def_property_readonly("fixed", &Body::fixed);
}

constexpr const char* add_body_doc = R"(Add a body.

position and orientation (unit quaternion x, y, z, w, or a yaw angle about z [rad]) are those of its centre of mass;
velocity [m/s] and angular_velocity [rad/s] are in the world's axes. mass [kg] of 0 fixes it. role is 'object' (the body
that disturbances act on), 'effector' or 'none'. The factors lock axes: 0 locked, 1 free; linear_factor=(1, 1, 0),
angular_factor=(0, 0, 1) makes a planar body. Raises ValueError on bad values.)";

}  // namespace

void bind_scene(py::module_& module) {
  bind_shapes(module);
  bind_body(module);
  py::class_<Scene>(module, "Scene", "What there is: bodies under gravity [m/s^2], and how the physics is stepped.")
      .def(py::init([](const ArrayLike& gravity, const Number& step, const WholeNumber& solver_iterations,
                       const Number& solver_tolerance, const std::optional<Number>& margin) {
             return Scene(vector3("gravity", gravity),
                          Stepping{real("step", step), count("solver_iterations", solver_iterations),
                                   real("solver_tolerance", solver_tolerance), real("margin", margin)});
           }),
           py::arg("gravity") = py::make_tuple(0.0, 0.0, -9.81), py::arg("step") = Stepping{}.step,
           py::arg("solver_iterations") = Stepping{}.iterations, py::arg("solver_tolerance") = Stepping{}.tolerance,
           py::arg("margin") = py::none())
      .def(
          "add_plane",
          [](Scene& scene, const std::string& name, const ArrayLike& normal, const Number& offset,
             const Number& friction) {
            Body body;
            body.name = name;
            body.shape = Plane{vector3("normal", normal), real("offset", offset)};
            body.friction = real("friction", friction);
            scene.add_body(body);
          },
          py::arg("name"), py::kw_only(), py::arg("normal") = py::make_tuple(0.0, 0.0, 1.0), py::arg("offset") = 0.0,
          py::arg("friction") = 0.5, "Add the fixed half space below a plane; by default z <= 0.")
      .def(
          "add_body",
          [](Scene& scene, const std::string& name, const Shape& shape, const Number& mass, const ArrayLike& position,
             const std::optional<ArrayLike>& quaternion_xyzw, const std::optional<Number>& yaw,
             const ArrayLike& velocity, const ArrayLike& angular_velocity, const Number& friction,
             const std::string& role_given, const ArrayLike& linear_factor, const ArrayLike& angular_factor) {
            Body body;
            body.name = name;
            body.shape = shape;
            body.mass = real("mass", mass);
            body.state = {vector3("position", position),
                          orientation("", quaternion_xyzw, real("yaw", yaw), Quaternion::Identity()),
                          vector3("velocity", velocity), vector3("angular_velocity", angular_velocity)};
            body.friction = real("friction", friction);
            body.role = role(role_given);
            body.linear_factor = vector3("linear_factor", linear_factor);
            body.angular_factor = vector3("angular_factor", angular_factor);
            scene.add_body(body);
          },
          py::arg("name"), py::arg("shape"), py::kw_only(), py::arg("mass"),
          py::arg("position") = py::make_tuple(0.0, 0.0, 0.0), py::arg("orientation") = py::none(),
          py::arg("yaw") = py::none(), py::arg("velocity") = py::make_tuple(0.0, 0.0, 0.0),
          py::arg("angular_velocity") = py::make_tuple(0.0, 0.0, 0.0), py::arg("friction") = 0.5,
          py::arg("role") = "none", py::arg("linear_factor") = py::make_tuple(1.0, 1.0, 1.0),
          py::arg("angular_factor") = py::make_tuple(1.0, 1.0, 1.0), add_body_doc)
      .def("pack", &pack_dicts,
           "State vector, shape (n,): scene.pack(box=dict(position=..., yaw=..., velocity=...)). What is left out has "
           "the scene's own value. Raises ValueError on unknown bodies or keys and bad values.")
      .def("unpack", &unpack_dicts, py::arg("state"),
           "Dict of dicts by body: position (3,), orientation (4,), velocity (3,), angular_velocity (3,), yaw.")
      .def(
          "slice",
          [](const Scene& scene, const std::string& name) {
            const int offset = StateLayout(scene).offset(scene.index(name));
            if (offset < 0) throw std::invalid_argument("body '" + name + "' is fixed, expected one that can move");
            return py::slice(offset, offset + StateLayout::numbers_per_body, 1);
          },
          py::arg("name"),
          "Where a body's 13 numbers stand in a state: position 3, quaternion 4, velocity 3, angular velocity 3.")
      .def_property_readonly(
          "dimension", [](const Scene& scene) { return StateLayout(scene).dimension(); },
          "n, numbers in a state vector.")
      .def_property_readonly("bodies", [](const Scene& scene) { return scene.bodies(); })
      .def_property_readonly("gravity", [](const Scene& scene) { return scene.gravity(); })
      .def_property_readonly(
          "step", [](const Scene& scene) { return scene.stepping().step; }, "[s]")
      .def_property_readonly("solver_iterations", [](const Scene& scene) { return scene.stepping().iterations; })
      .def_property_readonly("solver_tolerance", [](const Scene& scene) { return scene.stepping().tolerance; })
      .def_property_readonly("margin", [](const Scene& scene) { return scene.stepping().margin; }, "[m]");
}

}  // namespace energymargin::door
