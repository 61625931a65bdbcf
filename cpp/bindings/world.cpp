// The simulation for Python.

#include "energymargin/world.hpp"

#include <cstdio>
#include <mutex>

#include "convert.hpp"
#include "interrupt.hpp"
#include "warnings.hpp"

namespace energymargin::binding {
namespace {

// A rollout of so many steps is over before Ctrl-C is missed; a thread would take a share of its time.
constexpr int few_steps = 100;

struct Recording {
  Eigen::VectorXd times;
  States states;
  std::vector<std::vector<Contact>> contacts;
};

// Runs `simulation(limit)`, on a thread of its own if it may take long.
template <typename Simulation>
auto simulated(double steps, const Limit& limit, const Simulation& simulation) {
  if (steps > few_steps) return interruptible(limit, simulation);
  const py::gil_scoped_release release;
  return simulation(limit);
}

// A world that several Python threads may ask: one after the other.
class SharedWorld {
 public:
  explicit SharedWorld(const Scene& scene) : world_(scene) {}
  SharedWorld(const Scene& scene, const Plan& plan) : world_(scene, plan), planned_(true) {}

  bool planned() const { return planned_; }

  const World& world() const { return world_; }

  //! Runs `question` on the world without the GIL.
  template <typename Question>
  auto ask(const Question& question) {
    const py::gil_scoped_release release;
    const std::lock_guard<std::timed_mutex> lock(mutex_);
    return question(world_);
  }

  //! The same from a thread without the GIL, and up to a limit, also while another one asks.
  template <typename Question>
  auto ask_until(const Limit& limit, const Question& question) {
    std::unique_lock<std::timed_mutex> lock(mutex_, std::defer_lock);
    while (!lock.try_lock_for(std::chrono::milliseconds(20))) limit.require();
    return question(world_);
  }

 private:
  World world_;
  bool planned_ = false;
  std::timed_mutex mutex_;
};

Recording simulate(SharedWorld& shared, const ArrayLike& state, const WholeNumber& steps_given,
                   const std::map<std::string, ArrayLike>& drives, const std::map<std::string, ArrayLike>& targets,
                   const std::optional<std::vector<WholeNumber>>& record_given, const TimeoutArgument& timeout,
                   const CancelArgument& cancel) {
  const Limit given = limit_of(timeout, cancel);
  Script script;
  const bool planned = shared.planned() && drives.empty() && targets.empty();
  for (const auto& [body, rows] : drives) {
    script.drives.push_back({body, matrix("drives['" + body + "']", rows, -1, 6)});
  }
  for (const auto& [joint, positions] : targets) {
    script.targets.push_back({joint, vector("targets['" + joint + "']", positions, -1)});
  }
  const State start = vector("state", state, -1);
  const int steps = count("steps", steps_given);
  if (steps > most_steps) {
    throw std::invalid_argument("steps is " + std::to_string(steps) + ", expected at most " +
                                std::to_string(most_steps));
  }
  std::vector<int> record;
  if (record_given) {
    for (const WholeNumber& at : *record_given) record.push_back(count("record", at, 0));
  } else {
    for (int i = 1; i <= steps; ++i) record.push_back(i);
  }
  std::vector<Doubt> doubts;
  std::vector<Frame> frames = simulated(steps, given, [&](const Limit& limit) {
    return shared.ask_until(limit, [&](World& world) {
      doubts = implausible_start(world, start);
      return planned ? world.simulate(start, steps, record, limit)
                     : world.simulate(start, script, steps, record, limit);
    });
  });
  warn(doubts, shared.world().scene());
  Recording recording;
  recording.times.resize(static_cast<Eigen::Index>(frames.size()));
  recording.states.resize(static_cast<Eigen::Index>(frames.size()), shared.world().layout().dimension());
  for (Eigen::Index i = 0; i < recording.times.size(); ++i) {
    Frame& frame = frames[static_cast<std::size_t>(i)];
    recording.times[i] = frame.time;
    recording.states.row(i) = frame.state.transpose();
    recording.contacts.push_back(std::move(frame.contacts));
  }
  return recording;
}

//! The balance as a table: an entry a line [J].
std::string table(const Audit& audit) {
  std::string text;
  const auto line = [&text](const char* name, double energy) {
    char row[64];
    std::snprintf(row, sizeof row, "%-14s%+14.6e J", name, energy);
    text += row;
  };
  for (const auto& [name, work] :
       {std::pair{"wrench", audit.wrench}, std::pair{"plan", audit.plan}, std::pair{"friction", audit.friction},
        std::pair{"contacts", audit.contacts}, std::pair{"joints", audit.joints}, std::pair{"damping", audit.damping},
        std::pair{"drives", audit.drives}, std::pair{"overlap", audit.overlap},
        std::pair{"integration", audit.integration}, std::pair{"leftover", audit.leftover()}}) {
    line(name, work);
    text += '\n';
  }
  line("energy_change", audit.energy_change);
  return text;
}

void bind_audit(py::module_& module) {
  py::class_<Audit>(
      module, "Audit",
      "Where the energy of a rollout went. Each work [J] is that on the bodies: positive where it gives them energy. "
      "An "
      "impulse works along the mean of the velocities before the step and after it, which makes the sum over all "
      "impulses the gain of kinetic energy. The entries and `leftover` add up to `energy_change`.")
      .def_readonly("energy_change", &Audit::energy_change,
                    "Mechanical energy, World.energy, at the end minus at the start [J].")
      .def_readonly("wrench", &Audit::wrench, "Work of the disturbance: Rollout.work [J].")
      .def_readonly("plan", &Audit::plan,
                    "Work of the robot's plan: its wrenches, its servos, and targets that it moves away from the "
                    "scene's [J].")
      .def_readonly("friction", &Audit::friction, "Work of friction at contacts; negative but for solver error [J].")
      .def_readonly("contacts", &Audit::contacts,
                    "Work of the normal impulses at contacts: the loss of impacts, negative. Positive where links that "
                    "overlap something are pushed out of it, which Bullet does by a change of velocity [J].")
      .def_readonly(
          "joints", &Audit::joints,
          "Work of joint stops, negative where a joint hits one, and of what keeps mimic joints together [J].")
      .def_readonly("damping", &Audit::damping, "Work of the damping of joints and springs; negative [J].")
      .def_readonly("drives", &Audit::drives,
                    "Work of drives to a target velocity: damping * target velocity, within the torque limit [J].")
      .def_readonly("overlap", &Audit::overlap,
                    "Work of penetration recovery (split impulses) against gravity, constant forces and springs; it "
                    "takes no impulse [J].")
      .def_readonly(
          "integration", &Audit::integration,
          "What the steps of the simulation are known to change, of the order of their length h: velocities "
          "are h / 2 behind the positions, which counts the power P of gravity, constant forces and springs "
          "as -h / 2 (P at the end - P at the start); and compliant joints, integrated implicitly, are damped "
          "as by stiffness * h [J].")
      .def_property_readonly("leftover", &Audit::leftover,
                             "What the entries leave open: energy_change minus all of them [J]. It is the error of the "
                             "simulation that has no name, most of it that of turning in steps.")
      .def_property_readonly("turnover", &Audit::turnover,
                             "Energy turned over: the sum of the absolute values of energy_change and all the entries. "
                             "What leftover is to be compared with [J].")
      .def("__repr__", &table);
}

void bind_contact(py::module_& module) {
  py::class_<Contact>(module, "Contact", "One point where two bodies touch, and the forces there over the last step.")
      .def(py::init([](std::string body_a, std::string body_b, const ArrayLike& position, const ArrayLike& normal,
                       const Number& distance, const Number& normal_force, const ArrayLike& tangential_force,
                       const Number& friction) {
             return Contact{std::move(body_a),
                            std::move(body_b),
                            vector3("position", position),
                            vector3("normal", normal),
                            real("distance", distance),
                            real("normal_force", normal_force),
                            vector3("tangential_force", tangential_force),
                            real("friction", friction)};
           }),
           py::kw_only(), py::arg("body_a"), py::arg("body_b"), py::arg("position"), py::arg("normal"),
           py::arg("distance"), py::arg("normal_force"), py::arg("tangential_force"), py::arg("friction"))
      .def_readonly("body_a", &Contact::body_a, "The first body of the pair.")
      .def_readonly("body_b", &Contact::body_b, "The second one.")
      .def_readonly("position", &Contact::position, "On body_b, shape (3,) [m].")
      .def_readonly("normal", &Contact::normal, "Unit vector from body_b to body_a, shape (3,).")
      .def_readonly("distance", &Contact::distance, "Negative in penetration [m].")
      .def_readonly("normal_force", &Contact::normal_force, "Along the normal, on body_a [N].")
      .def_readonly("tangential_force", &Contact::tangential_force, "Friction on body_a, shape (3,) [N].")
      .def_readonly("friction", &Contact::friction, "Coefficient, the product of the two bodies'.");
}

}  // namespace

void bind_world(py::module_& module) {
  bind_contact(module);
  bind_audit(module);
  py::class_<Rollout>(module, "Rollout", "What one rollout leads to.")
      .def_readonly("state", &Rollout::state, "At the end, shape (n,).")
      .def_readonly("effort", &Rollout::effort, "Integral of |f . v + tau . omega| dt, eq. 2 and 3 [J].")
      .def_readonly("work", &Rollout::work, "The same with its sign [J].")
      .def_readonly("energy", &Rollout::energy, "Mechanical energy at the end [J].")
      .def_readonly("steps", &Rollout::steps, "Simulation steps, fewer than were asked for if it ended early.")
      .def_readonly("audit", &Rollout::audit, "Where the energy went; None unless it was asked for.");
  py::class_<Recording>(module, "Simulation", "A recorded simulation of K frames.")
      .def_readonly("times", &Recording::times, "Shape (K,) [s].")
      .def_readonly("states", &Recording::states, "Shape (K, n).")
      .def_readonly("contacts", &Recording::contacts, "For each frame the contacts of its last step.");
  py::class_<SharedWorld>(module, "World",
                          "One simulation of a Scene, in which the robot follows a plan if there is one. Every answer "
                          "is a pure function of its arguments; threads may share "
                          "a world, which answers one at a time.")
      .def(py::init([](const Scene& scene, const std::optional<Plan>& plan) {
             warn(implausible(scene), scene);
             return plan ? std::make_unique<SharedWorld>(scene, *plan) : std::make_unique<SharedWorld>(scene);
           }),
           py::arg("scene"), py::arg("plan") = py::none())
      .def(
          "rollout",
          [](SharedWorld& shared, const ArrayLike& state, const ArrayLike& wrench_given, const Number& duration,
             bool audit, const Number& time_given, const TimeoutArgument& timeout, const CancelArgument& cancel) {
            const Limit given = limit_of(timeout, cancel);
            const State start = vector("state", state, -1);
            const std::size_t objects = shared.world().scene().with_role(Role::object).size();
            const Disturbance pushes = wrenches("wrench", wrench_given, objects);
            const double seconds = real("duration", duration), time = real("time", time_given);
            return simulated(seconds / shared.world().scene().stepping().step, given, [&](const Limit& limit) {
              return shared.ask_until(
                  limit, [&](World& world) { return world.rollout(start, pushes, seconds, audit, limit, time); });
            });
          },
          py::arg("state"), py::arg("wrench"), py::arg("duration"), py::kw_only(), py::arg("audit") = false,
          py::arg("time") = 0.0, py::arg("timeout") = py::none(), py::arg("cancel") = py::none(),
          "Apply a wrench (6,), force [N] and torque [N m], to the object, or (k, 6) to k objects, for a duration [s], "
          "rounded to whole steps. With audit it also balances the energy: nothing else changes, to the last bit, but "
          "the time that it takes. time [s]: the robot goes on where its plan is then. Raises TimeoutError after "
          "timeout [s], and Cancelled once cancel is set.")
      .def(
          "simulate", &simulate, py::arg("state"), py::arg("steps"),
          py::arg("drives") = std::map<std::string, ArrayLike>{},
          py::arg("targets") = std::map<std::string, ArrayLike>{}, py::arg("record") = py::none(), py::kw_only(),
          py::arg("timeout") = py::none(), py::arg("cancel") = py::none(),
          "One unbroken simulation; drives gives wrenches by body, shape (steps, 6), and targets the targets of joints "
          "under position control, shape (steps,) [rad] or [m]; without both the robot follows the world's plan. "
          "record: after which steps a frame "
          "is recorded, ascending, from 0, the start, to steps; by default after each. Raises TimeoutError after "
          "timeout [s], and "
          "Cancelled once cancel is set.")
      .def(
          "energy",
          [](SharedWorld& shared, const ArrayLike& state) {
            const State at = vector("state", state, -1);
            return shared.ask([&](World& world) { return world.energy(at); });
          },
          py::arg("state"),
          "Mechanical energy [J]: kinetic energy of all bodies that move, links included; potential energy of gravity "
          "and of the bodies' constant forces, zero at the world's origin; energy of the springs, and of the joints' "
          "compliance, zero at their targets.")
      .def(
          "contacts",
          [](SharedWorld& shared, const ArrayLike& state) {
            const State at = vector("state", state, -1);
            return shared.ask([&](World& world) { return world.contacts(at); });
          },
          py::arg("state"), "Contacts at a state, with the forces that one step without wrench shows.")
      .def(
          "distance",
          [](SharedWorld& shared, const ArrayLike& state, const std::string& a, const std::string& b) {
            const State at = vector("state", state, -1);
            return shared.ask([&](World& world) { return world.distance(at, a, b); });
          },
          py::arg("state"), py::arg("body_a"), py::arg("body_b"),
          "Least distance between two bodies, negative in penetration [m].")
      .def_property_readonly(
          "scene", [](const SharedWorld& shared) { return shared.world().scene(); }, "What it simulates.");
}

}  // namespace energymargin::binding
