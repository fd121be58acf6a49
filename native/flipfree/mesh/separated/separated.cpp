#include "flipfree/mesh/separated/separated.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/base/random.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/mesh/islands.h"
#include "flipfree/mesh/separated/edge_pairs.h"
#include "flipfree/mesh/validate.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::mesh {

namespace {

// One winding for every part of a surface.

struct Orientation {
  std::vector<char> turned;  // #F: the face is to be turned over
  // Lower half-edges of the mates that were undone, ascending: of surfaces with one side, and
  // others. Those of crowded edges are not among them.
  std::vector<HalfedgeId> one_sided, opposed;
  std::vector<EdgeUse> undone;  // all of them
};

// Parts are faces joined by mates, but not at seams (3 #F). Within each, faces are turned until
// mates run in opposite directions; the least area is turned, the first face stays if both ways
// are equal. Mates that still run in one direction are undone:
//   - at seams;
//   - where faces contradict each other that are joined by others which all agree (a Moebius strip
//     that is wound along); what then still comes back to itself from its other side is cut
//     between the fronts of a breadth-first walk.
// With a map of the faces (3 #F x 2, or null), parts that hang together with contradicting windings
// or crowded edges, across seams too, are turned until most of their area in the map is positive:
// which way they were meant is not to be known. Mates within a polygon (input.polygon) are undone
// only if that alone has one side. Cost: O(#F).
class Orienter {
 public:
  Orienter(const PairingInput& input, EdgePairs& pairs)
      : input_(input),
        faces_(input.faces),
        closed_(input.at_seam),
        pairs_(pairs),
        mate_(pairs.mate) {
    // Areas are compared only: in a unit in which they neither overflow nor vanish.
    const double extent =
        input_.positions.size() == 0 ? 0.0 : input_.positions.cwiseAbs().maxCoeff();
    unit_ = extent > 0.0 ? 1.0 / extent : 1.0;
    if (!std::isfinite(unit_)) unit_ = 1.0;
    side_.assign(at(faces_.rows()), kUnknown);
    if (input_.has_map()) find_contradictions();
  }

  Orientation run(const ExecutionContext& context) {
    if (!input_.has_map()) close_where_regions_contradict_themselves();
    constexpr Index kCheckEvery = 1 << 14;
    for (FaceId f = 0; f < faces_.rows(); ++f) {
      if (f % kCheckEvery == 0) context.check();
      if (side_[at(f)] == kUnknown) orient_part(f);
    }
    Orientation result;
    result.turned = side_;
    const std::vector<HalfedgeId> opposed = opposed_mates();
    if (!opposed.empty()) list(opposed, result);
    for (const HalfedgeId h : opposed) {
      const HalfedgeId o = std::exchange(mate_[at(h)], kInvalid);
      mate_[at(o)] = kInvalid;
      result.undone.push_back({h, o});
    }
    return result;
  }

 private:
  static constexpr char kUnknown = 2;

  bool same_direction(HalfedgeId h, HalfedgeId o) const {
    return source(faces_, h) == source(faces_, o);
  }
  bool agree(HalfedgeId h, HalfedgeId o) const {
    return same_direction(h, o) == (side_[at(h / 3)] != side_[at(o / 3)]);
  }
  double area(FaceId f) const {
    const auto p = [&](int k) -> Vector3 { return unit_ * input_.positions.row(faces_(f, k)); };
    const Vector3 a = p(0), b = p(1), c = p(2);
    return (b - a).cross(c - a).norm();
  }

  void close(HalfedgeId h) { closed_[at(h)] = closed_[at(mate_[at(h)])] = 1; }
  bool are_of_polygon(FaceId f, FaceId g) const { return same_number(input_.polygon, f, g); }

  // Faces that all agree and still contradict each other somewhere are a surface with one side
  // (around a vertex, or a handle, contradictions are even in number): no turning helps there.
  void close_where_regions_contradict_themselves() {
    DisjointSets region(static_cast<Index>(faces_.rows()));
    std::vector<HalfedgeId> opposed;
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(mate_.size()); ++h) {
      const HalfedgeId o = mate_[at(h)];
      if (o < h || closed_[at(h)] != 0) continue;
      if (!same_direction(h, o)) {
        region.join(h / 3, o / 3);
      } else if (!are_of_polygon(h / 3, o / 3)) {
        opposed.push_back(h);
      }
    }
    for (const HalfedgeId h : opposed) {
      if (region.find(h / 3) == region.find(mate_[at(h)] / 3)) close(h);
    }
  }

  // The lower half-edges, ascending.
  std::vector<HalfedgeId> opposed_mates() const {
    std::vector<HalfedgeId> result;
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(mate_.size()); ++h) {
      if (mate_[at(h)] > h && !agree(h, mate_[at(h)])) result.push_back(h);
    }
    return result;
  }

  // By what is to be seen with a map and without: all mates across seams too, but no crowd.
  void list(const std::vector<HalfedgeId>& opposed, Orientation& result) const {
    std::vector<char> crowded(mate_.size(), 0);
    for (const EdgeUse& use : pairs_.several) {
      for (const HalfedgeId h : use) crowded[at(h)] = use.size() > 2 ? 1 : 0;
    }
    // Every face twice, once a side: f and count + f.
    const auto count = static_cast<Index>(faces_.rows());
    DisjointSets sides(2 * count);
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(mate_.size()); ++h) {
      const HalfedgeId o = mate_[at(h)];
      if (o < h || crowded[at(h)] != 0) continue;
      const Index across = same_direction(h, o) ? count : 0;
      sides.join(h / 3, o / 3 + across);
      sides.join(h / 3 + count, o / 3 + count - across);
    }
    for (const HalfedgeId h : opposed) {
      if (crowded[at(h)] != 0) continue;
      const bool one = sides.find(h / 3) == sides.find(h / 3 + count);
      (one ? result.one_sided : result.opposed).push_back(h);
    }
  }

  // Marks the faces that hang together with contradicting windings.
  void find_contradictions() {
    DisjointSets joined(static_cast<Index>(faces_.rows()));
    std::vector<FaceId> at_odds;
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(mate_.size()); ++h) {
      const HalfedgeId o = mate_[at(h)];
      if (o < h) continue;
      joined.join(h / 3, o / 3);
      if (same_direction(h, o)) at_odds.push_back(h / 3);
    }
    for (const EdgeUse& use : pairs_.several) {
      at_odds.push_back(use.front() / 3);
      for (const HalfedgeId h : use) joined.join(h / 3, use.front() / 3);
    }
    std::vector<char> twisted(side_.size(), 0);
    for (const FaceId f : at_odds) twisted[at(joined.find(f))] = 1;
    contradicted_.assign(side_.size(), 0);
    for (FaceId f = 0; f < faces_.rows(); ++f) contradicted_[at(f)] = twisted[at(joined.find(f))];
  }
  // With the exact sign, so that a part of slivers that are all positive is.
  double map_area(FaceId f) const {
    const Vector2 a = input_.corner_uv.row(3 * f);
    const Vector2 b = input_.corner_uv.row(3 * f + 1);
    const Vector2 c = input_.corner_uv.row(3 * f + 2);
    return numeric::orientation(a, b, c) *
           std::max(std::abs(cross(b - a, c - a)), std::numeric_limits<double>::min());
  }

  // The side of o's face that goes with that of h's.
  char side_across(HalfedgeId h, HalfedgeId o) const {
    return same_direction(h, o) != (side_[at(h / 3)] != 0) ? 1 : 0;
  }
  // A face, and all that is joined to it inside its polygon: no front meets another in there.
  void take(FaceId first, char side) {
    side_[at(first)] = side;
    std::size_t i = part_.size();
    part_.push_back(first);
    if (input_.polygon.empty()) return;
    for (; i < part_.size(); ++i) {
      const FaceId f = part_[i];
      for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
        const HalfedgeId o = mate_[at(h)];
        if (o == kInvalid || closed_[at(h)] != 0 || side_[at(o / 3)] != kUnknown) continue;
        if (!are_of_polygon(f, o / 3)) continue;
        side_[at(o / 3)] = side_across(h, o);
        part_.push_back(o / 3);
      }
    }
  }

  // Breadth first, so that the fronts of a one-sided part meet along a short cut.
  void orient_part(FaceId first) {
    part_.clear();
    take(first, 0);
    double kept = 0.0;
    double turned = 0.0;
    for (std::size_t i = 0; i < part_.size(); ++i) {
      const FaceId f = part_[i];
      (side_[at(f)] == 0 ? kept : turned) += area(f);
      for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
        const HalfedgeId o = mate_[at(h)];
        if (o == kInvalid || closed_[at(h)] != 0 || side_[at(o / 3)] != kUnknown) continue;
        take(o / 3, side_across(h, o));
      }
    }
    if (input_.has_map() && contradicted_[at(first)] != 0) {
      double positive = 0.0;
      for (const FaceId f : part_) positive += side_[at(f)] == 0 ? map_area(f) : -map_area(f);
      turned = positive < 0.0 ? 1.0 : 0.0;
      kept = 0.0;
    }
    if (turned > kept) {
      for (const FaceId f : part_) side_[at(f)] = side_[at(f)] == 0 ? 1 : 0;
    }
  }

  const PairingInput& input_;
  const Triangles& faces_;
  std::vector<char> closed_;  // 3 #F: no part goes on there
  const EdgePairs& pairs_;
  std::vector<HalfedgeId>& mate_;
  double unit_ = 1.0;
  std::vector<char> side_;
  std::vector<FaceId> part_;
  std::vector<char> contradicted_;  // per face, where there is a map
};

constexpr std::size_t kMostListed = 1000;

void check_meaning(const Surface& input, const SeparateOptions& options) {
  for (const Error& defect : value_defects(input)) {
    if (defect.code != ErrorCode::kRepeatedCorner) throw InvalidInput(defect);
  }
  const auto per_face = [&](const std::vector<Index>* numbers, const char* what) {
    if (numbers != nullptr && numbers->size() != at(input.faces.rows()))
      throw_invalid(ErrorCode::kBadShape, std::string(what) + " need one number per face.");
  };
  per_face(options.material, "Materials");
  per_face(options.polygon, "Polygons");
  if (options.corner_uv != nullptr && options.corner_uv->rows() != 3 * input.faces.rows())
    throw_invalid(ErrorCode::kBadShape, "A map needs one row per face corner.");
}

class Separator {
 public:
  Separator(const Surface& input, const SeparateOptions& options, const ExecutionContext& context)
      : input_(input), options_(options), context_(context) {}

  SeparatedSurface run() {
    check_meaning(input_, options_);
    drop_collapsed_faces();
    std::vector<char> at_seam =
        flag_pairs(faces_, static_cast<Index>(input_.vertices.rows()), options_.seams);
    const PairingInput pairing{input_.vertices, faces_, at_seam, material_, polygon_, corner_uv_};
    EdgePairs pairs = pair_edges(input_.vertices, faces_, context_);
    if (polygon_.empty() && options_.diagonals != nullptr && options_.diagonals->rows() > 0)
      polygon_ =
          polygons_of(faces_, static_cast<Index>(input_.vertices.rows()), *options_.diagonals);
    std::vector<HalfedgeId> crowded;
    for (const EdgeUse& use : pairs.several)
      if (use.size() > 2) crowded.push_back(use.front());
    if (!crowded.empty()) {
      // Which way faces run counts in a crowd, so that it is set right before, as far as others
      // tell it. A map has its own opinion.
      std::vector<char> turned;
      if (!pairing.has_map()) {
        EdgePairs others = pairs;
        turned = Orienter(pairing, others).run(context_).turned;
      }
      pair_crowds(pairing, turned, pairs, context_);
    }
    for (HalfedgeId h = 0; pairing.has_map() && at(h) < at_seam.size(); ++h) {
      const HalfedgeId o = pairs.mate[at(h)];
      if (o != kInvalid && !continues_in_map(faces_, corner_uv_, h, o)) at_seam[at(h)] = 1;
    }
    const Orientation orientation = Orienter(pairing, pairs).run(context_);
    list_edges(MendKind::kCrowdedEdge, crowded);
    list_edges(MendKind::kOneSidedEdge, orientation.one_sided);
    list_edges(MendKind::kOpposedEdge, orientation.opposed);
    list_faces(MendKind::kDuplicateFace, pairs.duplicate);
    std::vector<FaceId> turned;
    for (FaceId f = 0; f < faces_.rows(); ++f) {
      if (orientation.turned[at(f)] != 0) turned.push_back(f);
    }
    list_faces(MendKind::kTurnedFace, turned);
    std::vector<EdgeUse> doubtful = pairs.several;
    doubtful.insert(doubtful.end(), orientation.undone.begin(), orientation.undone.end());
    return assemble(orientation.turned, pairs.mate, std::move(doubtful), at_seam);
  }

 private:
  void drop_collapsed_faces() {
    faces_.resize(input_.faces.rows(), 3);
    Eigen::Index kept = 0;
    for (FaceId f = 0; f < input_.faces.rows(); ++f) {
      const auto face = input_.faces.row(f);
      if (face[0] == face[1] || face[1] == face[2] || face[2] == face[0]) {
        result_.collapsed.push_back(f);
        continue;
      }
      faces_.row(kept++) = face;
      result_.face_origin.push_back(f);
      if (options_.material != nullptr) material_.push_back((*options_.material)[at(f)]);
      if (options_.polygon != nullptr) polygon_.push_back((*options_.polygon)[at(f)]);
    }
    faces_.conservativeResize(kept, 3);
    if (options_.corner_uv != nullptr) {
      corner_uv_.resize(3 * kept, 2);
      for (Eigen::Index f = 0; f < kept; ++f) {
        corner_uv_.middleRows(3 * f, 3) =
            options_.corner_uv->middleRows(3 * result_.face_origin[at(f)], 3);
      }
    }
    list(MendKind::kRepeatedCorner, ElementKind::kFace, result_.collapsed);
  }

  // Half-edges of faces that are turned over, and back.
  static HalfedgeId turned_over(const std::vector<char>& turned, HalfedgeId h) {
    return turned[at(h / 3)] == 0 ? h : 3 * (h / 3) + 2 - h % 3;
  }

  SeparatedSurface assemble(const std::vector<char>& turned, const std::vector<HalfedgeId>& mate,
                            std::vector<std::vector<HalfedgeId>> doubtful,
                            const std::vector<char>& at_seam) {
    Triangles oriented = faces_;
    for (FaceId f = 0; f < faces_.rows(); ++f) {
      if (turned[at(f)] != 0) std::swap(oriented(f, 1), oriented(f, 2));
    }
    Adjacency adjacency{std::vector<HalfedgeId>(mate.size(), kInvalid), {}};
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(mate.size()); ++h) {
      if (mate[at(h)] != kInvalid)
        adjacency.opposite[at(turned_over(turned, h))] = turned_over(turned, mate[at(h)]);
    }
    std::vector<char> mended(at(static_cast<Index>(input_.vertices.rows())), 0);
    for (std::vector<HalfedgeId>& halfedges : doubtful) {
      for (HalfedgeId& h : halfedges) {
        h = turned_over(turned, h);
        mended[at(source(oriented, h))] = mended[at(target(oriented, h))] = 1;
      }
    }
    context_.check();
    Sheets sheets = make_sheets(oriented, adjacency, std::move(doubtful), polygon_);
    std::vector<HalfedgeId> parted;
    for (const HalfedgeId h : sheets.parted) {
      const HalfedgeId own = turned_over(turned, h);
      if (at_seam[at(own)] == 0) parted.push_back(own);
      mended[at(source(faces_, own))] = mended[at(target(faces_, own))] = 1;
    }
    list_edges(MendKind::kPartedEdge, parted);
    list_pinched(sheets.mesh.vertex_origin, mended);

    result_.turned = turned;
    result_.vertex_origin = std::move(sheets.mesh.vertex_origin);
    result_.surface.faces = std::move(sheets.mesh.faces);
    result_.surface.vertices = input_.vertices(result_.vertex_origin, Eigen::all);
    list_shapes();
    std::sort(result_.mends.begin(), result_.mends.end(),
              [](const Mend& a, const Mend& b) { return a.kind < b.kind; });
    return std::move(result_);
  }

  // `elements`: of the input, two vertices for an edge.
  void list(MendKind kind, ElementKind element, std::vector<Index> elements) {
    if (elements.empty()) return;
    const std::size_t count = elements.size() / (element == ElementKind::kEdge ? 2 : 1);
    elements.resize(std::min(elements.size(), kMostListed));
    result_.mends.push_back({kind, element, count, std::move(elements)});
  }
  void list_pairs(MendKind kind, const std::vector<VertexPair>& pairs) {
    std::vector<Index> elements;
    for (const auto& [low, high] : pairs) elements.insert(elements.end(), {low, high});
    list(kind, ElementKind::kEdge, std::move(elements));
  }
  void list_edges(MendKind kind, const std::vector<HalfedgeId>& halfedges) {
    std::vector<VertexPair> pairs;
    for (const HalfedgeId h : halfedges) pairs.push_back(ends(faces_, h));
    list_pairs(kind, pairs);
  }
  // Of the faces that are kept.
  void list_faces(MendKind kind, std::vector<FaceId> faces) {
    for (FaceId& f : faces) f = result_.face_origin[at(f)];
    list(kind, ElementKind::kFace, std::move(faces));
  }
  // Vertices with several copies for no other reason.
  void list_pinched(const std::vector<VertexId>& origin, const std::vector<char>& mended) {
    std::vector<VertexId> pinched;
    for (std::size_t v = 1; v < origin.size(); ++v) {
      const bool first_copy = origin[v] == origin[v - 1] && (v == 1 || origin[v - 2] != origin[v]);
      if (first_copy && mended[at(origin[v])] == 0) pinched.push_back(origin[v]);
    }
    list(MendKind::kPinchedVertex, ElementKind::kVertex, std::move(pinched));
  }
  void list_shapes() {
    std::vector<FaceId> flat;
    std::vector<VertexPair> short_edges;
    for (const FaceId f : shapeless_faces(input_.vertices, faces_)) {
      bool coincident = false;
      for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
        const auto [low, high] = ends(faces_, h);
        if (input_.vertices.row(low) != input_.vertices.row(high)) continue;
        coincident = true;
        short_edges.emplace_back(low, high);
      }
      if (!coincident) flat.push_back(f);
    }
    list_faces(MendKind::kZeroAreaFace, std::move(flat));
    sort_unique(short_edges);
    list_pairs(MendKind::kZeroLengthEdge, short_edges);
  }

  const Surface& input_;
  const SeparateOptions& options_;
  const ExecutionContext& context_;
  Triangles faces_;  // those that are kept, in the input's vertices
  std::vector<Index> material_;
  std::vector<Index> polygon_;
  Points2 corner_uv_;
  SeparatedSurface result_;
};

}  // namespace

std::string_view describe(MendKind kind) {
  using Enum = MendKind;
  switch (kind) { FLIPFREE_MEND_KINDS(FLIPFREE_CASE_OF_TEXT) }
  return "";
}

CornerId SeparatedSurface::corner_origin(CornerId c) const {
  const FaceId f = c / 3;
  const Index k = c % 3;
  return 3 * face_origin[at(f)] + (turned[at(f)] == 0 || k == 0 ? k : 3 - k);
}

IndexPairs copies_of_edges(const Surface& input, const SeparatedSurface& separated,
                           const IndexPairs& pairs) {
  const auto vertex_count = static_cast<Index>(input.vertices.rows());
  flag_each_pair(input.faces, vertex_count, pairs);
  // Which face and side of the surface they are of is no matter.
  const Triangles& faces = separated.surface.faces;
  const Triangles named =
      faces.unaryExpr([&](VertexId v) { return separated.vertex_origin[at(v)]; });
  return rows_of(pairs_of(faces, flag_pairs(named, vertex_count, &pairs)));
}

SeparatedSurface separate(const Surface& input, const SeparateOptions& options,
                          const ExecutionContext& context) {
  return Separator(input, options, context).run();
}

namespace {

// Each coordinate between -1 and 1, but not within a quarter of zero, so that none is lost.
Vector3 direction_of(VertexId v, std::uint64_t round) {
  Vector3 direction;
  for (Index k = 0; k < 3; ++k) {
    const std::uint64_t seed = static_cast<std::uint64_t>(v) + (round << 32);
    const std::uint64_t bits = Random(3 * seed + static_cast<std::uint64_t>(k)).next();
    const double share = static_cast<double>(bits >> 12) * 0x1p-52;
    direction[k] = (bits & 1) != 0 ? 0.25 + 0.75 * share : -0.25 - 0.75 * share;
  }
  return direction;
}

struct MeanLength {
  double sum = 0.0;
  Index count = 0;
  void add(double length) {
    if (!(length > 0.0) || !std::isfinite(length)) return;
    sum += length;
    ++count;
  }
  double mean() const { return count == 0 ? 0.0 : sum / count; }
};

// Over the longest edge. Precondition: the face has a shape.
double height_of(const Surface& surface, FaceId f) {
  const auto [p, q, r] = surface.corners(f);
  Vector3 a = q - p, b = r - p;
  const double longest = std::max({a.stableNorm(), b.stableNorm(), (b - a).stableNorm()});
  a /= longest;  // a product of lengths may be no number
  b /= longest;
  return a.cross(b).norm() * longest;
}

// Per vertex, of the faces with a shape; infinite where there is none.
std::vector<double> least_heights(const Surface& surface, const std::vector<FaceId>& shapeless) {
  std::vector<double> least(at(static_cast<Index>(surface.vertices.rows())),
                            std::numeric_limits<double>::infinity());
  for (FaceId f = 0; f < surface.faces.rows(); ++f) {
    if (std::binary_search(shapeless.begin(), shapeless.end(), f)) continue;
    const double height = height_of(surface, f);
    for (Index k = 0; k < 3; ++k)
      least[at(surface.faces(f, k))] = std::min(least[at(surface.faces(f, k))], height);
  }
  return least;
}

}  // namespace

Points3 rest_positions(const Surface& surface) {
  std::vector<FaceId> flat = shapeless_faces(surface.vertices, surface.faces);
  Points3 result = surface.vertices;
  if (flat.empty()) return result;
  std::vector<MeanLength> around(at(surface.vertices.rows()));
  MeanLength all;
  for (CornerId c = 0; c < static_cast<CornerId>(surface.faces.size()); ++c) {
    const VertexId a = source(surface.faces, c), b = target(surface.faces, c);
    const double length = (surface.vertices.row(b) - surface.vertices.row(a)).stableNorm();
    around[at(a)].add(length);
    around[at(b)].add(length);
    all.add(length);
  }
  const std::vector<double> height = least_heights(surface, flat);
  // The second round is for corners that share a direction by chance, or shifts that are lost
  // beside large coordinates.
  constexpr std::uint64_t kRounds = 8;
  for (std::uint64_t round = 0; round < kRounds && !flat.empty(); ++round) {
    std::vector<char> moves(around.size(), 0);
    for (const FaceId f : flat)
      for (Index k = 0; k < 3; ++k) moves[at(surface.faces(f, k))] = 1;
    for (std::size_t v = 0; v < moves.size(); ++v) {
      if (moves[v] == 0) continue;
      double length = around[v].count > 0 ? around[v].mean() : all.mean();
      if (!(length > 0.0)) length = 1.0 / kRestShift;
      const auto row = static_cast<VertexId>(v);
      const double magnitude = surface.vertices.row(row).cwiseAbs().maxCoeff();
      const double first =
          std::clamp(kRestShiftOfHeight * height[v], kLeastRestShift * length, kRestShift * length);
      const double shift =
          std::max(std::ldexp(first, 2 * static_cast<int>(round)), 0x1p-40 * magnitude);
      result.row(row) = surface.vertices.row(row) + shift * direction_of(row, round).transpose();
    }
    flat = shapeless_faces(result, surface.faces);
  }
  return result;
}

}  // namespace flipfree::mesh
