#include "flipfree/seamless/bordered/side_chords.h"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/mesh/topology.h"

namespace flipfree::seamless {
namespace {

// The largest disk that is looked for: so many faces, and so many more per edge of the side.
constexpr Index kLeastFaces = 1000;
constexpr Index kFacesPerEdge = 16;
// Disks and faces between two looks at the clock.
constexpr Index kCheckDisks = 64;
constexpr Index kCheckFaces = 4096;

class ChordFinder {
 public:
  ChordFinder(const Triangles& faces, const mesh::Adjacency& adjacency,
              const std::vector<Index>& cones, ExecutionContext& context)
      : faces_(faces),
        adjacency_(adjacency),
        context_(context),
        place_(cones.size()),
        vertex_seen_(cones.size(), kInvalid),
        face_seen_(static_cast<std::size_t>(faces.rows()), kInvalid),
        disk_faces_(adjacency.opposite.size(), 0) {
    for (const auto& loop : mesh::boundary_loops(faces, adjacency)) {
      // Corners up to each vertex, twice around.
      std::vector<Index>& corners = corners_.emplace_back(1, 0);
      for (std::size_t i = 0; i < 2 * loop.size(); ++i)
        corners.push_back(corners.back() + (cones[at(loop[i % loop.size()])] == 2 ? 0 : 1));
      for (std::size_t i = 0; i < loop.size(); ++i)
        place_[at(loop[i])] = {static_cast<Index>(corners_.size()) - 1, static_cast<Index>(i)};
    }
  }

  // Disks that lie in others come before them: they are not walked through again.
  std::vector<HalfedgeId> run() {
    const auto count = static_cast<HalfedgeId>(adjacency_.opposite.size());
    std::vector<std::pair<Index, HalfedgeId>> candidates;
    for (HalfedgeId h = 0; h < count; ++h) {
      const Index edges = edges_behind(h);
      if (edges > 0) candidates.emplace_back(edges, h);
    }
    std::sort(candidates.begin(), candidates.end());
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      if (i % at(kCheckDisks) == 0) context_.check();
      const auto [edges, h] = candidates[i];
      disk_faces_[at(h)] = disk_behind(h, place_[at(mesh::target(faces_, h))], edges);
    }
    std::vector<HalfedgeId> chords;
    for (HalfedgeId h = 0; h < count; ++h) {
      const HalfedgeId o = adjacency_.opposite[at(h)];
      if (o > h && (disk_faces_[at(h)] > 0 || disk_faces_[at(o)] > 0)) chords.push_back(h);
    }
    return chords;
  }

 private:
  struct Place {
    Index loop = kInvalid;
    Index number = 0;
  };

  // Edges of the straight side from the target of an inner half-edge to its source; 0: none.
  Index edges_behind(HalfedgeId h) const {
    if (adjacency_.opposite[at(h)] == kInvalid) return 0;
    const VertexId first = mesh::target(faces_, h), last = mesh::source(faces_, h);
    const Place from = place_[at(first)], to = place_[at(last)];
    if (from.loop == kInvalid || from.loop != to.loop) return 0;
    // The surface lies left of the boundary, and the side behind h is the one that h leaves to the
    // left.
    const std::vector<Index>& corners = corners_[at(from.loop)];
    const Index around = static_cast<Index>(corners.size()) / 2;
    const Index edges = (to.number - from.number + around) % around;
    if (edges == 0) return 0;
    const Index between = corners[at(from.number + edges)] - corners[at(from.number + 1)];
    return between == 0 ? edges : 0;
  }

  // Floods what lies left of h; its boundary must be h and the side, its Euler characteristic 1.
  // Disks in it that are known count as their chords. Returns the number of its faces; 0: no disk.
  Index disk_behind(HalfedgeId h, const Place& from, Index edges) {
    ++round_;
    std::vector<FaceId> queue = {h / 3};
    face_seen_[at(h / 3)] = round_;
    Index vertices = 0, inner_sides = 0, side_edges = 0;
    Index chords = 0, known_edges = 0, known_faces = 0;  // disks in it
    for (std::size_t i = 0; i < queue.size(); ++i) {
      if (i % at(kCheckFaces) == at(kCheckFaces) - 1) context_.check();
      if (static_cast<Index>(queue.size()) + known_faces > kLeastFaces + kFacesPerEdge * edges)
        return 0;
      for (HalfedgeId g = 3 * queue[i]; g < 3 * queue[i] + 3; ++g) {
        Index& seen = vertex_seen_[at(mesh::source(faces_, g))];
        if (seen != round_) ++vertices;
        seen = round_;
        if (g == h) continue;
        const HalfedgeId o = adjacency_.opposite[at(g)];
        if (o == kInvalid) {
          if (on_side(mesh::source(faces_, g), from) >= edges) return 0;
          ++side_edges;
          continue;
        }
        if (o == h) return 0;
        if (disk_faces_[at(o)] > 0 && face_seen_[at(o / 3)] != round_) {
          const Index between = edges_behind(o);
          if (on_side(mesh::target(faces_, o), from) + between > edges) return 0;
          known_edges += between;
          known_faces += disk_faces_[at(o)];
          ++chords;
          continue;
        }
        ++inner_sides;
        if (face_seen_[at(o / 3)] == round_) continue;
        face_seen_[at(o / 3)] = round_;
        queue.push_back(o / 3);
      }
    }
    const Index all_edges = 1 + side_edges + chords + inner_sides / 2;
    const auto own_faces = static_cast<Index>(queue.size());
    const bool disk = side_edges + known_edges == edges && vertices - all_edges + own_faces == 1;
    return disk ? own_faces + known_faces : 0;
  }

  // Edges of the boundary from `from` to the vertex; as many as there can be on another curve.
  Index on_side(VertexId v, const Place& from) const {
    const Place place = place_[at(v)];
    const Index around = static_cast<Index>(corners_[at(from.loop)].size()) / 2;
    return place.loop == from.loop ? (place.number - from.number + around) % around : around;
  }

  const Triangles& faces_;
  const mesh::Adjacency& adjacency_;
  ExecutionContext& context_;
  std::vector<Place> place_;
  std::vector<std::vector<Index>> corners_;
  std::vector<Index> vertex_seen_, face_seen_;  // in which round
  Index round_ = 0;
  std::vector<Index> disk_faces_;  // left of a half-edge that flattens them; 0: of another
};

[[noreturn]] void throw_too_short(VertexId from, VertexId to) {
  throw_not_converged(ErrorCode::kIterationLimit,
                      "A straight boundary flattens what edge " + vertex_id(from) + "-" +
                          vertex_id(to) +
                          " cuts off, and the edge is too short to be divided. Merge its end "
                          "points, or take the free boundary.",
                      ElementKind::kEdge, {from, to});
}

[[noreturn]] void throw_too_thin(FaceId f) {
  throw_not_converged(ErrorCode::kIterationLimit,
                      "A straight boundary flattens what an edge of face " + face_id(f) +
                          " cuts off, and the face is too thin to be divided. Merge vertices that "
                          "nearly coincide, or take the free boundary.",
                      ElementKind::kFace, {f});
}

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
                                    const std::vector<Index>& cones, ExecutionContext& context) {
  return ChordFinder(faces, adjacency, cones, context).run();
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
    const VertexId from = mesh::source(surface.faces, h), to = mesh::target(surface.faces, h);
    const Vector3 a = surface.vertices.row(from), b = surface.vertices.row(to);
    const Vector3 place = 0.5 * a + 0.5 * b;  // the sum may be too large for a number
    if (place == a || place == b) throw_too_short(from, to);
    out.surface.vertices.row(v) = place;
    out.cones.push_back(4);
    out.provenance.vertex.push_back(
        {h / 3, 0.5 * (Vector3::Unit(h % 3) + Vector3::Unit((h + 1) % 3))});
  }
  std::vector<Triangle> faces;
  for (FaceId f = 0; f < static_cast<FaceId>(surface.faces.rows()); ++f) {
    const Triangle corner{surface.faces(f, 0), surface.faces(f, 1), surface.faces(f, 2)};
    for (const Triangle& piece :
         pieces_of(corner, {middle[at(3 * f)], middle[at(3 * f + 1)], middle[at(3 * f + 2)]})) {
      for (std::size_t k = 0; k < 3; ++k) {
        const VertexId v = piece[k], w = piece[(k + 1) % 3];
        if (std::max(v, w) >= count && out.surface.vertices.row(v) == out.surface.vertices.row(w))
          throw_too_thin(f);
      }
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
