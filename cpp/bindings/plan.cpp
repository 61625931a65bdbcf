// Plans for Python.

#include "energymargin/plan.hpp"

#include "asking.hpp"
#include "callbacks.hpp"
#include "energymargin/problem_io.hpp"
#include "given.hpp"
#include "pickles.hpp"

namespace energymargin::binding {
namespace {

constexpr const char* plan_doc =
    R"(The robot's actions from a problem's state on: K rows in time, each for `step` [s].

Args:
    step: duration of a row [s], at least a step of the scene. Each row begins at the step that is nearest to its time.
    wrenches: by free or jointed body, shape (K, 6): force [N] and torque [N m] at its centre of mass, along the world's
        axes.
    targets: by joint under position control, shape (K,) [rad] or [m].
    velocities: by free body, shape (K, 6): the velocity of its frame [m/s] and its angular velocity [rad/s]. A motor of
        limited force keeps the body at them. A kinematic body has them, whatever it meets.
    limits: of the motors, by body of `velocities`: (force [N], torque [N m]), the largest along and about each axis of the
        world. By default twice what holds the body and its links against gravity, and that at the body's radius. A kinematic
        body has none.

After the last row motors and wrenches are off, joints keep their targets, and kinematic bodies their velocities. Raises ValueError on rows of unequal number,
or that are not finite.)";

using Limits = std::map<std::string, std::pair<Given<double>, Given<double>>>;

Plan plan_rows(const Given<double>& step, const Rows& wrenches, const Rows& targets, const Rows& velocities,
               const Limits& limits) {
  Plan plan = plan_of_rows("wrenches", wrenches, targets);
  plan.step = given("step", step);
  for (const auto& [body, rows] : velocities) {
    plan.velocities.push_back({body, matrix("velocities['" + body + "']", rows, -1, 6), std::nullopt, std::nullopt});
    const auto limit = limits.find(body);
    if (limit == limits.end()) continue;
    plan.velocities.back().force = given("limits['" + body + "'] force", limit->second.first);
    plan.velocities.back().torque = given("limits['" + body + "'] torque", limit->second.second);
  }
  for (const auto& [body, limit] : limits) {
    if (velocities.count(body) == 0) {
      throw std::invalid_argument("limits has '" + body + "', expected bodies of `velocities` only");
    }
  }
  return plan;
}

Plan plan_of(const Given<double>& step, const Rows& wrenches, const Rows& targets, const Rows& velocities,
             const Limits& limits) {
  Plan plan = plan_rows(step, wrenches, targets, velocities, limits);
  validate(plan);
  return plan;
}

constexpr const char* feedback_doc =
    R"doc(A plan that the robot corrects by what it observes: u = u_plan(t) + K(t) (x_ref(t) - x).

It is a Plan, and goes where a plan goes. A correction acts from one control time to the next; each control time is at the
step of the scene that is nearest to it. With a Feedback the last row of the plan stays, so that one row is enough.

Args:
    gains: K, shape (m, n), or (R, m, n) with one a control time, the last of which stays.
    observed: names of the n numbers x. Of a joint: its position "j" or velocity "j.velocity". Of a body: "b.x", "b.y", "b.z"
        [m], "b.rx", "b.ry", "b.rz" (rotation vector [rad]), "b.vx" to "b.vz" [m/s], "b.wx" to "b.wz" [rad/s]. Of two bodies:
        the normal force in the last step, "force(a, b)" [N].
    corrected: names of the m numbers u. A joint's target "j"; of a wrench "b.fx" to "b.fz" [N], "b.tx" to "b.tz" [N m], at the
        centre of mass; of a velocity "b.vx" to "b.wz" of a free body.
    states: x_ref, shape (n,), or (R, n) with a row a control time, the last of which stays; None: zero.
    targets, wrenches, velocities: u_plan, as of Plan. Wrenches and velocities that are left out are zero.
    motors: as the `limits` of Plan.
    period: between two control times [s].
    delay: control periods from an observation to its correction.
    limits: (low, high) of u, each (m,), infinite where there is none.
    start: of the law's time that is over as the plan begins [s].
    noise: standard deviations of what is added to x in rollouts, (n,) or one for all; None: none. Searches have none.
    step: of a row of the plan [s]; None: the period.

Raises ValueError on bad shapes, names and numbers.)doc";

using Bounds = std::optional<std::pair<GivenArray, GivenArray>>;

// The limits of all corrected numbers, if there are any.
void set_limits(Feedback& law, const Bounds& limits) {
  if (!limits) return;
  const auto count = static_cast<Eigen::Index>(law.corrected.size());
  law.low = vector("limits[0]", limits->first.value, count);
  law.high = vector("limits[1]", limits->second.value, count);
}

std::vector<Eigen::MatrixXd> gains_of(const GivenArray& given, Eigen::Index m, Eigen::Index n) {
  const auto array = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(given.value);
  const std::string expected =
      "shape (" + std::to_string(m) + ", " + std::to_string(n) + "), corrected by observed, or one a control time";
  if (!array || array.ndim() < 2)
    throw std::invalid_argument("gains is " + short_repr(given.value) + ", expected " + expected);
  const bool many = array.ndim() == 3;
  const auto size = [&](int axis) { return array.shape(axis + (many ? 1 : 0)); };
  if ((array.ndim() != 2 && !many) || size(0) != m || size(1) != n) {
    throw std::invalid_argument("gains is of shape " + py::str(array.attr("shape")).cast<std::string>() +
                                ", expected " + expected);
  }
  std::vector<Eigen::MatrixXd> gains;
  for (py::ssize_t i = 0; i < (many ? array.shape(0) : 1); ++i) {
    gains.emplace_back(Eigen::Map<const States>(array.data() + i * m * n, m, n));
  }
  return gains;
}

struct PlanWithFeedback : Plan {};

PlanWithFeedback feedback_of(const GivenArray& gains, std::vector<std::string> observed,
                             std::vector<std::string> corrected, const std::optional<GivenArray>& states,
                             const Rows& wrenches, const Rows& targets, const Rows& velocities, const Limits& motors,
                             const Given<double>& period, const Given<int>& delay, const Bounds& limits,
                             const Given<double>& start, const std::optional<GivenArray>& noise,
                             const std::optional<Given<double>>& step) {
  const auto m = static_cast<Eigen::Index>(corrected.size()), n = static_cast<Eigen::Index>(observed.size());
  Feedback law;
  law.gains = gains_of(gains, m, n);
  law.observed = std::move(observed);
  law.corrected = std::move(corrected);
  law.period = given("period", period);
  law.delay = count("delay", delay, 0);
  law.start = given("start", start);
  law.references = Eigen::MatrixXd::Zero(1, n);
  if (states) {
    const auto array = py::array::ensure(states->value);
    law.references = array && array.ndim() == 1 ? States(vector("states", states->value, n).transpose())
                                                : matrix("states", *states, -1, n);
  }
  if (noise) {
    auto array = py::array::ensure(noise->value);
    const bool is_one = array && array.ndim() == 0;
    law.noise = is_one ? vector("noise", array.reshape({1}), 1).replicate(n, 1) : vector("noise", noise->value, n);
  }
  set_limits(law, limits);
  return {with_feedback(plan_rows(step.value_or(period), wrenches, targets, velocities, motors), std::move(law))};
}

// A virtual spring and damper from a body's frame to where it is to be.
PlanWithFeedback impedance_of(const std::string& body, const GivenArray& stiffness, const GivenArray& damping,
                              const Given<double>& period, const std::optional<GivenArray>& states,
                              const Given<int>& delay, const Bounds& limits) {
  const auto names = [&body](std::initializer_list<const char*> words) {
    std::vector<std::string> full;
    for (const char* word : words) full.push_back(body + "." + word);
    return full;
  };
  States gains(6, 12);
  gains << States(vector("stiffness", stiffness.value, 6).asDiagonal()),
      States(vector("damping", damping.value, 6).asDiagonal());
  return feedback_of({py::cast(gains)}, names({"x", "y", "z", "rx", "ry", "rz", "vx", "vy", "vz", "wx", "wy", "wz"}),
                     names({"fx", "fy", "fz", "tx", "ty", "tz"}), states, {}, {}, {}, {}, period, delay, limits,
                     {py::cast(0.0)}, std::nullopt, std::nullopt);
}

// What is corrected moves on until a contact has its force.
PlanWithFeedback admittance_of(const std::map<std::string, std::string>& contacts, const Given<double>& force,
                               const Given<double>& compliance, const Given<double>& period, const Rows& wrenches,
                               const Rows& targets, const Rows& velocities, const Limits& motors,
                               const Given<int>& delay, const Bounds& limits) {
  std::vector<std::string> corrected, observed;
  for (const auto& [name, contact] : contacts) {
    corrected.push_back(name);
    if (std::find(observed.begin(), observed.end(), contact) == observed.end()) observed.push_back(contact);
  }
  States gains = States::Zero(static_cast<Eigen::Index>(corrected.size()), static_cast<Eigen::Index>(observed.size()));
  const double gain = given("compliance", compliance);
  for (std::size_t i = 0; i < corrected.size(); ++i) {
    const auto place = std::find(observed.begin(), observed.end(), contacts.at(corrected[i])) - observed.begin();
    gains(static_cast<Eigen::Index>(i), place) = gain;
  }
  const Eigen::VectorXd wanted = Eigen::VectorXd::Constant(gains.cols(), given("force", force));
  return feedback_of({py::cast(gains)}, observed, corrected, GivenArray{py::cast(wanted)}, wrenches, targets,
                     velocities, motors, period, delay, limits, {py::cast(0.0)}, std::nullopt, std::nullopt);
}

using Numbers = py::array_t<double>;
using ActFunction = py::typing::Callable<py::typing::Tuple<Numbers, Numbers>(double, int, Numbers,
                                                                             py::array_t<std::uint64_t>, Numbers)>;

constexpr const char* admittance_doc =
    R"doc(A robot that presses with a force: what it moves goes on, or gives way, until a contact has that force.

Args:
    contacts: by the name of a corrected number, as `corrected` of Feedback, which contact it controls, as
        {"slide": "force(finger, object)"}: fingers that press by targets, or an effector by velocities "b.vx".
    force: wanted normal force [N].
    compliance: of a target, [m/N] or [rad/N] for each newton that is missing; of a velocity [m/(N s)].

The others are as of Feedback.)doc";

struct PlanWithPolicy : Plan {};

PlanWithPolicy plan_with_policy(const ActFunction& act, std::vector<std::string> observed,
                                std::vector<std::string> commanded, const Given<double>& period,
                                const Given<int>& delay, const Given<int>& memory, const GivenArray& noise,
                                const Bounds& limits, std::string name) {
  auto policy = std::make_shared<Policy>();
  policy->name = std::move(name);
  policy->noise = vector("noise", noise.value, -1);
  policy->memory = count("memory", memory, 0);
  policy->act = AskedPolicy{Callback(act)};
  Feedback law;
  law.period = given("period", period);
  law.delay = count("delay", delay, 0);
  law.observed = std::move(observed);
  law.corrected = std::move(commanded);
  set_limits(law, limits);
  Plan plan;
  plan.step = law.period;
  plan.policy = std::move(policy);
  return {with_feedback(std::move(plan), std::move(law))};
}

using RowsByName = py::typing::Dict<py::str, py::object>;

template <typename Part, typename Numbers>
RowsByName by_name(const std::vector<Part>& parts, std::string Part::* name, Numbers Part::* rows) {
  py::dict values;
  for (const Part& part : parts) values[py::str(part.*name)] = part.*rows;
  return values;
}

RowsByName wrenches_of(const Plan& plan) { return by_name(plan.wrenches, &Drive::body, &Drive::wrenches); }
RowsByName targets_of(const Plan& plan) { return by_name(plan.targets, &Targets::joint, &Targets::positions); }
RowsByName velocities_of(const Plan& plan) { return by_name(plan.velocities, &Servo::body, &Servo::velocities); }

RowsByName limits_of(const Plan& plan) {
  py::dict limits;
  for (const Servo& servo : plan.velocities) {
    if (servo.force && servo.torque) limits[py::str(servo.body)] = py::make_tuple(*servo.force, *servo.torque);
  }
  return limits;
}

py::object law_of(const Plan& plan) {
  if (!plan.feedback) return py::none();
  const Feedback& law = *plan.feedback;
  py::list gains;
  for (const Eigen::MatrixXd& gain : law.gains) gains.append(gain);
  py::dict arguments;
  arguments["gains"] = py::module_::import("numpy").attr("array")(gains);
  arguments["observed"] = law.observed;
  arguments["corrected"] = law.corrected;
  arguments["states"] = law.references;
  arguments["period"] = law.period;
  arguments["delay"] = law.delay;
  arguments["limits"] = law.low.size() == 0 ? py::object(py::none()) : py::make_tuple(law.low, law.high);
  arguments["start"] = law.start;
  arguments["noise"] = law.noise.size() == 0 ? py::object(py::none()) : py::cast(law.noise);
  return arguments;
}

}  // namespace

bool AskedPolicy::operator()(const PolicyQuestion& asked, States& memory, States& actions) const {
  const WithGil acquire;
  const Asking asking(asked.limit);
  const py::array_t<std::uint64_t> seeds(static_cast<py::ssize_t>(asked.seeds.size()), asked.seeds.data());
  try {
    const py::tuple answer =
        function.function()(asked.time, asked.number, py::cast(asked.observations), seeds, py::cast(memory));
    actions = answer[0].cast<States>();
    memory = answer[1].cast<States>();
  } catch (const py::error_already_set&) {
    if (!asking.was_cut()) throw;
  }
  return !asking.was_cut();
}

py::object policy_of(const Plan& plan) {
  const auto* asked = plan.policy ? plan.policy->act.target<AskedPolicy>() : nullptr;
  return asked ? asked->function.function().attr("__self__") : py::object(py::none());
}

Policies policies_by_name(const Given<Policies>& policies) {
  auto plans = cast<Policies>("policies", policies.value, "a dict, each value an em.Policy");
  for (const auto& [name, plan] : plans) {
    if (!plan.policy) refuse("policies['" + name + "']", policies.value[py::str(name)], "an em.Policy");
  }
  return plans;
}

void bind_plan(py::module_& module) {
  py::class_<Plan, Owner<Plan>>(module, "Plan", collected<Plan>(), plan_doc)
      .def(py::init(&plan_of), py::arg("step"), py::arg("wrenches") = Rows{}, py::arg("targets") = Rows{},
           py::arg("velocities") = Rows{}, py::arg("limits") = Limits{})
      .def_static(
          "hold",
          [](const Scene& scene, const Given<State>& state, const Given<double>& duration) {
            return hold(scene, given("state", state), given("duration", duration));
          },
          py::arg("scene"), py::arg("state"), py::arg("duration"),
          "The robot goes on as it moves at a state (n,), for a duration [s]. Free effector bodies, or those that "
          "carry one, keep their twist in their own frames; joints under position control keep the scene's targets.")
      .def_readonly("step", &Plan::step, "Of a row [s].")
      .def_property_readonly("rows", &Plan::rows, "K.")
      .def_property_readonly("duration", &Plan::duration, "Of all rows [s].")
      .def_property_readonly("wrenches", &wrenches_of, "By body, shape (K, 6) [N, N m].")
      .def_property_readonly("targets", &targets_of, "By joint, shape (K,) [rad] or [m].")
      .def_property_readonly("velocities", &velocities_of, "By body, shape (K, 6) [m/s, rad/s].")
      .def_property_readonly("limits", &limits_of,
                             "Of motors, where the plan has them: by body, (force [N], torque [N m]).")
      .def_property_readonly("feedback", &law_of,
                             "The arguments of a Feedback that are not of its plan; None: a plan alone.")
      .def_property_readonly("policy", &policy_of, "The em.Policy that is asked; None: there is none.")
      .def(
          "fine_rows", [](const Plan& plan, const Given<double>& step) { return fine_rows(plan, given("step", step)); },
          py::arg("step"),
          "The same plan with a row for each step [s] of a scene, at most the plan's own. Each row begins at the step "
          "that is nearest to its time.")
      .def("__repr__",
           [](const Plan& plan) {
             py::list names;
             for (const auto& part : {wrenches_of(plan), targets_of(plan), velocities_of(plan)}) {
               for (const auto& [name, rows] : part) names.append(name);
             }
             return repr_of_fields("Plan", {{"duration", py::cast(plan.duration())}, {"of", names}});
           })
      .def(
          "rest",
          [](const Plan& plan, const Given<int>& done, const Given<double>& step,
             const std::optional<GivenArray>& memory) {
            return rest_of(plan, count("done", done, 0), given("step", step),
                           memory ? vector("memory", memory->value, -1) : Eigen::VectorXd());
          },
          py::arg("done"), py::arg("step"), py::arg("memory") = py::none(),
          "What is left after `done` steps [s] of a scene. Rows stay as they are where one begins there, and otherwise "
          "have the scene's step. A Feedback and a Policy go on with their `memory` of then, as "
          "`World.simulate(...).memory` has it; None: they begin anew. Raises ValueError if nothing is left.")
      .def(
          "to_json", [](const Plan& plan) { return to_json(plan); },
          "The plan as JSON text, as it stands in a problem file.")
      .def_static(
          "from_json",
          [](const std::string& text, const Given<Policies>& policies) {
            return plan_from_json(text, policies_by_name(policies));
          },
          py::arg("text"), py::arg("policies") = py::dict(),
          "A plan from JSON text; policies: as of Problem.load. Raises ValueError that names the place and what "
          "was expected.")
      .def(pickled_as_json<Plan>([](Plan& plan) { return &plan; }, &plan_from_json));
  py::class_<PlanWithFeedback, Plan, Owner<PlanWithFeedback>>(module, "Feedback", feedback_doc)
      .def(py::init(&feedback_of), py::arg("gains"), py::kw_only(), py::arg("observed"), py::arg("corrected"),
           py::arg("states") = py::none(), py::arg("wrenches") = Rows{}, py::arg("targets") = Rows{},
           py::arg("velocities") = Rows{}, py::arg("motors") = Limits{}, py::arg("period"), py::arg("delay") = 0,
           py::arg("limits") = py::none(), py::arg("start") = 0.0, py::arg("noise") = py::none(),
           py::arg("step") = py::none())
      .def_static("admittance", &admittance_of, py::arg("contacts"), py::kw_only(), py::arg("force"),
                  py::arg("compliance"), py::arg("period"), py::arg("wrenches") = Rows{}, py::arg("targets") = Rows{},
                  py::arg("velocities") = Rows{}, py::arg("motors") = Limits{}, py::arg("delay") = 0,
                  py::arg("limits") = py::none(), admittance_doc)
      .def_static(
          "impedance", &impedance_of, py::arg("body"), py::kw_only(), py::arg("stiffness"), py::arg("damping"),
          py::arg("period"), py::arg("states") = py::none(), py::arg("delay") = 0, py::arg("limits") = py::none(),
          "A virtual spring and damper on a body: `stiffness` (6,) [N/m, N m/rad] and `damping` (6,) [N s/m, N m "
          "s/rad] along and about the world's axes, about its centre of mass. `states` (12,) or (R, 12): where it "
          "is to be, as position, rotation vector, velocity and angular velocity of its frame; None: zeros. The "
          "others as of Feedback.")
      .def("__repr__",
           [](const PlanWithFeedback& plan) {
             return repr_of_fields("Feedback", {{"period", py::cast(plan.feedback->period)},
                                                {"observed", py::cast(plan.feedback->observed)},
                                                {"corrected", py::cast(plan.feedback->corrected)}});
           })
      .def(pickled_as_json<PlanWithFeedback>([](PlanWithFeedback& plan) { return &plan; },
                                             [](const std::string& text, const Policies& policies) {
                                               return PlanWithFeedback{plan_from_json(text, policies)};
                                             }));
  py::class_<PlanWithPolicy, Plan, Owner<PlanWithPolicy>>(module, "PolicyPlan",
                                                          "A plan whose robot is asked what to do; em.Policy makes it.")
      .def(py::init(&plan_with_policy), py::arg("act"), py::kw_only(), py::arg("observed"), py::arg("commanded"),
           py::arg("period"), py::arg("delay"), py::arg("memory"), py::arg("noise"), py::arg("limits"),
           py::arg("name"));
}

}  // namespace energymargin::binding
