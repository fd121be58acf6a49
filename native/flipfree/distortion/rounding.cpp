#include "flipfree/distortion/rounding.h"

#include <algorithm>
#include <numeric>

#include "flipfree/base/plane.h"
#include "flipfree/distortion/point_repair.h"

namespace flipfree::distortion {

Points2f round_to_storage(const Triangles& faces, const Points2& uv, const RoundingOptions& options,
                          ExecutionContext& context, Stats& stats) {
  PointRules rules;
  rules.leader.resize(at(static_cast<Index>(uv.rows())));
  std::iota(rules.leader.begin(), rules.leader.end(), VertexId{0});
  for (const VertexId v : options.fixed) rules.leader[at(v)] = kInvalid;
  rules.bijective = options.bijective;
  rules.where =
      "when the map is rounded to the 32-bit values that are stored, and no 32-bit points near by "
      "avoid it. Cut the chart into smaller ones, or enlarge its smallest parts.";
  Points2 wide = uv;
  const RepairedPoints rounded = round_and_repair(
      faces, rules, wide, [](const Points2& map) { return as_stored(map); },
      [&](const std::vector<char>& marked, bool, Points2& map) {
        std::vector<char> held(marked.size(), 0);
        for (const VertexId v : options.fixed) held[at(v)] = 1;
        open_crowd(faces, marked, std::move(held), nullptr, map, context);
      },
      context);
  stats["rounding.repaired"] =
      std::int64_t{std::count(rounded.moved.begin(), rounded.moved.end(), char{1})};
  return rounded.points.cast<float>();
}

}  // namespace flipfree::distortion
