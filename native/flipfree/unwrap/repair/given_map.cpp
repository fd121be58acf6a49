#include "flipfree/unwrap/repair/given_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
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

// A place that only faces have which are flipped, collapsed, or drawn out more than 4 times as far
// as the map's median, becomes the next one's around its vertex, not across an edge of `seams` (may
// be empty), if that makes all of these faces as good as others. uv: 3 #F x 2, finite. Cost: O(#F
// log #F).
class Rejoining {
 public:
  Rejoining(const mesh::Surface& surface, const mesh::EdgeFlags& seams, Points2& uv)
      : surface_(surface), adjacency_(surface.adjacency()), seams_(seams), uv_(uv) {}

  // Corners with a flag in `fixed` (3 #F) stay. Returns how many were joined.
  Index run(const std::vector<char>& fixed) {
    find_limit();
    if (!(scale_ > 0.0)) return 0;
    const mesh::CutMesh cut =
        mesh::cut_along(surface_.faces, adjacency_, mesh::uv_cuts(adjacency_, uv_));
    const VertexId* const place_of = cut.faces.data();  // per corner
    const auto corner_count = static_cast<CornerId>(surface_.faces.size());
    std::vector<char> stray(cut.vertex_origin.size(), 1);
    for (CornerId c = 0; c < corner_count; ++c) {
      if (energies_[at(c / 3)] <= limit_ || fixed[at(c)] != 0) stray[at(place_of[c])] = 0;
    }
    const Lists<CornerId> corners(stray.size(), [&](const auto& add) {
      for (CornerId c = 0; c < corner_count; ++c)
        if (stray[at(place_of[c])] != 0) add(place_of[c], c);
    });
    std::vector<CornerId> beside;
    for (VertexId place = 0; place < corners.size(); ++place)
      beside.push_back(better_beside(corners[place], stray, place_of));
    const Points2 before = uv_;
    for (VertexId place = 0; place < corners.size(); ++place) {
      for (const CornerId c : corners[place])
        if (beside[at(place)] != kInvalid) uv_.row(c) = before.row(beside[at(place)]);
    }
    take_back(corners, place_of, before, beside);
    Index joined = 0;
    for (VertexId place = 0; place < corners.size(); ++place)
      if (beside[at(place)] != kInvalid) joined += static_cast<Index>(corners[place].size());
    return joined;
  }

 private:
  // A corner at the place beside, seen from the first or from the last corner of a stray one, with
  // which its faces come out better.
  CornerId better_beside(std::span<const CornerId> corners, const std::vector<char>& stray,
                         const VertexId* place_of) {
    std::array<CornerId, 2> found{kInvalid, kInvalid};
    for (const CornerId c : corners) {
      for (const HalfedgeId h : {c, previous_corner(c)}) {
        const HalfedgeId opposite = adjacency_.opposite[at(h)];
        if (opposite == kInvalid || (!seams_.empty() && seams_[at(h)] != 0)) continue;
        const CornerId other = h == c ? next_corner(opposite) : opposite;
        if (stray[at(place_of[other])] == 0) found[h == c] = other;
      }
    }
    if (found[0] == kInvalid || found[1] == kInvalid) {
      const CornerId only = found[found[0] == kInvalid];
      const auto is_there = [&](CornerId c) { return uv_.row(c) == uv_.row(only); };
      return only == kInvalid || std::ranges::any_of(corners, is_there) ? kInvalid : only;
    }
    std::array<double, 2> worst{0.0, 0.0};
    for (const std::size_t i : {0u, 1u}) {
      for (const CornerId c : corners) {
        const Eigen::RowVector2d own = uv_.row(c);
        // What is where a neighbour is was cut off by what happened elsewhere.
        if (uv_.row(found[i]) == own) return kInvalid;
        uv_.row(c) = uv_.row(found[i]);
        worst[i] = std::max(worst[i], energy_now(c / 3));
        uv_.row(c) = own;
      }
    }
    return found[worst[1] < worst[0]];
  }

  // Places whose faces are not good now either go back, which may spoil others: round by round
  // those of the faces that changed in the one before.
  void take_back(const Lists<CornerId>& corners, const VertexId* place_of, const Points2& before,
                 std::vector<CornerId>& beside) {
    std::vector<FaceId> changed;
    for (VertexId place = 0; place < corners.size(); ++place)
      for (const CornerId c : corners[place]) changed.push_back(c / 3);
    while (!changed.empty()) {
      sort_unique(changed);
      std::vector<VertexId> back;
      for (const FaceId f : changed) {
        if (!(energy_now(f) > limit_)) continue;
        for (CornerId c = 3 * f; c < 3 * f + 3; ++c) back.push_back(place_of[c]);
      }
      changed.clear();
      for (const VertexId place : back) {
        if (std::exchange(beside[at(place)], kInvalid) == kInvalid) continue;
        for (const CornerId c : corners[place]) {
          uv_.row(c) = before.row(c);
          changed.push_back(c / 3);
        }
      }
    }
  }

  void find_limit() {
    const Points3 parts = certify::symmetric_dirichlet_parts(surface_, uv_);
    std::vector<std::pair<double, double>> ratios, finite;
    for (FaceId f = 0; f < parts.rows(); ++f) {
      // |J|^2 / |J^-1|^2 is the square of the determinant.
      const double ratio = std::sqrt(parts(f, 0) / parts(f, 1));
      if (std::isnormal(ratio)) ratios.emplace_back(ratio, parts(f, 2));
    }
    scale_ = weighted_percentile(std::move(ratios));
    for (FaceId f = 0; f < parts.rows(); ++f) {
      energies_.push_back(energy_of(parts.row(f)));
      if (std::isfinite(energies_.back())) finite.emplace_back(energies_.back(), parts(f, 2));
    }
    limit_ = kDrawnOutOverMedian * weighted_percentile(std::move(finite));
  }

  double energy_of(const Eigen::RowVector3d& parts) const {
    const double energy = 0.25 * (parts[0] / scale_ + parts[1] * scale_);
    return std::isfinite(energy) ? energy : std::numeric_limits<double>::infinity();
  }

  // With its places as they are now.
  double energy_now(FaceId f) const {
    mesh::Surface one{Points3(3, 3), Triangles{{0, 1, 2}}};
    for (Index k = 0; k < 3; ++k) one.vertices.row(k) = surface_.vertices.row(surface_.faces(f, k));
    return energy_of(certify::symmetric_dirichlet_parts(one, uv_.middleRows(3 * f, 3)).row(0));
  }

  const mesh::Surface& surface_;
  const mesh::Adjacency& adjacency_;
  const mesh::EdgeFlags& seams_;
  Points2& uv_;
  std::vector<double> energies_;  // #F, of the map that is given
  double scale_ = 0.0;            // UV area per area
  double limit_ = 0.0;            // of the energy of a good face
};

// Gives corners without a value that of one beside them at their vertex, as read_map() says, or
// else what is a guess: flags of these.
std::vector<char> complete(const mesh::Surface& surface, const mesh::EdgeFlags& seams,
                           Points2& uv) {
  const Triangles& faces = surface.faces;
  const mesh::Adjacency& adjacency = surface.adjacency();
  const auto count = static_cast<CornerId>(uv.rows());
  std::vector<char> given(at(count));
  std::vector<char> placed(adjacency.vertex_halfedge.size(), 0);  // some corner of it is given
  std::vector<CornerId> known;
  for (CornerId c = 0; c < count; ++c) {
    given[at(c)] = is_storable(uv.row(c).transpose());
    placed[at(faces.data()[c])] |= given[at(c)];
    if (given[at(c)] != 0) known.push_back(c);
  }
  std::vector<char> guessed(given.size(), 0);
  if (known.size() == given.size()) return guessed;
  // Calls visit(corner, goes_on) for the corners beside one at its vertex, but across seams and
  // edges whose other end has two places. goes_on: that end tells that the map does; where it has
  // no place at all, nothing denies it.
  const auto for_beside = [&](CornerId corner, auto visit) {
    for (const HalfedgeId h : {corner, previous_corner(corner)}) {
      const HalfedgeId o = adjacency.opposite[at(h)];
      if (o == kInvalid || (!seams.empty() && seams[at(h)] != 0)) continue;
      const CornerId here = h == corner ? next_corner(h) : h;  // at the other end
      const CornerId there = h == corner ? o : next_corner(o);
      const bool both = given[at(here)] != 0 && given[at(there)] != 0;
      if (both && uv.row(here) != uv.row(there)) continue;
      visit(h == corner ? next_corner(o) : o, both || placed[at(faces.data()[here])] == 0);
    }
  };
  std::vector<char> has = given;
  for (std::size_t i = 0; i < known.size(); ++i) {
    const CornerId c = known[i];
    for_beside(c, [&](CornerId beside, bool goes_on) {
      if (!goes_on || has[at(beside)] != 0) return;
      uv.row(beside) = uv.row(c);
      has[at(beside)] = 1;
      known.push_back(beside);
    });
  }
  // What hangs together without a value goes to the mean of the given corners of its faces.
  DisjointSets runs(count);
  Points2 sum = Points2::Zero(count, 2);
  std::vector<double> terms(given.size(), 0.0);
  const auto for_unknown = [&](auto visit) {
    for (CornerId c = 0; c < count; ++c)
      if (has[at(c)] == 0) visit(c);
  };
  for_unknown([&](CornerId c) {
    for_beside(c, [&](CornerId beside, bool) {
      if (has[at(beside)] == 0) runs.join(c, beside);
    });
  });
  for_unknown([&](CornerId c) {
    for (const CornerId other : {next_corner(c), previous_corner(c)}) {
      if (given[at(other)] == 0) continue;
      sum.row(runs.find(c)) += uv.row(other);
      terms[at(runs.find(c))] += 1.0;
    }
  });
  for_unknown([&](CornerId c) {
    uv.row(c) = sum.row(runs.find(c)) / std::max(terms[at(runs.find(c))], 1.0);
    guessed[at(c)] = 1;
  });
  return guessed;
}

}  // namespace

GivenMap read_map(const mesh::Surface& surface, const Points2& corner_uv,
                  const mesh::EdgeFlags& seams, const std::vector<certify::CornerPin>& pins) {
  const mesh::Adjacency& adjacency = surface.adjacency();
  GivenMap map;
  map.uv = corner_uv;
  std::vector<char> guessed = complete(surface, seams, map.uv);
  certify::require_corners(pins, static_cast<Index>(surface.faces.size()));
  std::vector<char> fixed(guessed.size(), 0);
  for (const certify::CornerPin& pin : pins) fixed[at(pin.corner)] = 1;
  const Points2 completed = map.uv;
  map.rejoined = Rejoining(surface, seams, map.uv).run(fixed);
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
  map.pins = pins_of_charts(map.charts, pins, static_cast<Index>(surface.faces.size()));
  for (std::size_t c = 0; c < map.charts.size(); ++c) {
    for (const auto& [v, uv] : map.pins[c]) {
      map.places[c].row(v) = uv.transpose();
      map.unknown[c][at(v)] = 0;
    }
  }
  return map;
}

std::vector<Points2> on_texture(std::vector<Points2> places, double aspect) {
  for (Points2& own : places) own = certify::on_texture(own, aspect);
  return places;
}

VertexPins on_texture(VertexPins pins, double aspect) {
  for (auto& [v, place] : pins) place = certify::on_texture(place, aspect);
  return pins;
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
