#pragma once
// When a set is left for good.

namespace energymargin {

//! Outside at a check time, and at all that follow until `dwell` steps are over or the horizon has come.
class Exit {
 public:
  explicit Exit(int dwell) : dwell_(dwell) {}

  //! `step` is the check time.
  void check(bool inside, int step) {
    if (left_) return;
    if (inside) {
      since_ = -1;
    } else if (since_ < 0) {
      since_ = step;
    }
    left_ = since_ >= 0 && step - since_ >= dwell_;
  }

  //! The horizon has come: who is outside has left.
  void end() { left_ = since_ >= 0; }

  bool left() const { return left_; }

  //! The first check time outside, if it was the last one too, or if the set is left; else -1 [steps].
  int since() const { return since_; }

 private:
  int dwell_;
  int since_ = -1;
  bool left_ = false;
};

}  // namespace energymargin
