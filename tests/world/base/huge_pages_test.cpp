#include "world/base/huge_pages.h"

#include <cstdint>
#include <cstring>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "world/base/jobs.h"

namespace world {
namespace {

constexpr size_t kBytes = 2048, kInASlab = HugePageRecords::kSlabBytes / kBytes - 1;

TEST(HugePages, RecordsLieApartAndOnCacheLines) {
  HugePageRecords records(kBytes);
  std::set<uintptr_t> places;
  for (size_t n = 0; n < 3 * kInASlab; ++n) {
    void* record = records.take();
    std::memset(record, static_cast<int>(n), kBytes);
    places.insert(reinterpret_cast<uintptr_t>(record));
  }
  EXPECT_EQ(places.size(), 3 * kInASlab);
  EXPECT_EQ(records.slabs(), 3u);
  uintptr_t end = 0;
  for (const uintptr_t place : places) {
    EXPECT_EQ(place % 64, 0u);
    EXPECT_GE(place, end);
    end = place + kBytes;
  }
  for (const uintptr_t place : places) records.give_back(reinterpret_cast<void*>(place));
  EXPECT_EQ(records.slabs(), 1u);  // the others went back
}

TEST(HugePages, WhatCameBackIsTakenAgain) {
  HugePageRecords records(kBytes);
  std::vector<void*> all;
  for (size_t n = 0; n < 2 * kInASlab; ++n) all.push_back(records.take());
  void* one = all[5];
  records.give_back(one);
  EXPECT_EQ(records.take(), one);
  EXPECT_EQ(records.slabs(), 2u);
  for (void* record : all) records.give_back(record);
}

TEST(HugePages, ManyThreadsTakeAndGiveBack) {
  HugePageRecords records(kBytes);
  parallel_for(64, [&](size_t n) {
    std::vector<void*> own;
    for (size_t k = 0; k < 200; ++k) {
      own.push_back(records.take());
      std::memset(own.back(), static_cast<int>(n), kBytes);
      if (k % 3 == 0) records.give_back(own.back()), own.pop_back();
    }
    for (void* record : own) {
      EXPECT_EQ(static_cast<const uint8_t*>(record)[kBytes - 1], static_cast<uint8_t>(n));
      records.give_back(record);
    }
  });
  EXPECT_EQ(records.slabs(), 1u);
}

}  // namespace
}  // namespace world
