#include "flipfree/unwrap/repair/patches.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <queue>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/parallel.h"
#include "flipfree/base/plane.h"
#include "flipfree/certify/measures.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/minimize/minimize.h"
#include "flipfree/distortion/untangle.h"
#include "flipfree/distortion/valid_map.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/mesh/islands.h"
#include "flipfree/unwrap/islands/islands.h"
#include "flipfree/unwrap/packing/layout.h"

namespace flipfree::unwrap {
namespace {

// So many times the energy of healthy faces is no shape that somebody wanted.
constexpr double kDrawnOutOverHealthy = 25.0;
// Beside a face that cannot stay, so many are enough.
constexpr double kDrawnOutBeside = 4.0;
// Energy up to which a face tells how large its chart was meant to be.
constexpr double kOrdinary = 10.0;

template <typename Visit>
void for_faces_around(const mesh::Adjacency& adjacency, VertexId v, Visit visit) {
  mesh::for_each_outgoing(adjacency, v, [&](HalfedgeId h) { visit(static_cast<FaceId>(h / 3)); });
}

// Flags of the vertices at exactly the same place as another one.
std::vector<char> stacked_vertices(const Points2& uv) {
  std::vector<VertexId> order(at(static_cast<Index>(uv.rows())));
  std::iota(order.begin(), order.end(), 0);
  const auto place = [&](VertexId v) { return std::pair(uv(v, 0), uv(v, 1)); };
  std::sort(order.begin(), order.end(),
            [&](VertexId a, VertexId b) { return place(a) < place(b); });
  std::vector<char> stacked(order.size(), 0);
  for (std::size_t i = 1; i < order.size(); ++i) {
    if (place(order[i]) == place(order[i - 1]))
      stacked[at(order[i])] = stacked[at(order[i - 1])] = 1;
  }
  return stacked;
}

}  // namespace

Density density_of(const mesh::Surface& surface, const Points2& uv,
                   const std::vector<char>& unknown) {
  const mesh::InOwnUnit own(surface);
  const std::vector<double> areas = face_areas(own.surface());
  std::vector<char> stacked = stacked_vertices(uv);
  for (std::size_t v = 0; v < unknown.size(); ++v) stacked[v] |= unknown[v];
  const auto usable = [&](FaceId f) {
    const auto corners = surface.faces.row(f);
    return std::none_of(corners.begin(), corners.end(),
                        [&](VertexId v) { return stacked[at(v)] != 0; });
  };
  std::vector<std::pair<double, double>> ratios;
  double total = 0.0;
  for (FaceId f = 0; f < surface.faces.rows(); ++f) {
    const double area = areas[at(f)];
    total += area;
    const double ratio = uv_area(surface.faces, uv, f) / area;
    if (ratio > 0.0 && std::isfinite(ratio) && usable(f)) ratios.emplace_back(ratio, area);
  }
  const double value = std::sqrt(weighted_percentile(std::move(ratios)));
  if (!std::isnormal(value) || !(total > 0.0)) return {};
  const std::vector<double> energies = face_energies(own.surface(), uv, value);
  double healthy = 0.0;
  for (FaceId f = 0; f < surface.faces.rows(); ++f) {
    if (energies[at(f)] <= kOrdinary && usable(f)) healthy += areas[at(f)];
  }
  return {value / own.unit(), healthy * own.unit() * own.unit(), healthy / total};
}

std::vector<double> face_energies(const mesh::Surface& surface, const Points2& uv, double density) {
  const Triangles& faces = surface.faces;
  const Points3 parts = certify::symmetric_dirichlet_parts(surface, by_corner(faces, uv));
  const double s2 = density * density;
  std::vector<double> energies(at(static_cast<Index>(faces.rows())));
  for (FaceId f = 0; f < faces.rows(); ++f) {
    const double e = 0.25 * (parts(f, 0) / s2 + parts(f, 1) * s2);
    energies[at(f)] = std::isfinite(e) ? e : std::numeric_limits<double>::infinity();
  }
  return energies;
}

Healthy healthy_energy(const std::vector<double>& area, const std::vector<double>& energies) {
  std::vector<std::pair<double, double>> finite;
  for (std::size_t f = 0; f < area.size(); ++f) {
    if (std::isfinite(energies[f])) finite.emplace_back(energies[f], area[f]);
  }
  Healthy healthy;
  healthy.median = std::max(1.0, weighted_percentile(finite));
  double sum = 0.0;
  double weight = 0.0;
  for (const auto& [energy, a] : finite) {
    if (energy > kDrawnOutOverHealthy * healthy.median) continue;
    sum += a * energy;
    weight += a;
  }
  if (weight > 0.0) healthy.mean = std::max(1.0, sum / weight);
  return healthy;
}

std::vector<char> find_damage(const DamagedChart& chart, const Points2& uv,
                              const std::vector<double>& energies, const Healthy& healthy,
                              bool spoilt, const ExecutionContext& context) {
  const Triangles& faces = chart.surface.faces;
  std::vector<char> bad(at(faces.rows()), 0);
  std::vector<char> touched(chart.unknown.size(), 0);  // vertices of faces that are not positive
  std::vector<FaceId> front;
  const auto add = [&](FaceId f) {
    if (std::exchange(bad[at(f)], 1) == 0) front.push_back(f);
  };
  for (const FaceId f : distortion::flipped_faces(faces, uv, context)) {
    for (Index k = 0; k < 3; ++k) touched[at(faces(f, k))] = 1;
    add(f);
  }
  for (FaceId f = 0; f < faces.rows(); ++f) {
    if (spoilt && energies[at(f)] > kDrawnOutOverHealthy * healthy.median) add(f);
    for (Index k = 0; k < 3; ++k) {
      if (chart.unknown[at(faces(f, k))] != 0) add(f);
    }
  }
  const std::vector<Index> quarters =
      certify::quarter_turns_around(chart.adjacency, by_corner(faces, uv));
  for (VertexId v = 0; v < static_cast<VertexId>(touched.size()); ++v) {
    const bool winds_once = quarters[at(v)] == kInvalid || quarters[at(v)] == 4;
    if (touched[at(v)] == 0 && !winds_once) for_faces_around(chart.adjacency, v, add);
  }
  std::vector<char> looked_around(touched.size(), 0);
  while (!front.empty()) {
    const FaceId f = front.back();
    front.pop_back();
    for (Index k = 0; k < 3; ++k) {
      if (std::exchange(looked_around[at(faces(f, k))], 1) != 0) continue;
      for_faces_around(chart.adjacency, faces(f, k), [&](FaceId g) {
        if (energies[at(g)] > kDrawnOutBeside * healthy.median) add(g);
      });
    }
  }
  return bad;
}

namespace {

// Rings by which a part grows, round by round; the first moves single vertices.
constexpr Index kGrowingRings[] = {0, 0, 1, 2, 4, 8, 16};
// A part may have more energy than the healthy faces' mean, or that around it, by this share of its
// own, or by that of the whole chart's.
constexpr double kOwnExcess = 0.25;
constexpr double kChartExcess = 0.01;
// What is drawn out further than so many medians is no measure for what lies beside it.
constexpr double kMostAround = 10.0;
// From this share of the chart's faces on, growing on is no smaller change than unwrapping it.
constexpr double kMostOfChart = 0.6;

// The vertices but pinned ones of the faces of a set, and of so many rings around it.
std::vector<char> free_around(const DamagedChart& chart, std::vector<char> set, Index rings) {
  const Triangles& faces = chart.surface.faces;
  std::vector<char> free(chart.pinned.size(), 0);
  for (Index ring = 0; ring <= rings; ++ring) {
    for (FaceId f = 0; f < faces.rows(); ++f) {
      for (Index k = 0; k < 3 && set[at(f)] != 0; ++k) free[at(faces(f, k))] = 1;
    }
    for (FaceId f = 0; f < faces.rows(); ++f) {
      for (Index k = 0; k < 3; ++k) set[at(f)] |= free[at(faces(f, k))];
    }
  }
  for (std::size_t v = 0; v < free.size(); ++v) free[v] = free[v] && !chart.pinned[v];
  return free;
}

struct Patch {
  mesh::Surface surface;
  std::vector<FaceId> faces;       // of the chart, ascending
  std::vector<VertexId> vertices;  // of the chart
  std::vector<char> fixed;
  std::vector<VertexId> held;  // the fixed ones
  Points2 uv;
  bool solved = false;
};

// The parts that the free vertices fall into; every face has free vertices of one part only.
std::vector<Patch> patches_of(const DamagedChart& chart, const std::vector<char>& free,
                              const Points2& uv) {
  const Triangles& faces = chart.surface.faces;
  DisjointSets parts(static_cast<Index>(free.size()));
  std::vector<VertexId> free_corner(at(faces.rows()), kInvalid);
  for (FaceId f = 0; f < faces.rows(); ++f) {
    VertexId& first = free_corner[at(f)];
    for (const VertexId v : faces.row(f)) {
      if (free[at(v)] == 0) continue;
      if (first == kInvalid) first = v;
      parts.join(v, first);
    }
  }
  std::vector<Patch> patches;
  std::vector<Index> number(free.size(), kInvalid);
  for (FaceId f = 0; f < faces.rows(); ++f) {
    if (free_corner[at(f)] == kInvalid) continue;
    Index& own = number[at(parts.find(free_corner[at(f)]))];
    if (own == kInvalid) {
      own = static_cast<Index>(patches.size());
      patches.emplace_back();
    }
    patches[at(own)].faces.push_back(f);
  }
  std::vector<Index> local(free.size(), kInvalid);
  for (Patch& patch : patches) {
    mesh::Part part = mesh::part_of(faces, patch.faces, local);
    patch.vertices = std::move(part.vertices);
    patch.surface = {chart.surface.vertices(patch.vertices, Eigen::all), std::move(part.faces)};
    patch.uv = uv(patch.vertices, Eigen::all);
    for (const VertexId v : patch.vertices) {
      if (free[at(v)] == 0) patch.held.push_back(static_cast<VertexId>(patch.fixed.size()));
      patch.fixed.push_back(free[at(v)] == 0);
    }
  }
  return patches;
}

// Free vertices between their neighbours: a start for the untangler, whatever was there before.
void even_out(Patch& patch) {
  constexpr int kSweeps = 60;
  const auto count = patch.uv.rows();
  const Eigen::RowVector2d middle =
      patch.uv(patch.held, Eigen::all).colwise().sum() / static_cast<double>(patch.held.size());
  std::vector<std::vector<Index>> neighbours(at(count));
  const Triangles& faces = patch.surface.faces;
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    for (Index k = 0; k < 3; ++k) {
      neighbours[at(faces(f, k))].push_back(faces(f, (k + 1) % 3));
      neighbours[at(faces(f, k))].push_back(faces(f, (k + 2) % 3));
    }
  }
  for (Eigen::Index v = 0; v < count; ++v) {
    if (patch.fixed[at(v)] == 0) patch.uv.row(v) = middle;
  }
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    for (Eigen::Index v = 0; v < count; ++v) {
      const auto& around = neighbours[at(v)];
      if (patch.fixed[at(v)] != 0) continue;
      Eigen::RowVector2d sum = Eigen::RowVector2d::Zero();
      for (const Index w : around) sum += patch.uv.row(w);
      patch.uv.row(v) = sum / static_cast<double>(around.size());
    }
  }
}

// Least distortion at the chart's density, from a map that is flip-free.
void relax_patch(Patch& patch, double density, ExecutionContext& context) {
  distortion::MinimizeOptions minimize;
  minimize.fixed = patch.held;
  minimize.unit = density;
  auto relaxed = attempt([&] {
    return distortion::with_own_map([&] {
      return distortion::minimize_distortion(patch.surface, patch.uv, minimize, context);
    });
  });
  if (relaxed) patch.uv = std::move(relaxed->uv);
}

bool unfold(Patch& patch, double density, ExecutionContext& context) {
  distortion::UntangleOptions options;
  options.max_iterations = 100;
  options.patience = 30;
  options.target_area = density * density * mesh::area_of(patch.surface);
  distortion::Untangler untangler(patch.surface, patch.fixed, context);
  distortion::UntangleResult result = untangler.run(patch.uv, options, context);
  if (result.flips != 0) return false;
  patch.uv = std::move(result.uv);
  return true;
}

class Mender {
 public:
  Mender(const DamagedChart& chart, Points2& uv, ExecutionContext& context)
      : chart_(chart), uv_(uv), context_(context) {}

  bool run() {
    for (std::size_t round = 0;; ++round) {
      context_.check();
      energies_ = face_energies(chart_.surface, uv_, chart_.density);
      if (round == 0) healthy_ = healthy_energy(chart_.area, energies_);
      const std::vector<char> bad = find_damage(chart_, uv_, energies_, healthy_, true, context_);
      if (!any_flag(bad)) return true;
      if (round == std::size(kGrowingRings)) return false;
      const std::vector<char> free =
          round == 0 ? cover(bad) : free_around(chart_, bad, kGrowingRings[round]);
      std::vector<Patch> patches = patches_of(chart_, free, uv_);
      // Parts that are as large as the chart come to nothing more than unwrapping it does.
      std::erase_if(patches, [&](const Patch& patch) { return !worth_it(patch, round); });
      if (patches.empty()) return false;
      solve(patches);
      for (const Patch& patch : patches) {
        if (!patch.solved) continue;
        for (std::size_t v = 0; v < patch.vertices.size(); ++v) {
          if (patch.fixed[v] != 0) continue;
          uv_.row(patch.vertices[v]) = patch.uv.row(static_cast<Eigen::Index>(v));
          chart_.unknown[at(patch.vertices[v])] = 0;
        }
      }
    }
  }

 private:
  bool worth_it(const Patch& patch, std::size_t round) const {
    return !patch.held.empty() &&
           (round == 0 || static_cast<double>(patch.faces.size()) <=
                              kMostOfChart * static_cast<double>(chart_.area.size()));
  }

  // Few vertices that are free to move, one of every bad face at least: all of them whose place is
  // a guess or another one's too; then those of most bad faces.
  std::vector<char> cover(const std::vector<char>& bad) const {
    const Triangles& faces = chart_.surface.faces;
    const std::vector<char> stacked = stacked_vertices(uv_);
    std::vector<char> chosen(stacked.size(), 0);
    std::vector<Index> count(stacked.size(), 0);
    std::vector<char> open = bad;
    for (FaceId f = 0; f < faces.rows(); ++f) {
      for (Index k = 0; k < 3 && bad[at(f)] != 0; ++k) {
        const VertexId v = faces(f, k);
        if ((stacked[at(v)] == 0 && chart_.unknown[at(v)] == 0) || chart_.pinned[at(v)] != 0)
          continue;
        chosen[at(v)] = 1;
        open[at(f)] = 0;
      }
      for (Index k = 0; k < 3 && open[at(f)] != 0; ++k) ++count[at(faces(f, k))];
    }
    std::priority_queue<std::pair<Index, VertexId>> queue;
    for (VertexId v = 0; v < static_cast<VertexId>(count.size()); ++v) {
      if (count[at(v)] > 0 && chart_.pinned[at(v)] == 0) queue.emplace(count[at(v)], v);
    }
    while (!queue.empty()) {
      const auto [rank, v] = queue.top();
      queue.pop();
      if (chosen[at(v)] != 0 || count[at(v)] == 0) continue;
      if (rank != count[at(v)]) {
        queue.emplace(count[at(v)], v);
        continue;
      }
      chosen[at(v)] = 1;
      for_faces_around(chart_.adjacency, v, [&](FaceId f) {
        if (open[at(f)] == 0) return;
        open[at(f)] = 0;
        for (Index k = 0; k < 3; ++k) --count[at(faces(f, k))];
      });
    }
    return chosen;
  }

  void solve(std::vector<Patch>& patches) {
    const auto one = [&](Patch& patch, ExecutionContext& context) {
      even_out(patch);
      if (!patch.uv.allFinite() || !unfold(patch, chart_.density, context)) return;
      relax_patch(patch, chart_.density, context);
      patch.solved = bearable(patch);
    };
    if (patches.size() == 1) return one(patches.front(), context_);
    parallel_for(context_, patches.size(), 1, [&](std::size_t i, std::size_t, std::size_t) {
      ExecutionContext part(&context_, 1);
      one(patches[i], part);
    });
  }

  // About the distortion that is around. What pins ask for is taken as it comes.
  bool bearable(const Patch& patch) const {
    for (const VertexId v : patch.vertices) {
      if (chart_.pinned[at(v)] != 0) return true;
    }
    const std::vector<double> areas = face_areas(patch.surface);
    const std::vector<double> energies = face_energies(patch.surface, patch.uv, chart_.density);
    const double usual = std::max(healthy_.mean, energy_around(patch));
    double excess = 0.0;
    double area = 0.0;
    for (std::size_t f = 0; f < energies.size(); ++f) {
      if (!(areas[f] > 0.0)) continue;
      excess += areas[f] * (energies[f] - usual);
      area += areas[f];
    }
    return excess <= usual * std::max(kOwnExcess * area, kChartExcess * area_);
  }

  // Mean of the healthy faces beside the patch; 0 without any.
  double energy_around(const Patch& patch) const {
    double sum = 0.0;
    double area = 0.0;
    for (const VertexId v : patch.held) {
      for_faces_around(chart_.adjacency, patch.vertices[at(v)], [&](FaceId f) {
        if (std::binary_search(patch.faces.begin(), patch.faces.end(), f)) return;
        if (!(energies_[at(f)] <= kMostAround * healthy_.median)) return;
        sum += chart_.area[at(f)] * energies_[at(f)];
        area += chart_.area[at(f)];
      });
    }
    return area > 0.0 ? sum / area : 0.0;
  }

  DamagedChart chart_;  // known where vertices have been placed
  const double area_ = mesh::area_of(chart_.surface);
  Points2& uv_;
  ExecutionContext& context_;
  Healthy healthy_;               // of the map that is given
  std::vector<double> energies_;  // #F, of this round's map
};

}  // namespace

bool mend_in_place(const DamagedChart& chart, Points2& uv, ExecutionContext& context) {
  return Mender(chart, uv, context).run();
}

}  // namespace flipfree::unwrap
