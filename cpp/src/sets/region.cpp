#include "energymargin/region.hpp"

#include <algorithm>
#include <cmath>

#include "base/angles.hpp"
#include "base/check.hpp"

namespace energymargin {
namespace {

struct Validator {
  void operator()(const regions::Ball& ball) const {
    require_finite("center", ball.center);
    require_positive("radius", ball.radius);
  }
  void operator()(const regions::Box& box) const {
    require_finite("center", box.center);
    if (!(box.size.array() > 0.0).all()) reject("size", text(box.size), "three numbers above 0");
  }
  void operator()(const regions::Disc& disc) const {
    require_finite("center", Vector3(disc.center.x(), disc.center.y(), 0.0));
    require_positive("radius", disc.radius);
  }
  void operator()(const regions::AnnularSector& sector) const {
    require_finite("center", Vector3(sector.center.x(), sector.center.y(), 0.0));
    require_positive("radius", sector.radius);
    require_positive("half_width", sector.half_width);
    require_finite("start_angle", sector.start_angle);
    if (!(std::abs(sector.sweep) > 0.0 && std::abs(sector.sweep) <= full_turn)) {
      reject("sweep", text(sector.sweep), "an angle of at most 2 pi in size, and not 0");
    }
  }
  void operator()(const regions::Swept& swept) const {
    require_positive("half_width", swept.half_width);
    require_not_negative("behind", swept.behind);
    require_positive("ahead", swept.ahead);
    require_not_negative("least_speed", swept.least_speed);
    require_positive("disc_radius", swept.disc_radius);
    require_not_negative("beyond", swept.beyond);
    if (!swept.at) return;
    require_finite("at: position", Vector3(swept.at->position.x(), swept.at->position.y(), 0.0));
    require_finite("at: velocity", Vector3(swept.at->velocity.x(), swept.at->velocity.y(), 0.0));
    require_finite("at: yaw_rate", swept.at->yaw_rate);
  }
  void operator()(const regions::HalfSpace& half_space) const {
    require_unit("normal", half_space.normal);
    require_finite("offset", half_space.offset);
    require_not_negative("ahead", half_space.ahead);
    if (half_space.ahead > 0.0 && half_space.frame.empty()) {
      reject("ahead", text(half_space.ahead), "0 without a frame, whose motion it is about");
    }
  }
  void operator()(const regions::Speed& speed) const {
    require_not_negative("limit", speed.limit);
    require_finite("point", speed.point);
    if (speed.along) require_unit("along", *speed.along);
  }
  void operator()(const regions::Tilt& tilt) const {
    require_unit("axis", tilt.axis);
    require_unit("reference", tilt.reference);
    if (!(tilt.limit >= 0.0 && tilt.limit <= pi)) reject("limit", text(tilt.limit), "an angle from 0 to pi");
  }
  void operator()(const regions::Predicate& predicate) const {
    if (!predicate.contains) reject("predicate", "empty", "a function of an (N, n) array of states");
  }
  void operator()(const regions::Intersection& all) const { require_some(all.of); }
  void operator()(const regions::Union& any) const { require_some(any.of); }
  void operator()(const regions::Complement& negated) const {
    if (negated.of.size() != 1) reject("of", std::to_string(negated.of.size()) + " regions", "exactly one");
  }
  static void require_some(const std::vector<Region>& of) {
    if (of.empty()) reject("of", "empty", "at least one region");
  }
};

// The regions that another one combines; null for a primitive.
const std::vector<Region>* combined_by(const Region::Expression& expression) {
  if (const auto* all = std::get_if<regions::Intersection>(&expression)) return &all->of;
  if (const auto* any = std::get_if<regions::Union>(&expression)) return &any->of;
  if (const auto* negated = std::get_if<regions::Complement>(&expression)) return &negated->of;
  return nullptr;
}

// A chain a & b & c is one intersection of three, not nested ones.
template <typename Combination>
Region combined(const Region& a, const Region& b) {
  std::vector<Region> of;
  for (const Region* region : {&a, &b}) {
    const auto* same = std::get_if<Combination>(&region->expression());
    if (same == nullptr) {
      of.push_back(*region);
    } else {
      of.insert(of.end(), same->of.begin(), same->of.end());
    }
  }
  return Combination{std::move(of)};
}

}  // namespace

Region::Node::Node(Expression definition) : expression(std::move(definition)) {
  std::visit(Validator{}, expression);
  const std::vector<Region>* const of = combined_by(expression);
  if (of == nullptr) return;
  primitives = 0;
  for (const Region& region : *of) {
    levels = std::max(levels, region.node_->levels + 1);
    primitives += region.node_->primitives;
  }
  if (levels > most_region_levels) {
    reject("region", "of " + std::to_string(levels) + " levels of & | ~",
           "at most " + std::to_string(most_region_levels) + "; a chain of one of them is one level");
  }
  if (primitives > most_region_primitives) {
    reject("region", "made of " + std::to_string(primitives) + " primitives",
           "at most " + std::to_string(most_region_primitives) + "; a Predicate can test more at once");
  }
}

Region operator&(const Region& a, const Region& b) { return combined<regions::Intersection>(a, b); }
Region operator|(const Region& a, const Region& b) { return combined<regions::Union>(a, b); }

Region operator~(const Region& a) {
  const auto* negated = std::get_if<regions::Complement>(&a.expression());
  return negated != nullptr ? negated->of.front() : Region(regions::Complement{{a}});
}

}  // namespace energymargin
