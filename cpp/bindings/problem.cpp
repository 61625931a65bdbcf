// Problems for Python.

#include "energymargin/problem.hpp"

#include "convert.hpp"
#include "described.hpp"
#include "energymargin/problem_io.hpp"
#include "warnings.hpp"

namespace energymargin::binding {
namespace {

constexpr const char* problem_doc = R"(One question: how robust is this state against these disturbances?

scene, state (n,): the bodies and where they are. force (3,) [N] and torque (3,) [N m]: the largest disturbance of each
object along and about each axis. duration [s]: the longest edge of the search. captured: the capture set Z_cap;
succeeded: the success set Z_suc. Where there are several objects, a dict of regions, one by object, asks twice: are all of
them in theirs (captured, succeeded), and is at least one (captured_any, succeeded_any). within: where the search for an
escape may go, Z_b. effector: 'coast', it is not actuated, or 'drive', each edge of the search starts with the velocity that
it has in the start state. rate: lambda of eq. 4 [1/J]. force_weights: those of the force score. contacts: measured at the
state, for the force score. horizon [s]: the question is about the next so many seconds, with a plan its length by default; plan: what the robot does
in them; check [s]: between two looks at the capture set, by default about 1/60; dwell [s]: how long an object has to stay
outside. start_outside: a state outside of the capture set is meant, as along a recorded trajectory.
Raises ValueError on bad values and on a state in deep penetration. Warns, as PlausibilityWarning, of values that look
like another unit, and of a start that falls or is outside of the capture set.)";

constexpr const char* force_weights_doc = R"(Weights of the force score, Section V-B.

engage [1/N]: of the normal forces between effector and object; stick [1/N]: of their distances to the friction cones'
edges; distance [1/m]: taken off per metre between object and effector. ground_engage and ground_stick: the same for the
object's contacts with all that is not the effector, of use where the object is meant to stick there.)";

using RegionByObject = std::map<std::string, Region>;
using Sets = std::variant<RegionByObject, Region>;

std::vector<Region> by_object(const std::string& name, const Scene& scene, const RegionByObject& given) {
  std::vector<Region> regions;
  for (const std::size_t index : scene.with_role(Role::object)) {
    const auto found = given.find(scene.bodies()[index].name);
    if (found == given.end()) {
      throw std::invalid_argument(name + " has no '" + scene.bodies()[index].name + "', expected every object");
    }
    regions.push_back(found->second);
  }
  if (regions.size() == given.size() && !given.empty()) return regions;
  for (const auto& [body, region] : given) {
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

std::string file_path(const py::object& path) {
  if (!py::isinstance<py::str>(path) && !py::isinstance<py::bytes>(path) && !py::hasattr(path, "__fspath__")) {
    throw py::type_error("path is " + shown(path) + ", expected a str or a pathlib.Path");
  }
  const std::string text = word("path", py::module_::import("os").attr("fsdecode")(path));
  if (text.find('\0') != std::string::npos) throw std::invalid_argument("path has a zero byte, expected none");
  return text;
}

Meshes meshes(const std::string& name) {
  if (name == "embedded") return Meshes::embedded;
  if (name == "files") return Meshes::files;
  throw std::invalid_argument("meshes is '" + name + "', expected 'embedded' or 'files'");
}

std::optional<double> horizon(const Problem& problem) {
  const auto timing = timing_of(problem);
  return timing ? std::optional(timing->horizon * problem.scene.stepping().step) : std::nullopt;
}

std::optional<RegionByObject> sets_by_object(const Problem& problem) {
  const std::vector<Region> sets = captured_by_object(problem);
  if (sets.empty()) return std::nullopt;
  const std::vector<std::size_t> objects = problem.scene.with_role(Role::object);
  RegionByObject found;
  for (std::size_t i = 0; i < sets.size(); ++i) found.emplace(problem.scene.bodies()[objects[i]].name, sets[i]);
  return found;
}

// Through the constructor, so that what it says of bad values holds here too.
py::object replace(const py::object& problem, const py::kwargs& changes) {
  py::dict keywords;
  for (const char* name : {"scene", "state", "force", "torque", "duration", "captured", "succeeded", "within",
                           "effector", "rate", "force_weights", "contacts", "horizon", "plan", "check", "dwell"}) {
    keywords[name] = problem.attr(name);
  }
  const auto& own = problem.cast<const Problem&>();
  if (!own.horizon) keywords["horizon"] = py::none();
  keywords["start_outside"] = true;
  for (const auto& [name, value] : changes) {
    if (!keywords.contains(name)) {
      throw py::type_error("replace has no keyword '" + name.cast<std::string>() + "', expected one of Problem's");
    }
    keywords[name] = value;
  }
  py::object made = py::type::of<Problem>()(**keywords);
  auto& other = made.cast<Problem&>();
  if (!changes.contains("captured")) other.captured_any = own.captured_any;
  if (!changes.contains("succeeded")) other.succeeded_any = own.succeeded_any;
  validate(other);
  return made;
}

py::typing::Dict<py::str, py::object> schema() { return py::module_::import("json").attr("loads")(problem_schema()); }

}  // namespace

void bind_problem(py::module_& module) {
  py::register_exception_translator([](std::exception_ptr error) {
    try {
      if (error) std::rethrow_exception(error);
    } catch (const FileError& failed) {
      py::set_error(PyExc_OSError, failed.what());
    }
  });
  py::class_<ForceWeights>(module, "ForceWeights", force_weights_doc)
      .def(py::init([](const Number& engage, const Number& stick, const Number& distance, const Number& ground_engage,
                       const Number& ground_stick) {
             return ForceWeights{real("engage", engage), real("stick", stick), real("distance", distance),
                                 real("ground_engage", ground_engage), real("ground_stick", ground_stick)};
           }),
           py::arg("engage") = ForceWeights{}.engage, py::arg("stick") = ForceWeights{}.stick,
           py::arg("distance") = ForceWeights{}.distance, py::arg("ground_engage") = ForceWeights{}.ground_engage,
           py::arg("ground_stick") = ForceWeights{}.ground_stick)
      .def_readonly("engage", &ForceWeights::engage, "Of the normal forces between object and effector.")
      .def_readonly("stick", &ForceWeights::stick, "Of the distances to the friction cones' edges there.")
      .def_readonly("distance", &ForceWeights::distance,
                    "Of the distance between object and effector, which is taken off.")
      .def_readonly("ground_engage", &ForceWeights::ground_engage,
                    "Of the normal forces between the object and all else.")
      .def_readonly("ground_stick", &ForceWeights::ground_stick,
                    "Of the distances to the friction cones' edges there.");
  py::class_<Problem> type(module, "Problem", problem_doc);
  {
    py::options options;
    options.disable_function_signatures();
    type.def("replace", &replace,
             "replace(self, **changes: typing.Any) -> Problem\n\nA copy with other values of some of the constructor's "
             "keywords. Raises as the constructor does, and TypeError on other keywords.");
  }
  type.def(py::init([](const Scene& scene, const ArrayLike& state, const ArrayLike& force, const ArrayLike& torque,
                       const Number& duration, const Sets& captured, const std::optional<Sets>& succeeded,
                       const std::optional<Region>& within, const std::string& mode, const Number& rate,
                       const ForceWeights& force_weights, const std::optional<std::vector<Contact>>& contacts,
                       const std::optional<Number>& horizon, const std::optional<Plan>& plan,
                       const std::optional<Number>& check, const Number& dwell, bool start_outside) {
             Problem problem{scene,
                             vector("state", state, -1),
                             vector3("force", force),
                             vector3("torque", torque),
                             real("duration", duration),
                             all_of("captured", scene, captured),
                             succeeded ? std::make_optional(all_of("succeeded", scene, *succeeded)) : std::nullopt,
                             within,
                             any_of("captured", scene, captured),
                             any_of("succeeded", scene, succeeded),
                             value_of_word<Effector>("effector", mode),
                             real("rate", rate),
                             force_weights,
                             contacts,
                             real("horizon", horizon),
                             plan,
                             real("check", check),
                             real("dwell", dwell)};
             validate(problem);
             warn(implausible(problem, start_outside), problem.scene);
             return problem;
           }),
           py::arg("scene"), py::arg("state"), py::kw_only(), py::arg("force"), py::arg("torque"), py::arg("duration"),
           py::arg("captured"), py::arg("succeeded") = py::none(), py::arg("within") = py::none(),
           py::arg("effector") = "coast", py::arg("rate") = 5.0,
           py::arg_v("force_weights", ForceWeights{}, "ForceWeights()"), py::arg("contacts") = py::none(),
           py::arg("horizon") = py::none(), py::arg("plan") = py::none(), py::arg("check") = py::none(),
           py::arg("dwell") = 0.0, py::arg("start_outside") = false)
      .def_property_readonly(
          "scene", [](const Problem& problem) { return problem.scene; }, "A copy.")
      .def_readonly("state", &Problem::state, "z_init, shape (n,).")
      .def_readonly("force", &Problem::force, "Largest |force| along each axis, shape (3,) [N].")
      .def_readonly("torque", &Problem::torque, "Largest |torque| about each axis, shape (3,) [N m].")
      .def_readonly("duration", &Problem::duration, "Longest edge [s].")
      .def_readonly("captured", &Problem::captured, "Capture set.")
      .def_readonly("succeeded", &Problem::succeeded, "Success set, or None.")
      .def_readonly("captured_any", &Problem::captured_any, "Where at least one object is captured, or None.")
      .def_readonly("succeeded_any", &Problem::succeeded_any, "Where at least one object has succeeded, or None.")
      .def_readonly("within", &Problem::within, "Bounds of the search for an escape, or None.")
      .def_property_readonly(
          "effector", [](const Problem& problem) { return word_of(problem.effector); },
          "\"drive\" or \"coast\": whether each edge of a search starts with the effector at its velocity of the "
          "start.")
      .def_readonly("rate", &Problem::rate, "lambda [1/J].")
      .def_readonly("force_weights", &Problem::force_weights, "Weights of the force score.")
      .def_readonly("contacts", &Problem::contacts, "Measured contacts, or None.")
      .def_property_readonly("horizon", &horizon, "The question is about so many seconds [s]; None: it has no clock.")
      .def_readonly("plan", &Problem::plan, "What the robot does, or None: the effector coasts.")
      .def_readonly("check", &Problem::check, "Between two looks at the capture set [s]; None: about 1/60.")
      .def_readonly("dwell", &Problem::dwell, "How long an object has to stay outside for an escape [s].")
      .def_property_readonly("captured_by_object", &sets_by_object,
                             "The capture set of each object by its name; None where there is one for all.")
      .def(
          "with_state",
          [](const Problem& problem, const ArrayLike& state) {
            Problem other = problem;
            other.state = vector("state", state, -1);
            other.contacts.reset();
            validate(other);
            return other;
          },
          py::arg("state"),
          "The same question of another state, shape (n,); contacts measured at the old one are gone.")
      .def(
          "save",
          [](const Problem& problem, const py::object& path, const std::string& mode) {
            save(problem, file_path(path), meshes(mode));
          },
          py::arg("path"), py::arg("meshes") = "embedded",
          "Write a JSON file, atomically. meshes: where the points of compounds go that are convex hulls alone, "
          "unmoved, "
          "as those of a mesh: 'embedded', into the file, or 'files', into OBJ files beside it. Raises ValueError if a "
          "region is a Predicate, OSError if a file cannot be written.")
      .def_static(
          "load",
          [](const py::object& path, bool start_outside) {
            Problem problem = load(file_path(path));
            warn(implausible(problem, start_outside), problem.scene);
            return problem;
          },
          py::arg("path"), py::kw_only(), py::arg("start_outside") = false,
          "Read a JSON file. Raises OSError if it cannot be opened, ValueError that names the file, the place "
          "in it and what was expected. Warns as the constructor does.")
      .def_static("schema", &schema, "The JSON Schema (draft-07) of problem files.")
      .def(
          "edge_start",
          [](const Problem& problem, const ArrayLike& node) {
            const State state = vector("node", node, -1);
            validate(problem.scene, state, "node");
            return EdgeStart(problem)(state);
          },
          py::arg("node"),
          "Where an edge from a node's state (n,) starts: there or, under effector 'drive', there with the effector at "
          "its velocity of the start state.")
      .def(
          "to_json", [](const Problem& problem) { return to_json(problem); }, "The problem as JSON text.")
      .def_static(
          "from_json",
          [](const std::string& text, const py::object& folder) {
            return from_json(text, folder.is_none() ? "" : file_path(folder));
          },
          py::arg("text"), py::arg("folder") = py::none(),
          "A problem from JSON text. folder: what the paths of its meshes are relative to. Raises ValueError that "
          "names "
          "the place and what was expected.")
      .def("__repr__",
           [](const Problem& problem) {
             return described("Problem", {{"scene", py::cast(problem.scene)},
                                          {"effector", py::cast(word_of(problem.effector))},
                                          {"rate", py::cast(problem.rate)}});
           })
      .def(py::pickle([](const Problem& problem) { return py::str(to_json(problem)); },
                      [](const py::str& text) { return from_json(text); }));
}

}  // namespace energymargin::binding
