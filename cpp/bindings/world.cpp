// The simulation, and the energy balance of a rollout, for Python.

#include "energymargin/world.hpp"

#include <cstdio>
#include <functional>
#include <mutex>

#include "callbacks.hpp"
#include "energymargin/metrics/guards.hpp"
#include "long_call.hpp"
#include "problem/records.hpp"
#include "records.hpp"

namespace energymargin::binding {
namespace {

// A rollout of so many steps ends before anybody misses Ctrl-C; another thread would cost a share of its time.
constexpr int few_steps = 100;

struct Recording : StepCounts {
  Eigen::VectorXd times;
  States states, memory;
  std::vector<std::vector<Contact>> contacts;
};

// A world that several Python threads share: it answers one at a time.
class SharedWorld {
 public:
  explicit SharedWorld(const Scene& scene) : world_(scene) {}
  SharedWorld(const Scene& scene, Plan plan) : plan_(std::move(plan)), world_(scene, plan_) {
    owners_ = plan_.policy.use_count();
  }

  const World& world() const { return world_; }

  //! Shows the functions that nothing else has.
  template <typename Visit>
  void visit_functions(const Visit& visit) const {
    binding::visit_functions(plan_, visit, owners_);
  }

  //! What a method of World answers about a state, without the GIL.
  template <typename Method, typename... More>
  auto ask(const Method& method, const Given<State>& state, const More&... more) {
    const State at = given("state", state);
    const WithoutGil release;
    const std::lock_guard<std::timed_mutex> lock(mutex_);
    return std::invoke(method, world_, at, more...);
  }

  //! Runs `question` on the world from a thread without the GIL, up to a limit, which ends its waiting too.
  template <typename Question>
  auto ask_until(const Limit& limit, const Question& question) {
    std::unique_lock<std::timed_mutex> lock(mutex_, std::defer_lock);
    while (!lock.try_lock_for(std::chrono::milliseconds(20))) limit.require();
    return question(world_);
  }

 private:
  Plan plan_;
  World world_;
  long owners_ = 0;  // of the plan's policy, in the world
  std::timed_mutex mutex_;
};

template <typename Visit>
void visit_functions(const SharedWorld& world, const Visit& visit) {
  world.visit_functions(visit);
}

// Runs `simulation(limit)`, on another thread if it may take long or ask a policy.
template <typename Simulation>
auto run_simulation(double steps, const SharedWorld& world, LongCall& call, const Simulation& simulation) {
  if (steps > few_steps || world.world().memory() > 0) return call.run(simulation);
  const WithoutGil release;
  return simulation(call.limit());
}

// The steps after which a frame is recorded; by default all.
std::vector<int> record_of(const std::optional<std::vector<Given<int>>>& numbers, int steps) {
  std::vector<int> record;
  if (numbers) {
    for (const Given<int>& number : *numbers) record.push_back(count("record", number, 0));
  } else {
    for (int i = 1; i <= steps; ++i) record.push_back(i);
  }
  return record;
}

// The simulation ended with the last step of `record`.
Recording recording_of(std::vector<Frame> frames, const std::vector<int>& record, const World& world) {
  Recording recording;
  recording.times.resize(static_cast<Eigen::Index>(frames.size()));
  recording.states.resize(static_cast<Eigen::Index>(frames.size()), world.layout().dimension());
  recording.memory.resize(static_cast<Eigen::Index>(frames.size()), world.robot_memory());
  for (Eigen::Index i = 0; i < recording.times.size(); ++i) {
    Frame& frame = frames[static_cast<std::size_t>(i)];
    recording.times[i] = frame.time;
    recording.states.row(i) = frame.state.transpose();
    recording.memory.row(i) = frame.memory.transpose();
    recording.contacts.push_back(std::move(frame.contacts));
    recording.unconverged = frame.unconverged;
    recording.lost_time = frame.lost_time;
  }
  if (!record.empty()) recording.steps = record.back();
  return recording;
}

void warn_of_quality(const StepCounts& counts, const Scene& scene) {
  if (counts.steps > 0) warn(implausible(counts, static_cast<double>(counts.steps) * scene.stepping().step), scene);
}

Recording simulate(SharedWorld& shared, const Given<State>& state, const Given<int>& number_of_steps,
                   const Rows& drives, const Rows& targets, const std::optional<std::vector<Given<int>>>& record_steps,
                   const Given<std::optional<double>>& timeout, const CancelArgument& cancel) {
  LongCall call(given("timeout", timeout), cancel);
  const Plan besides = plan_of_rows("drives", drives, targets);
  const State start = given("state", state);
  const int steps = given("steps", number_of_steps);
  if (steps > most_steps) reject("steps", std::to_string(steps), "at most " + std::to_string(most_steps));
  const std::vector<int> record = record_of(record_steps, steps);
  std::vector<Warning> warnings;
  std::vector<Frame> frames = run_simulation(steps, shared, call, [&](const Limit& limit) {
    return shared.ask_until(limit, [&](World& world) {
      warnings = implausible_start(world, start);
      return world.simulate(start, besides, steps, record, limit);
    });
  });
  Recording recording = recording_of(std::move(frames), record, shared.world());
  warn(warnings, shared.world().scene());
  warn_of_quality(recording, shared.world().scene());
  return recording;
}

Rollout roll_out(SharedWorld& shared, const Given<State>& state, const GivenArray& wrench,
                 const Given<double>& duration, bool audit, const Given<double>& time,
                 const Given<std::optional<double>>& timeout, const CancelArgument& cancel) {
  LongCall call(given("timeout", timeout), cancel);
  const Scene& scene = shared.world().scene();
  const State start = given("state", state);
  const Disturbance disturbance = wrenches("wrench", wrench, scene.with_role(Role::object).size());
  const double seconds = given("duration", duration);
  const double plan_time = given("time", time);
  Rollout rollout = run_simulation(seconds / scene.stepping().step, shared, call, [&](const Limit& limit) {
    return shared.ask_until(
        limit, [&](World& world) { return world.rollout(start, disturbance, seconds, audit, limit, plan_time); });
  });
  warn(implausible_joints(scene, start), scene);
  warn_of_quality(rollout, scene);
  return rollout;
}

std::unique_ptr<SharedWorld> make_world(const Given<Scene>& scene_given, const Given<std::optional<Plan>>& plan_given) {
  const Scene& scene = given_object("scene", scene_given);
  std::optional<Plan> plan = given("plan", plan_given);
  warn(implausible(scene), scene);
  if (!plan) return std::make_unique<SharedWorld>(scene);
  unshare(*plan);
  return std::make_unique<SharedWorld>(scene, std::move(*plan));
}

constexpr const char* audit_doc =
    R"(Where the energy of a rollout went.

Each work [J] is work on the bodies: positive where it gives them energy. An impulse works along the mean of the velocities
before and after the step. The entries and `leftover` add up to `energy_change`.)";

// An entry a line [J].
std::string table(const Audit& audit) {
  std::string text;
  const auto add_line = [&text](const char* name, double energy) {
    char row[64];
    std::snprintf(row, sizeof row, "%s%-14s%+14.6e J", text.empty() ? "" : "\n", name, energy);
    text += row;
  };
  for (const AuditEntry& entry : audit_entries) add_line(entry.name, audit.*entry.work);
  add_line("leftover", audit.leftover());
  add_line("energy_change", audit.energy_change);
  return text;
}

void bind_audit(py::module_& module) {
  py::class_<Audit> type(module, "Audit", audit_doc);
  for (const AuditEntry& entry : audit_entries) type.def_readonly(entry.name, entry.work, entry.description);
  type.def_readonly("energy_change", &Audit::energy_change,
                    "Mechanical energy, World.energy, at the end minus at the start [J].")
      .def_property_readonly("leftover", &Audit::leftover,
                             "energy_change minus all entries [J]: the error of the simulation without a known cause, "
                             "mostly that of finite rotations.")
      .def_property_readonly("turnover", &Audit::turnover,
                             "Sum of the absolute values of energy_change and all entries [J]: the scale of leftover.")
      .def("__repr__", &table);
}

void bind_results(py::module_& module) {
  bind_audit(module);
  py::class_<Rollout> rollout(module, "Rollout", "The result of one rollout.");
  rollout.def_readonly("state", &Rollout::state, "At the end, shape (n,).")
      .def_readonly("effort", &Rollout::effort, "Integral of |f . v + tau . omega| dt, eq. 2 and 3 [J].")
      .def_readonly("work", &Rollout::work, "The same with its sign [J].")
      .def_readonly("energy", &Rollout::energy, "Mechanical energy at the end [J].")
      .def_readonly("audit", &Rollout::audit, "Where the energy went; None unless audit.");
  def_step_counts(rollout, "Simulation steps, fewer than asked for if it ended early.");
  py::class_<Recording> recording(module, "Simulation", "A recorded simulation of K frames.");
  recording.def_readonly("times", &Recording::times, "Shape (K,) [s].")
      .def_readonly("states", &Recording::states, "Shape (K, n).")
      .def_readonly("memory", &Recording::memory, "What the plan's Feedback or Policy remembers, shape (K, h).")
      .def_readonly("contacts", &Recording::contacts, "For each frame the contacts of its last step.");
  def_step_counts(recording, "Simulation steps, up to the last frame.");
}

using WorldClass = py::class_<SharedWorld>;

constexpr const char* rollout_doc =
    R"(Applies a wrench (6,), force [N] and torque [N m], to the object, or (k, 6) to k objects.

duration [s]: of the wrench, rounded to whole steps. audit: also balances the energy; only the time that it takes changes.
time [s]: where the robot's plan starts. timeout [s], cancel: when the rollout ends early. Warns of a joint that starts
beyond its limits, and if more than 1 % of the steps did not converge, or of the time is lost. Raises TimeoutError, or Cancelled.)";

constexpr const char* simulate_doc =
    R"(One unbroken simulation of a number of steps.

The robot follows the world's plan. On top of it: drives, wrenches by body, shape (steps, 6), which add to the plan's; targets,
of joints under position control, shape (steps,) [rad] or [m], which replace the plan's. record: the steps after which a frame is recorded, ascending, from 0, the
start, to steps; by default all but 0. timeout [s], cancel: when the simulation ends early. Warns of a joint that starts
beyond its limits, and of bodies deep in each other. Raises TimeoutError, or Cancelled.)";

void def_simulations(WorldClass& type) {
  type.def("rollout", &roll_out, py::arg("state"), py::arg("wrench"), py::arg("duration"), py::kw_only(),
           py::arg("audit") = false, py::arg("time") = 0.0, py::arg("timeout") = py::none(),
           py::arg("cancel") = py::none(), rollout_doc)
      .def("simulate", &simulate, py::arg("state"), py::arg("steps"), py::arg("drives") = Rows{},
           py::arg("targets") = Rows{}, py::arg("record") = py::none(), py::kw_only(), py::arg("timeout") = py::none(),
           py::arg("cancel") = py::none(), simulate_doc);
}

void def_queries(WorldClass& type) {
  type.def(
          "energy", [](SharedWorld& shared, const Given<State>& state) { return shared.ask(&World::energy, state); },
          py::arg("state"),
          "Mechanical energy [J]: kinetic energy of all moving bodies, links included; potential energy of gravity and "
          "of the bodies' constant forces, zero at the world's origin; energy of the springs and of the joints' "
          "compliance, zero at their targets.")
      .def(
          "contacts",
          [](SharedWorld& shared, const Given<State>& state) { return shared.ask(&World::contacts, state); },
          py::arg("state"), "Contacts at a state, with the forces of one step without a wrench.")
      .def(
          "distance",
          [](SharedWorld& shared, const Given<State>& state, const std::string& a, const std::string& b) {
            return shared.ask(&World::distance, state, a, b);
          },
          py::arg("state"), py::arg("body_a"), py::arg("body_b"),
          "Least distance between two bodies, negative in penetration [m].")
      .def_property_readonly("scene", [](const SharedWorld& shared) { return shared.world().scene(); }, "A copy.");
}

}  // namespace

void bind_world(py::module_& module) {
  bind_record<Contact>(
      module, "Contact",
      "One point where two bodies touch, and the forces there over the last part of its step: where bodies come into "
      "contact or bounce, a step has several. What a Feedback observes as \"force(a, b)\" is the mean over a step.",
      {0});
  bind_results(module);
  WorldClass type(module, "World", collected<SharedWorld>(),
                  "One simulation of a Scene, in which the robot follows a plan if there is one. Every result is a "
                  "pure function of the arguments. Threads may share a world, which answers one at a time.");
  type.def(py::init(&make_world), py::arg("scene"), py::arg("plan") = py::none());
  def_simulations(type);
  def_queries(type);
}

}  // namespace energymargin::binding
