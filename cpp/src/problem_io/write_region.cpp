// Regions as JSON.

#include <stdexcept>

#include "problem_io/write.hpp"

namespace energymargin::problem_io {
namespace {

struct RegionWriter {
  OrderedJson write_region(const Region& region) const { return std::visit(*this, region.expression()); }

  template <typename Primitive>
  OrderedJson with_body(const char* type, const Primitive& primitive, OrderedJson more) const {
    OrderedJson json = {{"type", type}, {"body", primitive.body}};
    json.update(more);
    if (!primitive.frame.empty()) json["frame"] = primitive.frame;
    return json;
  }
  OrderedJson list(const char* type, const std::vector<Region>& of) const {
    OrderedJson json = {{"type", type}, {"of", OrderedJson::array()}};
    for (const Region& region : of) json["of"].push_back(write_region(region));
    return json;
  }

  OrderedJson operator()(const regions::Ball& r) const {
    return with_body("ball", r, {{"center", write(r.center)}, {"radius", r.radius}});
  }
  OrderedJson operator()(const regions::Box& r) const {
    const OrderedJson size = {write_size(r.size.x()), write_size(r.size.y()), write_size(r.size.z())};
    return with_body("box", r, {{"center", write(r.center)}, {"size", size}});
  }
  OrderedJson operator()(const regions::Disc& r) const {
    return with_body("disc", r, {{"center", write(r.center)}, {"radius", r.radius}});
  }
  OrderedJson operator()(const regions::AnnularSector& r) const {
    return with_body("annular_sector", r,
                     {{"center", write(r.center)},
                      {"radius", r.radius},
                      {"half_width", r.half_width},
                      {"start_angle", r.start_angle},
                      {"sweep", r.sweep}});
  }
  OrderedJson operator()(const regions::Swept& r) const {
    OrderedJson json = {{"type", "swept"},
                        {"body", r.body},
                        {"by", r.by},
                        {"half_width", r.half_width},
                        {"behind", r.behind},
                        {"ahead", r.ahead},
                        {"least_speed", r.least_speed},
                        {"disc_radius", r.disc_radius}};
    if (r.beyond > 0.0) json["beyond"] = r.beyond;
    if (r.at) {
      json["at"] = {
          {"position", write(r.at->position)}, {"velocity", write(r.at->velocity)}, {"yaw_rate", r.at->yaw_rate}};
    }
    return json;
  }
  OrderedJson operator()(const regions::HalfSpace& r) const {
    OrderedJson json = with_body("half_space", r, {{"normal", write(r.normal)}, {"offset", r.offset}});
    if (r.ahead > 0.0) json["ahead"] = r.ahead;
    return json;
  }
  OrderedJson operator()(const regions::Speed& r) const {
    OrderedJson json = with_body("speed", r, {{"limit", r.limit}, {"point", write(r.point)}});
    if (r.along_world) json["along_world"] = true;
    if (r.along) json["along"] = write(*r.along);
    return json;
  }
  OrderedJson operator()(const regions::Tilt& r) const {
    return with_body("tilt", r, {{"axis", write(r.axis)}, {"reference", write(r.reference)}, {"limit", r.limit}});
  }
  OrderedJson operator()(const regions::Predicate&) const {
    throw std::invalid_argument("a region made of a Predicate has no file format; build it from em.regions");
  }
  OrderedJson operator()(const regions::Intersection& r) const { return list("and", r.of); }
  OrderedJson operator()(const regions::Union& r) const { return list("or", r.of); }
  OrderedJson operator()(const regions::Complement& r) const { return list("not", r.of); }
};

}  // namespace

OrderedJson write(const Region& region) { return RegionWriter{}.write_region(region); }

}  // namespace energymargin::problem_io
