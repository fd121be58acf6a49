#include "flipfree/seamless/exact/parts.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <numeric>
#include <string>
#include <utility>

#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/seamless/request.h"

namespace flipfree::seamless {

std::vector<Index> with_corners(const std::vector<SurfacePart>& parts,
                                const std::vector<char>& freed, const std::vector<Index>& cones,
                                ExecutionContext& context) {
  std::vector<Index> all = cones;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (!parts[i].bordered || freed[i] != 0) continue;
    context.check();
    const std::vector<Index> own = aligned_cones(parts[i].surface, parts[i].cones, context);
    for (std::size_t v = 0; v < own.size(); ++v) all[at(parts[i].vertices[v])] = own[v];
  }
  return all;
}

std::vector<char> aligned_faces(const mesh::Surface& surface, const std::vector<Index>& cones) {
  const mesh::Adjacency& adjacency = surface.adjacency();
  const mesh::Components parts = mesh::face_components(adjacency);
  std::vector<char> aligned(at(parts.count), 0);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(adjacency.opposite.size()); ++h) {
    if (adjacency.opposite[at(h)] == kInvalid &&
        cones[at(mesh::source(surface.faces, h))] != kNotGiven)
      aligned[at(parts.of_face[at(h / 3)])] = 1;
  }
  std::vector<char> of_face;
  for (const Index part : parts.of_face) of_face.push_back(aligned[at(part)]);
  return of_face;
}

distortion::CutMap cut_of(const certify::Parametrization& map, const std::vector<char>& aligned) {
  const mesh::Adjacency& adjacency = map.surface.adjacency();
  const mesh::EdgeFlags cuts = mesh::flag_edges(map.surface.faces, adjacency, map.cut_edges);
  distortion::CutMap cut = distortion::cut_map(map.surface, adjacency, cuts, map.uv);
  cut.straight = distortion::straight_boundary(cut, adjacency);
  std::erase_if(cut.straight, [&](const distortion::StraightEdge& edge) {
    return aligned[at(map.parent_face[at(edge.h / 3)])] == 0;
  });
  return cut;
}

namespace {

// Inner edges that an aligned boundary would flatten.
//
// An edge whose two ends lie on one straight side of the boundary, and the side between them, end
// up on one line: what they enclose has no area, whatever the map. So it is with every triangle
// that has a tip at a straight vertex. A vertex on the middle of each of these edges is as much
// refinement as that needs, and as little.
//
// All edges with both ends on one side cut the surface into pieces. What one of them encloses with
// the side is a disk if its piece is one whose boundary has, beside it, only edges of the side and
// edges that enclose smaller disks.

// The largest disk that is divided: so many faces, and so many more per edge of the side. Beside
// larger ones the layout of the metric refines with less distortion (7200 and 24 200 faces beyond
// one edge: energies of 4.69 and 4.87, divided 5.18 and 5.31).
constexpr Index kLeastFaces = 1000;
constexpr Index kFacesPerEdge = 16;

class ChordFinder {
 public:
  ChordFinder(const mesh::Surface& surface, const std::vector<Index>& cones)
      : faces_(surface.faces), adjacency_(surface.adjacency()), place_(cones.size()) {
    for (const auto& loop : mesh::boundary_loops(faces_, adjacency_)) {
      // Corners up to each vertex, twice around.
      std::vector<Index>& corners = corners_.emplace_back(1, 0);
      for (std::size_t i = 0; i < 2 * loop.size(); ++i)
        corners.push_back(corners.back() + (cones[at(loop[i % loop.size()])] == 2 ? 0 : 1));
      for (std::size_t i = 0; i < loop.size(); ++i)
        place_[at(loop[i])] = {static_cast<Index>(corners_.size()) - 1, static_cast<Index>(i)};
    }
  }

  std::vector<HalfedgeId> run() {
    const auto count = static_cast<HalfedgeId>(adjacency_.opposite.size());
    mesh::EdgeFlags between(at(count), 0);
    std::vector<std::pair<Index, HalfedgeId>> candidates;
    for (HalfedgeId h = 0; h < count; ++h) {
      const Index edges = edges_behind(h);
      if (edges == 0) continue;
      candidates.emplace_back(edges, h);
      between[at(h)] = between[at(adjacency_.opposite[at(h)])] = 1;
    }
    cut_into_pieces(between);
    // Disks that lie in others come before them.
    std::sort(candidates.begin(), candidates.end());
    std::vector<Index> enclosed(at(count), 0);  // faces of the disk left of a half-edge
    std::vector<HalfedgeId> chords;
    for (const auto& [edges, h] : candidates) {
      const HalfedgeId o = adjacency_.opposite[at(h)];
      const Piece& own = pieces_[at(piece_of_.of_face[at(h / 3)])];
      const bool closed = enclosed[at(o)] > 0;  // is what lies beyond h a disk?
      const Index faces = own.faces + own.enclosed - enclosed[at(o)];
      if (own.euler() != 1 || own.open != (closed ? 0 : 1) ||
          own.side_edges != edges + (closed ? edges_behind(o) : 0))
        continue;
      enclosed[at(h)] = faces;
      if (faces <= kLeastFaces + kFacesPerEdge * edges) chords.push_back(std::min(h, o));
      Piece& beyond = pieces_[at(piece_of_.of_face[at(o / 3)])];
      --beyond.open;
      beyond.side_edges += edges;
      beyond.enclosed += faces;
    }
    sort_unique(chords);
    return chords;
  }

 private:
  struct Place {
    Index loop = kInvalid;
    Index number = 0;
  };
  struct Piece {
    Index vertices = 0, faces = 0, border = 0;
    Index open = 0;  // of its border edges: with no disk known beyond them
    // Edges of the boundary, those of the disks beyond it included, and the faces of these.
    Index side_edges = 0, enclosed = 0;

    Index euler() const { return vertices - (3 * faces + border) / 2 + faces; }
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

  void cut_into_pieces(const mesh::EdgeFlags& between) {
    piece_of_ = mesh::components_between(adjacency_, between);
    pieces_.resize(at(piece_of_.count));
    const mesh::CutMesh cut = mesh::cut_along(faces_, adjacency_, between);
    std::vector<char> seen(cut.vertex_origin.size(), 0);
    for (HalfedgeId h = 0; at(h) < between.size(); ++h) {
      Piece& piece = pieces_[at(piece_of_.of_face[at(h / 3)])];
      const bool side = adjacency_.opposite[at(h)] == kInvalid;
      if (h % 3 == 0) ++piece.faces;
      if (std::exchange(seen[at(cut.faces(h / 3, h % 3))], 1) == 0) ++piece.vertices;
      if (side) ++piece.side_edges;
      if (between[at(h)] != 0) ++piece.open;
      if (side || between[at(h)] != 0) ++piece.border;
    }
  }

  const Triangles& faces_;
  const mesh::Adjacency& adjacency_;
  std::vector<Place> place_;
  std::vector<std::vector<Index>> corners_;
  mesh::Components piece_of_;
  std::vector<Piece> pieces_;
};

[[noreturn]] void throw_undivided(const std::string& what, const std::string& why, ElementKind kind,
                                  std::vector<Index> elements) {
  throw_not_converged(ErrorCode::kIterationLimit,
                      "A straight boundary flattens what " + what + " cuts off, and the " + why +
                          ", or take the free boundary.",
                      kind, std::move(elements));
}

// A vertex on the middle of each of these inner edges, the i-th one's after the surface's own
// vertices and the i before; flat. Faces without such an edge stay as they are.
DividedSides split_in_the_middle(const mesh::Surface& surface, const std::vector<HalfedgeId>& edges,
                                 const std::vector<Index>& cones) {
  mesh::RefinedSurface refined = mesh::unrefined(surface);
  for (const HalfedgeId h : edges) {
    const VertexId from = mesh::source(surface.faces, h), to = mesh::target(surface.faces, h);
    const VertexId v = refined.split_edge(refined.mesh.find(from, to));
    const Vector3& place = refined.position[at(v)];
    if (place == refined.position[at(from)] || place == refined.position[at(to)])
      throw_undivided("edge " + vertex_id(from) + "-" + vertex_id(to),
                      "edge is too short to be divided. Merge its end points", ElementKind::kEdge,
                      {from, to});
  }
  DividedSides out{to_surface(refined), provenance_of(refined), cones, {}, {}};
  out.cones.resize(refined.position.size(), 4);
  const auto count = static_cast<VertexId>(surface.vertices.rows());
  for (HalfedgeId h = 0; h < refined.mesh.halfedge_slots(); ++h) {
    const VertexId v = refined.mesh.source(h), w = refined.mesh.target(h);
    if (std::max(v, w) >= count && refined.position[at(v)] == refined.position[at(w)])
      throw_undivided("an edge of face " + face_id(refined.mesh.parent(h / 3)),
                      "face is too thin to be divided. Merge vertices that nearly coincide",
                      ElementKind::kFace, {refined.mesh.parent(h / 3)});
  }
  return out;
}

// Edges inside faces, and what `diagonals` were divided into where these edges were.
IndexPairs diagonals_of(const mesh::Surface& surface, const std::vector<HalfedgeId>& edges,
                        const DividedSides& pieces, const IndexPairs& diagonals) {
  auto v = static_cast<VertexId>(surface.vertices.rows());
  std::map<std::pair<VertexId, VertexId>, VertexId> middle;
  for (const HalfedgeId h : edges)
    middle[std::minmax({mesh::source(surface.faces, h), mesh::target(surface.faces, h)})] = v++;
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
  const mesh::Adjacency& adjacency = pieces.surface.adjacency();
  const std::vector<FaceId>& parent = pieces.provenance.face;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(adjacency.opposite.size()); ++h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o > h && parent[at(h / 3)] == parent[at(o / 3)])
      pairs.emplace_back(mesh::source(faces, h), mesh::target(faces, h));
  }
  IndexPairs out(static_cast<Eigen::Index>(pairs.size()), 2);
  for (std::size_t i = 0; i < pairs.size(); ++i)
    out.row(static_cast<Eigen::Index>(i)) << pairs[i].first, pairs[i].second;
  return out;
}

}  // namespace

std::vector<HalfedgeId> side_chords(const mesh::Surface& surface, const std::vector<Index>& cones) {
  return ChordFinder(surface, cones).run();
}

std::optional<DividedSides> divided_sides(const mesh::Surface& surface,
                                          const std::vector<Index>& cones,
                                          const std::vector<HalfedgeId>& chords,
                                          const IndexPairs& uncuttable) {
  if (chords.empty()) return std::nullopt;
  DividedSides out = split_in_the_middle(surface, chords, cones);
  out.uncuttable = diagonals_of(surface, chords, out, uncuttable);
  for (const mesh::SurfacePoint& point : out.provenance.vertex) {
    Index k = 0;
    point.weight.maxCoeff(&k);
    out.place.push_back(surface.faces(point.face, k));
  }
  return out;
}

namespace {

constexpr double kLargest = 8388608.0;  // 2^23, steps
constexpr double kGap = 0.02;           // between boxes, of the size of a mean one

}  // namespace

void spread_charts(double step, certify::Parametrization& map) {
  const mesh::Components parts = mesh::face_components(map.surface.adjacency());
  if (parts.count < 2) return;
  std::vector<Eigen::AlignedBox2d> boxes(at(parts.count));
  const auto part_of = [&](Eigen::Index c) { return at(parts.of_face[at(c / 3)]); };
  for (Eigen::Index c = 0; c < map.uv.rows(); ++c)
    boxes[part_of(c)].extend(map.uv.row(c).transpose());
  double area = 0.0, widest = 0.0;
  for (const Eigen::AlignedBox2d& box : boxes) {
    area += box.sizes().x() * box.sizes().y();
    widest = std::max(widest, box.sizes().x());
  }
  const double gap = step * std::ceil(kGap * std::sqrt(area / parts.count) / step);
  const double width = std::max(widest, std::sqrt(area));
  std::vector<std::size_t> order(boxes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return boxes[a].sizes().y() > boxes[b].sizes().y();
  });
  std::vector<Vector2> place(boxes.size());  // of the lower left corners
  Vector2 at(0.0, 0.0), extent(0.0, 0.0);
  double row_height = 0.0;
  for (const std::size_t i : order) {
    const Vector2 size = boxes[i].sizes();
    if (at.x() > 0.0 && at.x() + size.x() > width) {
      at = {0.0, at.y() + row_height + gap};
      row_height = 0.0;
    }
    place[i] = at;
    row_height = std::max(row_height, size.y());
    extent = extent.cwiseMax(at + size);
    at.x() += size.x() + gap;
  }
  if (extent.maxCoeff() > 2.0 * kLargest * step) return;
  const Vector2 middle((0.5 * extent / step).array().floor() * step);
  for (Eigen::Index c = 0; c < map.uv.rows(); ++c) {
    const std::size_t i = part_of(c);
    map.uv.row(c) += (place[i] - boxes[i].min() - middle).transpose();
  }
}

namespace {

struct MeasuredPart {
  Eigen::AlignedBox3d box;
  Index faces = 0;
  int exponent = 0;  // binary, of what it is multiplied by

  // Half of it: the difference of two huge coordinates may not be finite.
  double half_extent() const { return (0.5 * box.max() - 0.5 * box.min()).maxCoeff(); }
};

}  // namespace

std::optional<EnlargedParts> enlarge_parts(const mesh::Surface& surface, double least_edge) {
  const mesh::Components components = mesh::face_components(surface.adjacency());
  if (components.count < 2) return std::nullopt;
  std::vector<MeasuredPart> parts(at(components.count));
  for (FaceId f = 0; f < static_cast<FaceId>(surface.faces.rows()); ++f) {
    MeasuredPart& part = parts[at(components.of_face[at(f)])];
    ++part.faces;
    for (Index k = 0; k < 3; ++k)
      part.box.extend(surface.vertices.row(surface.faces(f, k)).transpose());
  }
  double largest = 0.0;
  for (const MeasuredPart& part : parts) largest = std::max(largest, part.half_extent());
  EnlargedParts result;
  for (MeasuredPart& part : parts) {
    const double extent = part.half_extent();
    const double least = least_edge * largest * std::sqrt(static_cast<double>(part.faces));
    if (!(extent > 0.0) || extent >= least) continue;
    // The quotient itself may not be finite.
    part.exponent = std::ilogb(least) - std::ilogb(extent) + 1;
    ++result.count;
  }
  if (result.count == 0) return std::nullopt;
  result.surface = surface;
  for (FaceId f = 0; f < static_cast<FaceId>(surface.faces.rows()); ++f) {
    const MeasuredPart& part = parts[at(components.of_face[at(f)])];
    if (part.exponent == 0) continue;
    for (Index k = 0; k < 3; ++k) {
      const VertexId v = surface.faces(f, k);
      for (Index i = 0; i < 3; ++i)
        result.surface.vertices(v, i) =
            std::ldexp(surface.vertices(v, i) - part.box.min()[i], part.exponent);
    }
  }
  return result;
}

void place_on(const mesh::Surface& surface, certify::Parametrization& map) {
  const Eigen::Index own = surface.vertices.rows();
  map.surface.vertices.topRows(own) = surface.vertices;
  for (Eigen::Index v = own; v < map.surface.vertices.rows(); ++v)
    map.surface.vertices.row(v) =
        map.vertex_barycentric.row(v) *
        surface.vertices(surface.faces.row(map.vertex_parent[at(v)]), Eigen::all);
}

}  // namespace flipfree::seamless
