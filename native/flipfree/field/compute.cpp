#include "flipfree/field/compute.h"

#include <algorithm>
#include <complex>
#include <set>
#include <string>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/field/prescribed.h"
#include "flipfree/field/smoothest.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/validate.h"

namespace flipfree::field {
namespace {

void check(const FieldOptions& options, const mesh::Surface& surface) {
  const auto refuse = [](const std::string& what) { throw_invalid(ErrorCode::kBadOption, what); };
  if (!(options.alignment >= 0.0 && options.alignment < 1.0))
    refuse("alignment must lie in [0, 1), not " + std::to_string(options.alignment) + ".");
  if (!(options.edge_weight > 0.0 && options.edge_weight <= 1.0))
    refuse("edge_weight must lie in (0, 1], not " + std::to_string(options.edge_weight) + ".");
  check_sizing(options.sizing, surface);
  if (options.loops && !options.cones) refuse("loops need cones: give both.");
  if (!options.cones) return;
  if (options.cones->size() != at(surface.vertices.rows()))
    throw_invalid(ErrorCode::kBadShape, "cones need one number per vertex.");
}

// The angles of the directions that faces are asked for.
std::vector<double> angles_of(const Crosses& u) {
  std::vector<double> angle;
  for (const std::complex<double>& cross : u) angle.push_back(0.25 * std::arg(cross));
  return angle;
}

// Turns the directions of a field whose matching stays, so that those beside the boundary run along
// it where the matching lets them.
void follow_boundary(const Frames& own, const Frames& frames, CrossField& field,
                     ExecutionContext& context) {
  constexpr double kPull = 10.0;  // beside weights that are about one
  const auto faces = static_cast<Index>(field.angle.size());
  Wishes wishes(faces);
  follow_edges(own, mesh::EdgeFlags(at(3 * faces), 0), true, 1.0, wishes);
  std::vector<double> pull;
  for (const char held : wishes.held) pull.push_back(held == 0 ? 0.0 : kPull);
  AngleSystem(frames, std::vector<char>(at(faces), 0), std::move(pull), context)
      .relax(angles_of(wishes.cross), field, context);
}

CrossField guided_field(const Frames& own, const Frames& frames, const FieldOptions& options,
                        Wishes& wishes, ExecutionContext& context) {
  const mesh::Surface& surface = own.surface;
  const mesh::EdgeFlags edges = mesh::flag_edges(surface.faces, surface.adjacency(), options.edges);
  follow_curvature(surface, options.alignment, wishes);
  follow_edges(own, edges, options.boundary, options.edge_weight, wishes);
  // E of nearly equal crosses is 16 w rotation^2, and so with the wishes.
  std::vector<double> pull;
  Crosses u;
  {
    const ProgressRange range(context, 0.0, 0.7);
    u = smoothest(frames, wishes, pull, context);
  }
  CrossField field = match_nearest(frames, angles_of(u));
  const ProgressRange range(context, 0.7, 1.0);
  const AngleSystem system(frames, wishes.held, std::move(pull), context);
  system.descend(angles_of(wishes.cross), field, context);
  return field;
}

FoundField compute(const mesh::Surface& surface, const FieldOptions& options,
                   ExecutionContext& context) {
  const Stopwatch clock;
  mesh::validate(surface, {}, context);
  const mesh::Adjacency& adjacency = surface.adjacency();
  check(options, surface);
  const Frames own = measure_frames(surface);
  const Frames frames = options.sizing.empty() ? own : sized_frames(own, options.sizing);
  Wishes wishes(static_cast<Index>(surface.faces.rows()));
  FoundField found;
  found.field = options.cones ? field_with_signature(frames, *options.cones, options.loops, context)
                              : guided_field(own, frames, options, wishes, context);
  if (options.cones && options.boundary) follow_boundary(own, frames, found.field, context);
  if (options.simplify || !options.cones) {
    SimplifyOptions how{options.sizing.empty() ? options.reach : 0.0};
    if (!options.simplify) how = {0.0, 1};  // only those that no map can have
    const Simplified done = simplify(frames, wishes.held, how, found.field, context);
    found.stats["cancelled"] = static_cast<std::int64_t>(done.cancelled);
    found.stats["spread"] = static_cast<std::int64_t>(done.spread);
  }
  found.cones = cone_turns(frames, found.field);
  std::int64_t cones = 0, sharp = 0;
  for (std::size_t v = 0; v < found.cones.size(); ++v) {
    const HalfedgeId h = adjacency.vertex_halfedge[v];
    if (h == kInvalid || adjacency.opposite[at(h)] == kInvalid) continue;
    cones += found.cones[v] != 4;
    sharp += found.cones[v] <= 1;
  }
  found.stats["cones"] = cones;
  found.stats["sharp_cones"] = sharp;
  found.stats["seconds"] = clock.seconds();
  return found;
}

// The edges that keep(a, b) wants.
template <typename Keep>
IndexPairs kept_edges(const IndexPairs& edges, const Keep& keep) {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < edges.rows(); ++i)
    if (keep(edges(i, 0), edges(i, 1))) rows.push_back(i);
  return edges(rows, Eigen::all);
}

// Without the edges of faces at inner vertices of no quarter turn.
IndexPairs possible_edges(const IndexPairs& edges, const mesh::Surface& surface,
                          const std::vector<Index>& cones) {
  const mesh::Adjacency& adjacency = surface.adjacency();
  std::set<std::pair<VertexId, VertexId>> impossible;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(adjacency.opposite.size()); ++h) {
    const VertexId v = mesh::source(surface.faces, h);
    if (cones[at(v)] >= 1 || adjacency.opposite[at(adjacency.vertex_halfedge[at(v)])] == kInvalid)
      continue;
    for (const HalfedgeId i : {h, next_corner(h), previous_corner(h)})
      impossible.insert(
          std::minmax(mesh::source(surface.faces, i), mesh::target(surface.faces, i)));
  }
  return kept_edges(
      edges, [&](VertexId a, VertexId b) { return !impossible.contains(std::minmax(a, b)); });
}

// Without connected lines that are as short as a detail of the longest one, and would turn whole
// sides of what they lie on.
IndexPairs without_details(const IndexPairs& edges, const mesh::Surface& surface) {
  constexpr double kDetail = 1.0 / 64.0;
  if (edges.rows() == 0 || edges.minCoeff() < 0 || edges.maxCoeff() >= surface.vertices.rows())
    return edges;  // compute() names those that are none
  DisjointSets lines(static_cast<Index>(surface.vertices.rows()));
  for (Eigen::Index i = 0; i < edges.rows(); ++i) lines.join(edges(i, 0), edges(i, 1));
  std::vector<double> length(at(surface.vertices.rows()), 0.0);
  for (Eigen::Index i = 0; i < edges.rows(); ++i)
    length[at(lines.find(edges(i, 0)))] +=
        (surface.vertices.row(edges(i, 0)) - surface.vertices.row(edges(i, 1))).norm();
  const double longest = *std::max_element(length.begin(), length.end());
  return kept_edges(
      edges, [&](VertexId a, VertexId) { return length[at(lines.find(a))] >= kDetail * longest; });
}

FoundField compute_possible(const mesh::Surface& surface, const FieldOptions& given,
                            ExecutionContext& context) {
  FieldOptions options = given;
  if (options.let_go) options.edges = without_details(given.edges, surface);
  for (;;) {
    FoundField found = compute(surface, options, context);
    IndexPairs kept = possible_edges(options.edges, surface, found.cones);
    if (options.let_go && kept.rows() < options.edges.rows()) {
      options.edges = std::move(kept);
      continue;
    }
    if (options.let_go)
      found.stats["let_go"] = static_cast<std::int64_t>(given.edges.rows() - options.edges.rows());
    return found;
  }
}

}  // namespace

FoundField compute_cross_field(const mesh::Surface& surface, const FieldOptions& options,
                               ExecutionContext& context) {
  return in_time(context, options.max_seconds, "The cross field was not reached",
                 "or decimate the mesh",
                 [&] { return compute_possible(surface, options, context); });
}

CrossField read_field(const mesh::Surface& surface, const GivenField& given,
                      const ExecutionContext& context) {
  mesh::validate(surface, {}, context);
  const auto faces = at(surface.faces.rows());
  const auto fits = [&](std::size_t count, std::size_t of_each) {
    return count == 0 || count == of_each * faces;
  };
  const auto directions = at(given.directions.rows());
  if (!fits(directions, 1) || !fits(given.rotation.size(), 3) || !fits(given.quarters.size(), 3)) {
    throw_invalid(ErrorCode::kBadShape, "The field is not one of this mesh, which has " +
                                            std::to_string(faces) +
                                            " faces. Give the mesh that the field was made for.");
  }
  const Frames frames = measure_frames(surface);
  if (directions == 0) return field_of_rotation(frames, given.rotation);
  std::vector<double> angle = angles_of(surface, given.directions);
  if (!given.rotation.empty()) return match_by_rotation(frames, std::move(angle), given.rotation);
  return given.quarters.empty() ? match_nearest(frames, std::move(angle))
                                : match_by_quarters(frames, std::move(angle), given.quarters);
}

GivenField describe(const mesh::Surface& surface, const CrossField& field) {
  return {directions_of(surface, field.angle), rotation_form(measure_frames(surface), field),
          quarters_across(surface, field)};
}

}  // namespace flipfree::field
