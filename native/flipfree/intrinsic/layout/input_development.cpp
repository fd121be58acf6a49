#include "flipfree/intrinsic/layout/input_development.h"

#include <array>
#include <cmath>
#include <utility>

namespace flipfree::intrinsic {
namespace {

// The developed angle at a corner; in faces without crossings it is that of their three places.
double corner_angle(const Development& development, CornerId c) {
  if (development.corner_angle[at(c)] != 0.0) return development.corner_angle[at(c)];
  const Place &p = development.corner[at(c)], &a = development.corner[at(next_corner(c))],
              &b = development.corner[at(previous_corner(c))];
  const long double ax = a.x - p.x, ay = a.y - p.y, bx = b.x - p.x, by = b.y - p.y;
  return static_cast<double>(std::atan2(ax * by - ay * bx, ax * bx + ay * by));
}

// Appends the points of one input edge: `h` is its half-edge.
class ChainWriter {
 public:
  ChainWriter(const FineDevelopment& fine, const SplitSurface& split, InputDevelopment& out)
      : fine_(fine), split_(split), out_(out) {}

  void write(HalfedgeId h) {
    const Index begin = split_.piece_begin[at(h)], end = split_.piece_begin[at(h) + 1];
    for (Index i = begin; i < end; ++i) {
      const double from = split_.piece_from[at(i)];
      const double to = i + 1 < end ? split_.piece_from[at(i + 1)] : 1.0;
      write_crossings(split_.piece[at(i)], from, to);
      if (i + 1 < end) write_vertex(split_.piece[at(i)], to);
    }
  }

 private:
  void write_crossings(HalfedgeId g, double from, double to) {
    const Index e = fine_.edges->of_corner[at(g)];
    const bool forward = fine_.edges->halfedge[at(e)] == g;
    const std::int64_t begin = fine_.trace->begin[at(e)], end = fine_.trace->begin[at(e) + 1];
    for (std::int64_t i = 0; i < end - begin; ++i) {
      const auto id = static_cast<std::size_t>(forward ? begin + i : end - 1 - i);
      const Between& own = fine_.positions->on_curve[id];
      const double s = forward ? own.source : own.target, t = forward ? own.target : own.source;
      out_.along.push_back({s * (1.0 - from) + t * (1.0 - to), s * from + t * to});
      const std::array<Place, 2>& sides = fine_.development->crossing[id];
      out_.development.crossing.push_back({sides[forward ? 0 : 1], sides[forward ? 1 : 0]});
    }
  }
  // The vertex at the end of piece g.
  void write_vertex(HalfedgeId g, double share) {
    const HalfedgeId o = fine_.adjacency->opposite[at(g)];
    const Place left = fine_.development->corner[at(next_corner(g))];
    const Place right = o == kInvalid ? left : fine_.development->corner[at(o)];
    out_.along.push_back({1.0 - share, share});
    out_.development.crossing.push_back({left, right});
  }

  const FineDevelopment& fine_;
  const SplitSurface& split_;
  InputDevelopment& out_;
};

}  // namespace

InputEdges number_edges(const mesh::Adjacency& adjacency) {
  InputEdges edges;
  edges.of_corner.assign(adjacency.opposite.size(), kInvalid);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(adjacency.opposite.size()); ++h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o != kInvalid && o < h) {
      edges.of_corner[at(h)] = edges.of_corner[at(o)];
    } else {
      edges.of_corner[at(h)] = static_cast<Index>(edges.halfedge.size());
      edges.halfedge.push_back(h);
    }
  }
  return edges;
}

InputDevelopment own_development(Development development, const OverlayTrace& trace,
                                 const OverlayPositions& positions) {
  return {std::move(development), trace.begin, positions.on_curve};
}

InputDevelopment composed_development(const FineDevelopment& fine, const SplitSurface& split,
                                      const InputEdges& edges) {
  const auto corner_count = static_cast<CornerId>(split.corner_begin.size()) - 1;
  InputDevelopment out;
  Development& development = out.development;
  development.chart_count = fine.development->chart_count;
  development.closing_error = fine.development->closing_error;
  development.chart_of_face.resize(at(corner_count / 3));
  development.corner.resize(at(corner_count));
  development.corner_angle.assign(at(corner_count), 0.0);
  for (CornerId c = 0; c < corner_count; ++c) {
    for (Index i = split.corner_begin[at(c)]; i < split.corner_begin[at(c) + 1]; ++i) {
      const CornerId own = split.corner[at(i)];
      development.corner[at(c)] = fine.development->corner[at(own)];
      development.corner_angle[at(c)] += corner_angle(*fine.development, own);
      development.chart_of_face[at(c / 3)] = fine.development->chart_of_face[at(own / 3)];
    }
  }
  ChainWriter writer(fine, split, out);
  out.begin.push_back(0);
  for (const HalfedgeId h : edges.halfedge) {
    writer.write(h);
    out.begin.push_back(static_cast<std::int64_t>(out.along.size()));
  }
  return out;
}

}  // namespace flipfree::intrinsic
