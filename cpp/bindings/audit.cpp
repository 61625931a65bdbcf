// The energy balance of a rollout for Python.

#include "energymargin/audit.hpp"

#include <cstdio>

#include "bindings.hpp"
#include "convert.hpp"

namespace energymargin::binding {
namespace {

constexpr const char* audit_doc =
    R"(Where the energy of a rollout went.

Each work [J] is work on the bodies: positive where it gives them energy. An impulse works along the mean of the velocities
before and after the step; so the sum over all impulses is the gain of kinetic energy. The entries and `leftover` add up to
`energy_change`.)";

// An entry a line [J].
std::string table(const Audit& audit) {
  std::string text;
  const auto add_line = [&text](const char* name, double energy) {
    char row[64];
    std::snprintf(row, sizeof row, "%-14s%+14.6e J", name, energy);
    text += row;
  };
  for (const auto& [name, work] :
       {std::pair{"wrench", audit.wrench}, std::pair{"plan", audit.plan}, std::pair{"friction", audit.friction},
        std::pair{"contacts", audit.contacts}, std::pair{"joints", audit.joints}, std::pair{"damping", audit.damping},
        std::pair{"drives", audit.drives}, std::pair{"overlap", audit.overlap},
        std::pair{"integration", audit.integration}, std::pair{"leftover", audit.leftover()}}) {
    add_line(name, work);
    text += '\n';
  }
  add_line("energy_change", audit.energy_change);
  return text;
}

using AuditClass = py::class_<Audit>;

void def_works(AuditClass& type) {
  type.def_readonly("wrench", &Audit::wrench, "Work of the disturbance: Rollout.work [J].")
      .def_readonly("plan", &Audit::plan,
                    "Work of the robot's plan: its wrenches, its servos, targets that differ from the scene's, and "
                    "kinematic bodies [J].")
      .def_readonly("friction", &Audit::friction, "Work of friction at contacts; negative but for solver error [J].")
      .def_readonly("contacts", &Audit::contacts,
                    "Work of the normal impulses at contacts [J]. Impacts lose energy: negative. Positive where links "
                    "overlap something, which Bullet recovers from by a change of velocity.")
      .def_readonly("joints", &Audit::joints,
                    "Work of joint stops, negative where a joint hits one, and of the coupling of mimic joints [J].")
      .def_readonly("damping", &Audit::damping, "Work of the damping of joints and springs; negative [J].")
      .def_readonly("drives", &Audit::drives,
                    "Work of drives to a target velocity: damping * target velocity, within the torque limit [J].")
      .def_readonly("overlap", &Audit::overlap,
                    "Work of penetration recovery (split impulses) against gravity, constant forces and springs; it "
                    "takes no impulse [J].")
      .def_readonly("integration", &Audit::integration,
                    "Known error of time integration, of the order of the step h [J]. Velocities are h / 2 behind the "
                    "positions, which counts the power P of gravity, constant forces and springs as -h / 2 (P at the "
                    "end - P at the start). Implicit integration damps compliant joints as stiffness * h does.");
}

void def_sums(AuditClass& type) {
  type.def_readonly("energy_change", &Audit::energy_change,
                    "Mechanical energy, World.energy, at the end minus at the start [J].")
      .def_property_readonly("leftover", &Audit::leftover,
                             "energy_change minus all entries [J]: the error of the simulation without a known cause, "
                             "mostly that of finite rotations.")
      .def_property_readonly("turnover", &Audit::turnover,
                             "Sum of the absolute values of energy_change and all entries [J]: the scale of leftover.");
}

}  // namespace

void bind_audit(py::module_& module) {
  AuditClass type(module, "Audit", audit_doc);
  def_works(type);
  def_sums(type);
  type.def("__repr__", &table);
}

}  // namespace energymargin::binding
