#include "flipfree/unwrap/repair/given/rejoin.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "flipfree/certify/measures.h"
#include "flipfree/unwrap/repair/patches/damage.h"

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
    std::vector<std::size_t> first(beside.size() + 1, 0);  // of each place in own_corners
    for (const CornerId c : corners) ++first[place_of(c) + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<CornerId> own_corners(corners.size());
    std::vector<std::size_t> next(first.begin(), first.end() - 1);
    for (const CornerId c : corners) own_corners[next[place_of(c)]++] = c;
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
        for (std::size_t i = first[place]; i < first[place + 1]; ++i) {
          uv_.row(own_corners[i]) = before.row(own_corners[i]);
          changed.push_back(own_corners[i] / 3);
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

}  // namespace

Index rejoin_torn(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                  const mesh::EdgeFlags& seams, const std::vector<char>& fixed, Points2& uv) {
  return Rejoining(surface, adjacency, seams, uv).run(fixed);
}

}  // namespace flipfree::unwrap
