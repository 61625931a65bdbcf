// Regions from JSON.

#include "problem_io/read_record.hpp"
#include "sets/records.hpp"

namespace energymargin::problem_io {
namespace {

template <typename Primitive>
constexpr bool is_combination =
    std::is_same_v<Primitive, regions::Intersection> || std::is_same_v<Primitive, regions::Union> ||
    std::is_same_v<Primitive, regions::Complement>;

class RegionReader {
 public:
  RegionReader(const Scene& scene, int depth) : scene_(scene), depth_(depth) {}

  Region operator()(const JsonNode& node) const {
    if (depth_ > most_region_levels) {
      node.fail("at most " + std::to_string(most_region_levels) + " levels of \"and\", \"or\", \"not\"");
    }
    const std::string type = node["type"].text();
    std::optional<Region> region;
    visit_types<Region::Expression>([&](auto alternative) {
      using Alternative = typename decltype(alternative)::type;
      if (type == Record<Alternative>::type) region = read<Alternative>(node);
    });
    if (!region) node["type"].fail(alternatives(quoted_types<Region::Expression>(), ""));
    return *region;
  }

 private:
  template <typename Alternative>
  Region read(const JsonNode& node) const {
    if constexpr (is_combination<Alternative>) {
      node.allow_keys(keys_of<Alternative>());
      return Alternative{combined(node["of"], std::is_same_v<Alternative, regions::Complement>)};
    } else {
      return RecordReader(&scene_).record<Alternative>(node);
    }
  }

  std::vector<Region> combined(const JsonNode& list, bool single) const {
    std::vector<Region> regions;
    for (const JsonNode& item : list.items()) regions.push_back(with_path(item, RegionReader(scene_, depth_ + 1)));
    if (regions.empty() || (single && regions.size() != 1)) {
      list.fail(single ? "a list of one region" : "a list of at least one region");
    }
    return regions;
  }

  const Scene& scene_;
  int depth_;  // levels of "and", "or", "not" above
};

}  // namespace

Region read_region(const JsonNode& node, const Scene& scene) { return with_path(node, RegionReader(scene, 0)); }

}  // namespace energymargin::problem_io
