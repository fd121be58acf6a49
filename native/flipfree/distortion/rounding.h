// From 64-bit UVs to the 32-bit ones that are stored, without losing what the certificate promises.
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/base/types.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/minimize/minimize.h"
#include "flipfree/distortion/minimize/newton_system.h"

namespace flipfree::distortion {

// Moves rounded points apart where rounding has folded triangles, or made the boundary meet itself:
// on 32-bit floats and on a grid whose seams stay exact (seams/seams.h).

// Where points may lie, and which of them move together.
struct PointRules {
  double grain = 0;  // coordinates are its multiples, a power of two; 0: they are 32-bit floats
  double largest = std::numeric_limits<float>::max();  // size of a coordinate
  // Per vertex the one that it moves with, itself as a rule, and kInvalid if it never moves; it
  // moves by R^turns times what that one does.
  std::vector<VertexId> leader;
  std::vector<Index> turns;  // empty: 0
  enum Axis : char { kBoth, kFirst, kSecond };
  std::vector<char> axis;  // along which leaders move; empty: both
  bool bijective = false;  // the boundary may not meet itself
  std::string where;       // "when ... avoid it.", with the cure: ends the text of a failure
};

// Finds the steps of a part of a map, some faces with the numbers of its vertices, of which those
// `held` (#V) stay.
using PartSystem = std::function<std::unique_ptr<StepSystem>(const Triangles& part,
                                                             const std::vector<char>& held)>;

// Opens crowded triangles, those of which all vertices are marked (#V), towards equilateral ones of
// one size. A valid map all the time, so that a cluster of any depth can be opened, unlike by moves
// of single points.
void open_crowd(const Triangles& faces, const std::vector<char>& marked, std::vector<char> held,
                const PartSystem& system_of, Points2& uv, ExecutionContext& context);

// The nearest points of a map that the rules allow; may move and scale the map, and set the grain.
using RoundPoints = std::function<Points2(Points2& wide)>;
// Opens crowded triangles of the map in 64 bits, whose vertices are all marked; `everything`: so is
// all that hangs together with them. Throws NotConverged if it cannot.
using OpenRegion =
    std::function<void(const std::vector<char>& marked, bool everything, Points2& wide)>;

struct RepairedPoints {
  Points2 points;
  std::vector<char> moved;  // per vertex: is not at its nearest point
  Index folded = 0;         // triangles that plain rounding folds
};

// `wide` (#V x 2) is flip-free, and does not meet its boundary if the rules ask for it. Single
// points at fault are moved, no further than it takes; where that does not do, their surroundings
// are opened in 64 bits, over a region that grows as far as it must, and all is rounded anew. At
// last what was moved goes where the distortion against `wide` is least. Guarantee: every triangle
// is positively oriented, exactly. Throws NotConverged (kRoundingFlips) naming the faces. Cost:
// O(#F), plus the repairs.
RepairedPoints round_and_repair(const Triangles& faces, const PointRules& rules, Points2& wide,
                                const RoundPoints& round, const OpenRegion& open,
                                const ExecutionContext& context);

// The first step alone: false if not every fault of `points` could be mended so.
bool repair_points(const Triangles& faces, const PointRules& rules, Points2& points,
                   const ExecutionContext& context);

struct RoundingOptions {
  // Vertices that are rounded to nearest and then never moved (pins). Their 64-bit values are
  // expected to be 32-bit numbers already.
  std::vector<VertexId> fixed;
  // The boundary may not meet itself. Precondition: it does not before rounding.
  bool bijective = false;
};

// uv: #V x 2, every triangle positively oriented by the exact test. Every value is rounded to
// nearest; where that flips or collapses a triangle (or makes the boundary meet itself) the
// vertices around are moved to other 32-bit points, over a region that grows as far as it must.
// Guarantee: every triangle is positively oriented, exactly, on the values returned; fixed vertices
// are at their rounded places. stats: "rounding.repaired" counts the vertices that are not at their
// nearest 32-bit point. Throws NotConverged (kRoundingFlips) naming the faces if no such values
// were found: the map needs more than 24 bits. Cost: O(#F), plus the repairs.
Points2f round_to_storage(const Triangles& faces, const Points2& uv, const RoundingOptions& options,
                          ExecutionContext& context, Stats& stats);

}  // namespace flipfree::distortion
