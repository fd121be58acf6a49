#include "flipfree/matchmaker/start/first_try.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/minimize/minimize.h"
#include "flipfree/distortion/untangle.h"
#include "flipfree/distortion/valid_map.h"
#include "flipfree/embedding/embed.h"
#include "flipfree/matchmaker/target/target_domain.h"
#include "flipfree/unwrap/packing/layout.h"

namespace flipfree::matchmaker {

namespace {

// A first guess for a map onto a prescribed outline, simple or self-overlapping: through the common
// disk. The surface is mapped onto a circle (Tutte), the target's triangulation by its outline
// vertices alone onto the same circle, where it is valid as it stands (all of its vertices are on a
// convex curve). A vertex goes to the point of the target that shares its place in the disk. The
// composition is one-to-one; its values at the vertices, joined linearly, may have flips where
// triangles are large against the target's: a start for untangle.h, nothing more.
Points2 compose_through_disk(const mesh::RefinedSurface& surface, const TargetDomain& domain,
                             ExecutionContext& context) {
  const std::size_t n = domain.outline.size();
  std::vector<VertexId> loop;
  std::vector<double> lengths;
  for (std::size_t i = 0; i < n; ++i) {
    loop.push_back(domain.mesh_vertex[at(domain.outline[i])]);
    lengths.push_back(
        (domain.point[at(domain.outline[(i + 1) % n])] - domain.point[at(domain.outline[i])])
            .norm());
  }
  const Points2 disk = onto_circle(surface, loop, lengths, context);
  std::vector<Vector2> place(domain.point.size());
  for (std::size_t i = 0; i < n; ++i) place[at(domain.outline[i])] = disk.row(loop[i]).transpose();
  // Where it lies in the disk, carried along as the disk becomes the target.
  return Carrier(surface, disk, domain, place, context).vertices(domain.point);
}

// Rounds in which triangles come to rest at the shapes that they have, all of one area; the first
// one aims at equilateral triangles.
constexpr int kMetricRounds = 9;
constexpr int kStepsPerMetricRound = 4;
// Weight of areas against angles.
constexpr double kAreas = 1.0;
constexpr double kLeastTriangleHeight = 0.01;

using Shape = std::array<Vector2, 3>;

double twice_area_of(const Shape& t) { return twice_area(t[0], t[1], t[2]); }

}  // namespace

Points2 onto_circle(const mesh::RefinedSurface& surface, const std::vector<VertexId>& loop,
                    const std::vector<double>& lengths, ExecutionContext& context) {
  embedding::EmbedOptions options;
  options.float32 = false;
  Stats unused;
  const Points2 circle =
      embedding::place_boundary(embedding::BoundaryShape::kCircle, lengths).positions;
  return distortion::with_own_map([&] {
    return embedding::embed_disk(surface.mesh.faces(), surface.mesh.vertex_count(), loop, circle,
                                 options, context, unused);
  });
}

mesh::Surface equal_area_metric(const mesh::RefinedSurface& surface, const Points2& uv,
                                ExecutionContext& context) {
  mesh::Surface flat = to_surface(surface);
  const auto count = static_cast<std::size_t>(flat.faces.rows());
  Points2 here = uv;
  const auto shape = [&](std::size_t f) {
    const auto row = static_cast<Eigen::Index>(f);
    return Shape{here.row(flat.faces(row, 0)).transpose(), here.row(flat.faces(row, 1)).transpose(),
                 here.row(flat.faces(row, 2)).transpose()};
  };
  double total = 0;
  for (std::size_t f = 0; f < count; ++f) total += 0.5 * twice_area_of(shape(f));
  std::vector<char> fixed(surface.position.size(), 0);
  for (const VertexId v : surface.boundary) fixed[at(v)] = 1;
  std::vector<Shape> shapes(count, {Vector2(0, 0), Vector2(1, 0), Vector2(0.5, 0.75)});
  distortion::Untangler untangler(flat, fixed, context);
  distortion::UntangleOptions options;
  options.max_iterations = kStepsPerMetricRound;
  options.extra_iterations = kStepsPerMetricRound;
  options.lambda = kAreas;
  options.target_area = total;
  options.least_height = kLeastTriangleHeight;
  options.shapes = &shapes;
  for (int round = 0; round < kMetricRounds; ++round) {
    distortion::UntangleResult result = untangler.run(here, options, context);
    if (result.flips != 0) break;
    here = std::move(result.uv);
    for (std::size_t f = 0; f < count; ++f) {
      shapes[f] = shape(f);
      const double scale = 1.0 / std::sqrt(twice_area_of(shapes[f]));
      for (Vector2& p : shapes[f]) p *= scale;
    }
  }
  for (Eigen::Index v = 0; v < here.rows(); ++v)
    flat.vertices.row(v) << here(v, 0), here(v, 1), 0.0;
  return flat;
}

namespace {

// A start with a larger share of flips than this is not worth untangling: letters have 3 to 8 per
// cent, narrow spirals 27 and more, which never end well.
constexpr double kMostFolded = 0.2;

void hold(const mesh::RefinedSurface& surface, const Constraints& constraints, Points2& uv) {
  for (const PinnedVertex& p : constraints.pins) uv.row(p.vertex) = p.uv.transpose();
  for (std::size_t i = 0; i < constraints.outline.size(); ++i) {
    uv.row(surface.boundary[i]) = constraints.outline[i].transpose();
  }
}

// The surface's own flattening, free boundary, least distortion.
Points2 flatten(const mesh::RefinedSurface& surface, ExecutionContext& context) {
  const mesh::Surface arrays = to_surface(surface);
  std::vector<double> lengths;
  const std::size_t n = surface.boundary.size();
  for (std::size_t i = 0; i < n; ++i) {
    lengths.push_back((surface.position[at(surface.boundary[(i + 1) % n])] -
                       surface.position[at(surface.boundary[i])])
                          .norm());
  }
  Points2 uv;
  {
    const ProgressRange range(context, 0.0, 0.2);
    uv = onto_circle(surface, surface.boundary, lengths, context);
  }
  const ProgressRange range(context, 0.2, 0.6);
  distortion::MinimizeOptions minimize;
  minimize.max_iterations = 60;
  distortion::Minimized flat = distortion::with_own_map(
      [&] { return distortion::minimize_distortion(arrays, uv, minimize, context); });
  return std::move(flat.uv);
}

// Turns, scales and moves `uv` to lie over the pins: rotation of least squares, scale by the
// spreads' ratio.
void lay_over(Points2& uv, const std::vector<PinnedVertex>& pins) {
  if (pins.empty()) return;
  Points2 from(static_cast<Eigen::Index>(pins.size()), 2);
  Points2 to = from;
  for (Eigen::Index i = 0; i < from.rows(); ++i) {
    from.row(i) = uv.row(pins[at(i)].vertex);
    to.row(i) = pins[at(i)].uv.transpose();
  }
  const auto spread = [](const Points2& p) { return (p.rowwise() - p.colwise().mean()).norm(); };
  const double scale = spread(from) > 0 ? spread(to) / spread(from) : 1.0;
  uv = moved(fit_motion(from, to, scale), uv);
}

// Inner edges between boundary vertices whose straight images have no room in the target.
void split_blind_chords(mesh::RefinedSurface& surface, const Constraints& constraints) {
  if (!is_locally_convex(constraints.outline)) return split_chords(surface, constraints.edges);
  const Triangles faces = surface.mesh.faces();
  for (const HalfedgeId h :
       embedding::chords_to_split(faces, surface.mesh.vertex_count(), surface.boundary,
                                  rows_of(constraints.outline), true))
    surface.split_edge(surface.mesh.find(mesh::source(faces, h), mesh::target(faces, h)));
}

double outline_area(const Polygon& outline) {
  double twice = 0;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vector2 a = outline[i] - outline[0];
    const Vector2 b = outline[(i + 1) % outline.size()] - outline[0];
    twice += cross(a, b);
  }
  return 0.5 * std::abs(twice);
}

}  // namespace

void split_chords(mesh::RefinedSurface& surface,
                  const std::vector<std::pair<VertexId, VertexId>>& uncut) {
  const mesh::EditableTriangulation& mesh = surface.mesh;
  std::vector<std::pair<VertexId, VertexId>> chords;
  for (HalfedgeId h = 0; h < mesh.halfedge_slots(); ++h) {
    if (mesh.alive(h / 3) && mesh.edge(h) == h && !mesh.is_boundary(h) &&
        mesh.is_boundary_vertex(mesh.source(h)) && mesh.is_boundary_vertex(mesh.target(h)))
      chords.emplace_back(mesh.source(h), mesh.target(h));
  }
  for (const auto& [a, b] : uncut) {
    std::erase(chords, std::pair(a, b));
    std::erase(chords, std::pair(b, a));
  }
  for (const auto& [a, b] : chords) surface.split_edge(mesh.find(a, b));
}

std::vector<VertexId> held_vertices(const mesh::RefinedSurface& surface,
                                    const Constraints& constraints) {
  std::vector<VertexId> held;
  for (const PinnedVertex& p : constraints.pins) held.push_back(p.vertex);
  if (!constraints.free_boundary())
    held.insert(held.end(), surface.boundary.begin(), surface.boundary.end());
  std::sort(held.begin(), held.end());
  return held;
}

namespace {

// A flip-free map with the prescribed boundary, untangled from `start`; nothing if the search
// failed. (With a free boundary positive triangles may wind twice around an inner vertex; with a
// simple outline they cannot, see outline_target.h.)
std::optional<Points2> untangle_from(const mesh::RefinedSurface& surface,
                                     const Constraints& constraints, const Points2& start,
                                     ExecutionContext& context) {
  const mesh::Surface arrays = to_surface(surface);
  std::vector<char> fixed(surface.position.size(), 0);
  for (const VertexId v : held_vertices(surface, constraints)) fixed[at(v)] = 1;
  Points2 begin = start;
  hold(surface, constraints, begin);
  distortion::Untangler untangler(arrays, fixed, context);
  // A fast schedule first; where it gets stuck in a fold, a slow one often does not.
  for (const double pace : {0.4, 0.15}) {
    distortion::UntangleOptions options;
    options.pace = pace;
    if (!constraints.free_boundary()) options.target_area = outline_area(constraints.outline);
    distortion::UntangleResult result = untangler.run(begin, options, context);
    if (result.flips == 0) return std::move(result.uv);
  }
  return std::nullopt;
}

}  // namespace

std::optional<Points2> first_try(mesh::RefinedSurface& surface, const Constraints& constraints,
                                 ExecutionContext& context) {
  if (constraints.free_boundary()) {
    Points2 uv = flatten(surface, context);
    lay_over(uv, constraints.pins);
    if (distortion::is_flip_free(surface.mesh.faces(), uv, context)) return uv;
    return std::nullopt;  // needles that lose their area when turned; MatchMaker++ starts from
                          // combinatorics
  }
  split_blind_chords(surface, constraints);
  const Constraints boundary_only = outline_alone(constraints);
  const Target target = full_target(surface, boundary_only, context);
  const Points2 start = compose_through_disk(surface, target.domain, context);
  const auto folded =
      static_cast<double>(distortion::flipped_faces(surface.mesh.faces(), start, context).size());
  if (folded > kMostFolded * static_cast<double>(surface.mesh.faces().rows())) return std::nullopt;
  return untangle_from(surface, boundary_only, start, context);
}

}  // namespace flipfree::matchmaker
