#include "world/base/unset.h"

#include <vector>

#include <gtest/gtest.h>

namespace world {

TEST(UnsetAllocator, LeavesElementsThatAreMadeOfNothingAsTheirMemoryIs) {
  std::vector<int, UnsetAllocator<int>> v(4, 7);
  v.resize(1);
  v.resize(4);  // in the same memory
  EXPECT_EQ(v, (std::vector<int, UnsetAllocator<int>>{7, 7, 7, 7}));
}

TEST(UnsetAllocator, SetsThoseThatAreMadeOfSomething) {
  std::vector<int, UnsetAllocator<int>> v(2, 7);
  v.resize(1);
  v.resize(2, 0);
  v.push_back(5);
  v.insert(v.begin(), {1, 2});
  const auto copy = v;
  EXPECT_EQ(copy, (std::vector<int, UnsetAllocator<int>>{1, 2, 7, 0, 5}));
}

}  // namespace world
