#include "flipfree/intrinsic/intrinsic_mesh.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <numeric>
#include <utility>

#include "flipfree/base/failure.h"
#include "flipfree/mesh/adjacency.h"

namespace flipfree::intrinsic {
std::string at_halfedge(const char* what, HalfedgeId h) {
  return std::string(what) + " at half-edge " + std::to_string(h);
}

void flip_edge(FlipMesh& m, EdgeId e) {
  debug_require("flip_edge", "the edge has two faces", [&] { return !is_glued_to_itself(m, e); });
  const HalfedgeId h = 2 * e;
  const HalfedgeId o = h + 1;
  const HalfedgeId hn = m.next[at(h)];
  const HalfedgeId hp = m.next[at(hn)];
  const HalfedgeId on = m.next[at(o)];
  const HalfedgeId op = m.next[at(on)];
  m.next[at(h)] = hp, m.next[at(hp)] = on, m.next[at(on)] = h;
  m.next[at(o)] = op, m.next[at(op)] = hn, m.next[at(hn)] = o;
  m.origin[at(h)] = m.origin[at(op)];
  m.origin[at(o)] = m.origin[at(hp)];
}

bool is_glued_to_itself(const FlipMesh& m, EdgeId e) {
  const HalfedgeId h = 2 * e;
  return m.next_of(h) == (h ^ 1) || m.previous(h) == (h ^ 1);
}

Index count_vertices(const FlipMesh& m) {
  const auto last = std::max_element(m.origin.begin(), m.origin.end());
  return last == m.origin.end() ? 0 : *last + 1;
}

std::string find_broken_invariant(const FlipMesh& m) {
  const auto count = static_cast<Index>(m.next.size());
  if (count % 2 != 0 || m.origin.size() != m.next.size()) return "half-edges without a partner";
  for (HalfedgeId h = 0; h < count; ++h) {
    const HalfedgeId n = m.next[at(h)];
    if (n < 0 || n >= count) return at_halfedge("next out of range", h);
    if (m.origin[at(h)] < 0) return at_halfedge("no origin", h);
  }
  for (HalfedgeId h = 0; h < count; ++h) {
    const HalfedgeId n = m.next[at(h)];
    if (n == h || m.previous(n) != h) return at_halfedge("face orbit is not 3 long", h);
    if (m.origin[at(n)] != m.target(h)) return at_halfedge("ends do not meet", h);
  }
  return {};
}

namespace {

void glue(IntrinsicMesh& m, HalfedgeId a, HalfedgeId b, HalfedgeId c, FaceId f) {
  m.next[at(a)] = b;
  m.next[at(b)] = c;
  m.next[at(c)] = a;
  m.face[at(a)] = f;
  m.face[at(b)] = f;
  m.face[at(c)] = f;
  m.face_halfedge[at(f)] = a;
}

// Adds the mirrored copy: its vertices, the interior edges from `edges` on, its faces.
void add_mirror_image(const Triangles& faces, const mesh::Adjacency& adjacency, Index edges,
                      IntrinsicSetup& setup) {
  IntrinsicMesh& m = setup.mesh;
  const Index face_count = static_cast<Index>(faces.rows());
  m.reflection.assign(m.next.size(), kInvalid);
  m.edge_label.assign(m.edge_count(), EdgeLabel::kOne);
  m.face_label.assign(m.face_count(), FaceLabel::kOne);
  m.starts_in_two.assign(m.edge_count(), 0);
  const auto vertex_count = static_cast<Index>(m.unknown.size());
  std::vector<VertexId> mirror(at(vertex_count));
  for (VertexId v = 0; v < vertex_count; ++v) {
    mirror[at(v)] = v;
    if (setup.on_boundary[at(v)]) continue;
    mirror[at(v)] = static_cast<VertexId>(m.unknown.size());
    m.unknown.push_back(v);
  }
  Index mirrored = edges;
  for (Index h = 0; h < 3 * face_count; ++h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    const HalfedgeId mine = setup.input_halfedge[at(h)];
    if (o == kInvalid) {
      m.edge_label[at(mine >> 1)] = EdgeLabel::kParallel;
      m.reflection[at(mine)] = mine ^ 1;
      m.reflection[at(mine ^ 1)] = mine;
    } else if (h < o) {
      m.edge_label[at(mirrored)] = EdgeLabel::kTwo;
      pair_by_reflection(m, mine, 2 * mirrored);
      ++mirrored;
    }
  }
  // R(a -> b) runs from R(b) to R(a), and the face is walked backwards.
  for (Index f = 0; f < face_count; ++f) {
    std::array<HalfedgeId, 3> r{};
    for (Index k = 0; k < 3; ++k) {
      const HalfedgeId h = setup.input_halfedge[at(3 * f + k)];
      r[at(k)] = m.reflection[at(h)];
      m.origin[at(r[at(k)])] = mirror[at(faces(f, (k + 1) % 3))];
    }
    glue(m, r[0], r[2], r[1], face_count + f);
    m.face_label[at(face_count + f)] = FaceLabel::kTwo;
  }
}

// What is wrong with reflection and labels at a half-edge (Proposition 2); empty if nothing is.
std::string broken_symmetry(const IntrinsicMesh& m, HalfedgeId h) {
  const auto is_symmetric = [&](HalfedgeId h) {
    const FaceLabel l = m.face_label[at(m.face[at(h)])];
    return l == FaceLabel::kTriangle || l == FaceLabel::kQuad;
  };
  const HalfedgeId r = m.reflection[at(h)];
  const EdgeLabel label = m.edge_label[at(h >> 1)];
  if (label == EdgeLabel::kDiagonal) {
    if (r != kInvalid) return at_halfedge("diagonal has a reflection", h);
    if (m.face_label[at(m.face[at(h)])] != FaceLabel::kQuad)
      return at_halfedge("diagonal outside a quad", h);
    return {};
  }
  if (r == kInvalid) return at_halfedge("no reflection", h);
  if (m.reflection[at(r)] != h) return at_halfedge("R R is not the identity", h);
  if (m.reflection[at(h ^ 1)] != (r ^ 1)) return at_halfedge("R O differs from O R", h);
  if (m.unknown[at(m.origin[at(h)])] != m.unknown[at(m.target(r))]) {
    return at_halfedge("R does not map end points", h);
  }
  const bool perpendicular = r == h;
  const bool parallel = r == (h ^ 1);
  if (perpendicular != (label == EdgeLabel::kPerpendicular))
    return at_halfedge("perpendicular label", h);
  if (parallel != (label == EdgeLabel::kParallel)) return at_halfedge("parallel label", h);
  if (label == EdgeLabel::kOne && m.edge_label[at(r >> 1)] != EdgeLabel::kTwo) {
    return at_halfedge("mirror of copy 1 is not copy 2", h);
  }
  const FaceLabel face = m.face_label[at(m.face[at(h)])];
  // Proposition 2 (a), (b), (c).
  if (label == EdgeLabel::kPerpendicular && !is_symmetric(h))
    return at_halfedge("Proposition 2 (a)", h);
  if (label == EdgeLabel::kParallel && is_symmetric(h) != is_symmetric(h ^ 1)) {
    return at_halfedge("Proposition 2 (b)", h);
  }
  if (label == EdgeLabel::kOne && face == FaceLabel::kTwo)
    return at_halfedge("Proposition 2 (c)", h);
  if (label == EdgeLabel::kTwo && face == FaceLabel::kOne)
    return at_halfedge("Proposition 2 (c)", h);
  // next(R(h)) = R(previous(h)), around the diagonal where the face is a quadrilateral.
  HalfedgeId before = m.previous(h);
  if (m.edge_label[at(before >> 1)] == EdgeLabel::kDiagonal) before = m.previous(before ^ 1);
  HalfedgeId after = m.next[at(r)];
  if (m.edge_label[at(after >> 1)] == EdgeLabel::kDiagonal) after = m.next[at(after ^ 1)];
  if (m.reflection[at(before)] != after) return at_halfedge("R does not invert next", h);
  return {};
}

}  // namespace

void pair_by_reflection(IntrinsicMesh& m, HalfedgeId a, HalfedgeId b) {
  m.reflection[at(a)] = b;
  m.reflection[at(b)] = a;
  m.reflection[at(a ^ 1)] = b ^ 1;
  m.reflection[at(b ^ 1)] = a ^ 1;
}

InputEdges number_edges(const mesh::Adjacency& adjacency) {
  InputEdges edges;
  edges.of_corner.assign(adjacency.opposite.size(), kInvalid);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(adjacency.opposite.size()); ++h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o != kInvalid && o < h) {
      edges.of_corner[at(h)] = edges.of_corner[at(o)];
    } else {
      edges.of_corner[at(h)] = static_cast<Index>(edges.halfedge.size());
      edges.halfedge.push_back(h);
    }
  }
  return edges;
}

IntrinsicSetup build_intrinsic_mesh(Index vertex_count, const Triangles& faces) {
  const mesh::Adjacency adjacency = mesh::build_adjacency(vertex_count, faces);
  const Index face_count = static_cast<Index>(faces.rows());
  IntrinsicSetup setup;
  setup.on_boundary.assign(at(vertex_count), false);
  const InputEdges numbered = number_edges(adjacency);
  for (HalfedgeId h = 0; h < 3 * face_count; ++h) {
    const EdgeId e = numbered.of_corner[at(h)];
    setup.input_halfedge.push_back(numbered.halfedge[at(e)] == h ? 2 * e : 2 * e + 1);
    if (adjacency.opposite[at(h)] == kInvalid) setup.on_boundary[at(mesh::source(faces, h))] = true;
  }
  const auto edges = static_cast<Index>(numbered.halfedge.size());
  const Index boundary_edges = 2 * edges - 3 * face_count;
  const bool cover = boundary_edges > 0;
  const Index all_edges = cover ? 2 * edges - boundary_edges : edges;

  IntrinsicMesh& m = setup.mesh;
  m.next.assign(at(2 * all_edges), kInvalid);
  m.origin.assign(at(2 * all_edges), kInvalid);
  m.face.assign(at(2 * all_edges), kInvalid);
  m.face_halfedge.assign(at(cover ? 2 * face_count : face_count), kInvalid);
  m.unknown.resize(at(vertex_count));
  std::iota(m.unknown.begin(), m.unknown.end(), 0);
  for (Index f = 0; f < face_count; ++f) {
    for (Index k = 0; k < 3; ++k) m.origin[at(setup.input_halfedge[at(3 * f + k)])] = faces(f, k);
    glue(m, setup.input_halfedge[at(3 * f)], setup.input_halfedge[at(3 * f + 1)],
         setup.input_halfedge[at(3 * f + 2)], f);
  }
  if (cover) add_mirror_image(faces, adjacency, edges, setup);
  debug_check("build_intrinsic_mesh", [&] { return find_broken_invariant(setup.mesh); });
  return setup;
}

void flip_edge(IntrinsicMesh& m, EdgeId e) {
  const FaceId f = m.face[at(2 * e)];
  const FaceId g = m.face[at(2 * e + 1)];
  flip_edge(static_cast<FlipMesh&>(m), e);
  for (const auto& [h, face] : {std::pair{2 * e, f}, std::pair{2 * e + 1, g}}) {
    m.face_halfedge[at(face)] = h;
    m.face[at(m.next_of(h))] = face;
    m.face[at(m.previous(h))] = face;
  }
}

std::string find_broken_invariant(const IntrinsicMesh& m) {
  if (std::string broken = find_broken_invariant(static_cast<const FlipMesh&>(m));
      !broken.empty()) {
    return broken;
  }
  const auto count = static_cast<Index>(m.next.size());
  for (HalfedgeId h = 0; h < count; ++h) {
    if (m.face[at(m.next_of(h))] != m.face[at(h)])
      return at_halfedge("face differs along its orbit", h);
  }
  for (std::size_t f = 0; f < m.face_count(); ++f) {
    if (m.face[at(m.face_halfedge[f])] != static_cast<FaceId>(f)) {
      return "face " + std::to_string(f) + " names a half-edge of another face";
    }
  }
  if (!m.symmetric()) return {};
  for (HalfedgeId h = 0; h < count; ++h) {
    if (std::string broken = broken_symmetry(m, h); !broken.empty()) return broken;
  }
  for (std::size_t f = 0; f < m.face_count(); ++f) {
    const HalfedgeId h = m.face_halfedge[f];
    int diagonals = 0;
    for (HalfedgeId g : {h, m.next[at(h)], m.previous(h)}) {
      if (m.edge_label[at(g >> 1)] == EdgeLabel::kDiagonal) ++diagonals;
    }
    if (diagonals != (m.face_label[f] == FaceLabel::kQuad ? 1 : 0)) {
      return "face " + std::to_string(f) + " has " + std::to_string(diagonals) + " diagonals";
    }
  }
  return {};
}

}  // namespace flipfree::intrinsic
