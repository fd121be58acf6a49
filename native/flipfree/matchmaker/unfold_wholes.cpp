#include "flipfree/matchmaker/unfold_wholes.h"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "flipfree/certify/winding.h"
#include "flipfree/matchmaker/coarsen.h"
#include "flipfree/matchmaker/first_try.h"
#include "flipfree/matchmaker/relax.h"
#include "flipfree/matchmaker/untangle.h"

namespace flipfree {
namespace {

// Newton steps of a round, and without progress; and of the whole map after it.
constexpr int kIterations = 30;
constexpr int kPatience = 10;
constexpr int kRelaxSteps = 5;
// Vertices move within so many rings around split faces.
constexpr int kRings = 6;
// Lower values force more faces to be whole, but squeeze what is around those that can't be.
constexpr double kLeastEpsilon = 1e-3;
// Of the faces that are to be taken back: they hold the map, but not its shape.
constexpr double kPieceWeight = 0.01;

// The neighbourhood of the split input faces: the map's faces there, those of split faces with
// little weight, and after them the split faces as they would be whole.
struct Neighbourhood {
  Surface surface;  // all vertices of the map, some of its faces
  std::vector<double> weights;
  std::vector<char> fixed;  // #V
  Index guards = 0;         // faces of the map
};

Neighbourhood around_splits(const RefinedMap& map, const std::vector<VertexId>& held) {
  const Triangles& input = map.surface.input->faces;
  std::vector<FaceId> slots;
  const Triangles faces = map.surface.mesh.faces(&slots);
  std::vector<Index> pieces(static_cast<std::size_t>(input.rows()), 0);
  const auto parent = [&](Eigen::Index f) {
    return static_cast<std::size_t>(map.surface.mesh.parent(slots[static_cast<std::size_t>(f)]));
  };
  for (Eigen::Index f = 0; f < faces.rows(); ++f) ++pieces[parent(f)];
  std::vector<char> near(map.surface.position.size(), 0);
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    if (pieces[parent(f)] <= 1) continue;
    for (Index k = 0; k < 3; ++k) near[static_cast<std::size_t>(faces(f, k))] = 1;
  }
  std::vector<Eigen::Index> inside;  // faces with a vertex that may move
  for (int ring = 0; ring <= kRings; ++ring) {
    std::vector<char> wider = near;
    inside.clear();
    for (Eigen::Index f = 0; f < faces.rows(); ++f) {
      const auto at = [&](Index k) { return static_cast<std::size_t>(faces(f, k)); };
      if (near[at(0)] == 0 && near[at(1)] == 0 && near[at(2)] == 0) continue;
      wider[at(0)] = wider[at(1)] = wider[at(2)] = 1;
      inside.push_back(f);
    }
    if (ring < kRings) near = std::move(wider);
  }
  Neighbourhood all;
  for (const char n : near) all.fixed.push_back(n == 0 ? 1 : 0);
  for (const VertexId v : held) all.fixed[static_cast<std::size_t>(v)] = 1;
  all.surface = to_surface(map.surface);
  all.guards = static_cast<Index>(inside.size());
  const auto wholes = std::count_if(pieces.begin(), pieces.end(), [](Index n) { return n > 1; });
  all.surface.faces.resize(all.guards + wholes, 3);
  Eigen::Index next = 0;
  for (const Eigen::Index f : inside) {
    all.surface.faces.row(next++) = faces.row(f);
    all.weights.push_back(pieces[parent(f)] > 1 ? kPieceWeight : 1.0);
  }
  for (FaceId f = 0; f < input.rows(); ++f) {
    if (pieces[static_cast<std::size_t>(f)] <= 1) continue;
    all.surface.faces.row(next++) = input.row(f);
    all.weights.push_back(1.0);
  }
  return all;
}

// Long steps between valid maps may pass through others.
bool winds_once(const RefinedMap& map) {
  const Triangles faces = map.surface.mesh.faces();
  const Adjacency adjacency = build_adjacency(map.surface.mesh.vertex_count(), faces);
  Points2 corner_uv(faces.size(), 2);
  for (CornerId c = 0; c < faces.size(); ++c) corner_uv.row(c) = map.uv.row(faces.data()[c]);
  const EdgeFlags no_cuts(static_cast<std::size_t>(faces.size()), 0);
  return winding_failures(adjacency, no_cuts, corner_uv).empty();
}

}  // namespace

Index unfold_wholes(RefinedMap& map, const std::vector<VertexId>& held, Index keep, int rounds,
                    ExecutionContext& context) {
  const Index before = map.surface.mesh.vertex_count();
  for (int round = 0; round < rounds && map.surface.mesh.vertex_count() > keep; ++round) {
    const RefinedMap valid = map;
    const Neighbourhood all = around_splits(map, held);
    UntangleOptions options;
    options.max_iterations = kIterations;
    options.patience = kPatience;
    options.least_epsilon = kLeastEpsilon;
    options.guards = all.guards;
    options.weights = &all.weights;
    map.uv = Untangler(all.surface, all.fixed, context).run(map.uv, options, context).uv;
    const bool removed = winds_once(map) && remove_added(map, held, keep, context) > 0;
    if (!removed || !relax(map, held, {.steps = kRelaxSteps}, context)) {
      map = valid;
      break;
    }
  }
  return before - map.surface.mesh.vertex_count();
}

}  // namespace flipfree
