#include "flipfree/unwrap/repair/given/given_map.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/certify/measures.h"
#include "flipfree/certify/texture.h"
#include "flipfree/unwrap/repair/given/rejoin.h"

namespace flipfree::unwrap {
namespace {

// Corners around vertices, and what is known about their places.
class Corners {
 public:
  Corners(const Triangles& faces, const mesh::Adjacency& adjacency, const mesh::EdgeFlags& seams,
          Points2& uv)
      : faces_(faces),
        adjacency_(adjacency),
        seams_(seams),
        uv_(uv),
        given_(at(static_cast<Index>(uv.rows()))),
        placed_(adjacency.vertex_halfedge.size(), 0) {
    for (CornerId c = 0; c < static_cast<CornerId>(uv.rows()); ++c) {
      given_[at(c)] = is_storable(uv.row(c).transpose());
      placed_[at(faces.data()[c])] |= given_[at(c)];
    }
  }

  // Flags of the corners whose value is only a guess.
  std::vector<char> complete() {
    std::vector<char> guessed(given_.size(), 0);
    if (std::find(given_.begin(), given_.end(), 0) == given_.end()) return guessed;
    for (const HalfedgeId start : adjacency_.vertex_halfedge) {
      if (start == kInvalid) continue;
      for (const Sector& sector : sectors(start)) {
        for (const std::vector<CornerId>& rest : spread(sector)) {
          guess(rest);
          for (const CornerId c : rest) guessed[at(c)] = 1;
        }
      }
    }
    return guessed;
  }

 private:
  // Corners around a vertex counter-clockwise.
  struct Sector {
    std::vector<CornerId> corners;
    bool closed = false;  // the first follows the last
  };

  // A seam, or an edge into the vertex whose other end is known to have two places.
  bool parted_across(HalfedgeId h) const {
    const HalfedgeId opposite = adjacency_.opposite[at(h)];
    if (opposite == kInvalid) return true;
    if (!seams_.empty() && seams_[at(h)] != 0) return true;
    const CornerId here = h;
    const CornerId there = next_corner(opposite);
    return given_[at(here)] != 0 && given_[at(there)] != 0 && uv_.row(here) != uv_.row(there);
  }

  // The corners around a vertex, parted where it may have two places.
  std::vector<Sector> sectors(HalfedgeId start) const {
    std::vector<Sector> result(1);
    HalfedgeId h = start;
    bool closed = false;
    do {
      result.back().corners.push_back(h);
      const bool seam = parted_across(previous_corner(h));
      h = mesh::rotate_ccw(adjacency_, h);
      closed = h == start;
      if (seam && h != kInvalid && !closed) result.emplace_back();
      if (!closed || seam) continue;
      if (result.size() == 1) {
        result.front().closed = true;
      } else {
        std::vector<CornerId>& first = result.front().corners;
        const std::vector<CornerId>& last = result.back().corners;
        first.insert(first.begin(), last.begin(), last.end());
        result.pop_back();
      }
    } while (h != kInvalid && !closed);
    return result;
  }

  // Is it known from the other end of the edge between two corners that follow each other around
  // a vertex whether the map goes on there? Where that end has no place at all, nothing denies it.
  bool goes_on(CornerId corner, CornerId next) const {
    const CornerId here = previous_corner(corner);
    const CornerId there = next_corner(next);
    return (given_[at(here)] != 0 && given_[at(there)] != 0) ||
           placed_[at(faces_.data()[here])] == 0;
  }

  // Values to the corners beside them where the map goes on; the runs of those that got none.
  std::vector<std::vector<CornerId>> spread(const Sector& sector) {
    std::vector<CornerId> corners = sector.corners;
    if (sector.closed) {
      // From a known one all around and to it again.
      const auto known = std::find_if(corners.begin(), corners.end(),
                                      [&](CornerId c) { return given_[at(c)] != 0; });
      if (known == corners.end()) return {corners};
      std::rotate(corners.begin(), known, corners.end());
      corners.push_back(corners.front());
    }
    const std::size_t count = corners.size();
    std::vector<char> known;
    for (const CornerId c : corners) known.push_back(given_[at(c)]);
    const auto take = [&](std::size_t to, std::size_t from) {
      const bool goes = goes_on(corners[std::min(to, from)], corners[std::max(to, from)]);
      if (known[to] != 0 || known[from] == 0 || !goes) return;
      uv_.row(corners[to]) = uv_.row(corners[from]);
      known[to] = 1;
    };
    for (std::size_t i = 1; i < count; ++i) take(i, i - 1);
    for (std::size_t i = count; i-- > 1;) take(i - 1, i);
    std::vector<std::vector<CornerId>> rest;
    for (std::size_t i = 0; i < count; ++i) {
      if (known[i] != 0) continue;
      if (i == 0 || known[i - 1] != 0) rest.emplace_back();
      rest.back().push_back(corners[i]);
    }
    return rest;
  }

  void guess(const std::vector<CornerId>& sector) {
    Eigen::RowVector2d sum = Eigen::RowVector2d::Zero();
    double count = 0;
    for (const CornerId c : sector) {
      for (const CornerId other : {next_corner(c), previous_corner(c)}) {
        if (given_[at(other)] == 0) continue;
        sum += uv_.row(other);
        count += 1;
      }
    }
    if (count > 0) sum /= count;
    for (const CornerId c : sector) uv_.row(c) = sum;
  }

  const Triangles& faces_;
  const mesh::Adjacency& adjacency_;
  const mesh::EdgeFlags& seams_;
  Points2& uv_;
  std::vector<char> given_;   // per corner: it came with a value
  std::vector<char> placed_;  // per vertex: some corner of it did
};

// Pins at the charts' vertices.
void assign_pins(const std::vector<certify::CornerPin>& pins, Index corners, GivenMap& map) {
  map.pins.resize(map.charts.size());
  if (pins.empty()) return;
  certify::require_storable_pins(pins, corners);
  std::vector<std::pair<std::size_t, VertexId>> place(at(corners));
  for (std::size_t c = 0; c < map.charts.size(); ++c) {
    const mesh::Chart& chart = map.charts[c];
    for (std::size_t h = 0; h < 3 * chart.faces.size(); ++h)
      place[3 * at(chart.faces[h / 3]) + h % 3] = {c, chart.surface.faces.data()[h]};
  }
  for (const certify::CornerPin& pin : pins) {
    const auto [c, v] = place[at(pin.corner)];
    map.pins[c].emplace_back(v, pin.uv);
  }
  for (std::size_t c = 0; c < map.charts.size(); ++c) {
    auto& own = map.pins[c];
    std::stable_sort(own.begin(), own.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    for (std::size_t i = 1; i < own.size(); ++i) {
      if (own[i].first != own[i - 1].first || own[i].second == own[i - 1].second) continue;
      throw_invalid(ErrorCode::kBadPins,
                    "Two corners that share one place in the map are pinned to different places. "
                    "Unpin one of them.");
    }
    own.erase(std::unique(own.begin(), own.end(),
                          [](const auto& a, const auto& b) { return a.first == b.first; }),
              own.end());
    for (const auto& [v, uv] : own) {
      map.places[c].row(v) = uv.transpose();
      map.unknown[c][at(v)] = 0;
    }
  }
}

}  // namespace

GivenMap read_map(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                  const Points2& corner_uv, const mesh::EdgeFlags& seams,
                  const std::vector<certify::CornerPin>& pins) {
  GivenMap map;
  map.uv = corner_uv;
  std::vector<char> guessed = Corners(surface.faces, adjacency, seams, map.uv).complete();
  std::vector<char> fixed;
  if (!pins.empty()) {
    certify::require_corners(pins, static_cast<Index>(surface.faces.size()));
    fixed.assign(guessed.size(), 0);
    for (const certify::CornerPin& pin : pins) fixed[at(pin.corner)] = 1;
  }
  const Points2 completed = map.uv;
  map.rejoined = rejoin_torn(surface, adjacency, seams, fixed, map.uv);
  for (CornerId c = 0; c < static_cast<CornerId>(guessed.size()); ++c) {
    if (map.uv.row(c) != completed.row(c)) guessed[at(c)] = 0;  // it has a neighbour's now
  }
  map.cuts = mesh::uv_cuts(adjacency, map.uv);
  mesh::CutMesh cut = mesh::cut_along(surface.faces, adjacency, map.cuts);
  map.charts = mesh::split_into_charts(surface.vertices, cut);
  map.vertex_origin = std::move(cut.vertex_origin);
  for (const mesh::Chart& chart : map.charts) {
    const Eigen::Index vertices = chart.surface.vertices.rows();
    Points2& places = map.places.emplace_back(vertices, 2);
    std::vector<char>& unknown = map.unknown.emplace_back(at(static_cast<Index>(vertices)), 0);
    for (std::size_t h = 0; h < 3 * chart.faces.size(); ++h) {
      const std::size_t corner = 3 * at(chart.faces[h / 3]) + h % 3;
      const VertexId v = chart.surface.faces.data()[h];
      places.row(v) = map.uv.row(static_cast<Eigen::Index>(corner));
      unknown[at(v)] |= guessed[corner];
    }
  }
  assign_pins(pins, static_cast<Index>(surface.faces.size()), map);
  return map;
}

mesh::EdgeFlags own_flags(const mesh::EdgeFlags& flags, const mesh::Chart& chart) {
  if (flags.empty()) return {};
  mesh::EdgeFlags own(3 * chart.faces.size());
  for (std::size_t h = 0; h < own.size(); ++h) own[h] = flags[3 * at(chart.faces[h / 3]) + h % 3];
  return own;
}

SeenMap on_texture(const GivenMap& map, double aspect) {
  SeenMap seen{map.places, map.pins};
  if (aspect == 1.0) return seen;
  for (Points2& places : seen.places) places = certify::on_texture(places, aspect);
  for (auto& pins : seen.pins) {
    for (auto& [v, place] : pins) place = certify::on_texture(place, aspect);
  }
  return seen;
}

void measure_before(const mesh::Surface& surface, const GivenMap& map, const Points2& corner_uv,
                    double aspect, Stats& stats, const ExecutionContext& context) {
  // A face without a place counts as flipped; nothing else can be said about it.
  const Points2 finite = corner_uv.unaryExpr([](double x) { return std::isfinite(x) ? x : 0.0; });
  certify::CertifyRequest request;
  request.surface = &surface;
  request.uv = &finite;
  request.aspect = aspect;
  const certify::Certificate before = certify::certify(request, context);
  std::int64_t lost = 0;
  for (Eigen::Index c = 0; c < corner_uv.rows(); ++c)
    lost += !is_storable(corner_uv.row(c).transpose());
  const auto flips = static_cast<std::int64_t>(certify::flipped_faces(corner_uv).size());
  stats["flips_before"] = flips;
  stats["winding_failures_before"] = before.winding_failures;
  stats["overlaps_before"] = before.overlaps;
  stats["island_overlaps_before"] = before.island_overlaps;
  stats["energy_before"] = flips > 0 ? std::numeric_limits<double>::infinity() : before.energy;
  stats["corners_without_place"] = lost;
  stats["corners_rejoined"] = static_cast<std::int64_t>(map.rejoined);
}

}  // namespace flipfree::unwrap
