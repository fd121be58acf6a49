#include "flipfree/matchmaker/ways/problem.h"

#include <algorithm>

namespace flipfree::matchmaker {

const Target& Targets::full(const ExecutionContext& context) {
  if (!full_) full_ = full_target(surface_, constraints_, context);
  return *full_;
}

const SheetTarget& Targets::sheets(const ExecutionContext& context) {
  if (!sheets_) sheets_ = sheet_target(surface_, constraints_, context);
  return *sheets_;
}

bool lines_are_whole(const mesh::RefinedSurface& surface, const Constraints& constraints) {
  return std::all_of(constraints.edges.begin(), constraints.edges.end(), [&](const auto& edge) {
    return surface.mesh.find(edge.first, edge.second) != kInvalid;
  });
}

}  // namespace flipfree::matchmaker
