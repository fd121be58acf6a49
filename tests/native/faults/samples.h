// Which of many places tests try, always the same ones.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <random>
#include <vector>

namespace flipfree::test {

// `standard` times the environment's FLIPFREE_FAULTS, a factor; without it `standard`.
inline int sample_count(int standard) {
  const char* factor = std::getenv("FLIPFREE_FAULTS");
  return factor == nullptr ? standard : static_cast<int>(standard * std::atof(factor));
}

// Numbers of [1, total], ascending: all if there are no more than `count`, else one at random of
// each of `count` equal parts.
inline std::vector<std::int64_t> spread(std::int64_t total, int count, unsigned seed = 1) {
  std::vector<std::int64_t> chosen;
  std::mt19937_64 random(seed);
  if (total <= count) count = static_cast<int>(total);
  for (int i = 0; i < count; ++i) {
    const std::int64_t begin = total * i / count;
    const std::int64_t end = total * (i + 1) / count;
    const auto width = static_cast<std::uint64_t>(end - begin);
    chosen.push_back(begin + 1 + static_cast<std::int64_t>(random() % width));
  }
  return chosen;
}

}  // namespace flipfree::test
