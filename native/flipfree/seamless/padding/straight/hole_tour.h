// The order of holes in a chain as a short tour (thesis 5.4.1 goes from nearest to nearest).
#pragma once

#include <vector>

#include "flipfree/base/context.h"

namespace flipfree::seamless {

// Holes 2 l and 2 l + 1 are partners.
constexpr Index partner_of(Index hole) { return hole ^ 1; }

// Are there partners with an odd number of holes between them, the ends aside? `order`: of all
// holes, its ends partners. Cost: O(holes).
bool has_odd_couple(const std::vector<Index>& order);

// All holes in an order whose ends are partners and, with odd_couple (three loops or more), in
// which two other partners have an odd number of holes between them; the sum of the costs from one
// to the next is as small as reversing parts (2-opt; Croes 1958), moving parts of up to three (Or
// 1976) and the choice of the ends make it within a budget. `cost`: symmetric. Deterministic. Cost:
// O(loops^3) mostly, at most a fixed number of trials or O(loops^2).
std::vector<Index> hole_tour(const std::vector<std::vector<double>>& cost, bool odd_couple,
                             const ExecutionContext& context);

// The sum of the costs along an order.
double tour_cost(const std::vector<std::vector<double>>& cost, const std::vector<Index>& order);

}  // namespace flipfree::seamless
