#include "energymargin/region.hpp"

#include <algorithm>

#include "sets/records.hpp"

namespace energymargin {
namespace {

template <typename Primitive>
void validate(const Primitive& primitive) {
  require_fields(primitive);
  if constexpr (std::is_same_v<Primitive, regions::HalfSpace>) {
    if (primitive.ahead <= 0.0 || !primitive.frame.empty()) return;
    reject("ahead", text(primitive.ahead), "0 without a frame, whose motion it is about");
  }
  if constexpr (std::is_same_v<Primitive, regions::Joint>) {
    if (primitive.lower <= primitive.upper) return;
    reject("lower", text(primitive.lower), "a number up to upper, " + text(primitive.upper));
  }
  if constexpr (std::is_same_v<Primitive, regions::Touching>) {
    if (primitive.body == primitive.other) reject("other", "'" + primitive.other + "'", "another body than body");
  }
}

void validate(const regions::Predicate& predicate) {
  if (!predicate.contains) reject("predicate", "empty", "a function of an (N, n) array of states");
}

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
  std::visit([](const auto& region) { validate(region); }, expression);
  const std::vector<Region>* const of = combined_by(expression);
  if (of == nullptr) return;
  const bool single = std::holds_alternative<regions::Complement>(expression);
  if (single && of->size() != 1) reject("of", std::to_string(of->size()) + " regions", "exactly one");
  if (of->empty()) reject("of", "empty", "at least one region");
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
