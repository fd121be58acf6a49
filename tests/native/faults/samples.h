// Which of many places tests try: a sample by FLIPFREE_SEED.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <random>
#include <vector>

namespace flipfree::test {

inline bool is_long_run() {
  const char* all = std::getenv("FLIPFREE_LONG");
  return all != nullptr && std::atoi(all) != 0;
}

// `whole` in a long run (FLIPFREE_LONG), else a quarter; FLIPFREE_FAULTS is another factor.
inline int sample_count(int whole) {
  if (const char* factor = std::getenv("FLIPFREE_FAULTS"))
    return static_cast<int>(whole * std::atof(factor));
  return is_long_run() ? whole : (whole + 3) / 4;
}

inline unsigned sample_seed() {
  const char* seed = std::getenv("FLIPFREE_SEED");
  return seed == nullptr ? 1 : static_cast<unsigned>(std::atol(seed));
}

// Numbers of [1, total], ascending: all if there are no more than `count`, else one at random of
// each of `count` equal parts.
inline std::vector<std::int64_t> spread(std::int64_t total, int count,
                                        unsigned seed = sample_seed()) {
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
