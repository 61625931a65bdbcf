#include "simulator.hpp"

#include "asking.hpp"
#include "callbacks.hpp"

namespace energymargin::binding {
namespace {

// A method of an em.engines.Engine, which checks what its user's methods return.
struct AskedSimulator {
  Callback play;

  bool operator()(const SimulatorQuestion& asked, SimulatorAnswer& answer) const {
    const WithGil acquire;
    const Asking asking(asked.limit);
    try {
      const py::tuple told = play.function()(py::arg("states") = asked.states, py::arg("memory") = asked.memory,
                                             py::arg("pushes") = asked.pushes, py::arg("commands") = asked.commands,
                                             py::arg("commanded") = asked.commanded, py::arg("steps") = asked.steps,
                                             py::arg("every") = asked.every);
      answer = {told[0].cast<States>(), told[1].cast<States>(), told[2].cast<States>()};
    } catch (const py::error_already_set&) {
      if (!asking.was_cut()) throw;
    }
    return !asking.was_cut();
  }
};

struct AskedStart {
  Callback start;

  States operator()(const States& states) const {
    const WithGil acquire;
    return start.function()(py::cast(states)).cast<States>();
  }
};

std::shared_ptr<const Simulator> simulator_of(const py::handle& engine) {
  auto simulator = std::make_shared<Simulator>();
  simulator->name = word("name of the engine", engine.attr("name"));
  simulator->digest = word("digest of the engine", engine.attr("digest")());
  simulator->step = convert(Type<double>{}, "step of the engine", engine.attr("step"));
  simulator->memory = engine.attr("memory").cast<int>();
  for (const auto& [name, value] : engine.attr("commands").cast<std::map<std::string, double>>()) {
    Simulator::Command command;
    command.name = name;
    command.target = value;
    command.stiffness = 1.0;
    simulator->commands.push_back(std::move(command));
  }
  simulator->play = AskedSimulator{Callback(engine.attr("_play"))};
  simulator->start = AskedStart{Callback(engine.attr("_start"))};
  return simulator;
}

}  // namespace

EngineChoice convert(Type<EngineChoice>, const std::string& name, const py::handle& value) {
  if (py::isinstance<py::str>(value)) return {convert(Type<EngineKind>{}, name, value)};
  if (!py::hasattr(value, "_play")) refuse(name, value, "'native', 'bullet' or an em.engines.Engine");
  return {EngineKind::native, simulator_of(value)};
}

py::object engine_of(const Scene& scene) {
  const auto& simulator = scene.stepping().simulator;
  if (!simulator) return py::str(word_of(scene.stepping().engine));
  return simulator->play.target<AskedSimulator>()->play.function().attr("__self__");
}

}  // namespace energymargin::binding
