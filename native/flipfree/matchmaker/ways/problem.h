// What all ways to a map are given, and what they return.
#pragma once

#include <optional>
#include <string>

#include "flipfree/base/context.h"
#include "flipfree/matchmaker/homotopy/sheet_target.h"
#include "flipfree/matchmaker/patches/build_target.h"
#include "flipfree/matchmaker/request/options.h"
#include "flipfree/mesh/refined/refined_map.h"

namespace flipfree::matchmaker {

// The domains of a prescribed outline, each made once, when it is first asked for.
class Targets {
 public:
  // Both outlive this.
  Targets(const mesh::RefinedSurface& surface, const Constraints& constraints)
      : surface_(surface), constraints_(constraints) {}

  // full_target() and sheet_target() of surface and constraints, errors included.
  const Target& full(const ExecutionContext& context);
  const SheetTarget& sheets(const ExecutionContext& context);

 private:
  const mesh::RefinedSurface& surface_;
  const Constraints& constraints_;
  std::optional<Target> full_;
  std::optional<SheetTarget> sheets_;
};

struct Problem {
  const mesh::RefinedSurface& surface;  // with the vertices that the constraints need
  const Constraints& constraints;
  const MatchOptions& options;
  Targets& targets;

  // A target that overlaps itself: which disk, and on which sheet a pin lies, is for the homotopy
  // to say.
  bool overlapping() const { return !constraints.free_boundary() && !constraints.simple_outline; }
};

struct Solution {
  mesh::RefinedMap map;
  std::string engine;  // what really made it
  Index keep = 0;      // vertices that stay to the end: the surface's, and some splits
};

// Lines are edges still, none of which was split.
bool lines_are_whole(const mesh::RefinedSurface& surface, const Constraints& constraints);

}  // namespace flipfree::matchmaker
