#include "flipfree/unwrap/seams/nets.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <numeric>
#include <optional>
#include <queue>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/plane.h"
#include "flipfree/base/types.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/mesh/shortest_paths.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/unwrap/islands/islands.h"
#include "flipfree/unwrap/packing/nest/shape.h"
#include "flipfree/unwrap/seams/costs.h"

namespace flipfree::unwrap {
namespace {

// Radians between the normals of two faces: up to the first they are one flat face, up to the
// second one smooth region.
constexpr double kFlatAngle = 0.017;
constexpr double kSmoothAngle = 0.44;
// Between the normals of two faces of what bevels belong to.
constexpr double kPlateAngle = 0.04;
// Shares of a part's area: of a region that counts, and what regions that count must have of a hard
// part.
constexpr double kRegion = 0.01;
constexpr double kHardRegions = 0.1;
// A smooth region whose inner vertices have less curvature (radians, sum of absolute values) is
// rolled.
constexpr double kRolled = 0.05;
// Area of a needle, over its longest side's square.
constexpr double kNeedle = 1e-3;
// What has an edge longer than this, in roots of its area, is a wire or has a needle.
constexpr double kWire = 16.0;
// Bevels are narrower than this, in roots of the part's area, all together than that; they bend
// less than this from face to face, and away from their flat face than that. Around rims they bend
// into themselves: they overlap from a share of the width up to them on.
constexpr double kBevelWidth = 0.03;
constexpr double kBevelReach = 0.09;
constexpr double kBevelAngle = 0.88;
constexpr double kBevelTurn = 1.5;
constexpr double kBevelDepth = 0.15;

// Two sides of an edge lie on each other up to this share of the part's size (root of its area);
// triangles overlap from this share on.
constexpr double kMeets = 1e-3;
constexpr double kOverlaps = 1e-4;
// Of the outlines' length along their crosses so much (of the whole length) may be lost in a join.
constexpr double kCrossLost = 0.05;
// Nets are not longer than this, in roots of the whole surface's area, unless they were before:
// what is longer leaves most of a texture empty.
constexpr double kLongest = 1.8;
// Shares of a part's area: of a net that counts; and what nets that count must have of all nets of
// a hard part.
constexpr double kNet = 0.04;
constexpr double kHardNets = 0.85;
// Of the nets' outlines so much runs along their crosses, in the mean by area.
constexpr double kHardOutlines = 0.35;
// An outline of which so much runs along one cross is straight (24 directions have a sixth); where
// there are bevels, so much (a hexagon with a hole has a fifth).
constexpr double kStraightOutline = 0.25;
constexpr double kStraightBevelled = 0.19;
// Of a part that has bevels so much is flat (of made things a half or more, of scans a quarter).
constexpr double kBevelled = 0.48;
// Directions of outlines are counted modulo a quarter turn in so many bins.
constexpr int kBins = 180;
// Cells of the grid in which overlaps are looked for, to a part's extent: so many times the root of
// its faces, within these. A face is in as many of them, squared, at the most.
constexpr double kCellsToFaces = 2.0;
constexpr double kFewestCells = 4.0;
constexpr double kMostCells = 64.0;
// No point of a cell is farther from its middle than this, in its sides.
constexpr double kHalfCell = 0.75;

// An edge of a part between faces that may be apart.
struct Hinge {
  HalfedgeId h = kInvalid;  // the lower one of the edge's two
  double worth = 0.0;       // of joining it: its length, times what the caller says
  double angle = 0.0;       // where a flat face has bevels, from it to what is beyond them
};

using Corners = std::array<Vector2, 3>;

double longest_of(const Corners& p) {
  return std::max({(p[1] - p[0]).norm(), (p[2] - p[1]).norm(), (p[0] - p[2]).norm()});
}

// A connected part of the surface between seams, and what is measured of it.
struct MadePart {
  // own: must outlive this. Edges of infinite `cost` (per half-edge) are none of its hinges.
  MadePart(const mesh::Surface& own, const std::vector<double>& cost)
      : surface(own),
        faces(own.faces),
        opposite(own.adjacency().opposite),
        areas(face_areas(own)),
        curvature(at(own.vertices.rows()), 0.0),
        bend(curvature),
        soft(areas.size(), 0.0) {
    measure();
    for (FaceId f = 0; f < static_cast<FaceId>(areas.size()); ++f) {
      FaceId& shape = shaped.emplace_back(f);
      for (const bool in_polygon : {true, false}) {
        if (width(shape) >= kNeedle) break;
        for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
          const HalfedgeId o = opposite[at(h)];
          if (o == kInvalid || (cost[at(h)] == mesh::ShortestPaths::kUnreached) != in_polygon)
            continue;
          const FaceId other = o / 3 < f ? shaped[at(o / 3)] : o / 3;
          if (width(other) > width(shape)) shape = other;
        }
      }
    }
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(opposite.size()); ++h) {
      const HalfedgeId o = opposite[at(h)];
      if (o < h) continue;
      if (cost[at(h)] == mesh::ShortestPaths::kUnreached) {
        joined.push_back(h);
        continue;
      }
      const double length = edge_length(surface, h);
      const double plain = length * bend_factor(surface, h, o);
      const double worth = plain > 0.0 ? cost[at(h)] / plain * length : length;
      hinges.push_back({h, worth, angle(h / 3, o / 3)});
      for (const VertexId v : {mesh::source(faces, h), mesh::target(faces, h)})
        bend[at(v)] = std::max(bend[at(v)], hinges.back().angle);
    }
  }

  double size() const { return std::sqrt(area); }
  // Between the normals of two faces, needles aside.
  double angle(FaceId f, FaceId g) const {
    return bend_between(surface, shaped[at(f)], shaped[at(g)]);
  }

  const mesh::Surface& surface;
  const Triangles& faces;
  const std::vector<HalfedgeId>& opposite;
  std::vector<Hinge> hinges;       // edges that may become seams
  std::vector<HalfedgeId> joined;  // edges that may not
  double area = 0.0;
  double extent = 0.0;  // the longest edge, or size() if that is longer
  bool bevelled = false;
  std::vector<double> areas;  // per face
  std::vector<Corners> flat;  // per face, laid into the plane
  // Per vertex: the size of its angle defect over the number of its corners, 0 at borders; and the
  // largest angle between faces at an edge there.
  std::vector<double> curvature;
  std::vector<double> bend;
  // Per face: itself, or beside it one that is no needle, of its polygon if there is: how it bends.
  std::vector<FaceId> shaped;
  std::vector<double> soft;  // per face: how deep others may lie in it; bevels

 private:
  double width(FaceId f) const {
    const double longest = longest_of(flat[at(f)]);
    return areas[at(f)] / (longest * longest);
  }

  void measure() {
    std::vector<double> corners(curvature.size(), 0.0);
    for (FaceId f = 0; f < static_cast<FaceId>(areas.size()); ++f) {
      const auto [e, d] = mesh::sides_at(surface, 3 * f);
      const double length = e.norm();
      flat.push_back({Vector2::Zero(), Vector2(length, 0.0),
                      length > 0.0 ? Vector2(e.dot(d) / length, e.cross(d).norm() / length)
                                   : Vector2(d.norm(), 0.0)});
      area += areas[at(f)];
      extent = std::max(extent, longest_of(flat.back()));
      for (CornerId c = 3 * f; c < 3 * f + 3; ++c) {
        const auto [a, b] = mesh::sides_at(surface, c);
        curvature[at(mesh::source(faces, c))] -= std::atan2(a.cross(b).norm(), a.dot(b));
        corners[at(mesh::source(faces, c))] += 1.0;
      }
    }
    for (std::size_t v = 0; v < corners.size(); ++v)
      curvature[v] = std::abs(curvature[v] + 2 * std::numbers::pi) / corners[v];
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(opposite.size()); ++h)
      if (opposite[at(h)] == kInvalid)
        curvature[at(mesh::source(faces, h))] = curvature[at(mesh::target(faces, h))] = 0.0;
    extent = std::max(extent, size());
  }
};

// Faces joined across edges that bend by less than an angle, or are no seams.
class Regions {
 public:
  Regions(const MadePart& part, double angle)
      : sets_(static_cast<Index>(part.areas.size())),
        area_(part.areas.size(), 0.0),
        curvature_(area_) {
    const auto join = [&](HalfedgeId h) { sets_.join(h / 3, part.opposite[at(h)] / 3); };
    for (const HalfedgeId h : part.joined) join(h);
    for (const Hinge& hinge : part.hinges) {
      if (hinge.angle < angle) join(hinge.h);
    }
    for (FaceId f = 0; f < part.faces.rows(); ++f) {
      area_[at(of(f))] += part.areas[at(f)];
      for (const VertexId v : part.faces.row(f))
        if (part.bend[at(v)] < angle) curvature_[at(of(f))] += part.curvature[at(v)];
    }
  }

  Index of(FaceId f) { return sets_.find(f); }
  double area(Index region) const { return area_[at(region)]; }
  // Sum of the sizes of angle defects at the vertices inside, at which no edge bends more.
  double curvature(Index region) const { return curvature_[at(region)]; }

 private:
  DisjointSets sets_;
  std::vector<double> area_;
  std::vector<double> curvature_;
};

// What share of a part is flat, in regions that count; nothing where that and what is rolled is too
// little for a hard surface.
std::optional<double> flat_if_hard(const MadePart& part) {
  if (part.hinges.empty() || !(part.extent < kWire * part.size())) return {};
  Regions flat(part, kFlatAngle);
  Regions smooth(part, kSmoothAngle);
  // Faces of a fine mesh bend little from each to the next one, however much in all.
  std::vector<Vector3> direction(part.areas.size(), Vector3::Zero());
  for (FaceId f = 0; f < part.faces.rows(); ++f)
    direction[at(flat.of(f))] += part.areas[at(f)] * part.surface.area_vector(f).normalized();
  double hard = 0.0;
  double flat_area = 0.0;
  for (FaceId f = 0; f < part.faces.rows(); ++f) {
    const Index own = flat.of(f);
    const bool is_flat = flat.area(own) >= kRegion * part.area &&
                         direction[at(own)].norm() >= std::cos(kPlateAngle) * flat.area(own);
    const bool is_rolled = smooth.area(smooth.of(f)) >= kRegion * part.area &&
                           smooth.curvature(smooth.of(f)) < kRolled;
    if (is_flat || is_rolled) hard += part.areas[at(f)];
    if (is_flat) flat_area += part.areas[at(f)];
  }
  if (hard < kHardRegions * part.area) return {};
  return flat_area / part.area;
}

// Edges inside what flat faces have of the bevels around them, of which larger ones have all. First
// those along which they grew. Hinges between them get the angle from flat face to flat face; faces
// become soft.
std::vector<HalfedgeId> bevels_of(MadePart& part) {
  part.bevelled = true;
  Regions flat(part, kPlateAngle);
  const auto beyond = [&](HalfedgeId h) { return part.opposite[at(h)]; };
  std::unordered_map<Index, std::vector<HalfedgeId>> around;
  for (const Hinge& hinge : part.hinges) {
    for (const HalfedgeId h : {hinge.h, beyond(hinge.h)}) {
      if (hinge.angle >= kPlateAngle && hinge.angle < kBevelAngle)
        around[flat.of(h / 3)].push_back(h);
    }
  }
  // Per region the first face of the plate that has it; kInvalid: none.
  std::vector<FaceId> owner(part.areas.size(), kInvalid);
  std::vector<std::pair<double, FaceId>> plates;  // the largest first, those of one size by number
  for (FaceId f = 0; f < part.faces.rows(); ++f) {
    const Index region = flat.of(f);
    if (flat.area(region) < kRegion * part.area || owner[at(region)] != kInvalid) continue;
    owner[at(region)] = f;
    plates.emplace_back(-std::round(1e3 * flat.area(region) / part.area), f);
  }
  std::sort(plates.begin(), plates.end());
  std::vector<HalfedgeId> inside;
  std::vector<double> depth(owner.size(), 0.0);  // per region
  // What is parallel to a plate beyond a step goes to the nearest one, with the step; then one
  // plate after the other takes what is left.
  for (const bool to_parallels : {true, false}) {
    using Reach = std::tuple<std::size_t, double, HalfedgeId, FaceId>;  // turn, width; into; from
    std::priority_queue<Reach, std::vector<Reach>, std::greater<>> next;
    std::unordered_map<Index, std::pair<HalfedgeId, double>> into;  // and the width up to there
    const auto go_on = [&](Index region, std::size_t turn, double reached, FaceId plate) {
      for (const HalfedgeId h : around[region]) {
        const HalfedgeId o = beyond(h);
        const FaceId own = owner[at(flat.of(o / 3))];
        if (own != kInvalid && own != plate) continue;
        const Corners& corners = part.flat[at(o / 3)];
        const double width = flat.area(flat.of(o / 3)) /
                             (corners[at(next_corner(o) % 3)] - corners[at(o % 3)]).norm();
        if (width < kBevelWidth * part.size() && reached + width < kBevelReach * part.size() &&
            part.angle(plate, o / 3) < kBevelTurn)
          next.emplace(turn, reached + width, o, plate);
      }
    };
    for (std::size_t i = 0; i < plates.size(); ++i)
      go_on(flat.of(plates[i].second), to_parallels ? 0 : i, 0.0, plates[i].second);
    while (!next.empty()) {
      const auto [turn, width, h, plate] = next.top();
      next.pop();
      Index region = flat.of(h / 3);
      if (!into.emplace(region, std::pair(h, width)).second) continue;
      go_on(region, turn, width, plate);
      if (to_parallels && part.angle(plate, h / 3) >= kPlateAngle) continue;
      while (owner[at(region)] == kInvalid) {
        owner[at(region)] = plate;
        const auto& [entry, reached] = into.at(region);
        inside.push_back(entry);
        depth[at(region)] = kBevelDepth * reached;
        region = flat.of(beyond(entry) / 3);
      }
    }
  }
  for (Hinge& hinge : part.hinges) {
    const auto plate_of = [&](FaceId f) {
      const FaceId own = owner[at(flat.of(f))];
      return own == kInvalid ? f : own;
    };
    const FaceId f = plate_of(hinge.h / 3);
    const FaceId g = plate_of(beyond(hinge.h) / 3);
    if (hinge.angle < kFlatAngle) continue;
    if (f == g || part.angle(f, g) < kFlatAngle) {
      inside.push_back(hinge.h);
    } else {
      hinge.angle = part.angle(f, g);
    }
  }
  for (std::size_t f = 0; f < depth.size(); ++f)
    part.soft[f] = depth[at(flat.of(static_cast<FaceId>(f)))];
  return inside;
}

// Is one of a's sides, or of b's, a line beside which the other lies up to `care`? Both
// counter-clockwise.
bool apart(const Corners& a, const Corners& b, double care) {
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector2 side = a[(k + 1) % 3] - a[k];
    const double most = care * side.norm();
    if (cross(side, b[0] - a[k]) <= most && cross(side, b[1] - a[k]) <= most &&
        cross(side, b[2] - a[k]) <= most)
      return true;
  }
  return false;
}

bool overlap(const Corners& a, const Corners& b, double care) {
  return !apart(a, b, care) && !apart(b, a, care);
}

// What must hold besides no overlap where nets are joined.
struct Rules {
  bool cross = false;     // most of the outline runs along one cross then, too
  bool straight = false;  // both outlines are straight, or neither
};

// Faces of one part in nets, each with a plane of its own.
class Nets {
 public:
  // longest: a net may be, unless it was before.
  Nets(const MadePart& part, double longest, const ExecutionContext& context)
      : part_(part),
        longest_(longest),
        context_(context),
        cell_(part.extent /
              std::clamp(kCellsToFaces * std::sqrt(static_cast<double>(part.faces.rows())),
                         kFewestCells, kMostCells)),
        at_(part.flat),
        is_joined_(part.opposite.size(), 0),
        is_forced_(is_joined_),
        bins_(at_.size()),
        spans_(at_.size()) {
    for (FaceId f = 0; f < part.faces.rows(); ++f) {
      net_.push_back(f);
      members_.push_back({f});
      for (const Vector2& p : at_[at(f)]) spans_[at(f)].add(p);
      enter(f);
    }
    force(part.joined);
  }

  bool is_joined(HalfedgeId h) const { return is_joined_[at(h)] != 0; }
  // Are most of the part in few nets, with outlines along their crosses (in the mean by area)?
  bool are_hard() const {
    double counted = 0.0;
    double straight = 0.0;
    for (Index net = 0; net < static_cast<Index>(members_.size()); ++net) {
      if (members_[at(net)].empty()) continue;
      const double area = area_of(net);
      if (area >= kNet * part_.area) counted += area;
      Bins bins(kBins, 0.0);
      add_outline(net, {}, bins);
      straight += along_cross(bins) / length_of(bins) * area;
    }
    return counted >= kHardNets * part_.area && straight / part_.area >= kHardOutlines;
  }

  // Joins the two sides of an edge if they lie on each other, or their nets fit together.
  void join(HalfedgeId h, const Rules& rules) {
    if (is_joined(h)) return;
    if (++tried_ % 64 == 0) context_.check();
    if (net_at(h) == net_at(opposite(h))) {
      if (gap(h) <= kMeets * part_.size()) mark(h);
      return;
    }
    if (members_[at(net_at(h))].size() < members_[at(net_at(opposite(h)))].size()) h = opposite(h);
    const Index a = net_at(h);
    const Index b = net_at(opposite(h));
    const Similarity m = motion({h});
    if (rules.cross && is_longer(a, b, m)) return;
    if (overlaps(a, b, m, kOverlaps * part_.size())) return;
    if (rules.cross) {
      const Bins& first = outline(a);
      const Bins& second = outline(b);
      Bins whole = first;
      add_outline(b, m, whole);
      const double length = length_of(first) + length_of(second);
      if (along_cross(whole) < along_cross(first) + along_cross(second) - kCrossLost * length)
        return;
      // A disk hangs on no rectangle.
      if (rules.straight && is_straight(first) != is_straight(second)) return;
    }
    take(h, m, a, b);
  }

  // Whatever comes to lie on what; nets between which there are several of these edges lie in their
  // middle.
  void force(const std::vector<HalfedgeId>& edges) {
    for (const HalfedgeId h : edges) is_forced_[at(h)] = is_forced_[at(opposite(h))] = 1;
    for (HalfedgeId h : edges) {
      if (is_joined(h)) continue;
      if (net_at(h) == net_at(opposite(h))) {
        mark(h);
        continue;
      }
      if (members_[at(net_at(h))].size() < members_[at(net_at(opposite(h)))].size())
        h = opposite(h);
      const Index other = net_at(opposite(h));
      std::vector<HalfedgeId> between;
      for (const FaceId f : members_[at(other)]) {
        for (HalfedgeId o = 3 * f; o < 3 * f + 3; ++o)
          if (is_forced_[at(o)] != 0 && net_at(opposite(o)) == net_at(h))
            between.push_back(opposite(o));
      }
      take(h, motion(between), net_at(h), other);
    }
  }

  // Nets that are too small to stand alone go to a neighbour, across their longest edges; cracks
  // that this leaves are closed where they are narrow.
  void gather_slivers() {
    const double least = kSliver * part_.area;
    std::vector<std::pair<double, Index>> small;
    for (Index net = 0; net < static_cast<Index>(members_.size()); ++net) {
      const double area = area_of(net);
      if (!members_[at(net)].empty() && area < least) small.emplace_back(area, net);
    }
    std::sort(small.begin(), small.end());
    for (const auto& [unused, net] : small) {
      // It may have grown since.
      if (members_[at(net)].empty() || area_of(net) >= least) continue;
      context_.check();
      const HalfedgeId h = longest_border(net);
      if (h == kInvalid) continue;
      const std::vector<FaceId> moved = members_[at(net)];
      const Index into = net_at(h);
      take(h, motion({h}), into, net);
      for (const FaceId f : moved) {
        for (HalfedgeId g = 3 * f; g < 3 * f + 3; ++g) {
          const HalfedgeId o = opposite(g);
          if (o != kInvalid && !is_joined(g) && net_at(o) == into && gap(g) <= 0.5 * side(g).norm())
            mark(g);
        }
      }
    }
  }

 private:
  double area_of(Index net) const {
    double sum = 0.0;
    for (const FaceId f : members_[at(net)]) sum += part_.areas[at(f)];
    return sum;
  }
  HalfedgeId opposite(HalfedgeId h) const { return part_.opposite[at(h)]; }
  Index net_at(HalfedgeId h) const { return net_[at(h / 3)]; }
  Vector2 from(HalfedgeId h) const { return at_[at(h / 3)][at(h % 3)]; }
  Vector2 to(HalfedgeId h) const { return from(next_corner(h)); }
  Vector2 side(HalfedgeId h) const { return to(h) - from(h); }

  void mark(HalfedgeId h) { is_joined_[at(h)] = is_joined_[at(opposite(h))] = 1; }

  // Between the two sides of an edge, whose faces are in one net.
  double gap(HalfedgeId h) const {
    const HalfedgeId o = opposite(h);
    return std::max((from(h) - to(o)).norm(), (to(h) - from(o)).norm());
  }

  // Of the net on the other side, so that the edges' sides lie on each other.
  Similarity motion(const std::vector<HalfedgeId>& edges) const {
    Vector2 turn = Vector2::Zero();
    Vector2 here = Vector2::Zero();
    Vector2 there = Vector2::Zero();
    double length = 0.0;
    for (const HalfedgeId h : edges) {
      const HalfedgeId o = opposite(h);
      const Vector2 x = side(h);
      const Vector2 y = from(o) - to(o);
      turn += Vector2(x.dot(y), cross(y, x));
      here += 0.5 * x.norm() * (from(h) + to(h));
      there += 0.5 * x.norm() * (from(o) + to(o));
      length += x.norm();
    }
    Similarity m;
    if (turn.norm() > 0.0) m.linear = turn.normalized();
    if (length > 0.0) m.translation = (here - m(there)) / length;
    return m;
  }

  Corners moved(FaceId f, const Similarity& m) const {
    return {m(at_[at(f)][0]), m(at_[at(f)][1]), m(at_[at(f)][2])};
  }

  // Keys of different cells may be the same: what is found there is compared.
  static std::uint64_t key(Index net, std::int64_t x, std::int64_t y) {
    std::uint64_t k = static_cast<std::uint64_t>(net) * 0x9e3779b97f4a7c15u;
    k = (k ^ static_cast<std::uint64_t>(x)) * 0xbf58476d1ce4e5b9u;
    return (k ^ (k >> 31) ^ static_cast<std::uint64_t>(y)) * 0x94d049bb133111ebu;
  }

  template <typename Visit>
  void for_cells(const Corners& corners, Visit visit) const {
    Eigen::AlignedBox2d box;
    for (const Vector2& p : corners) box.extend(p);
    const auto cell = [&](double x) { return static_cast<std::int64_t>(std::floor(x / cell_)); };
    // Most of a needle's box is beside it, where spokes have their boxes, too.
    const auto is_beside = [&](const Vector2& middle) {
      bool is = false;
      for (std::size_t k = 0; k < 3 && !is; ++k) {
        const Vector2 side = corners[(k + 1) % 3] - corners[k];
        is = cross(side, middle - corners[k]) < -kHalfCell * cell_ * side.norm();
      }
      return is;
    };
    for (std::int64_t x = cell(box.min().x()); x <= cell(box.max().x()); ++x) {
      for (std::int64_t y = cell(box.min().y()); y <= cell(box.max().y()); ++y) {
        const Eigen::Array2d corner(static_cast<double>(x), static_cast<double>(y));
        if (!is_beside(cell_ * (corner + 0.5))) visit(x, y);
      }
    }
  }

  void enter(FaceId f) {
    for_cells(at_[at(f)],
              [&](std::int64_t x, std::int64_t y) { cells_[key(net_[at(f)], x, y)].push_back(f); });
  }

  // Deeper than `care`.
  bool overlaps(Index stays, Index moves, const Similarity& m, double care) const {
    return std::ranges::any_of(members_[at(moves)], [&](FaceId f) {
      const Corners corners = moved(f, m);
      bool found = false;
      for_cells(corners, [&](std::int64_t x, std::int64_t y) {
        const auto cell = cells_.find(key(stays, x, y));
        found = found || (cell != cells_.end() && std::ranges::any_of(cell->second, [&](FaceId g) {
                            return net_[at(g)] == stays &&
                                   overlap(at_[at(g)], corners,
                                           care + part_.soft[at(f)] + part_.soft[at(g)]);
                          }));
      });
      return found;
    });
  }

  // Lengths of a net's outline by direction, turned by `m`.
  using Bins = std::vector<double>;
  static void add_side(const Vector2& side, double weight, Bins& bins) {
    const double length = side.norm();
    if (!(length > 0.0)) return;
    double angle = std::fmod(std::atan2(side.y(), side.x()) + 2 * std::numbers::pi, kQuarterTurn);
    const int bin = std::min(static_cast<int>(angle / kQuarterTurn * kBins), kBins - 1);
    bins[at(bin)] += weight * length;
  }
  void add_outline(Index net, const Similarity& m, Bins& bins) const {
    for (const FaceId f : members_[at(net)]) {
      for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h)
        if (!is_joined(h)) add_side(m(to(h)) - m(from(h)), 1.0, bins);
    }
  }
  const Bins& outline(Index net) {
    Bins& bins = bins_[at(net)];
    if (bins.empty()) {
      bins.assign(kBins, 0.0);
      add_outline(net, {}, bins);
    }
    return bins;
  }
  // Of its length as much as runs along one cross.
  static double along_cross(const Bins& bins) {
    double most = 0.0;
    for (int i = 0; i < kBins; ++i)
      most = std::max(most,
                      bins[at((i + kBins - 1) % kBins)] + bins[at(i)] + bins[at((i + 1) % kBins)]);
    return most;
  }
  bool is_straight(const Bins& bins) const {
    const double least = part_.bevelled ? kStraightBevelled : kStraightOutline;
    return along_cross(bins) >= least * length_of(bins);
  }
  static double length_of(const Bins& bins) {
    return std::accumulate(bins.begin(), bins.end(), 0.0);
  }

  // Longer than nets may be, and than either is.
  bool is_longer(Index a, Index b, const Similarity& m) const {
    const double before = std::max(spans_[at(a)].length(), spans_[at(b)].length());
    const double most = std::max(longest_, 1.001 * before);
    Spans whole = spans_[at(a)];
    if (whole.length() + spans_[at(b)].length() <= most) return false;
    for (const FaceId f : members_[at(b)]) {
      for (const Vector2& p : at_[at(f)]) whole.add(m(p));
    }
    return whole.length() > most;
  }

  // Net b becomes part of a.
  void take(HalfedgeId h, const Similarity& m, Index a, Index b) {
    if (!bins_[at(a)].empty()) add_outline(b, m, bins_[at(a)]);
    for (const FaceId f : members_[at(b)]) {
      at_[at(f)] = moved(f, m);
      net_[at(f)] = a;
      members_[at(a)].push_back(f);
      for (const Vector2& p : at_[at(f)]) spans_[at(a)].add(p);
      enter(f);
    }
    members_[at(b)].clear();
    bins_[at(b)].clear();
    mark(h);
    if (!bins_[at(a)].empty()) add_side(side(h), -2.0, bins_[at(a)]);
  }

  // Of a net's outline towards others the longest edge, seen from there.
  HalfedgeId longest_border(Index net) const {
    HalfedgeId best = kInvalid;
    double most = 0.0;
    for (const FaceId f : members_[at(net)]) {
      for (HalfedgeId g = 3 * f; g < 3 * f + 3; ++g) {
        const HalfedgeId o = opposite(g);
        if (o == kInvalid || is_joined(g) || net_at(o) == net || !(side(g).norm() > most)) continue;
        most = side(g).norm();
        best = o;
      }
    }
    return best;
  }

  const MadePart& part_;
  double longest_;
  const ExecutionContext& context_;
  double cell_;
  std::vector<Corners> at_;                   // per face, in its net's plane
  std::vector<Index> net_;                    // per face
  std::vector<std::vector<FaceId>> members_;  // per net
  std::vector<char> is_joined_;               // per half-edge
  std::vector<char> is_forced_;               // per half-edge
  std::vector<Bins> bins_;                    // per net; empty: not counted
  std::vector<Spans> spans_;                  // per net
  std::unordered_map<std::uint64_t, std::vector<FaceId>> cells_;
  std::size_t tried_ = 0;
};

// Flat edges, then smooth ones, then the others, those first that are worth most.
std::vector<Hinge> in_order(const MadePart& part) {
  const double unit = 1e-6 * part.size();
  const auto rank = [&](const Hinge& hinge) {
    const int kind = hinge.angle < kFlatAngle ? 0 : hinge.angle < kBendAngle ? 1 : 2;
    return std::tuple(kind, -std::round(hinge.worth / unit), hinge.h);
  };
  std::vector<Hinge> order = part.hinges;
  std::sort(order.begin(), order.end(),
            [&](const Hinge& a, const Hinge& b) { return rank(a) < rank(b); });
  return order;
}

// Flags of a part's edges that no net runs over, none where it is not hard.
mesh::EdgeFlags seams_of(const MadePart& part, double longest,
                         const std::vector<HalfedgeId>& bevels, const ExecutionContext& context) {
  const std::vector<Hinge> order = in_order(part);
  Nets nets(part, longest, context);
  for (const Hinge& hinge : order) {
    if (hinge.angle < kFlatAngle) nets.join(hinge.h, {});
  }
  nets.force(bevels);
  for (int round = 0; round < 2; ++round) {
    for (const Hinge& hinge : order)
      nets.join(hinge.h, {hinge.angle >= kFlatAngle, hinge.angle >= kBendAngle});
  }
  nets.gather_slivers();
  if (!nets.are_hard()) return {};
  mesh::EdgeFlags flags(part.opposite.size(), 0);
  for (const Hinge& hinge : part.hinges) {
    if (!nets.is_joined(hinge.h)) flags[at(hinge.h)] = flags[at(part.opposite[at(hinge.h)])] = 1;
  }
  return flags;
}

}  // namespace

mesh::EdgeFlags net_seams(const mesh::Surface& surface, const mesh::EdgeFlags& seams,
                          const std::vector<double>& cost, const std::vector<char>& is_rim,
                          const ExecutionContext& context) {
  mesh::EdgeFlags flags(seams.size(), 0);
  const std::vector<double> areas = face_areas(surface);
  const double longest = kLongest * std::sqrt(std::accumulate(areas.begin(), areas.end(), 0.0));
  for (const mesh::Chart& chart : mesh::split_into_charts(
           surface.vertices, mesh::cut_along(surface.faces, surface.adjacency(), seams))) {
    context.check();
    MadePart part(chart.surface, part_of(chart, cost));
    const auto flat = flat_if_hard(part);
    if (!flat) continue;
    std::vector<HalfedgeId> bevels;
    if (*flat >= kBevelled) {
      bevels = bevels_of(part);
    } else {
      for (std::size_t f = 0; f < chart.faces.size() && !is_rim.empty(); ++f) {
        if (is_rim[at(chart.faces[f])] != 0)
          part.soft[f] = 2.0 * kBevelDepth * part.areas[f] / longest_of(part.flat[f]);
      }
    }
    put_part(chart, seams_of(part, longest, bevels, context), flags);
  }
  return flags;
}

}  // namespace flipfree::unwrap
