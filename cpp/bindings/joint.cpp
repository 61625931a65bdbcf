// Joints, tendons, loops and springs for Python.

#include "energymargin/scene.hpp"
#include "energymargin/state.hpp"
#include "problem/records.hpp"
#include "records.hpp"
#include "scene/records.hpp"

namespace energymargin::binding {
namespace {

constexpr const char* add_joint_doc = R"(Hang the body `child` on the body `parent`, which makes it a link.

type is 'revolute' (limits and positions in rad), 'prismatic' (in m; a rail) or 'fixed'. The joint's frame is at origin [m]
and orientation (unit quaternion x, y, z, w) in the parent's frame, and at child_origin and child_orientation in the child's;
the two are one at position 0. axis is in the joint's frame. start and start_velocity are where it is when a state does not
say. It is driven by the torque stiffness (target - position) + damping (target_velocity - velocity), at most torque_limit
[N m]; target is by default the start. held: it keeps the position that it has in the state, whatever the load. mimic: it
follows another joint, without limits and a drive of its own. armature: inertia of the drive's rotor times the square of the
gear ratio [kg m^2]. friction: dry friction, which resists motion by up to this torque [N m].

The parent may be fixed, free or a link; a body has one parent, joints make no loops, and bodies on joints have no locked
axes. Bodies that a joint connects do not collide. Raises ValueError on bad values.)";

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
          tendon.joints.push_back({joint, convert(Type<double>{}, "joints['" + joint + "']", number)});
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

void bind_joint(py::module_& module) {
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

void bind_add_joint(py::class_<Scene>& scene) {
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
