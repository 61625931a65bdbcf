// Plans as JSON, and back. Rows are one text: base64 of their bits, eight bytes a number, little-endian, row after row.

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string_view>

#include "problem_io/records.hpp"

namespace energymargin::problem_io {
namespace {

constexpr std::string_view base64_digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__ && sizeof(double) == 8);

// Three bytes, or the last ones, are four digits; "=" stands for those that are not there.
std::string encoded(std::string_view bytes) {
  std::string text;
  text.reserve(4 * (bytes.size() / 3 + 1));
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t bits = 0;
    for (std::size_t j = 0; j < 3; ++j) bits = bits << 8 | (j < count ? static_cast<unsigned char>(bytes[i + j]) : 0U);
    for (std::size_t j = 0; j < 4; ++j) text += j <= count ? base64_digits[bits >> (18 - 6 * j) & 0x3FU] : '=';
  }
  return text;
}

std::string decoded(std::string_view text) {
  std::string bytes;
  bytes.reserve(text.size() / 4 * 3);
  std::uint32_t bits = 0;
  int count = 0;  // of the bits that are no byte yet
  for (const char digit : text.substr(0, text.find('='))) {
    bits = (bits << 6 | static_cast<std::uint32_t>(base64_digits.find(digit))) & 0xFFFU;
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes += static_cast<char>(bits >> count & 0xFFU);
  }
  return bytes;
}

std::string pack(const Wrenches& rows) {
  const auto* const bytes = reinterpret_cast<const char*>(rows.data());
  return encoded({bytes, sizeof(double) * static_cast<std::size_t>(rows.size())});
}

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

// One text alone stands for the bytes: no blanks, all of the "=", and no bits that nobody reads.
Wrenches read_packed(const JsonNode& node, int columns) {
  const std::string text = node.text();
  if (text.find_first_not_of(base64_digits) < text.find('=')) node.fail("only digits of base64");
  const std::string bytes = decoded(text);
  if (encoded(bytes) != text) node.fail("base64 as this library writes it, with its \"=\"");
  const std::size_t row_size = sizeof(double) * static_cast<std::size_t>(columns);
  if (bytes.empty() || bytes.size() % row_size != 0) {
    node.fail("rows of " + std::to_string(columns) + " numbers, " + std::to_string(row_size) +
              " bytes each, and at least one; these are " + std::to_string(bytes.size()) + " bytes");
  }
  Wrenches rows(static_cast<Eigen::Index>(bytes.size() / row_size), columns);
  std::memcpy(rows.data(), bytes.data(), bytes.size());
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

std::vector<std::string> read_names(const JsonNode& node) {
  std::vector<std::string> names;
  for (const JsonNode& item : node.items()) names.push_back(item.text());
  if (names.empty()) node.fail("a list of at least one name");
  return names;
}

Eigen::VectorXd read_numbers(const JsonNode& node, std::size_t count, bool infinite = false) {
  return Eigen::Map<const Eigen::VectorXd>(node.numbers(count, infinite).data(), static_cast<Eigen::Index>(count));
}

// What the laws of a Feedback and of a Policy have alike.
const std::vector<std::string> law_keys = {"delay", "low", "high", "start", "remembered"};

std::vector<std::string> with_law_keys(std::vector<std::string> keys) {
  keys.insert(keys.end(), law_keys.begin(), law_keys.end());
  return keys;
}

void read_law(const JsonNode& node, Feedback& law) {
  if (node.has("delay")) law.delay = node["delay"].integer();
  if (node.has("low")) law.low = read_numbers(node["low"], law.corrected.size(), true);
  if (node.has("high")) law.high = read_numbers(node["high"], law.corrected.size(), true);
  if (node.has("start")) law.start = node["start"].number();
  if (node.has("remembered")) law.memory = read_numbers(node["remembered"], node["remembered"].items().size());
}

void write_law(const Feedback& law, OrderedJson& json) {
  if (law.delay != 0) json["delay"] = law.delay;
  for (const auto& [name, numbers] : {std::pair{"low", &law.low}, {"high", &law.high}, {"remembered", &law.memory}}) {
    for (const double number : *numbers) json[name].push_back(problem_io::write(number));
  }
  if (law.start != 0.0) json["start"] = law.start;
}

Feedback read_feedback(const JsonNode& node) {
  node.allow_keys(with_law_keys({"period", "observed", "corrected", "gains", "references", "noise"}));
  Feedback feedback{node["period"].number(), read_names(node["observed"]), read_names(node["corrected"])};
  const auto n = static_cast<Eigen::Index>(feedback.observed.size());
  const auto m = static_cast<Eigen::Index>(feedback.corrected.size());
  const Wrenches gains = read_rows(node["gains"], static_cast<int>(m * n));
  for (Eigen::Index row = 0; row < gains.rows(); ++row) {
    feedback.gains.push_back(Eigen::Map<const States>(gains.row(row).data(), m, n));
  }
  feedback.references = read_rows(node["references"], static_cast<int>(n));
  if (node.has("noise")) feedback.noise = read_numbers(node["noise"], feedback.observed.size());
  read_law(node, feedback);
  return feedback;
}

OrderedJson write(const Feedback& feedback) {
  OrderedJson json = {{"period", feedback.period}, {"observed", feedback.observed}, {"corrected", feedback.corrected}};
  const auto count = static_cast<Eigen::Index>(feedback.gains.size());
  Wrenches gains(count, feedback.gains.front().size());
  for (Eigen::Index i = 0; i < count; ++i) {
    const States gain = feedback.gains[static_cast<std::size_t>(i)];
    gains.row(i) = Eigen::Map<const Eigen::RowVectorXd>(gain.data(), gain.size());
  }
  json["gains"] = pack(gains);
  json["references"] = pack(feedback.references);
  for (const double deviation : feedback.noise) json["noise"].push_back(deviation);
  write_law(feedback, json);
  return json;
}

OrderedJson write(const Policy& policy, const Feedback& law) {
  OrderedJson json = {{"name", policy.name}, {"period", law.period}, {"commanded", law.corrected}};
  if (!law.observed.empty()) json["observed"] = law.observed;
  if (policy.memory != 0) json["memory"] = policy.memory;
  for (const double deviation : policy.noise) json["noise"].push_back(deviation);
  write_law(law, json);
  return json;
}

// The plan of a policy that is known by its name. Throws unless it is the one that the file was written of.
const Plan& find_policy(const JsonNode& node, const std::string& name, const Policies& policies) {
  const auto found = policies.find(name);
  if (found != policies.end() && found->second.policy) return found->second;
  throw std::invalid_argument(node.path() + " is the policy " + in_quotes(name) +
                              ", whose code no file has: load it in Python, with policies={" + in_quotes(name) +
                              ": the em.Policy}");
}

void require_same(const std::string& name, const OrderedJson& given, const OrderedJson& wanted) {
  for (const char* key : {"period", "commanded", "observed", "memory", "noise", "delay", "low", "high"}) {
    const OrderedJson one = given.value(key, OrderedJson()), other = wanted.value(key, OrderedJson());
    if (one == other) continue;
    const auto shown = [](const OrderedJson& json) { return json.is_null() ? "none" : shortened(json.dump()); };
    throw std::invalid_argument("policies[" + in_quotes(name) + "] has " + key + " " + shown(one) +
                                ", expected that of the file, " + shown(other));
  }
}

void read_policy(const JsonNode& node, const Policies& policies, Plan& plan) {
  node.allow_keys(with_law_keys({"name", "period", "commanded", "observed", "memory", "noise"}));
  Feedback law{node["period"].number(), {}, read_names(node["commanded"])};
  if (node.has("observed")) law.observed = read_names(node["observed"]);
  read_law(node, law);
  const std::string name = node["name"].text();
  const Plan& given = find_policy(node, name, policies);
  Policy written;
  written.name = name;
  if (node.has("memory")) written.memory = node["memory"].integer();
  if (node.has("noise")) {
    const std::vector<double> noise = node["noise"].all_numbers();
    written.noise = Eigen::Map<const Eigen::VectorXd>(noise.data(), static_cast<Eigen::Index>(noise.size()));
  }
  require_same(name, write(*given.policy, *given.feedback), write(written, law));
  plan.feedback = std::move(law);
  plan.policy = given.policy;
}

Plan read_parts(const JsonNode& node, const Scene* scene, const Policies& policies) {
  const auto body = [scene](const JsonNode& name) { return scene ? read_body_name(name, *scene) : name.text(); };
  const auto joint = [scene](const JsonNode& name) {
    if (!scene || scene->find_tendon(name.text())) return name.text();
    const bool none = scene->joints().empty();
    return read_name(name, scene->joints(), none ? "no targets: the scene has no joints" : "one of the joints ");
  };
  node.allow_keys({"step", "wrenches", "targets", "velocities", "feedback", "policy"});
  Plan plan{node["step"].number()};
  for_each_item(node, "wrenches", [&](const JsonNode& drive) {
    drive.allow_keys({"body", "rows"});
    plan.wrenches.push_back({body(drive["body"]), read_rows(drive["rows"], 6)});
  });
  for_each_item(node, "targets", [&](const JsonNode& targets) {
    targets.allow_keys({"joint", "rows"});
    plan.targets.push_back({joint(targets["joint"]), read_rows(targets["rows"], 1)});
  });
  for_each_item(node, "velocities", [&](const JsonNode& servo) {
    servo.allow_keys({"body", "rows", "force", "torque"});
    plan.velocities.push_back({body(servo["body"]), read_rows(servo["rows"], 6)});
    if (servo.has("force")) plan.velocities.back().force = servo["force"].number();
    if (servo.has("torque")) plan.velocities.back().torque = servo["torque"].number();
  });
  if (node.has("feedback") && node.has("policy")) node.fail("a feedback or a policy");
  if (node.has("feedback")) plan.feedback = read_feedback(node["feedback"]);
  if (node.has("policy")) read_policy(node["policy"], policies, plan);
  return plan;
}

}  // namespace

Plan read_plan(const JsonNode& node, const Scene* scene, const Policies& policies) {
  return with_path(node, [&](const JsonNode& at) {
    Plan plan = read_parts(at, scene, policies);
    scene == nullptr ? validate(plan) : validate(plan, *scene);
    return plan;
  });
}

Plan read_plan(const Json& json, const Policies& policies) {
  return read_plan(JsonNode(json, "plan"), nullptr, policies);
}

OrderedJson write(const Plan& plan) {
  if (plan.policy && plan.policy->name.empty()) {
    reject("plan", "a Policy without name=", "em.Policy(..., name='...'): a file has the name in place of the code");
  }
  OrderedJson json = {{"step", plan.step}};
  for (const Drive& drive : plan.wrenches) {
    json["wrenches"].push_back({{"body", drive.body}, {"rows", pack(drive.wrenches)}});
  }
  for (const Targets& targets : plan.targets) {
    json["targets"].push_back({{"joint", targets.joint}, {"rows", pack(targets.positions)}});
  }
  for (const Servo& servo : plan.velocities) {
    OrderedJson motor = {{"body", servo.body}, {"rows", pack(servo.velocities)}};
    if (servo.force) motor["force"] = *servo.force;
    if (servo.torque) motor["torque"] = *servo.torque;
    json["velocities"].push_back(motor);
  }
  if (plan.policy) {
    json["policy"] = write(*plan.policy, *plan.feedback);
  } else if (plan.feedback) {
    json["feedback"] = write(*plan.feedback);
  }
  return json;
}

}  // namespace energymargin::problem_io
