#include "flipfree/unwrap/repair/given_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/lists.h"
#include "flipfree/base/plane.h"
#include "flipfree/certify/measures.h"
#include "flipfree/certify/texture.h"
#include "flipfree/unwrap/islands/islands.h"
#include "flipfree/unwrap/repair/patches.h"

namespace flipfree::unwrap {
namespace {

constexpr double kDrawnOutOverMedian = 4.0;

class Rejoining {
 public:
  Rejoining(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
            const mesh::EdgeFlags& seams, Points2& uv)
      : surface_(surface), adjacency_(adjacency), seams_(seams), uv_(uv) {}

  Index run(const std::vector<char>& fixed) {
    find_limit();
    if (!(scale_ > 0.0)) return 0;
    const mesh::CutMesh cut =
        mesh::cut_along(surface_.faces, adjacency_, mesh::uv_cuts(adjacency_, uv_));
    const std::vector<char> good = good_faces();
    const std::size_t places = cut.vertex_origin.size();
    std::vector<char> stray(places, 1);
    for (CornerId c = 0; c < static_cast<CornerId>(surface_.faces.size()); ++c) {
      if (good[at(c / 3)] != 0 || (!fixed.empty() && fixed[at(c)] != 0))
        stray[at(cut.faces.data()[c])] = 0;
    }
    // The places beside, seen from the first and the last corner of each stray one.
    std::vector<std::array<CornerId, 2>> candidates(places, {kInvalid, kInvalid});
    std::vector<CornerId> corners;
    for (CornerId c = 0; c < static_cast<CornerId>(surface_.faces.size()); ++c) {
      const VertexId place = cut.faces.data()[c];
      if (stray[at(place)] == 0) continue;
      corners.push_back(c);
      for (const HalfedgeId h : {c, previous_corner(c)}) {
        const HalfedgeId opposite = adjacency_.opposite[at(h)];
        if (opposite == kInvalid || (!seams_.empty() && seams_[at(h)] != 0)) continue;
        const CornerId other = h == c ? next_corner(opposite) : opposite;
        if (stray[at(cut.faces.data()[other])] == 0) candidates[at(place)][h == c] = other;
      }
    }
    std::vector<CornerId> beside = chosen(corners, candidates, cut);
    const Points2 before = uv_;
    for (const CornerId c : corners) {
      const CornerId other = beside[at(cut.faces.data()[c])];
      if (other != kInvalid) uv_.row(c) = before.row(other);
    }
    return taken_back(corners, beside, cut, before);
  }

 private:
  // Places whose faces are not good now either go back, which may spoil others: round by round
  // those of the faces that changed in the one before.
  Index taken_back(const std::vector<CornerId>& corners, std::vector<CornerId>& beside,
                   const mesh::CutMesh& cut, const Points2& before) {
    const auto place_of = [&](CornerId c) { return at(cut.faces.data()[c]); };
    const Lists<CornerId> corners_at(beside.size(), [&](const auto& add) {
      for (const CornerId c : corners) add(cut.faces.data()[c], c);
    });
    std::vector<FaceId> changed;
    for (const CornerId c : corners) {
      if (changed.empty() || changed.back() != c / 3) changed.push_back(c / 3);
    }
    while (!changed.empty()) {
      std::vector<std::size_t> back;
      for (const FaceId f : changed) {
        if (!(energy_now(f) > limit_)) continue;
        for (CornerId c = 3 * f; c < 3 * f + 3; ++c) {
          if (beside[place_of(c)] != kInvalid) back.push_back(place_of(c));
        }
      }
      changed.clear();
      for (const std::size_t place : back) {
        if (std::exchange(beside[place], kInvalid) == kInvalid) continue;
        for (const CornerId c : corners_at[static_cast<Index>(place)]) {
          uv_.row(c) = before.row(c);
          changed.push_back(c / 3);
        }
      }
    }
    return static_cast<Index>(std::count_if(corners.begin(), corners.end(), [&](CornerId c) {
      return beside[place_of(c)] != kInvalid;
    }));
  }

  void find_limit() {
    parts_ = certify::symmetric_dirichlet_parts(surface_, uv_);
    std::vector<std::pair<double, double>> ratios;
    for (FaceId f = 0; f < surface_.faces.rows(); ++f) {
      // |J|^2 / |J^-1|^2 is the square of the determinant.
      const double ratio = std::sqrt(parts_(f, 0) / parts_(f, 1));
      if (std::isnormal(ratio)) ratios.emplace_back(ratio, parts_(f, 2));
    }
    scale_ = weighted_median(std::move(ratios));
    std::vector<std::pair<double, double>> energies;
    for (FaceId f = 0; f < surface_.faces.rows(); ++f) {
      const double energy = energy_of(f);
      if (std::isfinite(energy)) energies.emplace_back(energy, parts_(f, 2));
    }
    limit_ = kDrawnOutOverMedian * weighted_median(std::move(energies));
  }

  double energy_of(FaceId f) const {
    return 0.25 * (parts_(f, 0) / scale_ + parts_(f, 1) * scale_);
  }

  std::vector<char> good_faces() const {
    std::vector<char> good(at(static_cast<Index>(surface_.faces.rows())));
    for (FaceId f = 0; f < surface_.faces.rows(); ++f) good[at(f)] = energy_of(f) <= limit_;
    return good;
  }

  // Of two candidates that with which the faces of the place come out best.
  std::vector<CornerId> chosen(const std::vector<CornerId>& corners,
                               const std::vector<std::array<CornerId, 2>>& candidates,
                               const mesh::CutMesh& cut) {
    std::vector<CornerId> beside(candidates.size(), kInvalid);
    std::vector<std::array<double, 2>> worst(candidates.size(), {0.0, 0.0});
    for (const CornerId c : corners) {
      const std::size_t place = at(cut.faces.data()[c]);
      if (candidates[place][0] == kInvalid || candidates[place][1] == kInvalid) continue;
      const Eigen::RowVector2d own = uv_.row(c);
      for (const std::size_t i : {0u, 1u}) {
        uv_.row(c) = uv_.row(candidates[place][i]);
        worst[place][i] = std::max(worst[place][i], energy_now(c / 3));
      }
      uv_.row(c) = own;
    }
    for (const CornerId c : corners) {
      const std::size_t place = at(cut.faces.data()[c]);
      const auto& [first, second] = candidates[place];
      // What is where a neighbour is was cut off by what happened elsewhere.
      const auto same = [&](CornerId other) {
        return other != kInvalid && uv_.row(other) == uv_.row(c);
      };
      if (same(first) || same(second)) continue;
      const bool take_second =
          first == kInvalid || (second != kInvalid && worst[place][1] < worst[place][0]);
      beside[place] = take_second ? second : first;
    }
    return beside;
  }

  // With its places as they are now.
  double energy_now(FaceId f) const {
    mesh::Surface one;
    one.vertices.resize(3, 3);
    for (Index k = 0; k < 3; ++k) one.vertices.row(k) = surface_.vertices.row(surface_.faces(f, k));
    one.faces.resize(1, 3);
    one.faces << 0, 1, 2;
    const Points3 parts = certify::symmetric_dirichlet_parts(one, uv_.middleRows(3 * f, 3));
    const double energy = 0.25 * (parts(0, 0) / scale_ + parts(0, 1) * scale_);
    return std::isfinite(energy) ? energy : std::numeric_limits<double>::infinity();
  }

  const mesh::Surface& surface_;
  const mesh::Adjacency& adjacency_;
  const mesh::EdgeFlags& seams_;
  Points2& uv_;
  Points3 parts_;
  double scale_ = 0.0;  // UV area per area
  double limit_ = 0.0;  // of the energy of a good face
};

// A place that only faces have which are flipped, collapsed, or drawn out more than 4 times as far
// as the map's median, becomes the next one's around its vertex, not across an edge of `seams` (may
// be empty), if that makes all of these faces as good as others. Corners with a flag in `fixed`
// (3 #F, may be empty) stay. uv: 3 #F x 2, finite. Returns how many corners were joined. Cost: O(#F
// log #F).
Index rejoin_torn(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                  const mesh::EdgeFlags& seams, const std::vector<char>& fixed, Points2& uv) {
  return Rejoining(surface, adjacency, seams, uv).run(fixed);
}

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
    map.places.push_back(by_vertex(chart, map.uv));
    std::vector<char>& unknown = map.unknown.emplace_back(at(vertices), 0);
    for (std::size_t h = 0; h < corner_count(chart); ++h)
      unknown[at(chart.surface.faces.data()[h])] |= guessed[corner_of(chart, h)];
  }
  assign_pins(pins, static_cast<Index>(surface.faces.size()), map);
  return map;
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
