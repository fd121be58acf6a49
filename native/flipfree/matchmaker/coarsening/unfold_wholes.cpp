#include "flipfree/matchmaker/coarsening/unfold_wholes.h"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "flipfree/distortion/untangle.h"
#include "flipfree/matchmaker/coarsening/relax.h"
#include "flipfree/matchmaker/coarsening/remove_vertex.h"

namespace flipfree::matchmaker {
namespace {

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
  std::sort(split.begin(), split.end());
  split.erase(std::unique(split.begin(), split.end()), split.end());
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
  const Triangles valid = patch.surface.faces.topRows(options.guards);
  if (winds_more(map, patch.vertices, valid, uv, all.faces)) return false;
  for (std::size_t i = 0; i < patch.vertices.size(); ++i)
    map.uv.row(patch.vertices[i]) = uv.row(static_cast<Eigen::Index>(i));
  return true;
}

}  // namespace

void unfold_wholes(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
                   ExecutionContext& context, numeric::EliminationMemory& order) {
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
    if (!relax_near_added(map, seeds, keep, held, {kStepsAfterUnfolding, false, &order}, context))
      return;
  }
}

}  // namespace flipfree::matchmaker
