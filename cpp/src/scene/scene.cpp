#include "energymargin/scene.hpp"

#include <algorithm>

#include "base/check.hpp"
#include "energymargin/kinematics.hpp"
#include "energymargin/plausible.hpp"
#include "energymargin/simulator.hpp"
#include "scene/records.hpp"
#include "scene/scene_checks.hpp"

namespace energymargin {
namespace {

// Bullet's articulated bodies move freely or along their joints; they know no locked axes.
void require_hangable(const Body& body, const std::string& what) {
  if (body.fixed()) reject(what, "'" + body.name + "'", "a body with a mass above 0; this one is fixed");
  if (body.linear_factor != Vector3::Ones() || body.angular_factor != Vector3::Ones()) {
    reject(what, "'" + body.name + "'", "a body without locked axes");
  }
}

template <typename Named>
std::size_t find(const std::unordered_map<std::string, std::size_t>& indices, const std::vector<Named>& all,
                 const std::string& name, const std::string& what) {
  if (const auto entry = indices.find(name); entry != indices.end()) return entry->second;
  std::string names;
  for (const Named& named : all) names += (names.empty() ? "'" : ", '") + named.name + "'";
  reject(what, "'" + name + "'", all.empty() ? "a " + what + ", but the scene has none" : "one of " + names);
}

void validate(const Stepping& stepping) {
  require_positive("step", stepping.step);
  if (stepping.step > plausible::refused_step) {
    reject("step", text(stepping.step), "at most " + text(plausible::refused_step) + " s");
  }
  if (const int most = stepping.most_iterations(); most < 1 || most > most_solver_iterations) {
    reject("solver_iterations", std::to_string(most),
           "a whole number from 1 to " + std::to_string(most_solver_iterations));
  }
  if (const double residual = stepping.residual(); !(residual > 0.0 && residual <= most_solver_tolerance)) {
    reject("solver_tolerance", text(residual), "a number above 0, at most " + text(most_solver_tolerance));
  }
  if (stepping.margin) require_positive("margin", *stepping.margin);
  if (stepping.simulator && stepping.step != stepping.simulator->step) {
    reject("step", text(stepping.step),
           text(stepping.simulator->step) + ", that of the engine '" + stepping.simulator->name + "'");
  }
}

// Two springs in series; each damper has its spring's share of the speed.
Surface contact_of(const Surface& a, const Surface& b) {
  Surface both;
  both.torsional_friction = std::max(a.torsional_friction, b.torsional_friction);
  both.rolling_friction = std::max(a.rolling_friction, b.rolling_friction);
  both.patch_radius = std::max(a.patch_radius, b.patch_radius);
  both.restitution = std::max(a.restitution, b.restitution);
  both.stiffness = a.stiffness + b.stiffness;
  both.damping = a.damping + b.damping;
  if (a.stiffness > 0.0 && b.stiffness > 0.0) {
    const double share_of_a = b.stiffness / both.stiffness, share_of_b = 1.0 - share_of_a;
    both.damping = a.damping * share_of_a * share_of_a + b.damping * share_of_b * share_of_b;
    both.stiffness = a.stiffness * share_of_a;
  }
  return both;
}

}  // namespace

Scene::Scene(const Vector3& gravity, const Stepping& stepping, FrictionRule friction_rule)
    : gravity_(gravity), stepping_(stepping), friction_rule_(friction_rule) {
  require_finite("gravity", gravity);
  validate(stepping);
}

Scene Scene::with_stepping(const Stepping& stepping) const {
  validate(stepping);
  Scene scene = *this;
  scene.stepping_ = stepping;
  scene.springs_.clear();
  for (const Spring& spring : springs_) scene.add_spring(spring);  // which may be too stiff for a longer step
  if (stepping.margin != stepping_.margin) {
    for (auto& constants : scene.constants_) constants = std::make_shared<BodyConstants>(*constants);
  }
  return scene;
}

Scene Scene::with_simulator(std::shared_ptr<const Simulator> simulator) const {
  const double step = simulator->step;
  return with_stepping({step, {}, {}, stepping_.margin, EngineKind::native, std::move(simulator)});
}

Scene Scene::with_body(const std::string& name, const BodyChange& change) const {
  if (stepping_.simulator) {
    reject("'" + name + "'", "to be changed in a scene that the engine '" + stepping_.simulator->name + "' steps",
           "engine 'native' or 'bullet': the bodies of that one are its own");
  }
  Body body = bodies_[index(name)];
  const std::optional<double>& mass = change.mass;
  body.friction = change.friction.value_or(body.friction);
  if (change.torsional_friction || change.rolling_friction) {
    if (!body.surface) body.surface = Surface{};
    body.surface->torsional_friction = change.torsional_friction.value_or(body.surface->torsional_friction);
    body.surface->rolling_friction = change.rolling_friction.value_or(body.surface->rolling_friction);
  }
  if (mass) {
    if (body.fixed()) reject("mass of '" + name + "'", text(*mass), "none: the body is fixed");
    require_positive("mass", *mass);
    if (body.inertial) body.inertial->moments *= *mass / body.mass;
    body.mass = *mass;
  }
  auto constants = validate_body(body);
  Scene scene = *this;
  if (mass) scene.constants_[index(name)] = std::move(constants);
  scene.bodies_[index(name)] = std::move(body);
  scene.springs_.clear();
  for (const Spring& spring : springs_) scene.add_spring(spring);  // which may be too stiff for a lighter body
  return scene;
}

std::size_t Scene::add_body(Body body) {
  if (body.name.empty()) reject("name", "empty", "a name that no other body of the scene has");
  if (body.name == "joints") reject("name", "'joints'", "another name: a state calls its joints so");
  if (body_indices_.count(body.name)) {
    reject("name", "'" + body.name + "'", "a name that no other body of the scene has");
  }
  constants_.push_back(validate_body(body));
  body_indices_[body.name] = bodies_.size();
  joints_to_.emplace_back();
  joints_below_.emplace_back();
  bodies_.push_back(std::move(body));
  return bodies_.size() - 1;
}

std::size_t Scene::add_joint(Joint joint) {
  std::size_t parent = 0;
  std::size_t child = 0;
  at_place("joint '" + joint.name + "': ", [&] {
    validate_joint(joint);
    if (find_tendon(joint.name)) reject("name", "'" + joint.name + "'", "a name that no tendon has");
    if (joint_indices_.count(joint.name)) reject("name", "'" + joint.name + "'", "a name that no other joint has");
    parent = index(joint.parent);
    child = index(joint.child);
    require_hangable(bodies_[child], "child");
    if (bodies_[child].damped()) reject("child", "'" + joint.child + "'", "a body without damping: its joint has it");
    if (bodies_[child].kinematic) reject("child", "'" + joint.child + "'", "a body that is not kinematic");
    if (!bodies_[parent].fixed()) require_hangable(bodies_[parent], "parent");
    if (joint_to(child)) reject("child", "'" + joint.child + "'", "a body that no other joint carries");
    if (carries(child, parent)) reject("parent", "'" + joint.parent + "'", "a body that the child does not carry");
    if (joint.mimic && !joints_[joint_index(joint.mimic->joint)].moves()) {
      reject("mimic", "of '" + joint.mimic->joint + "'", "of a joint that moves, and follows no other");
    }
  });
  joint_indices_[joint.name] = joints_.size();
  joints_to_[child] = joints_.size();
  joints_below_[parent].push_back(joints_.size());
  joints_.push_back(std::move(joint));
  place_links(joints_.size() - 1);
  return joints_.size() - 1;
}

// Whether a body is another one, or hangs on it. Most that are hung carry nothing: then there is no way up to go.
bool Scene::carries(std::size_t above, std::size_t body) const {
  if (above == body) return true;
  if (joints_below_[above].empty()) return false;
  while (const auto up = joint_to(body)) {
    body = index(joints_[*up].parent);
    if (body == above) return true;
  }
  return false;
}

// Places the link that a joint carries and all that hangs on it; the other links stay where they are.
void Scene::place_links(std::size_t joint) {
  for (std::vector<std::size_t> left{joint}; !left.empty();) {
    const Joint& next = joints_[left.back()];
    left.pop_back();
    const std::size_t child = index(next.child);
    JointState state = next.state;
    if (const auto& mimic = next.mimic) {
      const JointState& source = joints_[joint_index(mimic->joint)].state;
      state = {mimic->multiplier * source.position + mimic->offset, mimic->multiplier * source.velocity};
    }
    bodies_[child].state = child_state(next, state, bodies_[index(next.parent)].state);
    left.insert(left.end(), joints_below_[child].begin(), joints_below_[child].end());
  }
}

void Scene::add_tendon(Tendon tendon) {
  at_place("tendon '" + tendon.name + "': ", [&] {
    validate_tendon(tendon);
    if (find_tendon(tendon.name)) reject("name", "'" + tendon.name + "'", "a name that no other tendon has");
    if (joint_indices_.count(tendon.name)) reject("name", "'" + tendon.name + "'", "a name that no joint has");
    std::set<std::size_t> trees;
    for (const TendonJoint& of : tendon.joints) {
      const std::size_t joint = joint_index(of.joint);
      if (joints_[joint].type == JointType::fixed) reject("joints", "'" + of.joint + "'", "joints that are not fixed");
      trees.insert(tree_of(joint));
    }
    if (trees.size() > 2) {
      reject("joints", "of " + std::to_string(trees.size()) + " chains of links that hang on fixed bodies alone",
             "of at most two, or a body with a mass that carries them");
    }
  });
  tendons_.push_back(std::move(tendon));
}

void Scene::add_loop(Loop loop) {
  at_place("loop '" + loop.body_a + "' - '" + loop.body_b + "': ", [&] {
    require_fields(loop);
    const Body& a = bodies_[index(loop.body_a)];
    const Body& b = bodies_[index(loop.body_b)];
    if (a.name == b.name) reject("body_b", "'" + loop.body_b + "'", "another body than body_a");
    if (!a.dynamic() && !b.dynamic()) reject("body_b", "'" + loop.body_b + "'", "at most one fixed or kinematic body");
  });
  loops_.push_back(std::move(loop));
}

// The free body that a joint hangs on in the end or, on a fixed one, the first joint there.
std::size_t Scene::tree_of(std::size_t joint) const {
  while (true) {
    const std::size_t parent = index(joints_[joint].parent);
    if (bodies_[parent].fixed()) return bodies_.size() + joint;
    if (!joint_to(parent)) return parent;
    joint = *joint_to(parent);
  }
}

void Scene::add_spring(Spring spring) {
  at_place("spring '" + spring.body_a + "' - '" + spring.body_b + "': ",
           [&] { validate_spring(spring, body(spring.body_a), body(spring.body_b), springs_, stepping_.step); });
  springs_.push_back(std::move(spring));
}

void Scene::disable_collisions(const std::string& body_a, const std::string& body_b) {
  if (index(body_a) == index(body_b)) reject("body_b", "'" + body_b + "'", "another body than body_a");
  disabled_.insert(std::minmax(body_a, body_b));
}

void Scene::set_friction(const PairFriction& pair) {
  const auto [a, b] = std::minmax({index(pair.body_a), index(pair.body_b)});
  if (a == b) reject("body_b", "'" + pair.body_b + "'", "another body than body_a");
  require_not_negative("friction", pair.friction);
  require_not_negative("torsional_friction", pair.torsional_friction.value_or(0.0));
  require_not_negative("rolling_friction", pair.rolling_friction.value_or(0.0));
  PairFriction& set = pair_frictions_[{a, b}];
  set = {bodies_[a].name, bodies_[b].name, pair.friction,
         pair.torsional_friction ? pair.torsional_friction : set.torsional_friction,
         pair.rolling_friction ? pair.rolling_friction : set.rolling_friction};
}

std::vector<PairFriction> Scene::pair_frictions() const {
  std::vector<PairFriction> frictions;
  for (const auto& [indices, pair] : pair_frictions_) frictions.push_back(pair);
  return frictions;
}

double Scene::contact_friction(std::size_t a, std::size_t b) const {
  if (const auto pair = pair_frictions_.find(std::minmax(a, b)); pair != pair_frictions_.end()) {
    return pair->second.friction;
  }
  const double of_a = bodies_[a].friction;
  const double of_b = bodies_[b].friction;
  return friction_rule_ == FrictionRule::max ? std::max(of_a, of_b) : of_a * of_b;
}

bool Scene::has_surfaces() const {
  const auto pair_turns = [](const auto& at) { return at.second.torsional_friction || at.second.rolling_friction; };
  const auto has_own = [](const Body& body) { return body.surface || !body.surface_velocity.isZero(0.0); };
  return std::any_of(pair_frictions_.begin(), pair_frictions_.end(), pair_turns) ||
         std::any_of(bodies_.begin(), bodies_.end(), has_own);
}

Surface Scene::contact_surface(std::size_t a, std::size_t b) const {
  Surface both = contact_of(bodies_[a].surface.value_or(Surface{}), bodies_[b].surface.value_or(Surface{}));
  if (const auto pair = pair_frictions_.find(std::minmax(a, b)); pair != pair_frictions_.end()) {
    both.torsional_friction = pair->second.torsional_friction.value_or(both.torsional_friction);
    both.rolling_friction = pair->second.rolling_friction.value_or(both.rolling_friction);
  }
  return both;
}

const Inertial& Scene::inertial(std::size_t body) const { return constants_[body]->inertial(); }
double Scene::smallest_half_extent(std::size_t body) const { return constants_[body]->smallest_half_extent(); }
const CollisionShape& Scene::collision_shape(std::size_t body) const {
  return constants_[body]->collision_shape(bodies_[body], stepping_.margin);
}

std::size_t Scene::index(const std::string& name) const { return find(body_indices_, bodies_, name, "body"); }

std::size_t Scene::joint_index(const std::string& name) const { return find(joint_indices_, joints_, name, "joint"); }

std::optional<std::size_t> Scene::find_tendon(const std::string& name) const {
  for (std::size_t i = 0; i < tendons_.size(); ++i) {
    if (tendons_[i].name == name) return i;
  }
  return std::nullopt;
}

const PositionControl& Scene::control(std::size_t index) const {
  if (index < joints_.size()) return joints_[index];
  index -= joints_.size();
  if (index < tendons_.size()) return tendons_[index];
  return stepping_.simulator->commands[index - tendons_.size()];
}

std::size_t Scene::control_index(const std::string& name) const {
  if (stepping_.simulator) {
    const auto& commands = stepping_.simulator->commands;
    std::string names;
    for (std::size_t i = 0; i < commands.size(); ++i) {
      if (commands[i].name == name) return joints_.size() + tendons_.size() + i;
      names += (i == 0 ? "'" : ", '") + commands[i].name + "'";
    }
    const std::string engine = "the engine '" + stepping_.simulator->name + "'";
    reject("target", "'" + name + "'",
           names.empty() ? "none: " + engine + " has no commands" : "one of " + names + ", the commands of " + engine);
  }
  const auto tendon = find_tendon(name);
  return tendon ? joints_.size() + *tendon : joint_index(name);
}

std::size_t Scene::root(std::size_t body) const {
  while (const auto joint = joint_to(body)) body = index(joints_[*joint].parent);
  return body;
}

bool Scene::rigid(const Joint& joint) const {
  if (joint.mimic) return rigid(joints_[joint_index(joint.mimic->joint)]);
  return joint.type == JointType::fixed || joint.held;
}

std::vector<std::size_t> Scene::with_role(Role role) const {
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    if (bodies_[i].role == role) indices.push_back(i);
  }
  return indices;
}

}  // namespace energymargin
