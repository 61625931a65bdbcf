#pragma once
// Linear equations whose matrix is zero outside of an envelope around its diagonal.

#include <cstddef>
#include <utility>
#include <vector>

namespace energymargin {

//! Most movers are free bodies, for which loops of a known length are twice as fast.
inline constexpr int usual_count = 6;

//! LU factors of a matrix with a symmetric pattern, without pivots: it is an inertia and what constraints add to it.
//! Row i has entries from column first[i] on; the factors stay within the envelope of these rows and of the same
//! columns (George and Liu 1981, chapter 4).
class EnvelopeLu {
 public:
  //! Sets the pattern, and all entries to zero. first[i] <= i.
  void reset(const std::vector<int>& first);

  //! Entry (i, j) is row(i)[j].
  double* row(int i) { return values_.data() + begins_[static_cast<std::size_t>(i)]; }
  const double* row(int i) const { return values_.data() + begins_[static_cast<std::size_t>(i)]; }

  //! From row i to the next one, where both begin and end at the same columns.
  std::ptrdiff_t stride(int i) const {
    return last_[static_cast<std::size_t>(i)] - first_[static_cast<std::size_t>(i)] + 1;
  }

  //! Puts the factors in the place of the entries. False where a pivot is next to nothing: the factors are of no use.
  bool factor();

  //! Replaces the right-hand side by the solution.
  void solve(double* x) const;

 private:
  void set_pattern(const std::vector<int>& first);
  int end_of_block(int begin) const;
  template <int... Rows>
  bool factor_block(int begin, std::integer_sequence<int, Rows...>);

  std::vector<double> values_, inverses_;  // entries or factors, and 1 / pivots
  std::vector<std::ptrdiff_t> begins_;     // of the rows, as if they had a column 0
  std::vector<int> first_, last_;          // columns of each row
  std::vector<char> starts_;               // whether a row's columns start there
};

}  // namespace energymargin
