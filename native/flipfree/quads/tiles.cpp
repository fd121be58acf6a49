#include "flipfree/quads/tiles.h"

#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/plane.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/mesh/shortest_paths.h"
#include "flipfree/mesh/validate.h"
#include "flipfree/quads/coarse.h"
#include "flipfree/quads/transfer.h"
#include "flipfree/seamless/seams.h"

namespace flipfree::quads {

namespace {

using seamless::turned;

class TurnedSeams {
 public:
  explicit TurnedSeams(certify::Parametrization& map)
      : map_(map),
        faces_(map.surface.faces),
        adjacency_(map.surface.adjacency()),
        turn_(adjacency_.opposite.size(), 0) {
    const auto along = [&](HalfedgeId h) -> Vector2 {
      return map.uv.row(next_corner(h)) - map.uv.row(h);
    };
    for (HalfedgeId h = 0; at(h) < turn_.size(); ++h) {
      const HalfedgeId o = adjacency_.opposite[at(h)];
      Index& turn = turn_[at(h)];
      while (o != kInvalid && turn < 4 && along(o) != -turned(along(h), turn)) ++turn;
      is_seamless_ = is_seamless_ && turn < 4;
      length_.push_back((map.surface.vertices.row(mesh::source(faces_, h)) -
                         map.surface.vertices.row(mesh::target(faces_, h)))
                            .norm());
      price(h);
    }
  }

  bool is_seamless() const { return is_seamless_; }

  // Whether any branch was moved.
  bool descend(const ExecutionContext& context) {
    bool moved = false;
    std::vector<char> seen(turn_.size(), 0);
    for (HalfedgeId h = 0; at(h) < turn_.size(); ++h) {
      if (turn_[at(h)] == 0 || seen[at(h)] != 0) continue;
      const std::vector<HalfedgeId> branch = branch_with(h);
      for (const HalfedgeId b : branch) seen[at(b)] = seen[at(adjacency_.opposite[at(b)])] = 1;
      moved = move(branch, context) || moved;
    }
    return moved;
  }

 private:
  // What a path along the edge adds at most to the length that turns.
  void price(HalfedgeId h) {
    const bool free = turn_[at(h)] != 0 || adjacency_.opposite[at(h)] == kInvalid;
    price_.resize(turn_.size(), 0.0);
    price_[at(h)] = free ? 0.0 : length_[at(h)];
  }

  // The half-edge that goes on with the same turn where nothing else turns; kInvalid at the end of
  // a branch.
  HalfedgeId next(HalfedgeId h) const {
    const VertexId v = mesh::target(faces_, h);
    if (adjacency_.opposite[at(adjacency_.vertex_halfedge[at(v)])] == kInvalid) return kInvalid;
    HalfedgeId found = kInvalid;
    int turned = 0;
    mesh::for_each_outgoing(adjacency_, v, [&](HalfedgeId out) {
      if (turn_[at(out)] == 0) return;
      ++turned;
      if (out != adjacency_.opposite[at(h)]) found = out;
    });
    return turned == 2 && turn_[at(found)] == turn_[at(h)] ? found : kInvalid;
  }

  // All of it, head to tail; a closed one from h round to h.
  std::vector<HalfedgeId> branch_with(HalfedgeId h) const {
    const auto opposite = [&](HalfedgeId e) { return adjacency_.opposite[at(e)]; };
    HalfedgeId first = h;
    for (HalfedgeId e = next(opposite(h)); e != kInvalid && e != opposite(h); e = next(e))
      first = opposite(e);
    std::vector<HalfedgeId> branch = {first};
    for (HalfedgeId e = next(first); e != kInvalid && e != first; e = next(e)) branch.push_back(e);
    return branch;
  }

  bool move(const std::vector<HalfedgeId>& branch, const ExecutionContext& context) {
    const VertexId start = mesh::source(faces_, branch.front());
    const VertexId end = mesh::target(faces_, branch.back());
    if (start == end) return false;
    std::vector<double> prices = price_;
    double gain = 0.0;
    for (const HalfedgeId h : branch) {
      gain += length_[at(h)];
      prices[at(h)] = prices[at(adjacency_.opposite[at(h)])] = mesh::ShortestPaths::kUnreached;
    }
    mesh::ShortestPaths paths(faces_, adjacency_, prices, (1.0 - 1e-9) * gain);
    paths.add_source(end);
    paths.grow(context);
    if (paths.distance(start) == mesh::ShortestPaths::kUnreached) return false;
    // From the branch's end back to its start: what lies between is on the left.
    std::vector<HalfedgeId> curve = branch;
    for (VertexId v = start; v != end; v = paths.before(v)) {
      HalfedgeId h = paths.arrival(v);
      if (adjacency_.opposite[at(h)] == kInvalid) continue;
      if (mesh::target(faces_, h) != v) h = adjacency_.opposite[at(h)];
      curve.push_back(h);
    }
    const Index turn = turn_[at(branch.front())];
    double change = 0.0;
    for (const HalfedgeId h : curve)
      change +=
          length_[at(h)] * ((turn_[at(h)] != turn ? 1.0 : 0.0) - (turn_[at(h)] != 0 ? 1.0 : 0.0));
    if (!(change < -1e-9 * gain)) return false;
    const std::vector<FaceId> between = left_of(curve);
    if (between.empty() || !turn_faces(between, branch.front())) return false;
    for (const HalfedgeId h : curve) {
      const HalfedgeId o = adjacency_.opposite[at(h)];
      turn_[at(h)] = (turn_[at(h)] - turn + 4) % 4;
      turn_[at(o)] = (4 - turn_[at(h)]) % 4;
      price(h);
      price(o);
    }
    return true;
  }

  // The faces on the left of a closed curve, without those on its right; none if it does not part
  // them.
  std::vector<FaceId> left_of(const std::vector<HalfedgeId>& curve) const {
    mesh::EdgeFlags barrier(turn_.size(), 0);
    for (const HalfedgeId h : curve) barrier[at(h)] = barrier[at(adjacency_.opposite[at(h)])] = 1;
    const mesh::Components parts = mesh::components_between(adjacency_, barrier);
    std::vector<char> inside(at(parts.count), 0);
    const auto is_inside = [&](FaceId f) -> char& { return inside[at(parts.of_face[at(f)])]; };
    for (const HalfedgeId h : curve) is_inside(h / 3) = 1;
    for (const HalfedgeId h : curve)
      if (is_inside(adjacency_.opposite[at(h)] / 3) != 0) return {};
    std::vector<FaceId> faces;
    for (FaceId f = 0; f < static_cast<FaceId>(faces_.rows()); ++f)
      if (is_inside(f) != 0) faces.push_back(f);
    return faces;
  }

  // As the map goes on across h, which has them on its left. False, and nothing changed, where
  // stored values could not hold that.
  bool turn_faces(const std::vector<FaceId>& faces, HalfedgeId h) {
    const Index turn = turn_[at(h)];
    const HalfedgeId beyond = next_corner(adjacency_.opposite[at(h)]);
    const Vector2 translation =
        Vector2(map_.uv.row(beyond)) - turned(Vector2(map_.uv.row(h)), turn);
    const auto carried = [&](CornerId c) -> Vector2 {
      return turned(Vector2(map_.uv.row(c)), turn) + translation;
    };
    for (const FaceId f : faces) {
      for (CornerId c = 3 * f; c < 3 * f + 3; ++c)
        if (carried(c).cast<float>().cast<double>() != carried(c)) return false;
    }
    for (const FaceId f : faces)
      for (CornerId c = 3 * f; c < 3 * f + 3; ++c) map_.uv.row(c) = carried(c);
    return true;
  }

  certify::Parametrization& map_;
  const Triangles& faces_;
  const mesh::Adjacency& adjacency_;
  bool is_seamless_ = true;
  std::vector<Index> turn_;     // per half-edge: from its face to the neighbour, 0 to 3
  std::vector<double> length_;  // on the surface
  std::vector<double> price_;
};

// Where the seams of a map lie that turn: quarter turns between cones are there to stay, but not
// along which edges.
//
// Moves seams so that those across which the map turns are shorter: a branch of them, between two
// vertices where others meet it or end, goes along the path with the least length that has no turn
// yet, if it is shorter so and the two paths part the surface. What lies between them is turned and
// moved until the old one is no seam at all. Exact: UVs change by quarter turns and the seams' own
// translations; what stored values could not hold stays. The map is the same as a seamless one:
// same triangles, same cones, same isolines. A descent by single branches, not to the shortest
// seams of all; branches round handles stay. A map that is not seamless in 64 bits stays as it is,
// for its certificate to say so. Cost: a search for shortest paths, no longer than the branch, for
// every branch, some times. Throws Cancelled, TimeIsOver.
void shorten_turned_seams(certify::Parametrization& map, const ExecutionContext& context) {
  TurnedSeams seams(map);
  while (seams.is_seamless() && seams.descend(context)) context.check();
}

double tiles_of(const Points2& uv) {
  double twice = 0.0;
  for (Eigen::Index c = 0; c < uv.rows(); c += 3) {
    const Vector2 a = uv.row(c + 1) - uv.row(c), b = uv.row(c + 2) - uv.row(c);
    twice += cross(a, b);
  }
  return 0.5 * twice;
}

// With about so many tiles.
std::optional<certify::Parametrization> whole_map(const certify::Parametrization& map,
                                                  const FlatMap& flat,
                                                  const std::optional<Prepared>& prepared,
                                                  double wanted, ExecutionContext& context,
                                                  Stats& stats) {
  if (!prepared) {
    const double scale = std::sqrt(wanted / tiles_of(map.uv32.cast<double>()));
    return rounded_map(map, flat, scale, context, stats);
  }
  CoarseSurface coarse = prepared->coarse;
  if (!choose_integers(coarse, *prepared, scales_of(*prepared, map), wanted, 0.0, context))
    return std::nullopt;
  return integer_map(map, map.surface, *prepared, coarse, context, stats);
}

void count_seams(certify::Parametrization& map) {
  double all = 0.0, matched = 0.0;
  std::int64_t quarter = 0, half = 0;
  for (std::size_t i = 0; i < map.transitions.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double length = (map.surface.vertices.row(map.cut_edges(row, 0)) -
                           map.surface.vertices.row(map.cut_edges(row, 1)))
                              .norm();
    const Index turns = map.transitions[i].quarter_turns;
    all += length;
    matched += turns == 0 ? length : 0.0;
    quarter += turns % 2;
    half += turns == 2 ? 1 : 0;
  }
  map.stats["seams"] = static_cast<std::int64_t>(map.transitions.size());
  map.stats["seams_quarter"] = quarter;
  map.stats["seams_half"] = half;
  map.stats["seams_matched"] = all > 0.0 ? matched / all : 1.0;
}

certify::Parametrization fit_in_time(certify::Parametrization map, const TileOptions& options,
                                     ExecutionContext& context) {
  constexpr int kMostTries = 5;
  constexpr double kFiner = 2.0;  // times as many tiles
  constexpr double kMostTiles = 1e10;
  mesh::ValidateOptions rules;
  rules.reject_zero_area = false;  // pieces of a refined map may have none
  mesh::validate(map.surface, rules, context);
  const mesh::Adjacency& adjacency = map.surface.adjacency();
  const mesh::EdgeFlags flags = mesh::flag_edges(map.surface.faces, adjacency, options.features);
  for (HalfedgeId h = 0; at(h) < flags.size(); ++h)
    if (flags[at(h)] != 0 && h < adjacency.opposite[at(h)]) map.features.push_back(h);
  const double area = mesh::area_of(map.surface);
  double wanted = area / (options.tile * options.tile);
  if (!(wanted <= kMostTiles))
    throw_invalid(
        ErrorCode::kBadOption,
        "tile is so short that it takes more than 10000000000 of them. Give a longer one.");
  if (!(wanted > 0.0))
    throw_invalid(ErrorCode::kBadOption, "The surface has no area, or tile is too long for it.");
  FlatMap flat = flat_map(map);
  std::optional<Prepared> prepared;
  if (flat.oblique.empty()) prepared = prepare(flat, map, context);
  const std::vector<Index> quarters =
      quarters_around(flat.surface, at(map.surface.vertices.rows()));
  Stats stats;
  std::optional<certify::Parametrization> whole;
  for (int i = 0; i < kMostTries && !whole; ++i, wanted *= kFiner) {
    const ProgressRange range(context, 0.9 * i / kMostTries, 0.9 * (i + 1) / kMostTries);
    stats["tries"] = static_cast<std::int64_t>(i + 1);
    whole = whole_map(map, flat, prepared, wanted, context, stats);
  }
  if (!whole)
    throw_not_converged(ErrorCode::kIterationLimit,
                        "No map with whole tiles was found without a flip. Ask for smaller tiles, "
                        "or take a map with fewer cones.");
  if (options.prefer_translations) shorten_turned_seams(*whole, context);
  const double tiles = tiles_of(whole->uv);
  context.report("certifying", 0.9);
  certify_integers(quarters, map.surface, options.features, *whole, context);
  certify::require_certificate(*whole, "Fitting tiles");
  whole->stats = std::move(stats);
  whole->stats["tile"] = std::sqrt(area / tiles);
  whole->stats["tiles"] = tiles;
  count_seams(*whole);
  return *std::move(whole);
}

}  // namespace

certify::Parametrization fit_tiles(certify::Parametrization map, const TileOptions& options,
                                   ExecutionContext& context) {
  return in_time(context, options.max_seconds, "Whole tiles were not reached",
                 "or take a map with fewer cones",
                 [&] { return fit_in_time(std::move(map), options, context); });
}

}  // namespace flipfree::quads
