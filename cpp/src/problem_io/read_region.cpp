// Regions from JSON.

#include "problem_io/read.hpp"

namespace energymargin::problem_io {
namespace {

class RegionReader {
 public:
  RegionReader(const Scene& scene, int depth) : scene_(scene), depth_(depth) {}

  Region operator()(const Place& place) const {
    if (depth_ > most_region_levels) {
      place.fail("at most " + std::to_string(most_region_levels) + " levels of \"and\", \"or\", \"not\"");
    }
    const std::string type = place["type"].word();
    if (type == "and" || type == "or" || type == "not") return combination(place, type);
    if (type == "ball") return ball(place);
    if (type == "box") return box(place);
    if (type == "disc") return disc(place);
    if (type == "annular_sector") return annular_sector(place);
    if (type == "swept") return swept(place);
    if (type == "half_space") return half_space(place);
    if (type == "speed") return speed(place);
    if (type == "tilt") return tilt(place);
    place["type"].fail(
        "\"ball\", \"box\", \"disc\", \"annular_sector\", \"swept\", \"half_space\", \"speed\", \"tilt\", \"and\", "
        "\"or\" or \"not\"");
  }

 private:
  Region combination(const Place& place, const std::string& type) const {
    place.only({"type", "of"});
    std::vector<Region> of;
    for (const Place& item : place["of"].items()) of.push_back(located(item, RegionReader(scene_, depth_ + 1)));
    if (of.empty() || (type == "not" && of.size() != 1)) {
      place["of"].fail(type == "not" ? "a list of one region" : "a list of at least one region");
    }
    if (type == "not") return regions::Complement{std::move(of)};
    return type == "and" ? Region(regions::Intersection{std::move(of)}) : Region(regions::Union{std::move(of)});
  }

  regions::Ball ball(const Place& place) const {
    only(place, {"center", "radius"});
    return {body(place), place["center"].vector3(), place["radius"].number(), frame(place)};
  }
  regions::Box box(const Place& place) const {
    only(place, {"center", "size"});
    const std::vector<Place> size = place["size"].items();
    if (size.size() != 3) place["size"].fail("a list of 3 numbers");
    return {body(place), place["center"].vector3(), {size[0].size(), size[1].size(), size[2].size()}, frame(place)};
  }
  regions::Disc disc(const Place& place) const {
    only(place, {"center", "radius"});
    return {body(place), place["center"].vector2(), place["radius"].number(), frame(place)};
  }
  regions::AnnularSector annular_sector(const Place& place) const {
    only(place, {"center", "radius", "half_width", "start_angle", "sweep"});
    return {body(place),
            place["center"].vector2(),
            place["radius"].number(),
            place["half_width"].number(),
            place["start_angle"].number(),
            place["sweep"].number(),
            frame(place)};
  }
  regions::Swept swept(const Place& place) const {
    place.only({"type", "body", "by", "half_width", "behind", "ahead", "least_speed", "disc_radius", "at", "beyond"});
    regions::Swept swept;
    swept.body = body(place);
    swept.by = read_body_name(place["by"], scene_);
    swept.half_width = place["half_width"].number();
    swept.behind = place["behind"].number();
    swept.ahead = place["ahead"].number();
    swept.least_speed = place["least_speed"].number();
    swept.disc_radius = place["disc_radius"].number();
    if (place.has("beyond")) swept.beyond = place["beyond"].number();
    if (!place.has("at")) return swept;
    const Place at = place["at"];
    at.only({"position", "velocity", "yaw_rate"});
    swept.at = regions::PlanarMotion{at["position"].vector2(), at["velocity"].vector2(), at["yaw_rate"].number()};
    return swept;
  }
  regions::HalfSpace half_space(const Place& place) const {
    only(place, {"normal", "offset", "ahead"});
    const double ahead = place.has("ahead") ? place["ahead"].number() : 0.0;
    return {body(place), place["normal"].vector3(), place["offset"].number(), frame(place), ahead};
  }
  regions::Speed speed(const Place& place) const {
    only(place, {"limit", "point", "along_world", "along"});
    regions::Speed speed{body(place), place["limit"].number(), place["point"].vector3(), frame(place)};
    speed.along_world = place.has("along_world") && place["along_world"].truth();
    if (place.has("along")) speed.along = place["along"].vector3();
    return speed;
  }
  regions::Tilt tilt(const Place& place) const {
    only(place, {"axis", "reference", "limit"});
    return {body(place), place["axis"].vector3(), place["reference"].vector3(), place["limit"].number(), frame(place)};
  }

  std::string body(const Place& place) const { return read_body_name(place["body"], scene_); }
  std::string frame(const Place& place) const {
    return place.has("frame") ? read_body_name(place["frame"], scene_) : "";
  }
  static void only(const Place& place, std::vector<std::string> keys) {
    keys.insert(keys.begin(), {"type", "body", "frame"});
    place.only(keys);
  }

  const Scene& scene_;
  int depth_;  // levels of "and", "or", "not" above
};

}  // namespace

Region read_region(const Place& place, const Scene& scene) { return located(place, RegionReader(scene, 0)); }

}  // namespace energymargin::problem_io
