// The probability of staying captured for Python.

#include "energymargin/metrics/probability.hpp"

#include "convert.hpp"
#include "described.hpp"
#include "interrupt.hpp"

namespace energymargin::binding {
namespace {

using namespace disturbances;

// A name that the file format and the tables know a model by, and its numbers.
template <typename Model>
void with_repr(py::class_<Model>& type, const char* name, std::vector<const char*> fields) {
  type.def("__repr__", [name, fields](const py::object& self) {
    py::str text(name);
    std::string all = std::string(name) + "(";
    for (std::size_t i = 0; i < fields.size(); ++i) {
      all += (i ? ", " : "") + std::string(fields[i]) + "=" + py::repr(self.attr(fields[i])).cast<std::string>();
    }
    return all + ")";
  });
}

Uniform uniform(const Number& strength, const std::optional<WholeNumber>& objects, const std::optional<Number>& hold) {
  Uniform model{real("strength", strength)};
  if (objects) model.objects = count("objects", *objects);
  model.hold = real("hold", hold);
  return model;
}

void bind_models(py::module_& module) {
  py::class_<Uniform> of_uniform(module, "Uniform",
                                 "Piecewise constant: along and about each axis even within strength times the "
                                 "problem's bounds, each piece held for an even draw of time.");
  of_uniform
      .def(py::init(&uniform), py::arg("strength") = 1.0, py::arg("objects") = py::none(), py::arg("hold") = py::none(),
           "strength: of the bounds. objects: how many of several objects each piece meets, drawn anew for each; by "
           "default all. hold: the longest piece [s]; by default the problem's duration.")
      .def_readonly("strength", &Uniform::strength, "Share of the problem's bounds.")
      .def_readonly("objects", &Uniform::objects, "How many objects it meets at a time; None: all.")
      .def_readonly("hold", &Uniform::hold, "[s]");
  with_repr(of_uniform, "Uniform", {"strength", "objects", "hold"});
  py::class_<Gaussian> of_gaussian(module, "Gaussian",
                                   "Normal in each step, on the axes whose bounds are not 0, with a correlation that "
                                   "fades as exp(-t / correlation_time).");
  of_gaussian
      .def(py::init([](const Number& force, const Number& torque, const Number& time) {
             return Gaussian{real("force", force), real("torque", torque), real("correlation_time", time)};
           }),
           py::arg("force"), py::arg("torque") = 0.0, py::arg("correlation_time") = Gaussian{}.correlation_time,
           "force [N], torque [N m]: standard deviations. correlation_time [s].")
      .def_readonly("force", &Gaussian::force, "[N]")
      .def_readonly("torque", &Gaussian::torque, "[N m]")
      .def_readonly("correlation_time", &Gaussian::correlation_time, "[s]");
  with_repr(of_gaussian, "Gaussian", {"force", "torque", "correlation_time"});
  py::class_<Boltzmann> of_boltzmann(module, "Boltzmann",
                                     "Uniform, each rollout weighted by exp(-rate * effort): what costs much work is "
                                     "less likely (eq. 4). All rollouts run to the horizon.");
  of_boltzmann
      .def(py::init([](const Number& rate, const Number& strength, const std::optional<WholeNumber>& objects,
                       const std::optional<Number>& hold) {
             return Boltzmann{real("rate", rate), uniform(strength, objects, hold)};
           }),
           py::arg("rate"), py::arg("strength") = 1.0, py::arg("objects") = py::none(), py::arg("hold") = py::none(),
           "rate: lambda [1/J]; the others as of Uniform.")
      .def_readonly("rate", &Boltzmann::rate, "[1/J]")
      .def_property_readonly(
          "strength", [](const Boltzmann& model) { return model.proposal.strength; }, "Share of the problem's bounds.")
      .def_property_readonly(
          "objects", [](const Boltzmann& model) { return model.proposal.objects; },
          "How many objects it meets at a time; None: all.")
      .def_property_readonly("hold", [](const Boltzmann& model) { return model.proposal.hold; }, "[s]");
  with_repr(of_boltzmann, "Boltzmann", {"rate", "strength", "objects", "hold"});
  py::class_<OfPlan> noise(module, "OfPlan", "Noise of the robot: an even draw is added to what its plan says.");
  noise.def_readonly("force", &OfPlan::force, "Largest along each axis, shape (3,) [N].")
      .def_readonly("torque", &OfPlan::torque, "Largest about each axis, shape (3,) [N m].")
      .def_readonly("targets", &OfPlan::targets, "Largest, of each joint's target [rad] or [m].")
      .def_readonly("hold", &OfPlan::hold, "[s]");
  with_repr(noise, "of_plan", {"force", "torque", "targets", "hold"});
  module.def(
      "of_plan",
      [](const ArrayLike& force, const ArrayLike& torque, const Number& targets, const std::optional<Number>& hold) {
        return OfPlan{vector3("force", force), vector3("torque", torque), real("targets", targets), real("hold", hold)};
      },
      py::arg("force") = py::make_tuple(0.0, 0.0, 0.0), py::arg("torque") = py::make_tuple(0.0, 0.0, 0.0),
      py::arg("targets") = 0.0, py::arg("hold") = py::none(),
      "Noise of the robot itself: to the wrenches on each body that its plan pushes or drives an even draw within "
      "force "
      "(3,) [N] and torque (3,) [N m] is added, and to each joint's target one within targets [rad] or [m]; each is "
      "held "
      "for hold [s], by default a step.");
}

using Function = py::typing::Callable<py::object(py::object, py::object)>;
using Model = std::variant<Uniform, Gaussian, Boltzmann, OfPlan, Function>;

// What a user's function draws for each rollout.
Given given_by(const Function& function, const Problem& problem, int rollouts, std::uint64_t seed_given) {
  const auto timing = timing_of(problem);
  if (!timing) throw std::invalid_argument("problem is without horizon and plan, expected one with");
  const py::module_ numpy = py::module_::import("numpy");
  const py::object times = numpy.attr("arange")(timing->horizon) * py::float_(problem.scene.stepping().step);
  Given given;
  for (int i = 0; i < rollouts; ++i) {
    const py::object random = numpy.attr("random").attr("default_rng")(py::make_tuple(seed_given, i));
    given.rollouts.push_back(matrix("disturbance", ArrayLike{function(random, times)}, timing->horizon, -1));
  }
  return given;
}

CaptureProbability probability(const Problem& problem, const Model& disturbance,
                               const std::optional<WholeNumber>& rollouts, const WholeNumber& seed_given,
                               const WholeNumber& threads, const std::optional<Number>& tolerance, bool success,
                               bool by_object, const TimeoutArgument& timeout, const CancelArgument& cancel,
                               const ProgressArgument& progress_call) {
  const Limit given = limit_of(timeout, cancel);
  Progress progress(progress_call);
  ProbabilityOptions options;
  if (rollouts) options.rollouts = count("rollouts", *rollouts);
  options.seed = seed("seed", seed_given);
  options.threads = count("threads", threads);
  options.tolerance = real("tolerance", tolerance);
  options.success = success;
  options.by_object = by_object;
  options.made = progress.made();
  std::visit(
      [&](const auto& model) {
        if constexpr (std::is_same_v<std::decay_t<decltype(model)>, Function>) {
          if (options.tolerance) {
            throw std::invalid_argument(
                "tolerance is given with a function as disturbance, expected a model of "
                "em.disturbances, or rollouts=");
          }
          options.rollouts = options.rollouts.value_or(30);
          options.disturbance = given_by(model, problem, *options.rollouts, options.seed);
        } else {
          options.disturbance = model;
        }
      },
      disturbance);
  return interruptible(
      given,
      [&](const Limit& limit) {
        options.limit = limit;
        return capture_probability(problem, options);
      },
      &progress);
}

// Of an interval of one look out of several.
double share_of_look(const CaptureProbability& probability, const Number& confidence) {
  const double share = real("confidence", confidence);
  if (!(share > 0.0 && share < 1.0)) {
    throw std::invalid_argument("confidence is " + shown(confidence.value) + ", expected a number between 0 and 1");
  }
  return 1.0 - (1.0 - share) / probability.looks;
}

std::pair<Eigen::VectorXd, Eigen::VectorXd> band(const CaptureProbability& probability, const Number& confidence,
                                                 const std::string& which) {
  if (which != "captured" && which != "any") {
    throw std::invalid_argument("which is '" + which + "', expected 'captured' or 'any'");
  }
  if (which == "any" && !probability.any) {
    throw std::invalid_argument("which is 'any', expected what was asked for: by_object=True");
  }
  const double share = share_of_look(probability, confidence);
  const Eigen::VectorXd& curve = which == "any" ? probability.any->curve : probability.all.curve;
  std::pair<Eigen::VectorXd, Eigen::VectorXd> ends{curve, curve};
  for (Eigen::Index i = 0; i < curve.size(); ++i) {
    const Interval at = interval(curve[i], probability.effective, share);
    ends.first[i] = at.low;
    ends.second[i] = at.high;
  }
  return ends;
}

void bind_result(py::module_& module) {
  py::class_<Survival>(module, "Survival", "How one capture set fares over the horizon.")
      .def_property_readonly("captured", &Survival::captured, "Probability of staying captured until the horizon.")
      .def_readonly("curve", &Survival::curve, "The same until each of the times, shape (T,).")
      .def_readonly("mean_time", &Survival::mean_time, "Mean time captured within the horizon [s].");
  py::class_<CaptureProbability>(module, "CaptureProbability",
                                 "Probability of staying captured under a stated random disturbance.")
      .def_property_readonly(
          "captured", [](const CaptureProbability& p) { return p.all.captured(); },
          "Probability that all objects stay captured throughout the horizon.")
      .def_readonly("times", &CaptureProbability::times, "At which the sets are looked at, shape (T,) [s].")
      .def_property_readonly(
          "curve", [](const CaptureProbability& p) { return p.all.curve; },
          "Probability of having been captured throughout until each time, shape (T,).")
      .def_property_readonly(
          "mean_time", [](const CaptureProbability& p) { return p.all.mean_time; },
          "Mean time captured within the horizon [s], the restricted mean survival time.")
      .def_readonly("any", &CaptureProbability::any, "Of at least one object, a Survival; None unless by_object.")
      .def_readonly("by_object", &CaptureProbability::by_object, "Of each object, in the scene's order; or empty.")
      .def_readonly("success", &CaptureProbability::success,
                    "Probability of being in the success set at the horizon; None unless asked for.")
      .def_readonly("undisturbed", &CaptureProbability::undisturbed,
                    "Whether they stay captured without any disturbance.")
      .def_readonly("undisturbed_time", &CaptureProbability::undisturbed_time,
                    "How long they do within the horizon [s].")
      .def_readonly("undisturbed_success", &CaptureProbability::undisturbed_success,
                    "Whether the undisturbed future ends in the success set; None unless asked for.")
      .def_readonly("rollouts", &CaptureProbability::rollouts, "Random ones that count.")
      .def_readonly("steps", &CaptureProbability::steps, "Simulation steps, those of the undisturbed one too.")
      .def_readonly("diverged", &CaptureProbability::diverged, "Rollouts that are left out.")
      .def_readonly("effective", &CaptureProbability::effective, "As many rollouts of equal weight say as much.")
      .def_readonly("complete", &CaptureProbability::complete,
                    "Whether all rollouts are there: False if the timeout or the cancel came first.")
      .def(
          "interval",
          [](const CaptureProbability& p, const Number& confidence, const std::string& which) {
            const double share = share_of_look(p, confidence);
            if (which != "captured" && which != "success" && which != "any") {
              throw std::invalid_argument("which is '" + which + "', expected 'captured', 'success' or 'any'");
            }
            if ((which == "success" && !p.success) || (which == "any" && !p.any)) {
              throw std::invalid_argument("which is '" + which +
                                          "', expected what was asked for: success=True, or "
                                          "by_object=True");
            }
            const double value = which == "captured" ? p.all.captured()
                                 : which == "any"    ? p.any->captured()
                                                     : *p.success;
            const Interval found = interval(value, p.effective, share);
            return std::pair(found.low, found.high);
          },
          py::arg("confidence") = 0.95, py::arg("which") = "captured",
          "(low, high) of the probability, by Clopper and Pearson, so that it holds at least as often as `confidence`; "
          "with a tolerance as much wider as the looks ask for. which: 'captured', 'success' or 'any'.")
      .def("band", &band, py::arg("confidence") = 0.95, py::arg("which") = "captured",
           "(low, high), each of shape (T,): the interval of each point of the curve, for itself alone. which: "
           "'captured' or 'any'.")
      .def("__repr__", [](const CaptureProbability& p) {
        const Interval found = interval(p.all.captured(), p.effective, 1.0 - 0.05 / p.looks);
        return described("CaptureProbability", {{"captured", py::cast(p.all.captured())},
                                                {"interval", py::make_tuple(found.low, found.high)},
                                                {"mean_time", py::cast(p.all.mean_time)},
                                                {"undisturbed", py::cast(p.undisturbed)},
                                                {"rollouts", py::cast(p.rollouts)},
                                                {"complete", py::cast(p.complete)}});
      });
}

}  // namespace

void bind_probability(py::module_& module) {
  py::module_ models = module.def_submodule("disturbances", "What may act on the objects at random.");
  bind_models(models);
  bind_result(module);
  module.def("capture_probability", &probability, py::arg("problem"), py::kw_only(),
             py::arg_v("disturbance", Uniform{}, "Uniform()"), py::arg("rollouts") = py::none(), py::arg("seed") = 0,
             py::arg("threads") = 1, py::arg("tolerance") = py::none(), py::arg("success") = false,
             py::arg("by_object") = false, py::arg("timeout") = py::none(), py::arg("cancel") = py::none(),
             py::arg("progress") = py::none(),
             R"(Probability that the objects stay captured over the problem's horizon while the robot follows its plan.

disturbance: a model of em.disturbances, by default Uniform(), or a function (random, times) of a numpy Generator and the
times of the steps, shape (steps,) [s], that gives wrenches (steps, 6 k). rollouts: by default 30; with a tolerance they
are added, 32, 64, 128, ..., until half of the 95 % interval is at most that, up to `rollouts`, by default 10000. One more
rollout, without disturbance, is told apart. success: also the probability of being in the success set at the horizon, for
which rollouts run on after an exit. by_object: of several objects also of any, and of each. The same seed draws the same
disturbances in units of the bounds for every problem; the result does not depend on the threads.

Raises ValueError on a problem without horizon and plan, RuntimeError if more than 1 % of the rollouts diverge. Ends early
after timeout [s], or once cancel is set: the rollouts that are complete count, up to the first that is not; `complete`
says so. Without any it raises TimeoutError or Cancelled. progress(rollouts) is called now and then.)");
}

}  // namespace energymargin::binding
