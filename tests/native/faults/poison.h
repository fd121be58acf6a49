// Numerical steps that return NaN: the linker redirects the library's calls to them (--wrap, see
// CMakeLists.txt) to functions here, which call the step and spoil what it returns when asked to.
// The library itself knows nothing of it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace flipfree::test {

// Names of all steps that can be spoiled.
std::vector<std::string> poisoned_steps();

// While it lives, the step (its place in poisoned_steps()) spoils its result number `at` (from 1
// on, of all threads), and if `and_all_later` all later ones. at = 0: none. One at a time.
class Poison {
 public:
  Poison(std::size_t step, std::int64_t at, bool and_all_later);
  ~Poison();
  Poison(const Poison&) = delete;
  Poison& operator=(const Poison&) = delete;

  std::int64_t count() const;    // calls of the step
  std::int64_t spoiled() const;  // results that were spoiled
};

}  // namespace flipfree::test
