#include "demslam/graph/shared_history.h"

#include <gtest/gtest.h>

namespace demslam {
namespace {

SharedHistory<int, 4> counted(int size) {
  SharedHistory<int, 4> history;
  for (int n = 0; n < size; ++n) history.push_back(n);
  return history;
}

TEST(SharedHistory, HoldsWhatWasPushed) {
  const auto history = counted(11);
  ASSERT_EQ(history.size(), 11U);
  for (std::size_t n = 0; n < history.size(); ++n) EXPECT_EQ(history[n], static_cast<int>(n));
  EXPECT_EQ(history.back(), 10);
}

TEST(SharedHistory, ACopySeesNothingOfWhatComesLaterAndSharesWhatIsFull) {
  for (const int size : {0, 3, 4, 5, 8}) {
    SharedHistory<int, 4> history = counted(size);
    const SharedHistory<int, 4> copy = history;
    if (size > 0) history.back() = 100;
    history.push_back(200);
    ASSERT_EQ(copy.size(), static_cast<std::size_t>(size));
    for (int n = 0; n < size; ++n) EXPECT_EQ(copy[static_cast<std::size_t>(n)], n);
    if (size > 4) {
      EXPECT_EQ(&copy[0], &history[0]);
    }
  }
}

}  // namespace
}  // namespace demslam
