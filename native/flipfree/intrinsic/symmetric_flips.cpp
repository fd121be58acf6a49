#include "flipfree/intrinsic/symmetric_flips.h"

// The symmetric flips, thesis Figure 4.5 and Table 4.1; the symmetry line is vertical, primes are
// mirror images, and (x) marks edges of copy 1 named in FlipStencil:
//
//   kParallel: (c,d) -> (a,a')      kTriangle: (a,c), (a',c) -> (b,b')    kQuad: (a,c), (a',c') ->
//   (b,b') kPerpendicular: the inverse     kTriangleQuad: the inverse            kQuadQuad: the
//   inverse
//
//          c                                  c                                  c' --v-- c
//        / | \ y                            / | \ y                             /  |    |  \ y
//       a' |  a                            b' | | b                            b'  |p   |p  b
//        \ | / x                            \ a'-w-a / x                        \  |    |  / x
//          d                                  (below: more mesh)                  a' --w-- a
//
// (for kParallel b is called a; for kTriangle the symmetric face is (c, a', a), for kQuad it is (a,
// c, c', a')).

namespace flipfree::intrinsic {
namespace {

bool is_perpendicular(const IntrinsicMesh& m, HalfedgeId h) {
  return m.label_of_edge(h >> 1) == EdgeLabel::kPerpendicular;
}
bool is_diagonal(const IntrinsicMesh& m, HalfedgeId h) {
  return m.label_of_edge(h >> 1) == EdgeLabel::kDiagonal;
}

// Of the two half-edges beside h in its (quadrilateral's) triangle: the diagonal and the other one.
struct QuadCorner {
  HalfedgeId diagonal;
  HalfedgeId other;
  bool diagonal_follows;  // diagonal == next(h)
};
QuadCorner quad_corner(const IntrinsicMesh& m, HalfedgeId h) {
  const HalfedgeId n = m.next[at(h)];
  const HalfedgeId p = m.next[at(n)];
  if (is_diagonal(m, n)) return {n, p, true};
  return {p, n, false};
}

// The perpendicular edge in the triangle of half-edge h.
EdgeId perpendicular_in(const IntrinsicMesh& m, HalfedgeId h) {
  const HalfedgeId n = m.next[at(h)];
  if (is_perpendicular(m, n)) return n >> 1;
  return m.next[at(n)] >> 1;
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

// s and s2 are the halves, in a symmetric face that a flip restored, of its side edges; s is the
// one of copy 1 or not. They and their outer faces get the labels 1 and 2.
void restore_sides(IntrinsicMesh& m, HalfedgeId s, HalfedgeId s2, bool s_is_one) {
  pair_by_reflection(m, s, s2);
  const HalfedgeId one = s_is_one ? s : s2;
  const HalfedgeId two = s_is_one ? s2 : s;
  m.face_label[at(m.face[at(one ^ 1)])] = FaceLabel::kOne;
  m.face_label[at(m.face[at(two ^ 1)])] = FaceLabel::kTwo;
  m.edge_label[at(one >> 1)] = EdgeLabel::kOne;
  m.edge_label[at(two >> 1)] = EdgeLabel::kTwo;
}

// Whether the side half-edge s of a symmetric triangle, or of a half of a quadrilateral, lies in
// copy 1: told by the perpendicular edge beside it. A half whose perpendicular edge is w reads (w,
// side) or (side, w) around the corner.
bool side_is_one(const IntrinsicMesh& m, HalfedgeId s) {
  const HalfedgeId n = m.next[at(s)];
  // s ends where n starts: if n leaves copy 1, that corner is in copy 1.
  if (is_perpendicular(m, n)) return m.leaves_one(n);
  return !m.leaves_one(m.next[at(n)]);
}

// The half of edge e that lies in face f (the even one if both do).
HalfedgeId half_in_face(const IntrinsicMesh& m, EdgeId e, FaceId f) {
  return m.face[at(2 * e)] == f ? 2 * e : 2 * e + 1;
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
      if (quad_corner(m, 2 * e).diagonal == (quad_corner(m, 2 * e + 1).diagonal ^ 1))
        return std::nullopt;
      return FlipType::kQuadQuad;
    case EdgeLabel::kOne:
      if (symmetric(lf) && symmetric(lg)) return std::nullopt;
      if (!symmetric(lf) && !symmetric(lg)) return FlipType::kInterior;
      return lf == FaceLabel::kQuad || lg == FaceLabel::kQuad ? FlipType::kQuad
                                                              : FlipType::kTriangle;
  }
  return std::nullopt;
}

FlipStencil flip_stencil(const IntrinsicMesh& m, EdgeId e, FlipType type) {
  FlipStencil s;
  s.type = type;
  s.e = e;
  const HalfedgeId h0 = 2 * e;
  const auto set_plain = [&s](EdgeId a, EdgeId b = kInvalid, EdgeId c = kInvalid) {
    s.plain.edges = {a, b, c};
    s.plain.count = b == kInvalid ? 1 : c == kInvalid ? 2 : 3;
  };
  switch (type) {
    case FlipType::kInterior:
    case FlipType::kParallel:
    case FlipType::kPerpendicular: {
      const HalfedgeId hn = m.next[at(h0)];
      const HalfedgeId on = m.next[at(h0 + 1)];
      s.jk = hn >> 1;
      s.ki = m.next[at(hn)] >> 1;
      s.im = on >> 1;
      s.mj = m.next[at(on)] >> 1;
      s.new_side = e;
      if (type == FlipType::kInterior && m.symmetric()) {
        s.new_side2 = m.reflection[at(h0)] >> 1;
        set_plain(e, s.new_side2);
      } else {
        set_plain(e);
      }
      return s;
    }
    case FlipType::kTriangle: {
      const bool first = m.face_label[at(m.face[at(h0)])] == FaceLabel::kTriangle;
      const HalfedgeId h = first ? h0 : h0 + 1;
      const HalfedgeId r = m.reflection[at(h)];
      const HalfedgeId on = m.next[at(h ^ 1)];
      const HalfedgeId op = m.next[at(on)];
      const bool ends_at_apex = m.next[at(h)] == r;  // h: a -> c
      s.w = (ends_at_apex ? m.next[at(r)] : m.next[at(h)]) >> 1;
      s.x = (ends_at_apex ? on : op) >> 1;
      s.y = (ends_at_apex ? op : on) >> 1;
      s.new_diagonal = e;
      s.new_cross = r >> 1;
      set_plain(e, s.new_cross);
      return s;
    }
    case FlipType::kTriangleQuad: {
      const bool first = m.face_label[at(m.face[at(h0)])] == FaceLabel::kQuad;
      const HalfedgeId q = first ? h0 : h0 + 1;
      const QuadCorner corner = quad_corner(m, q);
      s.y = m.next[at(q ^ 1)] >> 1;
      s.x = corner.other >> 1;
      s.diagonal = corner.diagonal >> 1;
      s.w = perpendicular_in(m, corner.diagonal ^ 1);
      s.new_side = e;
      s.new_side2 = s.diagonal;
      set_plain(e, s.diagonal);
      return s;
    }
    case FlipType::kQuad: {
      const bool first = m.face_label[at(m.face[at(h0)])] == FaceLabel::kQuad;
      const HalfedgeId h = first ? h0 : h0 + 1;
      const QuadCorner corner = quad_corner(m, h);
      const HalfedgeId on = m.next[at(h ^ 1)];
      const HalfedgeId op = m.next[at(on)];
      // a is the end of h at which its triangle has a perpendicular edge.
      const bool starts_at_a = corner.diagonal_follows;
      s.w = corner.other >> 1;
      s.diagonal = corner.diagonal >> 1;
      s.v = perpendicular_in(m, corner.diagonal ^ 1);
      s.x = (starts_at_a ? on : op) >> 1;
      s.y = (starts_at_a ? op : on) >> 1;
      s.new_diagonal = e;
      s.new_diagonal2 = m.reflection[at(h)] >> 1;
      s.new_cross = s.diagonal;
      set_plain(e, s.new_diagonal2, s.diagonal);
      return s;
    }
    case FlipType::kQuadQuad: {
      const QuadCorner a = quad_corner(m, h0);
      const QuadCorner c = quad_corner(m, h0 + 1);
      s.x = a.other >> 1;
      s.y = c.other >> 1;
      s.diagonal = a.diagonal >> 1;
      s.diagonal2 = c.diagonal >> 1;
      s.w = perpendicular_in(m, a.diagonal ^ 1);
      s.v = perpendicular_in(m, c.diagonal ^ 1);
      // If the diagonals leave e at different ends, e turns into the new diagonal, else the first
      // diagonal does.
      const bool different_ends = a.diagonal_follows == c.diagonal_follows;
      s.new_diagonal = different_ends ? e : s.diagonal;
      s.new_side = different_ends ? s.diagonal : e;
      s.new_side2 = s.diagonal2;
      set_plain(e, s.diagonal, s.diagonal2);
      return s;
    }
  }
  return s;
}

void flip_symmetrically(IntrinsicMesh& m, const FlipStencil& s) {
  const bool left_was_one =
      m.symmetric() && m.face_label[at(m.face[at(2 * s.e)])] == FaceLabel::kOne;
  const bool cross_was_inside =
      s.new_cross != kInvalid &&
      m.face_label[at(m.face[at(2 * s.new_cross)])] == FaceLabel::kTriangle;
  for (const EdgeId e : s.plain) flip_edge(m, e);
  if (!m.symmetric()) return;
  const HalfedgeId h = 2 * s.e;
  switch (s.type) {
    case FlipType::kInterior: {
      // Both copies turned counter-clockwise, the mirror image of which is clockwise: the halves
      // change partners.
      pair_by_reflection(m, h, m.reflection[at(h)] ^ 1);
      return;
    }
    case FlipType::kParallel:
      // The even half starts at the apex of what was the odd half's face.
      make_perpendicular(m, s.e, left_was_one);
      label_both_faces(m, s.e, FaceLabel::kTriangle);
      return;
    case FlipType::kPerpendicular: {
      m.edge_label[at(s.e)] = EdgeLabel::kParallel;
      m.reflection[at(h)] = h + 1;
      m.reflection[at(h + 1)] = h;
      // The face of the even half keeps the vertex from which that half started.
      const bool one = m.starts_in_two[at(s.e)] == 0;
      const FaceLabel left = one ? FaceLabel::kOne : FaceLabel::kTwo;
      const FaceLabel right = one ? FaceLabel::kTwo : FaceLabel::kOne;
      m.face_label[at(m.face[at(h)])] = left;
      m.face_label[at(m.face[at(h + 1)])] = right;
      return;
    }
    case FlipType::kTriangle: {
      label_both_faces(m, s.new_cross, FaceLabel::kTriangle);
      label_both_faces(m, s.new_diagonal, FaceLabel::kQuad);
      // The mirror image of e was turned last; its half in t got b' (copy 2) as origin.
      make_perpendicular(m, s.new_cross, cross_was_inside);
      make_diagonal(m, s.new_diagonal);
      return;
    }
    case FlipType::kTriangleQuad: {
      // The face between the two flipped edges is the symmetric triangle.
      const FaceId f = m.face[at(2 * s.new_side2)];
      const FaceId g = m.face[at(2 * s.new_side2 + 1)];
      const bool shares = m.face[at(h)] == f || m.face[at(h + 1)] == f;
      const FaceId t = shares ? f : g;
      m.face_label[at(t)] = FaceLabel::kTriangle;
      const HalfedgeId side = half_in_face(m, s.new_side, t);
      restore_sides(m, side, half_in_face(m, s.new_side2, t), side_is_one(m, side));
      return;
    }
    case FlipType::kQuad: {
      label_both_faces(m, s.new_diagonal, FaceLabel::kQuad);
      label_both_faces(m, s.new_diagonal2, FaceLabel::kQuad);
      make_diagonal(m, s.new_diagonal);
      make_diagonal(m, s.new_diagonal2);
      // Of the two diagonals, that of the flipped edge of copy 1 touches b, the other one b'.
      const QuadCorner corner = quad_corner(m, 2 * s.new_cross);
      const bool touches_one = (corner.diagonal >> 1) == s.e;
      make_perpendicular(m, s.new_cross, touches_one == corner.diagonal_follows);
      return;
    }
    case FlipType::kQuadQuad: {
      label_both_faces(m, s.new_diagonal, FaceLabel::kQuad);
      make_diagonal(m, s.new_diagonal);
      const FaceId f = m.face[at(2 * s.new_diagonal)];
      const FaceId g = m.face[at(2 * s.new_diagonal + 1)];
      const auto half_in_quad = [&](EdgeId e) {
        const FaceId side = m.face[at(2 * e)];
        return side == f || side == g ? 2 * e : 2 * e + 1;
      };
      const HalfedgeId side = half_in_quad(s.new_side);
      restore_sides(m, side, half_in_quad(s.new_side2), side_is_one(m, side));
      return;
    }
  }
}

}  // namespace flipfree::intrinsic
