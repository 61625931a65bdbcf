// Bodies, joints, tendons, loops and springs for Python.

#include "energymargin/plausible.hpp"
#include "energymargin/scene.hpp"
#include "energymargin/state.hpp"
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
                const Given<std::optional<double>>& mass, const Given<std::optional<double>>& torsional_friction,
                const Given<std::optional<double>>& rolling_friction) {
  return scene.with_body(
      name, {given("friction", friction), given("mass", mass), given("torsional_friction", torsional_friction),
             given("rolling_friction", rolling_friction)});
}

constexpr const char* with_body_doc =
    R"(A copy with other coefficients of friction (torsional and rolling [m]) or another mass [kg] of one body.

Its inertia grows with its mass; coefficients of pairs stay. Raises ValueError on an unknown body, bad values, the mass of a
fixed body, and a spring that is too stiff for a lighter one.)";

void def_add_body(py::class_<Scene>& scene) {
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
           py::arg("mass") = py::none(), py::arg("torsional_friction") = py::none(),
           py::arg("rolling_friction") = py::none(), with_body_doc);
}

constexpr const char* add_joint_doc = R"(Hang the body `child` on the body `parent`, which makes it a link.

type is 'revolute' (limits and positions in rad), 'prismatic' (in m; a rail) or 'fixed'. The joint's frame is at origin [m]
and orientation (unit quaternion x, y, z, w) in the parent's frame, and at child_origin and child_orientation in the child's;
the two are one at position 0. axis is in the joint's frame. start and start_velocity are where it is when a state does not
say. It is driven by the torque stiffness (target - position) + damping (target_velocity - velocity), at most torque_limit
[N m]; target is by default the start. held: it keeps the position that it has in the state, whatever the load. mimic: it
follows another joint, without limits and a drive of its own: the other one's torque_limit counts for both. armature:
inertia of the drive's rotor times the square of the gear ratio [kg m^2]. friction: dry friction, which resists motion by up
to this torque [N m]. For a prismatic joint read N for N m, and kg for kg m^2.

The parent may be fixed, free, kinematic or a link; a body has one parent, joints make no loops, and bodies on joints have no
locked axes. Bodies that a joint connects do not collide. Raises ValueError on bad values.)";

constexpr const char* add_spring_doc =
    R"(Add a spring between a point of one body and a point of another, in their frames.

It pulls with stiffness (length - rest_length) + damping * rate of the length. Raises ValueError on bad values, and on
a spring too stiff for the scene's step.)";

constexpr const char* add_tendon_doc =
    R"(Add a fixed tendon, whose length is the sum of joints' positions, each times a coefficient.

joints: {joint: coefficient}. limits, friction and the control are as those of a joint, along the length; target is by default
the length at the scene's start. A plan's targets may name it. Raises ValueError on bad values, a fixed joint, and joints on
more than two chains of links that hang on fixed bodies.)";

constexpr const char* add_loop_doc = R"(Tie a frame of one body to a frame of another: it closes a loop of joints.

type is 'point' (a ball joint: the frames' origins stay together) or 'weld' (the frames do). point_a, point_b [m] and
orientation_a, orientation_b (unit quaternions x, y, z, w) are in the bodies' frames; where they are apart at the start they
are pulled together. The bodies still collide unless disable_collisions says otherwise. Raises ValueError on bad values, and
on two bodies that no force moves.)";

// What files call otherwise.
auto renamed_fields() {
  return std::tuple{
      Field{"origin", [](auto& joint) -> auto& { return joint.in_parent.position; }, "In the parent's frame [m]."},
      Field{"orientation", [](auto& joint) -> auto& { return joint.in_parent.orientation; }, nullptr},
      Field{"child_origin", [](auto& joint) -> auto& { return joint.in_child.position; }, "In the child's frame [m]."},
      Field{"child_orientation", [](auto& joint) -> auto& { return joint.in_child.orientation; }, nullptr},
      Field{"start", [](auto& joint) -> auto& { return joint.state.position; }, "[rad]"},
      Field{"start_velocity", [](auto& joint) -> auto& { return joint.state.velocity; }, "[rad/s]"},
  };
}

using Limits = Given<std::pair<Given<double>, Given<double>>>;

template <typename Limited>
void set_limits(Limited& object, const Limits& limits) {
  const auto [lower, upper] =
      cast<std::pair<Given<double>, Given<double>>>("limits", limits.value, "a tuple (a number, a number)");
  object.lower = given("limits[0]", lower);
  object.upper = given("limits[1]", upper);
}

void def_add_joint(py::class_<Scene>& scene) {
  const auto add_joint = +[](Joint joint, Scene& its_scene, const std::string& name, const std::string& parent,
                             const std::string& child, const Given<JointType>& type, const Given<Vector3>& axis,
                             const Limits& limits, bool held, const Given<std::optional<double>>& target) {
    joint.name = name;
    joint.type = given("type", type);
    joint.parent = parent;
    joint.child = child;
    joint.axis = given("axis", axis);
    set_limits(joint, limits);
    joint.held = held;
    joint.target = given("target", target).value_or(joint.state.position);
    its_scene.add_joint(std::move(joint));
  };
  const Signature signature{99,
                            {"origin", "orientation", "child_origin", "child_orientation", "start", "start_velocity",
                             "target_velocity", "stiffness", "damping", "torque_limit"}};
  def_function(scene, "add_joint", add_joint_doc, std::tuple_cat(renamed_fields(), joint_drive()), signature, add_joint,
               py::arg("name"), py::kw_only(), py::arg("parent"), py::arg("child"), py::arg("type") = "revolute",
               py::arg("axis") = py::make_tuple(0.0, 0.0, 1.0),
               py::arg("limits") = py::make_tuple(Joint{}.lower, Joint{}.upper), py::arg("held") = false,
               py::arg("target") = py::none());
}

void def_add_tendon(py::class_<Scene>& scene) {
  const auto add_tendon =
      +[](Tendon tendon, Scene& its_scene, const std::string& name, const Given<std::map<std::string, double>>& joints,
          const Limits& limits, const Given<std::optional<double>>& target) {
        tendon.name = name;
        set_limits(tendon, limits);
        const State start = pack(its_scene);
        double length = 0.0;
        for (const auto& [key, number] : cast<py::dict>("joints", joints.value, "a dict {joint: coefficient}")) {
          const std::string joint = word("joints", key);
          const std::string place = "joints['" + joint + "']";
          tendon.joints.push_back({joint, convert(Type<double>{}, place, number)});
          require_finite(place, tendon.joints.back().coefficient);
          const JointState at = StateLayout(its_scene).joint(start.data(), its_scene.joint_index(joint));
          length += tendon.joints.back().coefficient * at.position;
        }
        tendon.target = given("target", target).value_or(length);
        its_scene.add_tendon(std::move(tendon));
      };
  const auto fields =
      std::tuple_cat(control_fields<Tendon>(), std::tuple{Field{"friction", &Tendon::friction, nullptr}});
  def_function(scene, "add_tendon", add_tendon_doc, fields,
               {99, {"target_velocity", "stiffness", "damping", "torque_limit", "friction"}}, add_tendon,
               py::arg("name"), py::arg("joints"), py::kw_only(),
               py::arg("limits") = py::make_tuple(Tendon{}.lower, Tendon{}.upper), py::arg("target") = py::none());
}

}  // namespace

void bind_bodies(py::module_& module) {
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
  bind_record<Mimic>(module, "Mimic",
                     "A joint follows another: position = multiplier * (that joint's position) + offset, always.",
                     {99, {"multiplier", "offset"}});
  py::class_<Joint> joint(module, "Joint", "A joint of a scene; for a prismatic one read m for rad and N for N m.");
  def_fields(joint, record_of<Joint>.fields, {"in_parent", "in_child", "lower", "upper", "position", "velocity"});
  def_fields(joint, renamed_fields());
  joint.def_property_readonly("limits", [](const Joint& of) { return std::pair(of.lower, of.upper); }, "[rad].");
  bind_record<TendonJoint>(module, "TendonJoint", "A joint of a tendon, and how much of its position counts.",
                           {99, {"coefficient"}});
  py::class_<Tendon> tendon(module, "Tendon", "A fixed tendon of a scene: a sum of joints' positions.");
  def_fields(tendon, record_of<Tendon>.fields, {"lower", "upper"});
  tendon.def_property_readonly(
      "limits", [](const Tendon& of) { return std::pair(of.lower, of.upper); }, "Of its length.");
  py::class_<Loop> loop(module, "Loop", "A frame of one body and one of another that stay together.");
  def_fields(loop, record_of<Loop>.fields);
  py::class_<Spring> spring(module, "Spring", "A spring between two bodies.");
  def_fields(spring, record_of<Spring>.fields);
}

void bind_additions(py::class_<Scene>& scene) {
  def_add_body(scene);
  def_add_joint(scene);
  def_add_tendon(scene);
  def_function(
      scene, "add_loop", add_loop_doc, record_of<Loop>.fields,
      {2, {"type", "point_a", "point_b", "orientation_a", "orientation_b"}},
      +[](Loop loop, Scene& its_scene) { its_scene.add_loop(std::move(loop)); });
  def_function(
      scene, "add_spring", add_spring_doc, record_of<Spring>.fields,
      {2, {"rest_length", "damping", "point_a", "point_b"}},
      +[](Spring spring, Scene& its_scene) { its_scene.add_spring(std::move(spring)); });
}

}  // namespace energymargin::binding
