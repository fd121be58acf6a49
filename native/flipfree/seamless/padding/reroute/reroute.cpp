#include "flipfree/seamless/padding/reroute/reroute.h"

#include <cstdlib>
#include <limits>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/seamless/padding/reroute/detours.h"
#include "flipfree/seamless/padding/reroute/turn_changes.h"

namespace flipfree::seamless {
namespace {

constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

// By how much each loop is asked to turn now.
std::vector<Index> wished_turns(const Canvas& canvas, const mesh::Adjacency& input_adjacency,
                                const BranchGraph& graph, const std::vector<BranchLoop>& loops,
                                const LoopTurning& turning) {
  std::vector<Index> turns;
  for (const BranchLoop& loop : loops)
    turns.push_back(turning(strip_on_input(canvas, input_adjacency, graph, loop)));
  return turns;
}

// By how much more it must be asked to turn, so that it is by what it will.
std::vector<Index> changes(const BranchGraph& graph, const std::vector<BranchLoop>& loops,
                           const std::vector<Index>& wished, const Ending& ending) {
  std::vector<Index> changes;
  for (std::size_t i = 0; i < loops.size(); ++i)
    changes.push_back(turn_to_come(graph, loops[i], ending) - wished[i]);
  return changes;
}

// All of them, or -1 if one cannot be reached.
Index quarters_off(const std::vector<Index>& changes, Index least) {
  Index sum = 0;
  for (const Index change : changes) {
    if (change != 0 && (least == 0 || change % least != 0)) return -1;
    sum += std::abs(change);
  }
  return sum;
}

// Changes what one branch is asked for; false if the shortest detour was not enough.
bool reroute_branch(Canvas& canvas, const std::vector<Index>& cones, Index change, Index most_added,
                    std::vector<VertexId>& branch, const ExecutionContext& context) {
  for (bool first = true;; first = false) {
    context.check();
    if (canvas.vertex_count() - static_cast<Index>(cones.size()) > most_added) {
      throw_not_converged(
          ErrorCode::kIterationLimit,
          "The branches of the cut wind around the cones so often that it has more than " +
              std::to_string(most_added) +
              " vertices more than the surface. Take a field that turns less along the handles, or "
              "with more cones.");
    }
    if (auto shortest = draw_shortest_detour(canvas, branch, change, context)) {
      branch = std::move(*shortest);
      return first;
    }
    Detour detour = draw_detour_around_cone(canvas, branch, next_changes(cones, change), context);
    branch = std::move(detour.branch);
    change -= detour.change;
    if (change == 0) return false;
  }
}

}  // namespace

Reroutings& Reroutings::operator+=(const Reroutings& other) {
  loops += other.loops;
  shortest += other.shortest;
  fallback += other.fallback;
  quarters += other.quarters;
  straight += other.straight;
  return *this;
}

std::size_t reroute(Canvas& canvas, const mesh::Surface& input, const std::vector<Index>& cones,
                    const std::vector<Ending>& endings, const WishedTurns& wished,
                    BranchGraph& graph, const ExecutionContext& context) {
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(input.vertices.rows()), input.faces);
  const std::vector<BranchLoop> loops = homology_loops(graph);
  const std::vector<Index> turns = wished_turns(canvas, adjacency, graph, loops, wished.turning);
  const Index least = least_change(cones);
  std::size_t best = kNone;
  Index fewest = 0;
  for (std::size_t i = 0; i < endings.size(); ++i) {
    const Index off = quarters_off(changes(graph, loops, turns, endings[i]), least);
    if (off < 0 || (best != kNone && off >= fewest)) continue;
    best = i;
    fewest = off;
  }
  if (best == kNone) {
    throw_not_converged(
        ErrorCode::kBadAngles,
        "The cut cannot turn as the map shall: going around the cones changes its turns by "
        "multiples of " +
            std::to_string(least) +
            " quarters only. Take the engine \"penner\", or a field with one cone more of index "
            "+-1/4.");
  }
  const std::vector<Index> change = changes(graph, loops, turns, endings[best]);
  Reroutings done;
  done.loops = static_cast<Index>(loops.size());
  done.quarters = fewest;
  for (std::size_t i = 0; i < loops.size(); ++i) {
    if (change[i] == 0) continue;
    std::vector<VertexId>& branch =
        graph.branches[static_cast<std::size_t>(loops[i].front() / 2)].vertices;
    const bool by_detour =
        reroute_branch(canvas, cones, change[i], wished.most_added, branch, context);
    ++(by_detour ? done.shortest : done.fallback);
  }
  divide_branches(canvas, graph);
  const std::vector<Index> now = wished_turns(canvas, adjacency, graph, loops, wished.turning);
  for (const Index off : changes(graph, loops, now, endings[best])) {
    if (off != 0) throw InternalError("a rerouted cut that does not turn as it was wished");
  }
  if (wished.done != nullptr) *wished.done += done;
  return best;
}

}  // namespace flipfree::seamless
