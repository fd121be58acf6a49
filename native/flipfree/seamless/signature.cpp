#include "flipfree/seamless/signature.h"

#include <algorithm>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/seamless/bordered/corners.h"

namespace flipfree::seamless {
namespace {

bool all_divided_by(Index m, const std::vector<Index>& turns) {
  return std::all_of(turns.begin(), turns.end(), [&](Index t) { return t % m == 0; });
}

}  // namespace

std::vector<Index> cone_list(const std::vector<Index>& cones) {
  std::vector<Index> list;
  for (const Index k : cones) {
    if (k != 4) list.push_back(k);
  }
  std::sort(list.begin(), list.end());
  return list;
}

void check_cones(const std::vector<Index>& cones, Index genus) {
  std::int64_t sum = 0;
  for (std::size_t v = 0; v < cones.size(); ++v) {
    if (cones[v] < 1) throw_too_sharp(static_cast<VertexId>(v), cones[v]);
    sum += 4 - cones[v];
  }
  const std::int64_t needed = 8 - 8 * std::int64_t{genus};
  if (sum == needed) return;
  const std::int64_t missing = sum - needed;
  throw_infeasible(ErrorCode::kGaussBonnet,
                   "The cones' curvatures 4 - k sum to " + std::to_string(sum) +
                       " quarter turns, but a closed surface of genus " + std::to_string(genus) +
                       " needs " + std::to_string(needed) + " (Gauss-Bonnet). " +
                       (missing > 0 ? "Add " + std::to_string(missing) + " to"
                                    : "Take " + std::to_string(-missing) + " from") +
                       " the sum of the cones' quarter turns k.",
                   {"angle sum",
                    {{"sum", {static_cast<double>(sum) * kQuarterTurn}},
                     {"needed", {static_cast<double>(needed) * kQuarterTurn}}}});
}

std::string why_impossible(const std::vector<Index>& cones, Index genus,
                           const std::vector<Index>& loop_turns) {
  const std::vector<Index> list = cone_list(cones);
  if (genus == 1 && list.empty()) {
    const bool none =
        std::all_of(loop_turns.begin(), loop_turns.end(), [](Index t) { return t == 0; });
    return none ? "" : "On a torus without cones no loop can turn.";
  }
  if (genus == 1 && list.size() == 2) {
    const Index m = list[1] - 4;
    if (!all_divided_by(m, loop_turns)) return "";
    if (m == 1) return "A torus cannot have the cones 3 and 5 alone.";
    return "A torus with the cones " + std::to_string(list[0]) + " and " + std::to_string(list[1]) +
           " alone has a loop whose quarter turns " + std::to_string(m) + " does not divide.";
  }
  if (genus == 2 && list == std::vector<Index>{12}) {
    if (!all_divided_by(2, loop_turns) || all_divided_by(4, loop_turns)) return "";
    return "A surface of genus 2 with one cone of 12 quarter turns cannot have loops that all turn "
           "by half turns.";
  }
  if (genus == 2 && list == std::vector<Index>{6, 10} && all_divided_by(2, loop_turns)) {
    return "A surface of genus 2 with the cones 6 and 10 cannot have loops that all turn by half "
           "turns.";
  }
  return "";
}

}  // namespace flipfree::seamless
