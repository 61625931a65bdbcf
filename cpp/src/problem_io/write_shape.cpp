// Shapes as JSON.

#include "problem_io/write.hpp"

namespace energymargin::problem_io {
namespace {

void write_solid(const Compound& compound, OrderedJson& json) {
  if (!compound.solid) return;
  json["solid"] = {{"volume", compound.solid->volume},
                   {"center", write(compound.solid->center)},
                   {"moments", write(compound.solid->moments)},
                   {"axes", write(compound.solid->axes)}};
}

struct ShapeWriter {
  OrderedJson operator()(const Plane& s) const {
    return {{"type", "plane"}, {"normal", write(s.normal)}, {"offset", s.offset}};
  }
  OrderedJson operator()(const Box& s) const { return {{"type", "box"}, {"size", write(s.size)}}; }
  OrderedJson operator()(const Sphere& s) const { return {{"type", "sphere"}, {"radius", s.radius}}; }
  OrderedJson operator()(const Cylinder& s) const {
    return {{"type", "cylinder"}, {"radius", s.radius}, {"length", s.length}};
  }
  OrderedJson operator()(const Capsule& s) const {
    return {{"type", "capsule"}, {"radius", s.radius}, {"length", s.length}};
  }
  OrderedJson operator()(const ConvexHull& s) const {
    OrderedJson points = OrderedJson::array();
    for (const Vector3& point : s.points) points.push_back(write(point));
    return {{"type", "convex_hull"}, {"points", points}};
  }
  OrderedJson operator()(const Compound& s) const {
    OrderedJson json = {{"type", "compound"}, {"parts", OrderedJson::array()}};
    for (const auto& [solid, pose] : s.parts) {
      json["parts"].push_back({{"shape", std::visit(*this, solid)},
                               {"position", write(pose.position)},
                               {"orientation", write(pose.orientation)}});
    }
    write_solid(s, json);
    return json;
  }
};

}  // namespace

OrderedJson write(const Shape& shape) { return std::visit(ShapeWriter{}, shape); }

OrderedJson write_mesh_shape(const Compound& compound, const std::string& file) {
  OrderedJson json = {{"type", "mesh"}, {"file", file}};
  write_solid(compound, json);
  return json;
}

}  // namespace energymargin::problem_io
