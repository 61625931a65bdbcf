// Problems for Python.

#include "energymargin/problem.hpp"

#include "callbacks.hpp"
#include "energymargin/problem_io.hpp"
#include "pickles.hpp"
#include "problem/records.hpp"
#include "problem_io/mesh.hpp"
#include "records.hpp"
#include "simulator.hpp"

namespace energymargin::binding {
namespace {

std::string problem_doc() {
  return R"(One question: how robust is this state against these disturbances?

Args:
    scene: the bodies.
    state: where they are and how they move, shape (n,).
    captured: the capture set Z_cap. Of several objects a dict, a region for each: it asks whether all of them are in
        theirs (captured), and whether at least one is (captured_any).
    succeeded: the success set Z_suc, or a dict in the same way.
    within: where the search for an escape may go, Z_b.
    start_outside: do not warn of a state outside of the capture set, as along a recorded trajectory.
)" + fields_doc(std::tuple_cat(problem_bounds(), problem_question()), "    ") +
         R"(

Raises ValueError on bad values and on a state in deep penetration. Warns, as PlausibilityWarning, of values that look like
another unit, and of a start that falls or is outside of the capture set.)";
}

constexpr const char* force_weights_doc = R"(Weights of the force score, Section V-B.

engage [1/N]: of the normal forces between effector and object. stick [1/N]: of their distances to the friction cones'
edges. distance [1/m]: of the distance between object and effector, which the score subtracts. ground_engage and
ground_stick: as engage and stick, for the object's contacts with everything but the effector.)";

constexpr const char* save_doc =
    R"(Writes a JSON file, atomically.

meshes: 'embedded' writes the points of convex hulls, as those of a mesh, into the file; 'files' writes them into OBJ files
beside it, for compounds whose parts are all hulls without a pose of their own. A policy goes by its name alone. Raises
ValueError if a region is a Predicate or a policy has no name, and OSError if a file cannot be written.)";

using RegionByObject = std::map<std::string, Region>;
using Sets = std::variant<RegionByObject, Region>;

std::vector<Region> by_object(const std::string& name, const Scene& scene, const RegionByObject& sets) {
  std::vector<Region> regions;
  for (const std::size_t index : scene.with_role(Role::object)) {
    const std::string& object = scene.bodies()[index].name;
    const auto entry = sets.find(object);
    if (entry == sets.end()) throw std::invalid_argument(name + " has no '" + object + "', expected every object");
    regions.push_back(entry->second);
  }
  if (regions.size() == sets.size() && !sets.empty()) return regions;
  for (const auto& [body, region] : sets) {
    if (scene.body(body).role == Role::object) continue;
    throw std::invalid_argument(name + " has '" + body + "', expected objects only");
  }
  throw std::invalid_argument(name + " is empty, expected a region for each object");
}

Region all_of(const std::string& name, const Scene& scene, const Sets& sets) {
  if (const auto* region = std::get_if<Region>(&sets)) return *region;
  return regions::Intersection{by_object(name, scene, std::get<RegionByObject>(sets))};
}

std::optional<Region> any_of(const std::string& name, const Scene& scene, const std::optional<Sets>& sets) {
  if (!sets || std::holds_alternative<Region>(*sets)) return std::nullopt;
  return regions::Union{by_object(name, scene, std::get<RegionByObject>(*sets))};
}

std::string file_path(const py::object& path, const std::string& name = "path") {
  if (!py::isinstance<py::str>(path) && !py::isinstance<py::bytes>(path) && !py::hasattr(path, "__fspath__")) {
    throw py::type_error(name + " is " + short_repr(path) + ", expected a str or a pathlib.Path");
  }
  const std::string text = word(name, py::module_::import("os").attr("fsdecode")(path));
  if (text.find('\0') != std::string::npos) throw std::invalid_argument(name + " has a zero byte, expected none");
  return text;
}

std::optional<double> horizon(const Problem& problem) {
  const auto timing = timing_of(problem);
  return timing ? std::optional(timing->horizon * problem.scene.stepping().step) : std::nullopt;
}

std::optional<RegionByObject> sets_by_object(const Problem& problem) {
  const std::vector<Region> sets = captured_by_object(problem);
  if (sets.empty()) return std::nullopt;
  const std::vector<std::size_t> objects = problem.scene.with_role(Role::object);
  RegionByObject by_name;
  for (std::size_t i = 0; i < sets.size(); ++i) by_name.emplace(problem.scene.bodies()[objects[i]].name, sets[i]);
  return by_name;
}

constexpr const char* sets_in_words = "a Region, or a dict, each value a Region";

Problem make_problem(Problem problem, const Given<Scene>& scene, const Given<State>& state,
                     const Given<Sets>& captured_given, const Given<std::optional<Sets>>& succeeded_given,
                     const Given<std::optional<Region>>& within, const Given<bool>& start_outside) {
  problem.scene = given_object("scene", scene);
  problem.state = given("state", state);
  const Sets captured = cast<Sets>("captured", captured_given.value, sets_in_words);
  const auto succeeded = cast<std::optional<Sets>>("succeeded", succeeded_given.value, sets_in_words);
  problem.captured = all_of("captured", problem.scene, captured);
  problem.captured_any = any_of("captured", problem.scene, captured);
  if (succeeded) problem.succeeded = all_of("succeeded", problem.scene, *succeeded);
  problem.succeeded_any = any_of("succeeded", problem.scene, succeeded);
  problem.within = given("within", within);
  validate(problem);
  warn(implausible(problem, given("start_outside", start_outside)), problem.scene);
  return problem;
}

// Keywords that give the same problem to the constructor.
py::dict keywords_of(const py::object& problem) {
  py::dict keywords;
  for (const char* name : {"scene", "state"}) keywords[name] = problem.attr(name);
  visit_fields<Problem>([&](const auto& field) { keywords[field.name] = problem.attr(field.name); });
  for (const char* name : {"captured_any", "succeeded_any"}) keywords.attr("pop")(name);
  if (!problem.cast<const Problem&>().horizon) keywords["horizon"] = py::none();  // of the plan
  keywords["start_outside"] = true;
  return keywords;
}

// Through the constructor, which checks the values.
py::object replace(const py::object& self, const py::kwargs& changes) {
  py::dict keywords = keywords_of(self);
  for (const auto& [name, value] : changes) {
    if (!keywords.contains(name)) {
      throw py::type_error("replace has no keyword '" + name.cast<std::string>() + "', expected one of Problem's");
    }
    keywords[name] = value;
  }
  const py::object copy = py::type::of<Problem>()(**keywords);
  const auto& original = self.cast<const Problem&>();
  auto& problem = copy.cast<Problem&>();
  if (!changes.contains("captured")) problem.captured_any = original.captured_any;
  if (!changes.contains("succeeded")) problem.succeeded_any = original.succeeded_any;
  validate(problem);
  unshare(problem);
  return copy;
}

Problem with_state(const Problem& problem, const Given<State>& state) {
  Problem copy = problem;
  copy.state = given("state", state);
  copy.contacts.reset();
  validate(copy);
  warn(implausible_joints(copy.scene, copy.state), copy.scene);
  return copy;
}

State edge_start(const Problem& problem, const Given<State>& node) {
  const State state = given("node", node);
  validate(problem.scene, state, "node");
  return EdgeStart(problem)(state);
}

void save_file(const Problem& problem, const py::object& path, const Given<Meshes>& meshes) {
  save(problem, file_path(path), given("meshes", meshes));
}

Problem load_file(const py::object& path, bool start_outside, const Given<Policies>& policies) {
  std::vector<Warning> warnings;
  Problem problem = load(file_path(path), &warnings, policies_by_name(policies));
  warn(warnings, problem.scene);
  warn(implausible(problem, start_outside), problem.scene);
  return problem;
}

Problem problem_from_json(const Given<std::string>& text, const py::object& folder, const Given<Policies>& policies) {
  std::vector<Warning> warnings;
  Problem problem = from_json(given("text", text), folder.is_none() ? "" : file_path(folder, "folder"), &warnings,
                              policies_by_name(policies));
  warn(warnings, problem.scene);
  return problem;
}

std::string repr_of(const Problem& problem) {
  return repr_of_fields("Problem", {{"scene", py::cast(problem.scene)},
                                    {"effector", py::cast(word_of(problem.effector))},
                                    {"rate", py::cast(problem.rate)}});
}

py::typing::Dict<py::str, py::object> schema() { return py::module_::import("json").attr("loads")(problem_schema()); }

using ProblemClass = py::class_<Problem, Owner<Problem>>;

void def_problem_constructor(ProblemClass& type) {
  const auto fields = std::tuple_cat(problem_bounds(), problem_question());
  with_fields(fields, {99, {"effector", "rate", "force_weights"}}, &make_problem,
              [&](const auto& make, const auto&... keywords) {
                type.def(py::init(make), py::arg("scene"), py::arg("state"), py::kw_only(), py::arg("captured"),
                         py::arg("succeeded") = py::none(), py::arg("within") = py::none(),
                         py::arg("start_outside") = false, keywords...);
              });
}

void def_properties(ProblemClass& type) {
  def_fields(type, record_of<Problem>.fields, {"horizon"});
  type.def_property_readonly(
          "scene", [](const Problem& problem) { return problem.scene; }, "A copy.")
      .def_readonly("state", &Problem::state, "z_init, shape (n,).")
      .def_property_readonly("horizon", &horizon, "The question is about so many seconds [s]; None: it has no clock.")
      .def_property_readonly("captured_by_object", &sets_by_object,
                             "The capture set of each object by its name; None where there is one for all.");
}

void def_copies(ProblemClass& type) {
  {
    py::options options;
    options.disable_function_signatures();
    type.def("replace", &replace,
             "replace(self, **changes: typing.Any) -> Problem\n\nA copy with other values of some of the constructor's "
             "keywords. Raises as the constructor does, and TypeError on other keywords.");
  }
  type.def("with_state", &with_state, py::arg("state"),
           "The same question about another state, shape (n,). The copy has no measured contacts. Warns of a joint "
           "that is beyond its limits.")
      .def(
          "with_engine",
          [](const Problem& problem, const Given<EngineChoice>& engine) {
            const EngineChoice choice = given("engine", engine);
            return choice.simulator ? with_simulator(problem, choice.simulator) : with_engine(problem, choice.kind);
          },
          py::arg("engine"),
          "The same question in a simulation by another engine: 'native' or 'bullet', with its own solver_iterations "
          "and solver_tolerance, or an em.engines.Engine in its own step. Raises ValueError on another word, and on "
          "what an engine does not do.")
      .def(
          "with_step",
          [](const Problem& problem, const Given<double>& step) { return with_step(problem, given("step", step)); },
          py::arg("step"),
          "The same question in a simulation with another step [s]; a plan with shorter rows has the means of their "
          "wrenches and velocities, and their last targets. em.longest_step finds how long it may be. Raises "
          "ValueError where a time is not whole steps of this length, or a spring is too stiff for it.")
      .def("edge_start", &edge_start, py::arg("node"),
           "Where an edge from a node's state (n,) starts: there or, under effector 'drive', there with the effector "
           "at its velocity of the start state.");
}

// Leaves the problem without its engine of Python and the plan of that one's commands; None: it has none.
py::object take_engine(Problem& problem) {
  Stepping stepping = problem.scene.stepping();
  if (!stepping.simulator) return py::none();
  py::object taken = py::make_tuple(engine_of(problem.scene), problem.plan ? py::cast(*problem.plan) : py::none());
  stepping.simulator.reset();
  problem.scene = problem.scene.with_stepping(stepping);
  problem.plan.reset();
  return taken;
}

void give_engine(Problem& problem, const py::object& taken) {
  const py::object engine = taken[py::int_(0)], plan = taken[py::int_(1)];
  if (!plan.is_none()) problem.plan = plan.cast<Plan>();
  problem = with_simulator(problem, convert(Type<EngineChoice>{}, "engine", engine).simulator);
}

void def_files(ProblemClass& type) {
  type.def("save", &save_file, py::arg("path"), py::arg("meshes") = "embedded", save_doc)
      .def_static("load", &load_file, py::arg("path"), py::kw_only(), py::arg("start_outside") = false,
                  py::arg("policies") = py::dict(),
                  "Reads a JSON file. policies: by name, the em.Policy of which a file has that name alone. Raises "
                  "OSError if it cannot be opened, and ValueError that names the file, the place in it and what was "
                  "expected, as a policy. Warns as the constructor does, and of friction along one direction, which "
                  "files of version 0.13 may ask for.")
      .def_static("schema", &schema, "The JSON Schema (draft-07) of problem files.")
      .def(
          "to_json", [](const Problem& problem) { return to_json(problem); }, "The problem as JSON text.")
      .def_static("from_json", &problem_from_json, py::arg("text"), py::arg("folder") = py::none(),
                  py::arg("policies") = py::dict(),
                  "A problem from JSON text. folder: what the paths of its meshes are relative to; policies: as of "
                  "load. Raises ValueError that names the place and what was expected.")
      .def(pickled_as_json<Problem>(
          [](Problem& problem) { return problem.plan ? &*problem.plan : nullptr; },
          [](const std::string& text, const Policies& policies) { return from_json(text, "", nullptr, policies); },
          &take_engine, &give_engine));
}

}  // namespace

void bind_problem(py::module_& module) {
  bind_record<ForceWeights>(module, "ForceWeights", force_weights_doc,
                            {99, {"engage", "stick", "distance", "ground_engage", "ground_stick"}});
  ProblemClass type(module, "Problem", collected<Problem>(), problem_doc().c_str());
  def_copies(type);
  def_problem_constructor(type);
  def_properties(type);
  def_files(type);
  type.def("__repr__", &repr_of);
}

}  // namespace energymargin::binding
