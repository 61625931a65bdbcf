// Any region expression is refused with std::invalid_argument, or has the laws of sets: on any states, and from JSON.

#include <fuzzer/FuzzedDataProvider.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "energymargin/membership.hpp"
#include "problem_files.hpp"
#include "problem_io/records.hpp"
#include "require.hpp"

namespace energymargin::fuzz {
namespace {

constexpr int most_depth = 5;

// Free bodies, fixed ones, and links of a hand.
const Scene& scene() {
  static const Scene made = [] {  // few iterations: states of any speeds hardly converge
    const Scene scene = scenes::articulated().scene;
    Stepping stepping = scene.stepping();
    stepping.iterations = 20;
    return scene.with_stepping(stepping);
  }();
  return made;
}

// Makes regions and states of whatever bytes there are.
class Generator {
 public:
  Generator(const std::uint8_t* data, std::size_t size) : bytes_(data, size) {}

  Region region(int depth = 0) {
    const int kind = bytes_.ConsumeIntegralInRange(0, depth < most_depth ? 12 : 8);
    switch (kind) {
      case 0:
        return regions::Ball{body(), vector3(), number(), frame()};
      case 1:
        return regions::Box{body(), vector3(), vector3(), frame()};
      case 2:
        return regions::Disc{body(), vector2(), number(), frame()};
      case 3:
        return regions::AnnularSector{body(), vector2(), number(), number(), number(), number(), frame()};
      case 4:
        return swept();
      case 5:
        return regions::HalfSpace{body(), direction(), number(), frame()};
      case 6:
        return regions::Speed{body(), number(), vector3(), frame()};
      case 7:
        return regions::Tilt{body(), direction(), direction(), number(), frame()};
      case 8:
        return regions::Touching{body(), body(), number(), number()};
      case 9:
        return region(depth + 1) & region(depth + 1);
      case 10:
        return region(depth + 1) | region(depth + 1);
      case 11:
        return ~region(depth + 1);
      default:
        return list(depth);
    }
  }

  // The scene's own state with other numbers here and there, none of them checked.
  States states() {
    const State start = pack(scene());
    States all = start.transpose().replicate(bytes_.ConsumeIntegralInRange(0, 4), 1);
    while (all.size() > 0 && bytes_.remaining_bytes() > 0) {
      all.data()[bytes_.ConsumeIntegralInRange<Eigen::Index>(0, all.size() - 1)] = number();
    }
    return all;
  }

 private:
  regions::Swept swept() {
    regions::Swept made{body(), body(), number(), number(), number(), number(), number()};
    if (bytes_.ConsumeBool()) made.at = regions::PlanarMotion{vector2(), vector2(), number()};
    return made;
  }

  Region list(int depth) {
    std::vector<Region> of;
    for (int i = bytes_.ConsumeIntegralInRange(0, 3); i > 0; --i) of.push_back(region(depth + 1));
    switch (bytes_.ConsumeIntegralInRange(0, 2)) {
      case 0:
        return regions::Intersection{of};
      case 1:
        return regions::Union{of};
      default:
        return regions::Complement{of};
    }
  }

  double number() {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    constexpr std::array<double, 14> special{0.0,
                                             -0.0,
                                             1.0,
                                             -1.0,
                                             1e-300,
                                             5e-324,
                                             1e154,
                                             1e155,
                                             1e300,
                                             -1e300,
                                             6.283185307179586,
                                             infinity,
                                             -infinity,
                                             std::numeric_limits<double>::quiet_NaN()};
    switch (bytes_.ConsumeIntegralInRange(0, 5)) {
      case 0:
        return bytes_.PickValueInArray(special);
      case 1: {
        const auto bits = bytes_.ConsumeIntegral<std::uint64_t>();
        double value = 0.0;
        std::memcpy(&value, &bits, sizeof value);
        return value;
      }
      case 2:
        return -0.01 * bytes_.ConsumeIntegral<std::uint8_t>();
      default:
        return 0.01 * bytes_.ConsumeIntegral<std::uint8_t>();
    }
  }
  Vector2 vector2() {
    const double x = number();
    return {x, number()};
  }
  Vector3 vector3() {
    const Vector2 xy = vector2();
    return {xy.x(), xy.y(), number()};
  }
  Vector3 direction() {
    const Vector3 any = vector3();
    return bytes_.ConsumeIntegralInRange(0, 7) == 0 ? any : Vector3(any.normalized());
  }

  std::string body() {
    const std::vector<Body>& bodies = scene().bodies();
    const std::size_t index = bytes_.ConsumeIntegralInRange<std::size_t>(0, bodies.size());
    return index == bodies.size() ? "nobody" : bodies[index].name;
  }
  std::string frame() { return bytes_.ConsumeBool() ? body() : ""; }

  FuzzedDataProvider bytes_;
};

template <typename Make>
auto unless_refused(const Make& make) -> std::optional<decltype(make())> {
  try {
    return make();
  } catch (const std::invalid_argument& error) {
    require(error.what()[0] != '\0', "an error says what is wrong");
    return std::nullopt;
  }
}

Mask mask(const Region& region, const States& states) { return Membership(region, scene())(states); }

bool equal(const Mask& a, const Mask& b) { return a.size() == b.size() && (a == b).all(); }

void require_rows_as_states(const Region& region, const States& states) {
  const Membership contains(region, scene());
  const Mask all = contains(states);
  require(all.size() == states.rows(), "a truth value for each state");
  for (Eigen::Index i = 0; i < states.rows(); ++i) {
    require(contains(State(states.row(i))) == all(i), "a table is evaluated as its rows are");
  }
}

void require_laws_of_sets(const Region& a, const Region& b, const States& states) {
  const Mask in_a = mask(a, states);
  const Mask in_b = mask(b, states);
  require(equal(mask(a & b, states), in_a && in_b), "a & b is in both");
  require(equal(mask(a | b, states), in_a || in_b), "a | b is in either");
  require(equal(mask(~a, states), !in_a), "~a is not in a");
  require(equal(mask(~(a | b), states), mask(~a & ~b, states)), "~(a | b) is ~a & ~b");
  require(equal(mask(~(a & b), states), mask(~a | ~b, states)), "~(a & b) is ~a | ~b");
  require(!mask(a & ~a, states).any(), "a & ~a is empty");
  require(mask(a | ~a, states).all(), "a | ~a is everything");
}

void require_written_and_read_back(const Region& region, const States& states) {
  const std::string text = problem_io::write(region).dump();
  const problem_io::Json json = problem_io::Json::parse(text);
  const Region again = problem_io::RecordReader(&scene()).region(problem_io::JsonNode(json, "region"));
  require(problem_io::write(again).dump() == text, "what is written is read back as it was");
  require(equal(mask(again, states), mask(region, states)), "a region from JSON is the same set");
}

}  // namespace
}  // namespace energymargin::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace energymargin;
  using namespace energymargin::fuzz;
  Generator generator(data, size);
  const auto a = unless_refused([&] { return generator.region(); });
  if (!a || !unless_refused([&] { return Membership(*a, scene()); })) return 0;
  const auto b = unless_refused([&] { return generator.region(); });
  const States states = generator.states();
  require_rows_as_states(*a, states);
  require_written_and_read_back(*a, states);
  const bool both = b && unless_refused([&] { return Membership(*b, scene()); });
  require_laws_of_sets(*a, both ? *b : *a, states);
  return 0;
}
