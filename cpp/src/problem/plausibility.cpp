#include "energymargin/plausibility.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>
#include <variant>

#include "base/check.hpp"
#include "energymargin/kinematics.hpp"
#include "energymargin/membership.hpp"
#include "scene/scene_checks.hpp"

namespace energymargin {
namespace {

using Warnings = std::vector<Warning>;

// A foot of a thousandth of what stands on it, by a joint, creeps by 0.3 mm/s at 1/240 s, one of 1e-5 by 5 mm/s.
constexpr double joint_mass_ratio = 1e3;
// What is in a loop turns by this in a step: the ways of the loop's ends are no longer nearly straight.
constexpr double loop_spin = 0.3;  // [rad]
// A plan's rows are a controller's, of milliseconds; a question is about the seconds of a manipulation.
constexpr double longest_row = 2.0;       // of several in a plan [s]
constexpr double longest_horizon = 60.0;  // [s]
// A hand that pushes an object away does it with a few times its weight; in millinewtons it is a thousand times.
constexpr double most_weights = 1000.0;
constexpr double usual_gravity = 9.81;  // of the weight where there is none [m/s^2]
// A set so much larger than all that there is holds an object that has left long ago.
constexpr double most_reaches = 10.0;

std::string of_body(const Body& body, const std::string& quantity) { return "body '" + body.name + "': " + quantity; }

void warn(Warnings& warnings, const std::string& about, const std::string& value, const std::string& why) {
  warnings.push_back({about, about + " is " + value + ", " + why});
}

double least_extent(const Scene& scene, std::size_t body) { return 2.0 * scene.smallest_half_extent(body); }

// inf for a scene in which nothing with an extent moves.
double least_moving_extent(const Scene& scene) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < scene.bodies().size(); ++i) {
    if (!scene.bodies()[i].fixed()) least = std::min(least, least_extent(scene, i));
  }
  return least;
}

void check_extent(Warnings& warnings, const Scene& scene, std::size_t index, double least_moving) {
  const Body& body = scene.bodies()[index];
  const double extent = least_extent(scene, index);
  if (!std::isfinite(extent) || extent < plausible::extent) return;
  if (body.fixed() && !(extent >= plausible::extent_ratio * least_moving)) return;
  const std::string beside = body.fixed() ? " beside a body of " + text(least_moving) + " m that moves" : "";
  warn(warnings, of_body(body, "its least extent"), text(extent) + " m",
       "a building's" + beside +
           ": sizes are in metres; was it meant in millimetres, or the mesh's scale 1000 times less?");
}

// A constant force that holds a body's own weight stands for a machine, and so does its mass.
bool is_driven(const Scene& scene, const Body& body) {
  return !scene.gravity().isZero(0.0) && body.force.isApprox(-body.mass * scene.gravity());
}

void check_density(Warnings& warnings, const Scene& scene, std::size_t index) {
  const Body& body = scene.bodies()[index];
  const bool counts = body.dynamic() && !is_driven(scene, body);
  const double volume = counts ? mass_properties(body.shape, 1.0).volume : 0.0;
  if (!(volume > 0.0)) return;
  const double density = body.mass / volume;
  const bool robot = body.role == Role::effector || scene.jointed(index);
  const std::string value = text(body.mass) + " kg";
  if (density > (robot ? plausible::robot_density : plausible::density)) {
    warn(warnings, of_body(body, "mass"), value,
         "which makes " + text(density) + " kg/m^3, denser than any solid: was it meant in grams?");
  } else if (density < plausible::least_implied_density && !robot) {
    warn(warnings, of_body(body, "mass"), value,
         "which makes " + text(density) +
             " kg/m^3, lighter than air: was it meant in tonnes, or a size in millimetres?");
  }
}

// A body with all its mass in its farthest point has a radius of gyration of its reach; robots' readers warn of links.
void check_inertial(Warnings& warnings, const Scene& scene, std::size_t index) {
  const Body& body = scene.bodies()[index];
  const bool robot = body.role == Role::effector || scene.jointed(index);
  if (!body.inertial || !body.dynamic() || robot) return;
  const double reach = reach_from(body.shape, body.inertial->center);
  const double gyration = std::sqrt(0.5 * body.inertial->moments.sum() / body.mass);
  if (!std::isfinite(reach) ||
      (gyration <= plausible::most_gyration * reach && gyration >= plausible::least_gyration * reach)) {
    return;
  }
  warn(warnings, of_body(body, "the inertia's radius of gyration"), text(gyration) + " m",
       "of a shape within " + text(reach) + " m of the centre of mass: is the inertia in kg m^2, and of this mass?");
}

// (1, 0, 0, 0) is no turn where w comes first, and here a half turn about x. (-1, 0, 0, 0) is the same half turn.
bool is_w_first(const Quaternion& orientation) { return orientation.coeffs() == Eigen::Vector4d(1.0, 0.0, 0.0, 0.0); }

void check_orientation(Warnings& warnings, const std::string& about, const Quaternion& orientation) {
  if (!is_w_first(orientation)) return;
  warn(warnings, about, "(1, 0, 0, 0)",
       "a half turn about x, since the order is x, y, z, w: no turn is (0, 0, 0, 1), and (-1, 0, 0, 0) says that the "
       "half turn is meant");
}

void check_joint(Warnings& warnings, const Joint& joint) {
  const std::string name = "joint '" + joint.name + "': ";
  check_orientation(warnings, name + "orientation", joint.in_parent.orientation);
  check_orientation(warnings, name + "child_orientation", joint.in_child.orientation);
  if (joint.type != JointType::revolute) return;
  for (const auto& [what, angle] : {std::pair{"lower limit", joint.lower}, std::pair{"upper limit", joint.upper},
                                    std::pair{"start", joint.state.position}, std::pair{"target", joint.target}}) {
    if (!std::isfinite(angle) || std::abs(angle) <= plausible::joint_angle) continue;
    warn(warnings, name + what, text(angle) + " rad", "beyond two turns: was it meant in degrees?");
  }
}

double reach_of(const Body& body) { return reach_from(body.shape, Vector3::Zero()); }

// A flat patch of radius r twists against 2/3 mu r.
void check_turning(Warnings& warnings, const std::string& of, double torsional, double rolling, double reach) {
  for (const auto& [name, friction] :
       {std::pair{"torsional_friction", torsional}, std::pair{"rolling_friction", rolling}}) {
    if (!(reach > 0.0 && friction > reach)) continue;
    const std::string why = "longer than what touches, " + text(reach) + " m: a contact's patch is smaller than that";
    warn(warnings, of + name, text(friction) + " m", why);
  }
}

// Frictions of surfaces and of pairs that turn; a fixed body touches what moves.
void check_surfaces(Warnings& warnings, const Scene& scene) {
  if (!scene.has_surfaces()) return;
  double moving = 0.0;
  for (const Body& body : scene.bodies()) moving = body.fixed() ? moving : std::max(moving, reach_of(body));
  for (const Body& body : scene.bodies()) {
    const Surface surface = body.surface.value_or(Surface{});
    const double reach = std::min(moving, reach_of(body));
    check_turning(warnings, of_body(body, ""), surface.torsional_friction, surface.rolling_friction, reach);
  }
  for (const PairFriction& pair : scene.pair_frictions()) {
    const double reach = std::min(reach_of(scene.body(pair.body_a)), reach_of(scene.body(pair.body_b)));
    check_turning(warnings,
                  "bodies '" + pair.body_a + "' and '" + pair.body_b + "': ", pair.torsional_friction.value_or(0.0),
                  pair.rolling_friction.value_or(0.0), reach);
  }
}

// A loop whose ends are apart at the start. Another loop, or joints at their stops, may keep them apart.
void check_loops(Warnings& warnings, const Scene& scene, const State& state) {
  if (scene.loops().empty()) return;
  const Kinematics kinematics(scene);
  for (const Loop& loop : scene.loops()) {
    const BodyState a = state_at_point(loop.point_a, kinematics(state.data(), scene.index(loop.body_a)));
    const BodyState b = state_at_point(loop.point_b, kinematics(state.data(), scene.index(loop.body_b)));
    const double gap = (a.position - b.position).norm();
    const bool turns = loop.type == LoopType::weld;
    const double turn = (a.orientation * loop.orientation_a).angularDistance(b.orientation * loop.orientation_b);
    if (gap <= plausible::loop_gap && !(turns && turn > plausible::loop_turn)) continue;
    warn(warnings, "state: the gap of loop '" + loop.body_a + "' - '" + loop.body_b + "'",
         text(gap) + " m" + (turns ? " and " + text(turn) + " rad" : ""),
         "which the first steps close, a fifth in each, or never if another loop or joint contradicts it: start its "
         "bodies and joints where its ends meet, or give it the points where they are");
  }
}

// Links of one tree are simulated in its joints' coordinates, so that their masses count together.
void check_mass_ratio(Warnings& warnings, const Scene& scene) {
  std::map<std::size_t, double> masses;
  for (std::size_t i = 0; i < scene.bodies().size(); ++i) {
    if (scene.bodies()[i].dynamic() && !is_driven(scene, scene.bodies()[i]))
      masses[scene.root(i)] += scene.bodies()[i].mass;
  }
  if (masses.empty()) return;
  const auto less = [](const auto& a, const auto& b) { return a.second < b.second; };
  const auto [light, heavy] = std::minmax_element(masses.begin(), masses.end(), less);
  if (heavy->second < plausible::mass_ratio * light->second) return;
  const auto name = [&](const auto& of) { return "'" + scene.bodies()[of->first].name + "'"; };
  warn(warnings, "the ratio of masses of " + name(heavy) + " and " + name(light),
       text(heavy->second) + " kg to " + text(light->second) + " kg",
       "too much for the solver's iterations, and the light one may be pressed through: is one in grams?");
}

// Bodies that no joint moves against each other count as one.
std::size_t carrier_of(const Scene& scene, std::size_t body) {
  const auto joint = scene.joint_to(body);
  if (!joint || !scene.rigid(scene.joints()[*joint])) return body;
  return carrier_of(scene, scene.index(scene.joints()[*joint].parent));
}

// A light link that collides beside a heavy one: its contacts are as soft as suits its own mass. One that collides with
// nothing, as in a chain of coordinates, is simulated exactly.
void check_joint_mass_ratio(Warnings& warnings, const Scene& scene) {
  struct Part {
    double mass = 0.0;
    bool moves = true, collides = false;
  };
  std::map<std::size_t, Part> parts;
  for (std::size_t i = 0; i < scene.bodies().size(); ++i) {
    const Body& body = scene.bodies()[i];
    Part& part = parts[carrier_of(scene, i)];
    part.mass += body.mass;
    part.moves = part.moves && body.dynamic();
    part.collides = part.collides || reach_of(body) > 0.0;
  }
  for (const Joint& joint : scene.joints()) {
    if (scene.rigid(joint)) continue;
    std::size_t light = carrier_of(scene, scene.index(joint.parent)), heavy = scene.index(joint.child);
    if (parts[light].mass > parts[heavy].mass) std::swap(light, heavy);
    if (!parts[light].moves || !parts[heavy].moves || !parts[light].collides) continue;
    if (parts[heavy].mass < joint_mass_ratio * parts[light].mass) continue;
    const auto name = [&](std::size_t body) { return "'" + scene.bodies()[body].name + "'"; };
    warn(warnings, "joint '" + joint.name + "': the ratio of masses of " + name(heavy) + " and " + name(light),
         text(parts[heavy].mass) + " kg to " + text(parts[light].mass) + " kg",
         "too much for contacts of the light one, which give way under the heavy one: is one in grams? A shorter step "
         "or an armature of the joint helps");
  }
}

// Nothing collides with anything, as in files of robots that have visuals alone.
void check_collides(Warnings& warnings, const Scene& scene) {
  const auto is_empty = [](const Body& body) { return reach_of(body) == 0.0; };
  if (scene.bodies().empty() || !std::all_of(scene.bodies().begin(), scene.bodies().end(), is_empty)) return;
  warn(warnings, "the scene's collision shapes", "none",
       "so that no body touches another: does its file have visuals alone, or geoms that collide with nothing?");
}

// Loops are closed step by step.
void check_loop_spin(Warnings& warnings, const Scene& scene, const State& state) {
  if (scene.loops().empty()) return;
  const Kinematics kinematics(scene);
  std::set<std::string> told;
  for (const Loop& loop : scene.loops()) {
    for (const std::string& name : {loop.body_a, loop.body_b}) {
      const double turn = scene.stepping().step * kinematics(state.data(), scene.index(name)).angular_velocity.norm();
      if (!(turn > loop_spin) || !told.insert(name).second) continue;
      warn(warnings, "state: the turn of body '" + name + "', which is in a loop, in a step", text(turn) + " rad",
           "more than " + text(loop_spin) + " rad: what a loop holds moves less exactly then; take a step of " +
               text(scene.stepping().step * loop_spin / turn) + " s or less");
    }
  }
}

// The nearest other body to one, and how far it is: inf if there is none, and the first one that is near enough.
std::pair<std::string, double> nearest_body(World& world, const State& state, const Body& body) {
  std::pair<std::string, double> nearest{"", std::numeric_limits<double>::infinity()};
  for (const Body& other : world.scene().bodies()) {
    if (other.name == body.name) continue;
    const double distance = world.distance(state, body.name, other.name);
    if (distance < nearest.second) nearest = {other.name, distance};
    if (distance < plausible::gap) break;
  }
  return nearest;
}

// Whether it would fall if nothing touched it: nothing but gravity acts on it, and it is at rest.
bool would_fall(const Scene& scene, const Body& body, const BodyState& at) {
  const bool pulled = (scene.gravity().array() * body.linear_factor.array() != 0.0).any();
  const auto holds = [&](const auto& tie) { return tie.body_a == body.name || tie.body_b == body.name; };
  const bool held = std::any_of(scene.springs().begin(), scene.springs().end(), holds) ||
                    std::any_of(scene.loops().begin(), scene.loops().end(), holds);
  return pulled && !held && body.force.isZero(0.0) && at.velocity.norm() < plausible::at_rest;
}

void check_floating(Warnings& warnings, const Problem& problem) {
  const Scene& scene = problem.scene;
  const Kinematics kinematics(scene);
  std::optional<World> world;
  for (const std::size_t index : scene.with_role(Role::object)) {
    const Body& object = scene.bodies()[index];
    if (scene.joint_to(index) || !would_fall(scene, object, kinematics(problem.state.data(), index))) continue;
    if (!world) world.emplace(scene);
    const auto [other, distance] = nearest_body(*world, problem.state, object);
    if (!std::isfinite(distance) || distance < plausible::gap) continue;
    warn(warnings, of_body(object, "its distance to the nearest body, '" + other + "',"), text(distance) + " m",
         "and it is at rest: nothing holds it, so that it falls before anything disturbs it");
  }
}

// A user's own predicate may fail, which the search will tell.
bool is_outside(const Problem& problem) {
  try {
    return !Membership(problem.captured, problem.scene)(problem.state);
  } catch (const std::logic_error&) {
    return false;
  } catch (const std::runtime_error&) {
    return false;
  }
}

void check_outside(Warnings& warnings, const Problem& problem) {
  if (problem.captured_any || !is_outside(problem)) return;
  const std::size_t object = problem.scene.with_role(Role::object).front();
  const BodyState at = Kinematics(problem.scene)(problem.state.data(), object);
  warn(warnings, "state",
       "one in which '" + problem.scene.bodies()[object].name + "' at " + text(at.position) + " is outside of captured",
       "the capture set, so that it has escaped before the search begins: start_outside=True says that it is meant");
}

void check_times(Warnings& warnings, const Problem& problem) {
  const auto check = [&](const std::string& about, double time, double most, const std::string& what) {
    if (time > most)
      warn(warnings, about, text(time) + " s", "a long time for " + what + ": was it meant in milliseconds?");
  };
  check("duration", problem.duration, plausible::duration, "one push of a disturbance, the longest edge of the search");
  const Plan* plan = problem.plan ? &*problem.plan : nullptr;
  if (plan && plan->rows() > 1) check("the plan's step", plan->step, longest_row, "one of its rows");
  check("horizon", problem.horizon.value_or(plan ? plan->duration() : 0.0), longest_horizon,
        "whether an object stays where it is");
}

void check_force(Warnings& warnings, const Problem& problem) {
  double heaviest = 0.0;
  for (const std::size_t object : problem.scene.with_role(Role::object)) {
    heaviest = std::max(heaviest, problem.scene.bodies()[object].mass);
  }
  const double most = problem.force.maxCoeff(), pull = problem.scene.gravity().norm();
  const double weight = heaviest * (pull > 0.0 ? pull : usual_gravity);
  if (!(most > most_weights * weight) || weight == 0.0) return;
  warn(warnings, "force", text(problem.force) + " N",
       "more than " + text(most_weights) + " times the weight of an object, " + text(weight) +
           " N: nothing holds against that; was it meant in millinewtons, or the mass in grams?");
}

// Radius or half of the least edge of the largest ball, disc or box that a set is made of; 0 if it has none.
struct LargestPart {
  double of(const Region& region) const { return std::visit(*this, region.expression()); }
  double operator()(const regions::Ball& ball) const { return ball.radius; }
  double operator()(const regions::Disc& disc) const { return disc.radius; }
  double operator()(const regions::Box& box) const { return 0.5 * box.size.minCoeff(); }
  double operator()(const regions::Intersection& set) const {
    double least = 0.0;
    for (const Region& part : set.of) {
      const double size = of(part);
      if (size > 0.0 && (least == 0.0 || size < least)) least = size;
    }
    return least;
  }
  double operator()(const regions::Union& set) const {
    double most = 0.0;
    for (const Region& part : set.of) most = std::max(most, of(part));
    return most;
  }
  template <typename Other>
  double operator()(const Other&) const {
    return 0.0;
  }
};

void check_captured(Warnings& warnings, const Problem& problem) {
  const Scene& scene = problem.scene;
  const Kinematics kinematics(scene);
  const auto at = [&](std::size_t body) { return kinematics(problem.state.data(), body).position; };
  const Vector3 middle = at(scene.with_role(Role::object).front());
  double farthest = 0.0;
  for (std::size_t i = 0; i < scene.bodies().size(); ++i) {
    const double reach = reach_of(scene.bodies()[i]);
    if (std::isfinite(reach)) farthest = std::max(farthest, (at(i) - middle).norm() + reach);
  }
  const double largest = LargestPart{}.of(problem.captured);
  if (!std::isfinite(largest) || !(largest > most_reaches * farthest) || farthest == 0.0) return;
  warn(warnings, "captured", "a set of " + text(largest) + " m around its centre",
       "more than " + text(most_reaches) + " times as far as all bodies reach, " + text(farthest) +
           " m: an object that is lost is still in it; was it meant in centimetres or millimetres?");
}

}  // namespace

std::vector<Warning> implausible(const Scene& scene) {
  Warnings warnings;
  if (scene.stepping().step > plausible::step) {
    warn(warnings, "step", text(scene.stepping().step) + " s",
         "in which a body falls " + text(9.81 * scene.stepping().step * scene.stepping().step) +
             " m: a step of 1/240 s is usual");
  }
  const double least_moving = least_moving_extent(scene);
  for (std::size_t i = 0; i < scene.bodies().size(); ++i) {
    const Body& body = scene.bodies()[i];
    check_extent(warnings, scene, i, least_moving);
    check_density(warnings, scene, i);
    check_inertial(warnings, scene, i);
    if (!scene.joint_to(i)) check_orientation(warnings, of_body(body, "orientation"), body.state.orientation);
  }
  for (const Joint& joint : scene.joints()) check_joint(warnings, joint);
  check_mass_ratio(warnings, scene);
  check_joint_mass_ratio(warnings, scene);
  check_collides(warnings, scene);
  check_surfaces(warnings, scene);
  return warnings;
}

std::vector<Warning> implausible(const Problem& problem, bool start_outside) {
  Warnings warnings = implausible(problem.scene);
  check_times(warnings, problem);
  check_force(warnings, problem);
  check_captured(warnings, problem);
  const StateLayout layout(problem.scene);
  for (std::size_t i = 0; i < problem.scene.bodies().size(); ++i) {
    const Body& body = problem.scene.bodies()[i];
    if (layout.offset(i) < 0 || is_w_first(body.state.orientation)) continue;
    check_orientation(warnings, "state: " + of_body(body, "orientation"),
                      StateLayout::read(problem.state.data() + layout.offset(i)).orientation);
  }
  for (Warning& joint : implausible_joints(problem.scene, problem.state)) warnings.push_back(std::move(joint));
  check_loops(warnings, problem.scene, problem.state);
  check_loop_spin(warnings, problem.scene, problem.state);
  check_floating(warnings, problem);
  if (!start_outside) check_outside(warnings, problem);
  return warnings;
}

std::vector<Warning> implausible_joints(const Scene& scene, const State& state) {
  validate(scene, state);
  Warnings warnings;
  const StateLayout layout(scene);
  for (std::size_t i = 0; i < scene.joints().size(); ++i) {
    const Joint& joint = scene.joints()[i];
    if (!joint.moves()) continue;
    const double position = layout.joint(state.data(), i).position;
    const double beyond = beyond_limits(joint, position);
    if (beyond == 0.0) continue;
    const bool revolute = joint.type == JointType::revolute;
    const std::string unit = revolute ? " rad" : " m";
    const bool low = position < joint.lower;
    warn(warnings, "state: joint '" + joint.name + "': position", text(position) + unit,
         text(beyond) + unit + " beyond its " + (low ? "lower" : "upper") + " limit of " +
             text(low ? joint.lower : joint.upper) + unit + ", which pushes it back in a simulation" +
             (revolute ? ": was it meant in degrees?" : ": was it meant in millimetres?"));
  }
  return warnings;
}

std::vector<Warning> implausible_start(World& world, const State& state) {
  Warnings warnings = implausible_joints(world.scene(), state);
  check_loops(warnings, world.scene(), state);
  check_loop_spin(warnings, world.scene(), state);
  const Contact contact = deepest_contact(world.scene(), state);
  if (contact.distance == 0.0) return warnings;
  const double most = plausible::overlap * smaller_half_extent(world.scene(), contact);
  if (-contact.distance <= most) return warnings;
  warn(warnings, "the overlap of '" + contact.body_a + "' and '" + contact.body_b + "' at the start",
       text(-contact.distance) + " m",
       "more than " + text(most) + " m, half of the thinner one: they are thrown apart by forces that mean nothing");
  return warnings;
}

std::optional<Warning> implausible_angle(const std::string& name, double angle) {
  if (!(std::abs(angle) > plausible::angle)) return std::nullopt;
  if (std::abs(angle) > plausible::refused_angle) {
    reject(name, text(angle), "at most " + text(plausible::refused_angle) + " rad");
  }
  return Warning{name, name + " is " + text(angle) + " rad, beyond a full turn: was it meant in degrees? Then write " +
                           "math.radians(" + text(angle) + ")"};
}

std::optional<Warning> implausible_density(const std::string& name, double density) {
  if (!(density > 0.0 && density < plausible::least_density)) return std::nullopt;
  return Warning{name, name + " is " + text(density) +
                           " kg/m^3, lighter than foam: was it meant in g/cm^3? Then write " + text(1000.0 * density)};
}

double smaller_half_extent(const Scene& scene, const Contact& contact) {
  return std::min(scene.smallest_half_extent(scene.index(contact.body_a)),
                  scene.smallest_half_extent(scene.index(contact.body_b)));
}

std::string fingerprint(const Scene& scene) {
  const Stepping& stepping = scene.stepping();
  std::string words = text(stepping.step) + " " + std::to_string(stepping.most_iterations()) +
                      word_of(stepping.engine) + text(scene.gravity());
  if (stepping.simulator) words += stepping.simulator->digest;
  for (std::size_t i = 0; i < scene.bodies().size(); ++i) {
    const Body& body = scene.bodies()[i];
    words += "\n" + body.name + " " + text(body.mass) + " " + text(scene.smallest_half_extent(i));
  }
  for (const Joint& joint : scene.joints()) words += "\n" + joint.name + " " + text(joint.lower) + text(joint.upper);
  return words;
}

}  // namespace energymargin
