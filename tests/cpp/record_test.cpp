// Forms of fields, by which values are checked.

#include "base/record.hpp"

#include <gtest/gtest.h>

#include <string>

namespace energymargin {
namespace {

TEST(Form, IsTheSameWhereverItsWordsStand) {
  const std::string elsewhere = "positive";
  EXPECT_TRUE(Form{elsewhere.c_str()} == forms::positive);
  EXPECT_FALSE(Form{elsewhere.c_str()} == forms::not_negative);
  EXPECT_FALSE(forms::any == forms::positive);
}

}  // namespace
}  // namespace energymargin
