// Whether two bodies touch, for regions of states.

#include <limits>
#include <memory>
#include <mutex>

#include "base/check.hpp"
#include "physics/engine.hpp"
#include "sets/primitives.hpp"

namespace energymargin {
namespace {

// The pair of bodies of a set in simulations of its scene: as many as there are threads that ask at once.
class TouchingPair {
 public:
  TouchingPair(const Scene& scene, const regions::Touching& set)
      : scene_(scene), set_(set), a_(scene.index(set.body)), b_(scene.index(set.other)) {
    if (const auto& simulator = scene.stepping().simulator; simulator && set.force > 0.0) {
      reject("force", text(set.force) + " with the engine '" + simulator->name + "'",
             "0: that one tells no contact force");
    }
    if (CollisionFilter(scene)(a_, b_) && has_parts(a_) && has_parts(b_)) return;
    reject("other", "'" + set.other + "', which never collides with '" + set.body + "'", "a body that can touch it");
  }

  double beyond_gap(const double* state) {
    return ask(state, [this](Engine& engine) {
      const auto closest = engine.pairs().closest(a_, b_, everywhere);
      return closest ? closest->distance - set_.gap : infinity;
    });
  }

  double missing_force(const double* state) {
    return ask(state, [this](Engine& engine) {
      const double step = scene_.stepping().step;
      double left = step, impulse = 0.0;
      while (left > 0.0) {
        left -= engine.advance(left).duration;
        impulse += engine.normal_impulse(a_, b_);
      }
      return set_.force - impulse / step;
    });
  }

 private:
  static constexpr double infinity = std::numeric_limits<double>::infinity();
  static constexpr double everywhere = 1e9;  // m

  bool has_parts(std::size_t body) const {
    const auto* compound = std::get_if<Compound>(&scene_.bodies()[body].shape);
    return !compound || !compound->parts.empty();
  }

  template <typename Question>
  double ask(const double* state, const Question& question) {
    std::unique_ptr<Engine> engine = take();
    const State at = Eigen::Map<const State>(state, engine->layout().dimension());
    if (!at.allFinite()) return infinity;
    engine->restore(at);
    const double answer = question(*engine);
    const std::lock_guard<std::mutex> lock(mutex_);
    idle_.push_back(std::move(engine));
    return answer;
  }

  std::unique_ptr<Engine> take() {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (idle_.empty()) return make_engine(scene_);
    std::unique_ptr<Engine> engine = std::move(idle_.back());
    idle_.pop_back();
    return engine;
  }

  Scene scene_;
  regions::Touching set_;
  std::size_t a_, b_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Engine>> idle_;
};

}  // namespace

std::pair<StateReader, StateReader> touch_readers(const Scene& scene, const regions::Touching& set) {
  const auto pair = std::make_shared<TouchingPair>(scene, set);
  StateReader force;
  if (set.force > 0.0) force = [pair](const double* state) { return pair->missing_force(state); };
  return {[pair](const double* state) { return pair->beyond_gap(state); }, force};
}

}  // namespace energymargin
