// The energy balance of a rollout for Python.

#include "energymargin/audit.hpp"

#include <cstdio>

#include "bindings.hpp"
#include "given.hpp"

namespace energymargin::binding {
namespace {

constexpr const char* audit_doc =
    R"(Where the energy of a rollout went.

Each work [J] is work on the bodies: positive where it gives them energy. An impulse works along the mean of the velocities
before and after the step; so the sum over all impulses is the gain of kinetic energy. The entries and `leftover` add up to
`energy_change`.)";

struct Entry {
  const char* name;
  double Audit::* work;
  const char* doc;
};

constexpr Entry entries[] = {
    {"wrench", &Audit::wrench, "Work of the disturbance: Rollout.work [J]."},
    {"plan", &Audit::plan,
     "Work of the robot's plan: its wrenches, its servos, targets that differ from the scene's, and kinematic bodies "
     "[J]."},
    {"friction", &Audit::friction, "Work of friction at contacts; negative but for solver error [J]."},
    {"contacts", &Audit::contacts,
     "Work of the normal impulses at contacts [J]. Impacts lose energy: negative. Positive where links overlap "
     "something, which Bullet recovers from by a change of velocity."},
    {"joints", &Audit::joints,
     "Work of joint stops, negative where a joint hits one, and of the coupling of mimic joints [J]."},
    {"damping", &Audit::damping, "Work of the damping of joints and springs; negative [J]."},
    {"drives", &Audit::drives,
     "Work of drives to a target velocity: damping * target velocity, within the torque limit [J]."},
    {"overlap", &Audit::overlap,
     "Work of penetration recovery (split impulses) against gravity, constant forces and springs; it takes no impulse "
     "[J]."},
    {"integration", &Audit::integration,
     "Known error of time integration, of the order of the step h [J]. Velocities are h / 2 behind the positions, "
     "which "
     "counts the power P of gravity, constant forces and springs as -h / 2 (P at the end - P at the start). Implicit "
     "integration damps compliant joints as stiffness * h does."}};

// An entry a line [J].
std::string table(const Audit& audit) {
  std::string text;
  const auto add_line = [&text](const char* name, double energy) {
    char row[64];
    std::snprintf(row, sizeof row, "%s%-14s%+14.6e J", text.empty() ? "" : "\n", name, energy);
    text += row;
  };
  for (const Entry& entry : entries) add_line(entry.name, audit.*entry.work);
  add_line("leftover", audit.leftover());
  add_line("energy_change", audit.energy_change);
  return text;
}

}  // namespace

void bind_audit(py::module_& module) {
  py::class_<Audit> type(module, "Audit", audit_doc);
  for (const Entry& entry : entries) type.def_readonly(entry.name, entry.work, entry.doc);
  type.def_readonly("energy_change", &Audit::energy_change,
                    "Mechanical energy, World.energy, at the end minus at the start [J].")
      .def_property_readonly("leftover", &Audit::leftover,
                             "energy_change minus all entries [J]: the error of the simulation without a known cause, "
                             "mostly that of finite rotations.")
      .def_property_readonly("turnover", &Audit::turnover,
                             "Sum of the absolute values of energy_change and all entries [J]: the scale of leftover.")
      .def("__repr__", &table);
}

}  // namespace energymargin::binding
