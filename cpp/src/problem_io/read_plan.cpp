// Plans from JSON.

#include "problem_io/packed.hpp"
#include "problem_io/read.hpp"

namespace energymargin::problem_io {
namespace {

// As they may be written by hand: [[...], ...], or [...] of one column.
Wrenches read_list(const Place& place, int columns) {
  const std::vector<Place> items = place.items();
  if (items.empty()) place.fail("at least one row");
  Wrenches rows(static_cast<Eigen::Index>(items.size()), columns);
  for (std::size_t i = 0; i < items.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    if (columns == 1) {
      rows(row, 0) = items[i].number();
    } else {
      const std::vector<double> numbers = items[i].numbers(static_cast<std::size_t>(columns));
      rows.row(row) = Eigen::Map<const Eigen::RowVectorXd>(numbers.data(), columns);
    }
  }
  return rows;
}

Wrenches read_packed(const Place& place, int columns) {
  Wrenches rows;
  try {
    rows = unpack(place.word(), columns);
  } catch (const std::invalid_argument& error) {
    place.fail(error.what());
  }
  for (Eigen::Index row = 0; row < rows.rows(); ++row) {
    if (!rows.row(row).allFinite()) place.fail("finite numbers, also in row " + std::to_string(row));
  }
  return rows;
}

Wrenches read_rows(const Place& place, int columns) {
  if (place.is_list()) return read_list(place, columns);
  if (!place.is_text()) place.fail("a list of rows, or base64 of their bits");
  return read_packed(place, columns);
}

std::string read_name_of_body(const Place& place, const Scene* scene) {
  return scene == nullptr ? place.word() : read_body_name(place, *scene);
}

std::string read_name_of_joint(const Place& place, const Scene* scene) {
  const std::string name = place.word();
  if (scene == nullptr) return name;
  std::string known;
  for (const Joint& joint : scene->joints()) {
    if (joint.name == name) return name;
    known += (known.empty() ? "'" : ", '") + joint.name + "'";
  }
  place.fail(known.empty() ? "no targets: the scene has no joints" : "one of the joints " + known);
}

Servo read_servo(const Place& place, const Scene* scene) {
  place.only({"body", "rows", "force", "torque"});
  Servo servo{read_name_of_body(place["body"], scene), read_rows(place["rows"], 6)};
  if (place.has("force")) servo.force = place["force"].number();
  if (place.has("torque")) servo.torque = place["torque"].number();
  return servo;
}

Plan read_parts(const Place& place, const Scene* scene) {
  place.only({"step", "wrenches", "targets", "velocities"});
  Plan plan{place["step"].number()};
  add_each(place, "wrenches", [&](const Place& drive) {
    drive.only({"body", "rows"});
    plan.wrenches.push_back({read_name_of_body(drive["body"], scene), read_rows(drive["rows"], 6)});
  });
  add_each(place, "targets", [&](const Place& targets) {
    targets.only({"joint", "rows"});
    plan.targets.push_back({read_name_of_joint(targets["joint"], scene), read_rows(targets["rows"], 1)});
  });
  add_each(place, "velocities", [&](const Place& servo) { plan.velocities.push_back(read_servo(servo, scene)); });
  return plan;
}

}  // namespace

Plan read_plan(const Place& place, const Scene* scene) {
  return located(place, [&](const Place& at) {
    Plan plan = read_parts(at, scene);
    scene == nullptr ? validate(plan) : validate(plan, *scene);
    return plan;
  });
}

}  // namespace energymargin::problem_io
