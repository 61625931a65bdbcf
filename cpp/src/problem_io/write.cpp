// A Problem as JSON.

#include <cmath>

#include "energymargin/problem_io.hpp"
#include "json.hpp"
#include "names.hpp"

namespace energymargin::problem_io {
namespace {

Json write(const Vector2& v) { return {v.x(), v.y()}; }
Json write(const Vector3& v) { return {v.x(), v.y(), v.z()}; }
Json write(const Quaternion& q) { return {q.x(), q.y(), q.z(), q.w()}; }

// JSON has no infinity; a size without limit is the word.
Json write_size(double value) {
  if (!std::isinf(value)) return value;
  return value > 0.0 ? "inf" : "-inf";
}

struct ShapeWriter {
  Json operator()(const Plane& s) const {
    return {{"type", "plane"}, {"normal", write(s.normal)}, {"offset", s.offset}};
  }
  Json operator()(const Box& s) const { return {{"type", "box"}, {"size", write(s.size)}}; }
  Json operator()(const Sphere& s) const { return {{"type", "sphere"}, {"radius", s.radius}}; }
  Json operator()(const Cylinder& s) const {
    return {{"type", "cylinder"}, {"radius", s.radius}, {"length", s.length}};
  }
  Json operator()(const Capsule& s) const { return {{"type", "capsule"}, {"radius", s.radius}, {"length", s.length}}; }
  Json operator()(const ConvexHull& s) const {
    Json points = Json::array();
    for (const Vector3& point : s.points) points.push_back(write(point));
    return {{"type", "convex_hull"}, {"points", points}};
  }
  Json operator()(const Compound& s) const {
    Json json = {{"type", "compound"}, {"parts", Json::array()}};
    for (const auto& [solid, pose] : s.parts) {
      json["parts"].push_back({{"shape", std::visit(*this, solid)},
                               {"position", write(pose.position)},
                               {"orientation", write(pose.orientation)}});
    }
    if (!s.solid) return json;
    json["solid"] = {{"volume", s.solid->volume},
                     {"center", write(s.solid->center)},
                     {"moments", write(s.solid->moments)},
                     {"axes", write(s.solid->axes)}};
    return json;
  }
};

struct RegionWriter {
  int depth = 0;

  Json write_region(const Region& region) const { return std::visit(*this, region.expression()); }

  template <typename Primitive>
  Json with_body(const char* type, const Primitive& primitive, Json more) const {
    Json json = {{"type", type}, {"body", primitive.body}};
    json.update(more);
    if (!primitive.frame.empty()) json["frame"] = primitive.frame;
    return json;
  }
  Json list(const char* type, const std::vector<Region>& of) const {
    if (depth > most_levels) {
      throw std::invalid_argument("a region nests more than " + std::to_string(most_levels) +
                                  " levels of & | ~, and no problem file has more");
    }
    Json json = {{"type", type}, {"of", Json::array()}};
    for (const Region& region : of) json["of"].push_back(RegionWriter{depth + 1}.write_region(region));
    return json;
  }

  Json operator()(const regions::Ball& r) const {
    return with_body("ball", r, {{"center", write(r.center)}, {"radius", r.radius}});
  }
  Json operator()(const regions::Box& r) const {
    const Json size = {write_size(r.size.x()), write_size(r.size.y()), write_size(r.size.z())};
    return with_body("box", r, {{"center", write(r.center)}, {"size", size}});
  }
  Json operator()(const regions::Disc& r) const {
    return with_body("disc", r, {{"center", write(r.center)}, {"radius", r.radius}});
  }
  Json operator()(const regions::AnnularSector& r) const {
    return with_body("annular_sector", r,
                     {{"center", write(r.center)},
                      {"radius", r.radius},
                      {"half_width", r.half_width},
                      {"start_angle", r.start_angle},
                      {"sweep", r.sweep}});
  }
  Json operator()(const regions::Swept& r) const {
    Json json = {{"type", "swept"},
                 {"body", r.body},
                 {"by", r.by},
                 {"half_width", r.half_width},
                 {"behind", r.behind},
                 {"ahead", r.ahead},
                 {"least_speed", r.least_speed},
                 {"disc_radius", r.disc_radius}};
    if (r.at) {
      json["at"] = {
          {"position", write(r.at->position)}, {"velocity", write(r.at->velocity)}, {"yaw_rate", r.at->yaw_rate}};
    }
    return json;
  }
  Json operator()(const regions::HalfSpace& r) const {
    return with_body("half_space", r, {{"normal", write(r.normal)}, {"offset", r.offset}});
  }
  Json operator()(const regions::Speed& r) const {
    return with_body("speed", r, {{"limit", r.limit}, {"point", write(r.point)}});
  }
  Json operator()(const regions::Tilt& r) const {
    return with_body("tilt", r, {{"axis", write(r.axis)}, {"reference", write(r.reference)}, {"limit", r.limit}});
  }
  Json operator()(const regions::Predicate&) const {
    throw std::invalid_argument("a region made of a Predicate has no file format; build it from em.regions");
  }
  Json operator()(const regions::Intersection& r) const { return list("and", r.of); }
  Json operator()(const regions::Union& r) const { return list("or", r.of); }
  Json operator()(const regions::Complement& r) const { return list("not", r.of); }
};

Json write(const Region& region) { return RegionWriter{}.write_region(region); }

Json write(const Body& body) {
  Json json = {{"name", body.name},
          {"shape", std::visit(ShapeWriter{}, body.shape)},
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

Json write(const Pose& pose) { return {{"position", write(pose.position)}, {"orientation", write(pose.orientation)}}; }

Json write(const Joint& joint) {
  Json json = {{"name", joint.name},
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

Json write(const Spring& spring) {
  return {{"body_a", spring.body_a},          {"body_b", spring.body_b},       {"point_a", write(spring.point_a)},
          {"point_b", write(spring.point_b)}, {"stiffness", spring.stiffness}, {"rest_length", spring.rest_length},
          {"damping", spring.damping}};
}

Json write(const ForceWeights& weights) {
  return {{"engage", weights.engage},
          {"stick", weights.stick},
          {"distance", weights.distance},
          {"ground_engage", weights.ground_engage},
          {"ground_stick", weights.ground_stick}};
}

Json write(const Scene& scene) {
  const Stepping& stepping = scene.stepping();
  Json json = {{"gravity", write(scene.gravity())},
               {"step", stepping.step},
               {"solver_iterations", stepping.iterations},
               {"solver_tolerance", stepping.tolerance},
               {"friction_directions", stepping.friction_directions}};
  if (stepping.margin) json["margin"] = *stepping.margin;
  json["bodies"] = Json::array();
  for (const Body& body : scene.bodies()) json["bodies"].push_back(write(body));
  json["joints"] = Json::array();
  for (const Joint& joint : scene.joints()) json["joints"].push_back(write(joint));
  json["springs"] = Json::array();
  for (const Spring& spring : scene.springs()) json["springs"].push_back(write(spring));
  if (!scene.disabled_collisions().empty()) json["disabled_collisions"] = scene.disabled_collisions();
  return json;
}

Json write(const Contact& contact) {
  return {{"body_a", contact.body_a},
          {"body_b", contact.body_b},
          {"position", write(contact.position)},
          {"normal", write(contact.normal)},
          {"distance", contact.distance},
          {"normal_force", contact.normal_force},
          {"tangential_force", write(contact.tangential_force)},
          {"friction", contact.friction}};
}

}  // namespace

Json write_problem(const Problem& problem) {
  Json json = {{"format", format_name}, {"version", problem_format_version}};
  json["scene"] = write(problem.scene);
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
    json["contacts"] = Json::array();
    for (const Contact& contact : *problem.contacts) json["contacts"].push_back(write(contact));
  }
  return json;
}

}  // namespace energymargin::problem_io
