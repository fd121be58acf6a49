// Named figures that a result carries: seconds per stage, iterations, counts, the rung that was
// used.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <string>

#include "flipfree/base/variant.h"

namespace flipfree {

using StatValue = Variant<double, std::int64_t, std::string>;
using Stats = std::map<std::string, StatValue>;

// Whoever worked on the result had to stop because time was over, or it was accepted.
inline void note_time_limit(Stats& stats) { stats["time_limit_reached"] = std::int64_t{1}; }

// Wall-clock seconds since construction or the last restart.
class Stopwatch {
 public:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }
  void restart() { start_ = std::chrono::steady_clock::now(); }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace flipfree
