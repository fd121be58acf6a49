#include "flipfree/seamless/exact/divided/divided_sides.h"

#include <algorithm>
#include <map>
#include <utility>

#include "flipfree/mesh/topology.h"
#include "flipfree/seamless/bordered/side_chords.h"

namespace flipfree::seamless {
namespace {

std::vector<VertexId> places_of(const mesh::Surface& surface, const RefinedPieces& pieces) {
  std::vector<VertexId> places;
  for (const mesh::SurfacePoint& point : pieces.provenance.vertex) {
    Index k = 0;
    point.weight.maxCoeff(&k);
    places.push_back(surface.faces(point.face, k));
  }
  return places;
}

// Edges inside faces, and what `diagonals` were divided into.
IndexPairs diagonals_of(const mesh::Surface& surface, const RefinedPieces& pieces,
                        const IndexPairs& diagonals) {
  const auto count = static_cast<Index>(surface.vertices.rows());
  std::map<std::pair<VertexId, VertexId>, VertexId> middle;
  for (VertexId v = count; v < static_cast<VertexId>(pieces.surface.vertices.rows()); ++v) {
    const mesh::SurfacePoint& point = pieces.provenance.vertex[static_cast<std::size_t>(v)];
    std::vector<VertexId> ends;
    for (Index k = 0; k < 3; ++k) {
      if (point.weight[k] != 0.0) ends.push_back(surface.faces(point.face, k));
    }
    middle[std::minmax(ends[0], ends[1])] = v;
  }
  std::vector<std::pair<VertexId, VertexId>> pairs;
  for (Eigen::Index e = 0; e < diagonals.rows(); ++e) {
    const VertexId a = diagonals(e, 0), b = diagonals(e, 1);
    const auto divided = middle.find(std::minmax(a, b));
    if (divided == middle.end()) {
      pairs.emplace_back(a, b);
    } else {
      pairs.emplace_back(a, divided->second);
      pairs.emplace_back(divided->second, b);
    }
  }
  const Triangles& faces = pieces.surface.faces;
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(pieces.surface.vertices.rows()), faces);
  const std::vector<FaceId>& parent = pieces.provenance.face;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(adjacency.opposite.size()); ++h) {
    const HalfedgeId o = adjacency.opposite[static_cast<std::size_t>(h)];
    if (o > h && parent[static_cast<std::size_t>(h / 3)] == parent[static_cast<std::size_t>(o / 3)])
      pairs.emplace_back(mesh::source(faces, h), mesh::target(faces, h));
  }
  IndexPairs out(static_cast<Eigen::Index>(pairs.size()), 2);
  for (std::size_t i = 0; i < pairs.size(); ++i)
    out.row(static_cast<Eigen::Index>(i)) << pairs[i].first, pairs[i].second;
  return out;
}

}  // namespace

std::optional<DividedSides> divided_sides(const mesh::Surface& surface,
                                          const mesh::Adjacency& adjacency,
                                          const std::vector<Index>& cones,
                                          const IndexPairs& uncuttable, ExecutionContext& context) {
  const std::vector<HalfedgeId> chords = side_chords(surface.faces, adjacency, cones, context);
  if (chords.empty()) return std::nullopt;
  DividedSurface divided = split_in_the_middle(surface, adjacency, chords, cones);
  DividedSides out;
  out.pieces = {
      std::move(divided.surface), std::move(divided.provenance), std::move(divided.cones), {}};
  out.uncuttable = diagonals_of(surface, out.pieces, uncuttable);
  out.place = places_of(surface, out.pieces);
  return out;
}

}  // namespace flipfree::seamless
