#pragma once
// Many rollouts in scenes with many contacts, and how many of them differ.

#include <random>
#include <vector>

#include "energymargin/world.hpp"
#include "expect.hpp"
#include "mechanisms.hpp"

namespace energymargin::scenes {

struct Question {
  State state;
  Disturbance wrenches;
  int steps;
};

// Rollouts from states along random pushes: in contact, out of it, and far apart.
inline std::vector<Question> questions(const Scene& scene, int count, unsigned int longest = 100) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> even(-1.0, 1.0);
  World world(scene);
  std::vector<Question> asked;
  State state = pack(scene);
  for (int i = 0; i < count; ++i) {
    Question question{state, Disturbance(scene.with_role(Role::object).size()),
                      1 + static_cast<int>(random() % longest)};
    for (Wrench& wrench : question.wrenches) {
      wrench.force.x() = 0.8 * even(random);
      wrench.force.y() = 0.8 * even(random);
      wrench.torque.z() = 0.05 * even(random);
    }
    state = world.rollout_unchecked(question.state, {push(question.wrenches, question.steps)}).state;
    asked.push_back(std::move(question));
    if (i % 15 == 14) state = pack(scene);
  }
  return asked;
}

//! One after the other.
inline std::vector<Rollout> answers(World& world, const std::vector<Question>& asked) {
  std::vector<Rollout> rollouts;
  for (const Question& question : asked) {
    rollouts.push_back(world.rollout_unchecked(question.state, {push(question.wrenches, question.steps)}));
  }
  return rollouts;
}

inline int differing(const std::vector<Rollout>& a, const std::vector<Rollout>& b) {
  int count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    count += same_bits(a[i].state, b[i].state) && same_bits(a[i].effort, b[i].effort) ? 0 : 1;
  }
  return count;
}

// The push with walls and a loose block about, so that there are many contacts to order.
inline Scene crowded_push() {
  Scene scene = push_scene();
  scene.add_body(fixed("wall", Box{{3.0, 0.2, 0.2}}, {1.0, 0.9, 0.1}));
  scene.add_body(body("loose", brick({0.2, 0.2, 0.2}), 0.5, {0.5, 0.7, 0.1}));
  return scene;
}

// A bar of two hulls off its frame, an angle of boxes and a bowl, pushed about together on a table made of two plates.
inline Scene compounds() {
  Scene scene;
  scene.add_body(fixed("ground", Plane{Vector3::UnitZ(), -0.1}));
  scene.add_body(fixed("table", Compound{{{Box{{1.0, 2.0, 0.1}}, {{0.5, 0.0, -0.05}}},
                                          {brick({1.0, 2.0, 0.1}), {{-0.5, 0.0, -0.05}}}}}));
  const Quaternion none = Quaternion::Identity();
  scene.add_body(body("bar",
                      Compound{{{brick({0.1, 0.1, 0.06}, none, {0.05, 0.0, 0.03})},
                                {brick({0.1, 0.1, 0.06}, none, {0.15, 0.0, 0.03})}}},
                      0.3, {0.02, 0.0, 0.0}, Role::object, 0.3));
  scene.add_body(body(
      "angle", Compound{{{Box{{0.15, 0.05, 0.05}}, {{0.05, 0.0, 0.025}}}, {Box{{0.05, 0.05, 0.1}}, {{0.0, 0.0, 0.1}}}}},
      0.3, {0.05, 0.1, 0.0}, Role::object, 0.3));
  scene.add_body(body("bowl",
                      Compound{{{Box{{0.2, 0.2, 0.01}}, {{0.0, 0.0, 0.005}}},
                                {Box{{0.01, 0.2, 0.1}}, {{0.095, 0.0, 0.06}}},
                                {Box{{0.01, 0.2, 0.1}}, {{-0.095, 0.0, 0.06}}},
                                {Box{{0.18, 0.01, 0.1}}, {{0.0, 0.095, 0.06}}},
                                {Box{{0.18, 0.01, 0.1}}, {{0.0, -0.095, 0.06}}}}},
                      0.3, {-0.12, 0.02, 0.0}, Role::none, 0.3));
  scene.add_body(body("ball", Sphere{0.03}, 0.1, {-0.12, 0.02, 0.041}, Role::object, 0.3));
  return scene;
}

// The hand with fingers of which the middle joints are followed by the last ones.
inline Scene coupled_hand() {
  const Scene plain = hand();
  Scene scene(plain.gravity(), plain.stepping());
  for (const Body& made : plain.bodies()) scene.add_body(made);
  for (Joint made : plain.joints()) {
    if (made.name == "left 3" || made.name == "right 3") {
      const std::string knuckle = made.name.substr(0, made.name.size() - 1) + "2";
      made.mimic = Mimic{knuckle, 0.5, -0.2 + 0.5 * 0.7};
      static_cast<PositionControl&>(made) = {};
      made.lower = -infinity;
      made.upper = infinity;
      made.state = {};
    }
    scene.add_joint(made);
  }
  return scene;
}

}  // namespace energymargin::scenes
