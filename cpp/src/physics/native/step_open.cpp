// Contacts that are open and stay so: they have no rows.

#include <algorithm>
#include <cmath>

#include "physics/native/step_equations.hpp"

namespace energymargin {
namespace {

// Loads may bring a contact so near to its touch, as a share of the speed that it lacks.
constexpr double most_loaded = 0.7;

// What is nearer than this is closed by any load, or nearly so [m/s].
constexpr double least_lacking = 0.02;

// Of fewer contacts rows cost little. Among more movers something closes in nearly each step, and all would be solved
// again.
constexpr std::size_t few_contacts = 32, most_movers = 4;

}  // namespace

// Whether a contact gets no rows: its bodies part by so much, or are so far apart, that it is open at the velocities of
// the state, and under the loads. The solver looks whether it stays so.
bool StepEquations::stays_open(const ContactPoint& point, const Substep& substep) {
  const double duration = substep.duration;
  if (surfaces_ || substep.contacts.size() < few_contacts || solver_.movers().size() > most_movers) return false;
  if (!(point.distance > least_lacking * duration)) return false;
  const int a = mover_of(point.a), b = mover_of(point.b);
  if (a == b || bears(point)) return false;
  if (std::find(closing_.begin(), closing_.end(), std::pair(a, b)) != closing_.end()) return false;
  const auto count = [this](int mover) {
    return mover < 0 ? std::size_t{0} : static_cast<std::size_t>(solver_.count(mover));
  };
  const std::size_t of_a = count(a);
  row_.assign(of_a + count(b), 0.0);
  double lacks = point.distance / duration;
  lacks += normal_speed({point.a, point.on_a, point.on_a, 1.0}, point.normal, row_.data());
  lacks += normal_speed({point.b, point.on_b, point.on_b, -1.0}, point.normal, row_.data() + of_a);
  double loads = 0.0;
  const auto for_each = [&](const auto& visit) {
    for (std::size_t k = 0; k < row_.size(); ++k) visit(k < of_a ? a : b, k < of_a ? k : k - of_a, row_[k]);
  };
  for_each([&](int mover, std::size_t k, double along) {
    lacks += along * solver_.velocities(mover)[k];
    loads += std::abs(along * (solver_.free(mover)[k] - solver_.velocities(mover)[k]));
  });
  if (!(loads < most_loaded * lacks)) return false;
  const OpenContacts& open = solver_.open_contacts(a, b);
  for_each([&](int mover, std::size_t k, double along) {
    double& weight = solver_.numbers(mover == open.a ? open.of_a : open.of_b)[k];
    weight = std::max(weight, std::abs(along) / lacks);
  });
  return true;
}

// Adds the normal row of an end of a contact over the velocities of its mover. The speed along it that is prescribed.
double StepEquations::normal_speed(const End& end, const btVector3& normal, double* row) {
  const btVector3 along = normal * end.sign;
  if (const auto& link = bodies_.link(end.body)) {
    const Articulation& tree = this->tree(link->tree);
    whole_.assign(tree.count(), 0.0);
    tree.add(link->link, end.point, along, whole_.data());
    const std::size_t skipped = tree.prescribed();
    double speed = 0.0;
    for (std::size_t k = 0; k < skipped; ++k) speed += whole_[k] * tree.kicked()[k];
    if (trees_[link->tree].mover >= 0)
      std::copy(whole_.begin() + static_cast<std::ptrdiff_t>(skipped), whole_.end(), row);
    return speed;
  }
  const FreeBody* const body = bodies_.free(end.body);
  if (!body) return 0.0;
  const btVector3 arm = end.point - bodies_.poses()[end.body].getOrigin();
  if (body->mover < 0) return along.dot(body->velocity.linear + body->velocity.angular.cross(arm));
  const btVector3 about = arm.cross(along);
  for (std::size_t k = 0; k < body->axes.size(); ++k) {
    const int axis = body->axes[k];
    row[k] = axis < 3 ? along[axis] : about[axis - 3];
  }
  return 0.0;
}

}  // namespace energymargin
