// Plans from JSON.

#include "problem_io/packed.hpp"
#include "problem_io/read.hpp"

namespace energymargin::problem_io {
namespace {

// As they may be written by hand: [[...], ...], or [...] of one column.
Wrenches read_list(const JsonNode& node, int columns) {
  const std::vector<JsonNode> items = node.items();
  if (items.empty()) node.fail("at least one row");
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

Wrenches read_packed(const JsonNode& node, int columns) {
  Wrenches rows;
  try {
    rows = unpack(node.text(), columns);
  } catch (const std::invalid_argument& error) {
    node.fail(error.what());
  }
  for (Eigen::Index row = 0; row < rows.rows(); ++row) {
    if (!rows.row(row).allFinite()) node.fail("finite numbers, also in row " + std::to_string(row));
  }
  return rows;
}

Wrenches read_rows(const JsonNode& node, int columns) {
  if (node.is_list()) return read_list(node, columns);
  if (!node.is_text()) node.fail("a list of rows, or base64 of their bits");
  return read_packed(node, columns);
}

std::string read_name_of_body(const JsonNode& node, const Scene* scene) {
  return scene == nullptr ? node.text() : read_body_name(node, *scene);
}

std::string read_name_of_joint(const JsonNode& node, const Scene* scene) {
  const std::string name = node.text();
  if (scene == nullptr) return name;
  std::string known;
  for (const Joint& joint : scene->joints()) {
    if (joint.name == name) return name;
    known += (known.empty() ? "'" : ", '") + joint.name + "'";
  }
  node.fail(known.empty() ? "no targets: the scene has no joints" : "one of the joints " + known);
}

Servo read_servo(const JsonNode& node, const Scene* scene) {
  node.allow_keys({"body", "rows", "force", "torque"});
  Servo servo{read_name_of_body(node["body"], scene), read_rows(node["rows"], 6)};
  if (node.has("force")) servo.force = node["force"].number();
  if (node.has("torque")) servo.torque = node["torque"].number();
  return servo;
}

Plan read_parts(const JsonNode& node, const Scene* scene) {
  node.allow_keys({"step", "wrenches", "targets", "velocities"});
  Plan plan{node["step"].number()};
  for_each_item(node, "wrenches", [&](const JsonNode& drive) {
    drive.allow_keys({"body", "rows"});
    plan.wrenches.push_back({read_name_of_body(drive["body"], scene), read_rows(drive["rows"], 6)});
  });
  for_each_item(node, "targets", [&](const JsonNode& targets) {
    targets.allow_keys({"joint", "rows"});
    plan.targets.push_back({read_name_of_joint(targets["joint"], scene), read_rows(targets["rows"], 1)});
  });
  for_each_item(node, "velocities",
                [&](const JsonNode& servo) { plan.velocities.push_back(read_servo(servo, scene)); });
  return plan;
}

}  // namespace

Plan read_plan(const JsonNode& node, const Scene* scene) {
  return with_path(node, [&](const JsonNode& at) {
    Plan plan = read_parts(at, scene);
    scene == nullptr ? validate(plan) : validate(plan, *scene);
    return plan;
  });
}

}  // namespace energymargin::problem_io
