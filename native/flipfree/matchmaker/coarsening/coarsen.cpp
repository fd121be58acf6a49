#include "flipfree/matchmaker/coarsening/coarsen.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/failure.h"
#include "flipfree/distortion/untangle.h"
#include "flipfree/matchmaker/coarsening/relax.h"
#include "flipfree/matchmaker/coarsening/remove_vertex.h"
#include "flipfree/mesh/refined/refined_surface.h"

namespace flipfree::matchmaker {
namespace {

// Takes refinement back by making room for the input's faces: the energy of the split ones, as they
// would be whole, is lowered until they are positive (untangle.h), while the map itself, as it is
// split, stays valid behind a barrier.
//
// Untangling the whole faces alone succeeds as often, but then vertices wind twice; here they can
// only be taken whole where removing a vertex leaves a valid map (remove_vertex.h).

constexpr int kUnfoldingRounds = 6;
// Newton steps of a round, and without progress; and of the energy after it.
constexpr int kUnfoldingSteps = 30;
constexpr int kUnfoldingPatience = 10;
constexpr int kStepsAfterUnfolding = 5;
// Vertices move within so many rings around split faces.
constexpr int kRingsAroundSplits = 6;
// Lower values force more faces to be whole, but squeeze what is around those that can't be.
constexpr double kLeastEpsilon = 1e-3;
// Of the faces that are to be taken back: they hold the map, but not its shape.
constexpr double kPieceWeight = 0.01;

// The neighbourhood of the split input faces: the map's faces there, those of split faces with
// little weight, and after them the split faces as they would be whole.
struct Neighbourhood {
  Patch patch;
  std::vector<FaceId> faces;  // of the map: the first of the patch, in this order
  std::vector<double> weights;
  std::vector<char> fixed;  // per vertex of the patch
};

Neighbourhood around_splits(const mesh::RefinedMap& map, const std::vector<VertexId>& held,
                            Index keep) {
  const mesh::EditableTriangulation& mesh = map.surface.mesh;
  std::vector<VertexId> seeds;
  for (VertexId v = keep; v < mesh.vertex_count(); ++v) seeds.push_back(v);
  std::vector<FaceId> split;  // input faces
  for (const FaceId f : faces_at(mesh, seeds)) split.push_back(mesh.parent(f));
  sort_unique(split);
  const std::vector<VertexId> near = vertices_near(mesh, std::move(seeds), kRingsAroundSplits + 1);
  Neighbourhood all;
  all.faces = faces_at(mesh, near);
  std::vector<mesh::EditableTriangulation::Triangle> triangles;
  for (const FaceId f : all.faces) {
    triangles.push_back(mesh.corners(f));
    const bool part = std::binary_search(split.begin(), split.end(), mesh.parent(f));
    all.weights.push_back(part ? kPieceWeight : 1.0);
  }
  const Triangles& input = map.surface.input->faces;
  for (const FaceId f : split) {
    triangles.push_back({input(f, 0), input(f, 1), input(f, 2)});
    all.weights.push_back(1.0);
  }
  all.patch = make_patch(map, triangles);
  std::vector<VertexId> stay = held;
  std::sort(stay.begin(), stay.end());
  for (const VertexId v : all.patch.vertices) {
    const bool moves = std::binary_search(near.begin(), near.end(), v) &&
                       !std::binary_search(stay.begin(), stay.end(), v);
    all.fixed.push_back(moves ? 0 : 1);
  }
  return all;
}

// Makes room for the split faces; false if there is none, and the map is as before.
bool make_room_for_wholes(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
                          ExecutionContext& context) {
  const Neighbourhood all = around_splits(map, held, keep);
  const Patch& patch = all.patch;
  distortion::UntangleOptions options;
  options.max_iterations = kUnfoldingSteps;
  options.patience = kUnfoldingPatience;
  options.least_epsilon = kLeastEpsilon;
  options.guards = static_cast<Index>(all.faces.size());
  options.weights = &all.weights;
  const Points2 uv =
      distortion::Untangler(patch.surface, all.fixed, context).run(patch.uv, options, context).uv;
  // Long steps between valid maps may pass through others.
  const Triangles valid = patch.surface.faces.triangles().topRows(options.guards);
  if (winds_more(map, patch.vertices, valid, uv, all.faces)) return false;
  for (std::size_t i = 0; i < patch.vertices.size(); ++i)
    map.uv.row(patch.vertices[i]) = uv.row(static_cast<Eigen::Index>(i));
  return true;
}

// `held`: vertices that do not move. Precondition: map.uv is flip-free, inner vertices wind once.
// Guarantee: so it is afterwards, vertices below `keep` are there still. Cost: at most six times
// some thirty-five Newton steps near split faces.
void unfold_wholes(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
                   ExecutionContext& context) {
  for (int round = 0; round < kUnfoldingRounds && map.surface.mesh.vertex_count() > keep; ++round) {
    const Points2 valid = map.uv;
    const Index there = map.surface.mesh.vertex_count();
    const std::vector<VertexId> seeds = beside_added(map.surface.mesh, keep);
    if (!make_room_for_wholes(map, held, keep, context) ||
        thin_out(map, held, keep, context) == 0) {
      // What had to give way for nothing goes back.
      if (map.surface.mesh.vertex_count() == there) map.uv = valid;
      return;
    }
    if (!relax_near_added(map, seeds, keep, held, kStepsAfterUnfolding, context)) return;
  }
}

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
      : map_(map), held_(held), keep_(keep), context_(context) {}

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
    return relax_near_added(map_, seeds, keep_, held_, steps, context_);
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
      unfold_wholes(map_, held_, keep_, context_);
    }
  }

  void untangle() {
    int rings = 1;
    for (int round = 0; round < kUntanglingRounds && added() > 0; ++round) {
      const double share = 1.0 / kUntanglingRounds;
      const ProgressRange range(context_, round * share, (round + 1) * share);
      const Index before = added();
      const std::vector<VertexId> seeds = beside();
      remove_by_untangling(map_, held_, keep_, rings, context_);
      map_ = mesh::compacted_map(map_);
      relaxed(seeds, kStepsOfUntangling);
      thin_out(map_, held_, keep_, context_);
      if (kWorthwhileUntangling[at(rings - 1)] * (before - added()) >= before) continue;
      if (at(rings) == kWorthwhileUntangling.size()) return;
      ++rings;
    }
  }

  mesh::RefinedMap& map_;
  const std::vector<VertexId>& held_;
  Index keep_;
  ExecutionContext& context_;
};

}  // namespace

void coarsen(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
             const CoarsenOptions& options, ExecutionContext& context, Stats& stats) {
  if (ended_in_time([&] { Coarsener(map, held, keep, context).run(options); })) return;
  map = mesh::compacted_map(map);  // valid after every step, but of vertices that are gone
  note_time_limit(stats);
}

}  // namespace flipfree::matchmaker
