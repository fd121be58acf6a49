#include "flipfree/seamless/padding/topology/cone_subsets.h"

#include <algorithm>
#include <cstddef>

#include "flipfree/seamless/signature.h"

namespace flipfree::seamless {
namespace {

// How a sum was reached first.
struct Step {
  VertexId last = kInvalid;
  Index before = 0;  // the sum without it
};

}  // namespace

std::optional<std::vector<VertexId>> cones_with_excess(const std::vector<Index>& cones,
                                                       Index excess) {
  Index lowest = 0;
  Index highest = 0;
  for (const Index k : cones) (k < kFlat ? lowest : highest) += k - kFlat;
  if (excess < lowest || excess > highest) return std::nullopt;
  std::vector<Step> steps(static_cast<std::size_t>(highest - lowest + 1));
  const auto step = [&](Index sum) -> Step& {
    return steps[static_cast<std::size_t>(sum - lowest)];
  };
  std::vector<Index> sums = {0};
  for (VertexId v = 0; v < static_cast<VertexId>(cones.size()); ++v) {
    const Index more = cones[static_cast<std::size_t>(v)] - kFlat;
    if (more == 0) continue;
    // Sums that are new now have v last, so that no cone is taken twice.
    const std::size_t known = sums.size();
    for (std::size_t i = 0; i < known; ++i) {
      const Index sum = sums[i] + more;
      if (sum == 0 || step(sum).last != kInvalid) continue;
      step(sum) = {v, sums[i]};
      sums.push_back(sum);
    }
    if (step(excess).last != kInvalid) break;
  }
  if (step(excess).last == kInvalid) return std::nullopt;
  std::vector<VertexId> found;
  for (Index sum = excess; sum != 0; sum = step(sum).before) found.push_back(step(sum).last);
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace flipfree::seamless
