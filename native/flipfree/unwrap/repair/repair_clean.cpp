#include "flipfree/unwrap/repair/repair_clean.h"

#include <algorithm>
#include <cstdint>
#include <set>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/parallel.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/certify/texture.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "flipfree/unwrap/repair/given/given_map.h"
#include "flipfree/unwrap/repair/mend_chart.h"
#include "flipfree/unwrap/repair/places/one_scale.h"
#include "flipfree/unwrap/repair/settle.h"
#include "flipfree/unwrap/repair/stretched_islands.h"
#include "flipfree/unwrap/unwrap.h"

namespace flipfree::unwrap {
namespace {

class Repair {
 public:
  Repair(const mesh::Surface& surface, const Points2& corner_uv, const RepairOptions& options,
         ExecutionContext& context)
      : surface_(surface),
        options_(options),
        context_(context),
        adjacency_(
            mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces)),
        seams_(mesh::flag_edges(surface.faces, adjacency_, options.cuts)),
        uncuttable_(options.uncuttable.rows() == 0
                        ? mesh::EdgeFlags{}
                        : mesh::flag_edges(surface.faces, adjacency_, options.uncuttable)),
        given_(read_map(surface, adjacency_, corner_uv, seams_, options.pins)),
        seen_(on_texture(given_, options.aspect)),
        density_(common_density(given_.charts, seen_.places)),
        mended_(given_.charts.size()),
        anew_(given_.charts.size(), 0) {
    measure_before(surface, given_, corner_uv, options.aspect, stats_, context);
    corner_uv_ = &corner_uv;
  }

  // Charts whose stored map does not hold are made anew, and again settled with the others; where
  // that does not hold either, all of them.
  certify::Parametrization run() {
    try {
      return mended_map();
    } catch (const NotConverged&) {
      if (!options_.pins.empty()) throw;
    }
    return all_anew();
  }

 private:
  // Of the given map only its cuts count. An unwrap cuts further around what cannot be stored.
  certify::Parametrization all_anew() {
    UnwrapOptions unwrapping;
    unwrapping.cuts = mesh::flagged_edges(surface_.faces, adjacency_, given_.cuts);
    unwrapping.uncuttable = options_.uncuttable;
    unwrapping.bijective = options_.overlaps != SelfOverlaps::kKeep;
    unwrapping.may_add_cuts = options_.overlaps != SelfOverlaps::kOpen;
    unwrapping.margin = options_.margin;
    unwrapping.max_iterations = options_.max_iterations;
    unwrapping.tolerance = options_.tolerance;
    certify::Parametrization map = unwrap(surface_, unwrapping, context_);
    const StatValue added = map.stats["added_cuts"];
    if (options_.aspect != 1.0) {
      // Narrower, or lower, in the unit square; stored and judged as any given map.
      map.uv.col(0) /= options_.aspect;
      map.uv *= std::min(options_.aspect, 1.0);
      map = Repair(surface_, Points2(map.uv), options_, context_).mended_map();
    }
    std::erase_if(map.stats, [](const auto& entry) {
      return !std::set<std::string>{"charts", "added_cuts", "energy", "max_energy"}.contains(
          entry.first);
    });
    map.stats.insert(stats_.begin(), stats_.end());  // of the map before
    const auto charts = std::get<std::int64_t>(map.stats["charts"]);
    for (const char* name : {"charts_anew", "charts_moved"}) map.stats[name] = charts;
    for (const char* name : {"charts_mirrored", "charts_unfolded", "charts_cut", "charts_improved",
                             "charts_stretched_anew", "stretched_charts", "corners_kept"})
      map.stats[name] = std::int64_t{0};
    map.stats["added_vertices"] = std::int64_t{0};
    map.stats["added_cuts"] = added;
    return map;
  }

  certify::Parametrization mended_map() {
    std::vector<char> wanted(given_.charts.size(), 1);
    while (true) {
      {
        const ProgressRange range(context_, 0.05, 0.85);
        mend(wanted);
      }
      context_.report("placing charts", 0.86);
      collect();
      const ProgressRange range(context_, 0.86, 0.95);
      settled_ = settle(charts_, to_settle_, sized_, options_, context_);
      wanted.assign(wanted.size(), 0);
      for (const std::size_t c : settled_.unstorable) want_anew(c, wanted);
      if (std::find(wanted.begin(), wanted.end(), 1) != wanted.end()) continue;
      if (!settled_.unstorable.empty()) throw_unstorable();
      certify::Parametrization map = finished();
      for (const FaceId f : map.certificate.failed_faces) want_anew(chart_of_face_[at(f)], wanted);
      if (map.certificate.ok || std::find(wanted.begin(), wanted.end(), 1) == wanted.end()) {
        certify::require_certificate(map, "The repaired map");
        return map;
      }
    }
  }

  // c: a chart of the result. That of the given map which it comes from is made anew, once.
  void want_anew(std::size_t c, std::vector<char>& wanted) {
    const std::size_t given = source_[c];
    if (anew_[given] != 0 || mended_[given].change == Change::kAnew) return;
    wanted[given] = anew_[given] = 1;
  }

  [[noreturn]] void throw_unstorable() const {
    const mesh::Chart& chart = charts_[settled_.unstorable.front()];
    throw_not_converged(ErrorCode::kRoundingFlips,
                        "The chart of face " + std::to_string(chart.faces.front()) +
                            " has triangles too small for the 32 bits that are stored. Enlarge it, "
                            "or mark seams that cut its long and thin parts off.",
                        ElementKind::kFace, {chart.faces.front()});
  }

  void mend_one(std::size_t c, ExecutionContext& context) {
    const ChartToMend chart{given_.charts[c],
                            given_.vertex_origin,
                            seen_.places[c],
                            given_.unknown[c],
                            seen_.pins[c],
                            own_flags(seams_, given_.charts[c]),
                            own_flags(uncuttable_, given_.charts[c]),
                            density_};
    mended_[c] = mend_chart(chart, options_, anew_[c] != 0, context);
    judge_stretched(chart, options_, mended_[c], context);
  }

  // The largest chart alone if it is half of everything, the others side by side.
  void mend(const std::vector<char>& wanted) {
    const std::vector<mesh::Chart>& charts = given_.charts;
    std::vector<std::size_t> order;
    std::size_t total = 0;
    for (std::size_t c = 0; c < charts.size(); ++c) {
      if (wanted[c] == 0) continue;
      order.push_back(c);
      total += charts[c].faces.size();
    }
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return charts[a].faces.size() > charts[b].faces.size();
    });
    const auto share = [&](std::size_t c) {
      return static_cast<double>(charts[c].faces.size()) / static_cast<double>(total);
    };
    std::size_t alone = 0;
    double done = 0.0;
    if (2 * charts[order[0]].faces.size() >= total) {
      done = share(order[0]);
      const ProgressRange range(context_, 0.0, done);
      mend_one(order[0], context_);
      alone = 1;
    }
    SharedProgress progress(context_, done);
    parallel_for(context_, order.size() - alone, 1, [&](std::size_t i, std::size_t, std::size_t) {
      const std::size_t c = order[alone + i];
      ExecutionContext part(&context_, 1, &progress, share(c));
      mend_one(c, part);
      part.report("mending charts", 1.0);
    });
  }

  // The charts of the result, from the mended ones and their further cuts.
  void collect() {
    const std::size_t corners = 3 * at(static_cast<Index>(surface_.faces.rows()));
    uv_.resize(static_cast<Eigen::Index>(corners), 2);
    mesh::EdgeFlags cuts = given_.cuts;
    std::vector<Place> place(corners / 3, Place::kStays);
    std::vector<char> remade(corners / 3);
    std::vector<std::size_t> given_chart(corners / 3);
    sized_ = true;
    Points2 before;  // that stretched islands were made better
    for (const MendedChart& mended : mended_) {
      if (mended.before.rows() > 0) before.resize(uv_.rows(), 2);
    }
    for (std::size_t c = 0; c < mended_.size(); ++c) {
      const mesh::Chart& chart = given_.charts[c];
      const Points2& own_before = mended_[c].before.rows() > 0 ? mended_[c].before : mended_[c].uv;
      sized_ = sized_ && mended_[c].has_density;
      for (std::size_t h = 0; h < 3 * chart.faces.size(); ++h) {
        const std::size_t corner = 3 * at(chart.faces[h / 3]) + h % 3;
        const auto stored_place = [&](const Points2& uv) {
          return certify::row_from_texture(uv.row(static_cast<Eigen::Index>(h)), options_.aspect,
                                           given_.places[c].row(chart.surface.faces.data()[h]));
        };
        uv_.row(static_cast<Eigen::Index>(corner)) = stored_place(mended_[c].uv);
        if (before.rows() > 0)
          before.row(static_cast<Eigen::Index>(corner)) = stored_place(own_before);
        if (!mended_[c].cut.empty()) cuts[corner] |= mended_[c].cut[h];
        place[corner / 3] = mended_[c].place[h / 3];
        remade[corner / 3] = mended_[c].remade[h / 3];
        given_chart[corner / 3] = c;
      }
    }
    cuts_ = std::move(cuts);
    charts_ = mesh::split_into_charts(surface_.vertices,
                                      mesh::cut_along(surface_.faces, adjacency_, cuts_));
    chart_of_face_.resize(corners / 3);
    source_.clear();
    to_settle_.clear();
    for (std::size_t c = 0; c < charts_.size(); ++c) {
      const mesh::Chart& chart = charts_[c];
      ChartToSettle& own = to_settle_.emplace_back();
      source_.push_back(given_chart[at(chart.faces.front())]);
      own.place = place[at(chart.faces.front())];
      own.uv.resize(chart.surface.vertices.rows(), 2);
      const bool improved = mended_[source_.back()].before.rows() > 0;
      if (improved) own.before.resize(own.uv.rows(), 2);
      for (std::size_t h = 0; h < 3 * chart.faces.size(); ++h) {
        const std::size_t corner = 3 * at(chart.faces[h / 3]) + h % 3;
        const VertexId v = chart.surface.faces.data()[h];
        own.uv.row(v) = uv_.row(static_cast<Eigen::Index>(corner));
        if (improved) own.before.row(v) = before.row(static_cast<Eigen::Index>(corner));
        chart_of_face_[corner / 3] = c;
      }
    }
    for (const certify::CornerPin& pin : options_.pins) {
      const std::size_t c = chart_of_face_[at(pin.corner / 3)];
      const mesh::Chart& chart = charts_[c];
      const auto f = std::lower_bound(chart.faces.begin(), chart.faces.end(), pin.corner / 3) -
                     chart.faces.begin();
      to_settle_[c].pinned.push_back(chart.surface.faces(f, pin.corner % 3));
    }
    if (options_.stretched == StretchedIslands::kImprove && sized_) take_one_scale(remade);
    parallel_for(context_, charts_.size(), 16,
                 [&](std::size_t begin, std::size_t end, std::size_t) {
                   const ExecutionContext part(&context_, 1);
                   for (std::size_t c = begin; c < end; ++c) {
                     const Triangles& faces = charts_[c].surface.faces;
                     const Points2& uv = to_settle_[c].uv;
                     to_settle_[c].bijective = !distortion::overlaps_itself(
                         distortion::find_boundary(static_cast<Index>(uv.rows()), faces), uv, part);
                   }
                 });
  }

  // Where most of what stands has one scale. remade: per face.
  void take_one_scale(const std::vector<char>& remade) {
    std::vector<Points2> seen;
    seen.reserve(charts_.size());
    std::vector<ScaledChart> scaled;
    for (std::size_t c = 0; c < charts_.size(); ++c) {
      const mesh::Chart& chart = charts_[c];
      seen.push_back(certify::on_texture(to_settle_[c].uv, options_.aspect));
      scaled.push_back({&chart.surface, &seen.back(), remade[at(chart.faces.front())] != 0});
    }
    const std::vector<double> factors = to_one_scale(scaled);
    for (std::size_t c = 0; c < charts_.size(); ++c) {
      if (factors[c] == 1.0) continue;
      const Points2& uv = to_settle_[c].uv;
      const Eigen::RowVector2d middle = uv.colwise().mean();
      Points2 other = (factors[c] * (uv.rowwise() - middle)).rowwise() + middle;
      if (distortion::is_flip_free(charts_[c].surface.faces, other, context_))
        to_settle_[c].uv = std::move(other);
    }
  }

  certify::Parametrization finished() {
    const Untimed finishing(context_);
    context_.report("certifying", 0.95);
    certify::Parametrization map;
    map.surface = surface_;
    map.stats = stats_;
    map.uv.resize(uv_.rows(), 2);
    map.uv32.resize(uv_.rows(), 2);
    for (std::size_t c = 0; c < charts_.size(); ++c) {
      const mesh::Chart& chart = charts_[c];
      for (std::size_t h = 0; h < 3 * chart.faces.size(); ++h) {
        const auto corner = static_cast<Eigen::Index>(3 * at(chart.faces[h / 3]) + h % 3);
        map.uv.row(corner) = settled_.uv[c].row(chart.surface.faces.data()[h]);
        map.uv32.row(corner) = settled_.stored[c].row(chart.surface.faces.data()[h]);
      }
    }
    map.cut_edges = mesh::flagged_edges(surface_.faces, adjacency_, cuts_);
    certify::set_identity_provenance(map);
    certify::CertifyRequest request;
    request.pins = options_.pins;
    request.require_bijective = options_.overlaps != SelfOverlaps::kKeep;
    request.require_disjoint = options_.disjoint && options_.pins.empty();
    request.aspect = options_.aspect;
    certify::certify_map(map, surface_, request, context_);
    count(map);
    return map;
  }

  void count(certify::Parametrization& map) const {
    Stats& stats = map.stats;
    const auto changed = [&](Change change) {
      return static_cast<std::int64_t>(
          std::count_if(mended_.begin(), mended_.end(),
                        [&](const MendedChart& chart) { return chart.change == change; }));
    };
    stats["charts"] = static_cast<std::int64_t>(charts_.size());
    stats["charts_mirrored"] = changed(Change::kMirrored);
    stats["charts_unfolded"] = changed(Change::kUnfolded);
    stats["charts_anew"] = changed(Change::kAnew);
    stats["charts_cut"] = static_cast<std::int64_t>(std::count_if(
        mended_.begin(), mended_.end(), [](const MendedChart& chart) { return chart.was_cut; }));
    const auto stretched = [&](std::int64_t StretchedPieces::*count) {
      std::int64_t sum = 0;
      for (const MendedChart& chart : mended_) sum += chart.stretched.*count;
      return sum;
    };
    stats["charts_improved"] = stretched(&StretchedPieces::improved);
    stats["charts_stretched_anew"] = stretched(&StretchedPieces::anew);
    stats["stretched_charts"] = stretched(&StretchedPieces::left);
    stats["charts_moved"] =
        static_cast<std::int64_t>(std::count(settled_.moved.begin(), settled_.moved.end(), 1));
    stats["added_cuts"] =
        static_cast<std::int64_t>(std::count(cuts_.begin(), cuts_.end(), 1) -
                                  std::count(given_.cuts.begin(), given_.cuts.end(), 1)) /
        2;
    std::int64_t kept = 0;
    for (Eigen::Index c = 0; c < map.uv.rows(); ++c) kept += map.uv.row(c) == corner_uv_->row(c);
    stats["corners_kept"] = kept;
    stats["energy"] = map.certificate.energy;
    stats["max_energy"] = map.certificate.max_energy;
    stats["added_vertices"] = std::int64_t{0};
  }

  const mesh::Surface& surface_;
  const RepairOptions& options_;
  ExecutionContext& context_;
  const mesh::Adjacency adjacency_;
  const mesh::EdgeFlags seams_;
  const mesh::EdgeFlags uncuttable_;
  const GivenMap given_;
  const SeenMap seen_;
  const double density_;
  const Points2* corner_uv_ = nullptr;
  Stats stats_;
  std::vector<MendedChart> mended_;
  std::vector<char> anew_;  // per given chart: it was not storable otherwise
  // The result.
  Points2 uv_;
  mesh::EdgeFlags cuts_;
  std::vector<mesh::Chart> charts_;
  std::vector<ChartToSettle> to_settle_;
  std::vector<std::size_t> source_;  // per chart: of the given map
  std::vector<std::size_t> chart_of_face_;
  bool sized_ = true;
  SettledCharts settled_;
};

}  // namespace

certify::Parametrization repair_clean(const mesh::Surface& surface, const Points2& corner_uv,
                                      const RepairOptions& options, ExecutionContext& context) {
  return Repair(surface, corner_uv, options, context).run();
}

}  // namespace flipfree::unwrap
