#include "flipfree/field/cross_field.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/plane.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut_graph.h"
#include "flipfree/mesh/face_area.h"

namespace flipfree::field {

namespace {

constexpr double kPi = std::numbers::pi;

// What is less than this of a unit vector is rounding.
constexpr double kUpright = 1e-9;

// Of length one, or zero. A power of two first: in a part that is 1e-308 as large as another one
// lengths have lost most of their digits.
Vector3 unit(const Vector3& v) {
  constexpr double kSmall = 0x1p-900;
  const bool small = v.cwiseAbs().maxCoeff() < kSmall;
  return (small ? Vector3(v / kSmall) : v).stableNormalized();
}

// The two axes of a face: along its first edge, and to the left of it.
struct Axes {
  Vector3 x, y;
};
Axes axes_of(const mesh::Surface& surface, FaceId f) {
  const auto [a, b, c] = surface.corners(f);
  const Vector3 x = unit(b - a);
  // The longer of the other sides, and twice, so that needles keep a normal.
  Vector3 y = unit((c - a).squaredNorm() > (c - b).squaredNorm() ? c - a : c - b);
  for (int again = 0; again < 2; ++again) y = (y - x * x.dot(y)).stableNormalized();
  if (!(std::abs(x.dot(y)) < kUpright && y.norm() > 0.5)) y = x.unitOrthogonal();
  return {x, y};
}

[[noreturn]] void refuse_edge(HalfedgeId h, const std::string& what, double by) {
  throw_invalid(ErrorCode::kBadAngles,
                "The rotation across edge " + std::to_string(h % 3) + " of face " + face_id(h / 3) +
                    " " + what + ", by " + std::to_string(by) +
                    " radians. Give the angle between the field's directions on both sides, as "
                    "seen from the edge, with the sign of the half-edge.",
                ElementKind::kFace, {h / 3});
}

// Per half-edge: across inner edges value(h, its opposite) of the lower half-edge h, and less than
// nothing by as much of the other one; 0 on the boundary.
template <typename T, typename Value>
std::vector<T> antisymmetric(const mesh::Surface& surface, const Value& value) {
  const std::vector<HalfedgeId>& opposite = surface.adjacency().opposite;
  std::vector<T> values(opposite.size(), 0);
  for (HalfedgeId h = 0; at(h) < opposite.size(); ++h) {
    const HalfedgeId o = opposite[at(h)];
    if (o == kInvalid || o < h) continue;
    values[at(h)] = value(h, o);
    values[at(o)] = -values[at(h)];
  }
  return values;
}

// Divided by a power of two near its length, which is exact: beside a large part, or a long side,
// squares of areas vanish among doubles.
Vector3 in_own_unit(const Vector3& side) {
  const int exponent = std::ilogb(side.cwiseAbs().maxCoeff());
  return side.unaryExpr([&](double x) { return std::ldexp(x, -exponent); });
}

}  // namespace

Frames measure_frames(const mesh::Surface& surface) {
  const auto count = static_cast<Index>(surface.faces.rows());
  Frames frames{surface, std::vector<double>(at(3 * count)), std::vector<double>(at(3 * count))};
  for (FaceId f = 0; f < count; ++f) {
    for (CornerId c = 3 * f; c < 3 * f + 3; ++c) {
      const auto sides = mesh::sides_at(surface, c);
      const Vector3 a = in_own_unit(sides.next), b = in_own_unit(sides.previous);
      frames.corner[at(c)] = std::atan2(a.cross(b).norm(), a.dot(b));
    }
    frames.direction[at(3 * f)] = 0.0;
    frames.direction[at(3 * f + 1)] = kPi - frames.corner[at(3 * f + 1)];
    frames.direction[at(3 * f + 2)] = kPi + frames.corner[at(3 * f)];
  }
  return frames;
}

CrossField match_nearest(const Frames& frames, std::vector<double> angle) {
  const auto nearest = [&](HalfedgeId h, HalfedgeId o) {
    return static_cast<Index>(
        std::lround((from_edge(frames, angle, o) - from_edge(frames, angle, h)) / kQuarterTurn));
  };
  std::vector<Index> matching = antisymmetric<Index>(frames.surface, nearest);
  return {std::move(angle), std::move(matching)};
}

std::vector<double> rotation_form(const Frames& frames, const CrossField& field) {
  return antisymmetric<double>(frames.surface, [&](HalfedgeId h, HalfedgeId o) {
    return from_edge(frames, field.angle, h) - from_edge(frames, field.angle, o) +
           kQuarterTurn * field.matching[at(h)];
  });
}

CrossField match_by_rotation(const Frames& frames, std::vector<double> angle,
                             const std::vector<double>& rotation) {
  constexpr double kTolerance = 1e-6;  // radians
  const auto across = [&](HalfedgeId h, HalfedgeId o) {
    const double sum = std::abs(rotation[at(h)] + rotation[at(o)]);
    if (!(sum <= kTolerance)) refuse_edge(h, "is not the opposite of the one coming back", sum);
    const double turns =
        (rotation[at(h)] - from_edge(frames, angle, h) + from_edge(frames, angle, o)) /
        kQuarterTurn;
    const double whole = std::round(turns);
    const double off = std::abs(turns - whole) * kQuarterTurn;
    if (!(off <= kTolerance) || std::abs(whole) > 1e9)
      refuse_edge(h, "is not that of a cross field", off);
    return static_cast<Index>(whole);
  };
  std::vector<Index> matching = antisymmetric<Index>(frames.surface, across);
  return {std::move(angle), std::move(matching)};
}

CrossField field_of_rotation(const Frames& frames, const std::vector<double>& rotation) {
  std::vector<double> angle(at(frames.surface.faces.rows()), 0.0);
  mesh::for_each_face_across(
      frames.surface.adjacency(), [](HalfedgeId, HalfedgeId) { return true; },
      [&](HalfedgeId h, HalfedgeId o) {
        const double turned =
            from_edge(frames, angle, h) - rotation[at(h)] + frames.direction[at(o)];
        if (!std::isfinite(turned)) refuse_edge(h, "is not finite", rotation[at(h)]);
        angle[at(o / 3)] = std::remainder(turned, 2.0 * kPi);
      });
  return match_by_rotation(frames, std::move(angle), rotation);
}

std::vector<Index> quarters_across(const mesh::Surface& surface, const CrossField& field) {
  const std::vector<HalfedgeId>& opposite = surface.adjacency().opposite;
  std::vector<Index> quarters(opposite.size(), 0);
  for (std::size_t h = 0; h < quarters.size(); ++h) {
    // Half-edges run against each other: half a turn between the two faces' edges.
    if (opposite[h] != kInvalid) quarters[h] = ((-field.matching[h] - 2) % 4 + 4) % 4;
  }
  return quarters;
}

CrossField match_by_quarters(const Frames& frames, std::vector<double> angle,
                             const std::vector<Index>& quarters) {
  const auto across = [&](HalfedgeId h, HalfedgeId o) {
    if ((std::int64_t{quarters[at(h)]} + quarters[at(o)]) % 4 != 0) {
      throw_invalid(ErrorCode::kBadOption,
                    "The matching across edge " + std::to_string(h % 3) + " of face " +
                        face_id(h / 3) +
                        " is not the opposite of the one coming back. Make their sum 0, 4 or 8.",
                    ElementKind::kFace, {h / 3, o / 3});
    }
    const double d = from_edge(frames, angle, h) - from_edge(frames, angle, o);
    const Index least = -(quarters[at(h)] % 4) - 2;
    const double turns = (-kPi - d - least * kQuarterTurn) / (2.0 * kPi);
    return least + 4 * static_cast<Index>(std::ceil(turns));
  };
  std::vector<Index> matching = antisymmetric<Index>(frames.surface, across);
  return {std::move(angle), std::move(matching)};
}

Points3 directions_of(const mesh::Surface& surface, const std::vector<double>& angle) {
  Points3 directions(surface.faces.rows(), 3);
  for (FaceId f = 0; f < static_cast<FaceId>(surface.faces.rows()); ++f) {
    const Axes axes = axes_of(surface, f);
    directions.row(f) = std::cos(angle[at(f)]) * axes.x + std::sin(angle[at(f)]) * axes.y;
  }
  return directions;
}

std::vector<double> angles_of(const mesh::Surface& surface, const Points3& directions) {
  std::vector<double> angle(at(surface.faces.rows()));
  std::vector<FaceId> none;
  for (FaceId f = 0; f < static_cast<FaceId>(surface.faces.rows()); ++f) {
    const Axes axes = axes_of(surface, f);
    const Vector3 d = Vector3(directions.row(f)).stableNormalized();
    const double x = d.dot(axes.x), y = d.dot(axes.y);
    // Less than this of the direction in the plane is rounding.
    constexpr double kLeastPart = 1e-6;
    if (!(std::hypot(x, y) > kLeastPart)) none.push_back(f);
    angle[at(f)] = std::atan2(y, x);
  }
  if (!none.empty()) {
    throw_invalid(ErrorCode::kBadAngles,
                  "The field has no direction in the plane of face " + face_id(none.front()) +
                      " (" + std::to_string(none.size()) +
                      " faces in all). Give every face a vector that is not across it.",
                  ElementKind::kFace, first_elements(none));
  }
  return angle;
}

std::vector<double> face_areas(const mesh::Surface& surface) {
  std::vector<double> area(at(surface.faces.rows()));
  for (FaceId f = 0; at(f) < area.size(); ++f) {
    const auto [a, b] = mesh::sides_at(surface, 3 * f);
    area[at(f)] = 0.5 * a.cross(b).norm();
  }
  return area;
}

std::vector<double> edge_weights(const mesh::Surface& surface, const std::vector<double>& area) {
  constexpr double kHeaviest = 1e5, kLightest = 1e-5;
  const std::vector<HalfedgeId>& opposite = surface.adjacency().opposite;
  std::vector<double> weight(opposite.size(), 0.0);
  for (HalfedgeId h = 0; at(h) < weight.size(); ++h) {
    const HalfedgeId o = opposite[at(h)];
    if (o == kInvalid || o < h) continue;
    const double square = (surface.vertices.row(mesh::target(surface.faces, h)) -
                           surface.vertices.row(mesh::source(surface.faces, h)))
                              .squaredNorm();
    const double ratio = 1.5 * square / (area[at(h / 3)] + area[at(o / 3)]);
    // Squares and areas that vanish among doubles say nothing.
    weight[at(h)] = std::isnan(ratio) ? 1.0 : std::clamp(ratio, kLightest, kHeaviest);
    weight[at(o)] = weight[at(h)];
  }
  return weight;
}

namespace {

// direction(the side out of a corner) - direction(the side into it) + corner, in quarter turns: pi,
// less a full turn at corner 0, where directions begin anew.
Index around_corner(CornerId c) { return c % 3 == 0 ? -2 : 2; }

}  // namespace

Index nearest_quarter(const Frames& frames, const CrossField& field, HalfedgeId h) {
  return static_cast<Index>(std::lround(from_edge(frames, field.angle, h) / kQuarterTurn));
}

std::vector<Index> cone_turns(const Frames& frames, const CrossField& field) {
  const Triangles& faces = frames.surface.faces;
  const mesh::Adjacency& adjacency = frames.surface.adjacency();
  std::vector<Index> cones(adjacency.vertex_halfedge.size(), 0);
  for (HalfedgeId h = 0; at(h) < adjacency.opposite.size(); ++h) {
    // The corner at the source of h lies between the side before it and h.
    cones[at(mesh::source(faces, h))] += around_corner(h);
    cones[at(mesh::target(faces, h))] += field.matching[at(h)];
    if (adjacency.opposite[at(h)] != kInvalid) continue;
    const Index quarter = nearest_quarter(frames, field, h);
    cones[at(mesh::source(faces, h))] += quarter;
    cones[at(mesh::target(faces, h))] -= quarter;
  }
  for (std::size_t v = 0; v < cones.size(); ++v) {
    if (adjacency.vertex_halfedge[v] == kInvalid) cones[v] = 4;
  }
  return cones;
}

Index turn_at_corner(HalfedgeId entered, HalfedgeId leaving) {
  // On the right hand the corner at the source of `leaving`, else the one at that of `entered`.
  return leaving == next_corner(entered) ? -around_corner(leaving) : around_corner(entered);
}

Index turning_number(const mesh::Surface& surface, const CrossField& field, const DualLoop& loop) {
  const std::vector<HalfedgeId>& opposite = surface.adjacency().opposite;
  Index turns = 0;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    turns += field.matching[at(loop[i])];
    turns += turn_at_corner(opposite[at(loop[i])], loop[(i + 1) % loop.size()]);
  }
  return turns;
}

std::vector<DualLoop> boundary_strips(const mesh::Surface& surface) {
  const mesh::Adjacency& adjacency = surface.adjacency();
  std::vector<DualLoop> strips;
  for (const auto& boundary : mesh::boundary_halfedge_loops(surface.faces, adjacency)) {
    DualLoop& strip = strips.emplace_back();
    for (const HalfedgeId b : boundary) {
      for (HalfedgeId h = next_corner(b); adjacency.opposite[at(h)] != kInvalid;
           h = next_corner(adjacency.opposite[at(h)])) {
        // Into a face with two boundary edges and back: not at all.
        intrinsic::go_across(strip, h, adjacency.opposite);
      }
    }
    intrinsic::close_strip(strip, adjacency.opposite);
  }
  return strips;
}

Signature signature_of(const mesh::Surface& surface, const CrossField& field,
                       const ExecutionContext& context) {
  Signature signature;
  signature.cones = cone_turns(measure_frames(surface), field);
  const auto add = [&](std::vector<DualLoop> loops) {
    for (DualLoop& loop : loops) {
      if (loop.empty()) continue;
      const Index turns = turning_number(surface, field, loop);
      signature.loops.push_back({std::move(loop), turns});
    }
  };
  add(intrinsic::tree_cotree(surface, context).loops);
  add(boundary_strips(surface));
  return signature;
}

}  // namespace flipfree::field
