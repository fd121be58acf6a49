#include "flipfree/seamless/padding/reroute/turn_changes.h"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <numeric>

#include "flipfree/base/error.h"
#include "flipfree/seamless/signature.h"

namespace flipfree::seamless {

Index least_change(const std::vector<Index>& cones) {
  Index divisor = 0;
  for (const Index k : cones) divisor = std::gcd(divisor, k - kFlat);
  return divisor;
}

std::set<Index> next_changes(const std::vector<Index>& cones, Index wanted) {
  std::set<Index> changes;
  for (const Index k : cones) {
    if (k != kFlat) changes.insert({k - kFlat, kFlat - k});
  }
  if (changes.empty()) throw InternalError("no cone to go around");
  // In a good order no sum is farther from 0 and `wanted` than the largest change.
  const Index most = std::abs(wanted) + *changes.rbegin();
  const auto slot = [most](Index sum) { return static_cast<std::size_t>(sum + most); };
  std::vector<Index> terms(2 * static_cast<std::size_t>(most) + 1, kInvalid);  // per sum, fewest
  terms[slot(0)] = 0;
  std::vector<Index> sums = {0};
  for (std::size_t i = 0; i < sums.size() && terms[slot(wanted)] == kInvalid; ++i) {
    for (const Index change : changes) {
      const Index sum = sums[i] + change;
      if (std::abs(sum) > most || terms[slot(sum)] != kInvalid) continue;
      terms[slot(sum)] = terms[slot(sums[i])] + 1;
      sums.push_back(sum);
    }
  }
  if (terms[slot(wanted)] == kInvalid) throw InternalError("no sum of changes is the wanted one");
  std::set<Index> next;
  for (const Index change : changes) {
    const Index rest = wanted - change;
    if (std::abs(rest) <= most && terms[slot(rest)] == terms[slot(wanted)] - 1) next.insert(change);
  }
  return next;
}

}  // namespace flipfree::seamless
