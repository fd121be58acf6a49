#include "flipfree/intrinsic/symmetric_flips.h"

#include <utility>

// The symmetric flips, thesis Figure 4.5 and Table 4.1; the symmetry line is vertical, primes are
// mirror images:
/*
    kParallel: (c,d) -> (a,a')       kTriangle: (a,c), (a',c) -> (b,b')   kQuad: (a,c), (a',c')
    kPerpendicular: the inverse      kTriangleQuad: the inverse           -> (b,b'); kQuadQuad back

           c                                  c                                  c' ---- c
         / | \                              / | \                             /  |    |  \
        a' |  a                            b' | | b                            b'  |    |   b
         \ | /                              \ a'--a /                         \  |    |  /
           d                                  (below: more mesh)                  a' ---- a
*/
// (for kTriangle the symmetric face is (c, a', a), for kQuad it is (a, c, c', a')). The points of
// each are in convex position where the flipped edge is not Delaunay, and so are they at every
// plain flip on the way.

namespace flipfree::intrinsic {
namespace {

bool is_perpendicular(const IntrinsicMesh& m, HalfedgeId h) {
  return m.label_of_edge(h >> 1) == EdgeLabel::kPerpendicular;
}
// The diagonal beside h in its (quadrilateral's) triangle.
HalfedgeId diagonal_beside(const IntrinsicMesh& m, HalfedgeId h) {
  const HalfedgeId n = m.next_of(h);
  return m.label_of_edge(n >> 1) == EdgeLabel::kDiagonal ? n : m.next_of(n);
}
bool diagonal_follows(const IntrinsicMesh& m, HalfedgeId h) {
  return diagonal_beside(m, h) == m.next_of(h);
}
// The half of edge e whose face has this label (the even one if both have).
HalfedgeId half_in(const IntrinsicMesh& m, EdgeId e, FaceLabel label) {
  return m.face_label[at(m.face[at(2 * e)])] == label ? 2 * e : 2 * e + 1;
}

void make_perpendicular(IntrinsicMesh& m, EdgeId e, bool starts_in_two) {
  m.starts_in_two[at(e)] = starts_in_two ? 1 : 0;
  m.edge_label[at(e)] = EdgeLabel::kPerpendicular;
  m.reflection[at(2 * e)] = 2 * e;
  m.reflection[at(2 * e + 1)] = 2 * e + 1;
}
void make_diagonal(IntrinsicMesh& m, EdgeId e) {
  m.edge_label[at(e)] = EdgeLabel::kDiagonal;
  m.reflection[at(2 * e)] = kInvalid;
  m.reflection[at(2 * e + 1)] = kInvalid;
}
void label_both_faces(IntrinsicMesh& m, EdgeId e, FaceLabel label) {
  m.face_label[at(m.face[at(2 * e)])] = label;
  m.face_label[at(m.face[at(2 * e + 1)])] = label;
}

// Whether the side half-edge s of a symmetric triangle, or of a half of a quadrilateral, lies in
// copy 1: told by the perpendicular edge beside it. A half whose perpendicular edge is w reads (w,
// side) or (side, w) around the corner.
bool side_is_one(const IntrinsicMesh& m, HalfedgeId s) {
  const HalfedgeId n = m.next_of(s);
  // s ends where n starts: if n leaves copy 1, that corner is in copy 1.
  if (is_perpendicular(m, n)) return m.leaves_one(n);
  return !m.leaves_one(m.next_of(n));
}

// A flip has restored the symmetric face of which edges a and b are the sides, its triangles f and
// g (the same, if it is one): they and their outer faces get the labels 1 and 2.
void restore_sides(IntrinsicMesh& m, EdgeId a, EdgeId b, FaceId f, FaceId g) {
  const auto inner = [&](EdgeId e) {
    const FaceId side = m.face[at(2 * e)];
    return side == f || side == g ? 2 * e : 2 * e + 1;
  };
  HalfedgeId one = inner(a), two = inner(b);
  pair_by_reflection(m, one, two);
  if (!side_is_one(m, one)) std::swap(one, two);
  m.face_label[at(m.face[at(one ^ 1)])] = FaceLabel::kOne;
  m.face_label[at(m.face[at(two ^ 1)])] = FaceLabel::kTwo;
  m.edge_label[at(one >> 1)] = EdgeLabel::kOne;
  m.edge_label[at(two >> 1)] = EdgeLabel::kTwo;
}

}  // namespace

std::optional<FlipType> flip_type(const IntrinsicMesh& m, EdgeId e) {
  const FaceId f = m.face[at(2 * e)];
  const FaceId g = m.face[at(2 * e + 1)];
  if (f == g) return std::nullopt;
  if (!m.symmetric()) return FlipType::kInterior;
  const FaceLabel lf = m.face_label[at(f)];
  const FaceLabel lg = m.face_label[at(g)];
  const auto symmetric = [](FaceLabel l) {
    return l == FaceLabel::kTriangle || l == FaceLabel::kQuad;
  };
  switch (m.edge_label[at(e)]) {
    case EdgeLabel::kDiagonal:
    case EdgeLabel::kTwo:
      return std::nullopt;
    case EdgeLabel::kParallel:
      if (symmetric(lf)) return std::nullopt;
      return FlipType::kParallel;
    case EdgeLabel::kPerpendicular:
      if (lf != lg) return FlipType::kTriangleQuad;
      if (lf != FaceLabel::kQuad) return FlipType::kPerpendicular;
      // A quadrilateral glued to itself across the line bounds a loop without a vertex; it cannot
      // arise.
      if (diagonal_beside(m, 2 * e) == (diagonal_beside(m, 2 * e + 1) ^ 1)) return std::nullopt;
      return FlipType::kQuadQuad;
    case EdgeLabel::kOne:
      if (symmetric(lf) && symmetric(lg)) return std::nullopt;
      if (!symmetric(lf) && !symmetric(lg)) return FlipType::kInterior;
      return lf == FaceLabel::kQuad || lg == FaceLabel::kQuad ? FlipType::kQuad
                                                              : FlipType::kTriangle;
  }
  return std::nullopt;
}

FlipRecord flip_of(const IntrinsicMesh& m, EdgeId e, FlipType type) {
  FlipRecord flip{type, false, {1, {e, kInvalid, kInvalid}}};
  const auto also = [&flip](HalfedgeId h) { flip.plain.edges[at(flip.plain.count++)] = h >> 1; };
  const HalfedgeId h = 2 * e;
  switch (type) {
    case FlipType::kInterior:
      if (m.symmetric()) also(m.reflection[at(h)]);
      break;
    case FlipType::kParallel:
      flip.turned = m.face_label[at(m.face[at(h)])] == FaceLabel::kOne;
      break;
    case FlipType::kPerpendicular:
      break;
    case FlipType::kTriangle: {
      const HalfedgeId mirror = m.reflection[at(half_in(m, e, FaceLabel::kTriangle))];
      also(mirror);
      flip.turned = half_in(m, mirror >> 1, FaceLabel::kTriangle) % 2 == 0;
      break;
    }
    case FlipType::kTriangleQuad:
      also(diagonal_beside(m, half_in(m, e, FaceLabel::kQuad)));
      break;
    case FlipType::kQuad: {
      const HalfedgeId inner = half_in(m, e, FaceLabel::kQuad);
      also(m.reflection[at(inner)]);
      also(diagonal_beside(m, inner));
      break;
    }
    case FlipType::kQuadQuad:
      also(diagonal_beside(m, h));
      also(diagonal_beside(m, h + 1));
      flip.turned = diagonal_follows(m, h) == diagonal_follows(m, h + 1);
      break;
  }
  return flip;
}

void relabel(IntrinsicMesh& m, const FlipRecord& flip) {
  if (!m.symmetric()) return;
  const auto [e, second, third] = flip.plain.edges;
  const HalfedgeId h = 2 * e;
  switch (flip.type) {
    case FlipType::kInterior:
      // Both copies turned counter-clockwise, the mirror image of which is clockwise: the halves
      // change partners.
      pair_by_reflection(m, h, m.reflection[at(h)] ^ 1);
      return;
    case FlipType::kParallel:
      // The even half starts at the apex of what was the odd half's face.
      make_perpendicular(m, e, flip.turned);
      label_both_faces(m, e, FaceLabel::kTriangle);
      return;
    case FlipType::kPerpendicular: {
      m.edge_label[at(e)] = EdgeLabel::kParallel;
      pair_by_reflection(m, h, h + 1);
      // The face of the even half keeps the vertex from which that half started.
      const bool one = m.starts_in_two[at(e)] == 0;
      m.face_label[at(m.face[at(h)])] = one ? FaceLabel::kOne : FaceLabel::kTwo;
      m.face_label[at(m.face[at(h + 1)])] = one ? FaceLabel::kTwo : FaceLabel::kOne;
      return;
    }
    case FlipType::kTriangle:
      label_both_faces(m, second, FaceLabel::kTriangle);
      label_both_faces(m, e, FaceLabel::kQuad);
      // The mirror image of e was turned last; its half in t got b' (copy 2) as origin.
      make_perpendicular(m, second, flip.turned);
      make_diagonal(m, e);
      return;
    case FlipType::kTriangleQuad: {
      // The face between the two flipped edges is the symmetric triangle.
      const FaceId f = m.face[at(2 * second)];
      const bool shares = m.face[at(h)] == f || m.face[at(h + 1)] == f;
      const FaceId t = shares ? f : m.face[at(2 * second + 1)];
      m.face_label[at(t)] = FaceLabel::kTriangle;
      restore_sides(m, e, second, t, t);
      return;
    }
    case FlipType::kQuad:
      for (const EdgeId diagonal : {e, second}) {
        label_both_faces(m, diagonal, FaceLabel::kQuad);
        make_diagonal(m, diagonal);
      }
      // Of the two diagonals, that of the flipped edge of copy 1 touches b, the other one b'.
      make_perpendicular(
          m, third, (diagonal_beside(m, 2 * third) >> 1 == e) == diagonal_follows(m, 2 * third));
      return;
    case FlipType::kQuadQuad: {
      // If the diagonals left e at different ends, e has become the new diagonal, else the first
      // diagonal has.
      const EdgeId diagonal = flip.turned ? e : second;
      label_both_faces(m, diagonal, FaceLabel::kQuad);
      make_diagonal(m, diagonal);
      restore_sides(m, flip.turned ? second : e, third, m.face[at(2 * diagonal)],
                    m.face[at(2 * diagonal + 1)]);
      return;
    }
  }
}

}  // namespace flipfree::intrinsic
