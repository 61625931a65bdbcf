// Models of random disturbances, and the probability of staying captured, for Python.

#include "energymargin/metrics/probability.hpp"

#include <cmath>

#include "callbacks.hpp"
#include "energymargin/metrics/guards.hpp"
#include "energymargin/metrics/rare.hpp"
#include "long_call.hpp"
#include "metrics/words.hpp"
#include "problem/records.hpp"
#include "records.hpp"

namespace energymargin::binding {
namespace {

constexpr const char* interval_doc =
    R"((low, high) of the probability, by Clopper and Pearson: it holds at least as often as `confidence`.

With design="sobol" it is that of the `effective` size, which blocks of the rollouts tell: it holds about as often.
With a tolerance or a threshold it is wider, by the number of looks. which: 'captured', 'lost', 'success' or
'any'.)";

using DrawFunction = py::typing::Callable<py::object(py::object, py::object)>;
using Model = std::variant<disturbances::Uniform, disturbances::Gaussian, disturbances::Boltzmann,
                           disturbances::ActuationNoise, DrawFunction>;

// A user's function that draws the wrenches of one rollout after the other.
disturbances::Draws draws_of(const DrawFunction& asked, const Problem& problem, std::uint64_t seed) {
  const auto timing = timing_of(problem);
  const int steps = timing ? timing->horizon : 0;
  const double step = problem.scene.stepping().step;
  return {[function = Callback(asked), steps, step, seed](std::uint64_t index,
                                                          const Limit& limit) -> std::optional<Wrenches> {
    const WithGil acquire;
    const Asking asking(limit);
    try {
      const py::module_ numpy = py::module_::import("numpy");
      const py::object random = numpy.attr("random").attr("default_rng")(py::make_tuple(seed, index));
      const py::object times = numpy.attr("arange")(steps) * py::float_(step);
      return matrix("disturbance", {function.function()(random, times)}, steps, -1);
    } catch (const py::error_already_set&) {
      if (!asking.was_cut()) throw;
      return std::nullopt;
    }
  }};
}

using LevelFunction = py::typing::Callable<py::object(py::array_t<double>)>;

// A user's function of a state.
std::function<double(const State&)> level_of(const LevelFunction& asked) {
  return [function = Callback(asked)](const State& state) {
    const WithGil acquire;
    return convert(Type<double>{}, "level", function.function()(py::cast(state)));
  };
}

// The call's own model, or what its function draws.
DisturbanceModel disturbance_of(const Problem& problem, const Model& model, const ProbabilityOptions& options) {
  return std::visit(
      [&](const auto& alternative) -> DisturbanceModel {
        if constexpr (!std::is_same_v<std::decay_t<decltype(alternative)>, DrawFunction>) {
          return alternative;
        } else {
          if (options.tolerance || options.above) {
            throw std::invalid_argument(
                std::string(options.above ? "above" : "tolerance") +
                " is given with a function as disturbance, expected a model of em.disturbances, or rollouts=");
          }
          return draws_of(alternative, problem, options.seed);
        }
      },
      model);
}

CaptureProbability score_rare(const Problem& problem, const ProbabilityOptions& asked, const Model& model,
                              RareOptions options, LongCall& call) {
  for (const auto& [argument, is_given] :
       {std::pair{"tolerance", asked.tolerance.has_value()}, std::pair{"above", asked.above.has_value()},
        std::pair{"design", asked.design != Design::independent}, std::pair{"success", asked.success},
        std::pair{"by_object", asked.by_object}, std::pair{"first", asked.first != 0},
        std::pair{"undisturbed=False", !asked.undisturbed},
        std::pair{"step", asked.long_step.has_value() || asked.finds_step},
        std::pair{"drawn_step", asked.drawn_step.has_value()},
        std::pair{"most_diverged", asked.most_diverged != ProbabilityOptions{}.most_diverged}}) {
    if (!is_given) continue;
    throw std::invalid_argument(std::string(argument) +
                                " is given with rare=True, expected without: rare losses are those of all objects over "
                                "the horizon, from `rollouts` replicas");
  }
  const auto alternative = [](const auto& given_model) -> DisturbanceModel {
    if constexpr (std::is_same_v<std::decay_t<decltype(given_model)>, DrawFunction>) {
      return disturbances::Draws{};
    } else {
      return given_model;
    }
  };
  options.disturbance = std::visit(alternative, model);
  options.rollouts = asked.rollouts.value_or(options.rollouts);
  options.seed = asked.seed;
  options.threads = asked.threads;
  options.rollout_counter = call.counter();
  return call.run(&rare_capture_probability, problem, options);
}

CaptureProbability score_probability(const Problem& problem, const Keywords& keywords) {
  LongCall call(keywords);  // a function as disturbance takes of its time
  ProbabilityOptions options;
  RareOptions rare_options;
  Model model;
  bool rare = false;
  bool warns = true;
  std::string design = "independent";
  std::optional<LevelFunction> level;
  keywords("disturbance", model)("rollouts", options.rollouts)("seed", options.seed)("first", options.first)(
      "threads", options.threads)("tolerance", options.tolerance)("above", options.above)("design", design)(
      "success", options.success)("by_object", options.by_object)("undisturbed", options.undisturbed)(
      "most_diverged", options.most_diverged)("step", options.long_step)("finds_step", options.finds_step)(
      "drawn_step", options.drawn_step)("rare", rare)("level", level)("ahead", rare_options.ahead)("warn", warns)
      .end();
  require_word("design", design, {"independent", "sobol"});
  options.design = design == "sobol" ? Design::sobol : Design::independent;
  if (!rare && level) throw std::invalid_argument("level is given, expected rare=True with it");
  if (!rare && rare_options.ahead) throw std::invalid_argument("ahead is given, expected rare=True with it");
  if (level) rare_options.level = level_of(*level);
  CaptureProbability p;
  if (rare) {
    p = score_rare(problem, options, model, rare_options, call);
  } else {
    options.disturbance = disturbance_of(problem, model, options);
    options.rollout_counter = call.counter();
    const bool asks = problem.plan && problem.plan->policy;  // Python, where Ctrl-C ends it
    p = asks ? call.run_here(&capture_probability, problem, options) : call.run(&capture_probability, problem, options);
  }
  if (warns) warn(p.warnings, problem.scene);
  return p;
}

// The confidence of one look out of several (Bonferroni).
double confidence_of_look(const CaptureProbability& p, const Given<double>& confidence) {
  const double of_all = given("confidence", confidence);
  if (!(of_all > 0.0 && of_all < 1.0)) {
    throw std::invalid_argument("confidence is " + short_repr(confidence.value) +
                                ", expected a number between 0 and 1");
  }
  return 1.0 - (1.0 - of_all) / p.looks;
}

Ends interval_of_look(const CaptureProbability& p, double probability, double confidence) {
  return ends(interval(probability, p.effective_of_parts, confidence));
}

Ends interval_of(const CaptureProbability& p, const Given<double>& confidence, const std::string& which) {
  const double of_look = confidence_of_look(p, confidence);
  require_word("which", which, {"captured", "lost", "success", "any"});
  if ((which == "success" && !p.success) || (which == "any" && !p.any)) {
    throw std::invalid_argument("which is '" + which +
                                "', expected what was asked for: success=True, or by_object=True");
  }
  if (which == "success") return interval_of_look(p, *p.success, of_look);
  if (which == "any") return interval_of_look(p, p.any->captured(), of_look);
  return ends(which == "lost" ? interval_of_loss(p, of_look) : interval_of_capture(p, of_look));
}

std::pair<Eigen::VectorXd, Eigen::VectorXd> band_of(const CaptureProbability& p, const Given<double>& confidence,
                                                    const std::string& which) {
  require_word("which", which, {"captured", "any"});
  if (which == "any" && !p.any) {
    throw std::invalid_argument("which is 'any', expected what was asked for: by_object=True");
  }
  const double of_look = confidence_of_look(p, confidence);
  const Eigen::VectorXd& curve = which == "any" ? p.any->curve : p.all.curve;
  std::pair<Eigen::VectorXd, Eigen::VectorXd> band{curve, curve};
  for (Eigen::Index i = 0; i < curve.size(); ++i) {
    std::tie(band.first[i], band.second[i]) =
        ends(which == "any" ? interval(curve[i], p.effective_of_parts, of_look) : interval_of_capture(p, of_look, i));
  }
  return band;
}

std::optional<bool> undisturbed_of(const CaptureProbability& p) {
  return std::isnan(p.undisturbed_time) ? std::nullopt : std::make_optional(p.undisturbed);
}

std::string repr_of(const CaptureProbability& p) {
  const double confidence = 1.0 - 0.05 / p.looks;
  const Interval interval = p.splitting ? interval_of_loss(p, confidence) : interval_of_capture(p, confidence);
  const double estimate = p.splitting ? p.lost[p.lost.size() - 1] : p.all.captured();
  return repr_of_fields("CaptureProbability", {{p.splitting ? "lost" : "captured", py::cast(estimate)},
                                               {"interval", py::cast(ends(interval))},
                                               {"mean_time", py::cast(p.all.mean_time)},
                                               {"undisturbed", py::cast(undisturbed_of(p))},
                                               {"rollouts", py::cast(p.rollouts)},
                                               {"steps", py::cast(p.steps)},
                                               {"unconverged", py::cast(p.unconverged)},
                                               {"lost_time", py::cast(p.lost_time)},
                                               {"complete", py::cast(p.complete)}});
}

using ProbabilityClass = py::class_<CaptureProbability>;

void def_survivals(ProbabilityClass& type) {
  type.def_property_readonly(
          "captured", [](const CaptureProbability& p) { return p.all.captured(); },
          "Probability that all objects stay captured throughout the horizon.")
      .def_property_readonly(
          "lost", [](const CaptureProbability& p) { return p.lost[p.lost.size() - 1]; },
          "Probability that an object is lost within the horizon: 1 - captured, in full precision.")
      .def_readonly("lost_curve", &CaptureProbability::lost,
                    "Probability of having been lost until each time, shape (T,): 1 - curve, in full precision.")
      .def_readonly("times", &CaptureProbability::times, "Of the looks at the sets, shape (T,) [s].")
      .def_property_readonly(
          "curve", [](const CaptureProbability& p) { return p.all.curve; },
          "Probability of being captured throughout until each time, shape (T,).")
      .def_property_readonly(
          "value", [](const CaptureProbability& p) { return p.all.captured(); }, "As `captured`.")
      .def_property_readonly(
          "mean_time", [](const CaptureProbability& p) { return p.all.mean_time; },
          "Mean time captured within the horizon [s], the restricted mean survival time.")
      .def_readonly("any", &CaptureProbability::any, "Of at least one object, a Survival; None unless by_object.")
      .def_property_readonly(
          "by_object",
          [](const CaptureProbability& p) {
            py::typing::Dict<py::str, Survival> of;
            for (const auto& [name, survival] : p.by_object) of[py::str(name)] = survival;
            return of;
          },
          "A Survival for each object by its name, in the scene's order; empty unless by_object.")
      .def_readonly("success", &CaptureProbability::success,
                    "Probability of being in the success set at the horizon; None unless success.");
}

void def_undisturbed(ProbabilityClass& type) {
  type.def_property_readonly("undisturbed", &undisturbed_of,
                             "Whether the objects stay captured without a disturbance; None with undisturbed=False.")
      .def_readonly("undisturbed_time", &CaptureProbability::undisturbed_time,
                    "When they leave without a disturbance [s]; the horizon if they stay, NaN with undisturbed=False.")
      .def_readonly("undisturbed_success", &CaptureProbability::undisturbed_success,
                    "Whether the undisturbed future ends in the success set; None unless success.");
}

void def_counts(ProbabilityClass& type) {
  type.def_readonly("rollouts", &CaptureProbability::rollouts,
                    "Random rollouts that count; with rare=True the replicas.")
      .def_readonly("diverged", &CaptureProbability::diverged, "Rollouts that diverged, and do not count.")
      .def_readonly("effective", &CaptureProbability::effective,
                    "Effective sample size: rollouts of equal weight that say as much.")
      .def_property_readonly(
          "levels", [](const CaptureProbability& p) { return p.splitting ? p.splitting->levels : 0.0; },
          "Levels at which replicas split, in the mean of the batches; 0 unless rare.")
      .def_property_readonly(
          "long_step",
          [](const CaptureProbability& p) {
            return p.two_steps ? std::make_optional(p.two_steps->step) : std::nullopt;
          },
          "The long step that the rollouts took [s]; None if they took that of the scene.")
      .def_property_readonly(
          "repeated", [](const CaptureProbability& p) { return p.two_steps ? p.two_steps->pairs : 0; },
          "Of them, those that took the scene's step too.")
      .def_readonly("exit_times", &CaptureProbability::exit_times,
                    "When each rollout leaves the capture set [s], shape (rollouts,), in the order of their numbers: "
                    "inf if it stays, NaN if it diverged. Empty with rare=True; with `step` those of the long one.")
      .def_property_readonly(
          "successes",
          [](const CaptureProbability& p) -> std::optional<py::array_t<bool>> {
            if (!p.success) return std::nullopt;
            return py::array_t<bool>(static_cast<py::ssize_t>(p.successes.size()),
                                     reinterpret_cast<const bool*>(p.successes.data()));
          },
          "Whether each rollout ends in the success set, shape (rollouts,); None unless success.")
      .def_readonly("above", &CaptureProbability::above,
                    "Whether the probability is above the threshold that was asked; None: that is not told.")
      .def_readonly("complete", &CaptureProbability::complete,
                    "Whether no rollout is missing. False if the timeout or the cancel came first.");
}

using namespace disturbances;

template <typename Struct>
std::vector<const char*> names_of() {
  std::vector<const char*> names;
  visit_fields<Struct>([&](const auto& field) { names.push_back(field.name); });
  return names;
}

template <typename Model>
void bind_model(py::module_& module, const char* name, const Signature& signature) {
  py::class_<Model> type = bind_record<Model>(module, name, record_of<Model>.description, signature);
  def_repr(type, name, names_of<Model>());
}

void bind_disturbances(py::module_& module) {
  py::module_ models = module.def_submodule("disturbances", "What may act on the objects at random.");
  bind_model<Uniform>(models, "Uniform", {99, {"strength", "objects", "hold"}});
  bind_model<Gaussian>(models, "Gaussian", {99, {"torque", "correlation_time"}});
  bind_model<Boltzmann>(models, "Boltzmann", {99, {"strength", "objects", "hold"}});
  py::class_<ActuationNoise> noise(models, "ActuationNoise", record_of<ActuationNoise>.description);
  def_fields(noise, record_of<ActuationNoise>.fields);
  def_repr(noise, "of_plan", names_of<ActuationNoise>());
  const std::string doc =
      "Noise of the robot: a uniform draw is added to the wrenches on each body that the plan pushes or drives, and "
      "one to each joint's target.\n\n" +
      fields_doc(record_of<ActuationNoise>.fields);
  def_function(models, "of_plan", doc, record_of<ActuationNoise>.fields, {99, {"force", "torque", "targets", "hold"}},
               &unchanged<ActuationNoise>);
}

}  // namespace

void bind_probability(py::module_& module) {
  bind_disturbances(module);
  py::class_<Survival>(module, "Survival", "The survival curve of one capture set over the horizon.")
      .def_property_readonly("captured", &Survival::captured, "Probability of staying captured until the horizon.")
      .def_readonly("curve", &Survival::curve, "The same until each of the times, shape (T,).")
      .def_readonly("mean_time", &Survival::mean_time, "Mean time captured within the horizon [s].");
  ProbabilityClass type(module, "CaptureProbability",
                        "Probability of staying captured under a stated random disturbance.");
  def_survivals(type);
  def_undisturbed(type);
  def_counts(type);
  def_quality(type, "");
  type.def("interval", &interval_of, py::arg("confidence") = 0.95, py::arg("which") = "captured", interval_doc)
      .def(
          "band", &band_of, py::arg("confidence") = 0.95, py::arg("which") = "captured",
          "(low, high), each of shape (T,): the interval of each point of the curve alone. which: 'captured' or 'any'.")
      .def("__repr__", &repr_of);
  def_metric(module, "capture_probability", &score_probability);
  module.def(
      "too_many_diverged",
      [](int diverged, int rollouts) {
        return too_many_diverged(diverged, rollouts, ProbabilityOptions{}.most_diverged);
      },
      py::arg("diverged"), py::arg("rollouts"),
      "Whether more of so many rollouts have diverged than a probability may have by default.");
}

}  // namespace energymargin::binding
