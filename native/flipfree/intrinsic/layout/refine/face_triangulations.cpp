#include "flipfree/intrinsic/layout/refine/face_triangulations.h"

#include <algorithm>
#include <cstdint>

#include "flipfree/base/parallel.h"

namespace flipfree::intrinsic {
namespace {

constexpr std::size_t kTriangulationsPerChunk = 4096;  // of what threads share

void set_uv(PolygonVertex& v, const Vector2& uv) {
  v.uv = {uv.x(), uv.y()};
  v.uv32 = {static_cast<float>(uv.x()), static_cast<float>(uv.y())};
}

}  // namespace

FaceTriangulations::FaceTriangulations(const mesh::Surface& input, const EdgePointMap& map)
    : input_(input),
      map_(map),
      vertex_count_(static_cast<Index>(input.vertices.rows())),
      active_(map.points.size(), 0),
      slot_(static_cast<std::size_t>(input.faces.rows()), kInvalid) {}

bool FaceTriangulations::has_points(FaceId f) const {
  for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
    const Index e = map_.edge_of[at(h)];
    if (map_.begin[at(e)] != map_.begin[at(e) + 1]) return true;
  }
  return false;
}

void FaceTriangulations::build_polygon(FaceId f, std::vector<PolygonVertex>& polygon) const {
  polygon.clear();
  const Vector3 a = input_.vertices.row(input_.faces(f, 0));
  const Vector3 b = input_.vertices.row(input_.faces(f, 1));
  const Vector3 c = input_.vertices.row(input_.faces(f, 2));
  const double length = (b - a).norm();
  const Vector3 x = (b - a) / length;
  const double along = (c - a).dot(x);
  std::array<std::array<double, 2>, 3> corner{
      {{0.0, 0.0}, {length, 0.0}, {along, ((c - a) - along * x).norm()}}};
  // Positions that have no triangle here (the metric came from given lengths): any frame will do.
  if (!(corner[1][0] * corner[2][1] > 0.0)) corner = {{{0.0, 0.0}, {1.0, 0.0}, {0.5, 0.75}}};
  for (Index k = 0; k < 3; ++k) {
    const HalfedgeId h = 3 * f + k;
    PolygonVertex v;
    v.id = input_.faces(f, k);
    v.sides = static_cast<std::uint8_t>((1u << k) | (1u << ((k + 2) % 3)));
    v.domain = corner[at(k)];
    set_uv(v, map_.corner_uv.row(h));
    polygon.push_back(v);
    const Index e = map_.edge_of[at(h)];
    const bool left = map_.edge_halfedge[at(e)] == h;
    const std::int64_t begin = map_.begin[at(e)], end = map_.begin[at(e) + 1];
    for (std::int64_t i = 0; i < end - begin; ++i) {
      const std::int64_t p = left ? begin + i : end - 1 - i;
      if (!active_[at(p)]) continue;
      const EdgePoint& point = map_.points[at(p)];
      const double from = left ? point.along.source : point.along.target;
      const double to = left ? point.along.target : point.along.source;
      const auto& s = corner[at(k)];
      const auto& t = corner[at((k + 1) % 3)];
      v.id = vertex_count_ + static_cast<Index>(p);
      v.sides = static_cast<std::uint8_t>(1u << k);
      v.domain = {from * s[0] + to * t[0], from * s[1] + to * t[1]};
      set_uv(v, left ? point.uv_left : point.uv_right);
      polygon.push_back(v);
    }
  }
}

std::array<Index, 3> FaceTriangulations::point_counts(FaceId f) const {
  std::array<Index, 3> count{};
  for (Index k = 0; k < 3; ++k) {
    const std::size_t e = at(map_.edge_of[at(3 * f + k)]);
    count[at(k)] = static_cast<Index>(map_.begin[e + 1] - map_.begin[e]);
  }
  return count;
}

std::vector<SidePlace> FaceTriangulations::places(FaceId f) const {
  std::vector<SidePlace> places;
  for (Index k = 0; k < 3; ++k) {
    const Index e = map_.edge_of[at(3 * f + k)];
    const bool left = map_.edge_halfedge[at(e)] == 3 * f + k;
    const std::int64_t begin = map_.begin[at(e)], end = map_.begin[at(e) + 1];
    places.push_back({k, 0});
    for (std::int64_t i = 0; i < end - begin; ++i) {
      if (active_[at(left ? begin + i : end - 1 - i)])
        places.push_back({k, static_cast<Index>(i) + 1});
    }
  }
  return places;
}

std::vector<FaceTriangulations::Triangle>& FaceTriangulations::triangles(FaceId f) {
  if (slot_[at(f)] == kInvalid) {
    slot_[at(f)] = static_cast<Index>(triangulations_.size());
    triangulations_.emplace_back();
    triangulations_.back().push_back({input_.faces(f, 0), input_.faces(f, 1), input_.faces(f, 2)});
  }
  return triangulations_[at(slot_[at(f)])];
}

RefinedLayout FaceTriangulations::write(const ExecutionContext& context) const {
  RefinedLayout out;
  // Vertices: the input's, then active points in order.
  out.edge_vertex.assign(map_.points.size(), kInvalid);
  Index count = vertex_count_;
  for (std::size_t p = 0; p < active_.size(); ++p) {
    if (active_[p]) out.edge_vertex[p] = count++;
  }
  write_points(out);
  write_faces(out, context);
  return out;
}

void FaceTriangulations::write_points(RefinedLayout& out) const {
  const Index count =
      vertex_count_ + static_cast<Index>(std::count(active_.begin(), active_.end(), 1));
  out.surface.vertices.resize(count, 3);
  out.surface.vertices.topRows(vertex_count_) = input_.vertices;
  std::vector<mesh::SurfacePoint>& where = out.provenance.vertex;
  where.resize(at(count));
  for (HalfedgeId h = 0; h < 3 * static_cast<Index>(input_.faces.rows()); ++h) {
    const Index v = input_.faces(h / 3, h % 3);
    if (where[at(v)].face != kInvalid) continue;
    where[at(v)].face = h / 3;
    where[at(v)].weight[h % 3] = 1.0;
  }
  for (Index e = 0; e < static_cast<Index>(map_.edge_halfedge.size()); ++e) {
    const HalfedgeId h = map_.edge_halfedge[at(e)];
    const HalfedgeId next = next_corner(h);
    for (std::int64_t p = map_.begin[at(e)]; p < map_.begin[at(e) + 1]; ++p) {
      const Index v = out.edge_vertex[at(p)];
      if (v == kInvalid) continue;
      const Between& along = map_.points[at(p)].along;
      where[at(v)].face = h / 3;
      where[at(v)].weight[h % 3] = along.source;
      where[at(v)].weight[next % 3] = along.target;
      out.surface.vertices.row(v) =
          along.source * input_.vertices.row(input_.faces(h / 3, h % 3)) +
          along.target * input_.vertices.row(input_.faces(h / 3, next % 3));
    }
  }
}

void FaceTriangulations::write_faces(RefinedLayout& out, const ExecutionContext& context) const {
  std::vector<Index> first_row(slot_.size() + 1, 0);
  for (std::size_t f = 0; f < slot_.size(); ++f) {
    const Index s = slot_[f];
    first_row[f + 1] =
        first_row[f] + (s == kInvalid ? 1 : static_cast<Index>(triangulations_[at(s)].size()));
  }
  const Index total = first_row.back();
  out.surface.faces.resize(total, 3);
  out.uv.resize(3 * total, 2);
  out.provenance.face.resize(at(total));
  const auto write_face = [&](FaceId f, std::vector<PolygonVertex>& polygon) {
    Index row = first_row[at(f)];
    if (slot_[at(f)] == kInvalid) {
      out.surface.faces.row(row) = input_.faces.row(f);
      out.uv.middleRows(3 * row, 3) = map_.corner_uv.middleRows(3 * f, 3);
      out.provenance.face[at(row)] = f;
      return;
    }
    build_polygon(f, polygon);
    for (const Triangle& t : triangulations_[at(slot_[at(f)])]) {
      for (Index k = 0; k < 3; ++k) {
        const Index id = t[at(k)];
        out.surface.faces(row, k) =
            id < vertex_count_ ? id : out.edge_vertex[at(id - vertex_count_)];
        for (const PolygonVertex& v : polygon) {
          if (v.id == id) out.uv.row(3 * row + k) = Vector2(v.uv[0], v.uv[1]);
        }
      }
      out.provenance.face[at(row++)] = f;
    }
  };
  parallel_for(context, slot_.size(), kTriangulationsPerChunk,
               [&](std::size_t begin, std::size_t end, std::size_t) {
                 std::vector<PolygonVertex> polygon;
                 for (auto f = static_cast<FaceId>(begin); f < static_cast<FaceId>(end); ++f)
                   write_face(f, polygon);
               });
}

}  // namespace flipfree::intrinsic
