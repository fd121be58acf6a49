#include "flipfree/certify/measures.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/plane.h"
#include "flipfree/base/tolerances.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::certify {

namespace {

// The least value with at least `share` of the weights at or below it; pairs of value and weight.
double percentile(std::vector<std::pair<double, double>> weighted, double share) {
  // Not finite sorts last: values that cannot be compared would make the order undefined.
  for (auto& [value, weight] : weighted) {
    if (!(value <= std::numeric_limits<double>::max()))
      value = std::numeric_limits<double>::infinity();
  }
  std::sort(weighted.begin(), weighted.end());
  double sum = 0.0;
  double reached = std::numeric_limits<double>::quiet_NaN();
  for (const auto& [value, weight] : weighted) {
    reached = value;
    sum += weight;
    if (sum >= share) break;
  }
  return reached;
}

using numeric::Pair;

// x - y exactly (Knuth's two-sum), and the only such pair: equal differences give equal pairs.
Pair difference(double x, double y) {
  const double high = x - y;
  const double back = x - high;
  return {high, (x - (high + back)) + (back - y)};
}

Pair product(const Pair& x, const Pair& y) {
  const Pair main = numeric::two_product(x.high, y.high);
  const double low = main.low + (x.high * y.low + x.low * y.high);
  return {main.high, low + x.low * y.low};
}

// Twice the area of a triangle so thin that its cross product has no correct digit in doubles.
double thin_area(const Vector2& p, const Vector2& q, const Vector2& r) {
  const Pair first = product(difference(q.x(), p.x()), difference(r.y(), p.y()));
  const Pair second = product(difference(q.y(), p.y()), difference(r.x(), p.x()));
  return (first.high - second.high) + (first.low - second.low);
}

// What has no shape has no distortion: no weight, unless nothing has any.
void leave_out_shapeless(const mesh::Surface& surface, Points3& parts) {
  const std::vector<FaceId> shapeless = mesh::shapeless_faces(surface.vertices, surface.faces);
  if (shapeless.size() == static_cast<std::size_t>(parts.rows())) return;
  for (const FaceId f : shapeless) parts(f, 2) = 0.0;
}

}  // namespace

Points3 symmetric_dirichlet_parts(const mesh::Surface& surface, const Points2& corner_uv,
                                  double aspect) {
  Points3 parts(surface.faces.rows(), 3);
  for (FaceId f = 0; f < surface.faces.rows(); ++f) {
    const auto [a, b, c] = surface.corners(f);
    const Vector3 e1 = b - a, e2 = c - a;
    const Vector2 q = corner_uv.row(3 * f);
    Vector2 d1 = corner_uv.row(3 * f + 1).transpose() - q;
    Vector2 d2 = corner_uv.row(3 * f + 2).transpose() - q;
    const double area2 = aspect * cross(d1, d2);
    d1.x() *= aspect;
    d2.x() *= aspect;
    // |J|^2 is a ratio of dot products and areas (Pinkall and Polthier 1993), |J^-1|^2 the same
    // with the roles swapped; for 2 x 2 matrices |J^-1| = |J| / det J.
    const double area3 = e1.cross(e2).norm();
    const double numerator = d1.squaredNorm() * e2.squaredNorm() - 2.0 * d1.dot(d2) * e1.dot(e2) +
                             d2.squaredNorm() * e1.squaredNorm();
    const double norm = numerator / (area3 * area3);
    parts(f, 0) = norm;
    if (area2 > 0.0) {
      parts(f, 1) = numerator / (area2 * area2);
    } else {
      const double area = aspect * thin_area(q, corner_uv.row(3 * f + 1).transpose(),
                                             corner_uv.row(3 * f + 2).transpose());
      parts(f, 1) = area > 0.0 ? numerator / area / area : std::numeric_limits<double>::infinity();
    }
    parts(f, 2) = 0.5 * area3;
  }
  leave_out_shapeless(surface, parts);
  return parts;
}

EnergyFigures symmetric_dirichlet(const mesh::Surface& surface, const Points2& corner_uv,
                                  double aspect) {
  const Points3 parts = symmetric_dirichlet_parts(surface, corner_uv, aspect);
  double direct = 0.0;
  double inverse = 0.0;
  double area = 0.0;
  for (Eigen::Index f = 0; f < parts.rows(); ++f) {
    if (!(parts(f, 2) > 0.0)) continue;
    direct += parts(f, 2) * parts(f, 0);
    inverse += parts(f, 2) * parts(f, 1);
    area += parts(f, 2);
  }
  EnergyFigures figures;
  // direct s^2 + inverse / s^2 is smallest at s^4 = inverse / direct.
  figures.mean = 2.0 * std::sqrt(direct) * std::sqrt(inverse) / (4.0 * area);
  figures.scale = std::sqrt(std::sqrt(inverse) / std::sqrt(direct));
  const double s2 = figures.scale * figures.scale;
  std::vector<std::pair<double, double>> of_face;  // energy, area
  of_face.reserve(static_cast<std::size_t>(parts.rows()));
  for (Eigen::Index f = 0; f < parts.rows(); ++f) {
    if (!(parts(f, 2) > 0.0)) continue;
    of_face.emplace_back((parts(f, 0) * s2 + parts(f, 1) / s2) / 4.0, parts(f, 2));
    figures.maximum = std::max(figures.maximum, of_face.back().first);
  }
  figures.percentile99 = percentile(std::move(of_face), 0.99 * area);
  return figures;
}

EnergyFigures worse_of(const EnergyFigures& a, const EnergyFigures& b) {
  EnergyFigures worse = b.mean <= a.mean ? a : b;
  worse.maximum = std::max(a.maximum, b.maximum);
  worse.percentile99 = std::max(a.percentile99, b.percentile99);
  return worse;
}

namespace {

template <typename Matrix>
std::vector<FaceId> collect(const Matrix& uv) {
  std::vector<FaceId> flipped;
  for (FaceId f = 0; f < uv.rows() / 3; ++f) {
    const auto* a = uv.data() + 6 * static_cast<std::ptrdiff_t>(f);
    const bool finite = uv.template middleRows<3>(3 * f).allFinite();
    if (!finite || numeric::orientation(a, a + 2, a + 4) <= 0) flipped.push_back(f);
  }
  return flipped;
}

}  // namespace

std::vector<FaceId> flipped_faces(const Points2& corner_uv) { return collect(corner_uv); }
std::vector<FaceId> flipped_faces(const Points2f& corner_uv) { return collect(corner_uv); }

namespace {

// The weights of a vertex in a face of the parent; none if it does not lie in that face.
std::optional<Vector3> weights_in(const Provenance& provenance, VertexId v, FaceId f) {
  const Triangles& faces = provenance.parent->faces;
  Vector3 weights = Vector3::Zero();
  const auto add = [&](VertexId corner, double weight) {
    for (Index k = 0; k < 3; ++k) {
      if (faces(f, k) != corner) continue;
      weights[k] += weight;
      return true;
    }
    return weight == 0.0;
  };
  bool inside = true;
  if (v < provenance.parent->vertices.rows()) {
    inside = add(v, 1.0);
  } else {
    const FaceId own = (*provenance.vertex_parent)[at(v)];
    const Vector3 given = provenance.vertex_barycentric->row(v);
    if (own == f) return given;
    inside = own >= 0 && own < faces.rows();
    for (Index k = 0; k < 3 && inside; ++k) inside = add(faces(own, k), given[k]);
  }
  return inside ? std::optional(weights) : std::nullopt;
}

struct Checker {
  const mesh::Surface& refined;
  const Provenance& provenance;
  ProvenanceReport report;
  void fail(const std::string& what, FaceId face) {
    if (report.failures++ == 0) report.first = what;
    if (face != kInvalid && report.faces.size() < kMostElements) report.faces.push_back(face);
  }

  bool shapes_fit() const {
    const auto faces = static_cast<std::size_t>(refined.faces.rows());
    const auto vertices = static_cast<std::size_t>(refined.vertices.rows());
    return provenance.parent_face->size() == faces &&
           provenance.vertex_parent->size() == vertices &&
           provenance.vertex_barycentric->rows() == refined.vertices.rows() &&
           refined.vertices.rows() >= provenance.parent->vertices.rows();
  }

  void check_vertices() {
    const mesh::Surface& parent = *provenance.parent;
    const Eigen::Index kept = parent.vertices.rows();
    for (Eigen::Index v = 0; v < refined.vertices.rows(); ++v) {
      if (v < kept) {
        if (refined.vertices.row(v) != parent.vertices.row(v)) {
          fail("vertex " + vertex_id(v) + " of the input was moved", kInvalid);
        }
        continue;
      }
      const FaceId f = (*provenance.vertex_parent)[at(v)];
      const Vector3 weights = provenance.vertex_barycentric->row(v);
      if (f < 0 || f >= parent.faces.rows() || !(weights.minCoeff() >= 0.0) ||
          !(std::abs(weights.sum() - 1.0) <= kProvenanceTolerance)) {
        fail("added vertex " + vertex_id(v) + " has no valid place in an input face", kInvalid);
        continue;
      }
      Vector3 expected = Vector3::Zero();
      double size = 0.0;
      for (Index k = 0; k < 3; ++k) {
        expected += weights[k] * parent.vertices.row(parent.faces(f, k)).transpose();
        size = std::max(size, parent.vertices.row(parent.faces(f, k)).cwiseAbs().maxCoeff());
      }
      // (The largest of some coefficients, one of them NaN, may be any.)
      const Vector3 off = refined.vertices.row(v).transpose() - expected;
      if (!off.allFinite() || !(off.cwiseAbs().maxCoeff() <= kProvenanceTolerance * size)) {
        fail("added vertex " + vertex_id(v) + " does not lie where its weights say", kInvalid);
      }
    }
  }

  void check_faces() {
    const mesh::Surface& parent = *provenance.parent;
    std::vector<double> covered(static_cast<std::size_t>(parent.faces.rows()), 0.0);
    std::vector<FaceId> first(covered.size(), kInvalid);
    for (FaceId f = 0; f < refined.faces.rows(); ++f) {
      const FaceId p = (*provenance.parent_face)[at(f)];
      if (p < 0 || p >= parent.faces.rows()) {
        fail("face " + face_id(f) + " has no parent face", f);
        continue;
      }
      FaceId& first_part = first[at(p)];
      if (first_part == kInvalid) first_part = f;
      const auto a = weights_in(provenance, refined.faces(f, 0), p);
      const auto b = weights_in(provenance, refined.faces(f, 1), p);
      const auto c = weights_in(provenance, refined.faces(f, 2), p);
      if (!a || !b || !c) {
        fail("face " + face_id(f) + " leaves its parent face " + face_id(p), f);
        continue;
      }
      const double area = twice_area(a->head<2>(), b->head<2>(), c->head<2>());
      if (!(area >= -kProvenanceTolerance)) {
        fail("face " + face_id(f) + " is turned over within its parent face " + face_id(p), f);
      }
      covered[at(p)] += area;
    }
    for (std::size_t p = 0; p < covered.size(); ++p) {
      if (!(std::abs(covered[p] - 1.0) <= kProvenanceTolerance)) {
        fail("input face " + face_id(p) + " is not covered exactly once by its parts", first[p]);
      }
    }
  }

  // Every edge glued as the parent's surface is there. For faces that passed check_faces().
  void check_gluing() {
    const mesh::Adjacency& adjacency = refined.adjacency();
    const mesh::Adjacency& across = provenance.parent->adjacency();
    const auto neighbour = [](const mesh::Adjacency& of, HalfedgeId h) {
      const HalfedgeId o = of.opposite[at(h)];
      return o == kInvalid ? kInvalid : o / 3;
    };
    for (FaceId f = 0; f < refined.faces.rows(); ++f) {
      const FaceId p = (*provenance.parent_face)[at(f)];
      Vector3 corner[3];
      for (Index k = 0; k < 3; ++k) corner[k] = *weights_in(provenance, refined.faces(f, k), p);
      for (Index k = 0; k < 3; ++k) {
        const FaceId other = neighbour(adjacency, 3 * f + k);
        const FaceId parent = other == kInvalid ? kInvalid : (*provenance.parent_face)[at(other)];
        bool glued = parent == p;
        for (Index m = 0; m < 3 && !glued; ++m) {
          const bool along_side = corner[k][m] <= kProvenanceTolerance &&
                                  corner[(k + 1) % 3][m] <= kProvenanceTolerance;
          glued = along_side && parent == neighbour(across, 3 * p + (m + 1) % 3);
        }
        if (!glued) {
          fail("face " + face_id(f) + " is torn off at the edge of vertices " +
                   vertex_id(refined.faces(f, k)) + " and " +
                   vertex_id(refined.faces(f, (k + 1) % 3)),
               f);
        }
      }
    }
  }
};

}  // namespace

ProvenanceReport check_provenance(const mesh::Surface& refined, const Provenance& provenance) {
  Checker checker{refined, provenance, {}};
  if (!checker.shapes_fit()) {
    checker.fail("the provenance arrays do not have the sizes of the refined mesh", kInvalid);
    return checker.report;
  }
  checker.check_vertices();
  checker.check_faces();
  if (checker.report.failures == 0) checker.check_gluing();
  return checker.report;
}

namespace {

// The quadrant of the direction from o to p: [0, pi/2) is 0, and so on; a quarter turn takes each
// to the next one exactly.
Index quadrant(const Points2& uv, CornerId o, CornerId p) {
  const bool right = uv(p, 0) > uv(o, 0);
  const bool left = uv(p, 0) < uv(o, 0);
  const bool above = uv(p, 1) > uv(o, 1);
  const bool below = uv(p, 1) < uv(o, 1);
  if (right && !below) return 0;
  if (above && !right) return 1;
  if (left && !above) return 2;
  return 3;
}

// Those that the corner's sides enter from the first to the second: a positive corner turns by less
// than half a turn, into at most two further quadrants.
Index entered_by(const Points2& uv, CornerId c) {
  return (quadrant(uv, c, previous_corner(c)) - quadrant(uv, c, next_corner(c)) + 4) % 4;
}

}  // namespace

std::vector<Index> quarter_turns_around(const mesh::Adjacency& adjacency,
                                        const Points2& corner_uv) {
  std::vector<Index> turns(adjacency.vertex_halfedge.size(), kInvalid);
  for (std::size_t v = 0; v < turns.size(); ++v) {
    const HalfedgeId start = adjacency.vertex_halfedge[v];
    if (start == kInvalid || adjacency.opposite[at(start)] == kInvalid) continue;
    turns[v] = 0;
    mesh::for_each_outgoing(adjacency, static_cast<VertexId>(v),
                            [&](HalfedgeId h) { turns[v] += entered_by(corner_uv, h); });
  }
  return turns;
}

Index quarter_turns_along(const mesh::Adjacency& adjacency, const Points2& corner_uv,
                          const std::vector<HalfedgeId>& strip) {
  const auto count = static_cast<HalfedgeId>(adjacency.opposite.size());
  Index total = 0;
  for (std::size_t i = 0; i < strip.size(); ++i) {
    const HalfedgeId leaving = strip[(i + 1) % strip.size()];
    if (strip[i] < 0 || strip[i] >= count || leaving < 0 || leaving >= count) return kNoStrip;
    const HalfedgeId entered = adjacency.opposite[at(strip[i])];
    if (entered == kInvalid || entered / 3 != leaving / 3 || entered == leaving) return kNoStrip;
    // The corner between both edges: on the left hand it is where the entered one begins.
    const bool right = leaving == next_corner(entered);
    total += right ? -entered_by(corner_uv, leaving) : entered_by(corner_uv, entered);
  }
  return total;
}

namespace {

// A vector between two corners.
struct Vector {
  Pair x;
  Pair y;
};
bool equal(const Pair& a, const Pair& b) { return a.high == b.high && a.low == b.low; }
bool equal(const Vector& a, const Vector& b) { return equal(a.x, b.x) && equal(a.y, b.y); }
Vector vector(const Points2& uv, CornerId from, CornerId to) {
  return {difference(uv(to, 0), uv(from, 0)), difference(uv(to, 1), uv(from, 1))};
}
Vector turned(const Vector& a) { return {{-a.y.high, -a.y.low}, a.x}; }

double distance(const Vector& a, const Vector& b) {
  return std::hypot((a.x.high - b.x.high) + (a.x.low - b.x.low),
                    (a.y.high - b.y.high) + (a.y.low - b.y.low));
}

}  // namespace

std::vector<SeamMeasure> measure_seams(const mesh::Adjacency& adjacency,
                                       const mesh::EdgeFlags& cuts, const Points2& corner_uv) {
  std::vector<SeamMeasure> measures;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cuts.size()); ++h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o < h || !cuts[at(h)]) continue;
    Vector here = vector(corner_uv, h, next_corner(h));
    // The same edge seen from the other side, in the same direction.
    const Vector there = vector(corner_uv, next_corner(o), o);
    SeamMeasure best{h, 0, {}, std::numeric_limits<double>::infinity()};
    for (Index turns = 0; turns < 4; ++turns, here = turned(here)) {
      const double off = equal(here, there) ? 0.0
                                            : std::max(distance(here, there),
                                                       std::numeric_limits<double>::denorm_min());
      if (off >= best.deviation) continue;
      best.deviation = off;
      best.quarter_turns = turns;
    }
    Vector2 image = corner_uv.row(h);
    for (Index i = 0; i < best.quarter_turns; ++i) image = Vector2(-image.y(), image.x());
    best.translation = corner_uv.row(next_corner(o)).transpose() - image;
    measures.push_back(best);
  }
  return measures;
}

std::vector<HalfedgeId> seam_failures(const mesh::Adjacency& adjacency, const mesh::EdgeFlags& cuts,
                                      const Points2& corner_uv) {
  std::vector<HalfedgeId> failures;
  for (const SeamMeasure& seam : measure_seams(adjacency, cuts, corner_uv)) {
    if (seam.deviation != 0) failures.push_back(seam.h);
  }
  return failures;
}

std::vector<VertexId> winding_failures(const mesh::Adjacency& adjacency,
                                       const mesh::EdgeFlags& cuts, const Points2& corner_uv) {
  const std::vector<Index> turns = quarter_turns_around(adjacency, corner_uv);
  std::vector<VertexId> failures;
  for (std::size_t v = 0; v < turns.size(); ++v) {
    if (turns[v] == kInvalid || turns[v] == 4) continue;
    bool uncut = true;
    mesh::for_each_outgoing(adjacency, static_cast<VertexId>(v),
                            [&](HalfedgeId h) { uncut = uncut && !cuts[at(h)]; });
    if (uncut) failures.push_back(static_cast<VertexId>(v));
  }
  return failures;
}

void require_corners(const std::vector<CornerPin>& pins, Index corners) {
  for (const CornerPin& pin : pins) {
    if (pin.corner >= 0 && pin.corner < corners) continue;
    throw_invalid(ErrorCode::kBadPins, "A pin names corner " + corner_id(pin.corner) +
                                           ", which does not exist. Pin corners of the mesh.");
  }
}

void require_storable_pins(const std::vector<CornerPin>& pins, Index corners) {
  require_corners(pins, corners);
  for (const CornerPin& pin : pins) {
    if (is_storable(pin.uv)) continue;
    throw_invalid(ErrorCode::kBadPins,
                  "The pin of corner " + corner_id(pin.corner) +
                      " is at a place that UVs cannot store (up to 3.4e38). Correct it.",
                  ElementKind::kCorner, {pin.corner});
  }
}

namespace {

using EdgeEnds = std::pair<VertexId, VertexId>;

// A side of an edge of the map's surface that lies on a feature.
struct Piece {
  Index feature = kInvalid;
  double from = 0.0, to = 0.0;  // shares of the way along the feature
  HalfedgeId h = kInvalid;
};

// By feature, and by where they begin. A row that names its edge the other way round has the
// direction of the lower vertex first as well.
std::vector<Piece> pieces_of(const IndexPairs& features, const mesh::Surface& surface,
                             const mesh::Adjacency& adjacency, const Provenance& provenance) {
  std::vector<std::pair<EdgeEnds, Index>> wanted;
  for (Eigen::Index i = 0; i < features.rows(); ++i)
    wanted.emplace_back(std::minmax(features(i, 0), features(i, 1)), static_cast<Index>(i));
  std::sort(wanted.begin(), wanted.end());
  std::vector<Piece> found;
  const auto add = [&](EdgeEnds edge, double from, double to, HalfedgeId h) {
    if (edge.first > edge.second) {
      std::swap(edge.first, edge.second);
      from = 1.0 - from;
      to = 1.0 - to;
    }
    for (auto i = std::lower_bound(wanted.begin(), wanted.end(), std::pair(edge, Index{0}));
         i != wanted.end() && i->first == edge; ++i)
      found.push_back({i->second, std::min(from, to), std::max(from, to), h});
  };
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(3 * surface.faces.rows()); ++h) {
    const VertexId source = mesh::source(surface.faces, h), target = mesh::target(surface.faces, h);
    if (provenance.parent == nullptr) {
      add({source, target}, 0.0, 1.0, h);
      continue;
    }
    const FaceId f = (*provenance.parent_face)[at(h / 3)];
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o != kInvalid && (*provenance.parent_face)[at(o / 3)] == f) continue;
    const auto begin = weights_in(provenance, source, f), end = weights_in(provenance, target, f);
    for (int k = 0; k < 3 && begin && end; ++k) {
      const int next = (k + 1) % 3;
      const auto on = [&](const Vector3& w) {
        return w[k] + w[next] >= 1.0 - kProvenanceTolerance;
      };
      const double from = (*begin)[next], to = (*end)[next];
      if (on(*begin) && on(*end) && from < to)
        add({provenance.parent->faces(f, k), provenance.parent->faces(f, next)}, from, to, h);
    }
  }
  std::sort(found.begin(), found.end(), [](const Piece& a, const Piece& b) {
    return std::pair(a.feature, a.from) < std::pair(b.feature, b.from);
  });
  return found;
}

// Whether the corners on the left between two sides of one boundary, the first of which ends where
// the second begins, make half a turn.
bool goes_straight(HalfedgeId in, HalfedgeId out, const mesh::Adjacency& adjacency,
                   const Points2& uv) {
  double turned = 0.0;
  const HalfedgeId first = next_corner(in);
  HalfedgeId h = first;
  do {
    turned += corner_angle(uv, h);
    if (h == out) return std::lround(turned / kQuarterTurn) == 2;
    const HalfedgeId o = adjacency.opposite[at(h)];
    h = o == kInvalid ? kInvalid : next_corner(o);
  } while (h != kInvalid && h != first);
  return false;
}

}  // namespace

double corner_angle(const Points2& corner_uv, CornerId c) {
  const auto p = corner_uv.row(c);
  return turn(corner_uv.row(next_corner(c)) - p, corner_uv.row(previous_corner(c)) - p);
}

void throw_no_edge(VertexId a, VertexId b, Eigen::Index vertex_count) {
  mesh::throw_no_edge("Feature " + vertex_id(a) + "-" + vertex_id(b) +
                          " is no edge of the mesh. Name pairs of vertices that an edge joins.",
                      a, b, static_cast<Index>(vertex_count));
}

std::vector<Index> missed_features(const IndexPairs& features, const mesh::Surface& surface,
                                   const mesh::Adjacency& adjacency, const Provenance& parent,
                                   const Points2& corner_uv) {
  std::vector<char> found(static_cast<std::size_t>(features.rows()), 0);
  std::vector<char> bent(found.size(), 0);
  const std::vector<Piece> pieces = pieces_of(features, surface, adjacency, parent);
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const Piece& piece = pieces[i];
    found[at(piece.feature)] = 1;
    const auto from = corner_uv.row(piece.h), to = corner_uv.row(next_corner(piece.h));
    if (from.x() != to.x() && from.y() != to.y()) bent[at(piece.feature)] = 1;
    // The next piece of this side begins where this one ends.
    for (std::size_t k = i + 1; k < pieces.size() && pieces[k].feature == piece.feature &&
                                pieces[k].from <= piece.to + kProvenanceTolerance;
         ++k) {
      const HalfedgeId h = piece.h, n = pieces[k].h;
      const bool goes_on = mesh::target(surface.faces, h) == mesh::source(surface.faces, n);
      const bool goes_back = mesh::target(surface.faces, n) == mesh::source(surface.faces, h);
      if (goes_on == goes_back) continue;
      if (!goes_straight(goes_on ? h : n, goes_on ? n : h, adjacency, corner_uv))
        bent[at(piece.feature)] = 1;
    }
  }
  std::vector<Index> missed;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    if (found[i] == 0)
      throw_no_edge(features(row, 0), features(row, 1),
                    (parent.parent == nullptr ? surface : *parent.parent).vertices.rows());
    if (bent[i] != 0) missed.push_back(static_cast<Index>(i));
  }
  return missed;
}

}  // namespace flipfree::certify
