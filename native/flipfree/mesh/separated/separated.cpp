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

#include "flipfree/base/error.h"
#include "flipfree/base/random.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/mesh/islands.h"
#include "flipfree/mesh/separated/edge_pairs.h"
#include "flipfree/mesh/separated/orientation.h"
#include "flipfree/mesh/validate.h"

namespace flipfree::mesh {

namespace {

constexpr std::size_t kMostListed = 1000;

void check_meaning(const Surface& input, const SeparateOptions& options) {
  for (const Error& defect : value_defects(input)) {
    if (defect.code != ErrorCode::kRepeatedCorner) throw InvalidInput(defect);
  }
  const auto per_face = [&](const std::vector<Index>* numbers, const char* what) {
    if (numbers != nullptr && numbers->size() != static_cast<std::size_t>(input.faces.rows()))
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
    const Points2* map = corner_uv_.rows() == 0 ? nullptr : &corner_uv_;
    PairingInput pairing{input_.vertices, faces_, at_seam};
    if (!material_.empty()) pairing.material = &material_;
    pairing.corner_uv = map;
    EdgePairs pairs = pair_edges(pairing, context_);
    if (polygon_.empty() && options_.diagonals != nullptr && options_.diagonals->rows() > 0)
      polygon_ =
          polygons_of(faces_, static_cast<Index>(input_.vertices.rows()), *options_.diagonals);
    if (!polygon_.empty()) pairing.polygon = &polygon_;
    if (!pairs.crowded.empty()) {
      // Which way faces run counts in a crowd, so that it is set right before, as far as others
      // tell it. A map has its own opinion.
      std::vector<char> turned;
      if (map == nullptr) {
        EdgePairs others = pairs;
        turned = orient(pairing, others, context_).turned;
      }
      pair_crowds(pairing, turned, pairs, context_);
    }
    for (HalfedgeId h = 0; map != nullptr && h < static_cast<HalfedgeId>(at_seam.size()); ++h) {
      const HalfedgeId o = pairs.mate[at(h)];
      if (o != kInvalid && !continues_in_map(faces_, *map, h, o)) at_seam[at(h)] = 1;
    }
    const std::vector<HalfedgeId> paired = pairs.mate;
    const Orientation orientation = orient(pairing, pairs, context_);
    list_edges(MendKind::kCrowdedEdge, firsts(pairs.crowded));
    list_edges(MendKind::kOneSidedEdge, orientation.one_sided);
    list_edges(MendKind::kOpposedEdge, orientation.opposed);
    list_faces(MendKind::kDuplicateFace, pairs.duplicate);
    std::vector<FaceId> turned;
    for (FaceId f = 0; f < faces_.rows(); ++f) {
      if (orientation.turned[at(f)] != 0) turned.push_back(f);
    }
    list_faces(MendKind::kTurnedFace, turned);
    std::vector<EdgeUse> doubtful = pairs.crowded;
    doubtful.insert(doubtful.end(), pairs.loose.begin(), pairs.loose.end());
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(paired.size()); ++h) {
      if (paired[at(h)] > h && pairs.mate[at(h)] == kInvalid)
        doubtful.push_back({h, paired[at(h)]});
    }
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
    std::vector<HalfedgeId> opposite(mate.size(), kInvalid);
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(mate.size()); ++h) {
      if (mate[at(h)] != kInvalid)
        opposite[at(turned_over(turned, h))] = turned_over(turned, mate[at(h)]);
    }
    std::vector<char> mended(at(static_cast<Index>(input_.vertices.rows())), 0);
    for (std::vector<HalfedgeId>& halfedges : doubtful) {
      for (HalfedgeId& h : halfedges) {
        h = turned_over(turned, h);
        mended[at(source(oriented, h))] = mended[at(target(oriented, h))] = 1;
      }
    }
    context_.check();
    Sheets sheets = make_sheets(oriented, opposite, std::move(doubtful),
                                polygon_.empty() ? nullptr : &polygon_);
    std::vector<HalfedgeId> parted;
    for (const HalfedgeId h : sheets.parted) {
      const HalfedgeId own = turned_over(turned, h);
      if (at_seam[at(own)] == 0) parted.push_back(own);
      mended[at(source(faces_, own))] = mended[at(target(faces_, own))] = 1;
    }
    list_edges(MendKind::kPartedEdge, parted);
    list_pinched(sheets.origin, mended);

    result_.turned = turned;
    result_.vertex_origin = std::move(sheets.origin);
    Triangles faces(faces_.rows(), 3);
    for (CornerId c = 0; c < static_cast<CornerId>(sheets.vertex.size()); ++c)
      faces(c / 3, c % 3) = sheets.vertex[at(c)];
    result_.surface.faces = std::move(faces);
    result_.surface.vertices.resize(static_cast<Eigen::Index>(result_.vertex_origin.size()), 3);
    for (std::size_t v = 0; v < result_.vertex_origin.size(); ++v) {
      result_.surface.vertices.row(static_cast<Eigen::Index>(v)) =
          input_.vertices.row(result_.vertex_origin[v]);
    }
    list_shapes();
    std::sort(result_.mends.begin(), result_.mends.end(),
              [](const Mend& a, const Mend& b) { return a.kind < b.kind; });
    return std::move(result_);
  }

  static std::vector<HalfedgeId> firsts(const std::vector<EdgeUse>& edges) {
    std::vector<HalfedgeId> result;
    for (const EdgeUse& edge : edges) result.push_back(edge.front());
    return result;
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
  switch (kind) {
    case MendKind::kCrowdedEdge:
      return "edges with more than two faces";
    case MendKind::kTurnedFace:
      return "faces wound against their part";
    case MendKind::kOneSidedEdge:
      return "edges cut, as the surface has one side only";
    case MendKind::kOpposedEdge:
      return "edges cut between parts wound against each other";
    case MendKind::kPartedEdge:
      return "edges cut, as sheets meet there more than once";
    case MendKind::kPinchedVertex:
      return "vertices where parts touch";
    case MendKind::kDuplicateFace:
      return "duplicate faces";
    case MendKind::kRepeatedCorner:
      return "faces that use a vertex twice";
    case MendKind::kZeroAreaFace:
      return "faces without area, or thinner than 1e-8 of their length";
    case MendKind::kZeroLengthEdge:
      return "edges of length zero";
  }
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
  // Those of the pairs that are edges of such faces; which face and side they are of is no matter.
  const auto edges_among = [&](const Triangles& faces, const Triangles& numbers) {
    std::vector<VertexPair> found;
    const std::vector<char> flags = flag_pairs(faces, vertex_count, &pairs);
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(flags.size()); ++h) {
      if (flags[at(h)] != 0) found.push_back(ends(numbers, h));
    }
    sort_unique(found);
    return found;
  };
  const auto of_input = edges_among(input.faces, input.faces);
  for (Eigen::Index i = 0; i < pairs.rows(); ++i) {
    const VertexPair pair = std::minmax({pairs(i, 0), pairs(i, 1)});
    if (!std::binary_search(of_input.begin(), of_input.end(), pair))
      throw_not_an_edge(pairs, i, vertex_count);
  }
  const Triangles& faces = separated.surface.faces;
  const Triangles named =
      faces.unaryExpr([&](VertexId v) { return separated.vertex_origin[at(v)]; });
  return rows_of(edges_among(named, faces));
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
  const Vector3 p = surface.vertices.row(surface.faces(f, 0));
  Vector3 a = surface.vertices.row(surface.faces(f, 1)).transpose() - p;
  Vector3 b = surface.vertices.row(surface.faces(f, 2)).transpose() - p;
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

// By how much a vertex is moved in the first round.
double shift_of(double length, double least_height) {
  return std::clamp(kRestShiftOfHeight * least_height, kLeastRestShift * length,
                    kRestShift * length);
}

}  // namespace

Points3 rest_positions(const Surface& surface) {
  std::vector<FaceId> flat = shapeless_faces(surface.vertices, surface.faces);
  Points3 result = surface.vertices;
  if (flat.empty()) return result;
  std::vector<char> moves(at(static_cast<Index>(surface.vertices.rows())), 0);
  for (const FaceId f : flat) {
    for (Index k = 0; k < 3; ++k) moves[at(surface.faces(f, k))] = 1;
  }
  std::vector<MeanLength> around(moves.size());
  MeanLength all;
  for (CornerId c = 0; c < static_cast<CornerId>(surface.faces.size()); ++c) {
    const VertexId a = surface.faces(c / 3, c % 3);
    const CornerId n = next_corner(c);
    const VertexId b = surface.faces(n / 3, n % 3);
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
    for (std::size_t v = 0; v < moves.size(); ++v) {
      if (moves[v] == 0) continue;
      double length = around[v].count > 0 ? around[v].mean() : all.mean();
      if (!(length > 0.0)) length = 1.0 / kRestShift;
      const auto row = static_cast<VertexId>(v);
      const double magnitude = surface.vertices.row(row).cwiseAbs().maxCoeff();
      const double shift =
          std::max(std::ldexp(shift_of(length, height[v]), 2 * static_cast<int>(round)),
                   0x1p-40 * magnitude);
      result.row(row) = surface.vertices.row(row) + shift * direction_of(row, round).transpose();
    }
    flat = shapeless_faces(result, surface.faces);
    moves.assign(moves.size(), 0);
    for (const FaceId f : flat) {
      for (Index k = 0; k < 3; ++k) moves[at(surface.faces(f, k))] = 1;
    }
  }
  return result;
}

}  // namespace flipfree::mesh
