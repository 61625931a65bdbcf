// Joints and springs for Python.

#include "energymargin/scene.hpp"
#include "problem/words.hpp"
#include "records.hpp"
#include "scene.hpp"
#include "scene/records.hpp"

namespace energymargin::binding {
namespace {

constexpr const char* add_joint_doc = R"(Hang the body `child` on the body `parent`, which makes it a link.

type is 'revolute' (limits and positions in rad), 'prismatic' (in m; a rail) or 'fixed'. The joint's frame is at
origin [m] and orientation (unit quaternion x, y, z, w) in the parent's frame, and at child_origin and child_orientation in
the child's; the two are one at position 0. axis is in the joint's frame. A link stands in no state vector: the joint's
position and velocity do, and start and start_velocity are theirs where none is given.

mimic: the joint follows another one, as by a linkage without play, and has no limits, no drive, and no numbers in the
state of its own.

The joint is driven by position control with compliance: by the torque stiffness (target - position) + damping
(target_velocity - velocity), at most torque_limit [N m]; target is by default the start. held: it keeps the position that
it has in the state, whatever the load. A joint with neither moves freely. armature: the inertia of the drive's rotor times
the square of the gear ratio [kg m^2], which resists accelerations of the joint and has no weight.

The parent may be fixed, free or a link itself; a body has one parent, joints make no loops, and bodies on joints have no
locked axes. Bodies that a joint connects do not collide. Raises ValueError on bad values.)";

constexpr const char* add_spring_doc =
    R"(Add a spring between a point of one body and a point of another, in their frames.

It pulls with stiffness (length - rest_length) + damping * rate of the length. Raises ValueError on bad values, and on
a spring too stiff for the scene's step.)";

Pose pose(const std::string& prefix, const ArrayLike& origin, const std::optional<ArrayLike>& quaternion_xyzw) {
  return {vector3(prefix + "origin", origin),
          orientation(prefix, quaternion_xyzw, std::nullopt, Quaternion::Identity())};
}

// The keywords of the drive are those of its fields.
template <typename... Get>
void def_add_joint(py::class_<Scene>& scene, const std::tuple<Field<Get>...>& drive) {
  const auto add_joint =
      [drive](Scene& its_scene, const std::string& name, const std::string& parent, const std::string& child,
              const std::string& type, const ArrayLike& origin, const std::optional<ArrayLike>& orientation,
              const ArrayLike& child_origin, const std::optional<ArrayLike>& child_orientation, const ArrayLike& axis,
              const Given<std::pair<Number, Number>>& limits_given, const Number& start, const Number& start_velocity,
              bool held, const std::optional<Number>& target, const FieldInput<Joint, Get>&... arguments) {
        const auto limits = given("limits", limits_given, "a tuple (a number, a number)");
        Joint joint;
        joint.name = name;
        joint.type = value_of<JointType>("type", type);
        joint.parent = parent;
        joint.child = child;
        joint.in_parent = pose("", origin, orientation);
        joint.in_child = pose("child_", child_origin, child_orientation);
        joint.axis = vector3("axis", axis);
        joint.lower = real("limits[0]", limits.first);
        joint.upper = real("limits[1]", limits.second);
        joint.state = {real("start", start), real("start_velocity", start_velocity)};
        joint.held = held;
        joint.target = real("target", target).value_or(joint.state.position);
        assign_fields(joint, drive, arguments...);
        its_scene.add_joint(std::move(joint));
      };
  const py::tuple zeros = py::make_tuple(0.0, 0.0, 0.0);
  std::apply(
      [&](const auto&... field) {
        scene.def("add_joint", add_joint, py::arg("name"), py::kw_only(), py::arg("parent"), py::arg("child"),
                  py::arg("type") = "revolute", py::arg("origin") = zeros, py::arg("orientation") = py::none(),
                  py::arg("child_origin") = zeros, py::arg("child_orientation") = py::none(),
                  py::arg("axis") = py::make_tuple(0.0, 0.0, 1.0),
                  py::arg("limits") = py::make_tuple(Joint{}.lower, Joint{}.upper), py::arg("start") = 0.0,
                  py::arg("start_velocity") = 0.0, py::arg("held") = false, py::arg("target") = py::none(),
                  field_keyword<Joint>(field)..., add_joint_doc);
      },
      drive);
}

void add_spring(Scene& scene, const std::string& body_a, const std::string& body_b, const Number& stiffness,
                const Number& rest_length, const Number& damping, const ArrayLike& point_a, const ArrayLike& point_b) {
  scene.add_spring({body_a, body_b, vector3("point_a", point_a), vector3("point_b", point_b),
                    real("stiffness", stiffness), real("rest_length", rest_length), real("damping", damping)});
}

void bind_mimic(py::module_& module) {
  py::class_<Mimic> mimic(module, "Mimic",
                          "A joint follows another: position = multiplier * (that joint's position) + offset, always.");
  mimic.def(py::init([](std::string joint, const Number& multiplier, const Number& offset) {
              return Mimic{std::move(joint), real("multiplier", multiplier), real("offset", offset)};
            }),
            py::arg("joint"), py::arg("multiplier") = 1.0, py::arg("offset") = 0.0);
  def_fields(mimic, Record<Mimic>::fields());
}

}  // namespace

void bind_joint(py::module_& module) {
  const auto position_of = [](Pose Joint::* pose) {
    return [pose](const Joint& joint) { return (joint.*pose).position; };
  };
  const auto orientation_of = [](Pose Joint::* pose) {
    return [pose](const Joint& joint) { return Eigen::Vector4d((joint.*pose).orientation.coeffs()); };
  };
  bind_mimic(module);
  py::class_<Joint> joint(module, "Joint", "A joint of a scene; for a prismatic one read m for rad and N for N m.");
  def_fields(joint, Record<Joint>::fields(), {"in_parent", "in_child", "lower", "upper", "position", "velocity"});
  joint.def_property_readonly("origin", position_of(&Joint::in_parent), "In the parent's frame, shape (3,) [m].")
      .def_property_readonly("orientation", orientation_of(&Joint::in_parent), "Unit quaternion x, y, z, w.")
      .def_property_readonly("child_origin", position_of(&Joint::in_child), "In the child's frame, shape (3,) [m].")
      .def_property_readonly("child_orientation", orientation_of(&Joint::in_child), "Unit quaternion x, y, z, w.")
      .def_property_readonly(
          "limits", [](const Joint& of) { return std::pair(of.lower, of.upper); }, "[rad].")
      .def_property_readonly(
          "start", [](const Joint& of) { return of.state.position; }, "[rad].")
      .def_property_readonly("start_velocity", [](const Joint& of) { return of.state.velocity; }, "[rad/s].");
  py::class_<Spring> spring(module, "Spring", "A spring between two bodies.");
  def_fields(spring, Record<Spring>::fields());
}

void bind_add_joint(py::class_<Scene>& scene) {
  const py::tuple zeros = py::make_tuple(0.0, 0.0, 0.0);
  def_add_joint(scene, Record<Joint>::drive());
  scene.def("add_spring", &add_spring, py::arg("body_a"), py::arg("body_b"), py::kw_only(), py::arg("stiffness"),
            py::arg("rest_length") = 0.0, py::arg("damping") = 0.0, py::arg("point_a") = zeros,
            py::arg("point_b") = zeros, add_spring_doc);
}

}  // namespace energymargin::binding
