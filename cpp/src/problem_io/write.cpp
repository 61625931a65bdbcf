// A Problem as JSON.

#include "problem_io/write.hpp"

#include "energymargin/problem_io.hpp"
#include "problem_io/names.hpp"

namespace energymargin::problem_io {
namespace {

using problem_io::write;

OrderedJson write(const Body& body, const MeshFiles& meshes) {
  const auto mesh = meshes.find(body.name);
  OrderedJson json = {{"name", body.name},
                      {"shape", mesh == meshes.end() ? write(body.shape)
                                                     : write_mesh_shape(std::get<Compound>(body.shape), mesh->second)},
                      {"mass", body.mass},
                      {"position", write(body.state.position)},
                      {"orientation", write(body.state.orientation)},
                      {"velocity", write(body.state.velocity)},
                      {"angular_velocity", write(body.state.angular_velocity)},
                      {"friction", body.friction},
                      {"role", name_of(roles, body.role)},
                      {"linear_factor", write(body.linear_factor)},
                      {"angular_factor", write(body.angular_factor)},
                      {"force", write(body.force)}};
  if (body.inertial) {
    json["inertial"] = {{"center", write(body.inertial->center)},
                        {"moments", write(body.inertial->moments)},
                        {"axes", write(body.inertial->axes)}};
  }
  return json;
}

OrderedJson write(const Pose& pose) {
  return {{"position", write(pose.position)}, {"orientation", write(pose.orientation)}};
}

OrderedJson write(const Joint& joint) {
  OrderedJson json = {{"name", joint.name},
                      {"type", name_of(joint_types, joint.type)},
                      {"parent", joint.parent},
                      {"child", joint.child},
                      {"in_parent", write(joint.in_parent)},
                      {"in_child", write(joint.in_child)},
                      {"axis", write(joint.axis)},
                      {"lower", write_size(joint.lower)},
                      {"upper", write_size(joint.upper)},
                      {"position", joint.state.position},
                      {"velocity", joint.state.velocity},
                      {"held", joint.held},
                      {"target", joint.target},
                      {"target_velocity", joint.target_velocity},
                      {"stiffness", joint.stiffness},
                      {"damping", joint.damping},
                      {"torque_limit", write_size(joint.torque_limit)}};
  if (joint.mimic) {
    json["mimic"] = {
        {"joint", joint.mimic->joint}, {"multiplier", joint.mimic->multiplier}, {"offset", joint.mimic->offset}};
  }
  return json;
}

OrderedJson write(const Spring& spring) {
  return {{"body_a", spring.body_a},          {"body_b", spring.body_b},       {"point_a", write(spring.point_a)},
          {"point_b", write(spring.point_b)}, {"stiffness", spring.stiffness}, {"rest_length", spring.rest_length},
          {"damping", spring.damping}};
}

OrderedJson write(const ForceWeights& weights) {
  return {{"engage", weights.engage},
          {"stick", weights.stick},
          {"distance", weights.distance},
          {"ground_engage", weights.ground_engage},
          {"ground_stick", weights.ground_stick}};
}

OrderedJson write(const Scene& scene, const MeshFiles& meshes) {
  const Stepping& stepping = scene.stepping();
  OrderedJson json = {{"gravity", write(scene.gravity())},
                      {"step", stepping.step},
                      {"solver_iterations", stepping.iterations},
                      {"solver_tolerance", stepping.tolerance},
                      {"friction_directions", stepping.friction_directions}};
  if (stepping.margin) json["margin"] = *stepping.margin;
  json["bodies"] = OrderedJson::array();
  for (const Body& body : scene.bodies()) json["bodies"].push_back(write(body, meshes));
  json["joints"] = OrderedJson::array();
  for (const Joint& joint : scene.joints()) json["joints"].push_back(write(joint));
  json["springs"] = OrderedJson::array();
  for (const Spring& spring : scene.springs()) json["springs"].push_back(write(spring));
  if (!scene.disabled_collisions().empty()) json["disabled_collisions"] = scene.disabled_collisions();
  return json;
}

OrderedJson write(const Contact& contact) {
  return {{"body_a", contact.body_a},
          {"body_b", contact.body_b},
          {"position", write(contact.position)},
          {"normal", write(contact.normal)},
          {"distance", contact.distance},
          {"normal_force", contact.normal_force},
          {"tangential_force", write(contact.tangential_force)},
          {"friction", contact.friction}};
}

// The oldest version that can say it: what has no clock, programs read that know no clock.
int version_of(const Problem& problem) {
  const bool clock = problem.horizon || problem.plan || problem.check || problem.dwell != 0.0;
  return clock ? version_with_clock : version_without_clock;
}

}  // namespace

OrderedJson write_problem(const Problem& problem, const MeshFiles& meshes) {
  OrderedJson json = {{"format", format_name}, {"version", version_of(problem)}};
  json["scene"] = write(problem.scene, meshes);
  json["state"] = std::vector<double>(problem.state.begin(), problem.state.end());
  json["force"] = write(problem.force);
  json["torque"] = write(problem.torque);
  json["duration"] = problem.duration;
  json["captured"] = write(problem.captured);
  if (problem.succeeded) json["succeeded"] = write(*problem.succeeded);
  if (problem.within) json["within"] = write(*problem.within);
  if (problem.captured_any) json["captured_any"] = write(*problem.captured_any);
  if (problem.succeeded_any) json["succeeded_any"] = write(*problem.succeeded_any);
  json["effector"] = name_of(effectors, problem.effector);
  json["rate"] = problem.rate;
  json["force_weights"] = write(problem.force_weights);
  if (problem.contacts) {
    json["contacts"] = OrderedJson::array();
    for (const Contact& contact : *problem.contacts) json["contacts"].push_back(write(contact));
  }
  if (problem.horizon) json["horizon"] = *problem.horizon;
  if (problem.check) json["check"] = *problem.check;
  if (problem.dwell != 0.0) json["dwell"] = problem.dwell;
  if (problem.plan) json["plan"] = write(*problem.plan);
  return json;
}

}  // namespace energymargin::problem_io
