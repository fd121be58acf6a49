// Values by corner of a surface, by vertex of its charts.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "flipfree/base/parallel.h"
#include "flipfree/base/plane.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "flipfree/mesh/cut.h"

namespace flipfree::unwrap {

// The corner, or half-edge, of the surface that is the chart's corner h.
inline std::size_t corner_of(const mesh::Chart& chart, std::size_t h) {
  return 3 * at(chart.faces[h / 3]) + h % 3;
}

inline std::size_t corner_count(const mesh::Chart& chart) { return 3 * chart.faces.size(); }

// Of values per corner of the surface (none: none) those of the chart.
template <typename Value>
std::vector<Value> part_of(const mesh::Chart& chart, const std::vector<Value>& corners) {
  std::vector<Value> own;
  for (std::size_t h = 0; h < corner_count(chart) && !corners.empty(); ++h)
    own.push_back(corners[corner_of(chart, h)]);
  return own;
}

// The map of a surface (3 #F x 2) by vertex (#V x 2), and of one of its charts.
inline Points2 by_vertex(const mesh::Surface& surface, const Points2& corners) {
  Points2 uv(surface.vertices.rows(), 2);
  for (CornerId c = 0; c < corners.rows(); ++c) uv.row(surface.faces.data()[c]) = corners.row(c);
  return uv;
}
inline Points2 by_vertex(const mesh::Chart& chart, const Points2& corners) {
  Points2 uv(chart.surface.vertices.rows(), 2);
  for (std::size_t h = 0; h < corner_count(chart); ++h)
    uv.row(chart.surface.faces.data()[h]) =
        corners.row(static_cast<Eigen::Index>(corner_of(chart, h)));
  return uv;
}
// The chart's map (#V x 2) as a part of that of the surface (3 #F x 2).
template <typename Points>
void put_corners(const mesh::Chart& chart, const Points& uv, Points& corners) {
  for (std::size_t h = 0; h < corner_count(chart); ++h)
    corners.row(static_cast<Eigen::Index>(corner_of(chart, h))) =
        uv.row(chart.surface.faces.data()[h]);
}

inline mesh::Adjacency adjacency_of(const mesh::Surface& surface) {
  return mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
}

inline double edge_length(const mesh::Surface& surface, HalfedgeId h) {
  return (surface.vertices.row(mesh::source(surface.faces, h)) -
          surface.vertices.row(mesh::target(surface.faces, h)))
      .norm();
}

// Its length is twice the face's area.
inline Vector3 face_normal(const mesh::Surface& surface, FaceId f) {
  const Vector3 p = surface.vertices.row(surface.faces(f, 0));
  const Vector3 a = surface.vertices.row(surface.faces(f, 1)).transpose() - p;
  return a.cross(surface.vertices.row(surface.faces(f, 2)).transpose() - p);
}

// Between the normals of two faces, radians.
inline double bend_between(const mesh::Surface& surface, FaceId f, FaceId g) {
  const Vector3 n = face_normal(surface, f);
  const Vector3 m = face_normal(surface, g);
  return std::atan2(n.cross(m).norm(), n.dot(m));
}

inline double uv_area(const Triangles& faces, const Points2& uv, FaceId f) {
  return 0.5 * twice_area(uv.row(faces(f, 0)), uv.row(faces(f, 1)), uv.row(faces(f, 2)));
}

// Of the whole map.
inline double uv_area(const Triangles& faces, const Points2& uv) {
  double area = 0.0;
  for (FaceId f = 0; f < faces.rows(); ++f) area += uv_area(faces, uv, f);
  return area;
}

// The first of the longest loops of half-edges; 0 if there is none.
inline std::size_t longest_loop(const mesh::Surface& surface,
                                const std::vector<std::vector<HalfedgeId>>& loops) {
  std::vector<double> length;
  for (const auto& loop : loops) {
    length.push_back(0.0);
    for (const HalfedgeId h : loop) length.back() += edge_length(surface, h);
  }
  return at(std::max_element(length.begin(), length.end()) - length.begin());
}

inline bool overlaps_itself(const Triangles& faces, const Points2& uv,
                            const ExecutionContext& context) {
  return distortion::overlaps_itself(
      distortion::find_boundary(static_cast<Index>(uv.rows()), faces), uv, context);
}

// Chosen charts, those of most faces first.
inline std::vector<std::size_t> largest_first(const std::vector<mesh::Chart>& charts,
                                              std::vector<std::size_t> chosen) {
  std::stable_sort(chosen.begin(), chosen.end(), [&](std::size_t a, std::size_t b) {
    return charts[a].faces.size() > charts[b].faces.size();
  });
  return chosen;
}

// Calls solve(chart, context) for all in `order` (largest_first()). One that holds half of all
// faces gets all threads; the others share them, one chart each.
template <typename Solve>
void for_each_chart(const std::vector<mesh::Chart>& charts, const std::vector<std::size_t>& order,
                    const char* stage, ExecutionContext& context, Solve solve) {
  double total = 0.0;
  for (const std::size_t c : order) total += static_cast<double>(charts[c].faces.size());
  const auto share_of = [&](std::size_t c) {
    return static_cast<double>(charts[c].faces.size()) / total;
  };
  std::size_t alone = 0;
  double done = 0.0;
  if (!order.empty() && share_of(order[0]) >= 0.5) {
    done = share_of(order[0]);
    const ProgressRange range(context, 0.0, done);
    solve(order[0], context);
    alone = 1;
  }
  SharedProgress progress(context, done);
  parallel_for(context, order.size() - alone, 1, [&](std::size_t i, std::size_t, std::size_t) {
    const std::size_t c = order[alone + i];
    ExecutionContext part(&context, 1, &progress, share_of(c));
    solve(c, part);
    const Grace done_with(part);
    part.report(stage, 1.0);
  });
}

inline bool any_flag(const std::vector<char>& flags) {
  return std::find(flags.begin(), flags.end(), 1) != flags.end();
}

}  // namespace flipfree::unwrap
