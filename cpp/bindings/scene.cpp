// Shapes and scenes for Python.

#include "energymargin/scene.hpp"

#include "convert.hpp"
#include "described.hpp"
#include "energymargin/state.hpp"
#include "warnings.hpp"

namespace energymargin::binding {
namespace {

double yaw_of(const Quaternion& q) {
  return std::atan2(2.0 * (q.w() * q.z() + q.x() * q.y()), 1.0 - 2.0 * (q.y() * q.y() + q.z() * q.z()));
}

std::optional<ArrayLike> entry(const py::dict& dict, const char* key) {
  if (!dict.contains(key)) return std::nullopt;
  return ArrayLike{dict[key]};
}

constexpr const char* compound_doc = R"(Several solids that move as one.

parts: Parts, or solids that stand at the body's frame; without any there is nothing to collide with. solid: the mass
properties, for a mass of 1 kg, of the solid that the parts stand for, as for a mesh; by default those of the parts
together. Raises ValueError on values that no solid can have.)";

constexpr const char* inertial_doc = R"(How a body's mass is inertial, in the body's frame.

center: the centre of mass [m]; inertia: about it, principal moments (3,) or a matrix (3, 3) [kg m^2], along axes, by
default the frame's, or those of a frame turned by this unit quaternion (x, y, z, w). Raises ValueError unless it is symmetric, positive, and such that a rigid body can have it.)";

// A body's state from a dict of position, orientation or yaw, velocity, angular_velocity.
BodyState body_state(const std::string& name, const py::dict& dict, BodyState state) {
  for (const auto& item : dict) {
    const std::string key = word(name + ": key", item.first);
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

// A joint's state from a number, its position, or a dict of position and velocity.
JointState joint_state(const std::string& name, const py::handle& given, JointState state) {
  if (!py::isinstance<py::dict>(given)) {
    state.position = real(name, Number{py::reinterpret_borrow<py::object>(given)});
    return state;
  }
  for (const auto& item : given.cast<py::dict>()) {
    const std::string key = word(name + ": key", item.first);
    if (key != "position" && key != "velocity") {
      throw std::invalid_argument(name + " has '" + key + "', expected position or velocity");
    }
    (key == "position" ? state.position : state.velocity) =
        real(name + ": " + key, Number{py::reinterpret_borrow<py::object>(item.second)});
  }
  return state;
}

State pack_dicts(const Scene& scene, const std::optional<py::typing::Dict<py::str, py::object>>& joints_given,
                 const py::KWArgs<py::typing::Dict<py::str, py::object>>& bodies_given) {
  std::map<std::string, BodyState> bodies;
  for (const auto& item : bodies_given) {
    const std::string name = word("body", item.first);
    if (!py::isinstance<py::dict>(item.second)) {
      throw std::invalid_argument(name + " is not a dict, expected dict(position=..., velocity=..., ...)");
    }
    bodies[name] = body_state(name, item.second.cast<py::dict>(), scene.body(name).state);
  }
  std::map<std::string, JointState> joints;
  for (const auto& item : joints_given ? py::dict(*joints_given) : py::dict()) {
    const std::string name = word("joint", item.first);
    joints[name] = joint_state("joint '" + name + "'", item.second, scene.joints()[scene.joint_index(name)].state);
  }
  return pack(scene, bodies, joints);
}

BodyDicts unpack_dicts(const Scene& scene, const ArrayLike& state) {
  const Unpacked unpacked = unpack(scene, vector("state", state, -1));
  py::dict dicts;
  for (const auto& [name, body] : unpacked.bodies) {
    py::dict dict;
    dict["position"] = body.position;
    dict["orientation"] = Eigen::Vector4d(body.orientation.coeffs());
    dict["velocity"] = body.velocity;
    dict["angular_velocity"] = body.angular_velocity;
    dict["yaw"] = yaw_of(body.orientation);
    dicts[py::str(name)] = dict;
  }
  if (!unpacked.joints.empty()) {
    py::dict joints;
    for (const auto& [name, joint] : unpacked.joints) {
      py::dict dict;
      dict["position"] = joint.position;
      dict["velocity"] = joint.velocity;
      joints[py::str(name)] = dict;
    }
    dicts["joints"] = joints;
  }
  return {dicts};
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

// A part from a Part, or from a bare solid at the body's frame.
Part part(const std::variant<Part, Solid>& given) {
  if (const auto* solid = std::get_if<Solid>(&given)) return {*solid, {}};
  return std::get<Part>(given);
}

Compound compound(const std::vector<std::variant<Part, Solid>>& given, const std::optional<MassProperties>& solid) {
  Compound made;
  for (const auto& one : given) made.parts.push_back(part(one));
  made.solid = solid;
  return validated(made);
}

// Principal moments (3,), or the whole matrix (3, 3).
Inertial inertial_of(const ArrayLike& center, const ArrayLike& inertia, const std::optional<ArrayLike>& axes) {
  const py::array array = array_of(inertia.value);
  const bool single = array && array.ndim() == 1;
  const Eigen::Matrix3d matrix_given = single ? Eigen::Matrix3d(vector3("inertia", inertia).asDiagonal())
                                              : Eigen::Matrix3d(matrix("inertia", inertia, 3, 3));
  return inertial(vector3("center", center), matrix_given, axes ? quaternion("axes", *axes) : Quaternion::Identity());
}

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
  warn_of_density("density", *density);
  return *density * volume;
}

void bind_mass(py::module_& module) {
  py::class_<MassProperties>(module, "MassProperties", "How a solid of even density resists to motion.")
      .def(py::init([](const Number& volume, const ArrayLike& center, const ArrayLike& moments, const ArrayLike& axes) {
             return MassProperties{real("volume", volume), vector3("center", center), vector3("moments", moments),
                                   quaternion("axes", axes)};
           }),
           py::arg("volume"), py::arg("center"), py::arg("moments"), py::arg("axes") = py::make_tuple(0., 0., 0., 1.))
      .def_readonly("volume", &MassProperties::volume, "[m^3].")
      .def_readonly("center", &MassProperties::center, "Centre of mass in the shape's frame, shape (3,) [m].")
      .def_readonly("moments", &MassProperties::moments, "Principal moments about the centre, shape (3,) [kg m^2].")
      .def_property_readonly(
          "axes", [](const MassProperties& mass) { return Eigen::Vector4d(mass.axes.coeffs()); },
          "Unit quaternion x, y, z, w that turns the principal axes into the shape's.");
  py::class_<Inertial>(module, "Inertial", inertial_doc)
      .def(py::init(&inertial_of), py::arg("center") = py::make_tuple(0.0, 0.0, 0.0), py::kw_only(), py::arg("inertia"),
           py::arg("axes") = py::none())
      .def_readonly("center", &Inertial::center, "Centre of mass, shape (3,) [m].")
      .def_readonly("moments", &Inertial::moments, "Principal moments about the centre, shape (3,) [kg m^2].")
      .def_property_readonly(
          "axes", [](const Inertial& inertial) { return Eigen::Vector4d(inertial.axes.coeffs()); },
          "Unit quaternion x, y, z, w that turns the principal axes into the body's.");
}

void bind_mass_properties(py::module_& module) {
  module.def(
      "mass_properties",
      [](const Shape& shape, const Number& mass) { return mass_properties(shape, real("mass", mass)); },
      py::arg("shape"), py::arg("mass") = 1.0, "Mass properties of a solid shape of a mass [kg], of even density.");
}

void bind_shapes(py::module_& module) {
  py::class_<Plane>(module, "Plane", "The half space below a plane: {x : normal . x <= offset}.")
      .def_readonly("normal", &Plane::normal, "Unit vector out of the solid, shape (3,).")
      .def_readonly("offset", &Plane::offset, "Of the surface along the normal [m].");
  py::class_<Box>(module, "Box", "A box with full edge lengths `size`, shape (3,) [m].")
      .def(py::init([](const ArrayLike& size) { return validated(Box{vector3("size", size)}); }), py::arg("size"))
      .def_readonly("size", &Box::size, "Whole lengths of its edges, shape (3,) [m].");
  py::class_<Sphere>(module, "Sphere", "A sphere of `radius` [m].")
      .def(py::init([](const Number& radius) { return validated(Sphere{real("radius", radius)}); }), py::arg("radius"))
      .def_readonly("radius", &Sphere::radius, "[m].");
  py::class_<Cylinder>(module, "Cylinder", "A cylinder about its own z axis, `radius` and full `length` [m].")
      .def(py::init([](const Number& radius, const Number& length) {
             return validated(Cylinder{real("radius", radius), real("length", length)});
           }),
           py::arg("radius"), py::arg("length"))
      .def_readonly("radius", &Cylinder::radius, "[m].")
      .def_readonly("length", &Cylinder::length, "Along z [m].");
  py::class_<Capsule>(module, "Capsule", "A capsule about its own z axis; `length` is that of its tube [m].")
      .def(py::init([](const Number& radius, const Number& length) {
             return validated(Capsule{real("radius", radius), real("length", length)});
           }),
           py::arg("radius"), py::arg("length"))
      .def_readonly("radius", &Capsule::radius, "[m].")
      .def_readonly("length", &Capsule::length, "Of the cylindrical part, along z [m].");
  py::class_<ConvexHull>(module, "ConvexHull", "The convex hull of points, shape (n, 3) [m], in the body's frame.")
      .def(py::init([](const ArrayLike& rows) { return validated(ConvexHull{points("points", rows)}); }),
           py::arg("points"))
      .def_property_readonly(
          "points", [](const ConvexHull& hull) { return point_array(hull.points); }, "Shape (n, 3) [m].")
      .def("centered", &centered, "The hull with its centre of mass moved to the origin.");
  py::class_<Part>(module, "Part", "A solid at its place in a Compound: position [m] and orientation (x, y, z, w).")
      .def(py::init([](const Solid& shape, const ArrayLike& position, const std::optional<ArrayLike>& turned) {
             return Part{
                 shape, {vector3("position", position), orientation("", turned, std::nullopt, Quaternion::Identity())}};
           }),
           py::arg("shape"), py::arg("position") = py::make_tuple(0.0, 0.0, 0.0), py::arg("orientation") = py::none())
      .def_readonly("shape", &Part::shape, "What it is.")
      .def_property_readonly(
          "position", [](const Part& part) { return part.pose.position; }, "In the body's frame, shape (3,) [m].")
      .def_property_readonly(
          "orientation", [](const Part& part) { return Eigen::Vector4d(part.pose.orientation.coeffs()); },
          "Unit quaternion x, y, z, w.");
  bind_mass(module);
  py::class_<Compound>(module, "Compound", compound_doc)
      .def(py::init(&compound), py::arg("parts"), py::arg("solid") = py::none())
      .def_readonly("parts", &Compound::parts, "Convex, each with its place.")
      .def_readonly("solid", &Compound::solid,
                    "Mass properties of a body of 1 kg, where the parts stand for another solid, as of a mesh; None: "
                    "those of the parts.");
  bind_mass_properties(module);
}

void bind_body(py::module_& module) {
  py::class_<Body>(module, "Body", "One body of a scene.")
      .def_readonly("name", &Body::name, "By which it is known in its scene.")
      .def_readonly("shape", &Body::shape, "What it is made of.")
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
      .def_readonly("linear_factor", &Body::linear_factor, "1: free along the axis, 0: locked; shape (3,).")
      .def_readonly("angular_factor", &Body::angular_factor, "1: free about the axis, 0: locked; shape (3,).")
      .def_readonly("inertial", &Body::inertial, "How its mass is inertial, or None: as its shape is.")
      .def_readonly("force", &Body::force, "Acts all the time, in the world's axes, shape (3,) [N].")
      .def_property_readonly("fixed", &Body::fixed, "Whether it has no mass, and never moves.");
}

void bind_joints(py::module_& module) {
  const auto position_of = [](Pose Joint::* pose) {
    return [pose](const Joint& joint) { return (joint.*pose).position; };
  };
  const auto orientation_of = [](Pose Joint::* pose) {
    return [pose](const Joint& joint) { return Eigen::Vector4d((joint.*pose).orientation.coeffs()); };
  };
  py::class_<Mimic>(module, "Mimic",
                    "A joint follows another: position = multiplier * (that joint's position) + offset, always.")
      .def(py::init([](std::string joint, const Number& multiplier, const Number& offset) {
             return Mimic{std::move(joint), real("multiplier", multiplier), real("offset", offset)};
           }),
           py::arg("joint"), py::arg("multiplier") = 1.0, py::arg("offset") = 0.0)
      .def_readonly("joint", &Mimic::joint, "The joint that is followed.")
      .def_readonly("multiplier", &Mimic::multiplier, "Of that joint's position.")
      .def_readonly("offset", &Mimic::offset, "[rad] or [m].");
  py::class_<Joint>(module, "Joint", "A joint of a scene; for a prismatic one read m for rad and N for N m.")
      .def_readonly("name", &Joint::name, "By which it is known in its scene.")
      .def_property_readonly(
          "type", [](const Joint& joint) { return joint_type_name(joint.type); }, "'revolute', 'prismatic' or 'fixed'.")
      .def_readonly("parent", &Joint::parent, "The body that carries it.")
      .def_readonly("child", &Joint::child, "The body that it moves.")
      .def_property_readonly("origin", position_of(&Joint::in_parent), "In the parent's frame, shape (3,) [m].")
      .def_property_readonly("orientation", orientation_of(&Joint::in_parent), "Unit quaternion x, y, z, w.")
      .def_property_readonly("child_origin", position_of(&Joint::in_child), "In the child's frame, shape (3,) [m].")
      .def_property_readonly("child_orientation", orientation_of(&Joint::in_child), "Unit quaternion x, y, z, w.")
      .def_readonly("axis", &Joint::axis, "In the joint's frame, shape (3,).")
      .def_property_readonly(
          "limits", [](const Joint& joint) { return std::pair(joint.lower, joint.upper); }, "[rad].")
      .def_property_readonly(
          "start", [](const Joint& joint) { return joint.state.position; }, "[rad].")
      .def_property_readonly(
          "start_velocity", [](const Joint& joint) { return joint.state.velocity; }, "[rad/s].")
      .def_readonly("held", &Joint::held, "Whether it keeps the position it has, whatever the load.")
      .def_readonly("target", &Joint::target, "[rad].")
      .def_readonly("target_velocity", &Joint::target_velocity, "[rad/s].")
      .def_readonly("stiffness", &Joint::stiffness, "[N m/rad].")
      .def_readonly("damping", &Joint::damping, "[N m s/rad].")
      .def_readonly("torque_limit", &Joint::torque_limit, "[N m].")
      .def_readonly("mimic", &Joint::mimic, "The Mimic by which it follows another joint, or None.");
  py::class_<Spring>(module, "Spring", "A spring between two bodies.")
      .def_readonly("body_a", &Spring::body_a, "One of its ends is on this body.")
      .def_readonly("body_b", &Spring::body_b, "The other one is on this body.")
      .def_readonly("point_a", &Spring::point_a, "In the frame of body_a, shape (3,) [m].")
      .def_readonly("point_b", &Spring::point_b, "In the frame of body_b, shape (3,) [m].")
      .def_readonly("stiffness", &Spring::stiffness, "[N/m].")
      .def_readonly("rest_length", &Spring::rest_length, "[m].")
      .def_readonly("damping", &Spring::damping, "Along the spring [N s/m].");
}

constexpr const char* add_joint_doc = R"(Hang the body `child` on the body `parent`, which makes it a link.

type is 'revolute' (limits and positions in rad), 'prismatic' (in m; a rail) or 'fixed'. The joint's frame is at
origin [m] and orientation (unit quaternion x, y, z, w) in the parent's frame, and at child_origin and child_orientation in
the child's; the two are one at position 0. axis is in the joint's frame. A link stands in no state vector: the joint's
position and velocity do, and start and start_velocity are theirs when nothing else is said.

mimic: the joint follows another one, as by a linkage without play, and has no limits, no drive, and no numbers in the
state of its own.

The joint is driven by position control with compliance: by the torque stiffness (target - position) + damping
(target_velocity - velocity), at most torque_limit [N m]; target is by default the start. held: it keeps the position that
it has in the state, whatever the load. A joint with neither moves freely.

The parent may be fixed, free or a link itself; a body has one parent, joints make no loops, and bodies on joints have no
locked axes. Bodies that a joint connects do not collide. Raises ValueError on bad values.)";

constexpr const char* add_spring_doc =
    R"(Add a spring between a point of one body and a point of another, in their frames.

It pulls with stiffness (length - rest_length) + damping * rate of the length. Raises ValueError on bad values, and on
a spring too stiff for the scene's step.)";

constexpr const char* scene_doc = R"(An empty scene.

gravity [m/s^2]. step [s]: of the simulation. solver_iterations: a step, at most, 1 to 10000; the solver stops early
below solver_tolerance, a squared residual. friction_directions: with 2, friction holds in any direction of the contact plane,
also against loads that come through other contacts; with 1 it acts along the velocity alone, which is right, and cheaper,
where bodies slide. Joints need 2. margin [m]: of collision shapes, by default a twentieth of each one's smallest half
extent.)";

constexpr const char* add_body_doc = R"(Add a body.

position and orientation (unit quaternion x, y, z, w, or a yaw angle about z [rad]) are those of its frame, which is its
shape's; velocity [m/s], of the frame's origin, and angular_velocity [rad/s] are in the world's axes. Either mass [kg] or
density [kg/m^3] says how heavy it is; a mass of 0 fixes it. inertial says where the centre of mass is, at which wrenches
act, and how the mass is inertial; by default as in the shape, evenly. role is 'object' (a body that disturbances act on),
'effector' or 'none'. The factors lock axes of the centre of mass: 0 locked, 1 free; linear_factor=(1, 1, 0),
angular_factor=(0, 0, 1) makes a planar body. force [N] acts on it all the time, in the world's axes, as a counterweight
or a motor does. Raises ValueError on bad values.)";

}  // namespace

void bind_scene(py::module_& module) {
  bind_shapes(module);
  bind_body(module);
  bind_joints(module);
  py::class_<Scene>(module, "Scene",
                    "What there is: bodies, joints and springs under gravity [m/s^2], and how the physics is stepped.")
      .def(py::init([](const ArrayLike& gravity, const Number& step, const WholeNumber& solver_iterations,
                       const Number& solver_tolerance, const WholeNumber& friction_directions,
                       const std::optional<Number>& margin) {
             return Scene(vector3("gravity", gravity),
                          Stepping{real("step", step), count("solver_iterations", solver_iterations),
                                   real("solver_tolerance", solver_tolerance),
                                   count("friction_directions", friction_directions), real("margin", margin)});
           }),
           py::arg("gravity") = py::make_tuple(0.0, 0.0, -9.81), py::arg("step") = Stepping{}.step,
           py::arg("solver_iterations") = Stepping{}.iterations, py::arg("solver_tolerance") = Stepping{}.tolerance,
           py::arg("friction_directions") = Stepping{}.friction_directions, py::arg("margin") = py::none(), scene_doc)
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
          [](Scene& scene, const std::string& name, const Shape& shape, const std::optional<Number>& mass,
             const std::optional<Number>& density, const std::optional<Inertial>& inertial, const ArrayLike& position,
             const std::optional<ArrayLike>& quaternion_xyzw, const std::optional<Number>& yaw,
             const ArrayLike& velocity, const ArrayLike& angular_velocity, const Number& friction,
             const std::string& role_given, const ArrayLike& linear_factor, const ArrayLike& angular_factor,
             const ArrayLike& force) {
            Body body;
            body.name = name;
            body.shape = shape;
            body.mass = mass_of(shape, real("mass", mass), real("density", density));
            body.inertial = inertial;
            body.state = {vector3("position", position),
                          orientation("", quaternion_xyzw, real("yaw", yaw), Quaternion::Identity()),
                          vector3("velocity", velocity), vector3("angular_velocity", angular_velocity)};
            body.friction = real("friction", friction);
            body.role = role(role_given);
            body.linear_factor = vector3("linear_factor", linear_factor);
            body.angular_factor = vector3("angular_factor", angular_factor);
            body.force = vector3("force", force);
            scene.add_body(body);
          },
          py::arg("name"), py::arg("shape"), py::kw_only(), py::arg("mass") = py::none(),
          py::arg("density") = py::none(), py::arg("inertial") = py::none(),
          py::arg("position") = py::make_tuple(0.0, 0.0, 0.0), py::arg("orientation") = py::none(),
          py::arg("yaw") = py::none(), py::arg("velocity") = py::make_tuple(0.0, 0.0, 0.0),
          py::arg("angular_velocity") = py::make_tuple(0.0, 0.0, 0.0), py::arg("friction") = 0.5,
          py::arg("role") = "none", py::arg("linear_factor") = py::make_tuple(1.0, 1.0, 1.0),
          py::arg("angular_factor") = py::make_tuple(1.0, 1.0, 1.0), py::arg("force") = py::make_tuple(0.0, 0.0, 0.0),
          add_body_doc)
      .def(
          "add_joint",
          [](Scene& scene, const std::string& name, const std::string& parent, const std::string& child,
             const std::string& type, const ArrayLike& origin, const std::optional<ArrayLike>& orientation_given,
             const ArrayLike& child_origin, const std::optional<ArrayLike>& child_orientation, const ArrayLike& axis,
             const std::pair<Number, Number>& limits, const Number& start, const Number& start_velocity, bool held,
             const std::optional<Number>& target, const Number& target_velocity, const Number& stiffness,
             const Number& damping, const Number& torque_limit, const std::optional<Mimic>& mimic) {
            const auto pose = [](const std::string& prefix, const ArrayLike& position,
                                 const std::optional<ArrayLike>& quaternion_xyzw) {
              return Pose{vector3(prefix + "origin", position),
                          orientation(prefix, quaternion_xyzw, std::nullopt, Quaternion::Identity())};
            };
            Joint joint;
            joint.name = name;
            joint.type = joint_type(type);
            joint.parent = parent;
            joint.child = child;
            joint.in_parent = pose("", origin, orientation_given);
            joint.in_child = pose("child_", child_origin, child_orientation);
            joint.axis = vector3("axis", axis);
            joint.lower = real("limits[0]", limits.first);
            joint.upper = real("limits[1]", limits.second);
            joint.state = {real("start", start), real("start_velocity", start_velocity)};
            joint.held = held;
            joint.target = real("target", target).value_or(joint.state.position);
            joint.target_velocity = real("target_velocity", target_velocity);
            joint.stiffness = real("stiffness", stiffness);
            joint.damping = real("damping", damping);
            joint.torque_limit = real("torque_limit", torque_limit);
            joint.mimic = mimic;
            scene.add_joint(std::move(joint));
          },
          py::arg("name"), py::kw_only(), py::arg("parent"), py::arg("child"), py::arg("type") = "revolute",
          py::arg("origin") = py::make_tuple(0.0, 0.0, 0.0), py::arg("orientation") = py::none(),
          py::arg("child_origin") = py::make_tuple(0.0, 0.0, 0.0), py::arg("child_orientation") = py::none(),
          py::arg("axis") = py::make_tuple(0.0, 0.0, 1.0),
          py::arg("limits") = py::make_tuple(Joint{}.lower, Joint{}.upper), py::arg("start") = 0.0,
          py::arg("start_velocity") = 0.0, py::arg("held") = false, py::arg("target") = py::none(),
          py::arg("target_velocity") = 0.0, py::arg("stiffness") = 0.0, py::arg("damping") = 0.0,
          py::arg("torque_limit") = Joint{}.torque_limit, py::arg("mimic") = py::none(), add_joint_doc)
      .def("disable_collisions", &Scene::disable_collisions, py::arg("body_a"), py::arg("body_b"),
           "From now on the two bodies never collide. Those that a joint connects never do.")
      .def_property_readonly(
          "disabled_collisions",
          [](const Scene& scene) {
            const auto& pairs = scene.disabled_collisions();
            return std::vector<std::pair<std::string, std::string>>(pairs.begin(), pairs.end());
          },
          "Pairs of bodies.")
      .def(
          "add_spring",
          [](Scene& scene, const std::string& body_a, const std::string& body_b, const Number& stiffness,
             const Number& rest_length, const Number& damping, const ArrayLike& point_a, const ArrayLike& point_b) {
            scene.add_spring({body_a, body_b, vector3("point_a", point_a), vector3("point_b", point_b),
                              real("stiffness", stiffness), real("rest_length", rest_length),
                              real("damping", damping)});
          },
          py::arg("body_a"), py::arg("body_b"), py::kw_only(), py::arg("stiffness"), py::arg("rest_length") = 0.0,
          py::arg("damping") = 0.0, py::arg("point_a") = py::make_tuple(0.0, 0.0, 0.0),
          py::arg("point_b") = py::make_tuple(0.0, 0.0, 0.0), add_spring_doc)
      .def("pack", &pack_dicts, py::kw_only(), py::arg("joints") = py::none(),
           "State vector, shape (n,): scene.pack(box=dict(position=..., yaw=..., velocity=...), joints=dict(knee=0.1, "
           "ankle=dict(position=..., velocity=...))). What is left out has the scene's own value. Raises ValueError on "
           "unknown bodies, joints or keys and bad values.")
      .def("unpack", &unpack_dicts, py::arg("state"),
           "Dict of dicts by body, links included: position (3,), orientation (4,), velocity (3,), angular_velocity "
           "(3,), yaw; and, if there are joints, under 'joints' a dict of dicts by joint: position, velocity.")
      .def(
          "slice",
          [](const Scene& scene, const std::string& name) {
            const int offset = StateLayout(scene).offset(scene.index(name));
            if (offset < 0) {
              throw std::invalid_argument("body '" + name + "' is fixed or a link, expected a free one");
            }
            return py::slice(offset, offset + StateLayout::numbers_per_body, 1);
          },
          py::arg("name"),
          "Where a free body's 13 numbers stand in a state: position 3, quaternion 4, velocity 3, angular velocity 3.")
      .def(
          "joint_slice",
          [](const Scene& scene, const std::string& name) {
            const int offset = StateLayout(scene).joint_offset(scene.joint_index(name));
            if (offset < 0)
              throw std::invalid_argument("joint '" + name +
                                          "' is fixed or follows another, expected one that moves by itself");
            return py::slice(offset, offset + StateLayout::numbers_per_joint, 1);
          },
          py::arg("name"), "Where a joint's position and velocity stand in a state.")
      .def_property_readonly(
          "dimension", [](const Scene& scene) { return StateLayout(scene).dimension(); },
          "n, numbers in a state vector.")
      .def("__repr__",
           [](const Scene& scene) {
             std::vector<std::string> names;
             for (const Body& body : scene.bodies()) names.push_back(body.name);
             return described("Scene", {{"bodies", py::cast(names)},
                                        {"joints", py::cast(scene.joints().size())},
                                        {"dimension", py::cast(StateLayout(scene).dimension())}});
           })
      .def_property_readonly(
          "bodies", [](const Scene& scene) { return scene.bodies(); }, "In the order in which they were added.")
      .def_property_readonly(
          "joints", [](const Scene& scene) { return scene.joints(); }, "In the order in which they were added.")
      .def_property_readonly(
          "springs", [](const Scene& scene) { return scene.springs(); }, "In the order in which they were added.")
      .def_property_readonly(
          "gravity", [](const Scene& scene) { return scene.gravity(); }, "Shape (3,) [m/s^2].")
      .def_property_readonly(
          "step", [](const Scene& scene) { return scene.stepping().step; }, "[s]")
      .def_property_readonly(
          "solver_iterations", [](const Scene& scene) { return scene.stepping().iterations; },
          "Most iterations of the contact solver a step.")
      .def_property_readonly(
          "friction_directions", [](const Scene& scene) { return scene.stepping().friction_directions; },
          "Of a contact: 1, along its sliding, or 2.")
      .def_property_readonly(
          "solver_tolerance", [](const Scene& scene) { return scene.stepping().tolerance; },
          "Squared change of speed at which the contact solver stops [m^2/s^2].")
      .def_property_readonly("margin", [](const Scene& scene) { return scene.stepping().margin; }, "[m]");
}

}  // namespace energymargin::binding
