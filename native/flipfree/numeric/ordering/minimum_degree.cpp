#include "flipfree/numeric/ordering/minimum_degree.h"

#include <bit>

namespace flipfree::numeric {
std::vector<Index> minimum_degree(std::vector<std::uint64_t>& near,
                                  const std::vector<Index>& outside) {
  const auto count = static_cast<Index>(near.size());
  std::vector<Index> order;
  order.reserve(near.size());
  std::uint64_t left = count == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << count) - 1;
  while (left != 0) {
    Index best = kInvalid;
    Index best_degree = 0;
    for (std::uint64_t set = left; set != 0; set &= set - 1) {
      const Index v = std::countr_zero(set);
      const Index degree = std::popcount(near[at(v)]) + outside[at(v)];
      if (best == kInvalid || degree < best_degree) {
        best = v;
        best_degree = degree;
      }
    }
    order.push_back(best);
    left &= ~(std::uint64_t{1} << best);
    const std::uint64_t clique = near[at(best)];
    for (std::uint64_t set = clique; set != 0; set &= set - 1) {
      const Index u = std::countr_zero(set);
      near[at(u)] |= clique;
      near[at(u)] &= ~((std::uint64_t{1} << u) | (std::uint64_t{1} << best));
    }
  }
  return order;
}

}  // namespace flipfree::numeric
