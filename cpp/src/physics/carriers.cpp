#include "physics/carriers.hpp"

namespace energymargin {
namespace {

// What goes along slides along others that it comes closer to by less than this share of its way.
constexpr double along_share = 1e-3;

struct Carriers {
  const Scene& scene;
  const MovingBodies& bodies;
  const std::vector<Velocity>& ways;
  std::vector<int> of{};  // each body, or the base of its tree; -1: none
  bool changed = false;

  bool kinematic(std::size_t body) const { return scene.bodies()[body].kinematic; }
  btVector3 origin(std::size_t body) const { return bodies.colliders()[body]->getWorldTransform().getOrigin(); }

  void join(std::size_t from, std::size_t to) {
    if (of[from] < 0 || of[to] >= 0 || scene.bodies()[to].fixed()) return;
    of[to] = of[from];
    changed = true;
  }

  void stop(std::size_t body) {
    if (of[body] < 0 || kinematic(body)) return;
    of[body] = -1;
    changed = true;
  }

  btVector3 velocity(std::size_t body, const btVector3& point) const {
    if (of[body] < 0) return {0, 0, 0};
    const auto carrier = static_cast<std::size_t>(of[body]);
    return ways[carrier].linear + ways[carrier].angular.cross(point - origin(carrier));
  }

  // Whether what is carried would be carried into something at a point: then it stays.
  bool blocks(std::size_t a, std::size_t b, const ContactPoint& point) const {
    if (of[a] == of[b]) return false;
    const btVector3 apart = velocity(a, point.on_a) - velocity(b, point.on_b);
    return point.normal.dot(apart) < -along_share * apart.length();
  }
};

}  // namespace

void carry_along(const Scene& scene, MovingBodies& bodies, const std::vector<ContactPoint>& points,
                 const std::vector<Velocity>& ways, double lost) {
  Carriers carriers{scene, bodies, ways};
  const std::size_t count = scene.bodies().size();
  for (std::size_t i = 0; i < count; ++i) carriers.of.push_back(carriers.kinematic(i) ? static_cast<int>(i) : -1);
  const auto until_nothing_changes = [&](const auto& visit) {
    do {
      carriers.changed = false;
      for (const ContactPoint& point : points) visit(point, bodies.base_of(point.a), bodies.base_of(point.b));
    } while (carriers.changed);
  };
  until_nothing_changes([&](const ContactPoint&, std::size_t a, std::size_t b) {
    carriers.join(a, b);
    carriers.join(b, a);
  });
  until_nothing_changes([&](const ContactPoint& point, std::size_t a, std::size_t b) {
    if (!carriers.blocks(a, b, point)) return;
    if (!carriers.kinematic(b)) carriers.stop(a);
    if (!carriers.kinematic(a)) carriers.stop(b);
  });
  for (std::size_t i = 0; i < count; ++i) {
    if (carriers.of[i] < 0 || carriers.kinematic(i)) continue;
    const auto carrier = static_cast<std::size_t>(carriers.of[i]);
    bodies.carry(i, ways[carrier], carriers.origin(carrier), lost);
  }
}

}  // namespace energymargin
