#include "flipfree/seamless/bordered/side_chords.h"

#include <array>

#include "flipfree/mesh/topology.h"

namespace flipfree::seamless {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

// The largest disk that is looked for: so many faces, and so many more per edge of the side.
constexpr Index kLeastFaces = 1000;
constexpr Index kFacesPerEdge = 16;

class ChordFinder {
 public:
  ChordFinder(const Triangles& faces, const mesh::Adjacency& adjacency,
              const std::vector<Index>& cones)
      : faces_(faces),
        adjacency_(adjacency),
        place_(cones.size()),
        vertex_seen_(cones.size(), kInvalid),
        face_seen_(static_cast<std::size_t>(faces.rows()), kInvalid) {
    for (const auto& loop : mesh::boundary_loops(faces, adjacency)) {
      // Corners up to each vertex, twice around.
      std::vector<Index>& corners = corners_.emplace_back(1, 0);
      for (std::size_t i = 0; i < 2 * loop.size(); ++i)
        corners.push_back(corners.back() + (cones[at(loop[i % loop.size()])] == 2 ? 0 : 1));
      for (std::size_t i = 0; i < loop.size(); ++i)
        place_[at(loop[i])] = {static_cast<Index>(corners_.size()) - 1, static_cast<Index>(i)};
    }
  }

  std::vector<HalfedgeId> run() {
    std::vector<HalfedgeId> chords;
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(adjacency_.opposite.size()); ++h) {
      const HalfedgeId o = adjacency_.opposite[at(h)];
      if (o == kInvalid || h > o) continue;
      if (flattens(h) || flattens(o)) chords.push_back(h);
    }
    return chords;
  }

 private:
  struct Place {
    Index loop = kInvalid;
    Index number = 0;
  };

  // Is there a straight side from the target of h to its source, and a disk between?
  bool flattens(HalfedgeId h) {
    const VertexId first = mesh::target(faces_, h), last = mesh::source(faces_, h);
    const Place from = place_[at(first)], to = place_[at(last)];
    if (from.loop == kInvalid || from.loop != to.loop) return false;
    // The surface lies left of the boundary, and the side behind h is the one that h leaves to the
    // left.
    const std::vector<Index>& corners = corners_[at(from.loop)];
    const Index around = static_cast<Index>(corners.size()) / 2;
    const Index edges = (to.number - from.number + around) % around;
    const Index between = corners[at(from.number + edges)] - corners[at(from.number + 1)];
    return edges > 0 && between == 0 && is_disk(h, from, edges);
  }

  // Floods what lies left of h; its boundary must be h and the side, its Euler characteristic 1.
  bool is_disk(HalfedgeId h, const Place& from, Index edges) {
    ++round_;
    std::vector<FaceId> queue = {h / 3};
    face_seen_[at(h / 3)] = round_;
    Index vertices = 0, inner_sides = 0, side_edges = 0;
    for (std::size_t i = 0; i < queue.size(); ++i) {
      if (static_cast<Index>(queue.size()) > kLeastFaces + kFacesPerEdge * edges) return false;
      for (HalfedgeId g = 3 * queue[i]; g < 3 * queue[i] + 3; ++g) {
        Index& seen = vertex_seen_[at(mesh::source(faces_, g))];
        if (seen != round_) ++vertices;
        seen = round_;
        if (g == h) continue;
        const HalfedgeId o = adjacency_.opposite[at(g)];
        if (o == kInvalid) {
          if (!on_side(g, from, edges)) return false;
          ++side_edges;
          continue;
        }
        if (o == h) return false;
        ++inner_sides;
        if (face_seen_[at(o / 3)] == round_) continue;
        face_seen_[at(o / 3)] = round_;
        queue.push_back(o / 3);
      }
    }
    const Index all_edges = 1 + side_edges + inner_sides / 2;
    return side_edges == edges && vertices - all_edges + static_cast<Index>(queue.size()) == 1;
  }

  bool on_side(HalfedgeId boundary, const Place& from, Index edges) const {
    const Place place = place_[at(mesh::source(faces_, boundary))];
    const Index around = static_cast<Index>(corners_[at(from.loop)].size()) / 2;
    return place.loop == from.loop && (place.number - from.number + around) % around < edges;
  }

  const Triangles& faces_;
  const mesh::Adjacency& adjacency_;
  std::vector<Place> place_;
  std::vector<std::vector<Index>> corners_;
  std::vector<Index> vertex_seen_, face_seen_;  // in which round
  Index round_ = 0;
};

using Triangle = std::array<VertexId, 3>;

// A triangle with vertices on the middles of some sides: middle[k] on that from corner k on, or
// kInvalid.
std::vector<Triangle> pieces_of(Triangle corner, Triangle middle) {
  const auto split = [&](std::size_t k) { return middle[k % 3] != kInvalid; };
  const auto count =
      static_cast<int>(split(0)) + static_cast<int>(split(1)) + static_cast<int>(split(2));
  // Turned so that the split sides come first.
  std::size_t r = 0;
  while (count < 3 && count > 0 && !(split(r) && !split(r + 2))) ++r;
  const VertexId a = corner[r % 3], b = corner[(r + 1) % 3], c = corner[(r + 2) % 3];
  const VertexId ab = middle[r % 3], bc = middle[(r + 1) % 3], ca = middle[(r + 2) % 3];
  switch (count) {
    case 0:
      return {corner};
    case 1:
      return {{a, ab, c}, {ab, b, c}};
    case 2:
      return {{a, ab, c}, {ab, b, bc}, {ab, bc, c}};
    default:
      return {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}};
  }
}

}  // namespace

std::vector<HalfedgeId> side_chords(const Triangles& faces, const mesh::Adjacency& adjacency,
                                    const std::vector<Index>& cones) {
  return ChordFinder(faces, adjacency, cones).run();
}

DividedSurface split_in_the_middle(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                                   const std::vector<HalfedgeId>& edges,
                                   const std::vector<Index>& cones) {
  const auto count = static_cast<Index>(surface.vertices.rows());
  DividedSurface out;
  out.cones = cones;
  out.provenance.vertex.resize(at(count));
  const auto corners = static_cast<CornerId>(3 * surface.faces.rows());
  for (CornerId c = 0; c < corners; ++c)
    out.provenance.vertex[at(surface.faces(c / 3, c % 3))] = {c / 3, Vector3::Unit(c % 3)};
  out.surface.vertices.resize(count + static_cast<Index>(edges.size()), 3);
  out.surface.vertices.topRows(count) = surface.vertices;
  std::vector<VertexId> middle(at(corners), kInvalid);
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const HalfedgeId h = edges[i];
    const VertexId v = count + static_cast<Index>(i);
    middle[at(h)] = middle[at(adjacency.opposite[at(h)])] = v;
    out.surface.vertices.row(v) = 0.5 * (surface.vertices.row(mesh::source(surface.faces, h)) +
                                         surface.vertices.row(mesh::target(surface.faces, h)));
    out.cones.push_back(4);
    out.provenance.vertex.push_back(
        {h / 3, 0.5 * (Vector3::Unit(h % 3) + Vector3::Unit((h + 1) % 3))});
  }
  std::vector<Triangle> faces;
  for (FaceId f = 0; f < static_cast<FaceId>(surface.faces.rows()); ++f) {
    const Triangle corner{surface.faces(f, 0), surface.faces(f, 1), surface.faces(f, 2)};
    for (const Triangle& piece :
         pieces_of(corner, {middle[at(3 * f)], middle[at(3 * f + 1)], middle[at(3 * f + 2)]})) {
      faces.push_back(piece);
      out.provenance.face.push_back(f);
    }
  }
  out.surface.faces.resize(static_cast<Eigen::Index>(faces.size()), 3);
  for (std::size_t f = 0; f < faces.size(); ++f)
    out.surface.faces.row(static_cast<Eigen::Index>(f)) << faces[f][0], faces[f][1], faces[f][2];
  return out;
}

}  // namespace flipfree::seamless
