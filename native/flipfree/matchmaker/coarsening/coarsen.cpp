#include "flipfree/matchmaker/coarsening/coarsen.h"

#include <array>
#include <cstddef>
#include <utility>

#include "flipfree/base/failure.h"
#include "flipfree/matchmaker/coarsening/relax.h"
#include "flipfree/matchmaker/coarsening/remove_vertex.h"
#include "flipfree/matchmaker/coarsening/unfold_wholes.h"
#include "flipfree/matchmaker/coarsening/untangle_removal.h"

namespace flipfree::matchmaker {
namespace {

// Plain removals: rounds at most, and Newton steps after each; one that removes less than this
// share (in per cent) is the last.
constexpr int kRounds = 12;
constexpr int kStepsOfRound = 8;
constexpr Index kWorthwhile = 2;
// Untangling: rounds at most, and Newton steps after each. One that frees less than one vertex in
// so many (with neighbourhoods of one ring, of two) is followed by larger neighbourhoods.
constexpr int kUntanglingRounds = 12;
constexpr int kStepsOfUntangling = 20;
constexpr std::array<Index, 2> kWorthwhileUntangling = {7, 12};

// Unfolding: so often, after so many Newton steps each.
constexpr int kUnfoldings = 2;
constexpr int kStepsOfUnfolding = 30;

class Coarsener {
 public:
  Coarsener(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
            ExecutionContext& context)
      : map_(map), held_(held), keep_(keep), context_(context), order_(keep) {}

  void run(const CoarsenOptions& options) {
    {
      const ProgressRange range(context_, 0.0, 0.5);
      remove_plainly();
    }
    const ProgressRange rest(context_, 0.5, 1.0);
    if (added() > options.most_untangled * keep_) return;
    if (options.unfold) unfold();
    untangle();
  }

 private:
  Index added() const { return map_.surface.mesh.vertex_count() - keep_; }

  std::vector<VertexId> beside() const { return beside_added(map_.surface.mesh, keep_); }

  // Near these and what is added still. False when the map is too squeezed; what is removed is
  // removed.
  bool relaxed(const std::vector<VertexId>& seeds, int steps) {
    return relax_near_added(map_, seeds, keep_, held_, {steps, true, &order_}, context_);
  }

  void remove_plainly() {
    for (int round = 0; round < kRounds && added() > 0; ++round) {
      const double share = 1.0 / kRounds;
      const ProgressRange range(context_, round * share, (round + 1) * share);
      context_.report("taking refinement back", 0.0);
      const Index before = added();
      const std::vector<VertexId> seeds = beside();
      const Index removed = thin_out(map_, held_, keep_, context_);
      if (removed == 0 || !relaxed(seeds, kStepsOfRound) || 100 * removed < kWorthwhile * before)
        return;
    }
  }

  void unfold() {
    for (int i = 0; i < kUnfoldings && added() > 0; ++i) {
      relaxed(beside(), kStepsOfUnfolding);
      unfold_wholes(map_, held_, keep_, context_, order_);
    }
  }

  void untangle() {
    VainRemovals vain;
    UntangleRemovalOptions options;
    options.rings = 1;
    options.iterations = kThoroughIterations;
    options.vain = &vain;
    for (int round = 0; round < kUntanglingRounds && added() > 0; ++round) {
      const double share = 1.0 / kUntanglingRounds;
      const ProgressRange range(context_, round * share, (round + 1) * share);
      const Index before = added();
      const std::vector<VertexId> seeds = beside();
      remove_by_untangling(map_, held_, keep_, context_, options);
      map_ = mesh::compacted_map(map_);
      relaxed(seeds, kStepsOfUntangling);
      thin_out(map_, held_, keep_, context_);
      const auto size = static_cast<std::size_t>(options.rings);
      if (kWorthwhileUntangling[size - 1] * (before - added()) >= before) continue;
      if (size == kWorthwhileUntangling.size()) return;
      ++options.rings;
    }
  }

  mesh::RefinedMap& map_;
  const std::vector<VertexId>& held_;
  Index keep_;
  ExecutionContext& context_;
  numeric::EliminationMemory order_;
};

}  // namespace

void coarsen(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
             const CoarsenOptions& options, ExecutionContext& context, Stats& stats) {
  if (ended_in_time([&] { Coarsener(map, held, keep, context).run(options); })) return;
  map = mesh::compacted_map(map);  // valid after every step, but of vertices that are gone
  note_time_limit(stats);
}

}  // namespace flipfree::matchmaker
