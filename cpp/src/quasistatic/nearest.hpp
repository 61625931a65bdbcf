#pragma once
// Nearest neighbours among poses, exactly, and of equally near ones the one added first. OMPL's trees find any of them:
// their pivots come from a global seed. Poses side by side in memory make the plain way through all of them as fast.

#include <ompl/datastructures/NearestNeighbors.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "quasistatic/pose_space.hpp"

namespace energymargin::quasistatic {

//! `Element` is a planner's pointer to something with a `state` or a `state()`.
template <typename Element>
class Nearest : public ompl::NearestNeighbors<Element> {
 public:
  bool reportsSortedResults() const override { return true; }
  std::size_t size() const override { return elements_.size(); }
  void list(std::vector<Element>& all) const override { all = elements_; }

  void clear() override {
    elements_.clear();
    poses_.clear();
  }

  using ompl::NearestNeighbors<Element>::add;
  void add(const Element& element) override {
    elements_.push_back(element);
    poses_.push_back(pose_of(state_of(element)));
  }

  bool remove(const Element& element) override {
    const auto place = std::find(elements_.begin(), elements_.end(), element);
    if (place == elements_.end()) return false;
    poses_.erase(poses_.begin() + (place - elements_.begin()));
    elements_.erase(place);
    return true;
  }

  Element nearest(const Element& element) const override {
    std::vector<Element> first;
    nearestK(element, 1, first);
    return first.front();
  }

  void nearestK(const Element& element, std::size_t count, std::vector<Element>& neighbors) const override {
    rank(element);
    count = std::min(count, ranking_.size());
    std::partial_sort(ranking_.begin(), ranking_.begin() + static_cast<std::ptrdiff_t>(count), ranking_.end());
    ranking_.resize(count);
    copy_ranking(neighbors);
  }

  void nearestR(const Element& element, double radius, std::vector<Element>& neighbors) const override {
    rank(element);
    const auto is_far = [radius](const auto& entry) { return entry.first > radius; };
    ranking_.erase(std::remove_if(ranking_.begin(), ranking_.end(), is_far), ranking_.end());
    std::sort(ranking_.begin(), ranking_.end());
    copy_ranking(neighbors);
  }

 private:
  template <typename Pointer>
  static auto state_of(const Pointer& element) -> decltype(element->state()) {
    return element->state();
  }
  template <typename Pointer>
  static auto state_of(const Pointer& element) -> decltype(element->state) {
    return element->state;
  }

  void rank(const Element& element) const {
    const auto* state = static_cast<const ompl::base::State*>(state_of(element))->as<PoseSpace::StateType>();
    ranking_.clear();
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      ranking_.emplace_back(state->space->distance(state->pose, poses_[i]), i);
    }
  }

  void copy_ranking(std::vector<Element>& neighbors) const {
    neighbors.clear();
    for (const auto& entry : ranking_) neighbors.push_back(elements_[entry.second]);
  }

  std::vector<Element> elements_;
  std::vector<Pose> poses_;
  mutable std::vector<std::pair<double, std::size_t>> ranking_;
};

}  // namespace energymargin::quasistatic
