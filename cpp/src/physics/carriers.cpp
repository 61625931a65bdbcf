#include "physics/carriers.hpp"

namespace energymargin {
namespace {

// What goes along slides along others that it comes closer to by less than this share of its way.
constexpr double along_share = 1e-3;

}  // namespace

void Carriers::carry(const std::vector<ContactPoint>& points, const std::vector<Velocity>& ways, double lost) {
  const std::vector<Body>& bodies = scene_.bodies();
  carriers_.resize(bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) carriers_[i] = bodies[i].kinematic ? static_cast<int>(i) : -1;
  const auto until_nothing_changes = [&](const auto& of_point) {
    do {
      changed_ = false;
      for (const ContactPoint& point : points) of_point(point);
    } while (changed_);
  };
  until_nothing_changes([this](const ContactPoint& point) { spread(point); });
  until_nothing_changes([&](const ContactPoint& point) { hold(point, ways); });
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (carriers_[i] < 0 || kinematic(i)) continue;
    const auto carrier = static_cast<std::size_t>(carriers_[i]);
    bodies_.carry(i, ways[carrier], origin(carrier), lost);
  }
}

void Carriers::spread(const ContactPoint& point) {
  const std::size_t a = bodies_.base_of(point.a), b = bodies_.base_of(point.b);
  join(a, b);
  join(b, a);
}

void Carriers::join(std::size_t from, std::size_t to) {
  if (carriers_[from] < 0 || carriers_[to] >= 0 || scene_.bodies()[to].fixed()) return;
  carriers_[to] = carriers_[from];
  changed_ = true;
}

// What would be carried into something stays.
void Carriers::hold(const ContactPoint& point, const std::vector<Velocity>& ways) {
  const std::size_t a = bodies_.base_of(point.a), b = bodies_.base_of(point.b);
  if (carriers_[a] == carriers_[b]) return;
  const btVector3 apart = velocity(a, point.on_a, ways) - velocity(b, point.on_b, ways);
  if (point.normal.dot(apart) >= -along_share * apart.length()) return;
  if (!kinematic(b)) stop(a);
  if (!kinematic(a)) stop(b);
}

void Carriers::stop(std::size_t body) {
  if (carriers_[body] < 0 || kinematic(body)) return;
  carriers_[body] = -1;
  changed_ = true;
}

btVector3 Carriers::velocity(std::size_t body, const btVector3& point, const std::vector<Velocity>& ways) const {
  if (carriers_[body] < 0) return {0, 0, 0};
  const auto carrier = static_cast<std::size_t>(carriers_[body]);
  return ways[carrier].linear + ways[carrier].angular.cross(point - origin(carrier));
}

}  // namespace energymargin
